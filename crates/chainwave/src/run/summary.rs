//! The summary on one screen, and its rows, which the report has too.

use std::path::Path;

use chainwave_experiment::{
    BEHIND_BODY_1, Evaluation, KnownTruth, PEAK_ENERGIES, RELEASE, RecordingState, Results, Setup, State,
    TRACKS,
};
use chainwave_inference::{Damping, FitError};
use chainwave_measurement::Estimate;

use super::Clock;
use crate::terminal::say;

/// Prints lines.
pub(crate) fn print_lines(lines: impl IntoIterator<Item = String>) {
    lines.into_iter().for_each(|line| say!("{line}"));
}

/// Prints how many recordings a share tracked.
pub(crate) fn print_share(setup: &Setup, n_tracked: usize) {
    say!("{}: {n_tracked} of {} recordings tracked", setup.experiment.name, setup.trials.len());
}

/// Prints how many recordings the results have, and which they do not have.
pub(crate) fn print_states(out: &Path, states: &[RecordingState]) {
    let count = |state: State| states.iter().filter(|one| one.state == state).count();
    let [used, left_out, failed] = [State::Used, State::LeftOut, State::Failed].map(count);
    for one in states.iter().filter(|one| one.state != State::Used) {
        let reason = one.reason.as_deref().unwrap_or("no reason is known");
        say!("{} {}: {reason}", one.recording, one.state.as_str());
    }
    let list = out.join("recordings.csv");
    say!(
        "{} recordings: {used} used, {left_out} left out, {failed} failed; each in {}",
        states.len(),
        list.display()
    );
}

/// Prints what was measured on one screen: values with uncertainties, the truth beside where it is known, the time that each
/// stage took, and where the figures are.
pub(crate) fn print(setup: &Setup, out: &Path, results: &Results, clock: &Clock) {
    let Results { evaluation, truth, .. } = results;
    say!("{}: {} recordings", setup.experiment.name, evaluation.stitched.alignments.len());
    say!("{:<34}{:>12} {:>11}{:>13}{:>9}", "", "measured", "sigma", "truth", "off by");
    for row in rows(evaluation, truth.as_ref()) {
        say!("{}", row.as_text());
    }
    if let Some(truth) = truth {
        let rms_px = truth.motion_rms_m / setup.map.m_per_px().value;
        say!(
            "x_n(t): rms error {:.3} um = {rms_px:.4} px; the 95 % intervals hold {:.1} % of the truth",
            1e6 * truth.motion_rms_m,
            100.0 * truth.motion_coverage
        );
    }
    for warning in &evaluation.warnings() {
        say!("warning: {warning}");
    }
    for (name, seconds) in clock.stages() {
        say!("{seconds:8.2} s  {name}");
    }
    say!("figures in {}, report in {}", out.join("figures").display(), out.join("report.html").display());
}

/// One measured quantity in the unit of the summary.
pub(crate) struct Row {
    /// Name and unit.
    pub(crate) name: String,
    /// Value, or the reason why there is none.
    pub(crate) measured: Result<Estimate, String>,
    /// The truth, where it is known.
    pub(crate) truth: Option<f64>,
}

impl Row {
    fn as_text(&self) -> String {
        let estimate = match &self.measured {
            Ok(estimate) => estimate,
            Err(reason) => return format!("{:<34}{reason}", self.name),
        };
        let beside = self.truth.map_or_else(String::new, |truth| {
            let off = (estimate.value - truth) / estimate.sigma;
            format!("{truth:>13.5}{off:>+7.2} s")
        });
        format!("{:<34}{:>12.5} {:>11.5}{beside}", self.name, estimate.value, estimate.sigma)
    }
}

