//! Frozen stability of the closed loop over a fine grid of the parameter, continuous and sampled.

use crate::math::Mat;
use crate::math::eigen::{spectral_abscissa, spectral_radius};
use crate::math::hold::discretize;
use crate::model::{linearize, parameter_grid};
use crate::plant::Plant;
use crate::synthesis::Design;
use rayon::prelude::*;

/// The worst frozen closed loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StabilityMargin {
    /// max Re λ(A − BK), 1/s; negative when stable.
    pub abscissa: f64,
    /// Parameter at which it is attained.
    pub abscissa_at: f64,
    /// max |λ(A_d − B_dK)| of the zero-order-hold loop; below one when stable.
    pub radius: f64,
    /// Parameter at which it is attained.
    pub radius_at: f64,
}

/// The worst eigenvalues of the frozen closed loop over `count` parameter values, with the scheduled gain.
pub fn frozen_stability(design: &Design, plant: &dyn Plant, count: usize) -> StabilityMargin {
    let parameters = parameter_grid(plant.description().scheduling.as_ref(), count);
    let margins: Vec<StabilityMargin> = parameters
        .into_par_iter()
        .map(|rho| {
            let model = linearize(plant, rho);
            let k = design.controller.schedule.gain_matrix(rho);
            let (ad, bd) = discretize(&model.a, &model.b, design.sample_time_s);
            let closed = |a: &Mat<f64>, b: &Mat<f64>| a - b * &k;
            StabilityMargin {
                abscissa: spectral_abscissa(&closed(&model.a, &model.b)),
                abscissa_at: rho,
                radius: spectral_radius(&closed(&ad, &bd)),
                radius_at: rho,
            }
        })
        .collect();
    margins.into_iter().reduce(worst).unwrap_or(StabilityMargin {
        abscissa: f64::NAN,
        abscissa_at: f64::NAN,
        radius: f64::NAN,
        radius_at: f64::NAN,
    })
}

/// The worse of two, separately for abscissa and radius; NaN is the worst. Of two that differ by rounding only, as all points
/// of a symmetric plant do, the one nearer to parameter zero is named.
fn worst(a: StabilityMargin, b: StabilityMargin) -> StabilityMargin {
    const SAME: f64 = 1e-9;
    let of_two = |a: (f64, f64), b: (f64, f64)| {
        let is_same = (a.0 - b.0).abs() <= SAME * a.0.abs();
        let second = if is_same { b.1.abs() < a.1.abs() } else { b.0.is_nan() || b.0 > a.0 };
        if second { b } else { a }
    };
    let (abscissa, abscissa_at) = of_two((a.abscissa, a.abscissa_at), (b.abscissa, b.abscissa_at));
    let (radius, radius_at) = of_two((a.radius, a.radius_at), (b.radius, b.radius_at));
    StabilityMargin { abscissa, abscissa_at, radius, radius_at }
}
