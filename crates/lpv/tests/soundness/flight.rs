//! Flights of the saturated LPV loop from the edge of a proved set, against a parameter that moves as badly as it may.
//!
//! ẋ = A(ρ)x − B(ρ) sat(K(ρ)x), Runge–Kutta of fourth order; ρ̇ is chosen at every step among the extreme rates, so
//! that V grows most (greedy). At every step: V̇ is not positive, V is not above what it was, inputs that are claimed
//! to stay unsaturated do, and the cost so far is below its bound.

use lpv::math::Mat;
use lpv::math::eigen::symmetric_eigenvectors;
use lpv::math::matrix::{inverse_spd, to_row_vec};

/// Steps of a flight, and their length times the largest entry of the loop's matrix.
const STEPS: usize = 160;
const STEP: f64 = 0.04;
/// What rounding leaves of V̇, against the sizes of what it is the sum of.
const ROUNDING: f64 = 1e-9;
/// Error of the integration, against V.
const INTEGRATION: f64 = 1e-6;

/// The loop at one value of the parameter, in numbers and row order.
#[derive(Clone)]
pub struct Frozen {
    pub a: Vec<f64>,
    pub b: Vec<f64>,
    pub k: Vec<f64>,
    pub p: Vec<f64>,
}

impl Frozen {
    pub fn new(a: &Mat<f64>, b: &Mat<f64>, k: &Mat<f64>, p: &Mat<f64>) -> Self {
        Self { a: to_row_vec(a), b: to_row_vec(b), k: to_row_vec(k), p: to_row_vec(p) }
    }
}

/// Where a parameter may be after a time, from where it is.
pub type Moves<'a> = dyn Fn(&[f64], f64) -> Vec<Vec<f64>> + 'a;

/// What is flown, and what is claimed of it.
pub struct Flown<'a> {
    pub states: usize,
    pub inputs: usize,
    /// The loop at a value of the parameter; `None` where V is no quadratic form there.
    pub frozen: &'a dyn Fn(&[f64]) -> Option<Frozen>,
    /// Where the parameter starts.
    pub start: Vec<f64>,
    /// Where it may be after a time, from where it is.
    pub moves: &'a Moves<'a>,
    /// sᵢ is in [−below, above], s = sat(Kx).
    pub below: Vec<f64>,
    pub above: Vec<f64>,
    /// V(x(0))
    pub level: f64,
    /// Kx of the limited inputs stays within the limits.
    pub unsaturated: bool,
    /// κ, Q and R, where the cost bound is claimed.
    pub cost: Option<(f64, &'a Mat<f64>, &'a Mat<f64>)>,
}

fn product(matrix: &[f64], x: &[f64], result: &mut [f64]) {
    let n = x.len();
    result.iter_mut().enumerate().for_each(|(i, r)| *r = (0..n).map(|j| matrix[i * n + j] * x[j]).sum());
}

fn form(matrix: &[f64], x: &[f64]) -> f64 {
    let n = x.len();
    (0..n).map(|i| x[i] * (0..n).map(|j| matrix[i * n + j] * x[j]).sum::<f64>()).sum()
}

