//! `chainwave import`: tracks that another program wrote, from their file to the wave.
//!
//! A mapping (TOML) says which numbers of a text file are the displacements of which body, or which program wrote the files, where that is
//! known. Its trials are aligned and merged as those of a recording are, and what follows needs no pictures: strain, leading pulse, group
//! velocity, spectra.

mod layout;
mod mapping;
mod numbers;
mod order;
mod program;
mod remarks;
mod tracks;

use std::collections::BTreeSet;
use std::num::NonZero;
use std::path::Path;

use chainwave_analysis::{FrontSettings, MeasureSettings, Measurement, Missing, measure};
use chainwave_experiment::{add_unresolved_motion, first_to_leave_rest};
use chainwave_measurement::{BodyTrack, Observation};
use chainwave_stitching::{Settings, Stitched, merge, outliers, take_out_wild};
use serde_json::json;

use self::layout::Layout;
use self::mapping::{Displacement, Mapping, Zero};
use self::numbers::Numbers;
use self::program::Program;
use self::remarks::{remarks, wild_remarks};
use self::tracks::{Spot, Track};
use crate::cli;
use crate::digits::{counted, with_sigma};
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::make_folder;
use crate::output::write_json;
use crate::parallel::threads;
use crate::run::{PROVENANCE, draw_motion, write_measurement};
use crate::run_files::RESULTS;
use crate::terminal::{say, tell};

/// Reads the trials of a mapping, merges and measures them, and writes tables, figures and `results.json`.
pub(crate) fn import(arguments: &cli::Import) -> Result<Outcome, Error> {
    let mapping = Mapping::read(&arguments.mapping)?;
    expect_no_run(&arguments.out)?;
    let beside = arguments.mapping.parent().unwrap_or(Path::new(""));
    let folder = arguments.data.as_deref().unwrap_or(beside);
    let mut outcome = Outcome::default();
    let mut observations = Vec::with_capacity(mapping.trials.len());
    for (trial, name) in (1..).zip(&mapping.trials) {
        match observation(&mapping, folder, name, trial) {
            Ok(observation) => observations.push(observation),
            Err(error) => outcome.fail(error),
        }
    }
    if observations.is_empty() {
        return Err(Error::nothing_left("trials", mapping.trials.len()));
    }
    let rest_until_s = mapping.time.rest_until_s;
    check_rest(&arguments.mapping, &observations, rest_until_s)?;
    let n_threads = threads(arguments.jobs);
    let settings = Settings { rest_until_s, n_threads, ..Settings::new(mapping.chain.n_bodies, 0.0) };
    let of_wild = wild_remarks(&take_out_wild(&mut observations), &observations);
    let left_out = outliers(&observations, &settings)?;
    for outlier in left_out.iter().rev() {
        observations.remove(outlier.index);
        outcome.fail(format!("{} was left out: {}", outlier.recording, outlier.evidence));
    }
    let of_rest = observations.iter().filter_map(|one| motion_at_rest(one, rest_until_s));
    let mut stitched = merge(&observations, &settings)?;
    stitched.warnings.extend(of_wild.into_iter().chain(of_rest));
    stitched.warnings.extend(add_unresolved_motion(&mut stitched.motion, &observations, rest_until_s));
    let measurement = measured(&mapping, &stitched, n_threads)?;
    stitched.warnings.extend(remarks(&observations, rest_until_s, &measurement));
    make_folder(&arguments.out)?;
    write_measurement(&arguments.out, &stitched, None, &measurement)?;
    draw_motion(&arguments.out, &mapping.name, &stitched.motion, &measurement)?;
    write_json(&arguments.out.join(RESULTS), &results(&stitched, &measurement))?;
    print(&mapping.name, &stitched, &measurement);
    Ok(outcome)
}

/// Refuses a folder with results of `run`: some of their files would be replaced, and others stay.
fn expect_no_run(folder: &Path) -> Result<(), Error> {
    match folder.join(PROVENANCE).exists() {
        true => Err(Error::Argument(format!(
            "{}: expected a folder without results of `chainwave run`, found {PROVENANCE} (hint: another --out)",
            folder.display()
        ))),
        false => Ok(()),
    }
}

/// Refuses a rest that no trial outlasts: nothing would be left to measure.
fn check_rest(mapping: &Path, observations: &[Observation], rest_until_s: f64) -> Result<(), Error> {
    let lasts_s =
        observations.iter().filter_map(|one| one.times_s.last()).fold(f64::NEG_INFINITY, |a, b| a.max(*b));
    match rest_until_s < lasts_s {
        true => Ok(()),
        false => {
            let expected = format!("a time before the last sample, at {lasts_s} s");
            Err(Error::place(mapping, "time.rest_until_s", &expected, &format!("{rest_until_s} s")))
        }
    }
}

