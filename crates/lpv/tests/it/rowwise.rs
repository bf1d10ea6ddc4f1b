//! High gains proved row by row: what is proved is true of every mixture of rows, and nothing is lost on the segment that the synthesis takes.

use crate::numbers::Numbers;
use lpv::certificate::{
    Claim, ClaimKind, PolytopicClaim, PolytopicLyapunov, ProofOptions, Proofs, Verdict, prove, prove_polytopic,
};
use lpv::controller::{Controller, InputLimits, Schedule};
use lpv::math::Mat;
use lpv::math::eigen::smallest_eigenvalue;
use lpv::math::matrix::{diagonal, identity, symmetric_part, to_rows};
use lpv::math::riccati;
use lpv::model::Polytope;
use lpv::plant::{LinearParameters, PlantSpec};
use lpv::synthesis::polytopic::InputBounds;
use lpv::synthesis::{CostWeights, Design, FrozenDesign, HighGainOptions, Method};

/// A loop with a high gain: ẋ = Ax − Bs, s between Fx and Kx.
struct Case {
    a: Mat<f64>,
    b: Mat<f64>,
    weights: CostWeights,
    p: Mat<f64>,
    f: Mat<f64>,
    k: Mat<f64>,
}

impl Case {
    /// With P a little more than the Riccati solution and F a share of the optimal gain, K on the segments with these s from it.
    fn on_the_segment(numbers: &mut Numbers, n: usize, m: usize, s: impl Fn(&mut Numbers) -> f64) -> Self {
        let (a, b) = (numbers.matrix(n, n), numbers.matrix(n, m));
        let r: Vec<f64> = (0..m).map(|_| 10.0_f64.powf(2.0 * numbers.next())).collect();
        let weights = CostWeights { q: identity(n), r: diagonal(&r) };
        let p = symmetric_part(&(1.05 * riccati::solve(&a, &b, &weights.q, &weights.r).unwrap().p));
        let optimal = Mat::from_fn(m, n, |i, j| (0..n).map(|l| b[(l, i)] * p[(l, j)]).sum::<f64>() / r[i]);
        let share: Vec<f64> = (0..m).map(|_| 1.0 + 0.2 * numbers.next()).collect();
        let s: Vec<f64> = (0..m).map(|_| s(numbers)).collect();
        let f = Mat::from_fn(m, n, |i, j| share[i] * optimal[(i, j)] + 0.01 * numbers.next());
        let k = Mat::from_fn(m, n, |i, j| f[(i, j)] + s[i] * (optimal[(i, j)] - f[(i, j)]));
        Self { a, b, weights, p, f, k }
    }

    /// λ_min of −κV̇ − c(cost) with the gain `s`, relative to P.
    fn margin(&self, s: &Mat<f64>, cost: f64) -> f64 {
        let flow = &self.p * (&self.a - &self.b * s);
        let stage = &self.weights.q + s.transpose() * &self.weights.r * s;
        let m = -1.0 * (&flow + flow.transpose()) - cost * stage;
        smallest_eigenvalue(&symmetric_part(&m)) / self.p.norm_max().max(1.0)
    }

    /// The least margin of all mixtures.
    fn least_margin(&self, cost: f64) -> f64 {
        let (m, n) = (self.k.nrows(), self.k.ncols());
        let mixture =
            |bits: usize| Mat::from_fn(m, n, |i, j| if bits >> i & 1 == 1 { self.k[(i, j)] } else { self.f[(i, j)] });
        (0..1_usize << m).map(|bits| self.margin(&mixture(bits), cost)).fold(f64::INFINITY, f64::min)
    }

    /// The claims, with σ of every input; the level is so small that F does not saturate.
    fn claims(&self, sigma: Vec<f64>) -> Vec<Claim> {
        prove_polytopic(&PolytopicClaim {
            polytope: Polytope::new(vec![self.a.clone()], vec![self.b.clone()]).unwrap(),
            lyapunov: PolytopicLyapunov::Common { p: self.p.clone(), gain: vec![self.k.clone()] },
            auxiliary_gain: Some(vec![self.f.clone()]),
            weights: Some(self.weights.clone()),
            saturation: Some(InputBounds { sigma, gamma: 1e-9 }),
        })
    }

    fn limited(&self) -> Vec<Claim> {
        self.claims(vec![1.0; self.k.nrows()])
    }

