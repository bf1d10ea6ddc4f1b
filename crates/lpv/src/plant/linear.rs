//! A linear plant from its matrices.

use super::{Description, Equations, PlantParameterError, Signal};
use crate::math::scalar::Scalar;
use serde::{Deserialize, Serialize};

/// Matrices of a linear plant, as rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinearParameters {
    /// A, n × n.
    #[serde(rename = "A")]
    pub a: Vec<Vec<f64>>,
    /// B, n × m.
    #[serde(rename = "B")]
    pub b: Vec<Vec<f64>>,
    /// C, n_y × n; the whole state is measured if it is left out.
    #[serde(rename = "C", default, skip_serializing_if = "Option::is_none")]
    pub c: Option<Vec<Vec<f64>>>,
}

/// ẋ = Ax + B(u + w), y = Cx + v, with states x_1 …, inputs u_1 …, outputs y_1 ….
pub struct Linear {
    parameters: LinearParameters,
    description: Description,
}

impl Linear {
    /// The plant with the given matrices.
    ///
    /// # Errors
    /// A is not square, B or C does not fit A, or an entry is not finite.
    pub fn new(parameters: &LinearParameters) -> Result<Self, PlantParameterError> {
        let n = parameters.a.len();
        check("A", &parameters.a, n.max(1), n, "square, with at least one row")?;
        let m = parameters.b.first().map_or(0, Vec::len).max(1);
        check("B", &parameters.b, n, m, &format!("{n} × m, with a row for each row of A"))?;
        if let Some(c) = &parameters.c {
            check("C", c, c.len().max(1), n, &format!("p × {n}, with a column for each state"))?;
        }
        let outputs = parameters.c.as_ref().map_or(n, Vec::len);
        let list = |symbol: &str, count: usize| {
            (1..=count).map(|i| Signal { name: format!("{symbol}_{i}"), unit: "-".into(), wraps: false }).collect()
        };
        let description = Description {
            name: "linear".into(),
            states: list("x", n),
            inputs: list("u", m),
            disturbances: list("w", m),
            outputs: list("y", outputs),
            scheduling: None,
            state_limits: vec![None; n],
            scene: None,
        };
        Ok(Self { parameters: parameters.clone(), description })
    }
}

fn check(
    matrix: &'static str,
    rows: &[Vec<f64>],
    expected_rows: usize,
    columns: usize,
    expected: &str,
) -> Result<(), PlantParameterError> {
    let odd = rows.iter().map(Vec::len).find(|&length| length != columns);
    if rows.len() != expected_rows || odd.is_some() {
        let columns = odd.or(rows.first().map(Vec::len)).unwrap_or(0);
        return Err(PlantParameterError::Shape { matrix, rows: rows.len(), columns, expected: expected.into() });
    }
    match rows.iter().flatten().all(|entry| entry.is_finite()) {
        true => Ok(()),
        false => Err(PlantParameterError::NotFinite { matrix }),
    }
}

impl Equations for Linear {
    fn description(&self) -> &Description {
        &self.description
    }

    /// The origin.
    fn trim<S: Scalar>(&self, _rho: S) -> (Vec<S>, Vec<S>) {
        let zeros = |count| vec![S::from(0.0); count];
        (zeros(self.description.states.len()), zeros(self.description.inputs.len()))
    }

    fn dynamics<S: Scalar>(&self, x: &[S], u: &[S], w: &[S], dx: &mut [S]) {
        for ((rate, a), b) in dx.iter_mut().zip(&self.parameters.a).zip(&self.parameters.b) {
            *rate = product(a, x)
                + b.iter().zip(u.iter().zip(w)).fold(S::from(0.0), |sum, (b, (&u, &w))| sum + (u + w) * *b);
        }
    }

    fn measurement<S: Scalar>(&self, x: &[S], v: &[S], y: &mut [S]) {
        match &self.parameters.c {
            Some(c) => {
                for ((y, c), &v) in y.iter_mut().zip(c).zip(v) {
                    *y = product(c, x) + v;
                }
            }
            None => {
                for ((y, &x), &v) in y.iter_mut().zip(x).zip(v) {
                    *y = x + v;
                }
            }
        }
    }
}

fn product<S: Scalar>(row: &[f64], x: &[S]) -> S {
    row.iter().zip(x).fold(S::from(0.0), |sum, (a, &x)| sum + x * *a)
}
