//! Good designs with one thing wrong: an entry, a sign, inputs exchanged, a limit shorter or gone, a level scaled,
//! the last digit of one of two entries that should agree, and numbers at the ends of the range of doubles.

use super::family;
use super::linear::{examine, regulator};
use super::{attack, polytope};
use crate::Tally;
use crate::loops::Linear;
use crate::numbers::Numbers;
use lpv::certificate::{Verdict, prove};
use lpv::controller::Schedule;
use lpv::math::Mat;
use lpv::math::matrix::is_finite;

const EXTREMES: [f64; 9] =
    [0.0, -0.0, f64::from_bits(1), 1e-300, 1e300, -1e300, f64::NAN, f64::INFINITY, 2.225_073_858_507_201e-308];

/// One entry times something, one sign, or an extreme number.
fn entry(numbers: &mut Numbers, matrix: &mut Mat<f64>, symmetric: bool) {
    let (i, j) = (numbers.below(matrix.nrows()), numbers.below(matrix.ncols()));
    let size = 2.0_f64.powi(-(numbers.below(20) as i32));
    let value = match numbers.below(4) {
        0 => -matrix[(i, j)],
        1 => numbers.of(&EXTREMES),
        2 => matrix[(i, j)] + size,
        _ => matrix[(i, j)] * (1.0 + size),
    };
    matrix[(i, j)] = value;
    if symmetric {
        matrix[(j, i)] = value;
    }
}

/// A good design with one thing wrong.
fn mutate(numbers: &mut Numbers, linear: &mut Linear) {
    let m = linear.b.ncols();
    let at = numbers.below(m);
    match numbers.below(13) {
        0 => entry(numbers, &mut linear.a, false),
        1 => entry(numbers, &mut linear.b, false),
        2 => entry(numbers, &mut linear.k, false),
        3 => entry(numbers, &mut linear.p, true),
        4 => entry(numbers, &mut linear.weights.q, true),
        5 => entry(numbers, &mut linear.weights.r, true),
        6 => match &mut linear.f {
            Some(f) => entry(numbers, f, false),
            None => (0..linear.k.ncols()).for_each(|j| linear.k[(at, j)] = -linear.k[(at, j)]),
        },
        // inputs exchanged, in K alone
        7 => (0..linear.k.ncols()).for_each(|j| {
            let last = linear.k[(m - 1, j)];
            linear.k[(m - 1, j)] = linear.k[(0, j)];
            linear.k[(0, j)] = last;
        }),
        8 => {
            let share = numbers.of(&[0.5, 0.99, 0.0, 1e-300]);
            linear.limits.max[at] =
                linear.limits.max[at].map(|max| linear.operating[at] + share * (max - linear.operating[at]));
        }
        9 => {
            (linear.limits.min[at], linear.limits.max[at]) =
                (None, numbers.of(&[None, Some(1.0 + linear.operating[at])]))
        }
        10 => linear.gamma = linear.gamma.map(|gamma| gamma * numbers.of(&[1.000_001, 1.01, 2.0, 1e6, 1e-300, 1e300])),
        11 => {
            let matrix = if numbers.once_in(2) { &mut linear.p } else { &mut linear.weights.q };
            let n = matrix.nrows();
            if n > 1 {
                matrix[(n - 1, 0)] = matrix[(n - 1, 0)].next_up();
            }
        }
        _ => linear.sample_time_s *= numbers.of(&[1e-12, 100.0, 1e6]),
    }
}

pub fn case(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    if numbers.once_in(12) {
        return of_family(numbers, tally);
    }
    if numbers.once_in(5) {
        return of_polytope(numbers, tally);
    }
    let (n, m) = (1 + numbers.below(3), 1 + numbers.below(3));
    let Some(mut linear) = regulator(numbers, n, m, 1e-9) else {
        tally.refused += 1;
        return Ok(());
    };
    mutate(numbers, &mut linear);
    let matrices = [&linear.a, &linear.b, &linear.k, &linear.p, &linear.weights.q, &linear.weights.r];
    let Some(of) = linear.build() else {
        tally.refused += 1;
        return Ok(());
    };
    let mut at_rest = linear.clone();
    at_rest.operating = vec![0.0; m];
    let refused = at_rest.build().is_none_or(|of| of.design.validate().is_err());
    tally.refused += usize::from(refused);
    let is_read = !matrices.into_iter().all(is_finite);
    if is_read || linear.f.as_ref().is_some_and(|f| !is_finite(f)) {
        // the door refuses it; behind the door nothing comes of it that needs the number (F is not read where nothing
        // is limited)
        let claims = prove(&of.design, &*of.plant, &Default::default()).map_or(Vec::new(), |proofs| proofs.claims);
        tally.count(&claims);
        let all = !claims.is_empty() && claims.iter().all(|claim| claim.verdict == Verdict::Proved);
        return if is_read && all || !refused { Err("a number that is none passes".into()) } else { Ok(()) };
    }
    examine(numbers, tally, &linear).map(|_| ())
}

fn of_family(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    let Some((mut of, mut options, positions)) = family::generate(numbers) else {
        tally.refused += 1;
        return Ok(());
    };
    let Some(bounded) = &mut of.design.rate_bounded else {
        options.rate = options.rate.map(|rate| 3.0 * rate);
        return attack(numbers, tally, &of, &options, &positions).map(|_| ());
    };
    let last = bounded.y.coefficients.len() - 1;
    match numbers.below(4) {
        0 => bounded.rate *= 2.0,
        1 => bounded.y.coefficients[last] = 2.0 * &bounded.y.coefficients[last],
        2 if bounded.y.coefficients[0].nrows() > 1 => {
            bounded.y.coefficients[0][(1, 0)] = bounded.y.coefficients[0][(1, 0)].next_down();
        }
        _ => {
            if let Schedule::Constant { gain } = &mut of.design.controller.schedule {
                gain[(0, 0)] *= 1.0 + numbers.next();
            }
        }
    }
    attack(numbers, tally, &of, &options, &positions).map(|_| ())
}

fn of_polytope(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    use lpv::certificate::PolytopicLyapunov::{Common, ParameterDependent};
    let Some(mut claim) = polytope::generate(numbers) else {
        tally.refused += 1;
        return Ok(());
    };
    let vertex = numbers.below(claim.polytope.len());
    match (numbers.below(4), &mut claim.lyapunov) {
        (0, Common { p, .. }) if p.nrows() > 1 => p[(1, 0)] = p[(1, 0)].next_up(),
        (0, ParameterDependent { y, .. }) if y[0].nrows() > 1 => y[vertex][(1, 0)] = y[vertex][(1, 0)].next_up(),
        (1, ParameterDependent { rate_vertices, .. }) => {
            rate_vertices.iter_mut().flatten().for_each(|rate| *rate *= 2.0);
        }
        (2, _) => {
            if let Some(bounds) = &mut claim.saturation {
                bounds.gamma *= numbers.of(&[1.001, 4.0]);
            }
        }
        (_, Common { gain, .. }) => gain[vertex][(0, 0)] *= -1.0,
        (_, ParameterDependent { l, .. }) => l[vertex][(0, 0)] *= 1.0 + numbers.next(),
    }
    polytope::examine(numbers, tally, &claim).map(|_| ())
}
