//! The light over time: drift and flicker, averaged over an exposure.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::SyntheticError;
use crate::check::require;

/// Light that is not the same in every frame: a factor (1 + drift t) (1 + amplitude sin(2 pi frequency t + phase)) on
/// everything the camera sees, t after the trigger.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lighting {
    /// Relative change a second.
    #[serde(default)]
    pub drift_per_s: f64,
    /// Relative amplitude of the flicker.
    #[serde(default)]
    pub flicker_amplitude: f64,
    /// Its frequency (twice the mains', or a switching supply's).
    #[serde(default)]
    pub flicker_hz: f64,
}

impl Lighting {
    pub(crate) fn check(&self) -> Result<(), SyntheticError> {
        require(
            self.drift_per_s.is_finite(),
            "camera.lighting.drift_per_s",
            "a finite number",
            self.drift_per_s,
        )?;
        let amplitude = self.flicker_amplitude;
        let expected = "0 to 1";
        require((0.0..=1.0).contains(&amplitude), "camera.lighting.flicker_amplitude", expected, amplitude)?;
        let frequency = self.flicker_hz >= 0.0 && self.flicker_hz <= 1.0e9;
        require(frequency, "camera.lighting.flicker_hz", "0 to 1e9", self.flicker_hz)
    }

    /// The factor averaged over an exposure centred at `time_s`: the mean of a sine over a window is its value in the
    /// middle times sinc. (The drift within an exposure is left out of the product: below drift * exposure.)
    pub(crate) fn factor(&self, time_s: f64, exposure_s: f64, phase_rad: f64) -> f64 {
        let half_turn = PI * self.flicker_hz * exposure_s;
        let sinc = if half_turn > 0.0 { libm::sin(half_turn) / half_turn } else { 1.0 };
        let flicker =
            self.flicker_amplitude * sinc * libm::sin(2.0 * PI * self.flicker_hz * time_s + phase_rad);
        ((1.0 + self.drift_per_s * time_s) * (1.0 + flicker)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_is_the_mean_over_the_exposure() {
        let lighting = Lighting { drift_per_s: 0.5, flicker_amplitude: 0.1, flicker_hz: 12_000.0 };
        let (exposure_s, phase_rad) = (3.0e-5, 0.7);
        for time_s in [-1.0e-3, 0.0, 2.345e-3] {
            let n = 10_000;
            let mean = (0..n)
                .map(|i| time_s + ((f64::from(i) + 0.5) / f64::from(n) - 0.5) * exposure_s)
                .map(|t| (1.0 + 0.5 * t) * (1.0 + 0.1 * (2.0 * PI * 12_000.0 * t + phase_rad).sin()))
                .sum::<f64>()
                / f64::from(n);
            // 1e-6: drift times exposure times the flicker, 0.5 * 3e-5 * 0.1 / 2, and the midpoint rule.
            assert!((lighting.factor(time_s, exposure_s, phase_rad) - mean).abs() < 1.0e-6);
        }
    }

    #[test]
    fn steady_light_is_exactly_one() {
        let steady = Lighting { drift_per_s: 0.0, flicker_amplitude: 0.0, flicker_hz: 0.0 };
        assert_eq!(steady.factor(0.123, 1.0e-5, 2.0).to_bits(), 1.0_f64.to_bits());
    }
}
