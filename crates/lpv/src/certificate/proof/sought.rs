//! Factors of cost bounds, and the rates among which the largest is sought.

/// By this factor the cost bound of a frozen design may be exceeded when it is proved for a moving parameter.
pub const COST_INFLATION: f64 = 1.1;
/// The same of a design that was made for a moving parameter.
pub const COST_INFLATION_RATE_BOUNDED: f64 = 1.01;
/// Rates are found to this factor.
pub(super) const RATE_RATIO: f64 = 1.03;
/// Rates outside are not sought.
pub(super) const RATES: [f64; 2] = [1e-4, 1e5];
