use chainwave_measurement::Estimate;
use serde::Serialize;

use super::Job;
use super::evaluation::Evaluation;
use super::tracking::Tracked;

/// One choice of what is modelled, with the rule and the evidence behind it.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Decision {
    /// What was to be chosen.
    pub(crate) question: &'static str,
    /// What was chosen.
    pub(crate) choice: String,
    /// By which rule.
    pub(crate) rule: &'static str,
    /// On what evidence.
    pub(crate) evidence: String,
}

/// The choices that this run made, and those that the experiment made for it.
pub(crate) fn decide(job: &Job, tracked: &Tracked, evaluation: &Evaluation) -> Vec<Decision> {
    vec![
        shape_function(job),
        motion(job, tracked),
        stages(tracked),
        left_out(evaluation),
        drives(evaluation),
        contact_law(job, evaluation),
        damping(evaluation),
        damping_source(evaluation),
    ]
}

fn left_out(evaluation: &Evaluation) -> Decision {
    let outliers = &evaluation.left_out;
    let names: Vec<&str> = outliers.iter().map(|outlier| outlier.recording.as_str()).collect();
    let evidence: Vec<String> =
        outliers.iter().map(|outlier| format!("{}: {}", outlier.recording, outlier.evidence)).collect();
    Decision {
        question: "recordings left out",
        choice: if names.is_empty() { "none".into() } else { names.join(", ") },
        rule: "a recording without which its view scatters at least three times less (and by more than 2 sigma with it), or whose \
               motion comes more than 5 frames and ten times the usual distance from the view's median; in views of four trials or more",
        evidence: if evidence.is_empty() { "every view's trials agree".into() } else { evidence.join("; ") },
    }
}

fn damping_source(evaluation: &Evaluation) -> Decision {
    let chi_squared =
        |chi_squared: Option<f64>| chi_squared.map_or("-".into(), |value| format!("{value:.3}"));
    let tracks = chi_squared(evaluation.track_fit.as_ref().ok().map(|fit| fit.reduced_chi_squared));
    let energies = chi_squared(evaluation.energy_fit.as_ref().ok().map(|fit| fit.reduced_chi_squared));
    Decision {
        question: "what the damping is taken from",
        choice: evaluation.damping().map_or("nothing", |(_, source)| source).into(),
        rule: "the tracks while the model explains them (reduced chi squared up to 1.2), else the peak energies, which feel less of \
               what the model leaves out",
        evidence: format!("reduced chi squared {tracks} of the tracks, {energies} of the peak energies"),
    }
}

fn shape_function(job: &Job) -> Decision {
    Decision {
        question: "shape function",
        choice: job.experiment.tracking.shape.clone(),
        rule: "as the experiment names it",
        evidence: format!("interpolation {}", job.experiment.tracking.interpolation),
    }
}

/// The chain moves along x; how far its bodies strayed across it says whether that is enough.
fn motion(job: &Job, tracked: &Tracked) -> Decision {
    let mut furthest_px = 0.0_f64;
    for table in &tracked.tables {
        let across = table.numbers("y_px").unwrap_or_default();
        let names = table.texts("name").unwrap_or_default();
        let mut rest: Option<(&str, f64)> = None;
        for (name, y_px) in names.iter().zip(&across) {
            let Some(y_px) = y_px else { continue };
            let (_, rest_px) = *rest.filter(|(body, _)| body == name).get_or_insert((name, *y_px));
            rest = Some((name, rest_px));
            furthest_px = furthest_px.max((y_px - rest_px).abs());
        }
    }
    let furthest_um = 1e6 * furthest_px * job.calibration.m_per_px().value;
    Decision {
        question: "dimensions of the motion",
        choice: "1-D, along the chain".into(),
        rule: "the chain model has one dimension; the largest excursion across it is reported",
        evidence: format!("largest excursion across the chain {furthest_px:.3} px ({furthest_um:.1} um)"),
    }
}

