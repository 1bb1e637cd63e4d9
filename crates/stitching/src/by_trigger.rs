//! Trials that no smooth response to the drive explains: averaged by their triggers, as uncertain as they scatter.
//!
//! Aligning takes each body's motion for a smooth function of the drive. Where it is none, as in a chain whose gaps snap in one trial and not
//! in the next, drives and triggers are moved by what they have nothing to do with, and come out far off with small errors. Such an
//! alignment may settle all the same, but it does not leave noise alone.

use chainwave_measurement::{ChainMotion, Estimate, Observation, median};
use ndarray::{Array2, ArrayView1};

use crate::error::StitchingError;
use crate::reading_error::on_time_base;
use crate::resample::{Interpolated, Resampling};
use crate::rest::{Displacement, displacement_from_rest};
use crate::settings::Settings;
use crate::spread::Spread;
use crate::stitched::{Alignment, Stitched};
use crate::trigger_scatter::widening;

/// Recordings that scatter by less, in the tracker's sigmas, agree. Of sigmas that are right noise alone comes to as much in one of 1e12
/// alignments with 30 degrees of freedom (chi squared 120), and an alignment has hundreds; what is left is room for sigmas that are too small
/// by up to two. Each effect of a real camera that `prove --camera` films leaves the recordings at 0.6 to 1.0.
pub(crate) const SOUND_SCATTER: f64 = 2.0;
/// What recordings scatter by over the farthest way of a body, from which on they contradict each other: a twentieth of what a pixel is of a usual way,
/// and less than any camera's noise.
const LEAST_SHARE_OF_WAY: f64 = 1e-4;
/// Trials from which their scatter is told, where as many saw a body; two tell it badly, and are better than nothing.
const LEAST_TRIALS: usize = 3;
/// Student's t at 97.5 % with one degree of freedom over the normal distribution's: two trials are beyond what expansions hold for.
const WIDENING_OF_TWO: f64 = 12.706_204_736_174_7 / Estimate::COVERAGE_95;

/// What one recording reads of a body at a time.
struct Reading {
    recording: usize,
    read: Interpolated,
    /// How many times share a frame's noise.
    n_shared: f64,
}

/// Whether an alignment is none: its recordings scatter by several times what the trackers' sigma lets expect. Where bodies tie all of them,
/// that alone decides, settled or not. Groups that nothing ties each settle for themselves and are joined by their triggers anyway, with the
/// errors of their means; there it must not have settled either, lest one recording of one group undo all others.
///
/// An alignment that ties all of them and in its last round still moves triggers by more than they were known to before is none either,
/// however well recordings agree: as where a front runs alike whatever set it off, and a drive is to all bodies behind the first what a
/// trigger is.
///
/// What recordings scatter by must be seen in the motion, too: readings without noise, as of drawn pictures, tell more than responses that are
/// polynomials of the drive follow, and trials that nothing relates differ by parts of their way.
pub(crate) fn is_contradicted(
    stitched: &Stitched,
    observations: &[Observation],
    n_groups: usize,
    trigger_prior_s: f64,
) -> bool {
    let is_lost = stitched.unsettled.is_some_and(|unsettled| unsettled.offset_change_s > trigger_prior_s);
    if n_groups == 1 && is_lost {
        return true;
    }
    let squares = stitched.alignments.iter().map(|alignment| alignment.scatter_ratio.powi(2));
    let mean = squares.sum::<f64>() / stitched.alignments.len().max(1) as f64;
    let scatters = mean.sqrt() > SOUND_SCATTER && (n_groups == 1 || stitched.unsettled.is_some());
    scatters && mean.sqrt() * usual_sigma_m(observations) > LEAST_SHARE_OF_WAY * way_m(stitched)
}

/// The median of what readings are uncertain by.
fn usual_sigma_m(observations: &[Observation]) -> f64 {
    let tracks = observations.iter().flat_map(|one| &one.bodies);
    let sigmas_m: Vec<f64> =
        tracks.flat_map(|track| track.position_m.iter().flatten()).map(|x| x.sigma).collect();
    median(sigmas_m).unwrap_or(0.0)
}

/// The farthest that a body goes.
fn way_m(stitched: &Stitched) -> f64 {
    stitched.motion.displacement_m.iter().flatten().map(|x| x.value.abs()).fold(0.0, f64::max)
}

