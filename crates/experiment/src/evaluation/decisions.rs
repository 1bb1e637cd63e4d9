//! What was modelled, by which rule and on what evidence.

use chainwave_analysis::probability::normal_beyond;
use chainwave_analysis::{
    Departure, Rule, camera_motion_rule, line_rule, motion_across, motion_across_rule, one_speed_rule,
};
use chainwave_inference::{
    FitError, Hypothesis, damping_rule, hypothesis_rule, scatter_of_bodies_rule, softening_rule,
    structure_rule,
};
use chainwave_measurement::Estimate;
use chainwave_mechanics::Law as ForceLaw;
use chainwave_stitching::{Assumption, Settings as StitchingSettings};
use serde::Serialize;

use chainwave_correlation::{ShapeChoice, ShapeEvidence};

use crate::camera::calibration::ChainMap;
use crate::configuration::{Experiment, Law};
use crate::evaluation::Evaluation;
use crate::evaluation::notices::farthest_drive;
use crate::evaluation::recording_alignment::{RecordingAlignment, RecordingAlignments};
use crate::fitting::assumptions::{assumed_by_fits, assumed_of_pictures};
use crate::fitting::damping::StatedDamping;
use crate::fitting::fits::Departures;
use crate::setup::Setup;
use crate::tracked::Tracked;
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
    pub rule: String,
    /// On what evidence, and how often such evidence errs.
    pub evidence: String,
}

impl Decision {
    fn by(rule: Rule, choice: impl Into<String>, evidence: impl Into<String>) -> Self {
        let rates = rule.rates_in_words();
        let mut evidence = evidence.into();
        if !rates.is_empty() {
            evidence.push_str("; ");
            evidence.push_str(&rates);
        }
        Self { question: rule.question, choice: choice.into(), rule: rule.text, evidence }
    }
}

/// A rule without a test.
fn plain(question: &'static str, text: impl Into<String>) -> Rule {
    Rule { question, text: text.into(), level: None, rates: Vec::new() }
}

/// The choices that this run made, and those that the experiment made for it.
pub(crate) fn decide(setup: &Setup, tracked: &Tracked, evaluation: &Evaluation) -> Vec<Decision> {
    let experiment = &setup.experiment;
    let mut decisions = vec![
        shape_function(experiment),
        motion(&setup.map, tracked),
        camera(evaluation),
        geometry(evaluation),
        stages(tracked),
        left_out(evaluation),
        drives(experiment, evaluation),
        alignment_source(evaluation),
        contact_law(experiment, evaluation),
        damping(evaluation),
        scatter(evaluation),
        peaks(evaluation),
        group_velocity(evaluation),
        tail(experiment, evaluation),
        chain_model(evaluation),
        single_causes(evaluation),
        damping_source(evaluation),
    ];
    decisions.extend(assumed(experiment, evaluation));
    decisions
}

/// What is assumed, of whatever chain, where the recordings do not tell it; of fits, where the experiment has them.
fn assumed(experiment: &Experiment, evaluation: &Evaluation) -> Vec<Decision> {
    let decision = |one: Assumption, from: &str| Decision {
        question: one.of,
        choice: one.in_words,
        rule: format!("decides {}", one.decides),
        evidence: format!("{}: {from}", one.reason),
    };
    let of_merging = evaluation.assumptions.iter().cloned();
    let mut all: Vec<Decision> =
        of_merging.map(|one| decision(one, StitchingSettings::assumed_from())).collect();
    let beside = assumed_of_pictures(experiment).into_iter();
    let by_fits = experiment.analysis.fits.then(|| assumed_by_fits(experiment, &evaluation.stitched));
    all.extend(beside.chain(by_fits.into_iter().flatten()).map(|one| decision(one, "not tuned to a chain")));
    all
}