/// The quantities of the summary and the report.
pub(crate) fn rows(evaluation: &Evaluation, truth: Option<&KnownTruth>) -> Vec<Row> {
    let measurement = &evaluation.measurement;
    let of_truth = |value: &dyn Fn(&KnownTruth) -> Option<f64>| truth.and_then(value);
    let row = |name: &str, measured: Result<Estimate, String>, factor: f64, truth: Option<f64>| Row {
        name: name.into(),
        measured: measured.map(|estimate| estimate.scaled(factor)),
        truth: truth.map(|value| value * factor),
    };
    let velocity = |m: &chainwave_analysis::Measurement| match &m.group_velocity {
        Ok(velocity) => Ok(velocity.velocity_m_per_s),
        Err(reason) => Err(reason.as_str().to_owned()),
    };
    let last_width = measurement.half_widths.last();
    let resonance = measurement.local_resonance.as_ref().map(|resonance| resonance.frequency_hz);
    let mut rows = vec![
        row(
            "group velocity (m/s)",
            velocity(measurement),
            1.0,
            of_truth(&|truth| velocity(&truth.measurement).ok().map(|estimate| estimate.value)),
        ),
        row(
            "HWHM of the front, last (mm)",
            last_width.map(|width| width.hwhm_m).ok_or_else(|| "front not seen".into()),
            1e3,
            of_truth(&|truth| {
                let at = last_width?.t_s;
                let same = truth.measurement.half_widths.iter().find(|width| (width.t_s - at).abs() < 1e-9);
                same.map(|width| width.hwhm_m.value)
            }),
        ),
        row(
            "dominant tail frequency (Hz)",
            resonance.map_err(|reason| reason.as_str().to_owned()),
            1.0,
            of_truth(&|truth| Some(truth.measurement.local_resonance.as_ref().ok()?.frequency_hz.value)),
        ),
    ];
    rows.extend(energy_rows(evaluation, truth));
    let stated = &evaluation.damping;
    let told = |source: &str, fit: Result<Damping, &FitError>| match (fit, stated.reason(source)) {
        (Err(why), _) => Err(why.to_string()),
        (_, Some(reason)) => Err(format!("refused: {reason}")),
        (Ok(damping), None) => Ok(damping),
    };
    let of_tracks = told(TRACKS, evaluation.track_fit.as_ref().map(|fit| fit.damping));
    let of_energies = told(PEAK_ENERGIES, evaluation.energy_fit.as_ref().map(|fit| fit.damping));
    let critical = stated.critical_kg_per_s;
    rows.extend(fit_rows(TRACKS, &of_tracks, critical, truth));
    rows.extend(fit_rows(PEAK_ENERGIES, &of_energies, critical, truth));
    if let Some(source) = stated.source.filter(|source| [BEHIND_BODY_1, RELEASE].contains(source)) {
        let c_d = stated.chain_damping_kg_per_s.clone();
        let name = format!("c_d (g/s), {source}");
        rows.push(row(&name, c_d, 1e3, of_truth(&|truth| Some(truth.chain_damping_kg_per_s))));
    }
    rows
}

/// Peak potential energy where the wave is still free of the far end: half way down the chain, relative to gap 1.
fn energy_rows(evaluation: &Evaluation, truth: Option<&KnownTruth>) -> Option<Row> {
    let energies = evaluation.measurement.energies.as_ref()?;
    let relative = energies.relative.as_ref()?;
    let gap = energies.gaps.len().div_ceil(2);
    let index = energies.gaps.iter().position(|found| *found == gap)?;
    let true_value = truth.and_then(|truth| {
        let energies = truth.measurement.energies.as_ref()?;
        let index = energies.gaps.iter().position(|found| *found == gap)?;
        Some(energies.relative.as_ref()?.get(index)?.value)
    });
    Some(Row {
        name: format!("Psi_max({gap}) / Psi_max(1)"),
        measured: Ok(relative[index]),
        truth: true_value,
    })
}

fn fit_rows(
    source: &str,
    damping: &Result<Damping, String>,
    critical_kg_per_s: f64,
    truth: Option<&KnownTruth>,
) -> Vec<Row> {
    let of = |name: &str, which: usize, factor: f64, truth: Option<f64>| {
        let measured = damping.as_ref().map_err(Clone::clone).and_then(|damping| {
            let found = [damping.chain_damping_kg_per_s, damping.striker_damping_kg_per_s][which];
            let [of_chain, of_striker] = damping.refusals(critical_kg_per_s);
            match [of_chain, of_striker].into_iter().nth(which).flatten() {
                Some(reason) => Err(format!("refused: {reason}")),
                None => Ok(found.scaled(factor)),
            }
        });
        Row { name: format!("{name}, {source}"), measured, truth: truth.map(|value| value * factor) }
    };
    vec![
        of("c_d (g/s)", 0, 1e3, truth.map(|truth| truth.chain_damping_kg_per_s)),
        of("c_s (kg/s)", 1, 1.0, truth.map(|truth| truth.striker_damping_kg_per_s)),
    ]
}
