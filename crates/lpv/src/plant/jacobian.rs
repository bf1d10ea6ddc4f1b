//! Jacobians by forward-mode differentiation: a few directions a pass, exact to rounding.

use super::{Description, Equations, OperatingPoint, Plant};
use crate::math::scalar::{Dual, LANES, derivative, dual};
use crate::math::taylor::{Taylor, TaylorDual};

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
        let (state, input) = Equations::trim(self, rho);
        OperatingPoint { state, input }
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

    fn trim_over(&self, rho: Taylor) -> (Vec<Taylor>, Vec<Taylor>) {
        Equations::trim(self, rho)
    }

    fn dynamics_over(&self, x: &[Taylor], u: &[Taylor]) -> Vec<Taylor> {
        let w = vec![Taylor::from(0.0); Equations::description(self).disturbances.len()];
        let mut dx = vec![Taylor::from(0.0); x.len()];
        Equations::dynamics(self, x, u, &w, &mut dx);
        dx
    }

    fn jacobians_over(&self, x: &[Taylor], u: &[Taylor]) -> (Vec<Taylor>, Vec<Taylor>) {
        let w = vec![TaylorDual::from(0.0); Equations::description(self).disturbances.len()];
        let (n, m) = (x.len(), u.len());
        let lift = |values: &[Taylor], variable: Option<usize>| -> Vec<TaylorDual> {
            values.iter().enumerate().map(|(i, &value)| TaylorDual::new(value, variable == Some(i))).collect()
        };
        let (mut a, mut b) = (vec![Taylor::from(0.0); n * n], vec![Taylor::from(0.0); n * m]);
        let mut dx = vec![TaylorDual::from(0.0); n];
        for j in 0..n {
            Equations::dynamics(self, &lift(x, Some(j)), &lift(u, None), &w, &mut dx);
            dx.iter().enumerate().for_each(|(i, dx)| a[i * n + j] = dx.derivative);
        }
        for j in 0..m {
            Equations::dynamics(self, &lift(x, None), &lift(u, Some(j)), &w, &mut dx);
            dx.iter().enumerate().for_each(|(i, dx)| b[i * m + j] = dx.derivative);
        }
        (a, b)
    }

    fn input_derivative_over(&self, x: &[Taylor], u: &[Taylor], direction: &[f64]) -> Vec<Taylor> {
        let w = vec![TaylorDual::from(0.0); Equations::description(self).disturbances.len()];
        let x: Vec<TaylorDual> = x.iter().map(|&value| TaylorDual::new(value, false)).collect();
        let along = |(&value, &slope): (&Taylor, &f64)| TaylorDual { value, derivative: Taylor::from(slope) };
        let u: Vec<TaylorDual> = u.iter().zip(direction).map(along).collect();
        let mut dx = vec![TaylorDual::from(0.0); x.len()];
        Equations::dynamics(self, &x, &u, &w, &mut dx);
        dx.iter().map(|dx| dx.derivative).collect()
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
