//! Whether the stage stood where the trials table has it: bodies in every view, the same bodies where views overlap, steps and pictures
//! that agree.

use std::collections::BTreeMap;
use std::f64::consts::SQRT_2;

use chainwave_measurement::{Estimate, RecordingInfo};

use super::resting::Resting;
use super::same_markers::same_markers;
use super::view_at_rest::ViewAtRest;
use crate::configuration::Trial;
use crate::error::Error;
use crate::finding::{Finding, Sanity};
use crate::geometry::stages::{Stages, StatedStep};
use crate::input::numbers::NotNegative;
use crate::recordings::view::bodies_in_view;
use crate::setup::Setup;

/// Another meaning of a stage's position.
struct Meaning {
    what: &'static str,
    position_m: fn(f64, f64) -> f64,
}

/// What a position may have meant, from the position as it stands and the pitch.
const MEANINGS: [Meaning; 5] = [
    Meaning { what: "does it count the other way?", position_m: |stage_m, _| -stage_m },
    Meaning { what: "is it in millimetres?", position_m: |stage_m, _| 1e-3 * stage_m },
    Meaning {
        what: "is it in millimetres, and does it count the other way?",
        position_m: |stage_m, _| -1e-3 * stage_m,
    },
    Meaning { what: "is it a pitch too far?", position_m: |stage_m, pitch_m| stage_m - pitch_m },
    Meaning { what: "is it a pitch too near?", position_m: |stage_m, pitch_m| stage_m + pitch_m },
];

/// Those of [`MEANINGS`] that all positions may have in common; a pitch too far in all of them is a matter of the first body's place.
const N_IN_COMMON: usize = 3;

/// Views in which no body lies are left out.
///
/// # Errors
/// [`Error::Configuration`] where no view has a body.
pub(super) fn empty_views(setup: &Setup, views: &[ViewAtRest], sanity: &mut Sanity) -> Result<(), Error> {
    // A scale or pitch that is wrong moves bodies out of every view: the stage is then no cause.
    let is_scale_doubted = sanity.findings.iter().any(|finding| finding.code == "scale");
    for view in views.iter().filter(|view| view.bodies.is_empty()) {
        let info = view.recording.info();
        let stage_m = view.trial.stage_m;
        let first = setup.map_of(&view.trial, info).rest_px(1, stage_m);
        let place = first.map_or("far outside the picture".into(), |[x, y]| format!("at ({x:.0}, {y:.0})"));
        let shown = |meaning: &&Meaning| {
            let other_m = (meaning.position_m)(stage_m, setup.experiment.chain.mean_pitch_m());
            let moved = Trial { stage_m: other_m, ..view.trial.clone() };
            !bodies_in_view(setup, &moved, view.recording.info()).is_empty()
        };
        let hint = MEANINGS
            .iter()
            .take(N_IN_COMMON)
            .filter(|_| !is_scale_doubted)
            .find(shown)
            .map_or(String::new(), |meaning| format!(" (hint: {})", meaning.what));
        let (size, name) = (format!("{} x {} px", info.width_px, info.height_px), view.name());
        let tracking = &setup.experiment.tracking;
        let is_shown = first.is_some_and(|place| is_within(place, info));
        let reason = match is_shown && hint.is_empty() {
            true => format!(
                "no subset fits into the {size} of {name}: that of body 1, {} x {} px, would be {place} (hint: a smaller \
                 tracking.half_width_px or half_height_px, or another camera.first_body_px)",
                2 * tracking.half_width_px + 1,
                2 * tracking.half_height_px + 1
            ),
            false => format!("no body lies in the {size} of {name}: body 1 would be {place}{hint}"),
        };
        sanity.leave_out(&view.trials, &reason);
    }
    match views.iter().all(|view| view.bodies.is_empty()) {
        false => Ok(()),
        true => Err(Error::Configuration {
            path: setup.path.clone(),
            message: format!(
                "camera.first_body_px, the scale and stage_m: expected bodies in at least one view, found: {}",
                sanity.left_out.first().map_or("none", |one| &one.reason)
            ),
        }),
    }
}

