//! A measured number with its standard uncertainty.

use serde::{Deserialize, Serialize};

/// A measured number with its standard uncertainty (one standard deviation), in the same unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Best estimate.
    pub value: f64,
    /// Standard uncertainty, not negative.
    pub sigma: f64,
}

impl Estimate {
    /// Half width of a 95 % interval of a normal distribution, in standard deviations.
    pub const COVERAGE_95: f64 = 1.959_963_984_540_054;

    /// Beyond so many standard deviations lies one sound value in a hundred.
    const UNUSUAL: f64 = 2.58;

    /// An estimate from its value and standard uncertainty.
    pub fn new(value: f64, sigma: f64) -> Self {
        Self { value, sigma }
    }

    /// The estimate in another unit: value and uncertainty times `factor`.
    pub fn scaled(self, factor: f64) -> Self {
        Self { value: self.value * factor, sigma: self.sigma * factor.abs() }
    }

    /// Whether it lies farther from zero than ninety-nine in a hundred do that scatter by `scatter` besides their own uncertainty.
    pub fn is_unusual(self, scatter: f64) -> bool {
        self.value.abs() > Self::UNUSUAL * self.sigma.hypot(scatter)
    }

    /// Whether `truth` lies within the 95 % interval.
    pub fn covers_95(self, truth: f64) -> bool {
        (self.value - truth).abs() <= Self::COVERAGE_95 * self.sigma
    }
}
