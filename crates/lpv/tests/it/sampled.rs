//! The saturated sampled loop: what is proved no motion contradicts, what is refuted a motion does, and the edge between is where it should be.

use crate::numbers::Numbers;
use lpv::certificate::{Claim, ProofOptions, Proofs, Verdict, lyapunov_matrix, prove};
use lpv::controller::{Controller, InputLimits, Schedule};
use lpv::math::Mat;
use lpv::math::hold::discretize;
use lpv::math::matrix::{diagonal, from_rows, identity, inverse_spd, quadratic_form, symmetric_part, to_rows};
use lpv::math::riccati;
use lpv::model::linearize;
use lpv::plant::{LinearParameters, PlantSpec};
use lpv::synthesis::{
    CostWeights, Design, DesignRequest, FrozenDesign, HighGainOptions, Method, RateBoundedOptions, ScheduleKind, design,
};

/// ẋ = Ax − B sat(Kx), sampled every T, with V = xᵀPx and a low gain F where there is one.
#[derive(Clone)]
struct Loop {
    a: Mat<f64>,
    b: Mat<f64>,
    p: Mat<f64>,
    f: Option<Mat<f64>>,
    k: Mat<f64>,
    limits: InputLimits,
    level: f64,
    sample_time_s: f64,
}

impl Loop {
    /// ẋ = ax − sat(kx) with |sat| ≤ σ, V = x² and the level 1.
    fn scalar(a: f64, f: Option<f64>, k: f64, sigma: f64, sample_time_s: f64) -> Self {
        let of = |x: f64| from_rows(&[vec![x]]);
        Self {
            a: of(a),
            b: of(1.0),
            p: of(1.0),
            f: f.map(of),
            k: of(k),
            limits: InputLimits { min: vec![Some(-sigma)], max: vec![Some(sigma)] },
            level: 1.0,
            sample_time_s,
        }
    }

    /// With P of a regulator and F a little off its gain, K some way towards higher gains; limits are not the same to both sides, and
    /// some inputs have none. The level is the largest on which F does not saturate, and a little less.
    fn random(numbers: &mut Numbers, n: usize, m: usize) -> Self {
        let (a, b) = (numbers.matrix(n, n), numbers.matrix(n, m));
        let r = diagonal(&(0..m).map(|_| 10.0_f64.powf(numbers.next())).collect::<Vec<f64>>());
        let regulator = riccati::solve(&a, &b, &identity(n), &r).unwrap();
        let p = symmetric_part(&regulator.p);
        let reach = 10.0_f64.powf(1.0 + numbers.next());
        let gain = Mat::from_fn(m, n, |i, j| (0..n).map(|l| b[(l, i)] * p[(l, j)]).sum::<f64>() / r[(i, i)]);
        let f = &gain + 0.05 * numbers.matrix(m, n);
        let k = reach * &gain + 0.1 * numbers.matrix(m, n);
        let bound = |numbers: &mut Numbers| Some(1.0 + 0.5 * numbers.next());
        let mut limits = InputLimits {
            min: (0..m).map(|_| bound(numbers).map(|x| -x)).collect(),
            max: (0..m).map(|_| bound(numbers)).collect(),
        };
        if m > 1 && numbers.next() > 0.0 {
            (limits.min[0], limits.max[0]) = (None, None);
        }
        let (inverse, sigma) = (inverse_spd(&p).unwrap(), limits.room(&vec![0.0; m]));
        let of_input = |i: usize| {
            let row: Vec<f64> = (0..n).map(|j| f[(i, j)]).collect();
            sigma[i].powi(2) / quadratic_form(&inverse, &row)
        };
        let level = 0.99 * (0..m).map(of_input).fold(f64::INFINITY, f64::min);
        let sample_time_s = 10.0_f64.powf(-1.5 + numbers.next());
        Self { a, b, p, f: Some(f), k, limits, level, sample_time_s }
    }

