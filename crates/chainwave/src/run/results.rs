//! The tables of a run, `results.json` and `decisions.json`.

use std::path::Path;

use chainwave_analysis::{DampingShare, GroupVelocity, LocalResonance, Measurement, Missing};
use chainwave_experiment::{
    BEHIND_BODY_1, Evaluation, Finding, ModelBeside, PEAK_ENERGIES, RELEASE, RecordingAlignment,
    RecordingState, Results, Setup, SideMotion, State, StatedDamping, TRACKS, TrackRows, Tracked, Trial,
    dispersion_table, energy_table, front_table, half_width_table, motion_by_model_table, motion_table,
    pulse_table, spectrum_table, strain_table,
};
use chainwave_inference::{
    Damping, EnergyFit, FitError, FittedRecording, ImposedFit, Quantity, ReleasedFit, Structure, TrackFit,
};
use chainwave_measurement::Estimate;
use chainwave_stitching::{Alignment, Stitched};
use polars_core::prelude::Column;
use serde_json::{Map, Value, json};

use super::outputs;
use super::pulses::{collisions_as_json, pulses_as_json};
use crate::error::Error;
use crate::output::{remove, write_json};
use crate::table::{self, column};

/// Writes the tracks.
pub(crate) fn write_tracks(out: &Path, tracked: &Tracked) -> Result<(), Error> {
    let mut tracks = TrackRows::default();
    tracked.recordings.iter().for_each(|one| tracks.add_bodies(&one.trial.recording, &one.tracks));
    table::write_result(&out.join(outputs::TRACKS), tracks.table())
}

/// Writes `results.json` of tracks that could not be evaluated: the reason, and what contradicts the experiment. What an earlier run left
/// in its place goes, as it would be taken for this one's.
pub(crate) fn write_unsolved(
    out: &Path,
    findings: &[Finding],
    recordings: &[RecordingState],
    reason: &str,
) -> Result<(), Error> {
    outputs::remove_conclusions(out)?;
    let unsolved = Finding { code: "unsolved", subject: "the tracks".into(), text: reason.to_owned() };
    let warnings: Vec<Finding> =
        std::iter::once(unsolved).chain(failures(recordings)).chain(findings.iter().cloned()).collect();
    let mut results = Map::from_iter([
        ("warnings".into(), warnings_as_json(&warnings)),
        ("recordings".into(), states_as_json(recordings)),
    ]);
    let refused =
        ["group_velocity_m_per_s", "c_d_kg_per_s", "c_s_kg_per_s", "correlation", "local_resonance_hz"];
    results.extend(refused.map(|name| (format!("{name}_refused"), json!(reason))));
    write_json(&out.join(outputs::RESULTS), &Value::Object(results))
}

/// Writes every table of the interface but the tracks, `results.json` and `decisions.json`.
pub(crate) fn write(
    setup: &Setup,
    out: &Path,
    results: &Results,
    states: &[RecordingState],
) -> Result<(), Error> {
    let Results { tracked, evaluation, decisions, .. } = results;
    let measurement = &evaluation.measurement;
    write_measurement(out, &evaluation.stitched, Some(&evaluation.side_motion), measurement)?;
    write_by_model(out, evaluation)?;
    table::write_result(&out.join(outputs::ENERGY), energy_table(measurement))?;
    table::write_result(&out.join(outputs::PULSES), pulse_table(&evaluation.pulses))?;
    let limit_hz = 3.0 * setup.experiment.band_edge_hz()?;
    table::write_result(&out.join(outputs::DISPERSION), dispersion_table(limit_hz, measurement))?;
    write_alignment(out, tracked, evaluation)?;
    write_json(&out.join(outputs::RESULTS), &as_json(setup, evaluation, states))?;
    write_json(&out.join(outputs::DECISIONS), &decisions)
}

/// Writes the tables that follow from a motion alone.
pub(crate) fn write_measurement(
    folder: &Path,
    stitched: &Stitched,
    side_motion: Option<&SideMotion>,
    measurement: &Measurement,
) -> Result<(), Error> {
    let write = |name: &str, table| table::write_result(&folder.join(name), table);
    write(outputs::MOTION, motion_table(stitched, side_motion))?;
    write(outputs::STRAIN, strain_table(measurement))?;
    write(outputs::FRONT, front_table(measurement))?;
    write(outputs::HWHM, half_width_table(measurement))?;
    write(outputs::SPECTRUM, spectrum_table(measurement))
}

