//! Recordings merged to one motion, with every error that its samples share.

pub(crate) mod between_views;
mod by_neighbours;
pub(crate) mod direction;
pub(crate) mod inclination;
pub(crate) mod joining;
pub(crate) mod joint;
pub(crate) mod picture_errors;
pub(crate) mod picture_geometry;
mod rounding;
pub(crate) mod shared_errors;
pub(crate) mod side_motion;
pub(crate) mod stabilisation;
pub(crate) mod usual_geometry;

use std::num::NonZero;

use chainwave_measurement::{SharedReadingError, both_in_parallel};
use chainwave_stitching::{Assumption, FirstBody, Settings, merge};

use crate::chain::stated_motion::StatedMotion;
use crate::configuration::Experiment;
use crate::error::Error;
use crate::finding::Finding;
use crate::input::numbers::{NotNegative, Positive};
use crate::merging::between_views::BetweenViews;
use crate::merging::direction::against_the_chain;
use crate::merging::inclination::Inclination;
use crate::merging::joint::Joint;
use crate::merging::picture_geometry::PictureGeometry;
use crate::merging::rounding::rounding_errors;
use crate::merging::shared_errors::SharedErrors;
use crate::merging::side_motion::SideMotion;
use crate::merging::usual_geometry::UsualGeometry;
use crate::sanity::MOVING_LIGHT;
use crate::setup::Setup;
use crate::timing::unresolved::UnresolvedMotion;
use crate::tracked::Tracked;

/// Recordings merged to one motion.
pub(crate) struct Merged<'a> {
    /// The recordings as they were joined, with the motion that has every error, and the positions as fits take them.
    pub(crate) joint: Joint<'a>,
    /// What the reader should know of the camera.
    pub(crate) of_camera: Vec<Finding>,
    pub(crate) shared: SharedErrors,
    pub(crate) side_motion: SideMotion,
    /// By how much displacements may be too small, relative to themselves, as bodies move at an angle to the pictures' rows.
    pub(crate) shortening: f64,
    /// The errors that their readings share.
    pub(crate) reading_errors: Vec<SharedReadingError>,
    /// What a camera that nothing calibrated leaves open, where nothing was told of it.
    pub(crate) usual_geometry: UsualGeometry,
    /// What was taken to be so.
    pub(crate) assumptions: Vec<Assumption>,
}

/// What is not known of the pictures' geometry and of clocks, and how far references without noise are off.
fn errors_of_readings(joint: &Joint<'_>) -> Vec<SharedReadingError> {
    let rest_until_s = joint.setup.experiment.tracking.rest_until_s;
    [
        joint.geometry_errors.clone(),
        joint.clocks.errors(&joint.observations),
        rounding_errors(&joint.observations, rest_until_s, joint.setup.map.m_per_px().value),
    ]
    .concat()
}