    fn proofs(&self) -> Proofs {
        let (n, m) = (self.b.nrows(), self.b.ncols());
        let plant = PlantSpec::Linear(LinearParameters { a: to_rows(&self.a), b: to_rows(&self.b), c: None });
        let gamma = self.level;
        let method = match self.f {
            Some(_) => Method::HighGainSlpvqr { gamma, high_gain: HighGainOptions::default() },
            None => Method::Slpvqr { gamma },
        };
        let design = Design {
            name: "sampled".into(),
            convention: String::new(),
            plant: plant.clone(),
            model_hash: None,
            method,
            weights: CostWeights { q: identity(n), r: identity(m) },
            sample_time_s: self.sample_time_s,
            controller: Controller {
                schedule: Schedule::Constant { gain: self.k.clone() },
                scheduling_state: None,
                limits: self.limits.clone(),
                operating_input: vec![0.0; m],
                supervisor: None,
            },
            schedule_error: 0.0,
            back_off: 0.0,
            points: vec![FrozenDesign {
                rho: 0.0,
                gain: self.k.clone(),
                auxiliary_gain: self.f.clone(),
                trace_y: 0.0,
                p: self.p.clone(),
                riccati_difference: None,
                iterations: 0,
            }],
            rate_bounded: None,
            inner: Vec::new(),
        };
        prove(&design, &*plant.build().unwrap(), &ProofOptions::default()).unwrap()
    }

    fn claim(&self) -> Claim {
        sampled(&self.proofs()).clone()
    }

    fn verdict(&self) -> Verdict {
        self.claim().verdict
    }

    fn v(&self, x: &[f64]) -> f64 {
        quadratic_form(&self.p, x)
    }

    /// Where x is after `time_s` of holding the input.
    fn after(&self, x: &[f64], time_s: f64) -> Vec<f64> {
        let mut u: Vec<f64> =
            (0..self.k.nrows()).map(|i| -(0..x.len()).map(|j| self.k[(i, j)] * x[j]).sum::<f64>()).collect();
        self.limits.saturate(&mut u);
        let (a, b) = discretize(&self.a, &self.b, time_s);
        let row = |i: usize| {
            (0..x.len()).map(|j| a[(i, j)] * x[j]).sum::<f64>()
                + u.iter().enumerate().map(|(l, u)| b[(i, l)] * u).sum::<f64>()
        };
        (0..x.len()).map(row).collect()
    }

    /// A state of the set, half of the time on its edge.
    fn state(&self, numbers: &mut Numbers) -> Vec<f64> {
        let x: Vec<f64> = (0..self.a.nrows()).map(|_| numbers.next()).collect();
        let share = if numbers.next() > 0.0 { 1.0 } else { numbers.next().abs() };
        let scale = share * (self.level / self.v(&x)).sqrt();
        x.iter().map(|x| scale * x).collect()
    }
}

fn sampled(proofs: &Proofs) -> &Claim {
    claim(proofs, "sampled-invariance")
}

fn claim<'a>(proofs: &'a Proofs, name: &str) -> &'a Claim {
    proofs.claims.iter().find(|claim| claim.id.to_string() == name).unwrap_or_else(|| panic!("no {name}: {proofs:?}"))
}