/// The motion aligned by the chain model; what an earlier run left goes where there is none.
fn write_by_model(folder: &Path, evaluation: &Evaluation) -> Result<(), Error> {
    let path = folder.join(outputs::MOTION_BY_MODEL);
    let Some(motion) = &evaluation.by_model else { return remove(&path) };
    let table = motion_by_model_table(motion, &evaluation.stitched, &evaluation.side_motion);
    table::write_result(&path, table)
}

/// Trigger offset, drive and stage of each recording, and what the fit found of its striker and impact.
fn write_alignment(folder: &Path, tracked: &Tracked, evaluation: &Evaluation) -> Result<(), Error> {
    let alignments = &evaluation.stitched.alignments;
    let fitted = |value: &dyn Fn(&FittedRecording) -> f64| -> Vec<Option<f64>> {
        let found =
            evaluation.track_fit.as_ref().ok().filter(|_| evaluation.damping.reason(TRACKS).is_none());
        // Those that the wave does not reach are no part of the fit.
        let of = |one: &Alignment| found?.recordings.iter().find(|fitted| fitted.recording == one.recording);
        alignments.iter().map(|one| of(one).map(value)).collect()
    };
    let is_struck = evaluation.track_fit.as_ref().is_ok_and(|fit| !fit.model.is_let_go());
    let of_striker = |value: &dyn Fn(&FittedRecording) -> f64| {
        if is_struck { fitted(value) } else { vec![None; alignments.len()] }
    };
    let of = |value: &dyn Fn(&Alignment) -> f64| alignments.iter().map(value).collect::<Vec<f64>>();
    let recording_alignments = &evaluation.recording_alignments;
    let stated = |value: &dyn Fn(&RecordingAlignment) -> f64| {
        recording_alignments.of_recordings.iter().map(value).collect::<Vec<f64>>()
    };
    let stated_drives: Vec<Option<Estimate>> =
        recording_alignments.of_recordings.iter().map(|aligned| aligned.drive_deviation).collect();
    // What is refused of the alignments is refused by the onset alone as well.
    let onset_drives: Vec<Option<Estimate>> = stated_drives
        .iter()
        .zip(alignments)
        .map(|(stated, one)| stated.and(Some(one.drive_deviation)))
        .collect();
    let values = |drives: &[Option<Estimate>]| {
        drives.iter().map(|drive| drive.map(|drive| drive.value)).collect::<Vec<_>>()
    };
    let sigmas = |drives: &[Option<Estimate>]| {
        drives.iter().map(|drive| drive.map(|drive| drive.sigma)).collect::<Vec<_>>()
    };
    let columns = vec![
        column("recording", alignments.iter().map(|one| one.recording.as_str()).collect::<Vec<_>>()),
        column("view", alignments.iter().map(|one| one.view).collect::<Vec<_>>()),
        column("trial", alignments.iter().map(|one| one.trial).collect::<Vec<_>>()),
        column("trigger_offset_s", stated(&|one| one.trigger_offset_s.value)),
        column("trigger_offset_sigma_s", stated(&|one| one.trigger_offset_s.sigma)),
        column("drive_deviation", values(&stated_drives)),
        column("drive_deviation_sigma", sigmas(&stated_drives)),
        column("offset_and_drive_from", vec![recording_alignments.source; alignments.len()]),
        column("onset_trigger_offset_s", of(&|one| one.trigger_offset_s.value)),
        column("onset_trigger_offset_sigma_s", of(&|one| one.trigger_offset_s.sigma)),
        column("onset_drive_deviation", values(&onset_drives)),
        column("onset_drive_deviation_sigma", sigmas(&onset_drives)),
        column("scatter_ratio", of(&|one| one.scatter_ratio)),
        column("striker_velocity_m_per_s", of_striker(&|one| one.striker_velocity_m_per_s.value)),
        column("striker_velocity_sigma", of_striker(&|one| one.striker_velocity_m_per_s.sigma)),
        column("impact_time_s", fitted(&|one| one.impact_time_s.value)),
        column("impact_time_sigma_s", fitted(&|one| one.impact_time_s.sigma)),
        column("model_scatter_ratio", fitted(&|one| one.scatter_ratio)),
    ];
    let stages = stage_columns(tracked, alignments);
    table::write(&folder.join(outputs::ALIGNMENT), columns.into_iter().chain(stages).collect())
}

