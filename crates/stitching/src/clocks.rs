//! How much farther apart in time than stated the frames of a recording were taken, or those of a whole view: what the readings that it shares with others
//! say of it.
//!
//! A frame rate that is not the true one stretches the motion in time, about the trigger. Its readings differ from the others' by the bodies' velocity, times
//! the time since the trigger, times the relative error: a pattern of known shape whose amplitude least squares tell, once motion, drives and triggers
//! are free. A body that starts late, or a drive that is off, makes no such pattern; a chain that was stiffer on the day of a view does.

use std::fmt;

use chainwave_measurement::Estimate;
use nalgebra::{DMatrix, DVector};

use crate::body_response::{BodyResponse, Contribution, ReadingBeside};
use crate::error::StitchingError;
use crate::fitted::Fitted;
use crate::fitted_body::{FittedBody, FittedTime};
use crate::state::AlignmentState;

/// Stretches of time of one body, each of which tells as much of a clock as the others.
const STRETCHES: usize = 8;
/// Recordings of a view that tell the clock of one among them: of three, two do not tell what the drive's second order makes of the third.
const LEAST_TRIALS: usize = 4;

/// Whose frames follow each other otherwise than stated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ClockOf {
    /// Those of all recordings of a view.
    View(u32),
    /// Those of one recording.
    Recording(String),
}

impl ClockOf {
    /// Whether it is that of a view.
    pub fn is_view(&self) -> bool {
        matches!(self, Self::View(_))
    }

    /// Whether a recording of a view goes by it.
    pub fn holds(&self, view: u32, recording: &str) -> bool {
        match self {
            Self::View(own) => *own == view,
            Self::Recording(own) => own == recording,
        }
    }
}

impl fmt::Display for ClockOf {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::View(view) => write!(f, "view {view}"),
            Self::Recording(recording) => f.write_str(recording),
        }
    }
}

/// What readings say of one clock.
#[derive(Debug, Clone, PartialEq)]
pub struct ClockShown {
    /// Whose it is.
    pub of: ClockOf,
    /// By how much longer the time between its frames is than stated, relative to that. Its sigma is that of the readings' noise, or of how far stretches of
    /// single bodies scatter where that is more.
    pub excess: Estimate,
    /// Degrees of freedom of that scatter.
    pub degrees_of_freedom: f64,
    /// What the excess takes from chi squared of the readings.
    pub gain: f64,
}

/// Weight and weighted sum of what a stretch of a body says of an amplitude.
#[derive(Debug, Clone, Copy, Default)]
struct StretchSum {
    weight: f64,
    sum: f64,
}

/// One time of one body, with what fitting its response leaves of the readings' weights.
struct Moment<'a> {
    time_s: f64,
    contributions: &'a [Contribution],
    response: &'a BodyResponse,
    free: DMatrix<f64>,
}

/// How drives, then offsets in seconds, follow clocks that are off by as much as they show: a column for each clock.
struct ClockEffects {
    by_clock: DMatrix<f64>,
    /// The largest of each clock's, of drives and of offsets.
    largest: Vec<[f64; 2]>,
}

/// Share of the largest change below which one is none: recordings far from those whose clock is off.
const UNMOVED: f64 = 1e-3;

impl ClockEffects {
    /// Whether a recording's drive or offset follows a clock.
    fn moves(&self, clock: usize, recording: usize) -> bool {
        let n = self.by_clock.nrows() / 2;
        let follows = |kind: usize| {
            self.by_clock[(kind * n + recording, clock)].abs() > UNMOVED * self.largest[clock][kind]
        };
        follows(0) || follows(1)
    }

    /// What that makes of the residuals at one time of a body, in metres.
    fn moved_m(&self, clock: usize, moment: &Moment<'_>, slopes: &[[f64; 2]]) -> DVector<f64> {
        let n = self.by_clock.nrows() / 2;
        let moved_m = |(one, [by_drive, by_offset]): (&Contribution, &[f64; 2])| {
            by_drive * self.by_clock[(one.recording, clock)]
                + by_offset * self.by_clock[(n + one.recording, clock)]
        };
        let moved = moment.contributions.iter().zip(slopes).map(moved_m);
        DVector::from_iterator(moment.contributions.len(), moved)
    }
}