impl Flown<'_> {
    /// s = sat(Kx), and ẋ; the cost's rate behind it.
    fn slope(&self, at: &Frozen, x: &[f64], slope: &mut [f64]) -> Vec<f64> {
        let (n, m) = (self.states, self.inputs);
        let mut s = vec![0.0; m];
        product(&at.k, &x[..n], &mut s);
        s.iter_mut().enumerate().for_each(|(i, s)| *s = s.clamp(-self.below[i], self.above[i]));
        product(&at.a, &x[..n], &mut slope[..n]);
        for (i, slope) in slope[..n].iter_mut().enumerate() {
            *slope -= (0..m).map(|j| at.b[i * m + j] * s[j]).sum::<f64>();
        }
        slope[n] = self.cost.map_or(0.0, |(_, q, r)| {
            let form = |weight: &Mat<f64>, x: &[f64]| -> f64 {
                (0..x.len()).map(|i| (0..x.len()).map(|j| x[i] * weight[(i, j)] * x[j]).sum::<f64>()).sum()
            };
            form(q, &x[..n]) + form(r, &s)
        });
        s
    }

    fn step(&self, at: [&Frozen; 3], h: f64, x: &[f64]) -> Vec<f64> {
        let size = x.len();
        let mut k = vec![vec![0.0; size]; 4];
        let shifted = |k: &[f64], share: f64| (0..size).map(|i| x[i] + share * h * k[i]).collect::<Vec<f64>>();
        self.slope(at[0], x, &mut k[0]);
        let second = shifted(&k[0], 0.5);
        self.slope(at[1], &second, &mut k[1]);
        let third = shifted(&k[1], 0.5);
        self.slope(at[1], &third, &mut k[2]);
        let fourth = shifted(&k[2], 1.0);
        self.slope(at[2], &fourth, &mut k[3]);
        (0..size).map(|i| x[i] + h / 6.0 * (k[0][i] + 2.0 * (k[1][i] + k[2][i]) + k[3][i])).collect()
    }

    /// Directions from which V may grow most: where an input is largest on the set, and where the unsaturated V̇/V is.
    pub fn worst_directions(&self) -> Vec<Vec<f64>> {
        let (n, m) = (self.states, self.inputs);
        let Some(at) = (self.frozen)(&self.start) else { return Vec::new() };
        let matrix =
            |entries: &[f64], rows: usize, columns: usize| Mat::from_fn(rows, columns, |i, j| entries[i * columns + j]);
        let (a, b, k, p) = (matrix(&at.a, n, n), matrix(&at.b, n, m), matrix(&at.k, m, n), matrix(&at.p, n, n));
        let Some(y) = inverse_spd(&p) else { return Vec::new() };
        let reached = |i: usize| (0..n).map(|r| (0..n).map(|c| y[(r, c)] * k[(i, c)]).sum()).collect::<Vec<f64>>();
        let flow = &p * (&a - &b * &k);
        let growth = symmetric_eigenvectors(&(&flow + flow.transpose()))
            .map(|(_, vectors)| (0..n).map(|i| vectors[(i, n - 1)]).collect::<Vec<f64>>());
        (0..m.min(4)).map(reached).chain(growth).filter(|x| x.iter().any(|x| *x != 0.0)).collect()
    }

    /// Fly from the edge of the set along `direction`.
    pub fn fly(&self, direction: &[f64]) -> Result<(), String> {
        let n = self.states;
        let mut rho = self.start.clone();
        let nowhere = || "V is no quadratic form on the way".to_owned();
        let mut at = (self.frozen)(&rho).ok_or_else(nowhere)?;
        let size = form(&at.p, direction);
        if size.is_nan() || size <= 0.0 {
            return Err(format!("V is {size} along {direction:?}"));
        }
        let scale = (self.level / size).sqrt();
        let mut x: Vec<f64> = direction.iter().map(|d| scale * d).collect();
        if !x.iter().all(|x| x.is_finite()) {
            return Ok(());
        }
        x.push(0.0);
        let largest = at.a.iter().fold(0.0_f64, |most, a| most.max(a.abs()));
        let gain = (0..n).fold(0.0_f64, |most, i| {
            let row = |j: usize| -> f64 { (0..self.inputs).map(|l| at.b[i * self.inputs + l] * at.k[l * n + j]).sum() };
            most.max((0..n).map(row).fold(0.0, |most, entry| most.max(entry.abs())))
        });
        let h = STEP / (largest + gain).max(1e-3);
        let mut before = self.level;
        for step in 0..STEPS {
            // where it may go, and where V is largest then
            let mut worst: Option<(f64, Vec<f64>, Vec<f64>, Frozen)> = None;
            for to in (self.moves)(&rho, h) {
                let halfway: Vec<f64> = rho.iter().zip(&to).map(|(a, b)| 0.5 * (a + b)).collect();
                let end = (self.frozen)(&to).ok_or_else(nowhere)?;
                let middle = (self.frozen)(&halfway).ok_or_else(nowhere)?;
                self.falls(&at, &end, &x, h)?;
                let next = self.step([&at, &middle, &end], h, &x);
                let value = form(&end.p, &next[..n]);
                if worst.as_ref().is_none_or(|worst| value > worst.0) {
                    worst = Some((value, to, next, end));
                }
            }
            let Some((value, to, next, end)) = worst else { return Ok(()) };
            if value.is_nan() || value > before * (1.0 + INTEGRATION) {
                return Err(format!("V goes from {before} to {value} at step {step}, parameter {to:?}"));
            }
            if let Some((factor, ..)) = self.cost
                && next[n] > factor * self.level * (1.0 + INTEGRATION)
            {
                return Err(format!("the cost is {} V(x(0)), which is more than {factor}", next[n] / self.level));
            }
            (x, rho, at, before) = (next, to, end, value);
            if before < 1e-12 * self.level {
                break;
            }
        }
        Ok(())
    }

    /// V̇ ≤ 0 at x, with Ṗ from the values of P before and after a step; inputs that do not saturate do not.
    fn falls(&self, at: &Frozen, end: &Frozen, x: &[f64], h: f64) -> Result<(), String> {
        let n = self.states;
        let mut slope = vec![0.0; n + 1];
        let s = self.slope(at, x, &mut slope);
        let (mut px, mut free) = (vec![0.0; n], vec![0.0; self.inputs]);
        product(&at.p, &x[..n], &mut px);
        product(&at.k, &x[..n], &mut free);
        if self.unsaturated {
            let passes = |i: usize| (s[i] - free[i]).abs() > 1e-9 * (self.below[i].min(self.above[i]) + free[i].abs());
            if let Some(i) = (0..self.inputs).find(|&i| passes(i)) {
                return Err(format!("input {} saturates: {} at {x:?}", i + 1, free[i]));
            }
        }
        let along: f64 = 2.0 * (0..n).map(|i| px[i] * slope[i]).sum::<f64>();
        let sizes: f64 = 2.0 * (0..n).map(|i| (px[i] * slope[i]).abs()).sum::<f64>();
        let change: Vec<f64> = end.p.iter().zip(&at.p).map(|(b, a)| (b - a) / h).collect();
        let turning = form(&change, &x[..n]);
        // Ṗ from a difference is wrong by a share of itself
        let rounding = ROUNDING * sizes + 0.02 * turning.abs() + ROUNDING * form(&at.p, &x[..n]) / h;
        if along + turning > rounding {
            return Err(format!("V grows by {} per second at {x:?}", along + turning));
        }
        Ok(())
    }
}
