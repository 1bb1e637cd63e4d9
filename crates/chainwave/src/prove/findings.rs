//! Estimates beside their truths.

use chainwave_analysis::{Measurement, Spacing};
use chainwave_experiment::{
    BEHIND_BODY_1, Evaluation, KnownTruth, PEAK_ENERGIES, Results, Setup, Stages, TRACKS, Trial, TrueTrial,
    typical_half_width,
};
use chainwave_inference::Interval;
use chainwave_measurement::{Estimate, Trajectory};

use polars_core::prelude::Column;

use super::variant::Variant;
use crate::error::Error;
use crate::table::column;

/// What stands for an experiment's kind of fault, effect, chain or protocol where it has none.
pub(super) const NONE: &str = "none";

/// One estimate beside its truth.
#[derive(Debug, Clone, Copy)]
pub(super) struct ProofFinding {
    quantity: &'static str,
    estimate: Estimate,
    truth: f64,
}

/// What an experiment is warned of.
#[derive(Debug, Clone)]
pub(super) struct Said {
    /// Whether what went wrong was named or, where nothing did, whether there was a warning all the same.
    pub(super) named: bool,
    /// The kinds of its warnings, with spaces between.
    pub(super) warned_of: String,
}

/// The half width of median uncertainty.
pub(super) const MEDIAN_HALF_WIDTH: &str = "HWHM of median sigma";

/// Of fields over time, every this many samples is taken: neighbours share their errors.
const THINNING: usize = 16;

impl ProofFinding {
    /// To be raised whenever a table of findings has other columns.
    pub(super) const VERSION: u32 = 4;

    /// The findings of one experiment as the columns of a table.
    pub(super) fn columns(variant: &Variant, said: &Said, findings: &[Self]) -> Vec<Column> {
        let Variant { seed, noise, striker_m_per_s, fault, effect, chain, protocol, other_chain } = *variant;
        let n = findings.len();
        let of = |value: &dyn Fn(&Self) -> f64| findings.iter().map(value).collect::<Vec<f64>>();
        vec![
            column("seed", vec![seed; n]),
            column("noise", vec![noise; n]),
            column("striker_velocity_m_per_s", vec![striker_m_per_s; n]),
            column("fault", vec![fault.unwrap_or(NONE); n]),
            column("effect", vec![effect.map_or(NONE, |effect| effect.name); n]),
            column("chain", vec![chain.map_or(NONE, |chain| chain.name); n]),
            column("protocol", vec![protocol.map_or(NONE, |protocol| protocol.name); n]),
            column("other_chain", vec![other_chain.map_or(NONE, |chain| chain.name); n]),
            column("named", vec![f64::from(u8::from(said.named)); n]),
            column("warned_of", vec![said.warned_of.as_str(); n]),
            column("quantity", findings.iter().map(|finding| finding.quantity).collect::<Vec<_>>()),
            column("value", of(&|finding| finding.estimate.value)),
            column("sigma", of(&|finding| finding.estimate.sigma)),
            column("truth", of(&|finding| finding.truth)),
        ]
    }
}

/// Every estimate of an evaluation whose truth is known.
pub(super) fn findings(setup: &Setup, results: &Results) -> Result<Vec<ProofFinding>, Error> {
    let Results { tracked, evaluation, truth, .. } = results;
    let truth = truth.as_ref().ok_or_else(|| {
        Error::configuration(&setup.path, "expected truth.json beside the recordings, found none".into())
    })?;
    let mut found = Vec::new();
    let mut add = |quantity: &'static str, estimate: Estimate, truth: f64| {
        found.push(ProofFinding { quantity, estimate, truth });
    };
    of_motion(evaluation, &truth.motion, &setup.experiment.chain.spacing()?, &mut add);
    of_wave(&evaluation.measurement, &truth.measurement, &mut add);
    of_damping(evaluation, truth, &mut add);
    of_recordings(evaluation, truth, &mut add);
    of_stages(&setup.table, &tracked.stages, truth, &mut add);
    Ok(found)
}

