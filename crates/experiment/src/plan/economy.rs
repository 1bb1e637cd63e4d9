//! The cheapest way through recordings that still tells results as well as asked.
//!
//! What a run may do without: trials, the end of the recordings, the rim of the subsets, and what interpolation and shape function do for
//! readings that noise spoils anyway. Trials, ends and rims are rehearsed as a plan is. More of each never makes a result worse, so that what
//! fails, or loses bodies that larger subsets hold, fails for everything that has less of each, and half of what is left is decided by one rehearsal or less. Methods are tried on the
//! pictures themselves; one that errs by a part of the noise that even the mean over all trials hides is good enough. Costs are counted in
//! pixels looked at, not measured by a clock, so that equal inputs give equal choices.

use std::num::NonZero;

use chainwave_correlation::{
    FilmError, Interpolation, Method, ReferenceFrames, RungError, Settings, Shape, ShapeChoice, film_test,
    self_test,
};
use chainwave_measurement::{Estimate, Lost, Subset};

use super::aim::Aim;
use super::costs::{Costs, Extent};
use super::models::{choose_models, choose_replicas};
use super::pictures::Pictures;
use super::precision::Precision;
use super::readings::Readings;
use super::rehearsal::Rehearsal;
use super::schedule::Schedule;
use super::{Prepared, pictures, rehearsed};
use crate::configuration::Tracking;
use crate::error::Error;
use crate::evaluation::decisions::Decision;
use crate::monitor::{Monitor, Stage};
use crate::recordings::view::first_view;
use crate::setup::Setup;
use crate::tracking::follow::follow;

/// How recordings are to be processed for results that are known well enough.
#[derive(Clone)]
pub struct Economy {
    /// The experiment as it shall be run.
    pub setup: Setup,
    /// What was asked, with what is foreseen of it.
    pub outlooks: Vec<Outlook>,
    /// What was chosen, and why.
    pub decisions: Vec<Decision>,
    /// Pixels that are looked at, over those of the experiment as it is stated.
    pub work: f64,
    /// Rehearsals that it took.
    pub n_rehearsals: usize,
}

/// A result that was asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlook {
    /// What was asked.
    pub aim: Aim,
    /// What the experiment will tell as it shall be run, or why nothing.
    pub expected: Result<Estimate, String>,
    /// The same as it is stated.
    pub at_best: Result<Estimate, String>,
}

/// Part of the largest uncertainty that a rehearsal may foresee: plans and outcomes differ by some per cent, and a run that just misses what
/// was asked is worth nothing.
const MARGIN: f64 = 0.8;

/// The largest uncertainty that may be foreseen of a result, in its unit.
fn within_margin(aim: &Aim, foreseen: &Estimate) -> f64 {
    MARGIN * aim.sigma(foreseen.value)
}

impl Outlook {
    /// The largest uncertainty that a rehearsal may foresee, in the result's unit, where more than that is foreseen.
    pub fn missed_margin(&self) -> Option<f64> {
        let foreseen = self.expected.as_ref().ok()?;
        Some(within_margin(&self.aim, foreseen)).filter(|margin| foreseen.sigma > *margin)
    }
}

/// Parts of the time from the trigger to the end of the recordings that are tried.
const PARTS_OF_TIME: [f64; 5] = [0.25, 0.375, 0.5, 0.75, 1.0];
/// Parts of the subsets' half sizes that are tried.
const PARTS_OF_SIZE: [f64; 5] = [0.5, 0.6, 0.7, 0.85, 1.0];
/// Half a subset's side is no less than this: smaller ones hold less than the speckles that tell one place from another.
const LEAST_HALF_PX: usize = 5;
/// What a method may err by, over the noise of the mean over all trials of a view: shared by all of them, it adds 5 % to that.
const BESIDE_NOISE: f64 = 0.3;

/// Draws of strikers, triggers and noise that must all reach what was asked: a film's own is worse than each of three, and by more than the
/// margin, hardly ever.
const DRAWS: usize = 3;

