//! The outcome of a test of a simpler model.

use chainwave_measurement::Estimate;

/// How far measurements depart from a simpler model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Departure {
    /// What departs, in words of the question's own: a factor or a relative scatter.
    pub size: Estimate,
    /// The test's statistic: chi squared with `degrees_of_freedom` degrees of freedom where the simpler model holds.
    pub chi_squared: f64,
    /// Its degrees of freedom.
    pub degrees_of_freedom: usize,
    /// Probability of so large a statistic under the simpler model.
    pub p_value: f64,
}
