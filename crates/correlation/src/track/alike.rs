//! Sigmas of a track by how alike neighbouring pixels' residuals are in its frames.
//!
//! One match tells the variance by [`Structure`](crate::structure::Structure) to a fifth, so it is taken in some frames and averaged over those
//! near in time; a camera's noise and pattern are what they are for longer than that. What chance may have made of white noise changes nothing.

use chainwave_measurement::{Lost, Position};

use crate::track::bending::Bend;
use crate::uncertainty::Residual;
use crate::warp::Warp;
use crate::{PreparedSubset, Window, Workspace};

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

/// Share of interpolation in a residual from which on that does not tell how noise and patterns are alike.
const INTERPOLATED: f64 = 0.02;
/// Frames from one that is looked at to the next, at most: looking takes about as long as half a match.
const MOST_STEPS: usize = 16;
/// Frames of a recording that are looked at, at least, where it has so many.
const LEAST_READINGS: usize = 64;
/// Standard deviations that a ratio is above 1 by chance.
const BY_CHANCE: f64 = 3.0;
/// Readings before and after a frame that tell its variance, to a tenth.
const NEAR: usize = 2;

/// What a match leaves.
pub(crate) struct Left {
    pub(crate) residual: Residual,
    /// The same pixel by pixel, in counts.
    pub(crate) residuals: Vec<f32>,
}

impl Left {
    pub(crate) fn of(
        subset: &PreparedSubset,
        window: &Window,
        warp: &Warp,
        workspace: &mut Workspace,
    ) -> Option<Self> {
        let (compared, residual) = subset.compare(window, warp, workspace)?;
        let residuals = subset.residuals(&compared, workspace);
        Some(Self { residual, residuals: residuals.into_iter().map(|one| one as f32).collect() })
    }

    /// Whether interpolation has a part in it that is to be seen.
    pub(crate) fn is_interpolated(&self) -> bool {
        let Residual { sum_of_squares, of_interpolation, .. } = self.residual;
        self.residual.gain_of_scene().powi(2) * of_interpolation.energy > INTERPOLATED * sum_of_squares
    }
}

impl Alike {
    /// Whether a frame of a recording with `n_frames` is looked at.
    pub(crate) fn looks_at(frame: usize, n_frames: usize) -> bool {
        frame.is_multiple_of((n_frames / LEAST_READINGS).clamp(1, MOST_STEPS))
    }

    pub(crate) fn note(&mut self, frame: usize, reading: Reading) {
        self.readings.push((frame, reading));
    }

    /// Enlarges the sigmas of a track; none is made smaller.
    pub(crate) fn widen(self, positions: &mut [Result<Position, Lost>]) {
        for (position, [x, y]) in positions.iter_mut().zip(self.factors()) {
            let Ok(position) = position else { continue };
            position.x_px.sigma *= x;
            position.y_px.sigma *= y;
            if let Some(theta_rad) = &mut position.theta_rad {
                theta_rad.sigma *= x.max(y);
            }
        }
    }

    /// Enlarges the variances of a track's bends.
    pub(crate) fn widen_bends(self, bends: &mut [Option<Bend>]) {
        for (bend, factors) in bends.iter_mut().zip(self.factors()) {
            let Some(bend) = bend else { continue };
            bend.variance.iter_mut().zip(factors).for_each(|(variance, factor)| *variance *= factor * factor);
        }
    }

    /// What sigmas grow by, frame by frame without an end.
    fn factors(mut self) -> impl Iterator<Item = [f64; 2]> {
        self.readings.sort_by_key(|(frame, _)| *frame);
        let of_all = [0, 1].map(|axis| Ratio::of(&self.readings, axis));
        (0..).map(move |frame| {
            let near = self.near(frame);
            [0, 1].map(|axis| Ratio::of(near, axis).factor(&of_all[axis]))
        })
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