/// Merges recordings. What the camera does of its own is taken out of them first, or else stands among the motion's errors.
pub(crate) fn merged<'a>(
    setup: &'a Setup,
    tracked: &Tracked,
    stated: &StatedMotion,
    n_threads: NonZero<usize>,
) -> Result<Merged<'a>, Error> {
    let experiment = &setup.experiment;
    let settings = Settings { n_threads, ..stitching_settings(experiment, stated) };
    let mut joint = Joint::of(setup, tracked, stated, &settings)?;
    let rest_until_s = experiment.tracking.rest_until_s;
    let picture_errors = joint.picture_errors();
    let of_views = joint.scale.reading_errors(&joint.observations, rest_until_s);
    let of_readings = errors_of_readings(&joint);
    let of_views = [of_views, of_readings.clone()].concat();
    let with = |reading_errors| Settings { reading_errors, ..settings.clone() };
    if !of_views.is_empty() {
        joint.stitched = merge(&joint.observations, &with(of_views.clone()))?;
    }
    let without_pictures = joint.stitched.motion.clone();
    let apart = picture_errors.apart();
    // By readings whose sigmas contain what pictures add to the noise of a body that moves, which is as white.
    let unresolved = UnresolvedMotion::of(&joint.observations, rest_until_s);
    if picture_errors.is_found() {
        joint.observations = apart.noise_of(joint.observations);
        joint.stitched =
            merge(&joint.observations, &with([of_views.clone(), apart.errors.clone()].concat()))?;
    }
    let as_merged = |observations| apart.noise_of(joint.stabilisation.steadied(observations));
    let Joint { setup: mapped, recordings, stabilisation, stitched, .. } = &joint;
    let (side_motion, shared) = both_in_parallel(
        n_threads,
        || SideMotion::of(mapped, recordings, stabilisation, &settings, stitched, n_threads),
        || SharedErrors::of(mapped, recordings, &as_merged, &settings, stitched, n_threads),
    );
    let (mut side_motion, shared) = (side_motion?, shared?);
    side_motion.widen(&without_pictures, &stitched.motion);
    let inclination = Inclination::of(&joint.stitched.motion, &side_motion);
    let rests_until_s = &joint.stabilisation.rests_until_s;
    let between_views = joint.between_views(&picture_errors);
    let of_each_view =
        between_views.map_or_else(Vec::new, |found| found.errors(&joint.observations, rests_until_s));
    if !of_each_view.is_empty() {
        let errors = [of_views, apart.errors.clone(), of_each_view.clone()].concat();
        joint.stitched = merge(&joint.observations, &with(errors))?;
    }
    add_errors(&mut joint, &shared, &unresolved, inclination.as_ref());
    joint.observations = joint.stabilisation.widened(joint.observations);
    let of_directions = inclination
        .as_ref()
        .map_or_else(Vec::new, |found| found.reading_errors(&joint.observations, rest_until_s));
    let usual_geometry = UsualGeometry::of(&joint, n_threads);
    let light_moves = tracked.findings.iter().any(|finding| finding.code == MOVING_LIGHT);
    let of_camera = [
        against_the_chain(experiment, &joint.stitched.motion).into_iter().collect(),
        joint.geometry.iter().map(PictureGeometry::finding).collect(),
        joint.clocks.findings(&joint.observations),
        Finding::all_of("camera_moves", "the camera", joint.stabilisation.warning(light_moves)),
        Finding::all_of("precursor", "bodies ahead of the wave", joint.stabilisation.precursor()),
        Finding::all_of("scale", "camera.scale_px_per_m", joint.scale.warnings()),
        Finding::all_of("picture_errors", "the pictures", picture_errors.warnings(light_moves)),
        Finding::all_of("frame_rate", "the frame rate", unresolved.warning()),
        between_views.iter().map(BetweenViews::finding).collect(),
        inclination.iter().map(Inclination::finding).collect(),
        side_motion.findings.clone(),
    ];
    Ok(Merged {
        of_camera: of_camera.concat(),
        shared,
        side_motion,
        shortening: inclination.as_ref().map_or(0.0, Inclination::of_scale),
        reading_errors: [apart.errors, of_each_view, of_readings, of_directions].concat(),
        assumptions: settings.assumptions().into_iter().chain(usual_geometry.assumption()).collect(),
        usual_geometry,
        joint,
    })
}

/// Adds what merging did not add to the errors of the motion.
fn add_errors(
    joint: &mut Joint<'_>,
    shared: &SharedErrors,
    unresolved: &UnresolvedMotion,
    inclination: Option<&Inclination>,
) {
    let motion = &mut joint.stitched.motion;
    shared.add_to(motion);
    joint.stabilisation.add_to(motion, &joint.observations);
    unresolved.add_to(motion);
    joint.scale.add_to(motion);
    if let Some(inclination) = inclination {
        inclination.add_to(motion);
    }
}

/// What the experiment states of rest, drives, triggers, and how the chain answers to its drive.
fn stitching_settings(experiment: &Experiment, stated: &StatedMotion) -> Settings {
    Settings {
        rest_until_s: experiment.tracking.rest_until_s,
        drive_scatter: Some(experiment.drive_scatter()),
        first_body: if experiment.is_shaken() { FirstBody::Imposed } else { FirstBody::Free },
        trigger_sigma_s: experiment.trigger.sigma_s.map(Positive::get),
        view_trigger_sigma_s: experiment.trigger.view_sigma_s.map(NotNegative::get),
        stated_responses: stated.responses.clone(),
        ..Settings::new(experiment.chain.n_bodies, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stated_scatter_of_triggers_reaches_the_stitching() {
        let read = |more: &str| {
            let text = format!("{}\n{more}", include_str!("../../../tests/small-experiment/experiment.toml"));
            toml::from_str::<Experiment>(&text)
        };
        let stated = |more: &str| {
            let experiment = read(more).unwrap();
            let motion = StatedMotion::of(&experiment, 0.0, NonZero::<usize>::MIN).unwrap();
            stitching_settings(&experiment, &motion)
        };
        let usual = stated("");
        assert_eq!((usual.trigger_sigma_s, usual.view_trigger_sigma_s), (None, None));
        let known = stated("[trigger]\nsigma_s = 1e-5\nview_sigma_s = 2e-5\n");
        assert_eq!((known.trigger_sigma_s, known.view_trigger_sigma_s), (Some(1e-5), Some(2e-5)));
        let refused = read("[trigger]\nsigma_s = 0.0\n").unwrap_err().to_string();
        assert!(refused.contains("above 0"), "{refused}");
    }
}