    /// The same as a design of a plant.
    fn proofs(&self, nonlinear: bool) -> Proofs {
        let inputs = self.k.nrows();
        let plant = PlantSpec::Linear(LinearParameters { a: to_rows(&self.a), b: to_rows(&self.b), c: None });
        let limits = InputLimits { min: vec![Some(-1.0); inputs], max: vec![Some(1.0); inputs] };
        let design = Design {
            name: "high-gain".into(),
            convention: String::new(),
            plant: plant.clone(),
            model_hash: None,
            method: Method::HighGainSlpvqr { gamma: 1e-9, high_gain: HighGainOptions::default() },
            weights: self.weights.clone(),
            sample_time_s: 1e-3,
            controller: Controller {
                schedule: Schedule::Constant { gain: self.k.clone() },
                scheduling_state: None,
                limits,
                operating_input: vec![0.0; inputs],
                supervisor: None,
            },
            schedule_error: 0.0,
            back_off: 0.0,
            points: vec![FrozenDesign {
                rho: 0.0,
                gain: self.k.clone(),
                auxiliary_gain: Some(self.f.clone()),
                trace_y: 0.0,
                p: self.p.clone(),
                riccati_difference: None,
                iterations: 0,
            }],
            rate_bounded: None,
            inner: Vec::new(),
        };
        prove(&design, &*plant.build().unwrap(), &ProofOptions { nonlinear, ..ProofOptions::default() }).unwrap()
    }
}

fn claim<'a>(claims: &'a [Claim], name: &str) -> &'a Claim {
    claims.iter().find(|claim| claim.id.to_string() == name).unwrap_or_else(|| panic!("no {name}: {claims:?}"))
}

fn is_proved(claims: &[Claim], name: &str) -> bool {
    claim(claims, name).verdict == Verdict::Proved
}

/// The cost bound with factor 1 exactly.
fn costs_at_most_v(claims: &[Claim]) -> bool {
    is_proved(claims, "cost") && matches!(claim(claims, "cost").kind, ClaimKind::Cost { factor: 1.0, .. })
}

/// Gains far from the segment, and R that couples the inputs: what is proved holds for every mixture; what every mixture has with a margin is
/// proved, by rows or by mixtures.
#[test]
fn what_is_proved_holds_for_every_mixture() {
    let mut numbers = Numbers(3);
    let (mut by_rows, mut by_mixtures, mut not) = (0, 0, 0);
    for case in 0..600 {
        let (n, m) = (1 + case % 3, 1 + case % 4);
        let size = 2.0_f64.powi(-(case as i32 % 8));
        let mut of = Case::on_the_segment(&mut numbers, n, m, |numbers| 1.0 + 1.2 * numbers.next());
        of.k = &of.k + size * numbers.matrix(m, n);
        of.f = &of.f + 0.2 * size * numbers.matrix(m, n);
        if case % 5 == 0 {
            let couple = numbers.matrix(m, m);
            let r = &of.weights.r;
            let coupled = |i: usize, j: usize| 0.2 * (r[(i, i)] * r[(j, j)]).sqrt() * couple[(i.min(j), i.max(j))];
            of.weights.r = Mat::from_fn(m, m, |i, j| if i == j { r[(i, i)] } else { coupled(i, j) });
        }
        let claims = of.limited();
        assert!(is_proved(&claims, "unsaturated") && is_proved(&claims, "weights"), "case {case}: {claims:?}");
        let margins = [of.least_margin(0.0), of.least_margin(1.0)];
        let proved = [is_proved(&claims, "invariance"), costs_at_most_v(&claims)];
        for (margin, proved) in margins.into_iter().zip(proved) {
            assert!(margin > -1e-12 || !proved, "case {case}: margin {margin} and proved");
            assert!(margin < 1e-9 || proved, "case {case}: margin {margin} and not proved");
        }
        match (proved[0], claim(&claims, "invariance").cells) {
            (true, 1) => by_rows += 1,
            (true, _) => by_mixtures += 1,
            (false, _) => not += 1,
        }
    }
    let counts = format!("{by_rows} by rows, {by_mixtures} by mixtures, {not} not");
    assert!(by_rows > 200 && not > 20, "{counts}: the test tests something");
    assert!(10 * by_mixtures < by_rows, "{counts}: rows lose little");
}

/// On the segment K = F + s(R⁻¹BᵀP − F), 0 < s < 2, with an s of its own for each row, one matrix proves what is true of F.
#[test]
fn nothing_is_lost_on_the_segment() {
    let mut numbers = Numbers(17);
    for case in 0..200 {
        let (n, m) = (1 + case % 4, [1, 2, 4, 10, 11][case % 5]);
        let of = Case::on_the_segment(&mut numbers, n, m, |numbers| 10.0_f64.powf(1.8 * numbers.next() - 1.55));
        let claims = of.limited();
        let margin = of.margin(&of.f, 1.0);
        assert_eq!(margin > 1e-7, costs_at_most_v(&claims), "case {case}, m = {m}: {margin}, {claims:?}");
        assert!(is_proved(&claims, "invariance") || margin < 1e-7, "case {case}: {claims:?}");
        if margin > 1e-7 {
            assert_eq!([claim(&claims, "invariance").cells, claim(&claims, "cost").cells], [1, 1]);
        }
    }
}

