//! What an experiment will tell, before it is filmed or run: how uncertain each result will be, what limits it, what a run costs, and which
//! change would help.
//!
//! A plan is a run without pictures. The stated chain is solved for each scheduled recording, with a striker and a trigger of its own;
//! bodies in view are read with the noise that pictures will have; and the very stitching, measuring and fitting of a run say how uncertain
//! their results are. So a plan says what a run will say, as far as noise, schedule and stated uncertainties decide it. What no plan can
//! foresee adds to it: a camera that moves, a pattern of the sensor, a chain that is not what is stated.
//!
//! The noise of a reading comes from pictures: of the recordings that are there, else drawn by the camera under `[synthetic]`, else by a
//! usual one, which is said to be assumed. A change is the same computation on another schedule, with the same seeds. Halving one source of
//! error, of variance s^2 in a total of t^2, leaves t^2 - 3/4 s^2, which tells the source's share.

mod aim;
mod assumed_chain;
mod bound;
mod change;
mod costs;
mod economy;
#[cfg(test)]
mod economy_tests;
mod in_memory;
mod models;
mod pace;
mod pictures;
mod planned_camera;
mod precision;
mod readings;
mod rehearsal;
mod schedule;
#[cfg(test)]
mod shot_tests;
#[cfg(test)]
mod tests;

use std::num::NonZero;

use chainwave_inference::{TrackModel, stated_damping};
use chainwave_measurement::Estimate;

pub use self::aim::{Aim, LargestSigma};
use self::assumed_chain::AssumedChain;
pub use self::bound::{DampingBound, damping_bound};
use self::change::Change;
pub use self::economy::{Economy, Outlook, economy};
use self::pace::Pace;
use self::pictures::Pictures;
use self::planned_camera::PlannedCamera;
pub use self::precision::{PlannedResult, Precision, outcome, typical_half_width};
use self::precision::{both, precision};
use self::readings::Readings;
use self::rehearsal::Rehearsal;
use self::schedule::{PlannedRecording, Schedule};
use crate::camera::calibration::ChainMap;
use crate::chain::measuring::chosen_gaps;
use crate::chain::stated_motion::StatedMotion;
use crate::error::Error;
use crate::evaluation::evaluate;
use crate::finding::Finding;
use crate::fitting::fits::{priors, track_model};
use crate::merging::joint::Joint;
use crate::merging::{Merged, merged};
use crate::monitor::{Monitor, Stage};
use crate::recordings::failed_recording::FailedRecording;
use crate::recordings::view::unreadable;
use crate::sanity::check;
use crate::setup::Setup;

/// What an experiment will tell.
#[derive(Debug, Clone)]
pub struct Plan {
    /// What the experiment does not state and no recording shows, and was taken for granted.
    pub assumed: Vec<String>,
    /// What contradicts the experiment.
    pub findings: Vec<Finding>,
    /// Recordings that are filmed already.
    pub n_filmed: usize,
    /// Recordings, their bytes, and the time of a run.
    pub cost: Cost,
    /// Standard uncertainty of one reading of a body's place along the picture's rows, in pixels: the median over bodies.
    pub reading_sigma_px: f64,
    /// What will be known of each result.
    pub forecasts: Vec<Forecast>,
    /// What could be done otherwise.
    pub changes: Vec<PlannedChange>,
}

/// What will be known of a result.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// The result.
    pub result: PlannedResult,
    /// The result with its standard uncertainty, or why there will be none.
    pub estimate: Result<Estimate, String>,
    /// What the uncertainty comes from, largest share of the variance first.
    pub shares: Vec<VarianceShare>,
}

/// What an experiment costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Recordings.
    pub n_recordings: usize,
    /// Bytes of them all.
    pub bytes: u64,
    /// Places of bodies that a run looks for, one for each in each frame.
    pub n_readings: u64,
    /// Seconds of a run on this machine, from pictures to results, where the stated model explains the tracks.
    pub seconds: f64,
    /// Those of a run whose tracks have more in common than the stated model explains, so that each cause that could is fitted.
    pub seconds_with_causes: f64,
    /// Those of them in which bodies are followed through the recordings.
    pub tracking_s: f64,
}

