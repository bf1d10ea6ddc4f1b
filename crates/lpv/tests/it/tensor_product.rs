//! The tensor-product model transformation: published singular values, the defining properties of every kind of weights, and
//! reconstruction.

use lpv::math::Mat;
use lpv::math::matrix::from_rows;
use lpv::math::riccati;
use lpv::model::linearize;
use lpv::model::literature::{LiteratureModel, ToraParameters};
use lpv::model::tensor_product::{
    ParameterGrid, RankRule, TensorProductError, TensorProductModel, TensorProductOptions, WeightFunctions, Weighting,
};
use lpv::plant::{Quadrotor, QuadrotorParameters};
use proptest::prelude::*;

fn literature(name: &str) -> (LiteratureModel, Vec<ParameterGrid>) {
    let model = LiteratureModel::named(name).unwrap();
    let grids = model.parameters();
    (model, grids.iter().map(|p| ParameterGrid::equidistant(p.name, p.unit, p.range, p.grid_points)).collect())
}

fn options(ranks: RankRule, weighting: Weighting) -> TensorProductOptions {
    TensorProductOptions { ranks: vec![ranks], weightings: vec![weighting], ..Default::default() }
}

/// The singular values that the TP Tool's TORA example prints, to their digits.
#[test]
fn tora_has_the_published_singular_values() {
    let (tora, grids) = literature("tora");
    let model = TensorProductModel::of(&|rho| tora.at(rho), &grids, &TensorProductOptions::default()).unwrap();
    let published: [&[f64]; 2] =
        [&[47.155155, 0.67184703, 0.63919983, 0.010340462, 0.0068889706], &[47.159941, 0.63928346]];
    assert_eq!(model.ranks, [5, 2]);
    for (found, published) in model.singular_values.iter().zip(published) {
        for (f, p) in found.iter().zip(published) {
            // eight significant digits are printed
            assert!((f / p - 1.0).abs() < 5e-8, "{f} is not {p}");
        }
    }
    assert!(model.accuracy.grid_max < 1e-10, "{:?}", model.accuracy);
    // weights that may be negative follow the function between the grid points too
    let exact = options(RankRule::Tolerance(1e-12), Weighting::Sn);
    let model = TensorProductModel::of(&|rho| tora.at(rho), &grids, &exact).unwrap();
    assert!(model.accuracy.between_max < 1e-10, "{:?}", model.accuracy);
}

/// Every kind has its defining property at the grid points, and the core with the weights gives the samples back.
#[test]
fn kinds_of_weights_have_their_properties() {
    for name in ["tora", "nata", "pendulum-cart"] {
        let (literature, grids) = literature(name);
        for (kind_name, kind) in Weighting::ALL {
            let options = options(RankRule::Tolerance(1e-12), kind);
            let model = TensorProductModel::of(&|rho| literature.at(rho), &grids, &options).unwrap();
            let label = format!("{name}, {kind_name}");
            let scale = model.core.norm_max();
            assert!(model.accuracy.grid_max < 1e-10 * scale.max(1.0), "{label}: {:?}", model.accuracy);
            for weights in &model.weights {
                has_the_properties(&label, kind, weights);
            }
        }
    }
}

