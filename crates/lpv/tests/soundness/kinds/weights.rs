//! Weights of small integers, singular and indefinite ones among them; matrices that differ from symmetric ones by
//! one unit in the last place.

use crate::Tally;
use crate::conditions::{Bounds, check};
use crate::loops::polytope_point;
use crate::numbers::Numbers;
use lpv::certificate::{PolytopicClaim, PolytopicLyapunov, Verdict, prove_polytopic};
use lpv::math::Mat;
use lpv::math::definite::{Definiteness, definiteness};
use lpv::math::matrix::identity;
use lpv::model::Polytope;
use lpv::synthesis::CostWeights;

/// GGᵀ of integers, less one here and there.
fn gram(numbers: &mut Numbers, size: usize) -> Mat<f64> {
    let columns = 1 + numbers.below(size + 1);
    let g = Mat::from_fn(size, columns, |_, _| f64::from(numbers.below(5) as i32 - 2));
    let mut product = Mat::from_fn(size, size, |i, j| (0..columns).map(|k| g[(i, k)] * g[(j, k)]).sum::<f64>());
    let at = numbers.below(size);
    product[(at, at)] += numbers.of(&[0.0, 0.0, -1.0, 1.0, f64::EPSILON, -f64::EPSILON, 1e-300]);
    let scale = numbers.of(&[1.0, 1.0, 0.1, 1e-300, 1e300, 3.0]);
    Mat::from_fn(size, size, |i, j| scale * product[(i, j)])
}

/// One entry off the diagonal by one unit in the last place.
fn nudge(numbers: &mut Numbers, matrix: &mut Mat<f64>) {
    if matrix.nrows() > 1 && numbers.once_in(8) {
        matrix[(1, 0)] = matrix[(1, 0)].next_up();
    }
}

pub fn case(numbers: &mut Numbers, tally: &mut Tally) -> Result<(), String> {
    let (n, m) = (1 + numbers.below(4), 1 + numbers.below(2));
    let mut q = gram(numbers, n);
    let mut r = if numbers.once_in(3) { gram(numbers, m) } else { identity(m) };
    let mut p = if numbers.once_in(3) { gram(numbers, n) } else { identity(n) };
    [&mut q, &mut r, &mut p].into_iter().for_each(|matrix| nudge(numbers, matrix));
    let claim = PolytopicClaim {
        polytope: Polytope::new(vec![-1.0 * identity(n)], vec![numbers.matrix(n, m)]).map_err(|e| e.to_string())?,
        lyapunov: PolytopicLyapunov::Common { p, gain: vec![Mat::zeros(m, n)] },
        auxiliary_gain: None,
        weights: Some(CostWeights { q: q.clone(), r: r.clone() }),
        saturation: None,
    };
    let claims = prove_polytopic(&claim);
    tally.count(&claims);
    let bounds = Bounds::of_sigma(&vec![f64::INFINITY; m], claim.weights.as_ref());
    let point = polytope_point(&claim, &[1.0], None);
    tally.witnesses += check(&claims, &bounds, std::slice::from_ref(&point), &|_| point.clone())?;
    // exact elimination with pivots against principal minors
    for matrix in [&q, &r] {
        let exact = crate::exact::Exact::of(matrix);
        let truth = match (exact.is_symmetric(), exact.is_semidefinite(), exact.is_symmetric() && exact.is_positive()) {
            (false, ..) => None,
            (_, false, _) => Some(Definiteness::Indefinite),
            (_, true, false) => Some(Definiteness::Semidefinite),
            (_, true, true) => Some(Definiteness::Positive),
        };
        let found = definiteness(matrix);
        if found != truth {
            return Err(format!("{matrix:?} is {truth:?}, and {found:?} was found"));
        }
    }
    let of = |name: &str| claims.iter().find(|claim| claim.id.name == name).map(|claim| claim.verdict);
    let is_symmetric = [&q, &r].into_iter().all(|matrix| crate::exact::Exact::of(matrix).is_symmetric());
    if is_symmetric == (of("weights") == Some(Verdict::Undecided)) {
        return Err("weights that are symmetric are decided, others are not".into());
    }
    Ok(())
}