fn left_out(evaluation: &Evaluation) -> Decision {
    let outliers = &evaluation.left_out;
    let names: Vec<&str> = outliers.iter().map(|outlier| outlier.recording.as_str()).collect();
    let evidence: Vec<String> =
        outliers.iter().map(|outlier| format!("{}: {}", outlier.recording, outlier.evidence)).collect();
    let rule = plain(
        "recordings left out",
        "a recording without which its view scatters at least three times less (and by more than 2 sigma with it), or whose motion comes \
         more than 5 frames and ten times the usual distance from the view's median, in views of four trials or more; or whose bodies are a \
         third of the way and ten times the usual distance from all other trials of its view; or in which nothing moves, though a body of it \
         does in another recording",
    );
    let choice = if names.is_empty() { "none".into() } else { names.join(", ") };
    let evidence = if evidence.is_empty() { "every view's trials agree".into() } else { evidence.join("; ") };
    Decision::by(rule, choice, evidence)
}

fn chain_model(evaluation: &Evaluation) -> Decision {
    let rule = structure_rule();
    let fit = match &evaluation.track_fit {
        Ok(fit) => fit,
        Err(why) => return Decision::by(rule, "not told", why.to_string()),
    };
    let beyond: Vec<&str> = fit.beyond.iter().map(|one| one.in_words()).collect();
    let choice = match (beyond.is_empty(), fit.leaves_noise_alone()) {
        (true, true) => "as the experiment states it".into(),
        (false, true) => format!("as if {}", beyond.join(", and ")),
        (true, false) => "as the experiment states it, which does not explain all".into(),
        (false, false) => format!("as if {}, which does not explain all", beyond.join(", and ")),
    };
    let evidence = match beyond.is_empty() {
        true => fit.structure.in_words(),
        false => format!("as stated: {}; with it: {}", fit.as_stated.in_words(), fit.structure.in_words()),
    };
    Decision::by(rule, choice, evidence)
}

fn single_causes(evaluation: &Evaluation) -> Decision {
    let rule = hypothesis_rule();
    let fit = match &evaluation.track_fit {
        Ok(fit) => fit,
        Err(why) => return Decision::by(rule, "not told", why.to_string()),
    };
    let Some(p_value) = fit.p_value_as_stated else {
        return Decision::by(rule, "not told", "none could be tried: the tracks leave them open".to_owned());
    };
    let choice = match rule.rejects(p_value) {
        true => "they have; see what explains the tracks",
        false => "no; what may hide in the noise is in the sigmas of c_d and c_s",
    };
    let p_value = probability(p_value);
    Decision::by(rule, choice, format!("the best of all that were tried, at the stated model: {p_value}"))
}

fn damping_source(evaluation: &Evaluation) -> Decision {
    let chi_squared =
        |chi_squared: Option<f64>| chi_squared.map_or("-".into(), |value| format!("{value:.3}"));
    let tracks = chi_squared(evaluation.track_fit.as_ref().ok().map(|fit| fit.reduced_chi_squared));
    let behind = chi_squared(evaluation.imposed_fit.as_ref().ok().map(|fit| fit.reduced_chi_squared));
    let energies = chi_squared(evaluation.energy_fit.as_ref().ok().map(|fit| fit.reduced_chi_squared));
    let released = evaluation
        .release_fit
        .as_ref()
        .map(|fit| chi_squared(fit.as_ref().ok().map(|fit| fit.reduced_chi_squared)));
    let released = released.map_or_else(String::new, |found| format!(", {found} since the release"));
    let refused: String =
        evaluation.damping.refused.iter().map(|(source, why)| format!("; {source} refused: {why}")).collect();
    Decision::by(
        StatedDamping::rule(),
        evaluation.damping.source.unwrap_or("nothing"),
        format!(
            "reduced chi squared {tracks} of the tracks, {behind} behind body 1, {energies} of the peak energies{released}{refused}"
        ),
    )
}

/// A simpler shape is falsely left in less than this share of subsets, both tests counted (by the tests of the correlation).
const SHAPE_FALSELY_LEFT_PERCENT: f64 = 4.5;

fn shape_function(experiment: &Experiment) -> Decision {
    let tracking = &experiment.tracking;
    let level = 100.0 * ShapeEvidence::SIGNIFICANCE_LEVEL;
    let (text, rate) = match tracking.shape {
        ShapeChoice::ByEvidence => (
            format!(
                "for each subset the simplest that its matches do not reject (Wald's test, {level} % level)"
            ),
            format!(
                "a simpler one falsely left in less than {SHAPE_FALSELY_LEFT_PERCENT} % of subsets, two tests counted"
            ),
        ),
        ShapeChoice::Named(_) => ("as the experiment names it".into(), "not tested".into()),
    };
    Decision::by(
        plain("shape function", text),
        tracking.shape.to_string(),
        format!("interpolation {}; {rate}", tracking.interpolation),
    )
}