/// The way through the pixels that costs least among those that reach all aims; the experiment as it is stated where none does.
///
/// # Errors
/// As of a plan; no aim at all.
pub fn economy(
    setup: &Setup,
    aims: &[Aim],
    n_threads: NonZero<usize>,
    monitor: &Monitor<'_>,
) -> Result<Economy, Error> {
    let (mut setup, mut prepared) = (setup.clone(), Prepared::of(setup)?);
    let of_models = choose_models(&mut setup, aims, &prepared.rehearsal);
    prepared.rehearsal.setup = setup.clone();
    let mut search = Search::new(&setup, prepared, aims, n_threads);
    let candidates = search.candidates();
    monitor.planned(Stage::Planning, 1);
    let at_best = search.rehearse(search.whole())?;
    monitor.done(Stage::Planning, 1);
    let (chosen, expected) = match search.reaches(&at_best) {
        true => search.cheapest(candidates, at_best.clone(), monitor)?,
        false => (search.whole(), at_best.clone()),
    };
    monitor.ended(Stage::Planning);
    let mut chosen_setup = search.setup_of(chosen);
    let mut decisions = search.decisions(chosen, &at_best);
    if search.reaches(&at_best) {
        let sigma_px = search.readings(chosen[2])?.0.usual.noise_px[0];
        decisions.push(choose_method(&mut chosen_setup, sigma_px, search.trials[chosen[0]])?);
        decisions.push(choose_replicas(&mut chosen_setup, aims, &expected));
    }
    decisions.extend(of_models);
    let of = |precision: &Precision, aim: &Aim| precision.of(aim.result).clone();
    let outlooks = aims.iter().map(|aim| Outlook {
        aim: *aim,
        expected: of(&expected, aim),
        at_best: of(&at_best, aim),
    });
    Ok(Economy {
        setup: chosen_setup,
        outlooks: outlooks.collect(),
        decisions,
        work: search.costs.pixels(chosen) as f64 / search.costs.pixels(search.whole()).max(1) as f64,
        n_rehearsals: search.n_rehearsals,
    })
}

/// Readings that are lost for another reason than that the body is out of view.
fn n_lost(setup: &Setup, pictures: &Pictures, n_threads: NonZero<usize>) -> Result<usize, Error> {
    let (bodies, subsets): (Vec<usize>, Vec<Subset>) = pictures.subsets.iter().cloned().unzip();
    let reference = ReferenceFrames::Mean(pictures.rest.clone());
    let recording = pictures.recording.as_ref();
    let followed = follow(recording, &subsets, &reference, setup.method(), n_threads, &Monitor::SILENT)?;
    let tracks = followed.of_bodies(bodies);
    let positions = tracks.bodies.iter().flat_map(|body| &body.positions);
    Ok(positions.filter(|found| found.as_ref().is_err_and(|why| *why != Lost::OutOfView)).count())
}

/// What is tried, and what is known of it.
struct Search<'a> {
    setup: &'a Setup,
    prepared: Prepared,
    aims: &'a [Aim],
    n_threads: NonZero<usize>,
    /// Trials of a view, ascending.
    trials: Vec<usize>,
    /// Times after the trigger, ascending; `None`: to the end.
    until_s: Vec<Option<f64>>,
    /// Half widths and heights, ascending.
    halves_px: Vec<[usize; 2]>,
    /// How bodies are read with each of those, and how many readings are lost, as far as it was asked.
    readings: Vec<Option<(Readings, usize)>>,
    costs: Costs,
    n_rehearsals: usize,
}

