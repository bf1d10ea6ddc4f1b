//! Problems with `method = "induced-l2"`: a bound on the induced L2 norm of an LPV system with a bounded parameter rate.

use crate::failure::Failure;
use crate::problem::file::Matrices;
use crate::scenario::door::Door;
use crate::scenario::file::toml_message;
use lpv::certificate::{Claim, Verdict, prove_gain};
use lpv::math::Mat;
use lpv::math::decimal::about;
use lpv::math::matrix::{from_rows, is_finite, to_rows};
use lpv::model::{BasisFunction, MatrixFunction};
use lpv::synthesis::bounded_real::{GainOptions, InputOutputModel, induced_gain};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Instant;

const METHOD: &str = "induced-l2";
/// Degree of P(ρ) and grid points where the file does not say.
const DEGREE: u32 = 3;
const GRID_POINTS: usize = 10;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GainFile {
    model: ModelTable,
    design: GainTable,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelTable {
    #[serde(rename = "A")]
    a: Matrices,
    #[serde(rename = "B")]
    b: Matrices,
    #[serde(rename = "C")]
    c: Matrices,
    #[serde(rename = "D")]
    d: Option<Matrices>,
    range: Option<[f64; 2]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GainTable {
    #[serde(rename = "method")]
    _method: String,
    rate_bound: Option<f64>,
    lyapunov_order: Option<u32>,
    grid_points: Option<usize>,
}

/// What `--json` prints.
#[derive(Serialize)]
pub struct GainReport {
    status: &'static str,
    /// γ of the inequality on the grid.
    gain: f64,
    /// What is proved between the grid points.
    claim: Claim,
    verdict: Verdict,
    rate_bound: Option<f64>,
    /// P(ρ) = Σ ρᵏ Pₖ.
    #[serde(rename = "P")]
    p: Vec<Vec<Vec<f64>>>,
    iterations: usize,
    seconds: f64,
}

impl GainReport {
    /// A bound that holds on the grid alone is none.
    pub fn failure(&self, file: &Path) -> Option<Failure> {
        let missed = || {
            let Self { claim, verdict, .. } = self;
            let message = "between the grid points the bound is";
            Failure::NotCertified(format!("{}: {message} {} ({})", file.display(), verdict.word(), claim.detail))
        };
        (self.verdict != Verdict::Proved).then(missed)
    }

    /// The answer as text.
    pub fn text(&self) -> String {
        format!(
            "status           {}\ngain on the grid {}\n{}: {} ({})\niterations       {} in {:.4} s\n",
            self.status,
            about(self.gain),
            self.verdict.word(),
            self.claim.claim,
            self.claim.detail,
            self.iterations,
            self.seconds
        )
    }
}

/// Whether the text of a problem file asks for this analysis.
pub fn is_gain(text: &str) -> bool {
    let method = |table: toml::Table| Some(table.get("design")?.get("method")?.as_str()? == METHOD);
    toml::from_str(text).ok().and_then(method) == Some(true)
}

/// Read the problem, bound the norm on the grid, prove it between the points.
pub fn solve(path: &Path, text: &str) -> Result<GainReport, Failure> {
    let door = Door { file: path };
    let file: GainFile = toml::from_str(text)
        .map_err(|error| Failure::Unreadable { file: path.to_owned(), message: toml_message(text, &error) })?;
    let [low, high] = file.model.range.unwrap_or([0.0, 1.0]);
    if !(low < high && low.is_finite() && high.is_finite()) {
        return door.refuse("model.range", format!("is [{low}, {high}]: it has to ascend"));
    }
    let function = |key: &str, given: &Matrices| function(&door, key, given, [low, high]);
    let (a, b, c) =
        (function("model.A", &file.model.a)?, function("model.B", &file.model.b)?, function("model.C", &file.model.c)?);
    let ((n, m), outputs) = (b.shape(), c.shape().0);
    let d = match &file.model.d {
        Some(d) => function("model.D", d)?,
        None => MatrixFunction::constant(Mat::zeros(outputs, m)),
    };
    for (key, (rows, columns), expected) in
        [("model.A", a.shape(), (n, n)), ("model.C", c.shape(), (outputs, n)), ("model.D", d.shape(), (outputs, m))]
    {
        if (rows, columns) != expected {
            let message =
                format!("is {rows} × {columns}: with this B and C it has to be {} × {}", expected.0, expected.1);
            return door.refuse(key, message);
        }
    }
    let GainTable { rate_bound, lyapunov_order, grid_points, .. } = file.design;
    if let Some(rate) = rate_bound.filter(|rate| !(*rate >= 0.0 && rate.is_finite())) {
        return door.refuse(
            "design.rate_bound",
            format!("is {rate}: it has to be finite, zero or more; leave it out for any rate"),
        );
    }
    let degree = lyapunov_order.unwrap_or(DEGREE);
    let count = grid_points.unwrap_or(GRID_POINTS);
    if degree > 10 {
        return door.refuse("design.lyapunov_order", format!("is {degree}: allowed are 0 to 10"));
    }
    if !(2..=512).contains(&count) {
        return door.refuse("design.grid_points", format!("is {count}: allowed are 2 to 512"));
    }
    let model = InputOutputModel { a, b, c, d, range: [low, high] };
    let started = Instant::now();
    let options = GainOptions { rate: rate_bound, degree, grid_points: count };
    let bound = induced_gain(&model, &options)
        .map_err(|source| Failure::Synthesis { controller: path.display().to_string(), source })?;
    let claim = prove_gain(&model, &bound);
    Ok(GainReport {
        status: "solved",
        gain: bound.gain,
        verdict: claim.verdict,
        claim,
        rate_bound,
        p: bound.p.coefficients.iter().map(to_rows).collect(),
        iterations: bound.iterations,
        seconds: started.elapsed().as_secs_f64(),
    })
}

/// One matrix is constant; of two, M(ρ) goes from the first to the second over the range.
fn function(door: &Door, key: &str, given: &Matrices, [low, high]: [f64; 2]) -> Result<MatrixFunction, Failure> {
    let matrix = |rows: &Vec<Vec<f64>>| {
        let width = rows.first().map_or(0, Vec::len);
        if width == 0 || rows.iter().any(|row| row.len() != width) {
            return door.refuse(key, "has to be rows of equally many numbers");
        }
        let matrix = from_rows(rows);
        if is_finite(&matrix) { Ok(matrix) } else { door.refuse(key, "has an entry that is not finite") }
    };
    let each = match given {
        Matrices::One(rows) => return Ok(MatrixFunction::constant(matrix(rows)?)),
        Matrices::Each(each) => each,
    };
    match each.as_slice() {
        [one] => Ok(MatrixFunction::constant(matrix(one)?)),
        [first, last] => {
            let (first, last) = (matrix(first)?, matrix(last)?);
            if (first.nrows(), first.ncols()) != (last.nrows(), last.ncols()) {
                return door.refuse(key, "has matrices of two sizes");
            }
            let (rows, columns) = (first.nrows(), first.ncols());
            let slope = Mat::from_fn(rows, columns, |i, j| (last[(i, j)] - first[(i, j)]) / (high - low));
            let constant = Mat::from_fn(rows, columns, |i, j| first[(i, j)] - low * slope[(i, j)]);
            Ok(MatrixFunction { basis: BasisFunction::powers(0, 1), coefficients: vec![constant, slope] })
        }
        more => door.refuse(key, format!("has {} matrices: give one, or two for the ends of the range", more.len())),
    }
}