/// What is to be said of a trial whose bodies move while they should rest.
fn motion_at_rest(observation: &Observation, rest_until_s: f64) -> Option<String> {
    let left = first_to_leave_rest(observation, rest_until_s)?;
    Some(format!(
        "{}: body {} moves by {:+.3e} m while the chain should rest; it begins at about {:.3} ms, before the rest ends at {:.3} ms: displacements count \
         from places that bodies have already left (hint: a time.rest_until_s before {:.2e})",
        observation.recording,
        left.body,
        left.by_m,
        1e3 * left.onset_s,
        1e3 * rest_until_s,
        left.onset_s
    ))
}

/// One trial's displacements on its own time base.
fn observation(mapping: &Mapping, folder: &Path, name: &Path, trial: u32) -> Result<Observation, Error> {
    let path = folder.join(name);
    let ImportedSamples { times_s, bodies } = match (mapping.program, &mapping.layout) {
        (Some(program), _) => of_program(mapping, program, &path)?,
        (None, Some(layout)) => of_columns(mapping, layout, &path)?,
        (None, None) => ImportedSamples::default(),
    };
    let zero_s = match (mapping.time.zero, bodies.first()) {
        (Zero::FirstBody, Some(first)) => half_way_s(&times_s, first)
            .ok_or_else(|| Error::place(&path, "body 1", "a motion past half of its way", "none"))?,
        _ => 0.0,
    };
    Ok(Observation {
        recording: name.display().to_string(),
        view: 1,
        trial,
        times_s: times_s.iter().map(|time_s| time_s - zero_s).collect(),
        bodies,
    })
}

/// What a file says: times as they are stated, and bodies in metres.
#[derive(Default)]
struct ImportedSamples {
    times_s: Vec<f64>,
    bodies: Vec<BodyTrack>,
}

/// A file whose columns (or lines) the mapping names.
fn of_columns(mapping: &Mapping, layout: &Layout, path: &Path) -> Result<ImportedSamples, Error> {
    let numbers = Numbers::read(path, layout)?;
    let of_body = |body: usize| -> Result<BodyTrack, Error> {
        let values = numbers.series(mapping.displacement.place(body))?;
        let sigmas = match &mapping.sigma.series {
            Some(series) => numbers.series(series.place(body))?,
            None => vec![Some(0.0); values.len()],
        };
        let position = |(value, sigma): (Option<f64>, Option<f64>)| {
            Some(mapping.position_m(value?, sigma? * mapping.sigma.unit_m.get()))
        };
        Ok(BodyTrack { body, position_m: values.into_iter().zip(sigmas).map(position).collect() })
    };
    let bodies = (1..=mapping.chain.n_bodies).map(of_body).collect::<Result<_, _>>()?;
    Ok(ImportedSamples { times_s: mapping.time.times_s(&numbers)?, bodies })
}

/// A file of a program that is known by name.
fn of_program(mapping: &Mapping, program: Program, path: &Path) -> Result<ImportedSamples, Error> {
    let Displacement { axis, unit_m, .. } = mapping.displacement;
    let names = mapping.tracks.as_deref();
    let (tracks, times_s) =
        program.read(path)?.of_bodies(path, mapping.chain.n_bodies, names, axis, unit_m < 0.0)?;
    let instants: BTreeSet<usize> = tracks.iter().flat_map(|track| track.spots.keys().copied()).collect();
    let missing = || Error::place(path, "its times", "some, or time.rate_hz in the mapping", "none");
    let time_s = |instant: &usize| match (&mapping.time.rate_hz, &times_s) {
        (Some(rate_hz), _) => Ok(*instant as f64 / rate_hz.get()),
        (None, Some(times_s)) => times_s.get(*instant).copied().ok_or_else(missing),
        (None, None) => Err(missing()),
    };
    let times_s = instants.iter().map(time_s).collect::<Result<_, _>>()?;
    let position = |spot: &Spot| {
        // A program's sigma is in the unit of its places.
        mapping.position_m(spot.along(axis), spot.sigma.map_or(0.0, |sigma| sigma * unit_m.abs()))
    };
    let body = |(row, track): (usize, &Track)| BodyTrack {
        body: row + 1,
        position_m: instants.iter().map(|instant| track.spots.get(instant).map(position)).collect(),
    };
    Ok(ImportedSamples { times_s, bodies: tracks.iter().enumerate().map(body).collect() })
}