/// A source of error, and its share of a result's variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VarianceShare {
    /// The source, in words.
    pub source: &'static str,
    /// Its share, from 0 to 1.
    pub share: f64,
}

/// Something that could be done otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedChange {
    /// What, in words.
    pub change: String,
    /// What the experiment would cost.
    pub cost: Cost,
    /// How many times smaller the uncertainty of each result would be; `None` of one that is missing in either plan.
    pub factors: Vec<(PlannedResult, Option<f64>)>,
}

/// Views of which pictures are looked at, or drawn, at most: noise and texture hardly differ from one to the next.
const MOST_VIEWS: usize = 5;
/// Shares of a variance below this are not told from none: uncertainties by 200 replicas scatter by 5 %, in two plans partly alike.
const LEAST_SHARE: f64 = 0.2;
/// Seconds of a run beside following and evaluating: its look at the pictures before work, tables, figures and the page, which took 0.4 to
/// 0.7 s of each of the book's ten experiments.
const REST_OF_RUN_S: f64 = 0.6;

/// Plans the trials of one striker velocity. `now_s` is the caller's clock, in seconds from any instant.
///
/// # Errors
/// An experiment that cannot be meant, a chain that cannot be computed, or one of which nothing would be seen.
pub fn plan(
    setup: &Setup,
    n_threads: NonZero<usize>,
    monitor: &Monitor<'_>,
    now_s: &dyn Fn() -> f64,
) -> Result<Plan, Error> {
    let mut findings = check(setup, n_threads)?.findings;
    findings.extend(unreadable_recordings(setup, n_threads));
    let Prepared { rehearsal, camera, pictures } = Prepared::of(setup)?;
    let setup = &rehearsal.setup;
    let n_filmed = rehearsal.schedule.recordings.iter().filter(|one| one.is_filmed).count();
    let pace = Pace::measured(setup, &pictures, n_threads, now_s)?;
    let mut assumed = if n_filmed == 0 { camera.assumed } else { Vec::new() };
    assumed.extend(rehearsal.chain.assumed.iter().cloned());
    let reading_sigma_px = rehearsal.readings.usual.noise_px[0];
    let changes = Change::of(&rehearsal)?;
    monitor.planned(Stage::Planning, 2 + changes.len() as u64);
    let from_s = now_s();
    let base = evaluated(&rehearsal, n_threads)?;
    let explained_s = now_s() - from_s;
    monitor.done(Stage::Planning, 1);
    let from_s = now_s();
    evaluated(&Rehearsal { readings: rehearsal.readings.unexplained(), ..rehearsal.clone() }, n_threads)?;
    let unexplained_s = now_s() - from_s;
    monitor.done(Stage::Planning, 1);
    let cost = |rehearsal_of: &Rehearsal| {
        let schedule = &rehearsal_of.schedule;
        let larger = schedule.n_frames() as f64 / rehearsal.schedule.n_frames().max(1) as f64;
        let tracking_s = pace.seconds(setup, schedule, n_threads);
        let seconds = |evaluated_s: f64| tracking_s + larger * evaluated_s + REST_OF_RUN_S;
        Cost {
            n_recordings: schedule.recordings.len(),
            bytes: schedule.bytes(),
            n_readings: schedule.n_readings(setup),
            seconds: seconds(explained_s),
            seconds_with_causes: seconds(unexplained_s.max(explained_s)),
            tracking_s,
        }
    };
    let mut made = Vec::with_capacity(changes.len());
    let mut halved = Vec::new();
    for (change, changed) in changes {
        if (monitor.is_cancelled)() {
            return Err(Error::Cancelled { n_done: 0, n: setup.trials.len() });
        }
        let found = rehearsed(&changed, n_threads)?;
        let factors = factors(&base, &found);
        halved.extend(change.halves().map(|source| (source, factors.clone())));
        made.push(PlannedChange { change: change.in_words(&rehearsal), cost: cost(&changed), factors });
        monitor.done(Stage::Planning, 1);
    }
    monitor.ended(Stage::Planning);
    let forecast = |(result, found): (PlannedResult, &Result<Estimate, String>)| Forecast {
        result,
        estimate: found.clone(),
        shares: shares(&halved, result),
    };
    Ok(Plan {
        assumed,
        findings,
        n_filmed,
        cost: cost(&rehearsal),
        reading_sigma_px,
        forecasts: base.iter().map(forecast).collect(),
        changes: made,
    })
}