/// The mean of all recordings of a body, each by its own trigger, on the time base of an alignment that is none.
///
/// Its error is that of a mean of trials: what one recording lies off it counts as one error of all its bodies and times, so that strains
/// and peaks have it too, so much wider that 1.96 standard deviations hold 95 % of a mean whose trials are few (of three, 3 % narrower than
/// Student's interval: that of an expansion). What fewer than three recordings saw at a time is left out, of a body that no more than two saw at all what one
/// saw. Of triggers, drives and all that an alignment tells beside the motion nothing is told but what is known before.
///
/// # Errors
/// A body that was never at rest, or [`StitchingError::Contradictory`] where nothing is left.
pub(crate) fn averaged_by_trigger(
    observations: &[Observation],
    settings: &Settings,
    interval_s: f64,
    contradicted: &Stitched,
) -> Result<Stitched, StitchingError> {
    let times_s = &contradicted.motion.times_s;
    let readings = readings(observations, settings, times_s, interval_s)?;
    let Means { mut motion, of_trials, spread } = means(&readings, times_s, observations.len());
    if motion.displacement_m.iter().all(Option::is_none) {
        let names: Vec<&str> = observations.iter().map(|one| one.recording.as_str()).collect();
        return Err(StitchingError::Contradictory { recordings: names.join(", ") });
    }
    for shared in &settings.reading_errors {
        let mut error_m = Array2::zeros(readings.dim());
        for of_row in on_time_base(shared, observations, &vec![0.0; observations.len()], times_s) {
            for (i, of_time) in readings.row(of_row.row).iter().enumerate() {
                let sum: f64 = of_time.iter().map(|one| of_row.at(one.recording, i)).sum();
                error_m[(of_row.row, i)] = sum / of_time.len().max(1) as f64;
            }
        }
        motion.add_error(shared.source.clone(), &error_m);
    }
    let ratios = scatter_ratios(&readings, &motion, observations.len());
    for (displacement_m, one) in of_trials.iter().zip(observations) {
        motion.modes.push(format!("trial {}", one.recording).into(), displacement_m);
    }
    let alignment = |(one, scatter_ratio): (&Observation, f64)| Alignment {
        recording: one.recording.clone(),
        view: one.view,
        trial: one.trial,
        trigger_offset_s: Estimate::new(0.0, settings.trigger_prior_s(interval_s)),
        drive_deviation: Estimate::new(0.0, settings.drive_scatter.unwrap_or(settings.drive_prior)),
        scatter_ratio,
    };
    let said = "no smooth response to the drive tells how trials differ: they are averaged by their triggers, with the error of a mean of trials \
                that scatter so; triggers and drives are not told (hint: motion_by_model has each trial by the chain model where that is accepted)";
    let mut warnings = vec![said.to_owned()];
    warnings.extend(contradicted.warnings.iter().cloned());
    Ok(Stitched {
        alignments: observations.iter().zip(ratios).map(alignment).collect(),
        drive_scale_sigma: None,
        motion,
        spread,
        rounds: contradicted.rounds,
        unsettled: contradicted.unsettled,
        by_trigger: true,
        // What the alignment says of these is no better than the alignment.
        shown: Vec::new(),
        clocks: Vec::new(),
        untied: Vec::new(),
        left_by_views: Vec::new(),
        warnings,
    })
}

/// The means of trials.
struct Means {
    /// With the readings' noise, and the trials' scatter in its sigmas alone.
    motion: ChainMotion,
    /// What each recording off the mean makes of the mean's error.
    of_trials: Vec<Array2<f64>>,
    spread: Spread,
}

fn means(readings: &Array2<Vec<Reading>>, times_s: &[f64], n_recordings: usize) -> Means {
    let shape = readings.dim();
    let mut motion = ChainMotion::unseen(readings.nrows(), times_s.to_vec());
    let mut of_trials: Vec<Array2<f64>> = vec![Array2::zeros(shape); n_recordings];
    let mut spread = Spread { within_m: Array2::zeros(shape), between_m: Array2::zeros(shape) };
    let least: Vec<usize> =
        readings.rows().into_iter().map(|of_body| least_trials(&of_body, n_recordings)).collect();
    for (at, of_time) in readings.indexed_iter().filter(|(at, of_time)| of_time.len() >= least[at.0]) {
        let n = of_time.len() as f64;
        let widened = if of_time.len() == 2 { WIDENING_OF_TWO } else { widening(n - 1.0) };
        let mean_m = of_time.iter().map(|one| one.read.value).sum::<f64>() / n;
        let noise_m2 = |gain: fn(&Reading) -> f64| {
            of_time.iter().map(|one| gain(one) * one.read.sigma.powi(2)).sum::<f64>() / n.powi(2)
        };
        let mut variance_m2 = noise_m2(|one| one.read.noise_gain);
        let mut squares_m2 = 0.0;
        for one in of_time {
            let off_m = one.read.value - mean_m;
            // Of n such errors with normal amplitudes the squares add up to the variance of the mean of n, known as well as n trials tell it.
            let error_m = widened * off_m / (n * (n - 1.0)).sqrt();
            of_trials[one.recording][at] = error_m;
            variance_m2 += error_m.powi(2);
            squares_m2 += off_m.powi(2);
        }
        motion.displacement_m[at] = Some(Estimate::new(mean_m, variance_m2.sqrt()));
        motion.independent_sigma_m[at] = noise_m2(|one| one.n_shared).sqrt();
        motion.n_trials[at] = of_time.len() as u32;
        spread.within_m[at] = (n * noise_m2(|_| 1.0)).sqrt();
        spread.between_m[at] = (squares_m2 / (n - 1.0)).sqrt();
    }
    Means { motion, of_trials, spread }
}