/// A design of a plant and a polytope of one vertex are proved alike, for as many inputs as there are; and the nonlinear claims, which try
/// mixtures, say so where there are too many.
#[test]
fn inputs_are_not_counted() {
    let mut numbers = Numbers(23);
    for m in [1, 4, 10, 11, 64, 70] {
        let of = Case::on_the_segment(&mut numbers, 6, m, |_| 0.3);
        let claims = of.limited();
        let proofs = of.proofs(false);
        assert!(of.margin(&of.f, 1.0) > 1e-7);
        for name in ["invariance", "cost"] {
            assert_eq!(claim(&claims, name).verdict, Verdict::Proved, "m = {m}: {claims:?}");
            assert_eq!(claim(&proofs.claims, name).verdict, Verdict::Proved, "m = {m}: {:?}", proofs.claims);
            assert_eq!(claim(&proofs.claims, name).cells, 1);
        }
    }
    let many = Case::on_the_segment(&mut numbers, 3, 70, |_| 0.3).proofs(true);
    assert_ne!(claim(&many.claims, "plant.invariance").verdict, Verdict::Refuted);
}

/// K with one row of the wrong sign, large enough that V grows: neither is proved, however many inputs there are. The loop of K itself is
/// a motion that leaves the set, and refutes where it does so before the wrong input is at its limit.
#[test]
fn one_row_of_the_wrong_sign_is_seen() {
    let mut numbers = Numbers(31);
    let mut refuted = 0;
    for m in [1, 2, 4, 10, 11, 63, 64, 65, 70] {
        for row in [0, m / 2, m - 1] {
            let mut of = Case::on_the_segment(&mut numbers, 3, m, |_| 0.5);
            (0..3).for_each(|j| of.k[(row, j)] *= -1e3);
            // large enough that V grows with K itself
            if of.margin(&of.k, 0.0) > -1e-9 {
                continue;
            }
            for claims in [of.limited(), of.proofs(false).claims] {
                assert!(!is_proved(&claims, "invariance") && !is_proved(&claims, "cost"), "m = {m}: {claims:?}");
                refuted += usize::from(claim(&claims, "invariance").verdict == Verdict::Refuted);
            }
        }
    }
    assert!(refuted > 10, "{refuted} of 54 refuted");
}

/// F of an input without a limit does not count, nor does that of the others make it fly: K is judged there.
#[test]
fn inputs_without_a_limit_fly_k() {
    let mut numbers = Numbers(41);
    for case in 0..60 {
        let m = 1 + case % 3;
        let mut of = Case::on_the_segment(&mut numbers, 2, m, |_| 0.5);
        let free = case % m;
        let mut sigma = vec![1.0; m];
        sigma[free] = f64::INFINITY;
        (0..2).for_each(|j| of.f[(free, j)] = of.k[(free, j)]);
        let margin = of.least_margin(1.0);
        // an F that would prove nothing, where it is not to be read
        (0..2).for_each(|j| of.f[(free, j)] = -100.0 * of.k[(free, j)]);
        assert_eq!(margin > 1e-7, costs_at_most_v(&of.claims(sigma.clone())), "case {case}: {margin}");
        // and a K that is bad there is bad
        (0..2).for_each(|j| of.k[(free, j)] *= -1e3);
        assert!(!is_proved(&of.claims(sigma), if m == 1 { "decrease" } else { "invariance" }), "case {case}");
    }
}

/// Numbers at the ends of the range of doubles: none makes a false claim true.
#[test]
fn extreme_numbers_prove_nothing_false() {
    let mut numbers = Numbers(43);
    let extremes = [0.0, -0.0, f64::from_bits(1), -f64::from_bits(1), 1e-300, 1e150, 1e300, -1e300, f64::MAX];
    for (case, &x) in extremes.iter().enumerate() {
        for scaled in [1.0, 1e-150, 1e150] {
            let mut of = Case::on_the_segment(&mut numbers, 2, 2, |_| 0.5);
            of.p = scaled * &of.p;
            of.k[(case % 2, 0)] = x;
            of.weights.r[(0, 0)] *= scaled;
            let claims = of.limited();
            let margins = [of.least_margin(0.0), of.least_margin(1.0)];
            for (name, margin) in ["invariance", "cost"].into_iter().zip(margins) {
                assert!(!is_proved(&claims, name) || margin > -1e-9, "{x}, {scaled}: {margin}, {claims:?}");
            }
        }
    }
    // K is F to the last bit but one entry, which differs by one: the row counts
    let mut of = Case::on_the_segment(&mut numbers, 2, 2, |_| 0.0);
    of.k = of.f.clone();
    assert!(costs_at_most_v(&of.limited()));
    of.k[(1, 1)] = of.k[(1, 1)].next_up();
    assert!(costs_at_most_v(&of.limited()));
}
