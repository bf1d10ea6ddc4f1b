//! What the thesis printed and what is right. Numbers that were recomputed are read from the tables.

use super::comparison::Table;
use serde::Serialize;

/// A slip of the thesis.
#[derive(Clone, Debug, Serialize)]
pub struct Erratum {
    /// Where it is.
    pub place: &'static str,
    /// What stands there.
    pub printed: String,
    /// What has to stand there.
    pub right: String,
}

/// Slips of the equations, in the order of the text.
const EQUATIONS: &[[&str; 3]] = &[
    ["(2.60)", "Q", "Q̃"],
    ["(2.62)", "left side x̂", "dx̂/dt; the filter's Jacobians are those at w = 0"],
    ["(3.19)", "m v̇ without the sum", "m v̇ = ΣF"],
    ["(3.24)", "garbled", "x = [v; r; p q r; φ θ ψ]"],
    ["(3.32)", "ẋ = A(ψ)x + Bu", "ẋ = A(ψ)(x − x*) + B(u − u*): in deviations"],
    ["(3.33)", "missing", "B is (3.29) at φ = θ = 0"],
    ["(3.36)-(3.39)", "ρᵢ", "the same: right, as are (3.10), (3.15), (3.16) and (3.26), by finite differences"],
    [
        "Ā₂, entry (2, 3)",
        "p(I_z − I_x) I_y",
        "p(I_z − I_x)/I_y; the third row is zero only because I_x = I_y: in general [q(I_x − I_y)/I_z, p(I_x − I_y)/I_z, 0]",
    ],
    ["Ā₃", "garbled, run together with Ā₄", "[c_ψ/c_θ, −s_ψ/c_θ, 0; s_ψ, c_ψ, 0; −c_ψ t_θ, s_ψ t_θ, 1]"],
    [
        "Ā₄",
        "garbled, run together with Ā₃",
        "[0, (p c_ψ − q s_ψ) t_θ/c_θ, −(p s_ψ + q c_ψ)/c_θ; 0, 0, p c_ψ − q s_ψ; 0, (q s_ψ − p c_ψ)/c_θ², (p s_ψ + q c_ψ) t_θ]",
    ],
    ["before (4.21)", "‖ν‖₁ = 0", "Σνᵢ = 0"],
    ["(4.15)", "P(ρ) = Σ ρᵢPᵢ", "Y(ρ) = Σ ρᵢYᵢ and P = Y(ρ)⁻¹, which is not affine"],
    ["(A.19)", "follows (4.15)", "has no meaning as written; the signs of Ẏ in Lemma 4.2 and Theorem 4.4 agree"],
    ["(4.35)", "A + BK", "A − BK"],
    [
        "(4.36), (5.18), (5.20), (A.30)",
        "L(ρ) or S in block (1, 3), its transpose in (3, 1)",
        "L(ρ)ᵀ or Sᵀ in (1, 3), L(ρ) or S in (3, 1)",
    ],
    ["(A.30)", "θ", "ρ"],
    ["(A.37)", "ℓᵢ, lower left", "ℓᵢᵀ"],
    ["Theorem 4.3, title of Table 4.1", "x(0) not stated", "x(0) = [π, 0], so ρ(0) = (0, 1)"],
    [
        "Lemma 2.1, Theorems 4.5, 5.3, 5.4",
        "a bound for every motion",
        "a bound for a parameter at rest: the lemma needs the minimiser ρ*(x), not the scheduled ρ",
    ],
];

