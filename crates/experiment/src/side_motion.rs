//! The bodies' motion across the chain and their rotation, beside their motion along it.

use std::num::NonZero;

use chainwave_measurement::{ChainMotion, Estimate, Observation};
use chainwave_stitching::{Settings, Stitched, averaged};

use crate::error::Error;
use crate::finding::Finding;
use crate::setup::Setup;
use crate::shared_errors::calibration_modes;
use crate::steadying::Steadying;
use crate::tracked::TrackedRecording;
use crate::tracks::Coordinate;

/// What the bodies do besides moving along the chain: each the mean of the trials at the times of the motion along it.
#[derive(Debug, Clone, PartialEq)]
pub struct SideMotion {
    /// Displacement across the chain from rest, in metres: positive on the side that is down in pictures where the chain goes to the
    /// right. `None` where no body was read.
    pub across: Option<ChainMotion>,
    /// Rotation from rest, from the direction of the chain towards the one across, in radians. `None` where no subset was matched with
    /// a shape function that turns: then the pictures did not ask for one.
    pub rotation: Option<ChainMotion>,
    /// What the reader should know.
    pub(crate) findings: Vec<Finding>,
}

impl SideMotion {
    /// Averages the recordings that were stitched, by their alignment. Views that are magnified differently, the camera's own motion in
    /// these coordinates and the calibration's errors are taken out, or stand in the sigmas, as they are of the motion along the chain.
    pub(crate) fn of(
        setup: &Setup,
        recordings: &[TrackedRecording],
        steadying: &Steadying,
        settings: &Settings,
        stitched: &Stitched,
        n_threads: NonZero<usize>,
    ) -> Result<Self, Error> {
        let mut findings = Vec::new();
        let mut of = |coordinate: Coordinate, subject: &str| -> Result<Option<ChainMotion>, Error> {
            let read = |one: &TrackedRecording| one.observation_of(coordinate, &one.map.of_chain.map);
            let observations: Vec<Observation> = recordings.iter().map(read).collect();
            if !observations.iter().any(has_readings) {
                return Ok(None);
            }
            let steadying = steadying.in_coordinate(coordinate, &observations);
            let mean = |observations: Vec<Observation>| {
                let steady = steadying.steadied(observations);
                averaged(&steady, &stitched.alignments, &stitched.motion.times_s, settings)
            };
            let mut motion = mean(observations.clone());
            let of_coordinate = (coordinate, recordings);
            let modes = calibration_modes(setup, of_coordinate, &motion, n_threads, |moved| Ok(mean(moved)))?;
            motion.add_errors(modes);
            steadying.add_to(&mut motion, &observations);
            steadying.scale.add_to(&mut motion, &observations);
            if steadying.motion().is_some() {
                let text = "the camera moves in it as well: its motion was taken out where two bodies at rest tell it, and stands in the \
                            uncertainties elsewhere";
                findings.extend(Finding::all_of("camera_moves", subject, [text.to_owned()]));
            }
            Ok(Some(motion))
        };
        let across = of(Coordinate::Across, "motion across the chain")?;
        let rotation = of(Coordinate::Turn, "rotation")?;
        Ok(Self { across, rotation, findings })
    }

    /// Adds what the pictures' own errors, which lie still while bodies move, do to these coordinates: as much, in proportion to the noise
    /// of readings, as they add to the motion along the chain, given before and after.
    pub(crate) fn widen(&mut self, before: &ChainMotion, after: &ChainMotion) {
        for motion in self.across.iter_mut().chain(&mut self.rotation) {
            for (place, found) in motion.displacement_m.indexed_iter_mut() {
                let (Some(read), Some(before_m), Some(after_m)) =
                    (*found, before.displacement_m[place], after.displacement_m[place])
                else {
                    continue;
                };
                let added = (after_m.sigma.powi(2) - before_m.sigma.powi(2)).max(0.0);
                let noise = before.independent_sigma_m[place];
                if added > 0.0 && noise > 0.0 {
                    let own = motion.independent_sigma_m[place] / noise * added.sqrt();
                    *found = Some(Estimate::new(read.value, read.sigma.hypot(own)));
                }
            }
        }
    }
}

fn has_readings(observation: &Observation) -> bool {
    observation.bodies.iter().any(|track| track.position_m.iter().any(Option::is_some))
}
