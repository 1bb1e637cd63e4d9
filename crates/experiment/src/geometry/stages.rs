//! Where the stage really stood in each view, from the bodies that views share.
//!
//! A body at rest bears the same marker in every view that shows it. The mean frame at rest of one recording is matched in that
//! of another, and the difference of the two places in the plane of the chain is the step of the stage between their views, to a
//! thousandth of a pixel where a stage's scale may be read to 20 um. Displacements from rest do not feel the stage, and so
//! nothing that follows from them does; what it decides is where subsets lie on their markers.

use std::num::NonZero;

use chainwave_correlation::Method;
use chainwave_measurement::{Estimate, map_in_parallel};
use chainwave_stitching::{StageStep, refine_stages};

use crate::configuration::Trial;
use crate::geometry::geometry_at_rest::{Bent, bent};
use crate::geometry::marker_pair::{AtRest, MarkerPair};
use crate::geometry::scale::{ScaleCheck, SharedBody, StatedScale};
use crate::input::numbers::{NotNegative, Positive};
use crate::setup::Setup;

/// Where the stage stood in each view.
#[derive(Clone)]
pub struct Stages {
    views: Vec<View>,
    /// Between views that share bodies, as the trials table states them and as the pictures have them.
    steps_m: Vec<StatedStep>,
    /// Why the steps could not be solved for, where they could not.
    unsolved: Option<String>,
    /// Whether positions count as refined wherever they are used, for which their stated ones need an uncertainty.
    is_used: bool,
    /// What the steps and the bodies' sizes say of the pictures' scale.
    pub(crate) scale: ScaleCheck,
    /// What that rests on.
    shared: Vec<SharedBody>,
    stated_scale: StatedScale,
}

/// A step of the stage between two views.
#[derive(Debug, Clone)]
pub(crate) struct StatedStep {
    pub(crate) views: [u32; 2],
    pub(crate) stated_m: f64,
    pub(crate) found_m: Estimate,
}

/// Recordings that were made with the stage in one place.
#[derive(Clone)]
struct View {
    number: u32,
    stated_m: f64,
    trials: Vec<Trial>,
    /// Where it stood.
    refined_m: Option<Estimate>,
    /// Where it seems to have stood if no view is magnified: there the stated scale finds the bodies.
    seen_m: Option<Estimate>,
}

impl Stages {
    /// Matches what the views of some trials share. A recording that cannot be read is passed over here: tracking names it. Steps that
    /// cannot be solved for leave the positions as they are stated.
    pub(crate) fn refine(setup: &Setup, trials: &[Trial], method: Method, n_threads: NonZero<usize>) -> Self {
        let mut views = views(trials);
        let sigma_m = stage_sigma_m(setup);
        let pairs: Vec<[usize; 2]> =
            (0..views.len()).flat_map(|one| (one + 1..views.len()).map(move |other| [one, other])).collect();
        let between =
            map_in_parallel(pairs.len(), n_threads, |i| steps_between(setup, &views, pairs[i], method));
        let (steps, shared): (Vec<Vec<StageStep>>, Vec<Vec<SharedBody>>) =
            between.into_iter().map(|of_pair| of_pair.into_iter().unzip()).unzip();
        let stated_m: Vec<f64> = views.iter().map(|view| view.stated_m).collect();
        let stated_scale = stated_scale(setup, &views);
        let scale = ScaleCheck::of(&shared.concat(), &stated_scale);
        let of_pair = |(steps, bodies): (&Vec<StageStep>, &Vec<SharedBody>)| {
            steps.iter().zip(bodies).map(|(step, body)| scale.levelled_step(step, body)).collect::<Vec<_>>()
        };
        let levelled: Vec<Vec<StageStep>> = steps.iter().zip(&shared).map(of_pair).collect();
        let steps_m = levelled.iter().filter_map(|steps| stated_step(&views, steps)).collect();
        let seen = refine_stages(&stated_m, sigma_m, &steps.concat());
        let refined = refine_stages(&stated_m, sigma_m, &levelled.concat());
        let unsolved = refined.as_ref().err().map(ToString::to_string);
        let solved = seen.into_iter().flatten().zip(refined.into_iter().flatten());
        views.iter_mut().zip(solved).for_each(|(view, found)| (view.seen_m, view.refined_m) = found);
        let (is_used, shared) = (sigma_m.is_some(), shared.concat());
        Self { views, steps_m, unsolved, is_used, scale, shared, stated_scale }
    }

    /// As far as subsets are placed by them: where stated positions are exact, views are not matched for what nobody asks then.
    pub(crate) fn for_placing(
        setup: &Setup,
        trials: &[Trial],
        method: Method,
        n_threads: NonZero<usize>,
    ) -> Self {
        match stage_sigma_m(setup) {
            Some(_) => Self::refine(setup, trials, method, n_threads),
            None => Self::as_stated(setup, trials, &[]),
        }
    }

    /// The positions of some trials as they are stated, and of the scale what bodies shown by two views say of it.
    pub(crate) fn as_stated(setup: &Setup, trials: &[Trial], shared: &[SharedBody]) -> Self {
        let views = views(trials);
        let stated_scale = stated_scale(setup, &views);
        Self {
            scale: ScaleCheck::of(shared, &stated_scale),
            shared: shared.to_vec(),
            stated_scale,
            views,
            steps_m: Vec::new(),
            unsolved: None,
            is_used: false,
        }
    }