impl AlignmentState<'_> {
    /// What the clocks of views that share a body with others, and of recordings among several of a view, are said to be off by, each for itself.
    ///
    /// # Errors
    /// [`StitchingError::Singular`] where the alignment cannot be solved.
    pub(crate) fn clocks(&self, field: &Fitted) -> Result<Vec<ClockShown>, StitchingError> {
        let of = self.clocks_asked();
        if of.is_empty() {
            return Ok(Vec::new());
        }
        let is_of: Vec<Vec<bool>> = of.iter().map(|clock| self.recordings_of(clock)).collect();
        let followed = self.followed(field, &is_of)?;
        let mut parts: Vec<Vec<StretchSum>> = vec![Vec::new(); of.len()];
        for of_body in field {
            let moments: Vec<Moment<'_>> = self.moments(of_body).collect();
            let mut of_times: Vec<Vec<StretchSum>> = vec![Vec::new(); of.len()];
            for moment in &moments {
                let slopes = self.slopes(moment);
                for (clock, is_of) in is_of.iter().enumerate() {
                    let is_moved =
                        |one: &Contribution| is_of[one.recording] || followed.moves(clock, one.recording);
                    if moment.contributions.iter().any(is_moved) {
                        let late_m = self.late_m(moment, is_of);
                        let left_m = late_m + followed.moved_m(clock, moment, &slopes);
                        of_times[clock].push(self.part(moment, &left_m));
                    }
                }
            }
            for (parts, of_times) in parts.iter_mut().zip(of_times) {
                parts.extend(stretches(&of_times));
            }
        }
        let shown = |(of, parts): (ClockOf, Vec<StretchSum>)| ClockShown::of(of, &parts);
        Ok(of.into_iter().zip(parts).filter_map(shown).collect())
    }

    /// How drives and offsets follow clocks that are off.
    fn followed(&self, field: &Fitted, is_of: &[Vec<bool>]) -> Result<ClockEffects, StitchingError> {
        let n = self.drive.len();
        let mut sensitivity = DMatrix::zeros(2 * n, is_of.len());
        for moment in field.iter().flat_map(|of_body| self.moments(of_body)) {
            let slopes = self.slopes(&moment);
            for (clock, is_of) in is_of.iter().enumerate() {
                let late_m = self.late_m(&moment, is_of);
                if late_m.iter().all(|late_m| *late_m == 0.0) {
                    continue;
                }
                for ((one, slopes), weighted) in
                    moment.contributions.iter().zip(&slopes).zip((&moment.free * late_m).iter())
                {
                    for (kind, slope) in slopes.iter().enumerate() {
                        sensitivity[(kind * n + one.recording, clock)] -= slope * weighted;
                    }
                }
            }
        }
        let singular = || StitchingError::Singular { n_recordings: n };
        let by_clock = self.solved(field)?.matrix.cholesky().ok_or_else(singular)?.solve(&sensitivity);
        let largest = by_clock
            .column_iter()
            .map(|column| [column.rows(0, n).amax(), column.rows(n, n).amax()])
            .collect();
        Ok(ClockEffects { by_clock, largest })
    }

    /// What a time of a body says of an error of its readings.
    fn part(&self, moment: &Moment<'_>, error_m: &DVector<f64>) -> StretchSum {
        let left = |one: &Contribution| {
            one.weight() * (one.read.value - moment.response.at(self.drive[one.recording]))
        };
        let products = moment.contributions.iter().zip(error_m).map(|(one, error_m)| error_m * left(one));
        StretchSum { weight: error_m.dot(&(&moment.free * error_m)), sum: products.sum() }
    }

    /// The clocks that readings may tell.
    fn clocks_asked(&self) -> Vec<ClockOf> {
        let mut views: Vec<u32> = self.observations.iter().map(|one| one.view).collect();
        views.sort_unstable();
        views.dedup();
        let n_of_view = |view: u32| self.observations.iter().filter(|one| one.view == view).count();
        let recordings = self.observations.iter().filter(|one| n_of_view(one.view) >= LEAST_TRIALS);
        let of_recordings = recordings.map(|one| ClockOf::Recording(one.recording.clone()));
        let of_views = views.iter().copied().filter(|_| views.len() > 1).map(ClockOf::View);
        of_views.chain(of_recordings).collect()
    }

    fn recordings_of(&self, clock: &ClockOf) -> Vec<bool> {
        self.observations.iter().map(|one| clock.holds(one.view, &one.recording)).collect()
    }

    /// The times behind the trigger at which several recordings saw a body.
    fn moments<'a>(&'a self, of_body: &'a FittedBody) -> impl Iterator<Item = Moment<'a>> + 'a {
        let times = self.times_s.iter().zip(of_body.times());
        let seen = times.filter(|(time_s, at)| **time_s > 0.0 && at.contributions.len() > 1);
        seen.map(|(time_s, FittedTime { contributions, response })| {
            let n = contributions.len();
            let beside: Vec<ReadingBeside> =
                contributions.iter().map(|one| response.beside(one, &self.drive)).collect();
            let free = |j: usize, k: usize| beside[j].free_weight(&contributions[k], &self.drive);
            Moment { time_s: *time_s, contributions, response, free: DMatrix::from_fn(n, n, free) }
        })
    }

    /// Derivatives of the residuals by each one's drive and offset.
    fn slopes(&self, moment: &Moment<'_>) -> Vec<[f64; 2]> {
        let of = |one: &Contribution| moment.response.residual_slopes(self.drive[one.recording]);
        moment.contributions.iter().map(of).collect()
    }

    /// What a clock that is off by as much as it shows makes of the readings, in metres.
    fn late_m(&self, moment: &Moment<'_>, is_of: &[bool]) -> DVector<f64> {
        let late_m = |one: &Contribution| match is_of[one.recording] {
            true => moment.time_s * moment.response.residual_slopes(self.drive[one.recording])[1],
            false => 0.0,
        };
        DVector::from_iterator(moment.contributions.len(), moment.contributions.iter().map(late_m))
    }
}

