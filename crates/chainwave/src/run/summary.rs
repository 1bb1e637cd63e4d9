//! The summary on one screen, and its rows, which the report has too.

use std::path::Path;

use chainwave_experiment::{
    BEHIND_BODY_1, Evaluation, ITS_C_D, KnownTruth, PEAK_ENERGIES, RELEASE, RecordingState, Results, Setup,
    State, TRACKS,
};
use chainwave_inference::{Damping, FitError};
use chainwave_measurement::Estimate;

use super::outputs::{RECORDINGS, REPORT};
use super::stage_times::StageTimes;
use crate::digits::{counted, decimals};
use crate::output::FIGURES_FOLDER;
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
    let list = out.join(RECORDINGS);
    say!(
        "{}: {used} used, {left_out} left out, {failed} failed; each in {}",
        counted(states.len(), "recording"),
        list.display()
    );
}

/// Prints what was measured on one screen: values with uncertainties, the truth beside where it is known, the time that each
/// stage took, and where the figures are.
pub(crate) fn print(setup: &Setup, out: &Path, results: &Results, clock: &StageTimes) {
    let Results { evaluation, truth, .. } = results;
    let n_recordings = evaluation.stitched.alignments.len();
    say!("{}: {}", setup.experiment.name, counted(n_recordings, "recording"));
    say!("{}", head(truth.is_some()));
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
    say!("figures in {}, report in {}", out.join(FIGURES_FOLDER).display(), out.join(REPORT).display());
}

/// What stands above the rows; the truth has columns where it is known.
fn head(is_truth_known: bool) -> String {
    let beside = if is_truth_known { format!("{:>13}{:>9}", "truth", "off by") } else { String::new() };
    format!("{:<34}{:>12} {:>11}{beside}", "", "measured", "sigma")
}

/// One measured quantity in the unit of the summary.
pub(crate) struct SummaryRow {
    /// Name and unit.
    pub(crate) name: String,
    /// Value, or the reason why there is none.
    pub(crate) measured: Result<Estimate, String>,
    /// The truth, where it is known.
    pub(crate) truth: Option<f64>,
}

impl SummaryRow {
    fn as_text(&self) -> String {
        let estimate = match &self.measured {
            Ok(estimate) => estimate,
            Err(reason) => return format!("{:<34}{reason}", self.name),
        };
        let digits = decimals(estimate.sigma);
        let beside = self.truth.map_or_else(String::new, |truth| {
            let off = (estimate.value - truth) / estimate.sigma;
            format!("{truth:>13.digits$}{off:>+7.2} s")
        });
        format!("{:<34}{:>12.digits$} {:>11.digits$}{beside}", self.name, estimate.value, estimate.sigma)
    }
}

/// The quantities of the summary and the report.
pub(crate) fn rows(evaluation: &Evaluation, truth: Option<&KnownTruth>) -> Vec<SummaryRow> {
    let measurement = &evaluation.measurement;
    let of_truth = |value: &dyn Fn(&KnownTruth) -> Option<f64>| truth.and_then(value);
    let row = |name: &str, measured: Result<Estimate, String>, factor: f64, truth: Option<f64>| SummaryRow {
        name: name.into(),
        measured: measured.map(|estimate| estimate.scaled(factor)),
        truth: truth.map(|value| value * factor),
    };
    let velocity = |m: &chainwave_analysis::Measurement| match &m.group_velocity {
        Ok(velocity) => Ok(velocity.velocity_m_per_s),
        Err(reason) => Err(reason.as_str().to_owned()),
    };
    let last_width = measurement.half_widths.last();
    let resonance = measurement.local_resonance.as_ref().map(|resonance| resonance.of_chain_hz());
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
    let of_fits = [
        (TRACKS, evaluation.track_fit.as_ref().map(|fit| fit.damping)),
        (PEAK_ENERGIES, evaluation.energy_fit.as_ref().map(|fit| fit.damping)),
    ];
    for (source, damping) in of_fits {
        let fit = Fit { source, damping, refused: stated.reason(source) };
        let [c_d, c_s] = fit.rows(stated.critical_kg_per_s, truth);
        rows.push(c_d);
        // A chain that is let go has no striker.
        if evaluation.release_fit.is_none() {
            rows.push(c_s);
        }
    }
    if let Some(source) = stated.source.filter(|source| [BEHIND_BODY_1, RELEASE].contains(source)) {
        let c_d = stated.chain_damping_kg_per_s.clone();
        let name = format!("c_d (g/s), {source}");
        rows.push(row(&name, c_d, 1e3, of_truth(&|truth| Some(truth.chain_damping_kg_per_s))));
    }
    rows
}

