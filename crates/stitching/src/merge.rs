use chainwave_measurement::{ChainMotion, Estimate, Observation, median};
use nalgebra::DMatrix;
use ndarray::Array2;

use crate::align::{Contribution, NormalEquations, Prior, Response};
use crate::consistency::check;
use crate::drive_scatter::contradicted;
use crate::gauge::{Exchange, Gauge, Onset, ReadingErrors, closed_directions, scale_and_delay};
use crate::modes::{AlignmentDirection, AlignmentErrors};
use crate::responses::Field;
use crate::rest::{Displacement, displacement_from_rest};
use crate::time_base::{common_times, rounded};
use crate::{Spread, StitchingError};

/// How to stitch.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Number of bodies in the chain.
    pub n_bodies: usize,
    /// Frames before this time show the chain at rest, in seconds after the trigger.
    pub rest_until_s: f64,
    /// How far drives may differ between trials, as a relative standard deviation.
    pub drive_prior: f64,
    /// Relative standard deviation of the drives about their mean, where it is known: it helps the first body's onset to tell their
    /// scale.
    pub drive_scatter: Option<f64>,
    /// How far a body's first-order response to the drive may differ from its motion, relative to its rms motion.
    pub slope_prior: f64,
    /// How far its second-order response may differ from none or, once the drives' scale is known, from what a weak non-linearity makes
    /// of the first order; relative to its rms motion.
    pub curvature_prior: f64,
    /// How far it does differ from a weak non-linearity's, over a whole pulse and in all bodies of a view alike.
    pub non_linearity: f64,
    /// How large its third-order response, which is not fitted, may be, relative to its rms motion.
    pub third_order_prior: f64,
}

impl Settings {
    /// Usual settings for a chain of `n_bodies` that rests until the trigger, less `trigger_margin_s`.
    ///
    /// The drives of repeated trials differ by less than 5 %. The response of a softening chain differs from plain scaling by
    /// 0.01 to 0.45 of a body's rms motion, and curves by as much, with a third order of up to 0.35 (chain model of the paper, 0.83 to
    /// 2.73 m/s, N = 12 and 26; the least where the strike is slow, the most in the last bodies). A drive's scale is found only within
    /// some tenths, which adds to the first. The curvature differs from what a weak non-linearity makes of it by 0.001 to 0.13, one sign
    /// over a whole pulse; the prior is wider, lest such a common error count as noise.
    pub fn new(n_bodies: usize, trigger_margin_s: f64) -> Self {
        Self {
            n_bodies,
            rest_until_s: -trigger_margin_s,
            drive_prior: 0.05,
            drive_scatter: None,
            slope_prior: 1.0,
            curvature_prior: 0.5,
            non_linearity: 0.15,
            third_order_prior: 0.2,
        }
    }
}

/// Where one recording stands among the others.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment {
    /// Name of the recording.
    pub recording: String,
    /// Number of the camera view.
    pub view: u32,
    /// Number of the trial in that view.
    pub trial: u32,
    /// Its trigger's lead over the mean trigger, in seconds: motion time = stamp - offset.
    pub trigger_offset_s: Estimate,
    /// Its drive relative to the mean drive, less one.
    pub drive_deviation: Estimate,
    /// Residuals' rms over what the trackers' sigma lets expect; near 1 when both are right.
    pub scatter_ratio: f64,
}

/// The chain's motion and how it was put together.
#[derive(Debug, Clone, PartialEq)]
pub struct Stitched {
    /// The motion at the mean drive and the mean trigger of all recordings.
    pub motion: ChainMotion,
    /// One entry for each recording, in the order given.
    pub alignments: Vec<Alignment>,
    /// What scatters within a trial, and what from trial to trial.
    pub spread: Spread,
    /// Rounds of the alignment until it settled.
    pub rounds: usize,
    /// What the reader should know, such as a view that shares no body with the others.
    pub warnings: Vec<String>,
}

/// Rounds after which the alignment stops in any case; 4 are usual.
pub(crate) const MAX_ROUNDS: usize = 20;
/// A step is the last one where it changes drives and offsets by less than this, in drives' priors and frames.
const SETTLED: f64 = 1e-5;
/// Rounds in which the open directions move too.
const FREE_ROUNDS: usize = 2;
/// Rounds in which the onset fixes the gauge, at most: where the first body's noise is a third of a per cent of its onset, each leaves
/// a third of what was left before. An alignment that follows it need not settle as far as one that leads.
const GAUGE_ROUNDS: usize = 20;

