//! Problems of SDPLIB 1.2 against their published optima (`tests/data/README.md`).

use lmi::{Answer, Options, Outcome, sdpa};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// A small problem from the repository, a larger one from the data beside it; `None` where those are absent.
fn solve(name: &str) -> Option<Answer> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let file = format!("{name}.dat-s");
    let places: [PathBuf; 2] =
        [here.join("tests/data").join(&file), here.join("../../../shared/data/sdplib").join(&file)];
    let Some(path) = places.iter().find(|path| path.is_file()) else {
        println!("{name}: skipped, no file {file}");
        return None;
    };
    let problem = sdpa::read(BufReader::new(File::open(path).unwrap())).unwrap();
    Some(problem.solve(&Options::default()).unwrap())
}

fn check(name: &str, optimum: f64, tolerance: f64) {
    let Some(answer) = solve(name) else { return };
    // Where rounding leaves much of the dual equations, the bound is not one for every x.
    assert!(answer.outcome.is_feasible(), "{name}: {:?} {:?}", answer.outcome, answer.residuals);
    let error = (answer.objective - optimum).abs() / optimum.abs();
    assert!(error < tolerance, "{name}: {} instead of {optimum}", answer.objective);
    let (bound, attained) = (answer.optimum_bound.unwrap(), answer.attained.unwrap());
    assert!(bound.value <= attained && bound.reach >= 10.0, "{name}: {bound:?} {attained:e}");
    println!(
        "{name}: optimum proved in [{:.9e}, {attained:.9e}], reach {}: {}",
        bound.value,
        bound.reach,
        answer.outcome.word()
    );
    assert!(answer.residuals.gap <= 1e-7 && answer.residuals.primal <= 1e-7 && answer.residuals.dual <= 1e-7);
}

/// The published optima have seven digits.
const PUBLISHED: f64 = 1e-6;

#[test]
fn control() {
    check("control1", 17.78463, PUBLISHED);
    check("control2", 8.300000, PUBLISHED);
    check("control3", 13.63327, PUBLISHED);
}

#[test]
fn truss() {
    check("truss1", -8.999996, PUBLISHED);
    check("truss3", -9.109996, PUBLISHED);
}

#[test]
fn graphs() {
    check("mcp100", 226.1574, PUBLISHED);
    check("theta1", 23.00000, PUBLISHED);
}

/// Quadratic assignment, whose multipliers have no interior. Published is −3.8144 (in hundreds); seven digits from a run in 106 bits.
#[test]
fn assignment() {
    check("qap6", -381.43840, 2e-7);
}

/// Problems without interior: the digits that are known, and no claim beyond them.
#[test]
fn ill_posed_control() {
    for (name, optimum, tolerance) in
        [("hinf1", 2.0326, 1e-3), ("hinf2", 10.967, 1e-3), ("hinf3", 56.9, 5e-3), ("hinf13", 46.0, 5e-2)]
    {
        let Some(answer) = solve(name) else { continue };
        let error = (answer.objective - optimum).abs() / optimum;
        assert!(error < tolerance, "{name}: {} instead of {optimum}", answer.objective);
        match answer.outcome {
            Outcome::Solved => assert!(answer.residuals.gap <= 1e-7),
            Outcome::SolvedToTolerance(_) | Outcome::Inaccurate(_) => {}
            other => panic!("{name}: {other:?}"),
        }
    }
}

/// In the terms of SDPLIB, which calls the side of Z primal: infp1 has no x, infd1 no Z.
#[test]
fn infeasible_ones() {
    if let Some(answer) = solve("infp1") {
        assert!(matches!(answer.outcome, Outcome::Infeasible(_)), "{:?}", answer.outcome);
    }
    if let Some(answer) = solve("infd1") {
        assert!(matches!(answer.outcome, Outcome::Unbounded(_)), "{:?}", answer.outcome);
    }
}
