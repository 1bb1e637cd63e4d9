//! How long bodies take to be followed, measured on pictures.

use std::num::NonZero;

use chainwave_correlation::ReferenceFrames;
use chainwave_measurement::{Excerpt, Subset};

use super::pictures::Pictures;
use super::schedule::{PlannedRecording, Schedule};
use crate::error::Error;
use crate::follow::{edges_beside, follow};
use crate::monitor::Monitor;
use crate::setup::Setup;
use crate::view::bodies_in_view;

/// Seconds of one thread.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pace {
    /// To prepare a subset.
    prepared_s: f64,
    /// To find it in a frame.
    found_s: f64,
}

/// Of the frames in motion, those that the shorter of two measurements takes.
const FEW_FRAMES: usize = 4;

impl Pace {
    /// Measured by a clock: the same bodies followed through a few frames, and through more.
    ///
    /// # Errors
    /// Pictures that cannot be followed.
    pub(super) fn measured(
        setup: &Setup,
        pictures: &Pictures,
        now_s: &dyn Fn() -> f64,
    ) -> Result<Self, Error> {
        let subsets: Vec<Subset> = pictures.subsets.iter().map(|(_, subset)| subset.clone()).collect();
        let n_rest = pictures.rest.len();
        let seconds = |n_moving: usize| -> Result<f64, Error> {
            let frames: Vec<usize> =
                pictures.rest.clone().chain(pictures.moving.clone().take(n_moving)).collect();
            let excerpt = Excerpt::new(pictures.recording.as_ref(), frames);
            let reference = ReferenceFrames::Mean(0..n_rest);
            let from_s = now_s();
            follow(&excerpt, &subsets, &reference, setup.method(), NonZero::<usize>::MIN, &Monitor::SILENT)?;
            edges_beside(&excerpt, &subsets, &reference)?;
            Ok(now_s() - from_s)
        };
        let n_moving = pictures.moving.len();
        let (few_s, all_s) = (seconds(FEW_FRAMES.min(n_moving))?, seconds(n_moving)?);
        let more = n_moving.saturating_sub(FEW_FRAMES).max(1) as f64;
        let n_bodies = subsets.len().max(1) as f64;
        let found_s = ((all_s - few_s) / (more * n_bodies)).max(0.0);
        let prepared_s = (all_s / n_bodies - found_s * (n_rest + n_moving) as f64).max(0.0);
        Ok(Self { prepared_s, found_s })
    }

    /// Seconds for all recordings of a schedule with so many threads.
    pub(super) fn seconds(&self, setup: &Setup, schedule: &Schedule, n_threads: NonZero<usize>) -> f64 {
        let of_recording = |one: &PlannedRecording| {
            let n_bodies = bodies_in_view(setup, &one.trial, &one.info).len() as f64;
            n_bodies * (self.prepared_s + self.found_s * one.info.n_frames as f64)
        };
        schedule.recordings.iter().map(of_recording).sum::<f64>() / n_threads.get() as f64
    }
}