fn stages(tracked: &Tracked) -> Decision {
    let (used, stated) = ("refined by the bodies that views share", "as the trials table states them");
    let evidence = match tracked.stages.largest_correction_m() {
        Some((largest_m, n_views)) => format!(
            "{n_views} views tied together; the largest correction is {:.2} +- {:.2} um",
            1e6 * largest_m.value,
            1e6 * largest_m.sigma
        ),
        None => "no body could be matched in two views".into(),
    };
    Decision {
        question: "positions of the stage",
        choice: if tracked.stages.is_used() { used } else { stated }.into(),
        rule: "refined where camera.stage_sigma_m states how well they are known; they place subsets on their markers and do not enter \
               displacements",
        evidence,
    }
}

fn drives(evaluation: &Evaluation) -> Decision {
    let alignments = &evaluation.stitched.alignments;
    let n = alignments.len().max(1) as f64;
    let rms =
        |of: &dyn Fn(usize) -> f64| ((0..alignments.len()).map(|r| of(r).powi(2)).sum::<f64>() / n).sqrt();
    let drive = rms(&|r| alignments[r].drive_deviation.value);
    let offset_s = rms(&|r| alignments[r].trigger_offset_s.value);
    Decision {
        question: "differences between trials",
        choice: "a trigger offset and a drive for each recording, response of second order".into(),
        rule: "always fitted; priors of one frame and 5 % decide what the data leave open",
        evidence: format!(
            "drives scatter by {:.2} %, trigger offsets by {:.2} us; aligned in {} rounds",
            100.0 * drive,
            1e6 * offset_s,
            evaluation.stitched.rounds
        ),
    }
}

fn contact_law(job: &Job, evaluation: &Evaluation) -> Decision {
    let contact = &job.experiment.contact;
    let peak = |front: &chainwave_analysis::GapFront| front.peak_strain.value.abs();
    let strain = evaluation.measurement.fronts.iter().flatten().map(peak).fold(0.0, f64::max);
    let depth = strain * job.experiment.chain.pitch_m.get() / contact.delta_0_m.get();
    // F = A delta_0^p ((1 + y)^p - 1) leaves its tangent by (1 - p) y / 2 to first order.
    let bend = 0.5 * (1.0 - contact.p.get()).abs() * depth;
    Decision {
        question: "contact law",
        choice: "power law, as the experiment gives it".into(),
        rule: "the linear law would do where force leaves the tangent by less than 1 % at the largest overlap",
        evidence: format!(
            "largest overlap {depth:.3} delta_0: force leaves the tangent by about {:.0} %",
            100.0 * bend
        ),
    }
}

fn damping(evaluation: &Evaluation) -> Decision {
    let rule = "damping is kept where its estimate exceeds 1.96 standard uncertainties (5 % level)";
    let question = "damping";
    match &evaluation.track_fit {
        Ok(fit) => {
            let told = |estimate: Estimate| estimate.value > Estimate::COVERAGE_95 * estimate.sigma;
            let (c_d, c_s) = (fit.damping.chain_damping_kg_per_s, fit.damping.striker_damping_kg_per_s);
            let choice = match (told(c_d), told(c_s)) {
                (true, true) => "c_d and c_s",
                (true, false) => "c_d (c_s is not distinguished from zero)",
                (false, true) => "c_s (c_d is not distinguished from zero)",
                (false, false) => "none (neither is distinguished from zero)",
            };
            let evidence = format!(
                "c_d = {:.3} sigma, c_s = {:.3} sigma from zero; reduced chi squared {:.3} over {} residuals",
                c_d.value / c_d.sigma,
                c_s.value / c_s.sigma,
                fit.reduced_chi_squared,
                fit.n_residuals
            );
            Decision { question, choice: choice.into(), rule, evidence }
        }
        Err(reason) => Decision { question, choice: "not fitted".into(), rule, evidence: reason.to_string() },
    }
}
