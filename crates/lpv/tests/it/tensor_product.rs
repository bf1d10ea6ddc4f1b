//! The tensor-product model transformation: published singular values, the defining properties of every kind of weights, and
//! reconstruction.

use lpv::model::literature::LiteratureModel;
use lpv::model::tensor_product::{
    ParameterGrid, RankRule, TensorProductModel, TensorProductOptions, WeightFunctions, Weighting,
};

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
