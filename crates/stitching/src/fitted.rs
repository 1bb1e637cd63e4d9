//! Every body's motion and response at the present drives and trigger offsets.

use chainwave_measurement::map_in_parallel;

use crate::body_response::{BodyResponse, Contribution, CurvaturePrior, FittedTime, ResponsePrior};
use crate::error::StitchingError;
use crate::resample::Stencil;
use crate::settings::Settings;
use crate::state::{AlignmentState, Scale};

/// All contributions and the fitted response at each body and time, row by row.
pub(crate) type Fitted = Vec<Vec<FittedTime>>;

/// What the prior of a response's slope is one of.
#[derive(Debug, Clone, Copy)]
enum SlopePrior {
    /// Of the body at all its times together, as drives and offsets feel it.
    OfBody,
    /// Of each time.
    OfTime,
}

impl AlignmentState<'_> {
    /// Reads every recording on the common time base at its present offset, and fits motion and response.
    ///
    /// # Errors
    /// [`StitchingError::Undetermined`] where readings and priors do not tell a body's motion.
    pub(crate) fn responses(&self) -> Result<Fitted, StitchingError> {
        self.fitted(SlopePrior::OfBody)
    }

    /// The same at drives and offsets that are found: at each time by what is known of the response there.
    pub(crate) fn responses_when_aligned(&self) -> Result<Fitted, StitchingError> {
        self.fitted(SlopePrior::OfTime)
    }

    /// The row of one body in [`AlignmentState::responses`].
    pub(crate) fn responses_of(&self, row: usize) -> Result<Vec<FittedTime>, StitchingError> {
        self.fit_body(row, &self.stencils(), SlopePrior::OfBody)
    }

    fn fitted(&self, slope_prior: SlopePrior) -> Result<Fitted, StitchingError> {
        let stencils = self.stencils();
        let of_row = |row: usize| self.fit_body(row, &stencils, slope_prior);
        let Settings { n_bodies, n_threads, .. } = *self.settings;
        map_in_parallel(n_bodies, n_threads, of_row).into_iter().collect()
    }

    /// How each recording is read at the times of the common base.
    fn stencils(&self) -> Vec<Vec<Option<Stencil>>> {
        let of_recording = |r: usize| {
            let (observation, offset_s) = (&self.observations[r], self.offsets_s[r]);
            self.times_s.iter().map(|time_s| Stencil::at(&observation.times_s, time_s + offset_s)).collect()
        };
        map_in_parallel(self.observations.len(), self.settings.n_threads, of_recording)
    }

    /// What each recording says of a body at each of these times.
    fn readings_of(&self, row: usize, stencils: &[Vec<Option<Stencil>>]) -> Vec<Vec<Contribution>> {
        let mut readings = vec![Vec::new(); self.times_s.len()];
        for (recording, (displacements, stencils)) in self.displacements.iter().zip(stencils).enumerate() {
            for displacement in displacements.iter().filter(|one| one.row == row) {
                for (at_time, stencil) in readings.iter_mut().zip(stencils) {
                    let read = stencil.as_ref().and_then(|stencil| stencil.read(&displacement.samples));
                    at_time.extend(read.map(|read| Contribution { recording, read }));
                }
            }
        }
        readings
    }

    /// Fits one body's motion. A time that fewer than three recordings cover, of more that saw the body, is left out: at the
    /// ends of the time base one trial would stand for all.
    fn fit_body(
        &self,
        row: usize,
        stencils: &[Vec<Option<Stencil>>],
        slope_prior: SlopePrior,
    ) -> Result<Vec<FittedTime>, StitchingError> {
        let readings = self.readings_of(row, stencils);
        let all = || readings.iter().flatten().map(|contribution| &contribution.read);
        let n = all().count().max(1) as f64;
        let rms_m = (all().map(|read| read.value.powi(2)).sum::<f64>() / n).sqrt();
        let noise_m = all().map(|read| read.sigma).sum::<f64>() / n;
        let most = readings.iter().map(Vec::len).max().unwrap_or(0);
        let enough = most.min(3);
        // The usual ones for any chain: wider ones let responses take up what is no smooth response to the drive.
        let sizes = self.settings.response_sizes;
        let prior_m = |relative: f64| (relative * rms_m).max(noise_m);
        let curvature = match (tells_curvature(most), self.scale) {
            // Three recordings would be interpolated exactly, noise and all: they leave the curvature at zero, and its size to the errors. Held at what a
            // weak non-linearity makes of the slope, it lets alignments of three trials run away.
            (false, _) => CurvaturePrior::Small(1e-3 * noise_m),
            (true, Scale::True) => CurvaturePrior::WeakNonLinearity(prior_m(sizes.curvature)),
            (true, _) => CurvaturePrior::Small(prior_m(sizes.curvature)),
        };
        // A body's response departs from plain scaling alike at all its times: where trials tell the slope at each, the prior counts once
        // and not at every time, else the sum of all would pull at drives that the readings hardly tell. Two or three trials whose drives are
        // nearly alike tell it badly at each time, where what is known of it beforehand is as good as it ever was.
        let n_times = readings.iter().filter(|at_time| !at_time.is_empty()).count().max(1) as f64;
        let is_told = match slope_prior {
            SlopePrior::OfBody => most > 1,
            SlopePrior::OfTime => most > 3,
        };
        let once = if is_told { n_times.sqrt() } else { 1.0 };
        let prior = ResponsePrior { slope_m: once * prior_m(sizes.slope), curvature };
        let mut of_body = Vec::with_capacity(readings.len());
        for (i, mut contributions) in readings.into_iter().enumerate() {
            if contributions.len() < enough {
                contributions.clear();
            }
            let response = match contributions.is_empty() {
                true => BodyResponse::default(),
                false => BodyResponse::fit(&contributions, &self.drive, prior)
                    .ok_or_else(|| self.undetermined(row, i, &contributions))?,
            };
            of_body.push((contributions, response));
        }
        if self.scale == Scale::True {
            smooth_velocities(&mut of_body);
        }
        Ok(of_body)
    }

    fn undetermined(&self, row: usize, i: usize, contributions: &[Contribution]) -> StitchingError {
        let name = |one: &Contribution| self.observations[one.recording].recording.clone();
        StitchingError::Undetermined {
            body: row + 1,
            time_s: self.times_s[i],
            recordings: contributions.iter().map(name).collect::<Vec<_>>().join(", "),
        }
    }
}

/// Whether so many recordings tell how a body's response to the drive is curved.
pub(crate) fn tells_curvature(n_recordings: usize) -> bool {
    n_recordings > 3
}

/// Times on each side whose velocities are averaged: they tell only in which direction a delay moves a body, and there the noise that a
/// velocity shares with the residual at the same time would pull at the delay, by its square.
const VELOCITY_TIMES: usize = 2;

/// Averages the velocities of neighbouring times.
fn smooth_velocities(of_body: &mut [FittedTime]) {
    let read: Vec<Option<[f64; 2]>> =
        of_body.iter().map(|(all, response)| (!all.is_empty()).then(|| response.velocity())).collect();
    for (i, (_, response)) in of_body.iter_mut().enumerate() {
        let around = &read[i.saturating_sub(VELOCITY_TIMES)..(i + VELOCITY_TIMES + 1).min(read.len())];
        let n = around.iter().flatten().count().max(1) as f64;
        let mean = |part: usize| around.iter().flatten().map(|velocity| velocity[part]).sum::<f64>() / n;
        response.set_velocity([mean(0), mean(1)]);
    }
}
