//! What a verdict says, evaluated in exact arithmetic at single values of the parameter: every condition behind a
//! claim that is proved, and the motion behind one that is refuted.

use crate::exact::{Dyadic, Exact, lyapunov};
use lpv::certificate::{Claim, ClaimKind, Motion, Verdict, Witness};
use lpv::controller::InputLimits;
use lpv::synthesis::CostWeights;

/// Mixtures of rows beyond this many inputs are sampled.
const MOST_MIXED: usize = 5;

/// A loop with V = xᵀPx or xᵀY⁻¹x at one value of the parameter.
#[derive(Clone)]
pub struct Point {
    pub a: Exact,
    pub b: Exact,
    /// `v` is Y.
    pub inverse: bool,
    /// P or Y.
    pub v: Exact,
    /// ∂P/∂ρ or ∂Y/∂ρ; of a polytope it is not read.
    pub slope: Exact,
    /// Ṗ or Ẏ of each rate vertex of a polytope.
    pub turns: Vec<Exact>,
    /// K, or KY.
    pub high: Exact,
    /// F, or FY.
    pub low: Option<Exact>,
    /// The matrices are those of the claim up to this relative error; 0: exactly.
    pub slack: f64,
}

/// What does not depend on the parameter.
#[derive(Clone)]
pub struct Bounds {
    pub weights: Option<CostWeights>,
    /// σᵢ, exactly; `None` is no limit.
    pub sigma: Vec<Option<Dyadic>>,
}

impl Bounds {
    /// The smaller side of each input's limits around u*.
    pub fn of_limits(limits: &InputLimits, operating: &[f64], weights: &CostWeights) -> Self {
        let side = |limit: Option<f64>, at: f64, sign: f64| {
            let limit = limit.filter(|x| x.is_finite())?;
            Some(&(&Dyadic::from(limit) - &Dyadic::from(at)) * &Dyadic::from(sign))
        };
        let room = |i: usize| {
            let sides = [side(limits.min[i], operating[i], -1.0), side(limits.max[i], operating[i], 1.0)];
            sides.into_iter().flatten().reduce(|a, b| if a.exceeds(&b) { b } else { a })
        };
        Self { weights: Some(weights.clone()), sigma: (0..operating.len()).map(room).collect() }
    }

    pub fn of_sigma(sigma: &[f64], weights: Option<&CostWeights>) -> Self {
        let bound = |&x: &f64| x.is_finite().then(|| x.into());
        Self { weights: weights.cloned(), sigma: sigma.iter().map(bound).collect() }
    }
}

impl Point {
    fn row(&self, gain: &Exact, i: usize) -> Exact {
        Exact::from_fn(1, gain.columns, |_, j| gain.at(i, j).clone())
    }

    /// Rows of K where `is_high`, else of F: those that the inputs may lie between.
    fn mixed(&self, is_high: impl Fn(usize) -> bool) -> Exact {
        let Some(low) = &self.low else { return self.high.clone() };
        let (m, n) = (self.high.rows, self.high.columns);
        Exact::from_fn(m, n, |i, j| if is_high(i) { self.high.at(i, j).clone() } else { low.at(i, j).clone() })
    }

    /// Every mixture of rows, or K, F and some where there are too many.
    fn mixtures(&self, bounds: &Bounds) -> Vec<Exact> {
        let free: Vec<usize> = (0..self.high.rows).filter(|&i| bounds.sigma[i].is_some()).collect();
        if self.low.is_none() {
            return vec![self.high.clone()];
        }
        let chosen =
            |bits: u64| self.mixed(|i| free.iter().position(|&f| f == i).is_none_or(|at| bits >> (at % 64) & 1 == 1));
        if free.len() <= MOST_MIXED {
            return (0..1 << free.len()).map(chosen).collect();
        }
        [0, u64::MAX, 0x5555_5555_5555_5555, 0x3333_3333_3333_3333, 1, 2, 0x0f0f_0f0f_0f0f_0f0f].map(chosen).to_vec()
    }