/// Whether a place, as column and row, lies in a picture.
fn is_within([x_px, y_px]: [f64; 2], info: &RecordingInfo) -> bool {
    let is_between = |place_px: f64, size: usize| (0.0..=size as f64 - 1.0).contains(&place_px);
    is_between(x_px, info.width_px) && is_between(y_px, info.height_px)
}

/// Views that should show a body of another view, and show another one there. Where another meaning of the stage's position finds the
/// same body, the view is left out: its bodies would be taken for others. So are views that should share none, and do by another meaning, but
/// where bodies look alike. Whether they do, views of one body do not show: one of them is doubted, several tell that markers are alike.
///
/// # Errors
/// [`Error::Configuration`] where all positions together mean something else: no view's bodies are then known.
pub(super) fn other_bodies(setup: &Setup, views: &[ViewAtRest], sanity: &mut Sanity) -> Result<(), Error> {
    let order = outwards(views);
    if let Some(meaning) = meaning_of_all(setup, &order) {
        return Err(Error::Configuration {
            path: setup.path.clone(),
            message: format!(
                "stage_m of all views: expected the same bodies where views overlap, found other ones, and the same where every position is \
                 taken otherwise (hint: {})",
                meaning.what
            ),
        });
    }
    let mut believed: Vec<Believed> = Vec::new();
    let mut of_one_body: Vec<Finding> = Vec::new();
    for view in order {
        let finding = |text| Finding { code: "other_bodies", subject: view.name(), text };
        match judged(setup, &believed, view) {
            Judged::Sound => {}
            Judged::Doubted(text) => sanity.findings.push(finding(text)),
            Judged::OfOneBody(text) => of_one_body.push(finding(text)),
            Judged::LeftOut(why) => {
                sanity.leave_out(&view.trials, &format!("{}: {why}", view.name()));
                continue;
            }
        }
        believed.push(Believed { view, resting: Resting::of(setup, &view.trial) });
    }
    if let [alone] = of_one_body.as_slice() {
        sanity.findings.push(alone.clone());
    }
    Ok(())
}

/// Views with bodies, from the one whose stage moved least, which is believed, to those that are compared outwards from it.
fn outwards(views: &[ViewAtRest]) -> Vec<&ViewAtRest> {
    let mut order: Vec<&ViewAtRest> = views.iter().filter(|view| !view.bodies.is_empty()).collect();
    order.sort_by(|a, b| a.trial.stage_m.abs().total_cmp(&b.trial.stage_m.abs()));
    order
}

/// The meaning by which views show the same bodies where they overlap, and as they stand none does: where no position is zero, the view that is
/// believed is wrong with the others.
fn meaning_of_all(setup: &Setup, order: &[&ViewAtRest]) -> Option<&'static Meaning> {
    let nearest = order.first().filter(|view| view.trial.stage_m != 0.0)?;
    let pitch_m = setup.experiment.chain.mean_pitch_m();
    let by = |meaning: &Meaning| {
        let position_m = |view: &ViewAtRest| (meaning.position_m)(view.trial.stage_m, pitch_m);
        let moved: Vec<ViewAtRest> = order.iter().map(|view| view.moved(setup, position_m(view))).collect();
        agreement(setup, &outwards(&moved))
    };
    if agreement(setup, order) != Agreement::OfNone {
        return None;
    }
    let moves = |meaning: &&Meaning| {
        let stated_m = nearest.trial.stage_m;
        (meaning.position_m)(stated_m, pitch_m).total_cmp(&stated_m).is_ne()
    };
    MEANINGS.iter().take(N_IN_COMMON).filter(moves).find(|meaning| by(meaning) == Agreement::OfAll)
}

/// How many of the views that should share bodies do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Agreement {
    /// No two views should share any.
    Unknown,
    OfNone,
    OfSome,
    OfAll,
}

fn agreement(setup: &Setup, order: &[&ViewAtRest]) -> Agreement {
    let mut believed: Vec<Believed<'_>> = Vec::new();
    let (mut n_same, mut n_other) = (0, 0);
    for view in order {
        match compared(setup, &believed, view, &view.trial) {
            Compared::SameBodies => n_same += 1,
            Compared::OtherBodies(_) => n_other += 1,
            Compared::NothingShared => {}
        }
        believed.push(Believed { view, resting: Resting::of(setup, &view.trial) });
    }
    match (n_same, n_other) {
        (0, 0) => Agreement::Unknown,
        (0, _) => Agreement::OfNone,
        (_, 0) => Agreement::OfAll,
        _ => Agreement::OfSome,
    }
}

