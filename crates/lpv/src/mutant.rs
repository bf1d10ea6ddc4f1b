//! Defects of the prover, one at a time, for the suite that has to find them (`validation/mutants`).
//!
//! With the feature `mutants`, which no other build has, the environment variable `LPV_MUTANT` names one of `TABLE`
//! and the prover is wrong in that way. Without it `is` is the constant `false`, and the hooks vanish.

/// Whether this defect is switched on.
#[cfg(not(feature = "mutants"))]
pub const fn is(_: &str) -> bool {
    false
}

/// Whether this defect is switched on.
#[cfg(feature = "mutants")]
pub fn is(name: &str) -> bool {
    static CHOSEN: std::sync::LazyLock<Option<String>> = std::sync::LazyLock::new(|| std::env::var("LPV_MUTANT").ok());
    CHOSEN.as_deref() == Some(name)
}

/// Name of each defect, and what is wrong with it.
#[cfg(feature = "mutants")]
pub const TABLE: &[(&str, &str)] = &[
    ("one-free-frees-all", "one input without a limit takes the limits of the others away"),
    ("one-sided-is-free", "an input with one limit has none"),
    ("larger-side", "of lopsided limits the larger side counts"),
    ("rounding-off", "intervals are not widened by what operations round"),
    ("lower-end-refutes", "the lower end of an interval is read where the upper one is due"),
    ("margin-sign", "a matrix that is not definite in the middle of a cell passes"),
    ("cells-by-their-middle", "a cell is proved by its middle alone"),
    ("slope-dropped", "what is linear on a cell is left out"),
    ("remainder-dropped", "the remainder of Taylor's theorem is left out"),
    ("last-piece-skipped", "the last piece of the range is not looked at"),
    ("last-cell-skipped", "the last narrower cell of a piece is not looked at"),
    ("rate-dropped", "the parameter rests"),
    ("rate-halved", "the parameter moves at half of its rate"),
    ("rate-one-end", "the parameter moves in one direction only"),
    ("premise-ignored", "verdicts on premises are not carried over"),
    ("definiteness-assumed", "P need not be definite"),
    ("q-indefinite", "Q need not be semidefinite"),
    ("asymmetry-tolerated", "P need not be symmetric"),
    ("level-unchecked", "the low gain may saturate on the set"),
    ("level-not-lowered", "the level that was asked for is claimed, a smaller one proved"),
    ("vertex-skipped", "the last vertex of a polytope is not looked at"),
    ("pair-skipped", "between the vertices of a polytope nothing is looked at"),
    ("pair-cost-halved", "between vertices half of the cost counts"),
    ("low-mixture-only", "of the mixtures of rows only the low gain is looked at"),
    ("saturation-is-free", "row by row, saturation takes nothing"),
    ("factor-two-missing", "row by row, the factor 2 of the gradient is missing"),
    ("share-halved", "row by row, half of what saturation takes is taken"),
    ("coupling-dropped", "row by row, what R couples is left out"),
    ("input-cost-forgotten", "the cost has no R"),
    ("cost-factor-lowered", "the cost bound is claimed with a factor of 1"),
    ("witness-saturates", "a witness may be at a state where an input is at its limit"),
    ("cost-witness-factor", "a witness of the cost need not exceed the factor"),
    ("sampled-time-halved", "the sampled loop is looked at with half of its sample time"),
    ("sampled-series-cut", "of the series of the zero-order hold two terms are taken"),
    ("sampled-edge-stable", "a sampled loop too close to the unit circle to be told is stable"),
    ("sampled-low-only", "the sampled saturated loop flies the low gain"),
    ("box-cells-by-their-middle", "a cell of several parameters is proved by its middle alone"),
    ("box-cell-skipped", "the last cell of the box of several parameters is not looked at"),
    ("approximation-trusted", "of the LPV model what holds for its tensor-product model is claimed"),
    ("range-unchecked", "states that are parameters may go twice as far as the parameters' ranges"),
    ("gain-lowered", "the L2 gain of the grid is claimed, a larger one proved"),
    ("gain-rate-dropped", "the L2 gain is that of a parameter that rests"),
    ("governor-row-skipped", "the last row of a governed reference's residual is not looked at"),
    ("governor-authority", "the reference's input and the feedback's limits may together exceed the actuators"),
];
