use std::path::Path;

use chainwave_analysis::Measurement;
use chainwave_analysis::fit::Interval;
use chainwave_measurement::{Estimate, Trajectory};

use super::Variant;
use crate::error::Error;
use crate::run::evaluation::Evaluation;
use crate::run::tracking::Tracked;
use crate::run::truth::KnownTruth;
use crate::run::{Comparison, Job};
use crate::synthesize::Truth;
use crate::table::{self, Table, column};

/// What stands for the kind of an experiment's fault where it has none.
const NO_FAULT: &str = "none";

/// One estimate beside its truth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Finding {
    quantity: &'static str,
    estimate: Estimate,
    truth: f64,
}

/// Of fields over time, every this many samples is taken: neighbours share their errors.
const THINNING: usize = 16;

impl Finding {
    /// Writes the findings of one experiment.
    pub(super) fn write(path: &Path, variant: &Variant, named: bool, findings: &[Self]) -> Result<(), Error> {
        let Variant { seed, noise, striker_m_per_s, fault } = *variant;
        let n = findings.len();
        let of = |value: &dyn Fn(&Self) -> f64| findings.iter().map(value).collect::<Vec<f64>>();
        let columns = vec![
            column("seed", vec![seed; n]),
            column("noise", vec![noise; n]),
            column("striker_velocity_m_per_s", vec![striker_m_per_s; n]),
            column("fault", vec![fault.unwrap_or(NO_FAULT); n]),
            column("named", vec![f64::from(u8::from(named)); n]),
            column("quantity", findings.iter().map(|finding| finding.quantity).collect::<Vec<_>>()),
            column("value", of(&|finding| finding.estimate.value)),
            column("sigma", of(&|finding| finding.estimate.sigma)),
            column("truth", of(&|finding| finding.truth)),
        ];
        table::write(path, columns)
    }
}

/// Every estimate of an evaluation whose truth is known.
pub(super) fn findings(job: &Job, compared: &Comparison) -> Result<Vec<Finding>, Error> {
    let Comparison { tracked, evaluation, truth, .. } = compared;
    let truths = Table::read(&job.recordings.join("truth_trials.csv"))?;
    let mut found = Vec::new();
    let mut add = |quantity: &'static str, estimate: Estimate, truth: f64| {
        found.push(Finding { quantity, estimate, truth });
    };
    of_motion(evaluation, &truth.motion, job.experiment.chain.pitch_m.get(), &mut add);
    of_wave(&evaluation.measurement, &truth.measurement, &mut add);
    of_damping(evaluation, truth, &mut add);
    of_recordings(job, evaluation, &truths, &mut add)?;
    of_stages(job, tracked, &truths, &mut add)?;
    Ok(found)
}