impl<'a> Search<'a> {
    fn new(setup: &'a Setup, prepared: Prepared, aims: &'a [Aim], n_threads: NonZero<usize>) -> Self {
        let schedule = &prepared.rehearsal.schedule;
        let n_trials = schedule.trials_a_view();
        let trials = (1..n_trials).filter(|n| *n <= 5 || n.is_multiple_of(5)).chain([n_trials]);
        let last_s = schedule.last_s();
        let until_s = PARTS_OF_TIME.map(|part| (part < 1.0).then_some(part * last_s));
        let tracking = &setup.experiment.tracking;
        let half = |whole: usize, part: f64| {
            let smaller = (part * whole as f64).round() as usize;
            smaller.max(LEAST_HALF_PX.min(whole))
        };
        let mut halves_px = match tracking.outline_px.is_empty() {
            true => PARTS_OF_SIZE
                .map(|part| [tracking.half_width_px, tracking.half_height_px].map(|whole| half(whole, part)))
                .to_vec(),
            false => vec![[tracking.half_width_px, tracking.half_height_px]],
        };
        halves_px.dedup();
        let trials: Vec<usize> = trials.collect();
        let costs = Costs::of(setup, schedule, (&trials, &until_s, &halves_px));
        let (until_s, readings) = (until_s.to_vec(), vec![None; halves_px.len()]);
        Self {
            setup,
            prepared,
            aims,
            n_threads,
            trials,
            until_s,
            halves_px,
            readings,
            costs,
            n_rehearsals: 0,
        }
    }

    /// Everything that the experiment states.
    fn whole(&self) -> Extent {
        [self.trials.len() - 1, self.until_s.len() - 1, self.halves_px.len() - 1]
    }

    /// All that can be looked at, cheapest first.
    fn candidates(&self) -> Vec<Extent> {
        let [trials, times, sizes] = self.whole();
        let all = (0..=trials).flat_map(|trial| {
            (0..=times).flat_map(move |time| (0..=sizes).map(move |size| [trial, time, size]))
        });
        let mut all: Vec<(u64, Extent)> = all.map(|extent| (self.costs.pixels(extent), extent)).collect();
        all.sort_unstable();
        all.into_iter().map(|(_, extent)| extent).collect()
    }

    fn schedule_of(&self, [trials, time, _]: Extent) -> Schedule {
        let schedule = self.prepared.rehearsal.schedule.with_first_trials(self.trials[trials]);
        self.until_s[time].map_or(schedule.clone(), |until_s| schedule.until(until_s))
    }

    /// The experiment as it shall be run.
    fn setup_of(&self, extent: Extent) -> Setup {
        let mut setup = self.setup.clone();
        setup.keep_first_trials(self.trials[extent[0]]);
        let Tracking { half_width_px, half_height_px, until_s, .. } = &mut setup.experiment.tracking;
        [*half_width_px, *half_height_px] = self.halves_px[extent[2]];
        *until_s = self.until_s[extent[1]].or(*until_s);
        setup
    }

    /// How bodies are read with subsets of a size, and how many readings are lost with them in one recording of some views, though bodies
    /// are in view: a rehearsal takes for granted that none is.
    fn readings(&mut self, size: usize) -> Result<(Readings, usize), Error> {
        if let Some(known) = &self.readings[size] {
            return Ok(known.clone());
        }
        let mut setup = self.setup.clone();
        let tracking = &mut setup.experiment.tracking;
        [tracking.half_width_px, tracking.half_height_px] = self.halves_px[size];
        let Prepared { rehearsal, camera, .. } = &self.prepared;
        let pictures = pictures(&setup, &rehearsal.schedule, camera, &rehearsal.chain)?;
        let readings = Readings::of(&setup, &pictures)?;
        let n_lost =
            pictures.iter().map(|one| n_lost(&setup, one, self.n_threads)).sum::<Result<usize, Error>>()?;
        self.readings[size] = Some((readings.clone(), n_lost));
        Ok((readings, n_lost))
    }