fn has_the_properties(label: &str, kind: Weighting, weights: &WeightFunctions) {
    let WeightFunctions { hull, .. } = weights;
    let least = hull.minima.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(hull.sum_error < 1e-12, "{label}: {hull:?}");
    assert!(!kind.is_convex() || least >= 0.0, "{label}: {hull:?}");
    if weights.count() == 1 {
        // nothing to choose
        assert!(hull.minima == [1.0] && hull.maxima == [1.0], "{label}: {hull:?}");
        return;
    }
    let close = |values: &[f64], to: f64, tolerance: f64| values.iter().all(|value| (value - to).abs() < tolerance);
    match kind {
        Weighting::Sn => {}
        Weighting::Snnn => assert!(least.abs() < 1e-12, "{label}: {hull:?}"),
        Weighting::No => {
            assert!(close(&hull.maxima, 1.0, 1e-9) && (hull.volume_ratio - 1.0).abs() < 1e-9, "{label}: {hull:?}")
        }
        Weighting::Ino | Weighting::Cno => assert!(close(&hull.minima, 0.0, 1e-10), "{label}: {hull:?}"),
        Weighting::InoRno => {
            assert!(close(&hull.minima, 0.0, 1e-10) && close(&hull.maxima, hull.maxima[0], 1e-10), "{label}: {hull:?}");
        }
        Weighting::Box => assert!(close(&hull.minima, 0.0, 1e-10), "{label}: {hull:?}"),
    }
    if weights.count() == 2 && kind.is_convex() && kind != Weighting::Snnn {
        // two weights: the hull is an interval, which is every limit at once
        assert!(close(&hull.maxima, 1.0, 1e-9), "{label}: {hull:?}");
    }
}

/// No hull of the same points is smaller than the CNO one.
#[test]
fn close_to_normal_is_the_tightest() {
    for name in ["tora", "nata", "pendulum-cart"] {
        let (literature, grids) = literature(name);
        let volumes = |kind| {
            let options = options(RankRule::Tolerance(1e-12), kind);
            let model = TensorProductModel::of(&|rho| literature.at(rho), &grids, &options).unwrap();
            model.weights.iter().map(|weights| weights.hull.volume_ratio).collect::<Vec<_>>()
        };
        let tightest = volumes(Weighting::Cno);
        println!(
            "{name}: CNO {tightest:?} INO {:?} RNO {:?} SNNN {:?}",
            volumes(Weighting::Ino),
            volumes(Weighting::InoRno),
            volumes(Weighting::Snnn)
        );
        assert!(tightest.iter().all(|ratio| *ratio >= 1.0 - 1e-9), "{name}: {tightest:?}");
        for kind in [Weighting::Snnn, Weighting::Ino, Weighting::InoRno] {
            for (tight, other) in tightest.iter().zip(volumes(kind)) {
                assert!(*tight <= other * (1.0 + 1e-9), "{name}, {kind:?}: {tight} against {other}");
            }
        }
    }
}

/// Weights 1, ρ, ρ² put the points on an arc of a parabola, y = x² for |x| ≤ 1 after a change of coordinates. The largest
/// triangle in it has area 1; of those around it, with the chord on one side and tangents at ±t on the others, the area is
/// (1 + t²)²/(2t), least 8√3/9 at t² = 1/3.
#[test]
fn tightest_triangle_around_a_parabola() {
    let quadratic = |rho: &[f64]| from_rows(&[vec![1.0, rho[0], rho[0] * rho[0]]]);
    let grid = ParameterGrid::equidistant("rho", "1", [0.0, 3.0], 201);
    let model = TensorProductModel::of(&quadratic, &[grid], &TensorProductOptions::default()).unwrap();
    let ratio = model.weights[0].hull.volume_ratio;
    // the polygon of 201 points is inside the arc by the square of their distance
    assert!((ratio - 8.0 * 3.0f64.sqrt() / 9.0).abs() < 2e-4, "{ratio}");
}

