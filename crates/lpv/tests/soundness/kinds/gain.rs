//! The induced L2 norm: the inequality in exact arithmetic, and motions with disturbances that gain as much as they
//! can.

use super::polynomials;
use crate::Tally;
use crate::exact::Exact;
use crate::loops::polynomial;
use crate::numbers::Numbers;
use lpv::certificate::{ClaimKind, Motion, Verdict, prove_gain};
use lpv::math::Mat;
use lpv::synthesis::bounded_real::{GainBound, GainOptions, InputOutputModel, induced_gain};

/// Steps of a motion, and the length of one times the rate of the fastest mode.
const STEPS: usize = 1500;
const STEP: f64 = 0.05;

pub fn case(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    let (n, degree) = (1 + numbers.below(2), numbers.below(2) as u32);
    let (inputs, outputs) = (1 + numbers.below(2), 1);
    let center = Mat::from_fn(n, n, |i, j| if i == j { -1.0 } else { 0.4 * numbers.next() });
    let size = numbers.of(&[0.5, 0.2, 0.02]);
    let [b, c] = [numbers.matrix(n, inputs), numbers.matrix(outputs, n)];
    let d = 0.2 * numbers.matrix(outputs, inputs);
    let model = InputOutputModel {
        a: polynomials(numbers, &center, degree, size, false),
        b: polynomials(numbers, &b, degree, 0.5 * size, false),
        c: polynomials(numbers, &c, degree, 0.5 * size, false),
        d: polynomials(numbers, &d, 0, 0.0, false),
        range: [-1.0, 1.0],
    };
    let rate = numbers.of(&[None, Some(0.0), Some(0.1), Some(1.0), Some(10.0)]);
    let options = GainOptions { rate, degree: 1 + numbers.below(2) as u32, grid_points: 2 + numbers.below(5) };
    let Ok(mut bound) = induced_gain(&model, &options) else {
        tally.refused += 1;
        return Ok(());
    };
    // back off a little, or claim more than is true
    bound.gain *= numbers.of(&[1.0, 1.000_1, 1.02, 0.999, 0.98, 0.8]);
    if numbers.once_in(4) {
        bound.rate = bound.rate.map(|rate| rate * numbers.of(&[1.1, 2.0, 10.0]));
    }
    if numbers.once_in(4) {
        let share = numbers.of(&[1e-3, 1e-2, 0.1]);
        let noise = numbers.symmetric(n);
        let p = &mut bound.p.coefficients[0];
        *p = Mat::from_fn(n, n, |i, j| p[(i, j)] * (1.0 + share * noise[(i, j)]));
    }
    let claim = prove_gain(&model, &bound);
    tally.count(std::slice::from_ref(&claim));
    if claim.verdict != Verdict::Proved {
        return Ok(());
    }
    let ClaimKind::InducedGain { gain, motion } = claim.kind else { return Err("another claim".into()) };
    let rates = match motion {
        Motion::Bounded { rate } => vec![rate, -rate],
        _ => vec![0.0],
    };
    // P(ρ) of an unbounded rate must not depend on ρ
    if motion == Motion::Any && bound.p.coefficients.len() > 1 {
        return Err("a parameter that jumps, and P depends on it".into());
    }
    let places = (0..8).map(|_| numbers.next()).chain([-1.0, 1.0]).collect::<Vec<f64>>();
    for &rho in &places {
        for &rate in &rates {
            if !holds(&model, &bound, gain, rho, rate) {
                return Err(format!("{} is false at parameter {rho} with rate {rate}: {}", claim.id, claim.claim));
            }
        }
    }
    tally.flights += 1;
    gains(numbers, &model, &bound, gain, rates[0])
}

/// The bounded-real inequality, exactly, with P ≻ 0.
fn holds(model: &InputOutputModel, bound: &GainBound, gain: f64, rho: f64, rate: f64) -> bool {
    let of = |function| polynomial(function, rho).expect("a polynomial");
    let [[a, _], [b, _], [c, _], [d, _]] = [&model.a, &model.b, &model.c, &model.d].map(of);
    let [p, slope] = of(&bound.p);
    let (n, m, outputs) = (a.rows, b.columns, c.rows);
    let flow = p.times(&a).with_transpose().plus(&slope.by(rate)).by(-1.0);
    let pb = p.times(&b).by(-1.0);
    let matrix = Exact::from_fn(n + m + outputs, n + m + outputs, |i, j| {
        let (i, j) = (i.min(j), i.max(j));
        match (i < n, j < n, j < n + m, i < n + m) {
            (_, true, ..) => flow.at(i, j).clone(),
            (true, _, true, _) => pb.at(i, j - n).clone(),
            (true, ..) => -c.at(j - n - m, i),
            (_, _, false, true) => -d.at(j - n - m, i - n),
            _ if i == j => gain.into(),
            _ => 0.0.into(),
        }
    });
    p.is_positive() && matrix.is_positive()
}

/// From rest, w of one frequency and then what V asks for; the energy of z is at most γ² that of w.
fn gains(
    numbers: &mut Numbers,
    model: &InputOutputModel,
    bound: &GainBound,
    gain: f64,
    rate: f64,
) -> Result<(), String> {
    let (n, m) = model.b.shape();
    let h = STEP / (1.0 + model.a.coefficients.iter().map(|a| a.norm_max()).sum::<f64>());
    let frequency = 10.0_f64.powf(2.0 * numbers.next() - 1.0);
    let direction: Vec<f64> = (0..m).map(|_| numbers.next()).collect();
    let (mut x, mut rho, mut turn) = (vec![0.0; n], numbers.next(), 1.0);
    let (mut given, mut taken) = (0.0, 0.0);
    for step in 0..STEPS {
        let [a, b, c, d, p] = [&model.a, &model.b, &model.c, &model.d, &bound.p].map(|f| f.at(&[rho]));
        let time = step as f64 * h;
        let w: Vec<f64> = match step < STEPS / 2 {
            true => direction.iter().map(|w| w * (frequency * time).sin()).collect(),
            false => {
                let px: Vec<f64> = (0..n).map(|i| (0..n).map(|j| p[(i, j)] * x[j]).sum()).collect();
                (0..m).map(|i| (0..n).map(|j| b[(j, i)] * px[j]).sum::<f64>() / gain).collect()
            }
        };
        // w is held: the trapezoidal rule for x, exactly summed energies of its middle
        let along = |x: &[f64]| -> Vec<f64> {
            (0..n)
                .map(|i| (0..n).map(|j| a[(i, j)] * x[j]).sum::<f64>() + (0..m).map(|j| b[(i, j)] * w[j]).sum::<f64>())
                .collect()
        };
        let first = along(&x);
        let middle: Vec<f64> = x.iter().zip(&first).map(|(x, f)| x + 0.5 * h * f).collect();
        let second = along(&middle);
        let z = |i: usize| {
            (0..n).map(|j| c[(i, j)] * middle[j]).sum::<f64>() + (0..m).map(|j| d[(i, j)] * w[j]).sum::<f64>()
        };
        given += h * w.iter().map(|w| w * w).sum::<f64>();
        taken += h * (0..c.nrows()).map(|i| z(i).powi(2)).sum::<f64>();
        x.iter_mut().zip(&second).for_each(|(x, f)| *x += h * f);
        if numbers.once_in(50) {
            turn = -turn;
        }
        rho = (rho + h * turn * rate).clamp(-1.0, 1.0);
    }
    // steps of second order leave a share of them
    if taken > gain * gain * given * 1.01 + 1e-12 {
        Err(format!("a motion gains {}, more than {gain}", (taken / given).sqrt()))
    } else {
        Ok(())
    }
}