    /// −(P(A − BS) + ·ᵀ), or −((AY − BSY) + ·ᵀ).
    fn flow(&self, s: &Exact) -> Exact {
        let bs = self.b.times(s);
        let flow = match self.inverse {
            false => self.v.times(&bs.minus(&self.a)),
            true => bs.minus(&self.a.times(&self.v)),
        };
        flow.with_transpose()
    }

    /// Q + SᵀRS, or YQY + (SY)ᵀRSY.
    fn stage(&self, s: &Exact, weights: &CostWeights) -> Exact {
        let (q, r) = (Exact::of(&weights.q), Exact::of(&weights.r));
        let state = if self.inverse { self.v.quadratic(&q) } else { q };
        state.plus(&s.quadratic(&r))
    }

    /// What the parameter's motion adds to the decrease, for each end of its rates.
    fn turning(&self, motion: &Motion) -> Vec<Exact> {
        let n = self.a.rows;
        match *motion {
            Motion::Bounded { rate } => {
                [-rate, rate].map(|rate| self.slope.by(if self.inverse { rate } else { -rate })).to_vec()
            }
            Motion::Hull => self.turns.clone(),
            _ => vec![Exact::zeros(n, n)],
        }
    }

    /// ≻ 0 within the error of this point's matrices, which is `slack` of `size` V.
    fn is_positive(&self, matrix: &Exact, size: f64) -> bool {
        if self.slack == 0.0 { matrix.is_positive() } else { matrix.plus(&self.v.by(self.slack * size)).is_positive() }
    }

    /// Whether the condition behind a claim holds here; `None` of claims that are not looked at.
    pub fn holds(&self, kind: &ClaimKind, bounds: &Bounds) -> Option<bool> {
        let decreases = |motion: &Motion, cost: Option<f64>| {
            let factor = cost.unwrap_or(1.0);
            self.mixtures(bounds).iter().all(|s| {
                self.turning(motion).iter().all(|turning| {
                    let flow = self.flow(s).plus(turning).by(factor);
                    match (cost, &bounds.weights) {
                        (Some(_), Some(weights)) => self.is_positive(&flow.minus(&self.stage(s, weights)), factor),
                        _ => self.is_positive(&flow, 1.0),
                    }
                })
            })
        };
        match kind {
            ClaimKind::Weights => {
                let weights = bounds.weights.as_ref()?;
                let (q, r) = (Exact::of(&weights.q), Exact::of(&weights.r));
                let is_cost = |q: &Exact, r: &Exact| q.is_symmetric() && r.is_symmetric() && r.is_positive();
                // principal minors are for a few rows; of more a diagonal Q is looked at
                let state = if q.rows <= 6 { q.is_semidefinite() } else { (0..q.rows).all(|i| q.at(i, i).sign() >= 0) };
                Some(is_cost(&q, &r) && state)
            }
            ClaimKind::LyapunovDefinite => Some(self.v.is_symmetric() && self.v.is_positive()),
            ClaimKind::Unsaturated { level } => {
                let low = self.low.as_ref();
                Some((0..self.high.rows).all(|i| {
                    let Some(sigma) = &bounds.sigma[i] else { return true };
                    let row = self.row(low.unwrap_or(&self.high), i);
                    if (0..row.columns).all(|j| row.at(0, j).sign() == 0) {
                        return true;
                    }
                    // σ²P − γfᵀf ≻ 0
                    let ball = self.v.scaled(&sigma.square()).minus(&row.t().times(&row).by(*level));
                    let size = self.v.scaled(&sigma.square()).by(self.slack);
                    if self.slack == 0.0 { ball.is_positive() } else { ball.plus(&size).is_positive() }
                }))
            }
            ClaimKind::Decrease { motion } | ClaimKind::Invariance { motion, .. } => Some(decreases(motion, None)),
            ClaimKind::Cost { factor, motion, .. } => Some(decreases(motion, Some(*factor))),
            _ => None,
        }
    }

    /// Px, K x and their common denominator, for a state x.
    fn image(&self, x: &Exact) -> (Exact, Exact, Dyadic) {
        match self.inverse {
            false => (self.v.times(x), self.high.times(x), 1.0.into()),
            true => {
                let (z, d) = self.v.solve(x);
                let input = self.high.times(&z);
                (z, input, d)
            }
        }
    }