/// Weights between the grid points: convex, clamped to the range, those of the grid at the grid, and back to the function
/// with an error that falls with the square of the spacing.
#[test]
fn weights_between_grid_points_follow_the_function() {
    let (tora, grids) = literature("tora");
    let error = |points: usize| {
        let grids: Vec<ParameterGrid> = grids
            .iter()
            .map(|g| ParameterGrid::equidistant(&g.name, &g.unit, [g.points[0], g.points[g.points.len() - 1]], points))
            .collect();
        let function = |rho: &[f64]| tora.at(rho);
        let model = TensorProductModel::of(&function, &grids, &TensorProductOptions::default()).unwrap();
        for (n, grid) in grids.iter().enumerate() {
            let at = |value| model.weights_at(&function, n, value);
            for (i, value) in grid.points.iter().enumerate() {
                let found = at(*value);
                let difference = found.iter().enumerate().map(|(j, w)| (w - model.weights[n].values[(i, j)]).abs());
                let difference = difference.fold(0.0, f64::max);
                assert!(
                    difference < 1e-9,
                    "parameter {n} at {value}: {difference}, {found:?} {:?}",
                    model.singular_values
                );
            }
            let [low, high] = [grid.points[0], grid.points[points - 1]];
            assert_eq!(at(low - 1.0), at(low));
            assert_eq!(at(high + 1.0), at(high));
            for k in 0..97 {
                let value = low + (high - low) * k as f64 / 96.3;
                for weights in [at(value), model.weights[n].interpolated(value)] {
                    assert!(weights.iter().all(|w| *w >= 0.0) && (weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                }
            }
        }
        model.accuracy.between_max
    };
    let (coarse, fine) = (error(12), error(45));
    assert!(fine < coarse / 8.0, "{coarse} at 12 points, {fine} at 45");
}

/// A hull that holds points between the grid points too loses less there, and its weights reach their limits at them.
#[test]
fn hulls_of_points_between_the_grid_points() {
    let (tora, grids) = literature("tora");
    let of = |hull_points| {
        let options = TensorProductOptions { hull_points, ..Default::default() };
        TensorProductModel::of(&|rho| tora.at(rho), &grids, &options).unwrap()
    };
    let (tight, held) = (of(0), of(9));
    assert!(held.accuracy.grid_max < 1e-10, "{:?}", held.accuracy);
    let (before, after) = (tight.accuracy.between_max, held.accuracy.between_max);
    assert!(after < before / 20.0, "{before} without, {after} with points in the cells");
    for weights in &held.weights {
        has_the_properties("tora", Weighting::Cno, weights);
    }
}

/// Units do not matter: entries near the ends of the range of numbers are transformed like their multiples near one.
#[test]
fn large_and_small_entries() {
    let (tora, grids) = literature("tora");
    for scale in [1e300, 1e-290] {
        let function = |rho: &[f64]| tora.at(rho) * scale;
        let model = TensorProductModel::of(&function, &grids, &TensorProductOptions::default()).unwrap();
        assert_eq!(model.ranks, [5, 2]);
        assert!((model.singular_values[0][4] / scale - 0.0068889706).abs() < 5e-10);
        assert!(model.accuracy.grid_max < 1e-10 * scale, "{:?}", model.accuracy);
        assert!(
            model.accuracy.between_rms < 1e-3 * scale && model.accuracy.bound < 1e-10 * scale,
            "{:?}",
            model.accuracy
        );
    }
}

/// A model is plain data: what is read back is what was written, and interpolates its weights.
#[test]
fn models_are_plain_data() {
    let (wing, grids) = literature("nata");
    let function = |rho: &[f64]| wing.at(rho);
    let model = TensorProductModel::of(&function, &grids, &TensorProductOptions::default()).unwrap();
    let text = serde_json::to_string(&model).unwrap();
    let read: TensorProductModel = serde_json::from_str(&text).unwrap();
    assert_eq!(serde_json::to_string(&read).unwrap(), text);
    assert_eq!(read.weights_at(&function, 0, 17.03), model.weights[0].interpolated(17.03));
    let (rho, scale) = ([17.03, 0.1234], model.core.norm_max());
    assert!((read.interpolated(&rho) - wing.at(&rho)).norm_max() < 1e-3 * scale);
    assert!((model.at(&function, &rho) - wing.at(&rho)).norm_max() < 1e-6 * scale);
    assert_eq!(read.interpolated(&[99.0, 9.0]), read.interpolated(&[25.0, 0.3]));
}

/// Wang, Tanaka and Griffin (1996) give θ̈ alone: the pole's rows of the model are theirs.
#[test]
fn pendulum_on_a_cart_is_the_published_one() {
    let model = LiteratureModel::named("pendulum-cart").unwrap();
    let (g, m, l, a) = (9.8, 2.0, 0.5, 0.1);
    for (theta, rate, force) in [(0.3f64, 1.5, 2.0), (-1.0, -0.7, 30.0), (0.8, 0.0, -5.0)] {
        let s = model.at(&[theta, rate]);
        let found = s[(3, 1)] * theta + s[(3, 3)] * rate + s[(3, 4)] * force;
        let published =
            (g * theta.sin() - a * m * l * rate * rate * (2.0 * theta).sin() / 2.0 - a * theta.cos() * force)
                / (4.0 * l / 3.0 - a * m * l * theta.cos().powi(2));
        assert!((found - published).abs() < 1e-12 * published.abs().max(1.0), "{found} is not {published}");
    }
}

/// The coefficients k₁ … k₄, c₁ … c₄, g₃, g₄ of the wing section as Ko, Kurdila and Strganac (1997) write them out.
#[test]
#[expect(clippy::approx_constant, reason = "6.28 is the source's lift slope, to its digits")]
fn wing_section_is_the_published_one() {
    let model = LiteratureModel::named("nata").unwrap();
    let (m, i, b, a, rho) = (12.387, 0.065, 0.135f64, -0.4, 1.225);
    let (k_h, c_h, c_a, cla, clb, cmb) = (2844.4, 27.43, 0.036, 6.28, 3.358, -0.635);
    let (cma, x) = ((0.5 + a) * cla, 0.0873 / b - (1.0 + a));
    let d = m * (i - m * x * x * b * b);
    for (u, alpha) in [(14.0f64, 0.0f64), (20.0, -0.25), (25.0, 0.3)] {
        let k_alpha =
            2.82 * (1.0 - 22.1 * alpha + 1315.5 * alpha.powi(2) - 8580.0 * alpha.powi(3) + 17289.7 * alpha.powi(4));
        let arm = 0.5 - a;
        let k2 = (i * rho * b * cla + m * x * b.powi(3) * rho * cma) / d;
        let k4 = (-m * x * b * b * rho * cla - m * rho * b * b * cma) / d;
        let published = [
            [
                -i * k_h / d,
                -k2 * u * u + m * x * b * k_alpha / d,
                -(i * (c_h + rho * u * b * cla) + m * x * rho * u * b.powi(3) * cma) / d,
                -(i * rho * u * b * b * cla * arm - m * x * b * c_a + m * x * rho * u * b.powi(4) * cma * arm) / d,
                (-i * rho * b * clb - m * x * b.powi(3) * rho * cmb) * u * u / d,
            ],
            [
                m * x * b * k_h / d,
                -k4 * u * u - m * k_alpha / d,
                (m * x * b * c_h + m * x * rho * u * b * b * cla + m * rho * u * b * b * cma) / d,
                -(m * c_a - m * x * rho * u * b.powi(3) * cla * arm - m * rho * u * b.powi(3) * cma * arm) / d,
                (m * x * b * b * rho * clb + m * rho * b * b * cmb) * u * u / d,
            ],
        ];
        let s = model.at(&[u, alpha]);
        for (row, values) in published.iter().enumerate() {
            for (column, value) in values.iter().enumerate() {
                let found = s[(2 + row, column)];
                assert!((found - value).abs() < 1e-11 * value.abs().max(1.0), "({row}, {column}): {found}, {value}");
            }
        }
    }
}

/// A scheduled controller is a function like any other (4.2.3): K(ψ) = K(0)T(ψ) of the quadrotor's regulator has rank 3.
#[test]
fn controllers_are_transformed() {
    let plant = Quadrotor::new(QuadrotorParameters::default());
    let (q, r) = (Mat::identity(12, 12), Mat::identity(4, 4));
    let gain = |rho: &[f64]| {
        let model = linearize(&plant, rho[0]);
        riccati::solve(&model.a, &model.b, &q, &r).unwrap().k
    };
    let grid = ParameterGrid::equidistant("psi", "rad", [-3.0, 3.0], 31);
    let options = options(RankRule::Tolerance(1e-7), Weighting::Cno);
    let model = TensorProductModel::of(&gain, &[grid], &options).unwrap();
    assert_eq!(model.ranks, [3]);
    assert_eq!(model.size, [4, 12]);
    let scale = model.core.norm_max();
    assert!(model.accuracy.grid_max < 1e-7 * scale, "{:?}", model.accuracy);
}

/// A function that does not depend on a parameter has one constant weight for it; errors name the parameter.
#[test]
fn special_functions() {
    let grids =
        [ParameterGrid::equidistant("p", "1", [0.0, 1.0], 5), ParameterGrid::equidistant("q", "1", [0.0, 1.0], 7)];
    for (_, kind) in Weighting::ALL {
        let constant = |_: &[f64]| from_rows(&[vec![3.0, -1.0]]);
        let model = TensorProductModel::of(&constant, &grids, &options(RankRule::Tolerance(1e-12), kind)).unwrap();
        assert_eq!((model.ranks.clone(), model.core.entries().to_vec().len()), (vec![1, 1], 2));
        assert!(model.accuracy.grid_max < 1e-14 && model.accuracy.between_max < 1e-14, "{kind:?} {:?}", model.accuracy);
        assert_eq!(model.dependencies, vec![vec![false, false]; 2]);
        // rank one without the constant: one weight more than singular values
        let growing = |rho: &[f64]| from_rows(&[vec![1.0 + rho[0]]]);
        let model = TensorProductModel::of(&growing, &grids, &options(RankRule::Tolerance(1e-12), kind)).unwrap();
        assert_eq!((model.ranks.clone(), model.weights[0].count(), model.weights[1].count()), (vec![1, 1], 2, 1));
        assert!(model.accuracy.grid_max < 1e-13, "{kind:?} {:?}", model.accuracy);
        assert_eq!(model.dependencies, vec![vec![true, false]]);
    }
    let defaults = TensorProductOptions::default();
    let of = |function: &(dyn Fn(&[f64]) -> Mat<f64> + Sync), grids: &[ParameterGrid]| {
        TensorProductModel::of(function, grids, &defaults).map(|_| ())
    };
    let one = |_: &[f64]| Mat::identity(1, 1);
    assert_eq!(of(&one, &[]), Err(TensorProductError::NoParameter));
    let backwards = ParameterGrid { name: "p".into(), unit: "1".into(), points: vec![1.0, 0.0] };
    assert_eq!(of(&one, &[backwards]), Err(TensorProductError::Grid { parameter: "p".into() }));
    assert_eq!(of(&|_| Mat::zeros(2, 2), &grids), Err(TensorProductError::Zero));
    let pole = |rho: &[f64]| from_rows(&[vec![1.0 / (rho[0] - 0.5)]]);
    assert!(matches!(of(&pole, &grids), Err(TensorProductError::Value { rho, .. }) if rho == [0.5, 0.0]));
    let growing = |rho: &[f64]| Mat::<f64>::identity(if rho[1] > 0.5 { 2 } else { 1 }, 1);
    assert!(matches!(of(&growing, &grids), Err(TensorProductError::Value { rows: 1, cols: 1, .. })));
}

/// The distance from `target` to the convex hull of `points`, from above: Frank-Wolfe steps with away steps.
fn distance_to_hull(points: &[Vec<f64>], target: &[f64]) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut shares = vec![0.0; points.len()];
    shares[0] = 1.0;
    let combined =
        |shares: &[f64]| (0..target.len()).map(|l| shares.iter().zip(points).map(|(s, p)| s * p[l]).sum()).collect();
    for _ in 0..20_000 {
        let at: Vec<f64> = combined(&shares);
        let gradient: Vec<f64> = at.iter().zip(target).map(|(a, t)| a - t).collect();
        let slope = |i: &usize| dot(&gradient, &points[*i]);
        let order = |a: &usize, b: &usize| slope(a).total_cmp(&slope(b));
        let (to, from) = (
            (0..points.len()).min_by(order).unwrap(),
            (0..points.len()).filter(|i| shares[*i] > 0.0).max_by(order).unwrap(),
        );
        let direction: Vec<f64> = points[to].iter().zip(&points[from]).map(|(a, b)| a - b).collect();
        let length = dot(&direction, &direction);
        if length == 0.0 {
            break;
        }
        let step = (-dot(&gradient, &direction) / length).clamp(0.0, shares[from]);
        shares[to] += step;
        shares[from] -= step;
    }
    let at: Vec<f64> = combined(&shares);
    at.iter().zip(target).map(|(a, t)| (a - t).powi(2)).sum::<f64>().sqrt()
}

/// Chebyshev polynomial T_n.
fn chebyshev(n: usize, x: f64) -> f64 {
    (n as f64 * x.clamp(-1.0, 1.0).acos()).cos()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// S(p, q, r) = Σ T_a(p) T_b(q) M_ab, with random matrices and without r: the ranks are found exactly, every kind of
    /// weights has its property, and weights and core give the samples back.
    #[test]
    fn models_of_known_rank(
        first in 1usize..5, second in 1usize..4,
        entries in prop::collection::vec(-1.0f64..1.0, 4 * 3 * 4).no_shrink(),
        kind in prop::sample::select(Weighting::ALL.to_vec()),
    ) {
        let matrix = |a: usize, b: usize, e: usize| entries[(a * 3 + b) * 4 + e];
        let function = |rho: &[f64]| {
            Mat::from_fn(2, 2, |i, j| {
                let term = |a, b| chebyshev(a, rho[0]) * chebyshev(b, rho[1]) * matrix(a, b, 2 * i + j);
                (0..first).flat_map(|a| (0..second).map(move |b| (a, b))).map(|(a, b)| term(a, b)).sum()
            })
        };
        let grid = |name, count| ParameterGrid::equidistant(name, "1", [-1.0, 1.0], count);
        let grids = [grid("p", 17), grid("q", 12), grid("r", 3)];
        let options = options(RankRule::Tolerance(1e-9), kind.1);
        let model = TensorProductModel::of(&function, &grids, &options).unwrap();
        prop_assert_eq!(&model.ranks, &vec![first, second, 1]);
        prop_assert!(model.accuracy.grid_max < 1e-10 * model.core.norm_max().max(1.0), "{} {:?}", kind.0, model.accuracy);
        for weights in &model.weights {
            has_the_properties(kind.0, kind.1, weights);
        }
        for depends in &model.dependencies {
            prop_assert_eq!(depends, &vec![first > 1, second > 1, false]);
        }
    }

    /// The same for points without any order: samples at the grid points are random combinations of `rank` random matrices, so
    /// that no hull is symmetric.
    #[test]
    fn samples_of_known_rank(
        rank in 1usize..6,
        entries in prop::collection::vec(-1.0f64..1.0, 20 * 5 + 5 * 6).no_shrink(),
        kind in prop::sample::select(Weighting::ALL.to_vec()),
    ) {
        let function = |rho: &[f64]| {
            let point = rho[0].round() as usize;
            Mat::from_fn(2, 3, |i, j| {
                (0..rank).map(|a| entries[5 * point + a] * entries[100 + 6 * a + 3 * i + j]).sum()
            })
        };
        let grid = ParameterGrid::equidistant("p", "1", [0.0, 19.0], 20);
        let model = TensorProductModel::of(&function, &[grid], &options(RankRule::Tolerance(1e-11), kind.1)).unwrap();
        prop_assert_eq!(&model.ranks, &vec![rank]);
        prop_assert_eq!(model.weights[0].count(), if kind.1 == Weighting::Box { 1 << rank } else { rank + 1 });
        prop_assert!(model.accuracy.grid_max < 1e-10 * model.core.norm_max().max(1.0), "{} {:?}", kind.0, model.accuracy);
        has_the_properties(kind.0, kind.1, &model.weights[0]);
    }

    /// Points of great symmetry, where faces could come in parallel pairs: samples of zeros and ones.
    #[test]
    fn samples_of_zeros_and_ones(
        entries in prop::collection::vec(0u8..2, 12 * 4).no_shrink(),
        kind in prop::sample::select(Weighting::ALL.to_vec()),
    ) {
        prop_assume!(entries.contains(&1));
        let function = |rho: &[f64]| {
            let point = (3.0 * rho[0] + rho[1]).round() as usize;
            Mat::from_fn(2, 2, |i, j| f64::from(entries[4 * point + 2 * i + j]))
        };
        let grid = |name, count: usize| ParameterGrid::equidistant(name, "1", [0.0, count as f64 - 1.0], count);
        let exact = options(RankRule::Tolerance(1e-11), kind.1);
        match TensorProductModel::of(&function, &[grid("p", 4), grid("q", 3)], &exact) {
            Ok(model) => {
                prop_assert!(model.accuracy.grid_max < 1e-10 * model.core.norm_max().max(1.0), "{} {:?}", kind.0, model.accuracy);
                for weights in &model.weights {
                    has_the_properties(kind.0, kind.1, weights);
                }
            }
            Err(error) => {
                let is_said = matches!(error, TensorProductError::NotRelaxed { .. });
                prop_assert!(kind.1 == Weighting::InoRno && is_said, "{}", error);
            }
        }
    }

    /// CNO reaches its limit: a simplex around points has locally least volume only if the centroid of every face lies in the
    /// convex hull of the points on it (V. Klee, "Facet-centroids and volume minimization", 1986). In barycentric coordinates
    /// the centroid of face j is 1/(k − 1) for all but j.
    #[test]
    fn tightest_hull_touches_at_its_facet_centroids(
        rank in 1usize..5, entries in prop::collection::vec(-1.0f64..1.0, 20 * 5).no_shrink(),
    ) {
        let function = |rho: &[f64]| Mat::from_fn(1, rank, |_, a| entries[5 * rho[0].round() as usize + a]);
        let grid = ParameterGrid::equidistant("p", "1", [0.0, 19.0], 20);
        let model = TensorProductModel::of(&function, &[grid], &TensorProductOptions::default()).unwrap();
        let values = &model.weights[0].values;
        let k = values.ncols();
        for face in 0..k {
            let touching: Vec<Vec<f64>> = (0..values.nrows())
                .filter(|i| values[(*i, face)] < 1e-6)
                .map(|i| (0..k).map(|j| values[(i, j)]).collect())
                .collect();
            let centroid: Vec<f64> = (0..k).map(|j| if j == face { 0.0 } else { 1.0 / (k - 1) as f64 }).collect();
            prop_assert!(!touching.is_empty());
            let distance = distance_to_hull(&touching, &centroid);
            prop_assert!(distance < 1e-3, "face {}: {} points, {}", face, touching.len(), distance);
        }
    }

    /// Truncation: the error at the grid points stays below the bound, which is the discarded singular values' where the
    /// constant is kept.
    #[test]
    fn truncation_is_bounded(coupling in 0.05f64..0.9, rank in 1usize..5) {
        let tora = LiteratureModel::Tora(ToraParameters { coupling });
        let (_, grids) = literature("tora");
        let options = options(RankRule::Count(rank), Weighting::Cno);
        let model = TensorProductModel::of(&|rho| tora.at(rho), &grids, &options).unwrap();
        let discarded: f64 =
            model.singular_values.iter().zip(&model.ranks).flat_map(|(values, rank)| &values[*rank..]).map(|v| v * v).sum();
        prop_assert!(model.accuracy.grid_norm <= model.accuracy.bound * (1.0 + 1e-9) + 1e-11, "{:?}", model.accuracy);
        // an axis that is dropped costs as much again as the truncation at most
        prop_assert!(model.accuracy.bound <= 3.0 * discarded.sqrt() + 1e-11, "{:?} {discarded}", model.accuracy);
    }
}
