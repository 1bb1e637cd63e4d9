//! Sigmas of a track by how alike neighbouring pixels' residuals are in its frames.
//!
//! One match tells the variance by [`Structure`](crate::structure::Structure) to a fifth, so it is taken in some frames and averaged over those
//! near in time; a camera's noise and pattern are what they are for longer than that. What chance may have made of white noise changes nothing.

use chainwave_measurement::{Lost, Position};

/// What some of a track's matches tell of it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Alike {
    readings: Vec<(usize, Reading)>,
}

/// What one match tells.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reading {
    /// Variance along x and y by the structure of the residual, in square pixels.
    pub(crate) variance_px2: [f64; 2],
    /// Standard uncertainty that is stated.
    pub(crate) sigma_px: [f64; 2],
    /// Relative scatter of the variance, of white noise.
    pub(crate) scatter: [f64; 2],
    /// Share of the reference in the noise of a residual, which all frames have in common.
    pub(crate) of_reference: f64,
}

/// Frames from one that is looked at to the next, at most: looking takes about as long as half a match.
const MOST_STEPS: usize = 16;
/// Frames of a recording that are looked at, at least, where it has so many.
const LEAST_READINGS: usize = 64;
/// Standard deviations that a ratio is above 1 by chance.
const BY_CHANCE: f64 = 3.0;
/// Readings before and after a frame that tell its variance, to a tenth.
const NEAR: usize = 2;

impl Alike {
    /// Whether a frame of a recording with `n_frames` is looked at.
    pub(crate) fn looks_at(frame: usize, n_frames: usize) -> bool {
        frame.is_multiple_of((n_frames / LEAST_READINGS).clamp(1, MOST_STEPS))
    }

    pub(crate) fn note(&mut self, frame: usize, reading: Reading) {
        self.readings.push((frame, reading));
    }

    /// Enlarges the sigmas of a track; none is made smaller.
    pub(crate) fn widen(mut self, positions: &mut [Result<Position, Lost>]) {
        self.readings.sort_by_key(|(frame, _)| *frame);
        let of_all = [0, 1].map(|axis| Ratio::of(&self.readings, axis));
        for (frame, position) in positions.iter_mut().enumerate() {
            let Ok(position) = position else { continue };
            let near = self.near(frame);
            let [x, y] = [0, 1].map(|axis| Ratio::of(near, axis).factor(&of_all[axis]));
            position.x_px.sigma *= x;
            position.y_px.sigma *= y;
            if let Some(theta_rad) = &mut position.theta_rad {
                theta_rad.sigma *= x.max(y);
            }
        }
    }

    /// The readings around a frame.
    fn near(&self, frame: usize) -> &[(usize, Reading)] {
        let next = self.readings.partition_point(|(at, _)| *at < frame);
        &self.readings[next.saturating_sub(NEAR)..(next + NEAR + 1).min(self.readings.len())]
    }
}

/// The variance by structure over that stated, in the mean of some readings, and how far it is off 1 by chance, as a standard deviation.
struct Ratio {
    mean: f64,
    chance: f64,
}

impl Ratio {
    /// Of none, neither is a number.
    fn of(readings: &[(usize, Reading)], axis: usize) -> Self {
        let n = readings.len() as f64;
        let mean = |of: &dyn Fn(&Reading) -> f64| readings.iter().map(|(_, one)| of(one)).sum::<f64>() / n;
        let chance =
            |one: &Reading| one.scatter[axis] * (1.0 / n + (1.0 - 1.0 / n) * one.of_reference.powi(2)).sqrt();
        Self { mean: mean(&|one| one.variance_px2[axis] / one.sigma_px[axis].powi(2)), chance: mean(&chance) }
    }

    fn is_beyond_chance(&self) -> bool {
        self.mean > 1.0 + BY_CHANCE * self.chance
    }

    /// What a sigma grows by where these readings are near: where they, or all of the track, are no white noise's.
    fn factor(&self, of_all: &Self) -> f64 {
        if self.is_beyond_chance() || of_all.is_beyond_chance() { self.mean.max(1.0).sqrt() } else { 1.0 }
    }
}