/// Trials that a time of a body must have, two or three, by how many saw the body at all.
fn least_trials(of_body: &ArrayView1<'_, Vec<Reading>>, n_recordings: usize) -> usize {
    let mut has_seen = vec![false; n_recordings];
    of_body.iter().flatten().for_each(|one| has_seen[one.recording] = true);
    has_seen.iter().filter(|has_seen| **has_seen).count().clamp(2, LEAST_TRIALS)
}

/// What the recordings read, by body and time.
fn readings(
    observations: &[Observation],
    settings: &Settings,
    times_s: &[f64],
    interval_s: f64,
) -> Result<Array2<Vec<Reading>>, StitchingError> {
    let mut readings = Array2::from_shape_fn((settings.n_bodies, times_s.len()), |_| Vec::new());
    for (recording, observation) in observations.iter().enumerate() {
        let seen = observation.bodies.iter().filter(|track| track.position_m.iter().any(Option::is_some));
        let displacements: Vec<Displacement> = seen
            .map(|track| displacement_from_rest(observation, track, settings.rest_until_s))
            .collect::<Result<_, _>>()?;
        let resampled = Resampling::at(observation, times_s.iter().copied());
        for i in 0..times_s.len() {
            for displacement in &displacements {
                if let Some(read) = resampled.read(i, &displacement.samples) {
                    let n_shared = read.n_shared(interval_s);
                    readings[(displacement.row, i)].push(Reading { recording, read, n_shared });
                }
            }
        }
    }
    Ok(readings)
}

