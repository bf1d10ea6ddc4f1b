//! Arrows between modules: which module names which, and that no circle of files grows.
//!
//! A file has an arrow to each file that defines something which its code names (see `modules`). On two levels:
//!
//! * top-level modules of each crate: every arrow stands in [`TABLE`], whose rows use only rows above them, and
//!   ARCHITECTURE.md shows that table;
//! * files: no circles, but those of [`KNOWN`], which may only become fewer. *A type stands in its own file, what drives it in
//!   another, on top*: a `mod.rs` that passes on what its children define is on top of them, so that a type they need is not
//!   to be defined in it.

mod graph;
mod modules;
mod on_small_sources;
mod table;

use graph::{Arrows, circles, within};
use modules::{Code, Named, Sources};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use table::{KNOWN, Known, Row, TABLE};

/// Crates in the order in which they use each other, with their root files.
const ROOTS: [(&str, &str); 3] =
    [("lmi", "lmi/src/lib.rs"), ("lpv", "lpv/src/lib.rs"), ("lpv-cli", "lpv-cli/src/main.rs")];
const BEGIN: &str = "<!-- arrows: written by crates/lpv-cli/tests/it/arrows.rs -->\n";
const END: &str = "<!-- arrows: end -->\n";

fn crates() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let files = entries.flat_map(|path| if path.is_dir() { rust_files(&path) } else { vec![path] });
    files.filter(|path| path.extension().is_some_and(|extension| extension == "rs")).collect()
}

fn workspace() -> (Sources, Code, Named) {
    let crates = crates();
    let files = ROOTS.iter().flat_map(|(name, _)| rust_files(&crates.join(name).join("src")));
    let name = |path: &Path| {
        let parts = path.strip_prefix(&crates).unwrap().iter().map(|part| part.to_str().unwrap());
        parts.collect::<Vec<_>>().join("/")
    };
    let sources: Sources = files.map(|path| (name(&path), fs::read_to_string(&path).unwrap())).collect();
    let code = Code::read(&sources, &ROOTS);
    let named = code.named();
    (sources, code, named)
}

/// Crate and top-level module of a file; a crate's root is `lib.rs` or `main.rs`.
fn module_of(file: &str) -> (&str, &str) {
    let (name, inside) = file.split_once("/src/").unwrap();
    if ROOTS.contains(&(name, file)) {
        return (name, inside);
    }
    let first = inside.split('/').next().unwrap();
    (name, first.strip_suffix(".rs").unwrap_or(first))
}

/// What each top-level module uses: modules of its crate, and other crates as a whole.
fn uses_of_modules<'n>(
    arrows: impl IntoIterator<Item = &'n (String, String)>,
) -> BTreeMap<(&'n str, &'n str), BTreeSet<&'n str>> {
    let mut uses: BTreeMap<(&str, &str), BTreeSet<&str>> = BTreeMap::new();
    for (from, to) in arrows {
        let (user, (to_crate, to_module)) = (module_of(from), module_of(to));
        let used = if user.0 == to_crate { to_module } else { to_crate };
        if user != (to_crate, to_module) {
            uses.entry(user).or_default().insert(used);
        }
    }
    uses
}

/// How the arrows of modules differ from a table, and which of the table's own go down.
fn against_table(arrows: &Arrows, known: &Arrows, table: &[(&str, &[Row])]) -> Vec<String> {
    let mut wrong = Vec::new();
    let uses = uses_of_modules(arrows);
    let rows = || table.iter().flat_map(|&(name, rows)| rows.iter().map(move |row| (name, row)));
    for (&(name, module), used) in &uses {
        let row = rows().find(|(crate_name, row)| *crate_name == name && row.module == module);
        let allowed = row.map_or(&[][..], |(_, row)| row.uses);
        for used in used.iter().filter(|used| !allowed.contains(used)) {
            wrong.push(format!("{name}: {module} uses {used}, which the table does not allow"));
        }
    }
    for (name, row) in rows() {
        let used = uses.get(&(name, row.module));
        for allowed in row.uses.iter().filter(|allowed| !used.is_some_and(|used| used.contains(*allowed))) {
            wrong.push(format!("{name}: {} does not use {allowed} any more: take it out of the table", row.module));
        }
    }
    let upward = uses_of_modules(arrows.difference(known));
    for &(name, rows) in table {
        for (k, row) in rows.iter().enumerate() {
            let below = rows[k..]
                .iter()
                .filter(|other| upward.get(&(name, row.module)).is_some_and(|used| used.contains(other.module)));
            for other in below {
                wrong.push(format!("{name}: {} uses {}, which stands below it in the table", row.module, other.module));
            }
        }
    }
    wrong
}