/// Random loops: of what is proved no motion of many leaves the set, at samples and where it is said between them; of what is refuted the
/// motion from the witness does.
#[test]
fn motions_agree_with_the_verdicts() {
    let mut numbers = Numbers(5);
    let mut counts = [0; 3];
    for case in 0..400 {
        let of = Loop::random(&mut numbers, 1 + case % 3, 1 + case / 3 % 3);
        let claim = of.claim();
        match claim.verdict {
            Verdict::Proved => {
                let between = claim.detail.starts_with("at the samples and between them");
                for _ in 0..100 {
                    let x = of.state(&mut numbers);
                    let share = if between { 0.5 + 0.5 * numbers.next() } else { 1.0 };
                    let now = of.v(&of.after(&x, share * of.sample_time_s));
                    assert!(now <= of.v(&x) * (1.0 + 1e-9), "case {case}: V from {} to {now}", of.v(&x));
                }
                counts[0] += 1;
            }
            Verdict::Refuted => {
                let x = &claim.witness.as_ref().unwrap().state;
                let (now, next) = (of.v(x), of.v(&of.after(x, of.sample_time_s)));
                assert!(now <= of.level * (1.0 + 1e-12) && next > of.level, "case {case}: {now}, {next}, {}", of.level);
                counts[1] += 1;
            }
            _ => {
                // as far as motions tell
                let leaves = (0..100).any(|_| of.v(&of.after(&of.state(&mut numbers), of.sample_time_s)) > of.level);
                counts[2] += usize::from(leaves);
            }
        }
    }
    let [proved, refuted, missed] = counts;
    assert!(proved > 100 && refuted > 40, "{counts:?}: the test tests something");
    assert!(10 * missed <= refuted, "{counts:?}: motions that leave the set are found");
}

/// ẋ = ax − kx held for T, not saturated in the set: x₊ = −x at e^{aT} = (k + a)/(k − a), or T = 2/k for a = 0. With a low gain beside
/// it, and without.
#[test]
fn the_edge_of_a_scalar_loop_is_found() {
    for (a, k) in [(0.0, 2.0), (1.0, 2.0), (-1.0, 3.0), (2.5, 3.0), (-0.01, 50.0)] {
        let edge = if a == 0.0 { 2.0 / k } else { f64::ln((k + a) / (k - a)) / a };
        for f in [None, Some(k), Some(0.5 * (k + a.max(0.0)))] {
            let at = |share: f64| Loop::scalar(a, f, k, 1.001 * k, share * edge);
            assert_eq!(at(1.0 - 1e-6).verdict(), Verdict::Proved, "a = {a}, k = {k}, F = {f:?}");
            let beyond = at(1.0 + 1e-6).claim();
            assert_eq!(beyond.verdict, Verdict::Refuted, "a = {a}, k = {k}, F = {f:?}: {beyond:?}");
            assert!(beyond.witness.unwrap().value < 0.0);
        }
    }
}

/// ẋ = −sat(kx), |sat| ≤ σ < k: from x = σ/k, where the input comes to its limit, x₊ = σ/k − Tσ is farthest on the other side, and outside
/// for T > 1/σ + 1/k. Before that the set is invariant; that every mixture contracts ends at 2/k.
#[test]
fn a_kink_inside_the_set_refutes() {
    for (k, sigma) in [(4.0, 1.0), (20.0, 3.0), (2.0, 1.9)] {
        let edge = 1.0 / sigma + 1.0 / k;
        let at = |sample_time_s: f64| Loop::scalar(0.0, Some(0.9 * sigma), k, sigma, sample_time_s).claim();
        assert_eq!(at(2.0 / k * (1.0 - 1e-6)).verdict, Verdict::Proved, "k = {k}");
        assert_eq!(at(edge * (1.0 - 1e-6)).verdict, Verdict::Undecided, "k = {k}: true, and not of every mixture");
        let beyond = at(edge * (1.0 + 1e-6));
        assert_eq!(beyond.verdict, Verdict::Refuted, "k = {k}: {beyond:?}");
        assert!(beyond.witness.unwrap().state[0].abs() < 0.99, "it starts inside");
    }
}

/// An unstable loop beyond what its input can hold: the low gain saturates on the set, and the motion leaves it. That the premise is refuted
/// too does not take the witness away.
#[test]
fn a_set_beyond_the_reach_of_the_input_is_refuted() {
    for (level, expected) in [(0.99, Verdict::Proved), (1.2, Verdict::Refuted)] {
        let mut of = Loop::scalar(1.0, Some(1.003), 5.0, 1.0, 0.01);
        of.level = level;
        let proofs = of.proofs();
        assert_eq!(sampled(&proofs).verdict, expected, "{:?}", proofs.claims);
        assert_ne!(claim(&proofs, "unsaturated").verdict == Verdict::Proved, level > 1.0);
    }
}

