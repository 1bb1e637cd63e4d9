//! The rows of the tracks' equations: each position's residual with its derivatives.

use chainwave_measurement::{BodyTrack, Observation};

use super::super::response::{Driven, MotionOfTrack};
use super::super::windows::Window;
use super::{Residual, SolvedModel};
use crate::least_squares::{N_OWN, Own, Row};

/// The rows of one recording's equations.
pub(super) struct Rows<'a> {
    model: &'a SolvedModel,
    driven: Driven<'a>,
    observation: &'a Observation,
    impact_s: f64,
    /// Length in the recording's pictures over true length.
    scale: f64,
    /// Which of a window's derivatives belongs to each shared unknown.
    places: &'a [Option<usize>],
}

/// The rows (own, shared, residual) of a track in a window, one behind the other, in units of the positions' sigmas; the residual is model less
/// measurement.
pub(super) struct TrackRows {
    width: usize,
    rows: Vec<f64>,
    seen: Vec<Seen>,
}

/// In which frame and when a position was seen, and how well.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    frame: usize,
    pub(super) after_impact_s: f64,
    inverse_sigma: f64,
}

impl TrackRows {
    /// The derivatives by shared unknowns and, last, the residual.
    pub(super) fn shared(&self) -> impl Iterator<Item = (&[f64], &Seen)> {
        self.rows.chunks_exact(self.width).map(|row| &row[N_OWN..]).zip(&self.seen)
    }

    /// With what one standard deviation of each error makes of the track's frames, in metres.
    pub(super) fn iter<'b>(
        &'b self,
        errors: &'b [(usize, &[f64])],
    ) -> impl Iterator<Item = (Row<'b>, &'b Seen)> {
        self.rows.chunks_exact(self.width).zip(&self.seen).map(|(entries, seen)| {
            let Seen { frame, inverse_sigma, .. } = *seen;
            let felt = errors.iter().filter(|(_, error_m)| error_m[frame] != 0.0);
            let errors = felt.map(|(error, error_m)| (*error, error_m[frame] * inverse_sigma)).collect();
            (Row { entries, errors, inverse_sigma }, seen)
        })
    }
}

impl<'a> Rows<'a> {
    pub(super) fn new(
        model: &'a SolvedModel,
        own: &Own,
        observation: &'a Observation,
        places: &'a [Option<usize>],
    ) -> Self {
        let driven = model.response.driven([own[0], own[1]], &observation.times_s);
        let scale = model.scale_of(observation.view);
        Self { model, driven, observation, impact_s: own[1], scale, places }
    }

    /// The rows of a track in a window.
    pub(super) fn of_track(&self, track: &BodyTrack, window: &Window) -> TrackRows {
        let width = N_OWN + self.places.len() + 1;
        let motion = self.driven.of_track(track, window);
        let origin_m = first_position_m(track);
        let positions = motion.frames.clone().filter_map(|frame| {
            let position = track.position_m[frame]?;
            let seen = Seen {
                frame,
                after_impact_s: self.observation.times_s[frame] - self.impact_s,
                inverse_sigma: position.sigma.recip(),
            };
            Some((position.value - origin_m, seen))
        });
        let (from_first_m, seen): (Vec<f64>, Vec<Seen>) = positions.unzip();
        let mut rows = vec![0.0; width * seen.len()];
        for (place, row) in rows.chunks_exact_mut(width).enumerate() {
            self.fill(row, (&motion, place), (from_first_m[place], seen[place].inverse_sigma));
        }
        TrackRows { width, rows, seen }
    }

    /// The residuals of a track of recording number `recording`, with errors of these amplitudes.
    pub(super) fn residuals(
        &self,
        recording: usize,
        track: &BodyTrack,
        errors: &[(f64, &[f64])],
    ) -> Vec<Residual> {
        let rows = self.of_track(track, &Window::whole(self.model.response.n_outputs()));
        let (mut weighted, mut weight) = (0.0, 0.0);
        let residual = |(row, seen): (&[f64], &Seen)| {
            let Seen { frame, after_impact_s, inverse_sigma } = *seen;
            let error_m: f64 = errors.iter().map(|(amplitude, error_m)| amplitude * error_m[frame]).sum();
            let value = row.last().copied().unwrap_or_default() + error_m * inverse_sigma;
            weighted += value * inverse_sigma;
            weight += inverse_sigma.powi(2);
            Residual { recording, body: track.body, after_impact_s, value }
        };
        let mut all: Vec<Residual> =
            rows.rows.chunks_exact(rows.width).zip(&rows.seen).map(residual).collect();
        let rest_m = weighted / weight.max(f64::MIN_POSITIVE);
        for (residual, seen) in all.iter_mut().zip(&rows.seen) {
            residual.value -= rest_m * seen.inverse_sigma;
        }
        all
    }

    /// One row, of a position in metres and the inverse of its sigma.
    fn fill(
        &self,
        row: &mut [f64],
        (motion, place): (&MotionOfTrack, usize),
        (position_m, inverse_sigma): (f64, f64),
    ) {
        let scale = self.scale;
        let factor = scale * inverse_sigma;
        let last = row.len() - 1;
        let resisted_m = |which: usize| motion.resistances_m.get(which).map_or(0.0, |added_m| added_m[place]);
        let x_m = motion.displacement_m[place] + resisted_m(0);
        row[0] = factor * motion.by_striker_s[place];
        row[1] = -factor * motion.velocity_m_per_s[place];
        row[last] = factor * x_m - position_m * inverse_sigma;
        for (entry, which) in row[N_OWN..last].iter_mut().zip(self.places) {
            *entry = factor * which.map_or(0.0, |which| motion.derivatives_m[which][place]);
        }
        for (unknown, factor) in self.model.scales_of(self.observation.view) {
            row[N_OWN + unknown] = x_m * inverse_sigma * (scale / factor);
        }
        for (above, unknown, step) in self.model.resistances.steps() {
            row[N_OWN + unknown] = factor * (resisted_m(above) - resisted_m(0)) / step;
        }
    }
}

/// Positions count from the first one seen, so that sums of squares keep their digits.
fn first_position_m(track: &BodyTrack) -> f64 {
    track.position_m.iter().flatten().next().map_or(0.0, |position| position.value)
}