/// All arrows but those to names from outside that the root of the same crate passes on: it is no module.
fn used(named: &Named) -> Arrows {
    let is_own_root = |from: &str, to: &str| ROOTS.contains(&(module_of(from).0, to));
    let passed_on = named.passed_on.iter().filter(|(from, to)| !is_own_root(from, to));
    named.arrows.iter().chain(passed_on).cloned().collect()
}

fn known_arrows(known: &[Known]) -> Arrows {
    let all = known.iter().flat_map(|known| known.against);
    all.map(|(from, to)| (from.to_string(), to.to_string())).collect()
}

/// Circles that are not known, and known ones that are none any more.
fn against_known(arrows: &Arrows, known: &[Known]) -> Vec<String> {
    let known = known_arrows(known);
    let mut wrong = Vec::new();
    let left: Arrows = arrows.difference(&known).cloned().collect();
    for circle in circles(&left) {
        let arrows = within(&left, &circle).into_iter().map(|(from, to)| format!("\n    {from} -> {to}"));
        wrong.push(format!("a circle of files:{}", arrows.collect::<String>()));
    }
    for (from, to) in &known {
        let arrow = (from.clone(), to.clone());
        let is_in_circle = || {
            let with = left.iter().cloned().chain([arrow.clone()]).collect();
            circles(&with).iter().any(|circle| circle.contains(from) && circle.contains(to))
        };
        if !arrows.contains(&arrow) || !is_in_circle() {
            wrong.push(format!("{from} -> {to} closes no circle any more: take it out of the list"));
        }
    }
    wrong
}

fn assert_none(wrong: &[String]) {
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The table as ARCHITECTURE.md shows it.
fn shown(table: &[(&str, &[Row])]) -> String {
    let rows = table.iter().flat_map(|&(name, rows)| rows.iter().map(move |row| (name, row)));
    let line = |(name, row): (&str, &Row)| format!("| {name} | `{}` | {} |\n", row.module, row.uses.join(", "));
    format!("| crate | module | uses |\n|---|---|---|\n{}", rows.map(line).collect::<String>())
}

#[test]
fn every_file_is_read_and_every_path_is_found() {
    let (sources, code, named) = workspace();
    let read: BTreeSet<&String> = code.files.union(&code.test_files).collect();
    let unread: Vec<String> = sources.keys().filter(|file| !read.contains(file)).cloned().collect();
    assert_none(&unread);
    assert_none(&named.lost);
    assert!(code.files.len() > 200 && named.arrows.len() > 1000, "the code is not where this test looks");
}

#[test]
fn modules_use_what_the_table_allows() {
    let (_, _, named) = workspace();
    assert_none(&against_table(&used(&named), &known_arrows(KNOWN), TABLE));
}

#[test]
fn files_go_in_no_circles_but_those_that_are_known() {
    let (_, _, named) = workspace();
    assert_none(&against_known(&named.arrows, KNOWN));
    assert!(KNOWN.iter().all(|known| !known.why.is_empty()));
}

#[test]
fn architecture_shows_the_table() {
    let text = fs::read_to_string(crates().join("../ARCHITECTURE.md")).unwrap();
    let (_, rest) = text.split_once(BEGIN).expect("the first marker");
    let (now, _) = rest.split_once(END).expect("the second marker");
    let shown = shown(TABLE);
    assert!(now == shown, "paste into ARCHITECTURE.md, between the markers:\n{shown}");
}

#[test]
fn solver_is_known_to_synthesis_only_and_simulation_never_designs() {
    let (_, _, named) = workspace();
    let arrows = used(&named);
    for ((name, module), used) in uses_of_modules(&arrows) {
        if name == "lpv" {
            assert!(module == "synthesis" || !used.contains("lmi"), "{module} uses the solver");
            assert!(module != "sim" || !used.contains("synthesis"), "sim designs");
        }
    }
}

#[test]
fn dense_linear_algebra_is_named_in_math_only() {
    let (_, _, named) = workspace();
    let mut users: BTreeSet<(&str, &str)> = BTreeSet::new();
    users.extend(named.outside.iter().filter(|(_, to)| to == "faer").map(|(from, _)| module_of(from)));
    assert!(users.remove(&("lpv", "math")), "the crate has another name");
    let others: Vec<_> = users.iter().filter(|(name, _)| *name != "lmi").collect();
    assert!(others.is_empty(), "{others:?}");
}