    /// Whether the witness breaks the claim, and only with what it may.
    pub fn breaks(&self, kind: &ClaimKind, witness: &Witness, bounds: &Bounds) -> Result<(), String> {
        let x = Exact::column(&witness.state);
        let (px, u, d) = self.image(&x);
        if d.sign() == 0 {
            return Err("Y is singular at the witness".into());
        }
        // V d
        let v = x.t().times(&px).scalar();
        let v = if d.sign() < 0 { -&v } else { v };
        let limited = || (0..u.rows).filter_map(|i| Some((u.at(i, 0), bounds.sigma[i].as_ref()?)));
        let slack = &v.abs() * &Dyadic::from(self.slack);
        let grows = || {
            // d² V̇ = 2(Px)ᵀ(dAx − Bu) and what turns
            let flow = self.a.times(&x).scaled(&d).minus(&self.b.times(&u));
            let along = &px.t().times(&flow).scalar() * &2.0.into();
            let turning = match (self.inverse, witness.vertex_rates.is_empty()) {
                (false, true) => &self.slope.by(witness.rate).form(&x) * &d.square(),
                (true, true) => -&self.slope.by(witness.rate).form(&px),
                (_, false) => {
                    let at = self.turns.len() - 1;
                    -&self.turns[at].form(&px)
                }
            };
            &(&along + &turning) + &(&slack * &d.abs())
        };
        let is_said = |holds: bool, word: &str| if holds { Ok(()) } else { Err(word.to_owned()) };
        match kind {
            // of Y the direction z is shown as x = Yz, so that V d = zᵀ(d Y)z
            ClaimKind::LyapunovDefinite => {
                let form = if self.inverse { &x.t().times(&px).scalar() * &d } else { self.v.form(&x) };
                is_said(form.sign() <= 0, "V is positive at the witness")
            }
            ClaimKind::Unsaturated { level } => {
                let row_of = |i: usize| match (&self.low, self.inverse) {
                    (Some(low), false) => low.times(&x).at(i, 0).clone(),
                    (Some(low), true) => low.times(&px).at(i, 0).clone(),
                    (None, _) => u.at(i, 0).clone(),
                };
                // (fx)² γ > σ² V, times d²
                let passes = |i: usize| {
                    let Some(sigma) = &bounds.sigma[i] else { return false };
                    let (left, right) =
                        (&row_of(i).square() * &Dyadic::from(*level), &(&sigma.square() * &v) * &d.abs());
                    (&left + &(&right.abs() * &Dyadic::from(self.slack))).exceeds(&right)
                };
                is_said((0..u.rows).any(passes), "no limit is passed at the witness")
            }
            ClaimKind::Decrease { .. } | ClaimKind::Invariance { .. } => {
                if let ClaimKind::Invariance { level, .. } = kind {
                    let exact = &Dyadic::from(*level) * &d.abs();
                    let off = (&v - &exact).abs();
                    is_said(
                        !off.exceeds(&(&exact * &Dyadic::from(1e-12))),
                        "the witness is not on the edge of the set",
                    )?;
                }
                let within = limited().all(|(u, sigma)| !u.abs().exceeds(&(sigma * &d.abs())));
                is_said(within, "an input is beyond its limit at the witness")?;
                is_said(grows().sign() > 0, "V does not grow at the witness")
            }
            ClaimKind::Cost { factor, .. } => {
                let weights = bounds.weights.as_ref().ok_or("a cost without weights")?;
                // K d, with d = det Y
                let (k, d) = match self.inverse {
                    false => (self.high.clone(), Dyadic::from(1.0)),
                    true => {
                        let (inverse, d) = self.v.solve(&Exact::identity(self.v.rows));
                        (self.high.times(&inverse), d)
                    }
                };
                // |d| A_c with d²(Q + KᵀRK) is the same loop in another time: its cost matrix is |d| X
                let flow = self.a.scaled(&d).minus(&self.b.times(&k));
                let stage = Exact::of(&weights.q).scaled(&d.square()).plus(&k.quadratic(&Exact::of(&weights.r)));
                let flow = if d.sign() < 0 { flow.by(-1.0) } else { flow };
                let (numerator, denominator) = lyapunov(&flow, &stage);
                let numerator = numerator.by(f64::from(denominator.sign()));
                let is_stable = denominator.sign() != 0 && numerator.is_positive();
                if !is_stable {
                    // an infinite cost is more than any; but then no limit may be in the way
                    return is_said(limited().next().is_none(), "the loop is not stable, and inputs are limited");
                }
                // xᵀXx = form/(|denominator| |d|) against κ v/|d|
                let cost = numerator.form(&x);
                let bound = &(&v * &Dyadic::from(*factor)) * &denominator.abs();
                is_said(
                    (&cost + &(&bound.abs() * &Dyadic::from(self.slack))).exceeds(&bound),
                    "the motion from the witness does not cost more",
                )
            }
            _ => Ok(()),
        }
    }
}