/// Two inputs of a plant of two integrators, one limited: the other flies K wherever it is, whatever F says of it.
#[test]
fn an_unlimited_input_beside_a_limited_one() {
    let of = |k: f64, f: f64| Loop {
        a: Mat::zeros(2, 2),
        b: identity(2),
        p: identity(2),
        f: Some(diagonal(&[0.9, f])),
        k: diagonal(&[5.0, k]),
        limits: InputLimits { min: vec![Some(-1.0), None], max: vec![Some(2.0), None] },
        level: 1.0,
        sample_time_s: 0.1,
    };
    // an F that would prove nothing, and one that would prove what is false
    assert_eq!(of(19.0, -1e3).verdict(), Verdict::Proved);
    let beyond = of(21.0, 1.0).claim();
    assert_eq!(beyond.verdict, Verdict::Refuted, "{beyond:?}");
    assert!(beyond.witness.unwrap().state[1].abs() > 0.9);
    // and an unlimited input whose K is its F to the last bit does nothing
    assert_eq!(of(1.0, 1.0).verdict(), Verdict::Proved);
}

/// As many inputs as there are: 70 that may saturate have 2⁷⁰ mixtures and one matrix.
#[test]
fn inputs_are_not_counted() {
    let mut numbers = Numbers(9);
    for m in [1, 6, 7, 64, 70] {
        let mut of = Loop::random(&mut numbers, 6, m);
        // ẋ = −x/2 − B sat(…): with P = I every gain BᵀP helps
        (of.a, of.p) = (-0.5 * identity(6), identity(6));
        of.f = Some((1.0 / m as f64) * of.b.transpose());
        of.k = (5.0 / m as f64) * of.b.transpose();
        (of.level, of.sample_time_s) = (1e-3, 1e-3);
        assert_eq!(of.verdict(), Verdict::Proved, "m = {m}: {:?}", of.claim());
        // one row of the wrong sign, and strong
        (0..6).for_each(|j| of.k[(m / 2, j)] *= -1e3);
        assert_ne!(of.verdict(), Verdict::Proved, "m = {m}");
    }
}

/// For short sample times the claim is that of the continuous loop: proved where that is with a margin, and not where it is false.
#[test]
fn short_sample_times_tend_to_the_continuous_claim() {
    let mut numbers = Numbers(21);
    let (mut both, mut neither) = (0, 0);
    for case in 0..120 {
        let mut of = Loop::random(&mut numbers, 1 + case % 3, 1 + case / 3 % 2);
        if case % 2 == 0 {
            // a gain that is too low, or a P that is not the loop's
            of.p =
                symmetric_part(&(&of.p + 0.9 * case as f64 / 120.0 * diagonal(&vec![of.p.norm_max(); of.p.nrows()])));
            of.k = 0.3 * &of.k;
            of.level = 1e-9;
        }
        of.sample_time_s = 1e-9;
        let proofs = of.proofs();
        let (continuous, discrete) = (claim(&proofs, "invariance"), sampled(&proofs));
        if continuous.verdict == Verdict::Proved && continuous.margin > 1e-4 {
            assert_eq!(discrete.verdict, Verdict::Proved, "case {case}: {:?}", proofs.claims);
            both += 1;
        }
        if continuous.verdict == Verdict::Refuted {
            assert_ne!(discrete.verdict, Verdict::Proved, "case {case}: {:?}", proofs.claims);
            neither += 1;
        }
    }
    assert!(both > 30 && neither > 3, "{both} and {neither}: the test tests something");
}

