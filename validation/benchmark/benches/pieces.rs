//! The pieces of a solve, on the high-gain design of a quadrotor and on SDPLIB's control1: `cargo bench` in this folder.

use criterion::{Criterion, criterion_group, criterion_main};
use lmi::{Options, sdpa};
use std::hint::black_box;
use std::path::Path;
use std::process::Command;

/// The text of a problem: what the example of `lmi` writes, or a file among its tests.
fn problems() -> Vec<(&'static str, Vec<u8>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let example = root.join("target/release/examples/saturated_regulator");
    let high_gain = Command::new(&example).arg("--write").output().map(|output| output.stdout);
    let control1 = std::fs::read(root.join("crates/lmi/tests/data/control1.dat-s"));
    [("quadrotor high gain", high_gain), ("control1", control1)]
        .into_iter()
        .map(|(name, text)| (name, text.unwrap_or_else(|error| panic!("{name}: {error}; build lmi's examples first"))))
        .collect()
}

fn pieces(criterion: &mut Criterion) {
    for (name, text) in problems() {
        let problem = sdpa::read(&text[..]).expect("a problem");
        let answer = problem.solve(&Options::default()).expect("an answer");
        let x: Vec<f64> = answer.unknown_values()[0].col(0).iter().copied().collect();
        let mut group = criterion.benchmark_group(name);
        group.bench_function("read", |b| b.iter(|| sdpa::read(black_box(&text[..]))));
        // Structure, balancing and the proofs at the end, with 1 and with 6 iterations: the difference is five iterations.
        for iterations in [1, 6] {
            let options = Options { max_iterations: iterations, ..Options::default() };
            group.bench_function(format!("{iterations} iterations"), |b| b.iter(|| problem.solve(&options)));
        }
        group.bench_function("whole solve", |b| b.iter(|| problem.solve(&Options::default())));
        group.bench_function("proof of all blocks", |b| b.iter(|| problem.verify(black_box(&x))));
        group.finish();
    }
}

criterion_group!(benches, pieces);
criterion_main!(benches);