/// What a claim has to rest on to be proved.
fn needed(kind: &ClaimKind) -> &'static [&'static str] {
    match kind {
        ClaimKind::Unsaturated { .. } | ClaimKind::Decrease { .. } => &["lyapunov-definite"],
        ClaimKind::Invariance { .. } | ClaimKind::SampledInvariance { .. } => &["lyapunov-definite", "unsaturated"],
        ClaimKind::Cost { level: None, .. } | ClaimKind::SampledCost { level: None, .. } => {
            &["weights", "lyapunov-definite"]
        }
        ClaimKind::SampledCost { level: Some(_), .. } => &["weights", "lyapunov-definite", "unsaturated"],
        ClaimKind::Cost { level: Some(_), .. } => &["weights", "lyapunov-definite", "unsaturated", "invariance"],
        _ => &[],
    }
}

/// Nothing is proved without what it rests on.
pub fn check_premises(claims: &[Claim]) -> Result<(), String> {
    for claim in claims.iter().filter(|claim| claim.verdict == Verdict::Proved) {
        for name in needed(&claim.kind) {
            let stands = claims.iter().any(|other| {
                other.id.name == *name && other.id.subject == claim.id.subject && other.verdict == Verdict::Proved
            });
            if !stands {
                return Err(format!("{} is proved and {name} is not", claim.id));
            }
        }
        let level = |claim: &Claim| match claim.kind {
            ClaimKind::Unsaturated { level } | ClaimKind::Invariance { level, .. } => Some(level),
            _ => None,
        };
        let of = |name: &str| claims.iter().find(|other| other.id.name == name && other.id.subject == claim.id.subject);
        let unsaturated = of("unsaturated").and_then(level);
        if let (Some(level), Some(unsaturated)) = (level(claim), unsaturated)
            && level > unsaturated
        {
            return Err(format!("{} is about a larger set than is unsaturated", claim.id));
        }
    }
    Ok(())
}

/// Every claim that is proved holds at these points, and what it rests on stands; every claim that is refuted is
/// broken at its witness. Counts the witnesses.
pub fn check(
    claims: &[Claim],
    bounds: &Bounds,
    points: &[Point],
    at_witness: &dyn Fn(&Witness) -> Point,
) -> Result<usize, String> {
    check_premises(claims)?;
    let mut witnesses = 0;
    for claim in claims {
        match claim.verdict {
            Verdict::Proved => {
                let at = points.iter().position(|point| point.holds(&claim.kind, bounds) == Some(false));
                if let Some(at) = at {
                    return Err(format!("{} is proved and false at point {at}: {}", claim.id, claim.claim));
                }
            }
            Verdict::Refuted => {
                let holds_weights = points[0].holds(&ClaimKind::Weights, bounds);
                match &claim.witness {
                    None if claim.kind == ClaimKind::Weights && holds_weights == Some(false) => {}
                    None => return Err(format!("{} is refuted without a witness", claim.id)),
                    Some(witness) => at_witness(witness)
                        .breaks(&claim.kind, witness, bounds)
                        .map_err(|reason| format!("{} is refuted, but {reason}: {witness:?}", claim.id))?,
                }
                // a step of the sampled loop is taken where the loop is known
                witnesses += usize::from(!matches!(
                    claim.kind,
                    ClaimKind::SampledStability { .. } | ClaimKind::SampledInvariance { .. }
                ));
            }
            _ => {}
        }
    }
    Ok(witnesses)
}
