//! Recordings joined to one motion, by maps of their pictures that bodies which several views show do not contradict.

use std::borrow::Cow;

use chainwave_measurement::{Observation, SharedReadingError, map_in_parallel};
use chainwave_stitching::{Outlier, Settings, Stitched};

use crate::chain::stated_motion::StatedMotion;
use crate::error::Error;
use crate::finding::LeftOutRecording;
use crate::geometry::scale::ScaleCheck;
use crate::geometry::stages::Stages;
use crate::merging::between_views::BetweenViews;
use crate::merging::joining::{Joined, chosen, join, sound};
use crate::merging::picture_errors::PictureErrors;
use crate::merging::picture_geometry::PictureGeometry;
use crate::merging::stabilisation::Stabilisation;
use crate::setup::Setup;
use crate::timing::clocks::Clocks;
use crate::tracked::{Tracked, TrackedRecording};

/// Recordings that were joined, and what was found on the way.
pub(crate) struct Joint<'a> {
    /// With the map by which they were joined.
    pub(crate) setup: Cow<'a, Setup>,
    /// What the pictures say of the scale by that map.
    pub(crate) scale: ScaleCheck,
    /// What was told of the camera's view and its lens.
    pub(crate) geometry: Option<PictureGeometry>,
    /// What is not known of that, as errors of the readings.
    pub(crate) geometry_errors: Vec<SharedReadingError>,
    /// What was told of frame rates.
    pub(crate) clocks: Clocks,
    /// The recordings that were kept.
    pub(crate) recordings: Vec<TrackedRecording>,
    /// Their positions as they were read.
    pub(crate) as_read: Vec<Observation>,
    /// The same by one scale and without the camera's motion.
    pub(crate) observations: Vec<Observation>,
    pub(crate) stabilisation: Stabilisation,
    pub(crate) stitched: Stitched,
    pub(crate) left_out: Vec<Outlier>,
    pub(crate) unjoined: Vec<LeftOutRecording>,
}

/// Recordings by the clocks that they state, or by others.
struct Timed<'t> {
    recordings: Cow<'t, [TrackedRecording]>,
    observations: Cow<'t, [Observation]>,
    stages: &'t Stages,
}

impl<'t> Timed<'t> {
    fn as_stated(Tracked { recordings, observations, stages, .. }: &'t Tracked) -> Self {
        Self { recordings: Cow::Borrowed(recordings), observations: Cow::Borrowed(observations), stages }
    }

    fn by(tracked: &'t Tracked, clocks: &Clocks) -> Self {
        let mut timed = Self::as_stated(tracked);
        if clocks.is_empty() {
            return timed;
        }
        for (recording, observation) in timed.recordings.to_mut().iter_mut().zip(timed.observations.to_mut())
        {
            recording.clock = clocks.factor(observation.view, &observation.recording);
            observation.times_s.iter_mut().for_each(|time_s| *time_s *= recording.clock);
        }
        timed
    }
}

/// Times that pictures are mapped anew, at most: where a map is far off, the alignment it led to tells the next one.
const ROUNDS: usize = 4;
/// The same of clocks: one that is off by some per cent puts a wave by many of its own rises from where it is, and is found in steps.
const CLOCK_ROUNDS: usize = 8;

impl<'a> Joint<'a> {
    /// Joins recordings by the stated map, and by others while bodies tell one.
    ///
    /// # Errors
    /// No view can be joined, or the stated chain cannot be solved.
    pub(crate) fn of(
        setup: &'a Setup,
        tracked: &Tracked,
        stated: &StatedMotion,
        settings: &Settings,
    ) -> Result<Self, Error> {
        let asking = &Settings { asks_for_clocks: true, ..settings.clone() };
        let (mut joint, timed) = Self::by_clocks(setup, tracked, stated, asking)?;
        let clocks = joint.clocks.clone();
        let mut shapes = None;
        for _ in 0..ROUNDS {
            if joint.is_adrift() {
                break;
            }
            let (before, shown) = (joint.geometry.unwrap_or(PictureGeometry::PLAIN), &joint.stitched.shown);
            let found = match shapes {
                Some(shapes) => before.refined(shown, shapes).map(|geometry| (geometry, shapes)),
                None => before.told(shown),
            };
            let Some((geometry, of_shapes)) = found else { break };
            shapes = Some(of_shapes);
            joint = Self::by_geometry(setup, &timed, stated, Some(geometry), settings)?;
        }
        Ok(Self { clocks, ..joint })
    }