/// Merges observations of one chain into its motion.
///
/// The common time base has the observations' median frame interval, rounded to five digits, and contains t = 0.
///
/// # Errors
/// [`StitchingError`] when there is nothing to merge, an observation contradicts itself, or a body was never at rest.
pub fn merge(observations: &[Observation], settings: &Settings) -> Result<Stitched, StitchingError> {
    let (mut stitch, covariance, rounds) = Stitch::aligned(observations, settings)?;
    let (scatter, contradiction) = stitch.stated_scatter();
    let errors = stitch.fix_gauge(covariance, scatter)?;
    stitch.trim_times();
    let mut stitched = stitch.finish(&errors, rounds);
    stitched.warnings.extend(contradiction);
    Ok(stitched)
}

/// Merges as [`merge`] does, with what the readings leave open as the priors put it: how well recordings agree does not depend on it, and
/// few recordings far from the impact tell it so badly that it would be put where even their agreement suffers.
pub(crate) fn merge_as_read(
    observations: &[Observation],
    settings: &Settings,
) -> Result<Stitched, StitchingError> {
    let (mut stitch, covariance, rounds) = Stitch::aligned(observations, settings)?;
    stitch.trim_times();
    let exchange = Exchange::none(observations.len());
    Ok(stitch.finish(&AlignmentErrors { covariance, exchange }, rounds))
}

/// What of the drives' scale, which the readings leave open, is settled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Scale {
    /// Nothing: it follows the priors.
    Open,
    /// It is held where it came to be.
    Held,
    /// It is the true one, as the first body's onset has it.
    True,
}

/// The alignment under way.
pub(crate) struct Stitch<'a> {
    pub(crate) observations: &'a [Observation],
    pub(crate) settings: &'a Settings,
    pub(crate) displacements: Vec<Vec<Displacement>>,
    pub(crate) times_s: Vec<f64>,
    pub(crate) frame_interval_s: f64,
    pub(crate) drive: Vec<f64>,
    pub(crate) offsets_s: Vec<f64>,
    pub(crate) scale: Scale,
}

impl<'a> Stitch<'a> {
    fn new(observations: &'a [Observation], settings: &'a Settings) -> Result<Self, StitchingError> {
        if observations.iter().all(|observation| observation.bodies.is_empty()) {
            return Err(StitchingError::Empty);
        }
        let mut displacements = Vec::with_capacity(observations.len());
        for observation in observations {
            check(observation, settings.n_bodies)?;
            let seen = observation.bodies.iter().filter(|track| track.position_m.iter().any(Option::is_some));
            let of_bodies =
                seen.map(|track| displacement_from_rest(observation, track, settings.rest_until_s));
            displacements.push(of_bodies.collect::<Result<Vec<_>, _>>()?);
        }
        let intervals_s = observations.iter().map(Observation::frame_interval_s).collect();
        let frame_interval_s = rounded(median(intervals_s).ok_or(StitchingError::Empty)?);
        Ok(Self {
            times_s: common_times(observations, frame_interval_s),
            frame_interval_s,
            drive: vec![0.0; observations.len()],
            offsets_s: vec![0.0; observations.len()],
            scale: Scale::Open,
            observations,
            settings,
            displacements,
        })
    }

    /// Drives and offsets as the readings have them, with their covariance and the rounds that it took.
    fn aligned(
        observations: &'a [Observation],
        settings: &'a Settings,
    ) -> Result<(Self, DMatrix<f64>, usize), StitchingError> {
        let mut stitch = Self::new(observations, settings)?;
        let mut rounds = 0;
        loop {
            rounds += 1;
            let field = stitch.responses();
            // The first rounds, from S = X, bring drives and offsets to their natural scale; later ones leave the open directions
            // alone, along which only priors would pull, slowly and far.
            stitch.scale = if rounds > FREE_ROUNDS { Scale::Held } else { Scale::Open };
            let (change, covariance) = stitch.align(&field)?;
            if change < SETTLED || rounds == MAX_ROUNDS {
                return Ok((stitch, covariance, rounds));
            }
        }
    }

    /// One joint least-squares step for all drives and offsets; the largest change, in drives' priors and frames.
    fn align(&mut self, field: &Field) -> Result<(f64, DMatrix<f64>), StitchingError> {
        let n = self.observations.len();
        let mut equations = NormalEquations::new(n);
        for (contributions, response) in field.iter().flatten().filter(|(all, _)| all.len() > 1) {
            equations.add(contributions, response, &self.drive);
        }
        let prior = Prior { offset_s: self.frame_interval_s, drive: self.settings.drive_prior };
        let (solution, covariance) = equations
            .solve(&self.drive, &self.offsets_s, prior)
            .ok_or(StitchingError::Singular { n_recordings: n })?;
        let closed = match self.scale {
            Scale::Open => None,
            Scale::Held => closed_directions(&self.drive, &covariance, 2),
            Scale::True => closed_directions(&self.drive, &covariance, 1),
        };
        let solution = closed.map_or(solution.clone(), |closed| closed * solution);
        let mut change = 0.0_f64;
        for r in 0..n {
            change = change.max(solution[r].abs() / self.settings.drive_prior);
            change = change.max(solution[n + r].abs() / self.frame_interval_s);
            self.drive[r] += solution[r];
            self.offsets_s[r] += solution[n + r];
        }
        Ok((change, covariance))
    }