/// Where the stage stood by the experiment, and by the bodies that views share; empty where nothing ties a view to another.
fn stage_columns(tracked: &Tracked, alignments: &[Alignment]) -> [Column; 3] {
    let trials = || tracked.recordings.iter().map(|recording| &recording.trial);
    let trial = |one: &Alignment| trials().find(|trial| trial.recording == one.recording);
    let trials: Vec<Option<&Trial>> = alignments.iter().map(trial).collect();
    let refined = |value: fn(Estimate) -> f64| -> Vec<Option<f64>> {
        trials.iter().map(|trial| tracked.stages.refined_m((*trial)?).map(value)).collect()
    };
    [
        column("stage_m", trials.iter().map(|trial| Some((*trial)?.stage_m)).collect::<Vec<_>>()),
        column("stage_refined_m", refined(|stage| stage.value)),
        column("stage_refined_sigma_m", refined(|stage| stage.sigma)),
    ]
}

fn as_json(setup: &Setup, evaluation: &Evaluation, states: &[RecordingState]) -> Value {
    let measurement = &evaluation.measurement;
    let mut results = Map::new();
    let velocity = measurement.group_velocity.as_ref().map(|velocity| velocity.velocity_m_per_s);
    put_or_refuse(
        &mut results,
        ("group_velocity_m_per_s", "group_velocity_sigma"),
        velocity.as_ref().map_err(|missing| missing.as_str()),
    );
    let damping = &evaluation.damping;
    put_or_refuse(
        &mut results,
        ("c_d_kg_per_s", "c_d_sigma"),
        damping.chain_damping_kg_per_s.as_ref().map_err(String::as_str),
    );
    put_or_refuse(
        &mut results,
        ("c_s_kg_per_s", "c_s_sigma"),
        damping.striker_damping_kg_per_s.as_ref().map_err(String::as_str),
    );
    let (key, correlation) = correlation_of(damping);
    results.insert(key.into(), correlation);
    results.insert("damping_from".into(), json!(damping.source));
    let resonance = measurement.local_resonance.as_ref().map(LocalResonance::of_chain_hz);
    put_or_refuse(
        &mut results,
        ("local_resonance_hz", "local_resonance_sigma"),
        resonance.as_ref().map_err(|missing| missing.as_str()),
    );
    let told = measurement.local_resonance.as_ref().ok().map(resonance_as_json);
    results.insert("local_resonance".into(), json!(told));
    let of_loss = evaluation.model.as_ref().and_then(ModelBeside::damping_share).map(share_as_json);
    results.insert("loss_of_peak_energy".into(), json!(of_loss));
    let gaps = measurement.group_velocity.as_ref().ok().map(|velocity| [velocity.gaps.0, velocity.gaps.1]);
    results.insert("group_velocity_gaps".into(), json!(gaps));
    put_beside_group_velocity(&mut results, measurement);
    let fits = [
        (
            "fit_to_tracks",
            TRACKS,
            evaluation.track_fit.as_ref().map(|fit| track_fit_as_json(fit, evaluation)),
        ),
        (
            "fit_to_peak_energies",
            PEAK_ENERGIES,
            evaluation.energy_fit.as_ref().map(|fit| energy_fit_as_json(fit, evaluation)),
        ),
        ("fit_behind_body_1", BEHIND_BODY_1, evaluation.imposed_fit.as_ref().map(imposed_fit_as_json)),
    ];
    let of_release = evaluation.release_fit.as_ref();
    let of_release =
        of_release.map(|fit| ("fit_to_release", RELEASE, fit.as_ref().map(released_fit_as_json)));
    for (key, source, fit) in fits.into_iter().chain(of_release) {
        let fit = fit.map_or_else(failed, |fit| unless_refused(fit, damping.reason(source)));
        results.insert(key.into(), Value::Object(fit));
    }
    if setup.experiment.analysis.pulses {
        results.insert("pulses".into(), pulses_as_json(&evaluation.pulses));
        results.insert("pulse_collisions".into(), collisions_as_json(&evaluation.pulses));
    } else {
        results.insert("pulses_refused".into(), json!("not asked for (analysis.pulses = false)"));
    }
    let warnings: Vec<Finding> = failures(states).chain(evaluation.warnings()).collect();
    results.insert("warnings".into(), warnings_as_json(&warnings));
    results.insert("recordings".into(), states_as_json(states));
    Value::Object(results)
}