/// When a body first passes half of its farthest displacement from where it began, linear between samples.
fn half_way_s(times_s: &[f64], track: &BodyTrack) -> Option<f64> {
    let seen: Vec<(f64, f64)> = times_s
        .iter()
        .zip(&track.position_m)
        .filter_map(|(time_s, position)| Some((*time_s, (*position)?.value)))
        .collect();
    let first = seen.first()?.1;
    let farthest = seen.iter().map(|(_, x)| (x - first).abs()).fold(0.0, f64::max);
    let past = |pair: &&[(f64, f64)]| (pair[1].1 - first).abs() > 0.5 * farthest;
    let pair = seen.windows(2).find(past)?;
    let [(t0, x0), (t1, x1)] = [pair[0], pair[1]].map(|(time_s, x)| (time_s, (x - first).abs()));
    Some(t0 + (0.5 * farthest - x0) / (x1 - x0) * (t1 - t0))
}

fn measured(mapping: &Mapping, stitched: &Stitched, n_threads: NonZero<usize>) -> Result<Measurement, Error> {
    let front = FrontSettings { edge_fraction: mapping.chain.edge_fraction, ..FrontSettings::default() };
    let settings = MeasureSettings {
        front,
        first_gap: mapping.chain.first_gap,
        end_reflects: mapping.end_reflects(),
        n_threads,
        velocity_gaps: mapping.chain.last_gap.map(|last| mapping.chain.first_gap..=last),
        ..MeasureSettings::new(mapping.chain.pitch_m.get(), 1)
    };
    Ok(measure(&stitched.motion, &settings, None)?)
}

fn results(stitched: &Stitched, measurement: &Measurement) -> serde_json::Value {
    let velocity = measurement.group_velocity.as_ref();
    let of = |value: fn(&chainwave_analysis::GroupVelocity) -> Option<f64>| velocity.ok().and_then(value);
    let trials = stitched.alignments.iter().map(|one| {
        json!({
            "file": one.recording,
            "trigger_offset_s": one.trigger_offset_s.value,
            "trigger_offset_sigma_s": one.trigger_offset_s.sigma,
            "drive_deviation": one.drive_deviation.value,
            "scatter_ratio": one.scatter_ratio,
        })
    });
    json!({
        "group_velocity_m_per_s": of(|velocity| Some(velocity.velocity_m_per_s.value)),
        "group_velocity_sigma": of(|velocity| Some(velocity.velocity_m_per_s.sigma)),
        "group_velocity_gaps": velocity.ok().map(|velocity| [velocity.gaps.0, velocity.gaps.1]),
        "group_velocity_residual_m": of(|velocity| Some(velocity.residual_m)),
        "group_velocity_variation": of(|velocity| Some(velocity.relative_variation?.value)),
        "group_velocity_variation_sigma": of(|velocity| Some(velocity.relative_variation?.sigma)),
        "failed": velocity.err().map(|reason| reason.as_str()),
        "trials": trials.collect::<Vec<_>>(),
        "warnings": stitched.warnings,
    })
}

fn print(name: &str, stitched: &Stitched, measurement: &Measurement) {
    say!("{name}: {}", counted(stitched.alignments.len(), "trial"));
    let velocity = measurement.group_velocity.as_ref().ok().map(|found| found.velocity_m_per_s);
    tell("n_trials", json!(stitched.alignments.len()));
    tell("group_velocity_m_per_s", json!(velocity.map(|velocity| velocity.value)));
    tell("group_velocity_sigma", json!(velocity.map(|velocity| velocity.sigma)));
    match &measurement.group_velocity {
        Ok(velocity) => say!(
            "group velocity {} m/s over gaps {} to {}, rms distance of the peaks from the line {:.2} mm",
            with_sigma(velocity.velocity_m_per_s),
            velocity.gaps.0,
            velocity.gaps.1,
            1e3 * velocity.residual_m
        ),
        Err(Missing::TooFewGaps) => {
            let n_peaks = measurement.fronts.iter().flatten().count();
            say!(
                "group velocity: {}: {n_peaks} of {} have a pulse, and 3 that the reflection has not reached are needed (hint: \
                 chain.first_gap, chain.last_gap and chain.end in the mapping)",
                Missing::TooFewGaps.as_str(),
                measurement.fronts.len()
            );
        }
        Err(reason) => say!("group velocity: {}", reason.as_str()),
    }
    for warning in &stitched.warnings {
        say!("warning: {warning}");
    }
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Estimate;

    use super::*;

    #[test]
    fn half_the_way_is_found_between_samples() {
        let position_m = [0.2, 0.2, 0.4, 1.2, 1.2].map(|x| Some(Estimate::new(x, 1e-3))).into();
        let track = BodyTrack { body: 1, position_m };
        // Half of 1.0 lies three eighths of the way from 0.2 to 1.0.
        let found_s = half_way_s(&[0.0, 1.0, 2.0, 3.0, 4.0], &track).unwrap();
        assert!((found_s - 2.375).abs() < 1e-12, "{found_s}");
        let lost = BodyTrack { body: 1, position_m: vec![None; 5] };
        assert!(half_way_s(&[0.0, 1.0, 2.0, 3.0, 4.0], &lost).is_none());
    }
}