    /// Drops the times at both ends at which no body was measured.
    fn trim_times(&mut self) {
        let field = self.responses();
        let measured = |i: &usize| field.iter().any(|of_body| !of_body[*i].0.is_empty());
        let first = (0..self.times_s.len()).find(measured).unwrap_or(0);
        let last = (0..self.times_s.len()).rfind(measured).unwrap_or(0);
        self.times_s = self.times_s[first..=last].to_vec();
    }

    /// Fixes what the readings leave open by the first body's onset, and aligns again from where that led to: the curvatures' prior
    /// holds there. Returns the errors.
    fn fix_gauge(
        &mut self,
        mut covariance: DMatrix<f64>,
        scatter: Option<f64>,
    ) -> Result<AlignmentErrors, StitchingError> {
        let (mut last, mut change) = (None, f64::INFINITY);
        for _ in 0..GAUGE_ROUNDS {
            let Some(gauge) = self.gauge(scatter) else { break };
            gauge.fix(&mut self.drive, &mut self.offsets_s);
            self.scale = Scale::True;
            let is_settled = gauge.is_settled() && change < 10.0 * SETTLED;
            last = Some(gauge);
            if is_settled {
                break;
            }
            (change, covariance) = self.align(&self.responses())?;
        }
        let exchange = match last {
            Some(gauge) => gauge.errors(&self.drive, &covariance),
            None => Exchange::none(self.observations.len()),
        };
        Ok(AlignmentErrors { covariance, exchange })
    }

    fn gauge(&self, scatter: Option<f64>) -> Option<Gauge> {
        let onset = self.onset()?;
        match scatter {
            Some(scatter) => Gauge::from_onset_and_scatter(onset, &self.drive, scatter),
            None => Gauge::from_onset(onset),
        }
    }

    /// The onset of the first body that three recordings saw.
    fn onset(&self) -> Option<Onset> {
        let seen = |row: usize| {
            let of_row = |one: &&Vec<Displacement>| one.iter().any(|displacement| displacement.row == row);
            self.displacements.iter().filter(of_row).count()
        };
        let row = (0..self.settings.n_bodies).find(|row| seen(*row) > 2)?;
        let field = self.responses_of(|other| other == row);
        let of_recording = |displacements: &Vec<Displacement>| {
            let own = displacements.iter().find(|displacement| displacement.row == row);
            own.map_or(0.0, |displacement| displacement.rest_sigma_m)
        };
        let rest_sigma_m: Vec<f64> = self.displacements.iter().map(of_recording).collect();
        let scatter_ratio = self.scatter_ratio(&field[row], |_| true).max(1.0);
        let errors = ReadingErrors { rest_sigma_m: &rest_sigma_m, scatter_ratio };
        Onset::read(&field[row], &self.drive, &errors, self.frame_interval_s)
    }

    /// The stated scatter of the drives, or else what the reader should know where the first body's onset contradicts it.
    fn stated_scatter(&self) -> (Option<f64>, Option<String>) {
        let Some(stated) = self.settings.drive_scatter else { return (None, None) };
        match self.onset().and_then(|onset| contradicted(&self.drive, stated, onset.scale())) {
            None => (Some(stated), None),
            Some(found) => {
                let contradiction = format!(
                    "the drives scatter by {:.1} % by the first body's onset and by {:.1} % as stated: the stated scatter was left out",
                    100.0 * found,
                    100.0 * stated
                );
                (None, Some(contradiction))
            }
        }
    }