/// The correlation of c_d and c_s, or why there is none: one of them was refused.
fn correlation_of(damping: &StatedDamping) -> (&'static str, Value) {
    match damping.refusals().first() {
        Some((_, reason)) if damping.correlation.is_none() => ("correlation_refused", json!(reason)),
        _ => ("correlation", json!(damping.correlation)),
    }
}

/// Recordings that could not be used, as warnings.
fn failures(states: &[RecordingState]) -> impl Iterator<Item = Finding> {
    states.iter().filter(|one| one.state == State::Failed).map(|one| Finding {
        code: "failed",
        subject: one.recording.clone(),
        text: one.reason.clone().unwrap_or_else(|| "it could not be used".into()),
    })
}

/// What the reader should know, each with its kind in a word and what it is about.
pub(crate) fn warnings_as_json(warnings: &[Finding]) -> Value {
    let of = |one: &Finding| json!({ "code": one.code, "subject": one.subject, "text": one.text });
    warnings.iter().map(of).collect()
}

/// Writes `recordings.csv`: every recording with what became of it, of all striker velocities.
pub(crate) fn write_states(out: &Path, states: &[RecordingState]) -> Result<(), Error> {
    let texts = |of: &dyn Fn(&RecordingState) -> String| states.iter().map(of).collect::<Vec<_>>();
    let columns = vec![
        column("recording", texts(&|one| one.recording.clone())),
        column("view", states.iter().map(|one| one.view).collect::<Vec<_>>()),
        column("trial", states.iter().map(|one| one.trial).collect::<Vec<_>>()),
        column("state", texts(&|one| one.state.as_str().to_owned())),
        column("reason", states.iter().map(|one| one.reason.clone()).collect::<Vec<_>>()),
    ];
    table::write(&out.join(outputs::RECORDINGS), columns)
}

/// What became of each recording.
pub(crate) fn states_as_json(states: &[RecordingState]) -> Value {
    let of = |one: &RecordingState| {
        json!({
            "recording": one.recording,
            "view": one.view,
            "trial": one.trial,
            "state": one.state.as_str(),
            "reason": one.reason,
        })
    };
    states.iter().map(of).collect()
}

fn resonance_as_json(resonance: &LocalResonance) -> Value {
    json!({
        "sigma_by_noise_hz": resonance.frequency_hz.sigma,
        "resolution_hz": resonance.resolution_hz,
        "line_p_value": resonance.line.p_value,
        "line_half_bandwidth_hz": resonance.line.half_bandwidth_hz,
        "line_n_gaps": resonance.line.n_gaps,
    })
}

/// Shares of the peak energy that gap 1 would take up without damping.
fn share_as_json(share: DampingShare) -> Value {
    json!({
        "gap": share.gap,
        "dispersion_and_rarefaction": share.spread,
        "damping": share.damped,
        "remaining": share.remaining,
    })
}

/// An estimate as two keys, both null where there is none.
fn put(results: &mut Map<String, Value>, name: &str, sigma_name: &str, estimate: Option<Estimate>) {
    results.insert(name.into(), json!(estimate.map(|estimate| estimate.value)));
    results.insert(sigma_name.into(), json!(estimate.map(|estimate| estimate.sigma)));
}

/// What a fit made of the quantities that are known within an uncertainty.
fn put_factors(results: &mut Map<String, Value>, factors: &[(Quantity, Estimate)]) {
    for (quantity, factor) in factors {
        let name = quantity.name();
        put(results, &format!("{name}_factor"), &format!("{name}_factor_sigma"), Some(*factor));
    }
}