/// Stretches of a body's times with equal weights.
fn stretches(of_times: &[StretchSum]) -> [StretchSum; STRETCHES] {
    let whole: f64 = of_times.iter().map(|part| part.weight).sum();
    let mut stretches = [StretchSum::default(); STRETCHES];
    let mut before = 0.0;
    for part in of_times {
        let middle = (before + 0.5 * part.weight) / whole.max(f64::MIN_POSITIVE);
        let stretch = &mut stretches[((middle * STRETCHES as f64) as usize).min(STRETCHES - 1)];
        stretch.weight += part.weight;
        stretch.sum += part.sum;
        before += part.weight;
    }
    stretches
}

impl ClockShown {
    /// `None` where too few stretches tell it.
    fn of(of: ClockOf, parts: &[StretchSum]) -> Option<Self> {
        let weight: f64 = parts.iter().map(|part| part.weight).sum();
        let sum: f64 = parts.iter().map(|part| part.sum).sum();
        let n_parts = weight.powi(2) / parts.iter().map(|part| part.weight.powi(2)).sum::<f64>();
        let degrees_of_freedom = n_parts - 1.0;
        if !(weight > 0.0 && degrees_of_freedom > 1.0) {
            return None;
        }
        let value = sum / weight;
        // By groups, whose errors are no noise of single readings (H. White, Econometrica 48 (1980) 817).
        let scatter: f64 = parts.iter().map(|part| (part.sum - part.weight * value).powi(2)).sum();
        let enlarged = (scatter / weight * n_parts / degrees_of_freedom).max(1.0);
        let sigma = (enlarged / weight).sqrt();
        Some(Self {
            of,
            excess: Estimate::new(value, sigma),
            degrees_of_freedom,
            gain: value.powi(2) * weight,
        })
    }
}
