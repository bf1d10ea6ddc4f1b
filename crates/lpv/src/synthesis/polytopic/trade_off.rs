//! Gain against optimum: what each share of the optimum that is given back buys.
//!
//! For shares β₁ < β₂ < … the designs of least effort with f ≥ f* − β|f*| ([`BackOff::Share`]), and for β = 0 the bare optimum, or of one that is not
//! attained what the solver came to. All of them follow from one first stage. τ falls as β grows, because the designs for a share are among those
//! for a larger one; the gain itself is bounded by τν and need not fall all the way.

use super::{BackOff, FirstStage, PolytopicDesign, Solution};
use crate::math::Mat;
use crate::math::eigen::{largest_singular_value, symmetric_eigenvalues};
use crate::math::matrix::cholesky_inverse;
use crate::synthesis::SynthesisError;

/// The curve of gain against optimum.
#[derive(Clone, Debug)]
pub struct TradeOff {
    /// f*, as the solver found it; of an optimum that is not attained what it came to.
    pub optimum: f64,
    /// Whether f* is the optimum to the solver's tolerance.
    pub is_attained: bool,
    /// One for each share, in the order asked.
    pub points: Vec<TradeOffPoint>,
}

/// A point of the curve.
#[derive(Clone, Debug)]
pub struct TradeOffPoint {
    /// β
    pub share: f64,
    /// The design; `None` where there is none for this share.
    pub design: Option<PolytopicDesign>,
    /// √τ: the largest √(uᵀRu) on {V ≤ 1}; of a high gain that of the low gain F, which is kept small; of stabilisation, which has no R, uᵀRu = Σⱼ ‖bⱼ‖²uⱼ².
    /// `None` without a design.
    pub effort: Option<f64>,
    /// The largest singular value of the Kᵢ; `None` without a design.
    pub gain: Option<f64>,
}

impl FirstStage {
    /// The design for each of `shares`, 0 ≤ β < 1. Nothing is proved of the designs beyond what [`PolytopicDesign::is_solved`] says: that of β = 0 is
    /// often neither.
    ///
    /// # Errors
    /// Problems without meaning. That the sampler allows no high gain for a share is no error but a point without design.
    pub fn trade_off(&self, shares: &[f64]) -> Result<TradeOff, SynthesisError> {
        let points: Vec<TradeOffPoint> = shares.iter().map(|&share| self.point(share)).collect::<Result<_, _>>()?;
        let moderation = points.iter().find_map(|point| point.design.as_ref()?.moderation.as_ref());
        let (optimum, is_attained) = match moderation {
            Some(moderation) => (moderation.optimum, moderation.is_attained),
            None => self.optimum()?,
        };
        Ok(TradeOff { optimum, is_attained, points })
    }

    /// √τ of a design of this stage: [`TradeOffPoint::effort`].
    pub fn effort(&self, solution: &Solution) -> f64 {
        let low = solution.auxiliary_gain.as_ref().unwrap_or(&solution.gain);
        self.r_inverse().map_or(f64::INFINITY, |r_inverse| largest_effort(low, &solution.y, &r_inverse))
    }

    fn point(&self, share: f64) -> Result<TradeOffPoint, SynthesisError> {
        let back_off = if share > 0.0 { BackOff::Share(share) } else { BackOff::Nothing };
        let design = match self.design(back_off) {
            Ok(design) => design,
            Err(SynthesisError::SampleTime { .. }) => return Ok(TradeOffPoint::without_design(share)),
            Err(error) => return Err(error),
        };
        // where no design is found for a share the optimum comes back as it is
        let is_asked = design.solution.is_some()
            && design.moderation.as_ref().map_or(share == 0.0, |moderation| moderation.back_off == share);
        Ok(match &design.solution {
            Some(solution) if is_asked => {
                let effort = Some(self.effort(solution));
                let gain = Some(solution.gain.iter().map(largest_singular_value).fold(0.0, f64::max));
                TradeOffPoint { share, effort, gain, design: Some(design) }
            }
            _ => TradeOffPoint::without_design(share),
        })
    }
}

impl TradeOffPoint {
    fn without_design(share: f64) -> Self {
        Self { share, design: None, effort: None, gain: None }
    }
}

/// √λ_max(R^½ Kᵢ Yᵢ Kᵢᵀ R^½), the largest of all vertices; zero for no gains, infinite where R⁻¹ is not definite.
pub(super) fn largest_effort(gains: &[Mat<f64>], y: &[Mat<f64>], r_inverse: &Mat<f64>) -> f64 {
    // R = GᵀG; by Cholesky's factors, which lose no digits where inputs differ much in size
    let Some(root) = cholesky_inverse(r_inverse) else { return f64::INFINITY };
    let at = |(k, y): (&Mat<f64>, &Mat<f64>)| {
        let weighted = &root * k;
        let effort = &weighted * y * weighted.transpose();
        symmetric_eigenvalues(&effort).into_iter().fold(0.0, f64::max).sqrt()
    };
    gains.iter().zip(y).map(at).fold(0.0, f64::max)
}
