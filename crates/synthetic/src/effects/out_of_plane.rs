//! Bodies that move towards the camera and away from it.

use std::f64::consts::TAU;

use chainwave_measurement::Trajectory;
use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::SyntheticError;
use crate::check::{require, require_not_negative};
use crate::seed::{Purpose, stream};

/// A harmonic motion of each body along the optical axis from when the wave comes, alike in all recordings. What is nearer is seen larger, about the
/// middle of the picture: a body's centre moves there; its marker keeps its size, of which a part in ten thousand is below what is seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutOfPlane {
    /// Amplitude, in metres.
    pub amplitude_m: f64,
    /// From the camera to the chain, in metres.
    pub distance_m: f64,
    /// Mean frequency. Each body has its own, between a half of it and three halves, and its own direction at first; from the effects' `seed`.
    pub frequency_hz: f64,
}

/// Share of its largest displacement by which a body has begun to move.
const BEGUN: f64 = 1e-3;

/// The motion of each body along the optical axis.
pub(crate) struct AlongAxis {
    /// Greatest change of the magnification.
    amplitude: f64,
    of_bodies: Vec<Swing>,
}

struct Swing {
    begins_s: f64,
    /// Its sign is the direction at first.
    frequency_hz: f64,
}

impl OutOfPlane {
    pub(super) fn check(&self) -> Result<(), SyntheticError> {
        require_not_negative("camera.effects.out_of_plane.amplitude_m", self.amplitude_m)?;
        require_not_negative("camera.effects.out_of_plane.frequency_hz", self.frequency_hz)?;
        let is_far = self.distance_m > 10.0 * self.amplitude_m && self.distance_m.is_finite();
        let name = "camera.effects.out_of_plane.distance_m";
        require(is_far, name, "more than ten times amplitude_m", self.distance_m)
    }

    /// The motion that bodies have in a scene.
    pub(crate) fn of_bodies(&self, seed: u64, motion: &Trajectory) -> AlongAxis {
        let swing = |(body, moves): (usize, ndarray::ArrayView1<'_, f64>)| {
            let most_m = moves.iter().fold(0.0_f64, |most, x_m| most.max(x_m.abs()));
            let begins = moves.iter().position(|x_m| x_m.abs() > BEGUN * most_m);
            let mut random = stream(Purpose::OutOfPlane, seed, body as u64);
            let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
            Swing {
                begins_s: begins.map_or(f64::INFINITY, |i| motion.times_s[i]),
                frequency_hz: sign * self.frequency_hz * random.random_range(0.5..1.5),
            }
        };
        AlongAxis {
            amplitude: self.amplitude_m / self.distance_m,
            of_bodies: motion.displacement_m.rows().into_iter().enumerate().map(swing).collect(),
        }
    }
}

impl AlongAxis {
    /// By how much larger a body is seen than at rest.
    pub(crate) fn magnification(&self, body: usize, time_s: f64) -> f64 {
        let swing = &self.of_bodies[body];
        let since_s = time_s - swing.begins_s;
        if since_s <= 0.0 { 0.0 } else { self.amplitude * libm::sin(TAU * swing.frequency_hz * since_s) }
    }
}