/// The chain moves along x; whether its bodies strayed across it is tested on their positions across.
fn motion(map: &ChainMap, tracked: &Tracked) -> Decision {
    let m_per_px = map.m_per_px().value;
    let bodies = tracked.recordings.iter().flat_map(|one| &one.tracks.bodies);
    let tracks: Vec<Vec<Option<f64>>> = bodies.map(|body| across_m(body, m_per_px)).collect();
    let rule = motion_across_rule();
    let along = "1-D, along the chain";
    match motion_across(&tracks) {
        Some(found) if rule.rejects(found.p_value) => {
            let evidence = told(&found, &format!("{:.3} um (rms) across", 1e6 * found.size.value));
            let choice =
                "2-D: bodies move across the chain; what the chain model explains is their motion along it";
            Decision::by(rule, choice, evidence)
        }
        Some(found) => {
            let evidence =
                told(&found, &format!("less than {:.3} um (95 %) across", 1e6 * upper(found.size)));
            Decision::by(rule, along, evidence)
        }
        None => Decision::by(rule, along, "no track is long enough to tell"),
    }
}

fn camera(evaluation: &Evaluation) -> Decision {
    let rule = camera_motion_rule();
    let Some(found) = &evaluation.stabilisation.found else {
        return Decision::by(
            rule,
            "counts as still",
            "no recording shows two bodies that the wave has not reached",
        );
    };
    let departure = &found.departure;
    if rule.rejects(departure.p_value) {
        let evidence =
            told(departure, &format!("{:.3} um (rms) along the chain", 1e6 * departure.size.value));
        return Decision::by(
            rule,
            "it moves; its motion was taken out where bodies at rest tell it",
            evidence,
        );
    }
    let size = format!("less than {:.3} um (95 %) along the chain", 1e6 * upper(departure.size));
    Decision::by(rule, "none", told(departure, &size))
}

fn geometry(evaluation: &Evaluation) -> Decision {
    let rule = plain(
        "geometry of the pictures",
        "a perspective along the picture, a radial distortion, or both, where places at rest or the motion of bodies that several views show tell it: by nine of \
         chi squared for each number beside views that are magnified each for itself, or by five standard deviations; a calibration by a board stays",
    );
    match &evaluation.geometry {
        Some(geometry) => Decision::by(rule, "mapped as bodies tell it", geometry.finding().text),
        None => Decision::by(rule, "as stated", "no body that several views show contradicts it"),
    }
}

/// Positions of a body across the chain, in metres.
fn across_m(followed: &FollowedBody, m_per_px: f64) -> Vec<Option<f64>> {
    followed.positions.iter().map(|found| Some(m_per_px * found.as_ref().ok()?.y_px.value)).collect()
}

