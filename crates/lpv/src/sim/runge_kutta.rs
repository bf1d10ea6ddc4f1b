//! The classical Runge–Kutta method with fixed step.

/// Stage weights bᵢ.
const B: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];
/// Nodes cᵢ; stage i starts from the one before it, so aᵢ,ᵢ₋₁ = cᵢ and the other aᵢⱼ are zero.
const C: [f64; 4] = [0.0, 0.5, 0.5, 1.0];

/// The classical fourth-order method, with its work space.
pub struct RungeKutta4 {
    stage: Vec<f64>,
    slope: Vec<f64>,
    sum: Vec<f64>,
}

impl RungeKutta4 {
    /// For systems of `size` equations.
    pub fn new(size: usize) -> Self {
        Self { stage: vec![0.0; size], slope: vec![0.0; size], sum: vec![0.0; size] }
    }

    /// Advance `z` by `step_s` along ż = f(t, z) from time `t_s`; `f(t, z, ż)` writes the slope.
    pub fn step(&mut self, t_s: f64, step_s: f64, z: &mut [f64], mut f: impl FnMut(f64, &[f64], &mut [f64])) {
        self.sum.fill(0.0);
        for i in 0..4 {
            for ((stage, z), slope) in self.stage.iter_mut().zip(z.iter()).zip(&self.slope) {
                *stage = if i == 0 { *z } else { z + step_s * C[i] * slope };
            }
            f(t_s + C[i] * step_s, &self.stage, &mut self.slope);
            for (sum, slope) in self.sum.iter_mut().zip(&self.slope) {
                *sum += B[i] * slope;
            }
        }
        for (z, sum) in z.iter_mut().zip(&self.sum) {
            *z += step_s * sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Order conditions up to four for this tableau (Hairer, Nørsett, Wanner, table II.1.1).
    #[test]
    fn order_conditions_hold() {
        let sum = |term: &dyn Fn(usize) -> f64| (0..4).map(term).sum::<f64>();
        let a = |i: usize| if i == 0 { 0.0 } else { C[i] };
        let c = |i: isize| if i < 0 { 0.0 } else { C[i as usize] };
        let before = |i: usize| i as isize - 1;
        let conditions = [
            (sum(&|i| B[i]), 1.0),
            (sum(&|i| B[i] * C[i]), 1.0 / 2.0),
            (sum(&|i| B[i] * C[i].powi(2)), 1.0 / 3.0),
            (sum(&|i| B[i] * a(i) * c(before(i))), 1.0 / 6.0),
            (sum(&|i| B[i] * C[i].powi(3)), 1.0 / 4.0),
            (sum(&|i| B[i] * C[i] * a(i) * c(before(i))), 1.0 / 8.0),
            (sum(&|i| B[i] * a(i) * c(before(i)).powi(2)), 1.0 / 12.0),
            (sum(&|i| B[i] * a(i) * c(before(i)) * c(before(i) - 1)), 1.0 / 24.0),
        ];
        for (k, (found, expected)) in conditions.into_iter().enumerate() {
            assert!((found - expected).abs() < 1e-15, "condition {k}: {found} is not {expected}");
        }
    }

    #[test]
    fn error_falls_with_the_fourth_power_of_the_step() {
        let error = |steps: usize| {
            let (h, mut z) = (2.0 / steps as f64, [1.0]);
            let mut method = RungeKutta4::new(1);
            for k in 0..steps {
                // ż = −2tz, z = e^{−t²}
                method.step(k as f64 * h, h, &mut z, |t, z, dz| dz[0] = -2.0 * t * z[0]);
            }
            (z[0] - (-4f64).exp()).abs()
        };
        let order = (error(100) / error(200)).log2();
        assert!((order - 4.0).abs() < 0.15, "order {order}");
    }
}
