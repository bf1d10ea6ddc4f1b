//! What the thesis printed and what is right.

/// A slip of the thesis.
pub struct Erratum {
    /// Where it is.
    pub place: &'static str,
    /// What stands there.
    pub printed: &'static str,
    /// What has to stand there.
    pub right: &'static str,
}

const fn erratum(place: &'static str, printed: &'static str, right: &'static str) -> Erratum {
    Erratum { place, printed, right }
}

/// Every slip that was found, in the order of the text.
pub const ERRATA: &[Erratum] = &[
    erratum("(2.60)", "Q", "Q̃"),
    erratum("(2.62)", "left side", "dx̂/dt; the filter's Jacobians are those at w = 0"),
    erratum("(3.19)", "m v̇ = …", "m v̇ = ΣF"),
    erratum("(3.24)", "garbled", "x = [v; r; p q r; φ θ ψ]"),
    erratum(
        "(3.32)",
        "ẋ = A(ψ)x + Bu",
        "ẋ = A(ψ)(x − x*) + B(u − u*): in deviations. (3.33) is missing: B is (3.29) at φ = θ = 0",
    ),
    erratum("Ā₂, entry (2, 3)", "p(I_z − I_x) I_y", "p(I_z − I_x)/I_y; the third row is zero only because I_x = I_y"),
    erratum(
        "Ā₃, Ā₄",
        "garbled entries",
        "the Jacobians that dual numbers give; Ā₃ = [c_ψ/c_θ, −s_ψ/c_θ, 0; s_ψ, c_ψ, 0; −c_ψ t_θ, s_ψ t_θ, 1]",
    ),
    erratum("before (4.21)", "‖ν‖₁ = 0", "Σνᵢ = 0"),
    erratum(
        "(4.15)",
        "P(ρ) = Σ ρᵢPᵢ",
        "Y(ρ) = Σ ρᵢYᵢ and P = Y(ρ)⁻¹, which is not affine; (A.19) has no meaning as written",
    ),
    erratum(
        "(4.32)",
        "as programmed: without the 2 of 2Y(ν), and (4.31) for i = 1 only",
        "with both: bounds 77.0554 and 68.7353, not 72.3877 and 55.7618",
    ),
    erratum("(4.35)", "A + BK", "A − BK"),
    erratum(
        "(4.36), (5.18), (5.20), (A.30)",
        "blocks L and Lᵀ exchanged",
        "block (1, 3) is L(ρ)ᵀ, block (3, 1) is L(ρ)",
    ),
    erratum("(A.37)", "ℓᵢ, lower left", "ℓᵢᵀ"),
    erratum(
        "Lemma 2.1, Theorem 4.5",
        "a bound for every motion",
        "a bound for a parameter at rest: the lemma needs the minimiser ρ*(x), not the scheduled ρ",
    ),
    erratum("Table 4.1, actual costs", "55.6300, 55.7392", "56.203, 56.026; nothing costs less than 55.89497"),
    erratum(
        "Theorem 5.2",
        "a better design than Theorem 5.1",
        "the same optimal Y; for diagonal R every gain on F + s(R⁻¹BᵀP − F), 0 ≤ s ≤ 1, is a solution, (5.14) at s = 0.102",
    ),
    erratum(
        "Table 5.1, actual costs",
        "0.002 to 0.006 low",
        "12.9242; 14.6289, 39.6808, 59.6849; the tolerance of the integration",
    ),
    erratum("(6.3)", "490.4586, and a garbled second half", "390.4586"),
    erratum("(6.3)-(6.7)", "computed with g = 9.81", "Table 6.1 says 9.807"),
    erratum(
        "(6.7)",
        "K(ψ)",
        "the gain at ψ + π: on the thesis's model max Re λ = +3.263; with columns 1, 2, 4, 5, 10, 11 negated −0.7071",
    ),
    erratum(
        "6.2.1",
        "Theorems 4.1-4.4 fail because the model is conservative",
        "they fail because the hull of the yaw circle holds its centre, where roll and pitch have no input; on arcs they succeed",
    ),
    erratum(
        "6.2.2",
        "the SLPVQR guarantees stability in flight",
        "the certified sets reach 0.65, 1.76 and 1.81 m along x, for a yaw at rest: proved up to 0.37 (γ = 1) and 0.014 rad/s (γ = 20)",
    ),
];
