//! Designs over a polytope of matrices: what `lpv design PROBLEM.toml --json` prints, or a file written by hand with K and P
//! from elsewhere.

use crate::failure::Failure;
use crate::scenario::door::Door;
use crate::scenario::engineers_words;
use lpv::certificate::{
    Claim, MOST_CELLS, Member, PolytopicClaim, PolytopicLyapunov, Record, RecordError, ScheduledClaim, prove_polytopic,
    prove_scheduled,
};
use lpv::math::Mat;
use lpv::math::decimal::about;
use lpv::math::definite::{Definiteness, asymmetry, definiteness, smallest_eigenvalue_about};
use lpv::math::matrix::{from_rows, identity, is_finite};
use lpv::model::tensor_product::TensorProductSchedule;
use lpv::model::{ModelSource, Polytope};
use lpv::synthesis::CostWeights;
use lpv::synthesis::polytopic::InputBounds;
use serde::{Deserialize, Serialize};

type Rows = Vec<Vec<f64>>;
/// Relative difference of what a file says twice: inverses are no better.
const REPEATED: f64 = 1e-6;
/// Relative size of what the sum of a rate vertex may be.
const TOLERANCE: f64 = 1e-9;

/// The status of a file whose design is one.
pub const SOLVED: &str = "solved";

/// The keys that a certificate reads; others, of the answer of `lpv design`, are let be.
#[derive(Deserialize)]
struct PolytopicFile {
    lyapunov: Option<Kind>,
    model: ModelTable,
    model_hash: Option<String>,
    /// Where the vertices are those of a tensor-product model: its weights, and the LPV model that it stands for.
    tensor_product: Option<Transformed>,
    weights: Option<WeightsTable>,
    /// Null where an input is not limited.
    sigma: Option<Vec<Option<f64>>>,
    gamma: Option<f64>,
    rate_vertices: Option<Vec<Vec<f64>>>,
    /// How `lpv design` ended, and why: it writes files without a design, too.
    status: Option<String>,
    verdict_reason: Option<String>,
    #[serde(rename = "K")]
    k: Option<Matrices>,
    #[serde(rename = "P")]
    p: Option<Matrices>,
    #[serde(rename = "Y")]
    y: Option<Matrices>,
    #[serde(rename = "L")]
    l: Option<Matrices>,
    #[serde(rename = "F")]
    f: Option<Matrices>,
}

#[derive(Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    Common,
    ParameterDependent,
    Frozen,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelTable {
    #[serde(rename = "A")]
    a: Matrices,
    #[serde(rename = "B")]
    b: Matrices,
}

/// What a design file says of the transformation that its vertices came from.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Transformed {
    /// The LPV model; null where only samples of it were known.
    pub source: Option<ModelSource>,
    /// Grid and weights of each parameter: what schedules K.
    pub parameters: TensorProductSchedule,
}

