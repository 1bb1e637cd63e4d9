//! What was modelled, by which rule and on what evidence.

use chainwave_analysis::Departure;
use chainwave_analysis::motion_across;
use chainwave_measurement::Estimate;
use serde::Serialize;

use chainwave_correlation::ShapeChoice;

use crate::calibration::ChainMap;
use crate::configuration::Experiment;
use crate::evaluation::Evaluation;
use crate::notices::farthest_drive;
use crate::setup::Setup;
use crate::standing::{Standing, Standings};
use crate::tracking::Tracked;
use crate::tracks::FollowedBody;
use crate::wording::{estimate, probability};

/// One choice of what is modelled, with the rule and the evidence behind it.
#[derive(Debug, Clone, Serialize)]
pub struct Decision {
    /// What was to be chosen.
    pub question: &'static str,
    /// What was chosen.
    pub choice: String,
    /// By which rule.
    pub rule: &'static str,
    /// On what evidence.
    pub evidence: String,
}

/// The choices that this run made, and those that the experiment made for it.
pub(crate) fn decide(setup: &Setup, tracked: &Tracked, evaluation: &Evaluation) -> Vec<Decision> {
    let experiment = &setup.experiment;
    vec![
        shape_function(experiment),
        motion(&setup.map, tracked),
        stages(tracked),
        left_out(evaluation),
        drives(experiment, evaluation),
        standing_source(evaluation),
        contact_law(experiment, evaluation),
        damping(evaluation),
        scatter(evaluation),
        group_velocity(evaluation),
        tail(experiment, evaluation),
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

fn shape_function(experiment: &Experiment) -> Decision {
    let tracking = &experiment.tracking;
    let (by_evidence, named) = (
        "for each subset the simplest that its matches do not reject (Wald's test, 1 % level)",
        "as the experiment names it",
    );
    let is_by_evidence = tracking.shape == ShapeChoice::ByEvidence;
    let rate = if is_by_evidence { false_choices::SHAPE } else { "not tested" };
    Decision {
        question: "shape function",
        choice: tracking.shape.to_string(),
        rule: if is_by_evidence { by_evidence } else { named },
        evidence: format!("interpolation {}; {rate}", tracking.interpolation),
    }
}

/// Level of every test: the probability of leaving the simpler model although it holds.
const LEVEL: f64 = 0.01;

/// How often each test left the simpler model although it held: the first three measured on 300 synthetic experiments at the level, the
/// speed's on 1000 (by `rates_of_false_choices` and `rates_of_false_choices_of_the_speed` among the tests of the analysis), the shape
/// function's by the tests of the correlation, the others at 5 % by unit tests of the analysis.
mod false_choices {
    pub(super) const SOFTENING: &str = "falsely told in 0.7 +- 0.5 % of synthetic experiments";
    pub(super) const SCATTER: &str = "falsely told in 0.3 +- 0.3 % of synthetic experiments";
    pub(super) const DAMPING: &str = "c_d falsely told in 2.7 +- 0.9 % of synthetic experiments";
    pub(super) const SPEED: &str = "falsely told in 1.1 +- 0.3 % of synthetic pulses of one speed";
    pub(super) const SHAPE: &str =
        "a simpler one falsely left in less than 4.5 % of subsets, two tests counted";
    pub(super) const ACROSS: &str = "at a level of 5 % falsely told in at most 10 % of noise";
    pub(super) const LINE: &str = "at a level of 5 % falsely told in 3 to 7 % of noise";
}

/// The chain moves along x; whether its bodies strayed across it is tested on their positions across.
fn motion(map: &ChainMap, tracked: &Tracked) -> Decision {
    let m_per_px = map.m_per_px().value;
    let bodies = tracked.recordings.iter().flat_map(|one| &one.tracks.bodies);
    let tracks: Vec<Vec<Option<f64>>> = bodies.map(|body| across_m(body, m_per_px)).collect();
    let rule = "1-D unless means of 16 frames across the chain scatter by more than noise lets them (chi squared, 1 % level)";
    let question = "dimensions of the motion";
    match motion_across(&tracks) {
        Some(found) if found.p_value < LEVEL => Decision {
            question,
            choice:
                "2-D: bodies move across the chain; what the chain model explains is their motion along it"
                    .into(),
            rule,
            evidence: told(
                &found,
                &format!("{:.3} um (rms) across", 1e6 * found.size.value),
                false_choices::ACROSS,
            ),
        },
        Some(found) => Decision {
            question,
            choice: "1-D, along the chain".into(),
            rule,
            evidence: told(
                &found,
                &format!("less than {:.3} um (95 %) across", 1e6 * upper(found.size)),
                false_choices::ACROSS,
            ),
        },
        None => Decision {
            question,
            choice: "1-D, along the chain".into(),
            rule,
            evidence: "no track is long enough to tell".into(),
        },
    }
}

/// Positions of a body across the chain, in metres.
fn across_m(followed: &FollowedBody, m_per_px: f64) -> Vec<Option<f64>> {
    followed.positions.iter().map(|found| Some(m_per_px * found.as_ref().ok()?.y_px.value)).collect()
}

/// A test's outcome in words, with how often it is wrong.
fn told(found: &Departure, what: &str, rate: &str) -> String {
    format!(
        "{what}; chi squared {:.1} of {} degrees of freedom, {}; {rate}",
        found.chi_squared,
        found.freedom,
        probability(found.p_value)
    )
}

/// Upper end of a 95 % interval of a size that cannot be negative.
fn upper(size: Estimate) -> f64 {
    size.value + Estimate::COVERAGE_95 * size.sigma
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

fn drives(experiment: &Experiment, evaluation: &Evaluation) -> Decision {
    let standings = &evaluation.standings.of_recordings;
    let n = standings.len().max(1) as f64;
    let rms = |of: &dyn Fn(&Standing) -> Estimate| {
        (standings.iter().map(|one| of(one).value.powi(2)).sum::<f64>() / n).sqrt()
    };
    let drive = rms(&|one| one.drive_deviation);
    let offset_s = rms(&|one| one.trigger_offset_s);
    Decision {
        question: "differences between trials",
        choice: "a trigger offset and a drive for each recording, response of second order".into(),
        rule: "always fitted; priors of one frame and 5 % decide what the data leave open",
        evidence: format!(
            "drives scatter by {:.2} %, trigger offsets by {:.2} us; aligned in {} rounds; farthest is {}",
            100.0 * drive,
            1e6 * offset_s,
            evaluation.stitched.rounds,
            farthest_drive(experiment, &evaluation.standings).map_or("none".into(), |drive| drive.as_text())
        ),
    }
}

fn standing_source(evaluation: &Evaluation) -> Decision {
    let (standings, alignments) = (&evaluation.standings, &evaluation.stitched.alignments);
    let mean_us = |sigma_s: &dyn Fn(usize) -> f64| {
        1e6 * (0..alignments.len()).map(sigma_s).sum::<f64>() / alignments.len().max(1) as f64
    };
    Decision {
        question: "what trigger offsets and drives are taken from",
        choice: standings.source.into(),
        rule: Standings::RULE,
        evidence: format!(
            "offsets are known to {:.3} us on average; to {:.3} us from the onset alone",
            mean_us(&|r| standings.of_recordings[r].trigger_offset_s.sigma),
            mean_us(&|r| alignments[r].trigger_offset_s.sigma),
        ),
    }
}

fn contact_law(experiment: &Experiment, evaluation: &Evaluation) -> Decision {
    let contact = &experiment.contact;
    let peak = |front: &chainwave_analysis::GapFront| front.peak_strain.value.abs();
    let strain = evaluation.measurement.fronts.iter().flatten().map(peak).fold(0.0, f64::max);
    let depth = strain * experiment.chain.pitch_m.get() / contact.delta_0_m.get();
    // F = A delta_0^p ((1 + y)^p - 1) leaves its tangent by (1 - p) y / 2 to first order.
    let bend = 50.0 * (1.0 - contact.p.get()).abs() * depth;
    let question = "contact law";
    let rule = "a spring unless the tracks tell the law's softening from zero (one-sided, 1 % level); 1 is the law that the experiment gives";
    let largest =
        format!("largest overlap {depth:.3} delta_0, where force leaves the tangent by about {bend:.0} %");
    let softening = evaluation.departures.as_ref().map(|departures| departures.softening);
    match softening {
        Some(found) => Decision {
            question,
            choice: if found.p_value < LEVEL { "power law" } else { "a spring would do" }.into(),
            rule,
            evidence: told(
                &found,
                &format!("{largest}; softening {}", estimate(found.size)),
                false_choices::SOFTENING,
            ),
        },
        None => Decision {
            question,
            choice: "power law, as the experiment gives it".into(),
            rule,
            evidence: format!("{largest}; not tested, as there is no fit to the tracks"),
        },
    }
}

fn damping(evaluation: &Evaluation) -> Decision {
    let rule = "each of c_d and c_s is zero unless told from it (one-sided, 1 % level)";
    let question = "damping";
    let Some((damping, source)) = evaluation.damping() else {
        let evidence = evaluation.track_fit.as_ref().err().map(ToString::to_string).unwrap_or_default();
        return Decision { question, choice: "not fitted".into(), rule, evidence };
    };
    let p_values = damping.told_from_zero();
    let choice = match p_values.map(|p_value| p_value < LEVEL) {
        [true, true] => "c_d and c_s",
        [true, false] => "c_d (c_s is not told from zero)",
        [false, true] => "c_s (c_d is not told from zero)",
        [false, false] => "none (neither is told from zero)",
    };
    let off = |found: Estimate| found.value / found.sigma;
    let evidence = format!(
        "from the {source}: c_d = {:.2} sigma, {}; c_s = {:.2} sigma, {}; {}",
        off(damping.chain_damping_kg_per_s),
        probability(p_values[0]),
        off(damping.striker_damping_kg_per_s),
        probability(p_values[1]),
        false_choices::DAMPING
    );
    Decision { question, choice: choice.into(), rule, evidence }
}

fn scatter(evaluation: &Evaluation) -> Decision {
    let question = "differences between bodies";
    let rule = "none unless masses that are free in each body scatter by more than their errors (chi squared, 1 % level); a stiffness that \
                scatters from gap to gap shows as well";
    let found = evaluation.departures.as_ref().and_then(|departures| departures.scatter);
    match found {
        Some(found) if found.p_value < LEVEL => Decision {
            question,
            choice: "bodies differ; one mass stands for all in the fit, whose residuals say what that costs"
                .into(),
            rule,
            evidence: told(
                &found,
                &format!("{} % in mass", estimate(found.size.scaled(100.0))),
                false_choices::SCATTER,
            ),
        },
        Some(found) => Decision {
            question,
            choice: "none: bodies are alike".into(),
            rule,
            evidence: told(
                &found,
                &format!("less than {:.3} % in mass (95 %)", 100.0 * upper(found.size)),
                false_choices::SCATTER,
            ),
        },
        None => Decision {
            question,
            choice: "bodies count as alike".into(),
            rule,
            evidence: "not tested, as there is no fit to the tracks".into(),
        },
    }
}

fn group_velocity(evaluation: &Evaluation) -> Decision {
    let question = "group velocity along the chain";
    let rule = "one speed unless those of the first and the last third of the gaps differ by more than 2.58 standard uncertainties (1 % level)";
    let found = evaluation.measurement.group_velocity.as_ref();
    let variation = found.ok().and_then(|velocity| velocity.relative_variation);
    let Some(variation) = variation else {
        return Decision {
            question,
            choice: "not told".into(),
            rule,
            evidence: "fewer than six gaps".into(),
        };
    };
    let varies = variation.value.abs() > 2.58 * variation.sigma;
    Decision {
        question,
        choice: if varies {
            "it varies; the speed stated is that of the line through all gaps"
        } else {
            "one speed"
        }
        .into(),
        rule,
        evidence: format!(
            "last third less first: {:+.3} +- {:.3} %; {}",
            100.0 * variation.value,
            100.0 * variation.sigma,
            false_choices::SPEED
        ),
    }
}

fn tail(experiment: &Experiment, evaluation: &Evaluation) -> Decision {
    let question = "what the tail is";
    let rule = "a line where Thomson's F-test rejects a continuum at the dominant frequency (1 % level, all resolved frequencies allowed for)";
    let resonance = match &evaluation.measurement.local_resonance {
        Ok(resonance) => resonance,
        Err(reason) => {
            let (choice, evidence) = ("not told".into(), reason.as_str().into());
            return Decision { question, choice, rule, evidence };
        }
    };
    let is_line = resonance.line.p_value < LEVEL;
    let edge_hz = experiment.band_edge_hz().unwrap_or(f64::NAN);
    Decision {
        question,
        choice: if is_line { "a line" } else { "the crest of a continuum, as dispersion makes it" }.into(),
        rule,
        evidence: format!(
            "{:.1} Hz, resolution {:.0} Hz, p = {:.2e} over {} gaps; the chain's band ends at {edge_hz:.0} Hz; {}",
            resonance.frequency_hz.value,
            resonance.resolution_hz,
            resonance.line.p_value,
            resonance.line.n_gaps,
            false_choices::LINE
        ),
    }
}