fn put_goodness(
    results: &mut Map<String, Value>,
    reduced_chi_squared: f64,
    n_residuals: usize,
    n_simulations: u64,
) {
    results.insert("reduced_chi_squared".into(), json!(reduced_chi_squared));
    results.insert("n_residuals".into(), json!(n_residuals));
    results.insert("n_simulations".into(), json!(n_simulations));
}

/// An estimate as two keys, or the reason why it is refused under a key of its own.
fn put_or_refuse(
    results: &mut Map<String, Value>,
    (name, sigma_name): (&str, &str),
    estimate: Result<&Estimate, &str>,
) {
    match estimate {
        Ok(estimate) => put(results, name, sigma_name, Some(*estimate)),
        Err(reason) => {
            results.insert(format!("{name}_refused"), json!(reason));
        }
    }
}

/// The variation of the group velocity, and the bodies' velocity.
fn put_beside_group_velocity(results: &mut Map<String, Value>, measurement: &Measurement) {
    let variation = of_velocity(measurement, |velocity| velocity.relative_variation, "fewer than six gaps");
    let names = ("group_velocity_variation", "group_velocity_variation_sigma");
    put_or_refuse(results, names, variation.as_ref().map_err(|reason| *reason));
    let otherwise = Missing::TooFewSamples.as_str();
    let particle = of_velocity(measurement, |velocity| velocity.particle_velocity_m_per_s, otherwise);
    let names = ("particle_velocity_m_per_s", "particle_velocity_sigma");
    put_or_refuse(results, names, particle.as_ref().map_err(|reason| *reason));
}

/// What stands beside the group velocity, or why it does not: the velocity's own reason, or what it takes more than that.
fn of_velocity<'a>(
    measurement: &'a Measurement,
    value: fn(&GroupVelocity) -> Option<Estimate>,
    otherwise: &'a str,
) -> Result<Estimate, &'a str> {
    let velocity = measurement.group_velocity.as_ref().map_err(|missing| missing.as_str())?;
    value(velocity).ok_or(otherwise)
}

fn failed(reason: &FitError) -> Map<String, Value> {
    Map::from_iter([("failed".into(), json!(reason.to_string()))])
}

/// What remains of a fit that is refused: the reason, and how well it describes what it was fitted to.
fn unless_refused(fit: Map<String, Value>, reason: Option<&str>) -> Map<String, Value> {
    const OF_ANY_FIT: [&str; 6] =
        ["reduced_chi_squared", "n_residuals", "n_simulations", "structure", "structure_as_stated", "c_s"];
    let Some(reason) = reason else { return fit };
    let kept = fit.into_iter().filter(|(key, _)| OF_ANY_FIT.contains(&key.as_str()));
    std::iter::once(("refused".to_owned(), json!(reason))).chain(kept).collect()
}

fn damping_as_json(damping: &Damping, evaluation: &Evaluation) -> Map<String, Value> {
    let mut results = Map::new();
    let [of_chain, of_striker] = damping.refusals(evaluation.damping.critical_kg_per_s);
    let told = |found: Estimate, refused: Option<String>| refused.map_or(Ok(found), Err);
    let c_d = told(damping.chain_damping_kg_per_s, of_chain);
    let c_s = told(damping.striker_damping_kg_per_s, of_striker);
    put_or_refuse(&mut results, ("c_d_kg_per_s", "c_d_sigma"), c_d.as_ref().map_err(String::as_str));
    put_or_refuse(&mut results, ("c_s_kg_per_s", "c_s_sigma"), c_s.as_ref().map_err(String::as_str));
    results.insert("correlation".into(), json!(damping.correlation));
    results
}

fn structure_as_json(found: &Structure) -> Value {
    json!({
        "variance_ratio": found.ratio,
        "degrees_of_freedom": [found.degrees_of_freedom.0, found.degrees_of_freedom.1],
        "p_value": found.p_value,
        "size": found.size,
        "size_in_tracks": found.size_in_tracks,
        "bodies": found.bodies.iter().map(|(body, _)| body).collect::<Vec<_>>(),
        "worst_s": [found.worst_s.0, found.worst_s.1],
    })
}