/// A view that others are compared with.
struct Believed<'a> {
    view: &'a ViewAtRest,
    resting: Resting,
}

/// What becomes of a view, and why.
enum Judged {
    Sound,
    Doubted(String),
    /// Its only body looks like one of another view, which it is, or as its marker is the same.
    OfOneBody(String),
    LeftOut(String),
}

fn judged(setup: &Setup, believed: &[Believed<'_>], view: &ViewAtRest) -> Judged {
    match compared(setup, believed, view, &view.trial) {
        Compared::SameBodies => Judged::Sound,
        Compared::OtherBodies(beside) => {
            let what = format!("bodies that {beside} shows too look different there");
            match other_meaning(setup, believed, view) {
                Some(meaning) => {
                    Judged::LeftOut(format!("{what}, and are found elsewhere (stage_m: {})", meaning.what))
                }
                None => Judged::Doubted(format!("{what} (hint: is stage_m right, and the light the same?)")),
            }
        }
        Compared::NothingShared => {
            let Some(meaning) = other_meaning(setup, believed, view) else { return Judged::Sound };
            let what = format!(
                "it should share no body with views nearer to stage 0, and shows one of theirs (stage_m: {})",
                meaning.what
            );
            let shown = Resting::of(setup, &view.trial).shown;
            // Of bodies that look alike, one may be taken for another anywhere.
            match shown {
                Some(shown) if shown.n_bodies() == 1 => Judged::OfOneBody(what),
                Some(shown) if shown.has_twins(setup.method()) => Judged::Doubted(what),
                _ => Judged::LeftOut(what),
            }
        }
    }
}

/// The meaning of the stage's position by which a view shows a body of those that are believed.
fn other_meaning(setup: &Setup, believed: &[Believed<'_>], view: &ViewAtRest) -> Option<&'static Meaning> {
    let pitch_m = setup.experiment.chain.mean_pitch_m();
    MEANINGS.iter().find(|meaning| {
        let stage_m = (meaning.position_m)(view.trial.stage_m, pitch_m);
        let moved = Trial { stage_m, ..view.trial.clone() };
        matches!(compared(setup, believed, view, &moved), Compared::SameBodies)
    })
}

/// What a view shows of the bodies of others.
enum Compared {
    NothingShared,
    SameBodies,
    /// None of the bodies that it should share with this view.
    OtherBodies(String),
}

/// The view as a trial has its stage, beside those that are believed.
fn compared(setup: &Setup, believed: &[Believed<'_>], view: &ViewAtRest, trial: &Trial) -> Compared {
    let numbers: Vec<usize> =
        bodies_in_view(setup, trial, view.recording.info()).into_iter().map(|(body, _)| body).collect();
    let shares = |other: &&Believed<'_>| other.view.bodies.iter().any(|(body, _)| numbers.contains(body));
    // The views nearest along the chain share most.
    let mut sharing = believed.iter().rev().filter(shares).peekable();
    if sharing.peek().is_none() {
        return Compared::NothingShared;
    }
    let resting = Resting::of(setup, trial);
    let mut beside = None;
    for other in sharing {
        match same_markers(setup.method(), &other.resting, &resting) {
            Some(true) => return Compared::SameBodies,
            Some(false) => {
                beside.get_or_insert_with(|| other.view.name());
            }
            None => {}
        }
    }
    beside.map_or(Compared::NothingShared, Compared::OtherBodies)
}

/// Relative difference of the stage's steps by pictures and by the table from which on it matters.
const LEAST_SHARE: f64 = 1e-3;
/// Standard deviations from which on a difference is none of chance.
const SIGMAS: f64 = 4.0;

/// Steps of the stage that the pictures contradict: all of them in proportion, as of a wrong scale, or one by itself.
pub(super) fn contradicted(setup: &Setup, stages: &Stages) -> Vec<Finding> {
    let steps = stages.steps_m();
    let stage_sigma_m = setup.experiment.camera.stage_sigma_m.map_or(0.0, NotNegative::get);
    let unsolved = stages.unsolved().map(|reason| Finding {
        code: "stage_steps",
        subject: "stage_m".into(),
        text: format!("{reason}: positions stay as trials.csv states them"),
    });
    let mut findings: Vec<Finding> = unsolved.into_iter().collect();
    let Some(slope) = slope(steps, stage_sigma_m) else { return findings };
    let is_off = (slope.value - 1.0).abs() > LEAST_SHARE.max(SIGMAS * slope.sigma);
    if is_off {
        let px_per_m = setup.map.m_per_px().value.recip();
        findings.push(Finding {
            code: "stage_steps",
            subject: format!("{} and stage_m", super::stated::scale_key(setup)),
            text: format!(
                "by the bodies that views share the stage moved {:.5} +- {:.5} times as far as trials.csv states: a scale of {:.2} px/m in place \
                 of {px_per_m:.2} would agree, else the stage is off by {:+.2} %",
                slope.value,
                slope.sigma,
                slope.value * px_per_m,
                100.0 * (slope.value - 1.0)
            ),
        });
    }
    let in_proportion = if is_off { slope.value } else { 1.0 };
    // Half a pixel puts no subset off its marker.
    let least_m = 0.5 * setup.map.m_per_px().value;
    for step in steps {
        let off_m = step.found_m.value - in_proportion * step.stated_m;
        // The stage may be off in both places.
        if off_m.abs() > least_m.max(SIGMAS * step.found_m.sigma.hypot(SQRT_2 * stage_sigma_m)) {
            findings.push(Finding {
                code: "stage_steps",
                subject: format!("views {} and {}", step.views[0], step.views[1]),
                text: format!(
                    "by the bodies that they share the stage moved {:.4} +- {:.4} mm between them, {:.4} mm by trials.csv",
                    1e3 * step.found_m.value,
                    1e3 * step.found_m.sigma,
                    1e3 * step.stated_m
                ),
            });
        }
    }
    findings
}

/// How many times as far as stated the stage moved, over all steps.
fn slope(steps: &[StatedStep], stage_sigma_m: f64) -> Option<Estimate> {
    let squares: f64 = steps.iter().map(|step| step.stated_m.powi(2)).sum();
    if squares <= 0.0 {
        return None;
    }
    let products: f64 = steps.iter().map(|step| step.stated_m * step.found_m.value).sum();
    let noise: f64 = steps.iter().map(|step| (step.stated_m * step.found_m.sigma).powi(2)).sum();
    // A place of the stage counts in the steps to it and from it.
    let mut of_places: BTreeMap<u32, f64> = BTreeMap::new();
    for step in steps {
        for (view, sign) in step.views.into_iter().zip([-1.0, 1.0]) {
            *of_places.entry(view).or_default() += sign * step.stated_m;
        }
    }
    let of_places: f64 = of_places.values().map(|moved| (moved * stage_sigma_m).powi(2)).sum();
    Some(Estimate::new(products / squares, (noise + of_places).sqrt() / squares))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_in_proportion_tell_a_scale() {
        let step = |stated_m: f64| StatedStep {
            views: [1, 2],
            stated_m,
            found_m: Estimate::new(1.01 * stated_m, 1e-6),
        };
        let told = slope(&[step(0.12), step(0.24)], 0.0).unwrap();
        assert!((told.value - 1.01).abs() < 1e-12 && told.sigma < 1e-5, "{told:?}");
        // Three places in a row, the stage off by 0.1 mm in each: what it is off in the middle goes from one step to the next.
        let row = [step(0.12), StatedStep { views: [2, 3], ..step(0.12) }];
        let told = slope(&row, 1e-4).unwrap();
        let expected = 2.0_f64.sqrt() * 0.12 * 1e-4 / (2.0 * 0.12 * 0.12);
        assert!((told.sigma / expected - 1.0).abs() < 1e-3, "{told:?}");
        assert!(slope(&[], 0.0).is_none() && slope(&[step(0.0)], 0.0).is_none());
    }
}