/// Peak potential energy where the wave is still free of the far end: half way down the chain, relative to gap 1.
fn energy_rows(evaluation: &Evaluation, truth: Option<&KnownTruth>) -> Option<SummaryRow> {
    let energies = evaluation.measurement.energies.as_ref()?;
    let relative = energies.relative.as_ref()?;
    let gap = energies.gaps.len().div_ceil(2);
    let index = energies.gaps.iter().position(|found| *found == gap)?;
    let true_value = truth.and_then(|truth| {
        let energies = truth.measurement.energies.as_ref()?;
        let index = energies.gaps.iter().position(|found| *found == gap)?;
        Some(energies.relative.as_ref()?.get(index)?.value)
    });
    Some(SummaryRow {
        name: format!("Psi_max({gap}) / Psi_max(1)"),
        measured: Ok(relative[index]),
        truth: true_value,
    })
}

/// What a fit says of the dampings.
struct Fit<'a> {
    source: &'static str,
    damping: Result<Damping, &'a FitError>,
    /// Why the whole of it is refused, where it is.
    refused: Option<&'a str>,
}

impl Fit<'_> {
    fn rows(&self, critical_kg_per_s: f64, truth: Option<&KnownTruth>) -> [SummaryRow; 2] {
        let row = |name: &str, found: Result<Estimate, String>, factor: f64, truth: Option<f64>| SummaryRow {
            name: format!("{name}, {}", self.source),
            measured: found.map(|found| found.scaled(factor)),
            truth: truth.map(|value| value * factor),
        };
        let [c_d, c_s] = self.told(critical_kg_per_s);
        [
            row("c_d (g/s)", c_d, 1e3, truth.map(|truth| truth.chain_damping_kg_per_s)),
            row("c_s (kg/s)", c_s, 1.0, truth.map(|truth| truth.striker_damping_kg_per_s)),
        ]
    }

    /// c_d and c_s, or why each is none. Where the whole fit is refused for its c_d, that of c_d is its own reason.
    fn told(&self, critical_kg_per_s: f64) -> [Result<Estimate, String>; 2] {
        let refused = |reason: &str| Err(format!("refused: {reason}"));
        match (&self.damping, self.refused) {
            (Err(why), _) => [Err(why.to_string()), Err(why.to_string())],
            (Ok(_), Some(reason)) => {
                [refused(reason.strip_prefix(ITS_C_D).unwrap_or(reason)), refused(reason)]
            }
            (Ok(damping), None) => {
                let [of_chain, of_striker] = damping.refusals(critical_kg_per_s);
                let told = |found: Estimate, reason: Option<String>| match reason {
                    Some(reason) => refused(&reason),
                    None => Ok(found),
                };
                [
                    told(damping.chain_damping_kg_per_s, of_chain),
                    told(damping.striker_damping_kg_per_s, of_striker),
                ]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fit_that_is_refused_for_its_c_d_says_so_of_c_s() {
        let damping = Damping {
            chain_damping_kg_per_s: Estimate::new(0.0, 1e-3),
            striker_damping_kg_per_s: Estimate::new(0.2, 0.01),
            correlation: 0.0,
        };
        let reason = format!("{ITS_C_D}at its bound of zero");
        let fit = |refused| Fit { source: PEAK_ENERGIES, damping: Ok(damping), refused };
        let [c_d, c_s] = fit(Some(reason.as_str())).told(1.0);
        assert_eq!(c_d, Err("refused: at its bound of zero".into()));
        assert_eq!(c_s, Err("refused: its c_d is at its bound of zero".into()));
        let [c_d, c_s] = fit(None).told(1.0);
        assert!(c_d.is_err() && c_s == Ok(damping.striker_damping_kg_per_s));
        let [c_d, c_s] = fit(Some("it fits nothing")).told(1.0);
        assert_eq!(c_d, c_s);
    }
}
