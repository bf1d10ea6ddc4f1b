//! The continuous-time extended Kalman filter, thesis algorithm 2.1, (2.48)-(2.62).

use super::noise_covariance::NoiseCovariance;
use crate::math::Mat;
use crate::math::angle::wrap;
use crate::math::matrix::{from_row_slice, inverse_spd, to_row_vec};
use crate::plant::Plant;

/// Right side of the filter's differential equations:
///
/// ```text
/// dx̂/dt = f(x̂, u, 0) + K (y − h(x̂, 0)),   K = P Cᵀ R̃⁻¹
/// dP/dt = A P + P Aᵀ + Q̃ − P Cᵀ R̃⁻¹ C P,   Q̃ = L Q_c Lᵀ,  R̃ = M R_c Mᵀ
/// ```
///
/// with the Jacobians A, L, C, M at (x̂, u, w = 0, v = 0). Angles in the innovation are wrapped. The caller integrates x̂
/// and P together with the plant, as one system.
pub struct Ekf<'a> {
    plant: &'a dyn Plant,
    q_c: Vec<f64>,
    r_c: Mat<f64>,
    work: Work,
}

/// Work space, so that a step allocates nothing of its own.
struct Work {
    a: Vec<f64>,
    l: Vec<f64>,
    c: Vec<f64>,
    m: Vec<f64>,
    ap: Vec<f64>,
    cp: Vec<f64>,
    lq: Vec<f64>,
    gain: Vec<f64>,
    innovation: Vec<f64>,
    /// R̃⁻¹ and the M that it was computed for.
    r_inverse: Option<(Vec<f64>, Vec<f64>)>,
    no_disturbance: Vec<f64>,
    no_noise: Vec<f64>,
}

impl<'a> Ekf<'a> {
    /// The filter for `plant` with the noise `covariance` at sample time `sample_time_s`.
    pub fn new(plant: &'a dyn Plant, covariance: &NoiseCovariance, sample_time_s: f64) -> Self {
        let description = plant.description();
        let (n, nw, ny) = (description.states.len(), description.disturbances.len(), description.outputs.len());
        let r = &covariance.measurement;
        Self {
            plant,
            q_c: to_row_vec(&covariance.process).iter().map(|entry| entry / sample_time_s).collect(),
            r_c: Mat::from_fn(ny, ny, |i, j| r[(i, j)] * sample_time_s),
            work: Work {
                a: vec![0.0; n * n],
                l: vec![0.0; n * nw],
                c: vec![0.0; ny * n],
                m: vec![0.0; ny * ny],
                ap: vec![0.0; n * n],
                cp: vec![0.0; ny * n],
                lq: vec![0.0; n * nw],
                gain: vec![0.0; n * ny],
                innovation: vec![0.0; ny],
                r_inverse: None,
                no_disturbance: vec![0.0; nw],
                no_noise: vec![0.0; ny],
            },
        }
    }

    /// (dx̂/dt, dP/dt) at estimate `x` and covariance `p` (row order) for input `u` and measurement `y`.
    pub fn derivative(&mut self, x: &[f64], p: &[f64], u: &[f64], y: &[f64], dx: &mut [f64], dp: &mut [f64]) {
        let work = &mut self.work;
        let (n, nw, ny) = (x.len(), work.no_disturbance.len(), y.len());
        self.plant.dynamics_by_state(x, u, &work.no_disturbance, &mut work.a);
        self.plant.dynamics_by_disturbance(x, u, &work.no_disturbance, &mut work.l);
        self.plant.measurement_by_state(x, &work.no_noise, &mut work.c);
        self.plant.measurement_by_noise(x, &work.no_noise, &mut work.m);

        if work.r_inverse.as_ref().is_none_or(|(m, _)| *m != work.m) {
            let m = from_row_slice(ny, ny, &work.m);
            let r = &m * &self.r_c * m.transpose();
            let inverse = inverse_spd(&r).map_or_else(|| vec![f64::NAN; ny * ny], |inverse| to_row_vec(&inverse));
            work.r_inverse = Some((work.m.clone(), inverse));
        }
        let r_inverse = work.r_inverse.as_ref().map_or(&[][..], |(_, inverse)| inverse);

        multiply(&work.a, p, n, &mut work.ap);
        multiply(&work.c, p, n, &mut work.cp);
        // K = (C P)ᵀ R̃⁻¹, for P = Pᵀ
        for i in 0..n {
            for j in 0..ny {
                work.gain[i * ny + j] = (0..ny).map(|k| work.cp[k * n + i] * r_inverse[k * ny + j]).sum();
            }
        }
        multiply(&work.l, &self.q_c, nw, &mut work.lq);
        for i in 0..n {
            for j in 0..=i {
                let noise: f64 = (0..nw).map(|k| work.lq[i * nw + k] * work.l[j * nw + k]).sum();
                let correction: f64 = (0..ny).map(|k| work.gain[i * ny + k] * work.cp[k * n + j]).sum();
                let entry = work.ap[i * n + j] + work.ap[j * n + i] + noise - correction;
                dp[i * n + j] = entry;
                dp[j * n + i] = entry;
            }
        }

        self.plant.measurement(x, &work.no_noise, &mut work.innovation);
        for ((innovation, y), signal) in work.innovation.iter_mut().zip(y).zip(&self.plant.description().outputs) {
            *innovation = y - *innovation;
            if signal.wraps {
                *innovation = wrap(*innovation);
            }
        }
        self.plant.dynamics(x, u, &work.no_disturbance, dx);
        for (i, rate) in dx.iter_mut().enumerate() {
            *rate += (0..ny).map(|j| work.gain[i * ny + j] * work.innovation[j]).sum::<f64>();
        }
    }
}

/// product = left · right for row-ordered matrices; right has `inner` rows. Zeros of `left` are skipped: Jacobians are
/// mostly zeros.
fn multiply(left: &[f64], right: &[f64], inner: usize, product: &mut [f64]) {
    let columns = right.len() / inner;
    product.fill(0.0);
    for (row, out) in left.chunks_exact(inner).zip(product.chunks_exact_mut(columns)) {
        for (&factor, source) in row.iter().zip(right.chunks_exact(columns)) {
            if factor != 0.0 {
                for (sum, value) in out.iter_mut().zip(source) {
                    *sum += factor * value;
                }
            }
        }
    }
}