    /// Joins recordings by the geometry that bodies at rest tell, and by the clocks that moving ones do; with the recordings by these clocks.
    fn by_clocks<'t>(
        setup: &'a Setup,
        tracked: &'t Tracked,
        stated: &StatedMotion,
        settings: &Settings,
    ) -> Result<(Self, Timed<'t>), Error> {
        let joined =
            |timed: &Timed<'_>| Self::by_geometry(setup, timed, stated, at_rest(setup, timed), settings);
        let rest_until_s = setup.experiment.tracking.rest_until_s;
        let mut timed = Timed::as_stated(tracked);
        let mut joint = joined(&timed)?;
        let rough = Clocks::roughly(&tracked.observations, rest_until_s, settings.n_threads);
        // Drives that differ stretch courses too: a clock is looked for from afar only where the alignment cannot do with the stated times.
        if !rough.is_empty() && joint.contradicts_its_times() {
            timed = Timed::by(tracked, &rough);
            joint = Self { clocks: rough, ..joined(&timed)? };
        }
        for _ in 0..CLOCK_ROUNDS {
            let Some(finer) = joint.told_clocks() else { break };
            timed = Timed::by(tracked, &finer);
            joint = Self { clocks: finer, ..joined(&timed)? };
        }
        if joint.clocks.are_of_views() {
            let pictures = joint.picture_errors();
            // Views that still disagree do so by something else, of which a clock would take up a part.
            if !joint.clocks.are_known() || joint.between_views(&pictures).is_some() {
                timed = Timed::as_stated(tracked);
                joint = joined(&timed)?;
            } else if pictures.outweigh_noise() {
                let clocks = joint.clocks.or_pictures();
                timed = Timed::by(tracked, &clocks);
                joint = Self { clocks, ..joined(&timed)? };
            }
        }
        Ok((joint, timed))
    }

    /// What pictures of bodies show beyond noise once they have moved.
    pub(crate) fn picture_errors(&self) -> PictureErrors {
        let rest_until_s = self.setup.experiment.tracking.rest_until_s;
        let m_per_px = self.setup.map.m_per_px().value;
        PictureErrors::of(&self.as_read, rest_until_s, &self.stabilisation.rests_until_s, m_per_px)
    }

    /// The clocks that the alignment tells besides those that are known; none of one that is adrift, or of pictures that swing, by which bodies seem to
    /// come later or sooner.
    fn told_clocks(&self) -> Option<Clocks> {
        let is_sound = !self.is_adrift() && self.stabilisation.motion().is_none();
        self.clocks.after(&self.stitched.clocks).filter(|_| is_sound)
    }

    /// Whether it does not go together by the times that it was joined by: no response to the drive tells how trials differ, it did not settle, a
    /// clock is told, or views contradict each other.
    fn contradicts_its_times(&self) -> bool {
        let Stitched { by_trigger, unsettled, .. } = &self.stitched;
        *by_trigger
            || unsettled.is_some()
            || self.told_clocks().is_some()
            || self.between_views(&self.picture_errors()).is_some()
    }

    /// Whether the alignment went nowhere.
    fn is_adrift(&self) -> bool {
        let frame_s =
            self.observations.iter().map(Observation::frame_interval_s).fold(f64::INFINITY, f64::min);
        self.stitched.unsettled.is_some_and(|unsettled| unsettled.is_adrift(frame_s))
    }

    /// What views that contradict each other say of that, beyond what picture errors make of it; nothing where the alignment is adrift, whose own
    /// errors they leave over.
    pub(crate) fn between_views(&self, pictures: &PictureErrors) -> Option<BetweenViews> {
        if self.is_adrift() {
            return None;
        }
        let Stitched { left_by_views, motion, .. } = &self.stitched;
        let found = BetweenViews::of(left_by_views, motion, &self.stabilisation.rests_until_s);
        found.filter(|found| found.is_beyond(pictures.size_m()))
    }

    fn by_geometry(
        setup: &'a Setup,
        timed: &Timed<'_>,
        stated: &StatedMotion,
        geometry: Option<PictureGeometry>,
        settings: &Settings,
    ) -> Result<Self, Error> {
        let asked_errors = geometry.unwrap_or(PictureGeometry::PLAIN).asked(
            &timed.recordings,
            &timed.observations,
            settings.n_threads,
        );
        let settings = &Settings { asked_errors, ..settings.clone() };
        let (Some(geometry), Some(first)) = (geometry, timed.recordings.first()) else {
            let scale = timed.stages.scale.clone();
            return Self::by_map(
                Cow::Borrowed(setup),
                stated,
                scale,
                &timed.recordings,
                &timed.observations,
                settings,
            );
        };
        let mapped = |one: &TrackedRecording| TrackedRecording {
            map: geometry.map(&one.map, one.picture_px),
            ..one.clone()
        };
        let recordings: Vec<TrackedRecording> = timed.recordings.iter().map(mapped).collect();
        let observations =
            map_in_parallel(recordings.len(), settings.n_threads, |r| recordings[r].observation());
        let setup = Setup { map: geometry.map(&setup.map, first.picture_px), ..setup.clone() };
        let scale = timed.stages.scale_by(|place_m| setup.map.place_from_middle_m(place_m, first.picture_px));
        let joint = Self::by_map(Cow::Owned(setup), stated, scale, &recordings, &observations, settings)?;
        let geometry_errors = geometry.errors(&timed.recordings, &joint.as_read, settings.n_threads);
        Ok(Self { geometry: Some(geometry), geometry_errors, ..joint })
    }

    fn by_map(
        setup: Cow<'a, Setup>,
        stated: &StatedMotion,
        scale: ScaleCheck,
        recordings: &[TrackedRecording],
        all: &[Observation],
        settings: &Settings,
    ) -> Result<Self, Error> {
        // A recording of other bodies than it is taken for would move the camera.
        let (sound, left_out) =
            sound(all, &Settings { asked_errors: Vec::new(), asks_for_clocks: false, ..settings.clone() });
        let mut as_read = chosen(all, &sound);
        let mut stabilisation = Stabilisation::of(&setup.experiment, stated, &as_read, &scale);
        let mut observations = stabilisation.steadied(as_read.clone());
        let Joined { kept, stitched, unjoined } = join(&observations, settings)?;
        if !unjoined.is_empty() {
            as_read = chosen(&as_read, &kept);
            observations = chosen(&observations, &kept);
            stabilisation = Stabilisation::of(&setup.experiment, stated, &as_read, &scale);
        }
        let recordings = kept.iter().map(|index| recordings[sound[*index]].clone()).collect();
        let (geometry, geometry_errors, clocks) = (None, Vec::new(), Clocks::default());
        Ok(Self {
            setup,
            scale,
            geometry,
            geometry_errors,
            clocks,
            recordings,
            as_read,
            observations,
            stabilisation,
            stitched,
            left_out,
            unjoined,
        })
    }
}

/// The geometry of pictures that bodies at rest tell, where the calibration leaves it open.
fn at_rest(setup: &Setup, timed: &Timed<'_>) -> Option<PictureGeometry> {
    let picture_px = timed.recordings.first()?.picture_px;
    let is_open = !timed.recordings.iter().any(|one| one.map.has_geometry());
    let bent = timed.stages.bent().filter(|_| is_open)?;
    Some(PictureGeometry::at_rest(&bent, &setup.map, picture_px))
}