/// Sample times, levels and gains at the ends of the range of doubles: nothing false is proved, nothing true refuted.
#[test]
fn extreme_numbers_prove_and_refute_nothing_false() {
    for x in [0.0, -0.0, f64::from_bits(1), 1e-300, 1e150, 1e300, f64::MAX, f64::INFINITY, f64::NAN, -1.0] {
        let of = Loop::scalar(1.0, Some(1.5), 2.0, 2.0, x);
        let verdict = of.verdict();
        assert!(verdict != Verdict::Proved || x > 0.0 && x < 1.0, "T = {x}: {verdict:?}");
        assert!(verdict != Verdict::Refuted || x > 1.0, "T = {x}: {verdict:?}");
        let mut of = Loop::scalar(-1.0, Some(0.5), x, 2.0, 0.1);
        let verdict = of.verdict();
        // x₊ = e^{-0.1}x − 0.095 sat(Kx) keeps |x| ≤ 1 for every K ≥ −1, and sat ≤ 2 for all there is
        assert!(verdict != Verdict::Refuted || x.is_nan(), "K = {x}: {verdict:?}");
        (of.level, of.k) = (x, from_rows(&[vec![1.0]]));
        assert!(of.verdict() != Verdict::Refuted, "level {x}");
    }
}

/// The quadrotor that is proved in `scenarios/quadrotor.toml`: at T = 2 ms on all of the level on which the continuous loop is. A gain that is
/// bad at the seam of the circle alone is found there.
#[test]
fn the_flagship_keeps_its_level_when_sampled() {
    let (spec, plant) = (crate::quadrotor::spec(9.807), crate::quadrotor::plant());
    let request = DesignRequest {
        name: "flagship".into(),
        method: Method::HighGainSlpvqr { gamma: 20.0, high_gain: HighGainOptions::default() },
        weights: crate::quadrotor::weights(),
        grid_points: 32,
        schedule: ScheduleKind::Grid,
        limits: crate::quadrotor::limits(),
        sample_time_s: 0.002,
        rate_bounded: Some(RateBoundedOptions { rate: 2.0, order: 2, direction: None }),
    };
    let mut design = design(&spec, &*plant, &request, &|_| {}).unwrap();
    let proofs = prove(&design, &*plant, &ProofOptions::default()).unwrap();
    let (invariant, kept) = (claim(&proofs, "invariance"), sampled(&proofs));
    assert_eq!((invariant.verdict, kept.verdict), (Verdict::Proved, Verdict::Proved), "{:?}", proofs.claims);
    assert!(proofs.level.unwrap() >= 0.98 * 20.0);

    let Schedule::Grid { gains, .. } = &mut design.controller.schedule else { panic!("a grid was asked for") };
    gains[0] = 60.0 * &gains[0];
    let proofs = prove(&design, &*plant, &ProofOptions::default()).unwrap();
    let kept = sampled(&proofs);
    assert_eq!(kept.verdict, Verdict::Refuted, "{:?}", proofs.claims);
    let witness = kept.witness.as_ref().unwrap();
    assert!(witness.parameter.abs() > 2.7, "at {}", witness.parameter);
    // and its motion leaves the set
    let (rho, x) = (witness.parameter, &witness.state);
    let (p, model) = (lyapunov_matrix(&design, &*plant, rho).unwrap(), linearize(&*plant, rho));
    let (a, b) = discretize(&model.a, &model.b, design.sample_time_s);
    let (k, operating) = (design.controller.schedule.gain_matrix(rho), &design.controller.operating_input);
    let mut u: Vec<f64> = (0..4).map(|i| operating[i] - (0..12).map(|j| k[(i, j)] * x[j]).sum::<f64>()).collect();
    design.controller.limits.saturate(&mut u);
    let next = |i: usize| {
        (0..12).map(|j| a[(i, j)] * x[j]).sum::<f64>() + (0..4).map(|l| b[(i, l)] * (u[l] - operating[l])).sum::<f64>()
    };
    let (now, next) = (quadratic_form(&p, x), quadratic_form(&p, &(0..12).map(next).collect::<Vec<f64>>()));
    let level = proofs.level.unwrap();
    assert!(now <= level * (1.0 + 1e-9) && next > level, "V from {now} to {next}");
}
