//! The bodies' motion across the chain and their rotation, beside their motion along it.

use std::num::NonZero;

use chainwave_measurement::{ChainMotion, Estimate, Observation, both_in_parallel};
use chainwave_stitching::{Settings, Stitched, averaged};

use crate::error::Error;
use crate::finding::Finding;
use crate::merging::shared_errors::calibration_modes;
use crate::merging::stabilisation::Stabilisation;
use crate::setup::Setup;
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
        stabilisation: &Stabilisation,
        settings: &Settings,
        stitched: &Stitched,
        n_threads: NonZero<usize>,
    ) -> Result<Self, Error> {
        let of = |coordinate: Coordinate,
                  subject: &str|
         -> Result<(Option<ChainMotion>, Vec<Finding>), Error> {
            let read = |one: &TrackedRecording| one.observation_of(coordinate, &one.map.of_chain.map);
            let observations: Vec<Observation> = recordings.iter().map(read).collect();
            if !observations.iter().any(has_readings) {
                return Ok((None, Vec::new()));
            }
            let stabilisation = stabilisation.in_coordinate(coordinate, &observations);
            let mean = |observations: Vec<Observation>| {
                let steady = stabilisation.steadied(observations);
                averaged(&steady, &stitched.alignments, &stitched.motion.times_s, settings)
            };
            let mut motion = mean(observations.clone());
            let of_coordinate = (coordinate, recordings);
            let modes = calibration_modes(setup, of_coordinate, &motion, n_threads, |moved| Ok(mean(moved)))?;
            motion.add_errors(modes);
            stabilisation.add_to(&mut motion, &observations);
            stabilisation.scale.add_all_to(&mut motion, &observations);
            let unit = if coordinate == Coordinate::Turn { ("mrad", 1e3) } else { ("um", 1e6) };
            let said = stabilisation.warning_beside(unit);
            Ok((Some(motion), Finding::all_of("camera_moves", subject, said)))
        };
        let (across, rotation) = both_in_parallel(
            n_threads,
            || of(Coordinate::Across, "motion across the chain"),
            || of(Coordinate::Turn, "rotation"),
        );
        let ((across, findings), (rotation, of_rotation)) = (across?, rotation?);
        Ok(Self { across, rotation, findings: [findings, of_rotation].concat() })
    }

    /// Adds what the pictures' own errors, which lie still while bodies move, do to these coordinates: as much, in proportion to the noise
    /// of readings, as they add to the motion along the chain, given before and after.
    pub(crate) fn widen(&mut self, before: &ChainMotion, after: &ChainMotion) {
        let columns_before = before.columns_at(&after.times_s);
        for motion in self.across.iter_mut().chain(&mut self.rotation) {
            for (place, found) in motion.displacement_m.indexed_iter_mut() {
                let (Some(read), Some(column)) = (*found, columns_before[place.1]) else { continue };
                let place_before = (place.0, column);
                let sigmas_m = before.displacement_m[place_before].zip(after.displacement_m[place]);
                let added =
                    sigmas_m.map_or(0.0, |(before, after)| after.sigma.powi(2) - before.sigma.powi(2));
                let noise = before.independent_sigma_m[place_before];
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

#[cfg(test)]
mod tests {
    use chainwave_measurement::ErrorModes;
    use ndarray::Array2;

    use super::*;

    /// One body that one trial saw at these milliseconds, with these sigmas, half of it noise.
    fn motion(times_ms: std::ops::Range<i32>, sigma_m: f64) -> ChainMotion {
        let shape = (1, times_ms.len());
        ChainMotion {
            times_s: times_ms.map(|ms| 1e-3 * f64::from(ms)).collect(),
            displacement_m: Array2::from_elem(shape, Some(Estimate::new(0.0, sigma_m))),
            independent_sigma_m: Array2::from_elem(shape, 0.5 * sigma_m),
            modes: ErrorModes::default(),
            n_trials: Array2::ones(shape),
        }
    }

    #[test]
    fn what_pictures_add_is_found_at_the_same_time_where_triggers_moved() {
        // With the pictures' errors triggers are found otherwise, and the motion begins two samples sooner and ends one later.
        let (before, after) = (motion(0..8, 3e-6), motion(-2..9, 5e-6));
        let mut side = SideMotion { across: Some(motion(-2..9, 2e-6)), rotation: None, findings: Vec::new() };
        side.widen(&before, &after);
        let across = side.across.unwrap();
        // 4 um more of which 1.5 um are noise: as much in proportion to a noise of 1 um.
        let widened = 2e-6_f64.hypot(4e-6 / 1.5);
        for (i, time_s) in across.times_s.iter().enumerate() {
            let expected = if (0.0..7.5e-3).contains(time_s) { widened } else { 2e-6 };
            assert!(
                (across.displacement_m[(0, i)].unwrap().sigma / expected - 1.0).abs() < 1e-12,
                "{time_s}"
            );
        }
    }
}