/// Every slip that was found: of the equations, then of the numbers.
pub fn errata(tables: &[Table]) -> Vec<Erratum> {
    let value = |row: &str, quantity: &str| -> String {
        let entries = tables.iter().flat_map(|table| &table.entries);
        let found = entries.into_iter().find(|entry| entry.row.starts_with(row) && entry.quantity == quantity);
        found.map_or_else(|| "–".into(), |entry| entry.shown())
    };
    let bound = |row: &str| value(row, "guaranteed cost");
    let cost = |row: &str| value(row, "actual cost");
    let numbers = [
        (
            "(4.32)",
            "as programmed: without the 2 of 2Y(ν), and (4.31) for i = 1 only: bounds 72.3877 and 55.7618".to_owned(),
            format!(
                "with both: {} and {}. The printed ones are no bounds: ρ = (0, 1) at rest already costs {}",
                bound("Theorem 4.4, |ẋ₁| ≤ π"),
                bound("Theorem 4.4, |ẋ₁| ≤ 2"),
                bound("Theorem 4.5")
            ),
        ),
        (
            "Table 4.1, actual costs",
            "55.6300 (Theorem 4.4), 55.7392 (Theorem 4.5)".into(),
            format!(
                "{} and {}; no controller costs less than {}. Theorem 4.5 exceeds its own \"guarantee\", {}",
                cost("Theorem 4.4, |ẋ₁| ≤ 2"),
                cost("Theorem 4.5"),
                cost("Least cost"),
                bound("Theorem 4.5")
            ),
        ),
        (
            "Theorem 4.3",
            "J < min x(0)ᵀPx(0)".into(),
            format!(
                "the largest tr Y is not the least x(0)ᵀPx(0): its bound is {}, and {} is in reach of the same inequalities",
                bound("Theorem 4.3, common Y"),
                bound("Theorem 4.3, least bound")
            ),
        ),
        (
            "Theorem 5.2",
            "a better design than Theorem 5.1; K (5.14) = [117.0280, 152.2037]".into(),
            format!(
                "the same optimal Y; for diagonal R every gain on F + s(R⁻¹BᵀP − F), 0 ≤ s ≤ 1, is a solution, and (5.14) is the point s = {}",
                value("High gain (5.14)", "s on K_s")
            ),
        ),
        (
            "Table 5.1, actual costs",
            "LQR 12.9183; SLQR 14.6245, 39.6767, 59.6823; high gain 12.9800, 13.7781, 14.1560".into(),
            format!(
                "LQR {}; SLQR {}, {}, {}; high gain {}, {}, {} (at that s): the printed ones are 0.002 to 0.006 low, the tolerance of their integration",
                cost("LQR"),
                cost("SLQR, γ = 1"),
                cost("SLQR, γ = 30"),
                cost("SLQR, γ = 60"),
                cost("High-gain SLQR, γ = 1"),
                cost("High-gain SLQR, γ = 30"),
                cost("High-gain SLQR, γ = 60")
            ),
        ),
        ("(6.3)", "490.4586, and a garbled second half".into(), "390.4586".into()),
        ("(6.3)-(6.7), Table 6.1", "g = 9.807".into(), "the gains were computed with g = 9.81".into()),
        (
            "(6.7)",
            "K(ψ), stabilising".into(),
            format!(
                "the gain at ψ + π: on the thesis's model max Re λ = +{}; with columns 1, 2, 4, 5, 10, 11 negated {}. The Kᵢ are vertex values of an affine K(cos ψ, sin ψ), not regulators \
                 of the vertex systems",
                value("K(ψ) as printed, at ψ = 0", "max Re λ"),
                value("the same, columns", "max Re λ")
            ),
        ),
        (
            "6.2.1",
            "Theorems 4.1-4.4 fail because the model of four vertices is conservative".into(),
            format!(
                "they fail because the hull of the yaw circle holds its centre, where roll and pitch have no input; on arcs of ±30° to ±88° they succeed, with margins {} to {}",
                value("Theorem 4.1, yaw within ±30°", "largest margin, tr Y = 12"),
                value("Theorem 4.1, yaw within ±88°", "largest margin, tr Y = 12")
            ),
        ),
        (
            "6.2.2",
            "the SLPVQR guarantees stability in the flights shown".into(),
            format!(
                "the certified sets reach {}, {} and {} m along x, for a yaw at rest; they are proved invariant up to {} (γ = 1) and {} rad/s (γ = 20)",
                value("Theorem 5.3, γ = 1", "certified step in x / m"),
                value("Theorem 5.3, γ = 10", "certified step in x / m"),
                value("Theorem 5.3, γ = 20", "certified step in x / m"),
                value("Theorem 5.3, γ = 1", "proved yaw rate / (rad/s)"),
                value("Theorem 5.3, γ = 20", "proved yaw rate / (rad/s)")
            ),
        ),
    ];
    let equations = EQUATIONS.iter().map(|&[place, printed, right]| (place, printed.to_owned(), right.to_owned()));
    equations.chain(numbers).map(|(place, printed, right)| Erratum { place, printed, right }).collect()
}
