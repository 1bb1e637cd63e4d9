//! A shaker: a sine imposed on body 1, that grows from rest.

use std::f64::consts::{PI, TAU};

use chainwave_mechanics::{ImposedMotion, MechanicsError};

/// A shaker that moves body 1 by a sine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shaker {
    /// Frequency.
    pub(crate) frequency_hz: f64,
    /// Displacement from the middle.
    pub(crate) amplitude_m: f64,
    /// Time in which the amplitude grows from 0, as half a cosine; 0 to begin at once.
    pub(crate) ramp_s: f64,
}

/// Samples of a period, or of the ramp where that is shorter: a cubic spline through so many errs by 5 / 384 (2 pi / 128)^4 = 8e-8 of
/// the amplitude.
const SAMPLES: f64 = 128.0;
/// The fewest of a motion.
const FEWEST: f64 = 8.0;
/// How much longer than asked for the motion is, relative to it: the last output may lie a rounding behind.
const MARGIN: f64 = 1e-6;

impl Shaker {
    /// Displacement at a time.
    fn at(&self, t_s: f64) -> f64 {
        let grown = if t_s < self.ramp_s { 0.5 * (1.0 - (PI * t_s / self.ramp_s).cos()) } else { 1.0 };
        self.amplitude_m * grown * (TAU * self.frequency_hz * t_s).sin()
    }

    /// The motion that it imposes for a time, in metres.
    ///
    /// # Errors
    /// Numbers that make no motion.
    pub(crate) fn motion(&self, duration_s: f64) -> Result<ImposedMotion, MechanicsError> {
        let until_s = duration_s * (1.0 + MARGIN);
        let period_s = self.frequency_hz.recip();
        let shortest_s = if self.ramp_s > 0.0 { period_s.min(2.0 * self.ramp_s) } else { period_s };
        let n = (SAMPLES * until_s / shortest_s).ceil().max(FEWEST);
        let times_s: Vec<f64> = (0..=n as usize).map(|k| until_s * k as f64 / n).collect();
        let displacement_m = times_s.iter().map(|t_s| self.at(*t_s)).collect();
        ImposedMotion::from_samples(times_s, displacement_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_motion_is_the_sine_with_its_ramp() {
        for ramp_s in [0.0, 0.01] {
            let shaker = Shaker { frequency_hz: 200.0, amplitude_m: 1e-3, ramp_s };
            let motion = shaker.motion(0.05).unwrap();
            for k in 0..=500 {
                let t_s = 1e-4 * f64::from(k);
                // The spline's bound above, and as much again at the ramp's end, where the third derivative jumps.
                assert!((motion.displacement_m(t_s) - shaker.at(t_s)).abs() < 1e-9, "{t_s}");
            }
            assert!(motion.displacement_m(0.0).abs() < 1e-15);
        }
    }
}
