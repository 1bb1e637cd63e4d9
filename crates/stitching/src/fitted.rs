//! Every body's motion and response at the present drives and trigger offsets.

use chainwave_measurement::map_in_parallel;

use crate::body_response::{BodyResponse, Contribution, CurvaturePrior, ResponsePrior};
use crate::error::StitchingError;
use crate::fitted_body::{FittedBody, FittedTime, Readings};
use crate::resample::Resampling;
use crate::settings::Settings;
use crate::state::{AlignmentState, Scale};

/// All contributions and the fitted response at each body and time, row by row.
pub(crate) type Fitted = Vec<FittedBody>;

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
    pub(crate) fn responses_of(&self, row: usize) -> Result<FittedBody, StitchingError> {
        self.fit_body(row, &self.resampled(), SlopePrior::OfBody)
    }

    fn fitted(&self, slope_prior: SlopePrior) -> Result<Fitted, StitchingError> {
        let resampled = self.resampled();
        let of_row = |row: usize| self.fit_body(row, &resampled, slope_prior);
        let Settings { n_bodies, n_threads, .. } = *self.settings;
        map_in_parallel(n_bodies, n_threads, of_row).into_iter().collect()
    }

    /// How each recording is read at the times of the common base.
    fn resampled(&self) -> Vec<Resampling<'_>> {
        let of_recording = |r: usize| {
            let own_s = self.times_s.iter().map(|time_s| time_s + self.offsets_s[r]);
            Resampling::at(&self.observations[r], own_s)
        };
        map_in_parallel(self.observations.len(), self.settings.n_threads, of_recording)
    }

    /// What each recording says of a body at each of these times, and how many of those that saw the body ever last over the time.
    fn readings_of(&self, row: usize, resampled: &[Resampling<'_>]) -> (Readings, Vec<usize>) {
        let seen = self.displacements.iter().zip(resampled).enumerate();
        let seen: Vec<_> = seen
            .flat_map(|(recording, (displacements, resampled))| {
                let own = displacements.iter().filter(|displacement| displacement.row == row);
                own.map(move |displacement| (recording, &displacement.samples, resampled))
            })
            .collect();
        let mut readings = Readings::default();
        for i in 0..self.times_s.len() {
            readings.push_time(seen.iter().filter_map(|(recording, samples, resampled)| {
                let read = resampled.read(i, samples)?;
                let n_shared = read.n_shared(self.frame_interval_s);
                Some(Contribution { recording: *recording, read, n_shared })
            }));
        }
        let lasting = |i: usize| seen.iter().filter(|(_, _, resampled)| resampled.covers(i)).count();
        (readings, (0..self.times_s.len()).map(lasting).collect())
    }

    /// Fits one body's motion. A time over which fewer than three recordings last, of more that saw the body, is left out: at the
    /// ends of the time base one trial would stand for all. Where recordings last and their tracks do not, as a body leaves one view before the other, those that
    /// still see it tell its motion, with the error of a response that they do not tell.
    fn fit_body(
        &self,
        row: usize,
        resampled: &[Resampling<'_>],
        slope_prior: SlopePrior,
    ) -> Result<FittedBody, StitchingError> {
        let (readings, n_lasting) = self.readings_of(row, resampled);
        let all = || readings.all().iter().map(|contribution| &contribution.read);
        let n = all().count().max(1) as f64;
        let rms_m = (all().map(|read| read.value.powi(2)).sum::<f64>() / n).sqrt();
        let noise_m = all().map(|read| read.sigma).sum::<f64>() / n;
        let most = readings.of_times().map(<[Contribution]>::len).max().unwrap_or(0);
        let enough = most.min(3);
        // The usual ones for any chain: wider ones let responses take up what is no smooth response to the drive.
        let sizes = self.settings.response_sizes;
        let prior_m = |relative: f64| (relative * rms_m).max(noise_m);
        let stated_orders_m = self.stated_orders_m(row, &readings);
        let is_stated = stated_orders_m.iter().any(|[curvature_m, _]| *curvature_m != 0.0);
        let curvature = match (tells_curvature(most), self.scale) {
            // Three recordings would be interpolated exactly, noise and all: they leave the curvature at zero, and its size to the errors. Held at what a
            // weak non-linearity makes of the slope, it lets alignments of three trials run away.
            (false, _) => CurvaturePrior::Small(1e-3 * noise_m),
            (true, Scale::True) if !is_stated => CurvaturePrior::WeakNonLinearity(prior_m(sizes.curvature)),
            (true, _) => CurvaturePrior::Small(prior_m(sizes.curvature)),
        };
        // A body's response departs from plain scaling alike at all its times: where trials tell the slope at each, the prior counts once
        // and not at every time, else the sum of all would pull at drives that the readings hardly tell. Two or three trials whose drives are
        // nearly alike tell it badly at each time, where what is known of it beforehand is as good as it ever was.
        let n_times = readings.of_times().filter(|of_time| !of_time.is_empty()).count().max(1) as f64;
        let is_told = match slope_prior {
            SlopePrior::OfBody => most > 1,
            SlopePrior::OfTime => most > 3,
        };
        let once = if is_told { n_times.sqrt() } else { 1.0 };
        let prior = |n: usize| {
            let is_left_alone = n < enough && matches!(slope_prior, SlopePrior::OfTime);
            let once = if is_left_alone { 1.0 } else { once };
            ResponsePrior { slope_m: once * prior_m(sizes.slope), curvature }
        };
        let (mut kept, mut responses) = (Readings::default(), Vec::with_capacity(self.times_s.len()));
        for (i, of_time) in readings.of_times().enumerate() {
            let of_time = if n_lasting[i] < enough { &[] } else { of_time };
            responses.push(match of_time.is_empty() {
                true => BodyResponse::default(),
                false => BodyResponse::fit(of_time, &self.drive, prior(of_time.len()), stated_orders_m[i][0])
                    .ok_or_else(|| self.undetermined(row, i, of_time))?,
            });
            kept.push_time(of_time.iter().copied());
        }
        let mut of_body = FittedBody::new(kept, responses, stated_orders_m);
        if self.scale == Scale::True {
            smooth_velocities(&mut of_body);
        }
        Ok(of_body)
    }

    /// Q and C of a body by the stated chain at each time, as late as the readings show that the wave reaches it; zero as long as the drives' scale is open, and
    /// where nothing is stated or the body is not reached.
    fn stated_orders_m(&self, row: usize, readings: &Readings) -> Vec<[f64; 2]> {
        let stated = self.settings.stated_responses.get(row).map(|response| &response.orders);
        let orders = stated.filter(|orders| self.scale == Scale::True && orders.reached_m > 0.0);
        let away_m = |of_time: &[Contribution]| {
            let n = of_time.len() as f64;
            (n > 0.0).then(|| (of_time.iter().map(|one| one.read.value).sum::<f64>() / n).abs())
        };
        let away_m: Vec<(f64, f64)> = self
            .times_s
            .iter()
            .zip(readings.of_times())
            .filter_map(|(time_s, of_time)| Some((*time_s, away_m(of_time)?)))
            .collect();
        let reached_s = orders.and_then(|orders| {
            let is_passed =
                |pair: &&[(f64, f64)]| pair[0].1 <= orders.reached_m && pair[1].1 > orders.reached_m;
            let pair = away_m.windows(2).find(is_passed)?;
            let [(before_s, before_m), (after_s, after_m)] = [pair[0], pair[1]];
            Some(before_s + (after_s - before_s) * (orders.reached_m - before_m) / (after_m - before_m))
        });
        let at = |time_s: &f64| match (orders, reached_s) {
            (Some(orders), Some(reached_s)) => orders.at_m(time_s - reached_s),
            _ => [0.0; 2],
        };
        self.times_s.iter().map(at).collect()
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
pub(crate) fn smooth_velocities(of_body: &mut FittedBody) {
    let velocity = |at: FittedTime<'_>| (!at.contributions.is_empty()).then(|| at.response.velocity());
    let read: Vec<Option<[f64; 2]>> = of_body.times().map(velocity).collect();
    for (i, response) in of_body.responses.iter_mut().enumerate() {
        let around = &read[i.saturating_sub(VELOCITY_TIMES)..(i + VELOCITY_TIMES + 1).min(read.len())];
        let n = around.iter().flatten().count().max(1) as f64;
        let mean = |part: usize| around.iter().flatten().map(|velocity| velocity[part]).sum::<f64>() / n;
        response.set_velocity([mean(0), mean(1)]);
    }
}