/// A test's outcome in words.
fn told(found: &Departure, what: &str) -> String {
    format!(
        "{what}; chi squared {:.1} of {} degrees of freedom, {}",
        found.chi_squared,
        found.degrees_of_freedom,
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
    let rule = plain(
        "positions of the stage",
        "refined where camera.stage_sigma_m states how well they are known; they place subsets on their markers and do not enter \
         displacements",
    );
    Decision::by(rule, if tracked.stages.is_used() { used } else { stated }, evidence)
}

fn drives(experiment: &Experiment, evaluation: &Evaluation) -> Decision {
    let recording_alignments = &evaluation.recording_alignments.of_recordings;
    let n = recording_alignments.len().max(1) as f64;
    let rms = |of: &dyn Fn(&RecordingAlignment) -> Option<Estimate>| {
        let squares: Option<f64> = recording_alignments.iter().map(|one| Some(of(one)?.value.powi(2))).sum();
        squares.map(|squares| (squares / n).sqrt())
    };
    let drives = match rms(&|one| one.drive_deviation) {
        Some(drive) => format!("drives scatter by {:.2} %", 100.0 * drive),
        None => "drives are refused, as two strikers drive the chain".into(),
    };
    let offset_s = rms(&|one| Some(one.trigger_offset_s)).unwrap_or(0.0);
    let rule = plain(
        "differences between trials",
        "always fitted; priors of one frame and 5 % decide what the data leave open",
    );
    let evidence = format!(
        "{drives}, trigger offsets by {:.2} us; aligned in {} round{}; farthest is {}",
        1e6 * offset_s,
        evaluation.stitched.rounds,
        if evaluation.stitched.rounds == 1 { "" } else { "s" },
        farthest_drive(experiment, &evaluation.recording_alignments)
            .map_or("none".into(), |drive| drive.as_text())
    );
    Decision::by(rule, "a trigger offset and a drive for each recording, response of second order", evidence)
}

fn alignment_source(evaluation: &Evaluation) -> Decision {
    let (recording_alignments, alignments) =
        (&evaluation.recording_alignments, &evaluation.stitched.alignments);
    let mean_us = |sigma_s: &dyn Fn(usize) -> f64| {
        1e6 * (0..alignments.len()).map(sigma_s).sum::<f64>() / alignments.len().max(1) as f64
    };
    let evidence = format!(
        "offsets are known to {:.3} us on average; to {:.3} us from the onset alone",
        mean_us(&|r| recording_alignments.of_recordings[r].trigger_offset_s.sigma),
        mean_us(&|r| alignments[r].trigger_offset_s.sigma),
    );
    Decision::by(RecordingAlignments::rule(), recording_alignments.source, evidence)
}

fn contact_law(experiment: &Experiment, evaluation: &Evaluation) -> Decision {
    let contact = &experiment.contact;
    let peak = |front: &chainwave_analysis::GapFront| front.peak_strain.value.abs();
    let strain = evaluation.measurement.fronts.iter().flatten().map(peak).fold(0.0, f64::max);
    let overlap_m = strain * experiment.chain.mean_pitch_m();
    let rule = softening_rule();
    let stated = contact.laws().next().map_or("none", Law::in_words);
    let largest = match contact.laws().next().map(Law::force_law) {
        Some(Ok(ForceLaw::Power(law))) => {
            let depth = overlap_m / law.delta_0_m;
            // F = A delta_0^p ((1 + y)^p - 1) leaves its tangent by (1 - p) y / 2 to first order.
            let bend = 50.0 * (1.0 - law.p).abs() * depth;
            format!("largest overlap {depth:.3} delta_0, where force leaves the tangent by about {bend:.0} %")
        }
        _ => format!("largest overlap {overlap_m:.2e} m"),
    };
    match tested(evaluation, |departures| &departures.softening) {
        Ok(found) => {
            let choice = if rule.rejects(found.p_value) { stated } else { "a spring would do" };
            let evidence = told(found, &format!("{largest}; softening {}", estimate(found.size)));
            Decision::by(rule, choice, evidence)
        }
        Err(why) => {
            Decision::by(rule, format!("{stated}, as the experiment gives it"), format!("{largest}; {why}"))
        }
    }
}

/// What the tracks say of a simpler model, or why they were not asked.
fn tested(
    evaluation: &Evaluation,
    of: impl Fn(&Departures) -> &Result<Departure, FitError>,
) -> Result<&Departure, String> {
    let departures = evaluation.departures.as_ref().ok_or("not tested, as there is no fit to the tracks")?;
    of(departures).as_ref().map_err(|why| format!("not tested: {why}"))
}

fn damping(evaluation: &Evaluation) -> Decision {
    let rule = damping_rule();
    let stated = &evaluation.damping;
    let found = [&stated.chain_damping_kg_per_s, &stated.striker_damping_kg_per_s];
    if let Err(why @ FitError::NotAsked) = &evaluation.track_fit {
        return Decision::by(rule, "not asked for", why.to_string());
    }
    let Some(source) = stated.source else {
        let reasons: Vec<String> =
            stated.refused.iter().map(|(source, why)| format!("{source}: {why}")).collect();
        return Decision::by(rule, "refused", reasons.join("; "));
    };
    let p_value = |found: &Estimate| normal_beyond(found.value / found.sigma);
    let is_told = found.map(|found| found.as_ref().is_ok_and(|found| rule.rejects(p_value(found))));
    let choice = match is_told {
        [true, true] => "c_d and c_s",
        [true, false] => "c_d (c_s is not told from zero)",
        [false, true] => "c_s (c_d is not told from zero)",
        [false, false] => "none (neither is told from zero)",
    };
    let said = |name: &str, found: &Result<Estimate, String>| match found {
        Ok(found) => {
            format!("{name} = {:.2} sigma, {}", found.value / found.sigma, probability(p_value(found)))
        }
        Err(why) => format!("{name} is refused: {why}"),
    };
    let evidence = format!("from the {source}: {}; {}", said("c_d", found[0]), said("c_s", found[1]));
    Decision::by(rule, choice, evidence)
}

fn scatter(evaluation: &Evaluation) -> Decision {
    let rule = scatter_of_bodies_rule();
    let beyond = evaluation.track_fit.as_ref().map_or(&[][..], |fit| fit.beyond.as_slice());
    let scatters =
        |one: &&Hypothesis| matches!(one, Hypothesis::MassesScatter | Hypothesis::StiffnessScatters);
    if let (Some(one), Ok(fit)) = (beyond.iter().find(scatters), &evaluation.track_fit) {
        let choice = format!("bodies differ: the tracks move as if {}", one.in_words());
        return Decision::by(rule, choice, fit.as_stated.in_words());
    }
    match tested(evaluation, |departures| &departures.scatter) {
        Ok(found) if rule.rejects(found.p_value) => {
            let evidence = told(found, &format!("{} % in mass", estimate(found.size.scaled(100.0))));
            let choice =
                "bodies differ; one mass stands for all in the fit, whose residuals say what that costs";
            Decision::by(rule, choice, evidence)
        }
        Ok(found) => {
            let size = format!("less than {:.3} % in mass (95 %)", 100.0 * upper(found.size));
            Decision::by(rule, "none: bodies are alike", told(found, &size))
        }
        Err(why) => Decision::by(rule, "bodies count as alike", why),
    }
}

fn peaks(evaluation: &Evaluation) -> Decision {
    let rule = plain(
        "where peaks are read",
        "from the samples above 80 % of each peak, unless those above 90 % say otherwise by more than noise, all gaps together (mean square, or mean, of time \
         or strain by three standard deviations); then above 90 %, and by the same test above 95 %",
    );
    let share = 100.0 * evaluation.measurement.front.peak_fraction;
    let text = "a polynomial of order six; what a gap's peak still moves by beyond chance from half as far down is in its uncertainty";
    Decision::by(rule, format!("above {share:.0} % of each peak"), text)
}

fn group_velocity(evaluation: &Evaluation) -> Decision {
    let rule = one_speed_rule();
    let found = match &evaluation.measurement.group_velocity {
        Ok(found) => found,
        Err(reason) => {
            return Decision::by(rule, "not told", format!("no group velocity: {}", reason.as_str()));
        }
    };
    let Some((variation, p_value)) = found.relative_variation.zip(found.variation_p_value()) else {
        return Decision::by(rule, "not told", "fewer than six gaps");
    };
    let variation = variation.scaled(100.0);
    let choice = match rule.rejects(p_value) {
        true => "it varies; the speed stated is that of the line through all gaps",
        false => "one speed",
    };
    let evidence = format!(
        "last third less first: {:+.3} +- {:.3} %, {}",
        variation.value,
        variation.sigma,
        probability(p_value)
    );
    Decision::by(rule, choice, evidence)
}

fn tail(experiment: &Experiment, evaluation: &Evaluation) -> Decision {
    let rule = line_rule();
    let resonance = match &evaluation.measurement.local_resonance {
        Ok(resonance) => resonance,
        Err(reason) => return Decision::by(rule, "not told", reason.as_str()),
    };
    let choice = match rule.rejects(resonance.line.p_value) {
        true => "a line",
        false => "the crest of a continuum, as dispersion makes it",
    };
    let band = match experiment.band_edge_hz() {
        Ok(band_edge_hz) => format!("the chain's band ends at {band_edge_hz:.0} Hz"),
        Err(why) => why.to_string(),
    };
    let evidence = format!(
        "{:.1} Hz, resolution {:.0} Hz, p = {:.2e} over {} gaps; {band}",
        resonance.frequency_hz.value, resonance.resolution_hz, resonance.line.p_value, resonance.line.n_gaps,
    );
    Decision::by(rule, choice, evidence)
}