fn track_fit_as_json(fit: &TrackFit, evaluation: &Evaluation) -> Map<String, Value> {
    let is_struck = !fit.model.is_let_go();
    let mut results = damping_as_json(&fit.damping, evaluation);
    if !is_struck {
        results.retain(|key, _| !key.starts_with("c_s") && key != "correlation");
        results.insert("c_s".into(), json!(ReleasedFit::NO_STRIKER_DAMPING));
    }
    // What is told of c_s, behind what is told of c_d.
    let n_told = if is_struck { 2 } else { 1 };
    results.insert("structure".into(), structure_as_json(&fit.structure));
    if !fit.beyond.is_empty() {
        let causes: Vec<&str> = fit.beyond.iter().map(|one| one.in_words()).collect();
        results.insert("as_if".into(), json!(causes));
        results.insert("structure_as_stated".into(), structure_as_json(&fit.as_stated));
        for (quantity, found) in &fit.found {
            let name = quantity.name();
            put(&mut results, &format!("{name}_found"), &format!("{name}_found_sigma"), Some(*found));
        }
    }
    let intervals = ["c_d_interval_95", "c_s_interval_95"].into_iter().zip(fit.intervals_95);
    for (name, interval) in intervals.take(n_told) {
        let told =
            json!({ "low": interval.low, "high": interval.high, "is_quadratic": interval.is_quadratic });
        results.insert(name.into(), told);
    }
    let values = [fit.damping.chain_damping_kg_per_s.value, fit.damping.striker_damping_kg_per_s.value];
    let over_trials = fit.bootstrap.iter().flatten().take(n_told);
    for ((name, value), found) in ["c_d_bootstrap", "c_s_bootstrap"].into_iter().zip(values).zip(over_trials)
    {
        let (low, high) = found.interval_95(value);
        let told = json!({ "sigma": found.sigma, "degrees_of_freedom": found.degrees_of_freedom, "low_95": low, "high_95": high });
        results.insert(name.into(), told);
    }
    results.insert("starts_at_this_minimum".into(), json!(fit.starts.0));
    results.insert("starts".into(), json!(fit.starts.1));
    let [drive, drive_sigma, start, start_sigma] = match is_struck {
        true => ["striker_velocity_m_per_s", "striker_velocity_sigma", "impact_time_s", "impact_time_sigma"],
        false => ["state", "state_sigma", "release_time_s", "release_time_sigma"],
    };
    put(&mut results, drive, drive_sigma, Some(fit.striker_velocity_m_per_s));
    put(&mut results, start, start_sigma, Some(fit.impact_time_s));
    put_factors(&mut results, &fit.factors);
    put_goodness(&mut results, fit.reduced_chi_squared, fit.n_residuals, fit.n_simulations);
    results
}

fn imposed_fit_as_json(fit: &ImposedFit) -> Map<String, Value> {
    let mut results = Map::new();
    put(&mut results, "c_d_kg_per_s", "c_d_sigma", Some(fit.chain_damping_kg_per_s));
    results.insert("c_s".into(), json!(ImposedFit::NO_STRIKER_DAMPING));
    put_factors(&mut results, &fit.factors);
    put_goodness(&mut results, fit.reduced_chi_squared, fit.n_residuals, fit.n_simulations);
    results
}

fn released_fit_as_json(fit: &ReleasedFit) -> Map<String, Value> {
    let mut results = Map::new();
    put(&mut results, "c_d_kg_per_s", "c_d_sigma", Some(fit.chain_damping_kg_per_s));
    put(&mut results, "release_time_s", "release_time_sigma", Some(fit.release_time_s));
    put(&mut results, "state", "state_sigma", Some(fit.state));
    put_factors(&mut results, &fit.factors);
    put_goodness(&mut results, fit.reduced_chi_squared, fit.n_residuals, fit.n_simulations);
    results
}

fn energy_fit_as_json(fit: &EnergyFit, evaluation: &Evaluation) -> Map<String, Value> {
    let mut results = damping_as_json(&fit.damping, evaluation);
    let velocity = Some(fit.striker_velocity_m_per_s);
    put(&mut results, "striker_velocity_m_per_s", "striker_velocity_sigma", velocity);
    put_factors(&mut results, &fit.factors);
    put_goodness(&mut results, fit.reduced_chi_squared, fit.n_residuals, fit.n_simulations);
    results
}
