//! `lpv thesis`: the tables and figures of the thesis from fresh computations, in one page.

mod comparison;
mod errata;
mod numbers;
mod pendulum;
mod phase_plane;
mod quadrotor;
mod responses;
mod saturated_integrator;

use crate::failure::Failure;
use crate::figure::{Figure, STYLE, escaped};
use crate::folder::ResultFolder;
use crate::output::print;
use clap::Args;
use comparison::Table;
use errata::{Erratum, errata};
use quadrotor::Fleet;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Arguments of `lpv thesis`.
#[derive(Args)]
pub struct ThesisArguments {
    /// Folder for the report and its figures
    #[arg(long, short, default_value = "out/thesis")]
    out: PathBuf,
    /// Replace an earlier result
    #[arg(long)]
    force: bool,
    /// Print the tables as JSON instead of text
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Record<'a> {
    tables: &'a [Table],
    errata: &'a [Erratum],
    figures: Vec<&'static str>,
}

/// Compute everything and write it.
pub fn run(arguments: &ThesisArguments) -> Result<(), Failure> {
    let started = Instant::now();
    let folder = ResultFolder::begin(&arguments.out, arguments.force)?;
    let vehicle = || {
        let fleet = Fleet::new()?;
        let (figures, numbers) = rayon::join(|| quadrotor::figures(&fleet), || numbers::chapter(&fleet));
        Ok::<_, Failure>((figures?, numbers?))
    };
    let ((pendulum, integrator), vehicle) =
        rayon::join(|| rayon::join(pendulum::chapter, saturated_integrator::chapter), vehicle);
    let ((table_4, figures_4), (table_5, figures_5), (mut figures, table_6)) = (pendulum?, integrator?, vehicle?);
    let later = figures.split_off(1);
    figures.extend(figures_4.into_iter().chain(figures_5).chain(later));
    let tables = [table_4, table_5, table_6];
    let errata = errata(&tables);
    let seconds = started.elapsed().as_secs_f64();

    for figure in &figures {
        folder.write(&figure.file_name(), figure.svg(true).as_bytes())?;
    }
    folder.write("report.html", page(&tables, &errata, &figures, seconds).as_bytes())?;
    let record =
        Record { tables: &tables, errata: &errata, figures: figures.iter().map(|figure| figure.number).collect() };
    let json = serde_json::to_string_pretty(&record).map_err(|error| Failure::serialisation(&error))?;
    folder.write("tables.json", json.as_bytes())?;
    let place = folder.finish()?;
    if arguments.json {
        print(&json)
    } else {
        let text: String = tables.iter().map(text).collect();
        print(&format!("{text}{} in {seconds:.1} s", place.join("report.html").display()))
    }
}

fn text(table: &Table) -> String {
    let mut text = format!("Table {}: {}\n", table.number, table.title);
    for entry in &table.entries {
        text.push_str(&format!(
            "  {:46} {:26} thesis {:>9}  right {:>11}  {}\n",
            entry.row,
            entry.quantity,
            entry.shown_printed(),
            entry.shown(),
            entry.standing.words()
        ));
    }
    text.push('\n');
    text
}

const PAGE_STYLE: &str = include_str!("thesis/page.css");

fn page(tables: &[Table], errata: &[Erratum], figures: &[Figure], seconds: f64) -> String {
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>The thesis, recomputed</title>\n<style>{PAGE_STYLE}{STYLE}</style>\n<main>\n<h1>The thesis, recomputed</h1>\n\
         <p>Every table and figure of A. Serirojanakul, “Output feedback control of quad-rotor helicopter using linear parameter-varying method with saturation \
         constraints” (Chulalongkorn University), computed anew by lpv {} in {seconds:.1} s. Where the thesis printed something else, it is shown beside the right \
         value with the reason. Figures 6.1 to 6.3 show the thesis's software and have no counterpart.</p>\n",
        env!("CARGO_PKG_VERSION")
    );
    for table in tables {
        html.push_str(&format!(
            "<h2 id=\"table-{0}\">Table {0}: {1}</h2>\n<p>{2}</p>\n<div class=\"wide\"><table>\n<tr><th>Row<th>Quantity<th>Thesis<th>Right<th>What it is<th>Why they differ</tr>\n",
            table.number,
            escaped(&table.title),
            escaped(&table.setting)
        ));
        for entry in &table.entries {
            let class = match entry.agrees() {
                Some(true) => "same",
                Some(false) => "differs",
                None => "alone",
            };
            html.push_str(&format!(
                "<tr class=\"{class}\"><td>{}<td>{}<td class=\"number\">{}<td class=\"number\">{}<td>{}<td>{}</tr>\n",
                escaped(&entry.row),
                entry.quantity,
                entry.shown_printed(),
                entry.shown(),
                entry.standing.words(),
                escaped(&entry.reason)
            ));
        }
        html.push_str("</table></div>\n");
    }
    html.push_str("<h2 id=\"errata\">Errata</h2>\n<div class=\"wide\"><table>\n<tr><th>Where<th>Thesis printed<th>Right is</tr>\n");
    for Erratum { place, printed, right } in errata {
        html.push_str(&format!("<tr><td>{}<td>{}<td>{}</tr>\n", escaped(place), escaped(printed), escaped(right)));
    }
    html.push_str("</table></div>\n<h2 id=\"figures\">Figures</h2>\n");
    for figure in figures {
        html.push_str(&format!(
            "<figure id=\"figure-{0}\">\n<div class=\"wide\">{1}</div>\n<figcaption><b>Figure {0}: {2}.</b> {3}</figcaption>\n</figure>\n",
            figure.number,
            figure.svg(false),
            escaped(&figure.title),
            escaped(&figure.caption)
        ));
    }
    html.push_str("</main>\n</html>\n");
    html
}