    /// What is foreseen: of each result the worst of several draws of strikers, triggers and noise, as few trials fall out unequally; of the
    /// first draws alone where these miss an aim.
    fn rehearse(&mut self, extent: Extent) -> Result<Precision, Error> {
        self.n_rehearsals += 1;
        let (readings, n_lost) = self.readings(extent[2])?;
        let (_, n_lost_at_best) = self.readings(self.whole()[2])?;
        if n_lost > n_lost_at_best {
            return Err(Error::Value(format!("{n_lost} readings are lost, expected {n_lost_at_best}")));
        }
        let mut rehearsal = Rehearsal {
            setup: self.setup_of(extent),
            schedule: self.schedule_of(extent),
            readings,
            ..self.prepared.rehearsal.clone()
        };
        let mut worst = rehearsed(&rehearsal, self.n_threads)?;
        for _ in 1..DRAWS {
            if !self.reaches(&worst) {
                break;
            }
            rehearsal.seed = rehearsal.seed.wrapping_add(1);
            let found = rehearsed(&rehearsal, self.n_threads)?;
            worst = worst.worse_of_each(&found);
        }
        Ok(worst)
    }

    /// Whether all aims are met, with a margin.
    fn reaches(&self, precision: &Precision) -> bool {
        self.aims.iter().all(|aim| {
            let found = precision.of(aim.result).as_ref();
            found.is_ok_and(|found| found.sigma <= within_margin(aim, found))
        })
    }

    /// The cheapest of some candidates, which stand in the order of their costs, with what is foreseen of it; the whole, of which that is known,
    /// where no other reaches the aims. One that cannot be evaluated does not.
    fn cheapest(
        &mut self,
        mut candidates: Vec<Extent>,
        of_whole: Precision,
        monitor: &Monitor<'_>,
    ) -> Result<(Extent, Precision), Error> {
        let whole = self.whole();
        let mut best = (whole, of_whole);
        candidates.retain(|extent| *extent != whole);
        while let Some(&middle) = candidates.get(candidates.len() / 2) {
            if (monitor.is_cancelled)() {
                return Err(Error::Cancelled { n_done: 0, n: self.setup.trials.len() });
            }
            monitor.planned(Stage::Planning, 1);
            let found = self.rehearse(middle).ok().filter(|precision| self.reaches(precision));
            monitor.done(Stage::Planning, 1);
            match found {
                Some(precision) => {
                    let place = candidates.iter().position(|extent| *extent == middle).unwrap_or(0);
                    candidates.truncate(place);
                    best = (middle, precision);
                }
                None => candidates.retain(|extent| (0..3).any(|i| extent[i] > middle[i])),
            }
        }
        Ok(best)
    }

    /// What was chosen to be looked at.
    fn decisions(&self, chosen: Extent, at_best: &Precision) -> Vec<Decision> {
        let whole = self.whole();
        let rule = || {
            let aims: Vec<String> = self.aims.iter().map(Aim::to_string).collect();
            format!(
                "the fewest pixels for {}, rehearsed with a margin: sigma within {MARGIN} of what was asked",
                aims.join(" and ")
            )
        };
        let evidence = |axis: usize| match (self.reaches(at_best), chosen[axis] == whole[axis]) {
            (false, _) => "what was asked is out of reach even with all".to_owned(),
            (true, true) => {
                "with less, what was asked is not reached, bodies are lost, or it costs more elsewhere"
                    .to_owned()
            }
            (true, false) => format!("reached in a rehearsal, one of {}", self.n_rehearsals),
        };
        let [half_width, half_height] = self.halves_px[chosen[2]];
        let frames = match self.until_s[chosen[1]].or(self.setup.experiment.tracking.until_s) {
            Some(until_s) => format!("until {:.3} ms after the trigger", 1e3 * until_s),
            None => "all".into(),
        };
        vec![
            Decision {
                question: "trials that are used",
                choice: format!("{} of {} of each view", self.trials[chosen[0]], self.trials[whole[0]]),
                rule: rule(),
                evidence: evidence(0),
            },
            Decision {
                question: "frames that are used",
                choice: frames,
                rule: rule(),
                evidence: evidence(1),
            },
            Decision {
                question: "size of the subsets",
                choice: format!("{} x {} px", 2 * half_width + 1, 2 * half_height + 1),
                rule: rule(),
                evidence: evidence(2),
            },
        ]
    }
}