    fn finish(&self, errors: &AlignmentErrors, rounds: usize) -> Stitched {
        let field = &self.responses();
        let shape = (self.settings.n_bodies, self.times_s.len());
        let ratios: Vec<f64> =
            field.iter().map(|of_body| self.scatter_ratio(of_body, |_| true).max(1.0)).collect();
        let directions = self.alignment_directions(field, errors);
        let modes = self.error_modes(field, &directions);
        let mut motion = ChainMotion {
            times_s: self.times_s.clone(),
            displacement_m: Array2::from_elem(shape, None),
            independent_sigma_m: Array2::zeros(shape),
            modes,
            n_trials: Array2::zeros(shape),
        };
        for (row, of_body) in field.iter().enumerate() {
            for (i, (contributions, response)) in
                of_body.iter().enumerate().filter(|(_, (all, _))| !all.is_empty())
            {
                let shared: f64 = motion.modes.iter().map(|mode| mode.displacement_m[(row, i)].powi(2)).sum();
                let noise = |gain: fn(&Contribution) -> f64| -> f64 {
                    let part =
                        |c: &Contribution| (response.gain(c, &self.drive) * c.read.sigma).powi(2) * gain(c);
                    ratios[row].powi(2) * contributions.iter().map(part).sum::<f64>()
                };
                let sigma_m = (noise(|c| c.read.noise_gain) + shared).sqrt();
                motion.displacement_m[(row, i)] = Some(Estimate::new(response.motion_m, sigma_m));
                motion.independent_sigma_m[(row, i)] = noise(|_| 1.0).sqrt();
                motion.n_trials[(row, i)] = contributions.len() as u32;
            }
        }
        let scale_sigma = errors.exchange.scale_sigma;
        let bent_delay_s = self.bent_delay_s(field);
        let alignments = (0..self.observations.len())
            .map(|r| self.alignment(r, field, &directions, scale_sigma, bent_delay_s))
            .collect();
        let spread = self.spread(field, &ratios);
        Stitched { motion, alignments, spread, rounds, warnings: self.warnings(rounds) }
    }

    /// Residuals' rms of the chosen contributions over what the trackers' sigma lets expect.
    pub(crate) fn scatter_ratio(
        &self,
        of_body: &[(Vec<Contribution>, Response)],
        chosen: impl Fn(&Contribution) -> bool,
    ) -> f64 {
        let (mut squares, mut freedom) = (0.0, 0.0);
        for (contributions, response) in of_body.iter().filter(|(all, _)| all.len() > 2) {
            for contribution in contributions.iter().filter(|contribution| chosen(contribution)) {
                let residual = contribution.read.value - response.at(self.drive[contribution.recording]);
                squares += contribution.weight() * residual.powi(2) / contribution.read.noise_gain;
                freedom += 1.0 - response.leverage(contribution, &self.drive);
            }
        }
        if freedom > 1.0 { (squares / freedom).sqrt() } else { 1.0 }
    }

    fn alignment(
        &self,
        r: usize,
        field: &Field,
        directions: &[AlignmentDirection],
        scale_sigma: f64,
        bent_delay_s: f64,
    ) -> Alignment {
        let n = self.observations.len();
        let observation = &self.observations[r];
        let rows = self.displacements[r].iter().map(|displacement| displacement.row);
        let ratios: Vec<f64> =
            rows.map(|row| self.scatter_ratio(&field[row], |c| c.recording == r)).collect();
        let scatter = ratios.iter().map(|ratio| ratio.powi(2)).sum::<f64>() / ratios.len().max(1) as f64;
        let square =
            |unknown: usize| directions.iter().map(move |direction| direction.error[unknown].powi(2));
        let sigma = |unknown: usize| square(unknown).sum::<f64>().sqrt();
        let mean_square = self.drive.iter().map(|s| s * s).sum::<f64>() / n as f64;
        let bent_s = bent_delay_s * (self.drive[r].powi(2) - mean_square).abs();
        Alignment {
            recording: observation.recording.clone(),
            view: observation.view,
            trial: observation.trial,
            trigger_offset_s: Estimate::new(self.offsets_s[r], sigma(n + r).hypot(bent_s)),
            drive_deviation: Estimate::new(self.drive[r], sigma(r).hypot(scale_sigma * self.drive[r])),
            scatter_ratio: scatter.sqrt(),
        }
    }

    /// Standard deviation of the delay with the square of the drive that the offsets may hold: nothing in the readings tells it, and the
    /// mean motion does not feel it (see [`crate::gauge`]). A pulse that a drive `1 + s` delays by `T(s)` has beta = -T' in its slope and
    /// beta - T''/2 times the velocity in its curvature; a weak non-linearity, which delays in proportion, makes beta of it.
    fn bent_delay_s(&self, field: &Field) -> f64 {
        let of_bodies = field.iter().filter(|of_body| of_body.iter().any(|(all, _)| all.len() > 2));
        let delays_s: Vec<f64> =
            of_bodies.filter_map(|of_body| Some(scale_and_delay(of_body)?.0[1])).collect();
        let squares: f64 = delays_s.iter().map(|delay_s| delay_s.powi(2)).sum();
        BENT_SHARE * (squares / delays_s.len().max(1) as f64).sqrt()
    }
}

/// T''/2 over beta: 0.02 to 0.09 in the bodies of the paper's chain, and 0.5 where T goes with the drive's logarithm.
const BENT_SHARE: f64 = 0.2;