impl Transformed {
    /// Whether it makes sense, for `count` vertices; `key` is what it is called in the file.
    pub fn check(&self, door: &Door, key: &str, count: usize) -> Result<(), Failure> {
        if let Err(error) = self.parameters.check() {
            return door.refuse(format!("{key}.parameters"), error.to_string());
        }
        if self.parameters.vertices() != count {
            let message = format!("makes {} vertices, and the model has {count}", self.parameters.vertices());
            return door.refuse(format!("{key}.parameters"), message);
        }
        let Some(source) = &self.source else { return Ok(()) };
        let model = source.build().or_else(|error| door.refuse(format!("{key}.source"), error.to_string()))?;
        let given: Vec<&str> =
            self.parameters.parameters.iter().map(|parameter| parameter.grid.name.as_str()).collect();
        let own: Vec<&str> = model.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
        match given == own {
            true => Ok(()),
            false => door.refuse(
                format!("{key}.parameters"),
                format!("are {}: those of {} are {}, in this order", given.join(", "), source.name(), own.join(", ")),
            ),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WeightsTable {
    #[serde(rename = "Q")]
    q: Rows,
    #[serde(rename = "R")]
    r: Rows,
}

/// One matrix as rows, or one for each vertex.
#[derive(Deserialize)]
#[serde(untagged)]
enum Matrices {
    One(Rows),
    Each(Vec<Rows>),
}

/// Whether the text is a design over a polytope rather than one of a plant: it has the key "model".
pub fn is_polytopic(text: &str) -> bool {
    serde_json::from_str::<serde_json::Map<String, serde_json::Value>>(text)
        .is_ok_and(|map| map.contains_key("model") && !map.contains_key("points"))
}

/// Prove what the file claims; `region` replaces its γ.
pub fn claims(door: &Door, text: &str, region: Option<f64>, record: &mut Record) -> Result<Vec<Claim>, Failure> {
    let file: PolytopicFile = serde_json::from_str(text).map_err(|error| Failure::Unreadable {
        file: door.file.to_owned(),
        message: format!("is not a design over a polytope: {}", engineers_words(&error.to_string())),
    })?;
    if let Some(failure) = without_design(door, &file) {
        return Err(failure);
    }
    let (a, b) = (all(door, "model.A", &file.model.a)?, all(door, "model.B", &file.model.b)?);
    let polytope = Polytope::new(a, b).or_else(|error| door.refuse("model", error.to_string()))?;
    let fingerprint = polytope.fingerprint();
    if let Some(hash) = file.model_hash.as_ref().filter(|&hash| *hash != fingerprint) {
        return door.refuse(
            "model_hash",
            format!(
                "is {hash:?}, and the model of the file has {fingerprint:?}: the design was made for another model"
            ),
        );
    }
    let (n, m, count) = (polytope.states(), polytope.inputs(), polytope.len());
    let sized = |key: &str, given: &Option<Matrices>, [rows, columns]: [usize; 2]| {
        let Some(given) = given else { return Ok(None) };
        let mut each = all(door, key, given)?;
        if each.len() == 1 {
            each = vec![each[0].clone(); count];
        }
        if each.len() != count {
            return door.refuse(key, format!("has {} matrices: give one, or {count}, one for each vertex", each.len()));
        }
        match each.iter().position(|matrix| (matrix.nrows(), matrix.ncols()) != (rows, columns)) {
            None => Ok(Some(each)),
            Some(at) => door.refuse(
                format!("{key}[{}]", at + 1),
                format!("is {} × {}: it has to be {rows} × {columns}", each[at].nrows(), each[at].ncols()),
            ),
        }
    };
    let symmetric = |key: &str, each: &[Mat<f64>]| {
        let numbered = |at: usize| if each.len() > 1 { format!("{key}[{}]", at + 1) } else { key.to_owned() };
        each.iter().enumerate().try_for_each(|(at, matrix)| symmetric(door, &numbered(at), matrix))
    };
    let needed = |key: &str, given: Option<Vec<Mat<f64>>>| {
        given.map_or_else(|| door.refuse(key, "is missing: without it there is nothing to certify"), Ok)
    };
    let weights = match &file.weights {
        None => None,
        Some(table) => Some(weights(door, table, n, m)?),
    };
    let saturation = saturation(door, &file, region, m)?;
    let auxiliary_gain = sized("F", &file.f, [m, n])?;
    if auxiliary_gain.is_some() && saturation.is_none() {
        return door.refuse("F", "needs sigma and gamma: a gain that saturates nowhere needs no second one");
    }
    let p = sized("P", &file.p, [n, n])?;
    let same = p.as_ref().is_some_and(|p| p.iter().all(|other| *other == p[0]));
    let repeated =
        [("K", sized("K", &file.k, [m, n])?), ("L", sized("L", &file.l, [m, n])?), ("Y", sized("Y", &file.y, [n, n])?)];
    let [k, l, y] = &repeated;
    agree(door, "L", &l.1, &[&k.1, &y.1])?;
    let identity = || vec![identity(n); count];
    agree(door, "Y", &y.1.as_ref().and(p.as_ref()).map(|_| identity()), &[&p, &y.1])?;
    let kind = match (file.lyapunov, &file.rate_vertices) {
        (Some(kind), _) => kind,
        (None, Some(_)) => Kind::ParameterDependent,
        (None, None) => Kind::Common,
    };
    let claim = |polytope, lyapunov, auxiliary_gain| PolytopicClaim {
        polytope,
        lyapunov,
        auxiliary_gain,
        weights: weights.clone(),
        saturation: saturation.clone(),
    };
    if let Some(transformed) = &file.tensor_product {
        transformed.check(door, "tensor_product", count)?;
        if kind == Kind::Frozen {
            return door
                .refuse("lyapunov", "is \"frozen\": a tensor-product model has vertices, and no designs at points");
        }
        let built = transformed.source.as_ref().and_then(|source| source.build().ok());
        if let Some(model) = built.filter(|model| (model.states.len(), model.inputs) != (n, m)) {
            let sizes = [model.states.len(), model.inputs];
            let message = format!("has {} states and {} inputs: the vertices have {n} and {m}", sizes[0], sizes[1]);
            return door.refuse("tensor_product.source", message);
        }
    }
    let mut proved = |claim: PolytopicClaim| {
        let claims = prove_polytopic(&claim);
        let unwritten =
            |error: RecordError| Failure::Unreadable { file: door.file.to_owned(), message: error.to_string() };
        record.add_polytopic(&claim, &claims).map_err(unwritten)?;
        Ok(match &file.tensor_product {
            None => claims,
            Some(Transformed { source, parameters: schedule }) => {
                let source = source.as_ref();
                let claim = ScheduledClaim { polytopic: &claim, schedule, source, most_cells: MOST_CELLS };
                prove_scheduled(&claim, claims)
            }
        })
    };
    match kind {
        Kind::ParameterDependent => {
            let (y, l) = (needed("Y", sized("Y", &file.y, [n, n])?)?, needed("L", sized("L", &file.l, [m, n])?)?);
            symmetric("Y", &y)?;
            let rate_vertices = rates(door, &file, count)?;
            let lyapunov = PolytopicLyapunov::ParameterDependent { y, l, rate_vertices };
            proved(claim(polytope, lyapunov, auxiliary_gain))
        }
        Kind::Common => {
            let (p, gain) = (needed("P", p)?, needed("K", sized("K", &file.k, [m, n])?)?);
            symmetric("P", &p)?;
            if !same {
                return door.refuse("P", "differs between vertices: give one for all, or lyapunov = \"parameter-dependent\" with Y, L and rate_vertices, or \"frozen\"");
            }
            let lyapunov = PolytopicLyapunov::Common { p: p[0].clone(), gain };
            proved(claim(polytope, lyapunov, auxiliary_gain))
        }
        Kind::Frozen => {
            let (p, gain) = (needed("P", p)?, needed("K", sized("K", &file.k, [m, n])?)?);
            symmetric("P", &p)?;
            let mut at = |i: usize| {
                let model = Polytope::hull(&[polytope.vertex(i)]);
                let lyapunov = PolytopicLyapunov::Common { p: p[i].clone(), gain: vec![gain[i].clone()] };
                let claims = proved(claim(model, lyapunov, auxiliary_gain.as_ref().map(|f| vec![f[i].clone()])))?;
                let named = |claim: Claim| if count > 1 { claim.of_member(Member::Point(i)) } else { claim };
                Ok(claims.into_iter().map(named).collect::<Vec<Claim>>())
            };
            let each: Vec<Vec<Claim>> = (0..count).map(&mut at).collect::<Result<_, Failure>>()?;
            Ok(each.into_iter().flatten().collect())
        }
    }
}

/// What the file says where it is an answer without a design. The words are those of the file, and nothing of them is proved again here.
fn without_design(door: &Door, file: &PolytopicFile) -> Option<Failure> {
    let status = file.status.as_deref().filter(|&status| status != SOLVED)?;
    if file.k.is_some() || file.p.is_some() || file.y.is_some() {
        return None;
    }
    // one line, whatever a file holds
    let line = |text: &str| text.replace(char::is_control, " ");
    let reason = file.verdict_reason.as_deref().map_or(String::new(), |reason| format!(": {}", line(reason)));
    let message = format!(
        "{}: holds no design, there is nothing to certify: lpv design ended with \"{}\"{reason}",
        door.file.display(),
        line(status)
    );
    Some(match status {
        "infeasible" | "unbounded" => Failure::NoOptimum(message),
        _ => Failure::NotCertified(message),
    })
}

fn all(door: &Door, key: &str, given: &Matrices) -> Result<Vec<Mat<f64>>, Failure> {
    let (each, single): (Vec<&Rows>, bool) = match given {
        Matrices::One(rows) => (vec![rows], true),
        Matrices::Each(each) => (each.iter().collect(), false),
    };
    let matrix = |(i, rows): (usize, &&Rows)| {
        let key = if single { key.to_owned() } else { format!("{key}[{}]", i + 1) };
        matrix(door, &key, rows)
    };
    each.iter().enumerate().map(matrix).collect()
}

fn matrix(door: &Door, key: &str, rows: &Rows) -> Result<Mat<f64>, Failure> {
    let width = rows.first().map_or(0, Vec::len);
    if width == 0 || rows.iter().any(|row| row.len() != width) {
        return door.refuse(key, "has to be rows of equally many numbers");
    }
    let matrix = from_rows(rows);
    if !is_finite(&matrix) {
        return door.refuse(key, "has an entry that is not finite");
    }
    Ok(matrix)
}

/// What a file says twice is the same: `product` is that of `factors` at every vertex, as far as printed digits go.
fn agree(
    door: &Door,
    key: &str,
    product: &Option<Vec<Mat<f64>>>,
    factors: &[&Option<Vec<Mat<f64>>>; 2],
) -> Result<(), Failure> {
    let (Some(product), [Some(left), Some(right)]) = (product, factors) else { return Ok(()) };
    for (at, ((product, left), right)) in product.iter().zip(left).zip(right).enumerate() {
        let size = product.norm_max().max(left.norm_max() * right.norm_max());
        if (left * right - product).norm_max() > REPEATED * size {
            let message = "does not agree with the file's other matrices: L = KY and YP = I at every vertex";
            return door.refuse(format!("{key}[{}]", at + 1), message);
        }
    }
    Ok(())
}

/// A proof reads the numbers of the file: they have to be symmetric to the bit.
fn symmetric(door: &Door, key: &str, matrix: &Mat<f64>) -> Result<(), Failure> {
    let Some((i, j)) = asymmetry(matrix) else { return Ok(()) };
    let [(a, b), (c, d)] = [(i + 1, j + 1), (j + 1, i + 1)];
    let (one, other) = (matrix[(i, j)], matrix[(j, i)]);
    door.refuse(
        key,
        format!("has {one} in row {a}, column {b}, and {other} in row {c}, column {d}: it has to be symmetric, the two the same number to the last digit"),
    )
}

fn weights(door: &Door, table: &WeightsTable, n: usize, m: usize) -> Result<CostWeights, Failure> {
    let sized = |key: &str, rows: &Rows, size: usize| {
        let matrix = matrix(door, key, rows)?;
        if (matrix.nrows(), matrix.ncols()) != (size, size) {
            return door.refuse(key, format!("has to be a symmetric {size} × {size} matrix"));
        }
        symmetric(door, key, &matrix)?;
        Ok(matrix)
    };
    let (q, r) = (sized("weights.Q", &table.q, n)?, sized("weights.R", &table.r, m)?);
    let refuse = |key: &str, matrix: &Mat<f64>, needed: &str| {
        let eigenvalue = about(smallest_eigenvalue_about(matrix));
        door.refuse(key, format!("has to be {needed}: its smallest eigenvalue is about {eigenvalue}"))
    };
    if !matches!(definiteness(&q), Some(Definiteness::Positive | Definiteness::Semidefinite)) {
        return refuse("weights.Q", &q, "positive semidefinite");
    }
    if definiteness(&r) != Some(Definiteness::Positive) {
        return refuse("weights.R", &r, "positive definite");
    }
    Ok(CostWeights { q, r })
}

fn saturation(
    door: &Door,
    file: &PolytopicFile,
    region: Option<f64>,
    m: usize,
) -> Result<Option<InputBounds>, Failure> {
    let (sigma, gamma) = match (&file.sigma, region.or(file.gamma)) {
        (None, None) => return Ok(None),
        (Some(sigma), Some(gamma)) => (sigma, door.positive("gamma", gamma)?),
        (None, _) => {
            return door.refuse("sigma", "is missing: gamma and --region are levels of a set on which |u| <= sigma");
        }
        (_, None) => return door.refuse("gamma", "is missing: sigma holds on a set V <= gamma"),
    };
    if sigma.len() != m {
        return door.refuse("sigma", format!("has {} numbers: the model has {m} inputs", sigma.len()));
    }
    let sigma: Vec<f64> = sigma.iter().map(|bound| bound.unwrap_or(f64::INFINITY)).collect();
    sigma
        .iter()
        .filter(|bound| **bound != f64::INFINITY)
        .try_for_each(|&bound| door.positive("sigma", bound).map(|_| ()))?;
    Ok(Some(InputBounds { sigma, gamma }))
}

fn rates(door: &Door, file: &PolytopicFile, count: usize) -> Result<Vec<Vec<f64>>, Failure> {
    let Some(vertices) = file.rate_vertices.as_ref().filter(|vertices| !vertices.is_empty()) else {
        return door
            .refuse("rate_vertices", "is missing: V that depends on the parameter holds for a rate; [[0, …]] is rest");
    };
    for (k, nu) in vertices.iter().enumerate() {
        let largest = nu.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        if nu.len() != count || !largest.is_finite() || nu.iter().sum::<f64>().abs() > TOLERANCE * largest {
            let message = format!("is {nu:?}: it has to be {count} finite numbers that sum to zero");
            return door.refuse(format!("rate_vertices[{}]", k + 1), message);
        }
    }
    Ok(vertices.clone())
}
