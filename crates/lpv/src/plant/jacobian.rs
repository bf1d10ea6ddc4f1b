//! Jacobians by forward-mode differentiation: a few directions a pass, exact to rounding.

use super::{Description, Equations, OperatingPoint, Plant};
use crate::math::scalar::{Dual, LANES, derivative, dual};

/// The Jacobian of `function` at `point`, `rows` × `point.len()`, in row order.
fn jacobian(point: &[f64], rows: usize, jacobian: &mut [f64], function: impl Fn(&[Dual], &mut [Dual])) {
    let columns = point.len();
    debug_assert_eq!(jacobian.len(), rows * columns);
    let mut argument: Vec<Dual> = point.iter().map(|&value| dual(value, None)).collect();
    let mut value = vec![dual(0.0, None); rows];
    for first in (0..columns).step_by(LANES) {
        let lanes = LANES.min(columns - first);
        for lane in 0..lanes {
            argument[first + lane] = dual(point[first + lane], Some(lane));
        }
        function(&argument, &mut value);
        for lane in 0..lanes {
            argument[first + lane] = dual(point[first + lane], None);
            for row in 0..rows {
                jacobian[row * columns + first + lane] = derivative(&value[row], lane);
            }
        }
    }
}

fn constants(values: &[f64]) -> Vec<Dual> {
    values.iter().map(|&value| dual(value, None)).collect()
}

impl<E: Equations> Plant for E {
    fn description(&self) -> &Description {
        Equations::description(self)
    }

    fn trim(&self, rho: f64) -> OperatingPoint {
        Equations::trim(self, rho)
    }

    fn dynamics(&self, x: &[f64], u: &[f64], w: &[f64], dx: &mut [f64]) {
        Equations::dynamics(self, x, u, w, dx);
    }

    fn measurement(&self, x: &[f64], v: &[f64], y: &mut [f64]) {
        Equations::measurement(self, x, v, y);
    }

    fn dynamics_by_state(&self, x: &[f64], u: &[f64], w: &[f64], a: &mut [f64]) {
        let (u, w) = (constants(u), constants(w));
        jacobian(x, x.len(), a, |x, dx| Equations::dynamics(self, x, &u, &w, dx));
    }

    fn dynamics_by_input(&self, x: &[f64], u: &[f64], w: &[f64], b: &mut [f64]) {
        let (rows, x, w) = (x.len(), constants(x), constants(w));
        jacobian(u, rows, b, |u, dx| Equations::dynamics(self, &x, u, &w, dx));
    }

    fn dynamics_by_disturbance(&self, x: &[f64], u: &[f64], w: &[f64], l: &mut [f64]) {
        let (rows, x, u) = (x.len(), constants(x), constants(u));
        jacobian(w, rows, l, |w, dx| Equations::dynamics(self, &x, &u, w, dx));
    }

    fn measurement_by_state(&self, x: &[f64], v: &[f64], c: &mut [f64]) {
        let (rows, v) = (v.len(), constants(v));
        jacobian(x, rows, c, |x, y| Equations::measurement(self, x, &v, y));
    }

    fn measurement_by_noise(&self, x: &[f64], v: &[f64], m: &mut [f64]) {
        let (rows, x) = (v.len(), constants(x));
        jacobian(v, rows, m, |v, y| Equations::measurement(self, &x, v, y));
    }
}