/// What a rehearsal takes, and the pictures that told how bodies are read.
struct Prepared {
    rehearsal: Rehearsal,
    camera: PlannedCamera,
    pictures: Vec<Pictures>,
}

impl Prepared {
    /// Of the trials of one striker velocity.
    ///
    /// # Errors
    /// Pictures that cannot be read or drawn, or that show no body.
    fn of(setup: &Setup) -> Result<Self, Error> {
        let camera = PlannedCamera::of(setup)?;
        let is_drawn = !setup.trials.iter().any(|trial| setup.open(trial).is_ok());
        let setup = &match is_drawn && setup.map.goes_left() {
            true => mirrored(setup, camera.camera.width_px)?,
            false => setup.clone(),
        };
        let schedule = Schedule::of(setup, &camera);
        let rate_hz = schedule.recordings.iter().find_map(|one| one.info.rate_hz);
        let chain = AssumedChain::of(&setup.experiment, rate_hz.unwrap_or(camera.camera.rate_hz))?;
        let pictures = pictures(setup, &schedule, &camera, &chain)?;
        let readings = Readings::of(setup, &pictures)?;
        let seed = setup.experiment.analysis.seed;
        let rehearsal = Rehearsal { setup: setup.clone(), schedule, readings, chain, seed };
        Ok(Self { rehearsal, camera, pictures })
    }
}

/// An experiment in a mirror, so that a chain to the left goes to the right, as cameras draw it: what is known of it stays the same.
///
/// # Errors
/// None that the experiment itself has not.
fn mirrored(setup: &Setup, width_px: usize) -> Result<Setup, Error> {
    let mut mirrored = setup.clone();
    let camera = &mut mirrored.experiment.camera;
    let mirror = |at_px: &mut [f64; 2]| at_px[0] = width_px as f64 - 1.0 - at_px[0];
    mirror(&mut camera.first_body_px);
    camera.marks.iter_mut().flat_map(|marks| &mut marks.at_px).for_each(mirror);
    mirrored.map = ChainMap::read(&mirrored.experiment, &mirrored.path)?;
    Ok(mirrored)
}

/// How well each result will be known, as [`plan()`] says, and nothing else.
///
/// # Errors
/// As of a plan.
pub fn foreseen(setup: &Setup, n_threads: NonZero<usize>) -> Result<Precision, Error> {
    evaluated(&Prepared::of(setup)?.rehearsal, n_threads)
}

/// Recordings that are there and cannot be read; they are planned as if they were not.
fn unreadable_recordings(setup: &Setup, n_threads: NonZero<usize>) -> impl Iterator<Item = Finding> {
    let failed = unreadable(setup, n_threads).into_iter();
    let is_there = |one: &FailedRecording| setup.has_recording(&one.trial);
    failed.filter(is_there).map(|one| Finding {
        code: "unreadable",
        subject: one.trial.recording,
        text: one.error.to_string(),
    })
}

