//! The saturated quadratic regulator of a quadrotor with high gain, as its theorem states it:
//! maximise tr Y over Y, L, M with, for every choice S of rows from L and M,
//!
//! ```text
//! [ −(AY − BS) − (AY − BS)ᵀ   Y     Sᵀ  ]          [ σ²/γ   mᵢ ]
//! [ Y                         Q⁻¹   0   ]  ≻ 0,    [ mᵢᵀ    Y  ]  ≻ 0,   mᵢ: row i of M.
//! [ S                         0     R⁻¹ ]
//! ```
//!
//! With `--low-gain` S = L = M, one vertex; with `--sweep` a grid of yaw angles, each solved near the one before; with `--write` the
//! problem goes to standard output in the SDPA sparse format.
//!
//! `cargo run --release -p lmi --example saturated_regulator -- [--low-gain] [REPETITIONS | --sweep POINTS | --write]`

use lmi::{Expr, Mat, Options, Problem};
use std::time::Instant;

/// The problem and Y; with low gain S = L = M.
fn saturated(
    a: &Mat<f64>,
    b: &Mat<f64>,
    q: &[f64],
    r: &[f64],
    sigma: f64,
    gamma: f64,
    low_gain: bool,
) -> (Problem, Expr) {
    let (n, m) = (a.nrows(), b.ncols());
    let mut p = Problem::new();
    let y = p.symmetric("Y", n);
    let k = p.rectangular("M", m, n);
    let l = if low_gain { k.clone() } else { p.rectangular("L", m, n) };
    for vertex in if low_gain { 0..1 } else { 0..1_u32 << m } {
        let v = Mat::from_fn(m, m, |i, j| f64::from(u32::from(i == j) & (vertex >> i)));
        let s = if low_gain { k.clone() } else { &v * &l + (Mat::<f64>::identity(m, m) - &v) * &k };
        let f = a * &y - b * &s;
        p.positive_definite(
            format!("Riccati, vertex {vertex}"),
            Expr::symmetric_blocks(vec![
                vec![-(&f + f.t())],
                vec![y.clone(), Expr::constant(inverse_diagonal(q))],
                vec![s, Expr::zeros(m, n), Expr::constant(inverse_diagonal(r))],
            ]),
        );
    }
    for i in 0..m {
        let bound = Expr::constant(Mat::from_fn(1, 1, |_, _| sigma * sigma / gamma));
        p.positive_definite(
            format!("saturation of input {i}"),
            Expr::symmetric_blocks(vec![vec![bound], vec![k.row(i).t(), y.clone()]]),
        );
    }
    p.maximize(&y.trace());
    (p, y)
}

fn inverse_diagonal(d: &[f64]) -> Mat<f64> {
    Mat::from_fn(d.len(), d.len(), |i, j| if i == j { 1.0 / d[i] } else { 0.0 })
}

/// The quadrotor at hover, state [v, r, p q r, φ θ ψ], mass 2 kg, arm 0.3 m, inertia 1.25, 1.25, 2.5 kg m².
fn quadrotor(yaw_rad: f64) -> (Mat<f64>, Mat<f64>) {
    let (s, c) = yaw_rad.sin_cos();
    let g = 9.807;
    let entries = [
        (0, 10, g),
        (1, 9, -g),
        (3, 0, 1.0),
        (4, 1, 1.0),
        (5, 2, 1.0),
        (9, 6, c),
        (9, 7, -s),
        (10, 6, s),
        (10, 7, c),
        (11, 8, 1.0),
    ];
    let mut a = Mat::zeros(12, 12);
    entries.iter().for_each(|&(i, j, value)| a[(i, j)] = value);
    let b = Mat::from_fn(12, 4, |i, rotor| match i {
        2 => 0.5,
        6 => [0.0, 0.24, 0.0, -0.24][rotor],
        7 => [-0.24, 0.0, 0.24, 0.0][rotor],
        8 => [0.03, -0.03, 0.03, -0.03][rotor],
        _ => 0.0,
    });
    (a, b)
}

/// Weights, σ = mg/4 and γ = 20 at one yaw angle.
fn design(yaw_rad: f64, low_gain: bool) -> (Problem, Expr) {
    let (a, b) = quadrotor(yaw_rad);
    let q = [1.0, 1.0, 100.0, 1.0, 1.0, 50.0, 50.0, 50.0, 50.0, 1.0, 1.0, 100.0];
    saturated(&a, &b, &q, &[0.001; 4], 2.0 * 9.807 / 4.0, 20.0, low_gain)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (flags, numbers): (Vec<String>, Vec<String>) = std::env::args().skip(1).partition(|a| a.starts_with("--"));
    let number = numbers.first().map_or(Ok(1), |text| text.parse())?.max(1);
    let low_gain = flags.iter().any(|flag| flag == "--low-gain");
    if flags.iter().any(|flag| flag == "--sweep") {
        return sweep(number, low_gain);
    }
    if flags.iter().any(|flag| flag == "--write") {
        let (problem, _) = design(0.3, low_gain);
        lmi::sdpa::write(&problem.to_sdp(&Options::default())?, std::io::stdout().lock())?;
        return Ok(());
    }
    let mut fastest = f64::INFINITY;
    for repetition in 0..number {
        let started = Instant::now();
        let (problem, y) = design(0.3, low_gain);
        let answer = problem.solve(&Options::default())?;
        fastest = fastest.min(started.elapsed().as_secs_f64());
        if repetition == 0 {
            let smallest = answer.blocks.iter().map(|block| block.smallest_eigenvalue).fold(f64::INFINITY, f64::min);
            println!(
                "{:?}: tr Y = {:.9}, gap {:.1e}",
                answer.outcome,
                answer.value(&y.trace())[(0, 0)],
                answer.residuals.gap
            );
            println!("smallest eigenvalue over all blocks {smallest:.1e}, {} iterations", answer.iterations.len());
        }
    }
    println!("{:.1} ms", 1e3 * fastest);
    Ok(())
}

/// A grid of yaw angles over the circle, each solved near the one before.
fn sweep(points: usize, low_gain: bool) -> Result<(), Box<dyn std::error::Error>> {
    let started = Instant::now();
    let (mut iterations, mut worst) = (0, 0.0_f64);
    let mut before: Option<lmi::Answer> = None;
    for k in 0..points {
        let (problem, _) = design(std::f64::consts::TAU * k as f64 / points as f64, low_gain);
        let answer = match &before {
            Some(neighbour) => problem.solve_near(neighbour, &Options::default())?,
            None => problem.solve(&Options::default())?,
        };
        assert!(matches!(answer.outcome, lmi::Outcome::Solved), "{:?}", answer.outcome);
        iterations += answer.iterations.len();
        worst = worst.max(answer.residuals.gap);
        before = Some(answer);
    }
    println!(
        "{points} points, {iterations} iterations, largest gap {worst:.1e}: {:.1} ms",
        1e3 * started.elapsed().as_secs_f64()
    );
    Ok(())
}