    /// What bodies at rest say of the pictures' geometry.
    pub(crate) fn bent(&self) -> Option<Bent> {
        bent(&self.shared, &self.stated_scale)
    }

    /// What the pictures say of the scale where what is seen at a place from their middle stands at another one (both in metres).
    pub(crate) fn scale_by(&self, place_m: impl Fn(f64) -> f64) -> ScaleCheck {
        let shared: Vec<SharedBody> = self.shared.iter().map(|body| body.mapped(&place_m)).collect();
        ScaleCheck::of(&shared, &self.stated_scale)
    }

    /// Steps of the stage between views that share bodies.
    pub(crate) fn steps_m(&self) -> &[StatedStep] {
        &self.steps_m
    }

    /// Why the steps could not be solved for, where they could not.
    pub(crate) fn unsolved(&self) -> Option<&str> {
        self.unsolved.as_deref()
    }

    /// The refined position of a recording's stage, where another view ties it down.
    pub fn refined_m(&self, trial: &Trial) -> Option<Estimate> {
        self.views.iter().find(|view| view.holds(trial)).and_then(|view| view.refined_m)
    }

    /// The position that a recording's subsets are placed by.
    pub fn placing_m(&self, trial: &Trial) -> f64 {
        let view = self.views.iter().find(|view| view.holds(trial)).filter(|_| self.is_used);
        view.and_then(|view| view.seen_m).map_or(trial.stage_m, |seen_m| seen_m.value)
    }

    /// Whether subsets are placed by the refined positions.
    pub fn is_used(&self) -> bool {
        self.is_used
    }

    /// The largest correction with its uncertainty, in metres, and the number of views refined.
    pub fn largest_correction_m(&self) -> Option<(Estimate, usize)> {
        let correction = |view: &View| {
            view.refined_m.map(|refined| Estimate::new(refined.value - view.stated_m, refined.sigma))
        };
        let corrections: Vec<Estimate> = self.views.iter().filter_map(correction).collect();
        let largest = corrections.iter().max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
        largest.map(|largest| (*largest, corrections.len()))
    }
}

/// Standard uncertainty of the stage's positions, in metres, where one is stated.
fn stage_sigma_m(setup: &Setup) -> Option<f64> {
    setup.experiment.camera.stage_sigma_m.map(NotNegative::get).filter(|sigma_m| *sigma_m > 0.0)
}

/// What an experiment states of the scale of views.
fn stated_scale(setup: &Setup, views: &[View]) -> StatedScale {
    let scale = setup.map.m_per_px();
    StatedScale {
        stage_sigma_m: stage_sigma_m(setup),
        m_per_px: scale.value,
        sigma: scale.sigma / scale.value,
        view_sigma: setup.experiment.camera.view_scale_sigma.map(Positive::get),
        views: views.iter().map(|view| view.number).collect(),
    }
}

/// The weighted mean of the steps between two views, with what shared errors add; they scatter as they do, or as they state.
fn stated_step(views: &[View], steps: &[StageStep]) -> Option<StatedStep> {
    let first = steps.first()?;
    let weight = |step: &StageStep| step.step_m.sigma.powi(-2);
    let weights: f64 = steps.iter().map(weight).sum();
    let mean_m = steps.iter().map(|step| weight(step) * step.step_m.value).sum::<f64>() / weights;
    let chi_squared: f64 = steps.iter().map(|step| weight(step) * (step.step_m.value - mean_m).powi(2)).sum();
    let enlargement = (chi_squared / (steps.len() as f64 - 1.0).max(1.0)).max(1.0);
    let shared_m2: f64 = first.shared_m.iter().map(|shared_m| shared_m.powi(2)).sum();
    let sigma_m = (enlargement / weights + shared_m2).sqrt();
    Some(StatedStep {
        views: [views[first.from].number, views[first.to].number],
        stated_m: views[first.to].stated_m - views[first.from].stated_m,
        found_m: Estimate::new(mean_m, sigma_m),
    })
}

impl View {
    fn holds(&self, trial: &Trial) -> bool {
        self.trials[0].is_of_one_place_with(trial)
    }
}

fn views(trials: &[Trial]) -> Vec<View> {
    let view = |trials: Vec<Trial>| View {
        number: trials[0].view,
        stated_m: trials[0].stage_m,
        trials,
        refined_m: None,
        seen_m: None,
    };
    Trial::by_place(trials).into_iter().map(view).collect()
}

/// Every recording of one view beside one of the other: the scatter of their steps tells whether bodies come back to their places.
fn steps_between(
    setup: &Setup,
    views: &[View],
    [one, other]: [usize; 2],
    method: Method,
) -> Vec<(StageStep, SharedBody)> {
    let shared = |pair: MarkerPair| {
        let step = pair.step([one, other], method)?;
        let stated_m = views[other].stated_m - views[one].stated_m;
        let body = SharedBody {
            body: pair.body,
            views: [one, other].map(|view| views[view].number),
            stated_m,
            from_middle_m: pair.offset_from_middle_m(),
            found_m: step.step_m,
            magnified: pair.magnified(method),
        };
        Some((step, body))
    };
    let trials = views[one].trials.iter().zip(&views[other].trials);
    let steps = trials.filter_map(|(first, second)| {
        let (first, second) = (AtRest::of(setup, first).ok()?, AtRest::of(setup, second).ok()?);
        Some(first.shared_with(&second).filter_map(shared).collect::<Vec<_>>())
    });
    steps.flatten().collect()
}