/// Pictures of some views: of recordings that are there, else drawn.
fn pictures(
    setup: &Setup,
    schedule: &Schedule,
    camera: &PlannedCamera,
    chain: &AssumedChain,
) -> Result<Vec<Pictures>, Error> {
    let stages = schedule.stages();
    let n_views = stages.len().min(MOST_VIEWS);
    let views = (0..n_views).map(|index| stages[index * stages.len() / n_views].0);
    let of_view = |view: u32| {
        let shown = schedule.recordings.iter().filter(|one| one.trial.view == view);
        shown.max_by_key(|one| one.is_filmed)
    };
    let recordings: Vec<&PlannedRecording> = views.filter_map(of_view).collect();
    let mut filmed = Vec::new();
    let mut failure = None;
    for one in recordings.iter().filter(|one| one.is_filmed) {
        match Pictures::filmed(setup, &one.trial) {
            Ok(found) => filmed.extend(found),
            Err(error) => failure = Some(error),
        }
    }
    match failure {
        Some(error) if filmed.is_empty() => return Err(error),
        _ if schedule.recordings.iter().any(|one| one.is_filmed) => return Ok(filmed),
        _ => {}
    }
    let last_s = camera.info().times_s.last().copied().unwrap_or(0.0);
    let frame_s = camera.camera.rate_hz.recip();
    let strength = setup.experiment.nominal_drive().value;
    let motion = chain.motion(&setup.experiment, strength, last_s.max(0.0) + 2.0 * frame_s)?;
    let drawn = recordings.iter().map(|one| Pictures::drawn(setup, camera, &one.trial, &motion));
    drawn.filter_map(Result::transpose).collect()
}

/// What a whole evaluation says, as a run makes it.
fn evaluated(rehearsal: &Rehearsal, n_threads: NonZero<usize>) -> Result<Precision, Error> {
    let evaluation = evaluate(&rehearsal.setup, &rehearsal.tracked(n_threads)?, n_threads, &Monitor::SILENT)?;
    let dampings =
        both(&rehearsal.setup.experiment, evaluation.track_fit.map(|fit| fit.stated.unwrap_or(fit.by_noise)));
    Ok(precision(&evaluation.stitched.motion, &evaluation.measurement, dampings))
}

/// The same, without what a run adds to it.
fn rehearsed(rehearsal: &Rehearsal, n_threads: NonZero<usize>) -> Result<Precision, Error> {
    let (setup, tracked) = (&rehearsal.setup, rehearsal.tracked(n_threads)?);
    let experiment = &setup.experiment;
    let stated = StatedMotion::of(experiment, tracked.last_s(), n_threads)?;
    let Merged { joint, shared, reading_errors, usual_geometry, .. } =
        merged(setup, &tracked, &stated, n_threads)?;
    let Joint { setup: mapped, scale, stitched, observations, .. } = joint;
    let measurement = shared.measure(experiment, &stitched.motion, chosen_gaps(experiment), n_threads)?;
    let priors = priors(experiment, &mapped.map, &scale, 0.0);
    let model = track_model(experiment, experiment.chain_model()?, &priors, n_threads);
    let model =
        model.map(|model| TrackModel { reading_errors, usual_errors: usual_geometry.errors, ..model });
    let offsets_s: Vec<f64> = stitched.alignments.iter().map(|one| one.trigger_offset_s.value).collect();
    let dampings =
        both(experiment, model.and_then(|model| stated_damping(&observations, &offsets_s, &model)));
    Ok(precision(&stitched.motion, &measurement, dampings))
}

/// How many times smaller the uncertainty of each result becomes; `None` of one that is missing.
type Factors = Vec<(PlannedResult, Option<f64>)>;

/// How many times smaller uncertainties become.
fn factors(base: &Precision, changed: &Precision) -> Factors {
    let factor = |base: &Result<Estimate, String>, changed: &Result<Estimate, String>| {
        Some(base.as_ref().ok()?.sigma / changed.as_ref().ok()?.sigma)
    };
    base.iter().map(|(result, found)| (result, factor(found, changed.of(result)))).collect()
}

/// The shares of sources that were halved in the variance of a result, largest first.
fn shares(halved: &[(&'static str, Factors)], result: PlannedResult) -> Vec<VarianceShare> {
    let share = |(source, factors): &(&'static str, Factors)| {
        let factor = factors.iter().find(|(one, _)| *one == result)?.1?;
        let share = (4.0 / 3.0 * (1.0 - factor.powi(-2))).min(1.0);
        (share >= LEAST_SHARE).then_some(VarianceShare { source, share })
    };
    let mut shares: Vec<VarianceShare> = halved.iter().filter_map(share).collect();
    shares.sort_by(|one, other| other.share.total_cmp(&one.share));
    shares
}