fn of_motion(
    evaluation: &Evaluation,
    truth: &Trajectory,
    spacing: &Spacing,
    add: &mut impl FnMut(&'static str, Estimate, f64),
) {
    for ((row, i), x) in evaluation.stitched.motion.displacement_m.indexed_iter() {
        if let Some(x) = x.filter(|_| i % THINNING == 0) {
            add("displacement", x, truth.displacement_m[(row, i)]);
        }
    }
    let by_model = evaluation.by_model.iter().flat_map(|motion| motion.displacement_m.indexed_iter());
    for ((row, i), x) in by_model {
        if let Some(x) = x.filter(|_| i % THINNING == 0) {
            add("displacement by model", x, truth.displacement_m[(row, i)]);
        }
    }
    for ((row, i), strain) in evaluation.measurement.strain.strain.indexed_iter() {
        if let Some(strain) = strain.filter(|_| i % THINNING == 0) {
            let difference_m = truth.displacement_m[(row + 1, i)] - truth.displacement_m[(row, i)];
            add("strain", strain, difference_m / spacing.of_gap_m(row + 1));
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
    let at = |t_s: f64| truth.half_widths.iter().find(|other| (other.t_s - t_s).abs() < 1e-9);
    for width in found.half_widths.iter().step_by(THINNING) {
        at(width.t_s).into_iter().for_each(|same| add("HWHM", width.hwhm_m, same.hwhm_m.value));
    }
    // Sigma swings as the pulse passes from gap to gap, with a period that may be that of the thinning: the one that a plan foresees is of all.
    if let Some(width) = typical_half_width(&found.half_widths) {
        at(width.t_s).into_iter().for_each(|same| add(MEDIAN_HALF_WIDTH, width.hwhm_m, same.hwhm_m.value));
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
    let (c_d, c_s) = (truth.chain_damping_kg_per_s, truth.striker_damping_kg_per_s);
    let (striker_velocity_m_per_s, impact_time_s) = (truth.striker_velocity_m_per_s, truth.impact_time_s);
    let stated = &evaluation.damping;
    if let Ok(stated) = &stated.chain_damping_kg_per_s {
        add("c_d, stated", *stated, c_d);
    }
    if let Ok(stated) = &stated.striker_damping_kg_per_s {
        add("c_s, stated", *stated, c_s);
    }
    let holds = |source: &str| stated.reason(source).is_none();
    if let Some(fit) = evaluation.track_fit.as_ref().ok().filter(|_| holds(TRACKS)) {
        let (chain, striker) = (fit.damping.chain_damping_kg_per_s, fit.damping.striker_damping_kg_per_s);
        let over_trials = fit.bootstrap.as_ref();
        add("c_d, tracks", chain, c_d);
        add("c_d, noise alone", fit.by_noise.chain_damping_kg_per_s, c_d);
        add("c_d, profile", middle(fit.intervals_95[0]), c_d);
        if let Some([of_chain, _]) = over_trials {
            add("c_d, bootstrap", of_chain.estimate(chain.value), c_d);
        }
        if !fit.model.is_let_go() {
            add("c_s, tracks", striker, c_s);
            add("c_s, noise alone", fit.by_noise.striker_damping_kg_per_s, c_s);
            add("c_s, profile", middle(fit.intervals_95[1]), c_s);
            if let Some([_, of_striker]) = over_trials {
                add("c_s, bootstrap", of_striker.estimate(striker.value), c_s);
            }
        }
        add("mean striker, tracks", fit.striker_velocity_m_per_s, striker_velocity_m_per_s);
        add("mean impact, tracks", fit.impact_time_s, impact_time_s);
    }
    if let Some(fit) = evaluation.imposed_fit.as_ref().ok().filter(|_| holds(BEHIND_BODY_1)) {
        add("c_d, behind body 1", fit.chain_damping_kg_per_s, c_d);
    }
    if let Some(fit) = evaluation.energy_fit.as_ref().ok().filter(|_| holds(PEAK_ENERGIES)) {
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
    evaluation: &Evaluation,
    truth: &KnownTruth,
    add: &mut impl FnMut(&'static str, Estimate, f64),
) {
    let delays_s: Vec<f64> = truth.trials.iter().map(|trial| trial.trigger_delay_s).collect();
    let strikers: Vec<f64> = truth.trials.iter().map(|trial| trial.striker_velocity_m_per_s).collect();
    let alignments = &evaluation.stitched.alignments;
    let row = |recording: &str| truth.trials.iter().position(|trial| trial.recording == recording);
    let rows: Vec<usize> = alignments.iter().filter_map(|alignment| row(&alignment.recording)).collect();
    let mean = |of: &[f64]| rows.iter().map(|row| of[*row]).sum::<f64>() / rows.len().max(1) as f64;
    let (mean_delay_s, mean_striker) = (mean(&delays_s), mean(&strikers));
    let recording_alignments = &evaluation.recording_alignments.of_recordings;
    for ((aligned, alignment), row) in recording_alignments.iter().zip(alignments).zip(&rows) {
        let (offset_s, drive) = (mean_delay_s - delays_s[*row], strikers[*row] / mean_striker - 1.0);
        add("trigger offset", aligned.trigger_offset_s, offset_s);
        add("trigger offset by onset", alignment.trigger_offset_s, offset_s);
        if let Some(stated) = aligned.drive_deviation {
            add("drive", stated, drive);
            add("drive by onset", alignment.drive_deviation, drive);
        }
    }
    let fit = evaluation.track_fit.iter().filter(|_| evaluation.damping.reason(TRACKS).is_none());
    for one in fit.flat_map(|fit| &fit.recordings) {
        if let Some(row) = row(&one.recording) {
            add("striker velocity", one.striker_velocity_m_per_s, strikers[row]);
            add("impact time", one.impact_time_s, -delays_s[row]);
        }
    }
}

/// Where the stage stood in each view that is tied to others; where the first one is taken as stated, the others count from it.
fn of_stages(
    trials: &[Trial],
    stages: &Stages,
    truth: &KnownTruth,
    add: &mut impl FnMut(&'static str, Estimate, f64),
) {
    let first_of_view = |row: &usize| trials[..*row].iter().all(|other| other.view != trials[*row].view);
    let mut from_m = 0.0;
    for row in (0..trials.len()).filter(first_of_view) {
        let trial = &trials[row];
        let is_it = |other: &&TrueTrial| other.recording == trial.recording;
        let Some(true_m) = truth.trials.iter().find(is_it).map(|filmed| filmed.stage_m) else { continue };
        match stages.refined_m(trial) {
            Some(refined_m) if refined_m.sigma > 0.0 => add("stage", refined_m, true_m - from_m),
            Some(_) => from_m = true_m - trial.stage_m,
            None => {}
        }
    }
}
