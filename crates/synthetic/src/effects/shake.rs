//! A camera that shakes: a harmonic motion of the whole picture, all the time or set off by the impact.

use std::f64::consts::TAU;

use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::SyntheticError;
use crate::check::{require, require_not_negative};
use crate::seed::{Purpose, stream};

/// A harmonic motion of the camera against the laboratory. Bodies, rods and the wall behind move in the picture alike; what
/// lies on the sensor and its window does not.
///
/// Along each axis the picture is displaced by amplitude sin(2 pi f t + phase) exp(-decay t). Within one exposure it is taken
/// for still: at most 2 pi f amplitude exposure is left out, 3e-3 px for 0.2 px at 200 Hz in 10 us.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shake {
    /// Amplitudes along the columns' direction (right) and along the rows' (down), in pixels.
    pub amplitude_px: [f64; 2],
    /// Amplitude of the turn about the optical axis, from right towards down. A turning view costs some ten times the time.
    #[serde(default)]
    pub turn_amplitude_rad: f64,
    /// Frequency.
    pub frequency_hz: f64,
    /// When it shakes.
    pub onset: ShakeOnset,
    /// Decay rate of a shake that the impact sets off, per second.
    #[serde(default)]
    pub decay_per_s: f64,
}

/// When a camera shakes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShakeOnset {
    /// All the time: t counts from the trigger, and each recording draws the phase of each axis and of the turn.
    Always,
    /// From the impact on: t counts from it, and all phases are 0.
    Impact,
}

impl Shake {
    pub(super) fn check(&self) -> Result<(), SyntheticError> {
        for amplitude_px in self.amplitude_px {
            let small = (0.0..=100.0).contains(&amplitude_px);
            require(small, "camera.effects.shake.amplitude_px", "0 to 100 pixels", amplitude_px)?;
        }
        let turn_rad = self.turn_amplitude_rad;
        let name = "camera.effects.shake.turn_amplitude_rad";
        require((0.0..=0.1).contains(&turn_rad), name, "0 to 0.1", turn_rad)?;
        require(
            (0.0..=1.0e6).contains(&self.frequency_hz),
            "camera.effects.shake.frequency_hz",
            "0 to 1e6",
            self.frequency_hz,
        )?;
        require_not_negative("camera.effects.shake.decay_per_s", self.decay_per_s)?;
        let free = self.onset == ShakeOnset::Impact || self.decay_per_s <= 0.0;
        let expected = "0 unless onset = \"impact\"";
        require(free, "camera.effects.shake.decay_per_s", expected, self.decay_per_s)
    }

    /// Phases of a recording: of the two axes and the turn.
    pub(crate) fn phases_rad(&self, noise_seed: u64) -> [f64; 3] {
        match self.onset {
            ShakeOnset::Impact => [0.0; 3],
            ShakeOnset::Always => {
                let mut random = stream(Purpose::Shake, noise_seed, 0);
                [0, 1, 2].map(|_| random.random_range(0.0..TAU))
            }
        }
    }

    /// Displacement (right, down; pixels) and turn of the picture, given the time after the trigger and after the impact.
    pub(crate) fn at(&self, phases_rad: [f64; 3], stamp_s: f64, motion_s: f64) -> ([f64; 2], f64) {
        let (time_s, envelope) = match self.onset {
            ShakeOnset::Always => (stamp_s, 1.0),
            ShakeOnset::Impact if motion_s <= 0.0 => return ([0.0; 2], 0.0),
            ShakeOnset::Impact => (motion_s, libm::exp(-self.decay_per_s * motion_s)),
        };
        let swing = |axis: usize| envelope * libm::sin(TAU * self.frequency_hz * time_s + phases_rad[axis]);
        ([0, 1].map(|axis| self.amplitude_px[axis] * swing(axis)), self.turn_amplitude_rad * swing(2))
    }
}