fn of_motion(
    evaluation: &Evaluation,
    truth: &Trajectory,
    pitch_m: f64,
    add: &mut impl FnMut(&'static str, Estimate, f64),
) {
    for ((row, i), x) in evaluation.stitched.motion.displacement_m.indexed_iter() {
        if let Some(x) = x.filter(|_| i % THINNING == 0) {
            add("displacement", x, truth.displacement_m[(row, i)]);
        }
    }
    for ((row, i), strain) in evaluation.measurement.strain.strain.indexed_iter() {
        if let Some(strain) = strain.filter(|_| i % THINNING == 0) {
            let difference_m = truth.displacement_m[(row + 1, i)] - truth.displacement_m[(row, i)];
            add("strain", strain, difference_m / pitch_m);
        }
    }
}

fn of_wave(found: &Measurement, truth: &Measurement, add: &mut impl FnMut(&'static str, Estimate, f64)) {
    if let (Ok(found), Ok(truth)) = (&found.group_velocity, &truth.group_velocity) {
        add("group velocity", found.velocity_m_per_s, truth.velocity_m_per_s.value);
        if let (Some(found), Some(truth)) = (found.relative_variation, truth.relative_variation) {
            add("its variation", found, truth.value);
        }
        if let (Some(found), Some(truth)) = (found.particle_velocity_m_per_s, truth.particle_velocity_m_per_s)
        {
            add("particle velocity", found, truth.value);
        }
    }
    for (found, truth) in found.fronts.iter().zip(&truth.fronts) {
        let (Ok(found), Ok(truth)) = (found, truth) else { continue };
        add("peak time", found.peak_time_s, truth.peak_time_s.value);
        add("peak strain", found.peak_strain, truth.peak_strain.value);
        if let (Some(found), Some(truth)) = (found.edge_time_s, truth.edge_time_s) {
            add("edge time", found, truth.value);
        }
        if let (Some(found), Some(truth)) = (found.particle_velocity_m_per_s, truth.particle_velocity_m_per_s)
        {
            add("particle velocity of a gap", found, truth.value);
        }
    }
    for width in found.half_widths.iter().step_by(THINNING) {
        let same = truth.half_widths.iter().find(|other| (other.t_s - width.t_s).abs() < 1e-9);
        same.into_iter().for_each(|same| add("HWHM", width.hwhm_m, same.hwhm_m.value));
    }
    if let (Some(found), Some(truth)) = (&found.energies, &truth.energies) {
        for (gap, energy) in found.gaps.iter().zip(&found.energy_j) {
            let same = truth.gaps.iter().position(|other| other == gap);
            same.into_iter().for_each(|same| add("peak energy", *energy, truth.energy_j[same].value));
        }
    }
    if let (Ok(found), Ok(truth)) = (&found.local_resonance, &truth.local_resonance) {
        add("tail frequency", found.frequency_hz, truth.frequency_hz.value);
    }
}

fn of_damping(
    evaluation: &Evaluation,
    truth: &KnownTruth,
    add: &mut impl FnMut(&'static str, Estimate, f64),
) {
    let Truth { c_d_kg_per_s: c_d, c_s_kg_per_s: c_s, striker_velocity_m_per_s, impact_time_s, .. } =
        truth.parameters;
    if let Ok(fit) = &evaluation.track_fit {
        let (chain, striker) = (fit.damping.chain_damping_kg_per_s, fit.damping.striker_damping_kg_per_s);
        add("c_d, tracks", chain, c_d);
        add("c_s, tracks", striker, c_s);
        add("c_d, profile", middle(fit.intervals_95[0]), c_d);
        add("c_s, profile", middle(fit.intervals_95[1]), c_s);
        if let Some([of_chain, of_striker]) = fit.bootstrap {
            add("c_d, bootstrap", of_chain.estimate(chain.value), c_d);
            add("c_s, bootstrap", of_striker.estimate(striker.value), c_s);
        }
        add("mean striker, tracks", fit.striker_velocity_m_per_s, striker_velocity_m_per_s);
        add("mean impact, tracks", fit.impact_time_s, impact_time_s);
    }
    if let Ok(fit) = &evaluation.imposed_fit {
        add("c_d, behind body 1", fit.chain_damping_kg_per_s, c_d);
    }
    if let Ok(fit) = &evaluation.energy_fit {
        add("c_d, peak energies", fit.damping.chain_damping_kg_per_s, c_d);
        add("c_s, peak energies", fit.damping.striker_damping_kg_per_s, c_s);
        add("mean striker, energies", fit.striker_velocity_m_per_s, striker_velocity_m_per_s);
    }
}

/// A 95 % interval as the estimate that has it.
fn middle(interval: Interval) -> Estimate {
    let half_width = 0.5 * (interval.high - interval.low);
    Estimate::new(interval.low + half_width, half_width / Estimate::COVERAGE_95)
}

/// Trigger, drive, striker and impact of each recording; the truths of triggers and drives count from their means.
fn of_recordings(
    job: &Job,
    evaluation: &Evaluation,
    truths: &Table,
    add: &mut impl FnMut(&'static str, Estimate, f64),
) -> Result<(), Error> {
    let delays_s = truths.full_numbers("trigger_delay_s")?;
    let strikers = truths.full_numbers("striker_velocity_m_per_s")?;
    let alignments = &evaluation.stitched.alignments;
    let row = |recording: &str| job.trials.iter().position(|trial| trial.recording == recording);
    let rows: Vec<usize> = alignments.iter().filter_map(|alignment| row(&alignment.recording)).collect();
    let mean = |of: &[f64]| rows.iter().map(|row| of[*row]).sum::<f64>() / rows.len().max(1) as f64;
    let (mean_delay_s, mean_striker) = (mean(&delays_s), mean(&strikers));
    let standings = &evaluation.standings.of_recordings;
    for ((standing, alignment), row) in standings.iter().zip(alignments).zip(&rows) {
        let (offset_s, drive) = (mean_delay_s - delays_s[*row], strikers[*row] / mean_striker - 1.0);
        add("trigger offset", standing.trigger_offset_s, offset_s);
        add("trigger offset by onset", alignment.trigger_offset_s, offset_s);
        add("drive", standing.drive_deviation, drive);
        add("drive by onset", alignment.drive_deviation, drive);
    }
    for one in evaluation.track_fit.iter().flat_map(|fit| &fit.recordings) {
        if let Some(row) = row(&one.recording) {
            add("striker velocity", one.striker_velocity_m_per_s, strikers[row]);
            add("impact time", one.impact_time_s, -delays_s[row]);
        }
    }
    Ok(())
}

/// Where the stage stood in each view that is tied to the first.
fn of_stages(
    job: &Job,
    tracked: &Tracked,
    truths: &Table,
    add: &mut impl FnMut(&'static str, Estimate, f64),
) -> Result<(), Error> {
    let stages_m = truths.full_numbers("stage_m")?;
    let first_of_view =
        |row: &usize| job.trials[..*row].iter().all(|other| other.view != job.trials[*row].view);
    for row in (0..job.trials.len()).filter(first_of_view) {
        if let Some(refined_m) = tracked.stages.refined_m(&job.trials[row]).filter(|stage| stage.sigma > 0.0)
        {
            add("stage", refined_m, stages_m[row]);
        }
    }
    Ok(())
}
