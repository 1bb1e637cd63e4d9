//! Numbers that a configuration may hold only within bounds; refused where they are read, a wrong one is shown with its line.

use serde::{Deserialize, Serialize};

/// A number above zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Positive(pub(crate) f64);

/// A number of at least zero.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct NotNegative(f64);

impl Positive {
    /// One.
    pub const ONE: Self = Self(1.0);

    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl NotNegative {
    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }

    /// Half of it.
    pub(crate) fn half(self) -> Self {
        Self(0.5 * self.0)
    }
}

impl TryFrom<f64> for Positive {
    type Error = String;

    fn try_from(value: f64) -> Result<Self, String> {
        match value > 0.0 && value.is_finite() {
            true => Ok(Self(value)),
            false => Err(format!("expected a number above 0, found {value}")),
        }
    }
}

impl TryFrom<f64> for NotNegative {
    type Error = String;

    fn try_from(value: f64) -> Result<Self, String> {
        match value >= 0.0 && value.is_finite() {
            true => Ok(Self(value)),
            false => Err(format!("expected a number of at least 0, found {value}")),
        }
    }
}

impl From<Positive> for f64 {
    fn from(number: Positive) -> Self {
        number.0
    }
}

impl From<NotNegative> for f64 {
    fn from(number: NotNegative) -> Self {
        number.0
    }
}