/// The cheapest shape function and interpolation whose own error drowns in the noise of the mean over so many trials.
fn choose_method(setup: &mut Setup, sigma_px: f64, n_trials: usize) -> Result<Decision, Error> {
    let stated = setup.method();
    let view = first_view(setup)?;
    let (recording, settings) = (view.recording.as_ref(), Settings::default());
    let methods = up_to(&setup.experiment.tracking);
    let shifted = self_test(&methods, recording, &view.subsets, &view.reference, &settings)?;
    let filmed = film_test(&methods, recording, &view.subsets, &view.reference, &settings)?;
    let of_stated = shifted.iter().find(|found| found.method == stated);
    let stated_effort = of_stated.map_or(0.0, |found| found.effort);
    let allowed_px = BESIDE_NOISE * sigma_px / (n_trials as f64).sqrt();
    let error_px = |(shifted, filmed): (&RungError, &FilmError)| {
        let loses_nothing = shifted.n_lost == 0 && filmed.n_lost == 0 && shifted.n_found > 0;
        loses_nothing.then(|| shifted.bias_px.hypot(filmed.error_px.unwrap_or(0.0)))
    };
    let cheaper: Vec<(&RungError, f64)> = shifted
        .iter()
        .zip(&filmed)
        .filter(|(shifted, _)| shifted.effort < stated_effort)
        .filter_map(|both| Some((both.0, error_px(both)?)))
        .collect();
    let good_enough = cheaper.iter().copied().filter(|(_, error_px)| *error_px <= allowed_px);
    let cheapest = good_enough.min_by(|(one, _), (other, _)| one.effort.total_cmp(&other.effort));
    let nearest = cheaper.iter().min_by(|(_, one), (_, other)| one.total_cmp(other)).map_or_else(
        || "there is no cheaper one that loses nothing on these pictures".to_owned(),
        |(found, error_px)| {
            format!(
                "of the cheaper ones {} errs least on these pictures, by {error_px:.1e} px, allowed {allowed_px:.1e} px",
                found.method
            )
        },
    );
    let (method, evidence) = match cheapest {
        Some((found, error_px)) => (
            found.method,
            format!(
                "{:.2} of the multiplications of {stated}; errs by {error_px:.1e} px on these pictures, allowed {allowed_px:.1e} px",
                found.effort / stated_effort
            ),
        ),
        None => (stated, nearest),
    };
    if let Method::IcGn { shape, interpolation } = method {
        let tracking = &mut setup.experiment.tracking;
        (tracking.shape, tracking.interpolation) = (shape, interpolation);
    }
    Ok(Decision {
        question: "tracking method for what was asked",
        choice: method.to_string(),
        rule: format!(
            "the cheapest that errs by less than {BESIDE_NOISE} of the noise of the mean over {n_trials} trials"
        ),
        evidence,
    })
}

/// The stated method, and those of simpler shape functions and interpolations.
fn up_to(tracking: &Tracking) -> Vec<Method> {
    let Tracking { shape, interpolation, .. } = *tracking;
    let ShapeChoice::Named(stated) = shape else { return vec![Method::IcGn { shape, interpolation }] };
    let place = Shape::ALL.iter().position(|one| *one == stated).unwrap_or(0);
    let shapes = Shape::ALL.into_iter().take(place + 1);
    let place = Interpolation::ALL.iter().position(|one| *one == interpolation).unwrap_or(0);
    let of = |shape: Shape| {
        let interpolations = Interpolation::ALL.into_iter().take(place + 1);
        interpolations
            .map(move |interpolation| Method::IcGn { shape: ShapeChoice::Named(shape), interpolation })
    };
    shapes.flat_map(of).collect()
}