/// How far each recording lies off the means, in its trackers' sigmas, as a root mean square; 1 of one that is in none.
fn scatter_ratios(readings: &Array2<Vec<Reading>>, motion: &ChainMotion, n_recordings: usize) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); n_recordings];
    for (at, of_time) in readings.indexed_iter() {
        let Some(mean_m) = motion.displacement_m[at] else { continue };
        for one in of_time {
            let (squares, n) = &mut sums[one.recording];
            *squares += ((one.read.value - mean_m.value) / one.read.sigma).powi(2);
            *n += 1.0;
        }
    }
    sums.into_iter()
        .map(|(squares, n): (f64, f64)| if n > 0.0 { (squares / n).sqrt() } else { 1.0 })
        .collect()
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::BodyTrack;

    use super::*;
    use crate::phases::Aligned;

    /// A body that goes 4 mm, and in some trials snaps on by 3 mm more, at times of their own.
    fn trial(trial: u32, snaps_at_s: f64) -> Observation {
        let times_s: Vec<f64> = (-30..200).map(|frame| f64::from(frame) * 1e-4).collect();
        let step = |since_s: f64| (1.0 + (since_s / 1e-3).tanh()) / 2.0;
        let position = |t: &f64| {
            let moved_m = if *t < 0.0 { 0.0 } else { 4e-3 * step(t - 6e-3) + 3e-3 * step(t - snaps_at_s) };
            let noise_m = 1e-6 * ((t * 1e4).round() * f64::from(7 * trial) * 0.37).sin();
            Some(Estimate::new(moved_m + noise_m, 1e-6))
        };
        let bodies = vec![BodyTrack { body: 1, position_m: times_s.iter().map(position).collect() }];
        Observation { recording: format!("trial {trial}"), view: 1, trial, times_s, bodies }
    }

    const NEVER_S: f64 = 1.0;
    const SNAPS_S: [f64; 5] = [9e-3, NEVER_S, 14e-3, NEVER_S, 11e-3];

    #[test]
    fn a_mean_of_trials_has_the_error_of_one() {
        let observations: Vec<Observation> =
            (1..).zip(SNAPS_S).map(|(number, snaps_s)| trial(number, snaps_s)).collect();
        let settings = Settings::new(1, 1e-4);
        let aligned = Aligned::of(&observations, &settings, 1e-4).unwrap();
        let (merged, _) = aligned.ungauged().trimmed().unwrap().stitched().unwrap();
        let averaged = averaged_by_trigger(&observations, &settings, 1e-4, &merged).unwrap();
        // At the end three trials have gone 7 mm and two of them 4: on average 5.8, with a standard deviation of 1.643 mm about it.
        let last = averaged.motion.displacement_m.row(0).iter().flatten().last().copied().unwrap();
        // The steps have ended to a part in 1e4 of 3 mm.
        assert!((last.value - 5.8e-3).abs() < 1e-6, "{last:?}");
        // Student's t at 97.5 % with 4 degrees of freedom is 2.776; the expansion is off by 0.1 % there.
        let expected_m = 2.776 / Estimate::COVERAGE_95 * 1.643e-3 / 5.0_f64.sqrt();
        assert!((last.sigma / expected_m - 1.0).abs() < 3e-3, "{last:?}");
        assert_eq!(averaged.motion.modes.len(), 5);
        assert!(averaged.alignments.iter().all(|one| one.scatter_ratio > 100.0));
        assert!(averaged.warnings[0].contains("no smooth response"));
    }

    #[test]
    fn scatter_decides_where_all_recordings_are_tied() {
        let observations: Vec<Observation> = (1..6).map(|number| trial(number, NEVER_S)).collect();
        let mut merged = crate::merge(&observations, &Settings::new(1, 1e-4)).unwrap();
        assert!(merged.unsettled.is_none() && !is_contradicted(&merged, &observations, 1, 1e-4));
        merged.alignments.iter_mut().for_each(|one| one.scatter_ratio = 1.1 * SOUND_SCATTER);
        assert!(
            is_contradicted(&merged, &observations, 1, 1e-4)
                && !is_contradicted(&merged, &observations, 12, 1e-4)
        );
        // Of readings a hundred times as sure as much is a thirtieth of a micrometre, which no response follows.
        let mut sure = observations.clone();
        let readings =
            sure.iter_mut().flat_map(|one| &mut one.bodies).flat_map(|track| &mut track.position_m);
        readings.flatten().for_each(|x| x.sigma *= 0.01);
        assert!(!is_contradicted(&merged, &sure, 1, 1e-4));

        // What still moves by more than a trigger was known to before has aligned nothing, however well recordings agree.
        merged.alignments.iter_mut().for_each(|one| one.scatter_ratio = 1.0);
        let left = |offset_change_s: f64| {
            let phase = crate::AlignmentPhase::Onset;
            Some(crate::Unsettled { phase, rounds: 50, offset_change_s, drive_change: 1e-3 })
        };
        merged.unsettled = left(0.9e-4);
        assert!(!is_contradicted(&merged, &observations, 1, 1e-4));
        merged.unsettled = left(1.3e-4);
        assert!(
            is_contradicted(&merged, &observations, 1, 1e-4)
                && !is_contradicted(&merged, &observations, 12, 1e-4)
        );
    }

    fn averaged(observations: &[Observation]) -> Result<Stitched, StitchingError> {
        let settings = Settings { asks_for_clocks: true, ..Settings::new(1, 1e-4) };
        let aligned = Aligned::of(observations, &settings, 1e-4).unwrap();
        let (merged, _) = aligned.ungauged().trimmed().unwrap().stitched().unwrap();
        averaged_by_trigger(observations, &settings, 1e-4, &merged)
    }

    #[test]
    fn two_trials_that_contradict_each_other_leave_a_wide_mean_and_one_leaves_nothing() {
        let two = averaged(&[trial(1, NEVER_S), trial(2, 9e-3)]).unwrap();
        let last = two.motion.displacement_m.row(0).iter().flatten().last().copied().unwrap();
        // 4 and 7 mm: 5.5 on average, off by half their distance, 12.706 times which holds 95 %.
        assert!((last.value - 5.5e-3).abs() < 1e-6, "{last:?}");
        assert!((last.sigma / (12.706 / Estimate::COVERAGE_95 * 1.5e-3) - 1.0).abs() < 1e-3, "{last:?}");
        let said = averaged(&[trial(1, NEVER_S)]).unwrap_err().to_string();
        assert!(said.contains("trial 1"), "{said}");
    }

    #[test]
    fn nothing_of_the_alignment_that_was_given_up_is_told() {
        let mut seen: Vec<Observation> = (1..6).map(|number| trial(number, NEVER_S)).collect();
        seen[4].view = 2;
        let found = averaged(&seen).unwrap();
        let settings = Settings { asks_for_clocks: true, ..Settings::new(1, 1e-4) };
        let merged = crate::merge(&seen, &settings).unwrap();
        assert!(!merged.clocks.is_empty() && !merged.left_by_views.is_empty());
        assert!(found.shown.is_empty() && found.clocks.is_empty() && found.left_by_views.is_empty());
    }
}
