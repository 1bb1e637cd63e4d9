//! The Cramér-Rao bound of the pixels on the dampings of a struck chain: what no method, however good, could undercut.
//!
//! The bound knows the bodies' pictures without noise, and that they only shift, under light of unknown gain and offset in each frame. Such
//! a picture tells a shift with the Fisher information of its pixels; shifts tell c_d and c_s through the motion's derivatives. Unknown beside
//! these are for each recording its striker's velocity (within its stated scatter) and its trigger, and for each body in it where it rests.
//! Nothing here is shared with the matcher or the fits: slopes are differences of the renderer's expected counts, and derivatives
//! differences of whole simulations.

use chainwave_measurement::{Estimate, Subset, Trajectory};
use chainwave_synthetic::Scene;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::planned_camera::PlannedCamera;
use super::rehearsal::Rehearsal;
use super::schedule::PlannedRecording;
use super::{AssumedChain, Prepared};
use crate::error::Error;
use crate::recordings::view::bodies_in_view;
use crate::setup::Setup;

/// The least standard deviations that pixels allow, in kilograms per second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DampingBound {
    /// Of c_d.
    pub chain_damping_kg_per_s: f64,
    /// Of c_s.
    pub striker_damping_kg_per_s: f64,
}

/// Relative step of derivatives by a parameter, both ways: the second derivatives cancel.
const STEP: f64 = 0.01;
/// Step of the derivative by time.
const STEP_S: f64 = 1e-6;
/// Unit of a trigger's time, so that all unknowns are of like size.
const TRIGGER_S: f64 = 1e-5;
/// Time that is simulated beyond the last frame, whose exposure ends after its stamp.
const BEYOND_S: f64 = 1e-3;
/// Pixels on both sides of one by which its slope is told.
const SLOPE_REACH_PX: usize = 3;
/// The same as a difference of sixth order: 1e-3 of the slope of a speckle of 4.5 px.
const SLOPE_WEIGHTS: [f64; SLOPE_REACH_PX] = [0.75, -0.15, 1.0 / 60.0];

/// The bound of an experiment as it is planned, filmed by the camera under `[synthetic]` or a usual one.
///
/// # Errors
/// As of a plan; a chain that nothing strikes, and pixels that do not tell all unknowns.
pub fn damping_bound(setup: &Setup) -> Result<DampingBound, Error> {
    if setup.experiment.striker.is_none() {
        return Err(Error::Value("a bound of c_d and c_s: expected a chain that a striker strikes".into()));
    }
    let Prepared { rehearsal, camera, .. } = Prepared::of(setup)?;
    bound(setup, &rehearsal, &camera)
}

/// The motion of the chain, and its derivatives by the logarithms of c_d, of c_s and of the striker's velocity, as pairs of motions.
struct Motions {
    usual: Trajectory,
    pairs: [[Trajectory; 2]; 3],
}

impl Motions {
    fn of(setup: &Setup, chain: &AssumedChain, duration_s: f64) -> Result<Self, Error> {
        let velocity = setup.experiment.nominal_drive().value;
        let motion = |[c_d, c_s, of_velocity]: [f64; 3]| {
            let chain = AssumedChain {
                damping_kg_per_s: c_d * chain.damping_kg_per_s,
                striker_damping_kg_per_s: c_s * chain.striker_damping_kg_per_s,
                ..chain.clone()
            };
            chain.motion(&setup.experiment, of_velocity * velocity, duration_s)
        };
        let pair = |parameter: usize| {
            let changed = |factor: f64| {
                let mut factors = [1.0; 3];
                factors[parameter] = factor;
                motion(factors)
            };
            Ok::<_, Error>([changed(1.0 + STEP)?, changed(1.0 - STEP)?])
        };
        Ok(Self { usual: motion([1.0; 3])?, pairs: [pair(0)?, pair(1)?, pair(2)?] })
    }

    /// Where a body is at a time, and the derivatives of that by the three logarithms and by the trigger's time in its unit, in metres.
    fn of_body(&self, body: usize, time_s: f64) -> Option<(f64, [f64; 4])> {
        let at =
            |motion: &Trajectory, time_s: f64| Some(motion.at(time_s.max(0.0))?.displacement_m(body - 1));
        let by =
            |[more, less]: &[Trajectory; 2]| Some((at(more, time_s)? - at(less, time_s)?) / (2.0 * STEP));
        let by_time =
            (at(&self.usual, time_s + STEP_S)? - at(&self.usual, time_s - STEP_S)?) / (2.0 * STEP_S);
        let [c_d, c_s, velocity] = &self.pairs;
        Some((at(&self.usual, time_s)?, [by(c_d)?, by(c_s)?, by(velocity)?, TRIGGER_S * by_time]))
    }
}

/// The bodies in view, each with its column at rest and the information of one picture on its place along the rows, in px^-2.
fn information(
    setup: &Setup,
    camera: &PlannedCamera,
    one: &PlannedRecording,
    motion: &Trajectory,
) -> Result<Vec<(usize, f64, f64)>, Error> {
    let shot = camera.shot(setup, one.trial.view, one.trial.stage_m);
    let picture = Scene::new(&camera.camera, &camera.specimen, &shot, motion)?.expected_counts(0)?;
    let sensor = &camera.camera.sensor;
    // Beyond the picture's rim it goes on as it ends: subsets keep away from there.
    let count = |x: usize, y: usize| {
        let (rows, columns) = picture.dim();
        f64::from(picture[(y.min(rows - 1), x.min(columns - 1))])
    };
    let of_body = |subset: &Subset| {
        let [x, y] = [subset.x_px.round() as usize, subset.y_px.round() as usize];
        let mut fisher = SMatrix::<f64, 4, 4>::zeros();
        for row in y.saturating_sub(subset.half_height_px)..=y + subset.half_height_px {
            for column in x.saturating_sub(subset.half_width_px)..=x + subset.half_width_px {
                let slope = |difference: &dyn Fn(usize) -> f64| {
                    (1..).zip(SLOPE_WEIGHTS).map(|(reach, weight)| weight * difference(reach)).sum::<f64>()
                };
                let along =
                    slope(&|reach| count(column + reach, row) - count(column.saturating_sub(reach), row));
                let across =
                    slope(&|reach| count(column, row + reach) - count(column, row.saturating_sub(reach)));
                let signal = count(column, row) - sensor.black_level;
                let variance = sensor.read_noise_counts.powi(2) + sensor.counts_per_electron * signal;
                let slopes = SVector::<f64, 4>::new(along, across, signal, 1.0);
                fisher += slopes * slopes.transpose() / variance;
            }
        }
        // Without texture nothing is told.
        fisher.try_inverse().map_or(0.0, |covariance| covariance[(0, 0)].recip())
    };
    let in_view = bodies_in_view(setup, &one.trial, &one.info);
    Ok(in_view.iter().map(|(body, subset)| (*body, subset.x_px, of_body(subset))).collect())
}

fn bound(setup: &Setup, rehearsal: &Rehearsal, camera: &PlannedCamera) -> Result<DampingBound, Error> {
    let (experiment, chain) = (&setup.experiment, &rehearsal.chain);
    let Estimate { value: velocity, sigma: scatter } = experiment.nominal_drive();
    let recordings = &rehearsal.schedule.recordings;
    let motions = Motions::of(setup, chain, rehearsal.schedule.last_s() + BEYOND_S)?;
    let n = 2 + 2 * recordings.len();
    let mut fisher = DMatrix::<f64>::zeros(n, n);
    let px_per_m = setup.map.m_per_px().value.recip();
    for (number, one) in recordings.iter().enumerate() {
        let own = 2 + 2 * number;
        let half_px = experiment.tracking.half_width_px as f64;
        let seen_px = half_px..=one.info.width_px as f64 - 1.0 - half_px;
        for (body, rest_px, information) in information(setup, camera, one, &motions.usual)? {
            // Where the body rests is as unknown: what the frames share tells nothing else.
            let (mut shared, mut n_frames) = (DVector::<f64>::zeros(n), 0.0);
            for &time_s in &one.info.times_s {
                let Some((at_m, [c_d, c_s, velocity, trigger])) =
                    motions.of_body(body, time_s - chain.strike_s)
                else {
                    continue;
                };
                if !seen_px.contains(&(rest_px + px_per_m * at_m)) {
                    continue;
                }
                let mut slope = DVector::<f64>::zeros(n);
                (slope[0], slope[1], slope[own], slope[own + 1]) = (c_d, c_s, velocity, trigger);
                slope *= px_per_m;
                fisher.ger(information, &slope, &slope, 1.0);
                shared += slope;
                n_frames += 1.0;
            }
            if n_frames > 0.0 {
                fisher.ger(-information / n_frames, &shared, &shared, 1.0);
            }
        }
        // What is known of the striker beforehand; a strike that repeats exactly leaves nothing to find.
        fisher[(own, own)] += (velocity / scatter.max(1e-9 * velocity)).powi(2);
    }
    let covariance = fisher
        .try_inverse()
        .ok_or_else(|| Error::Value("a bound of c_d and c_s: the pixels do not tell them all".into()))?;
    let sigma = |place: usize, value: f64| value * covariance[(place, place)].sqrt();
    Ok(DampingBound {
        chain_damping_kg_per_s: sigma(0, chain.damping_kg_per_s),
        striker_damping_kg_per_s: sigma(1, chain.striker_damping_kg_per_s),
    })
}

#[cfg(test)]
mod tests {
    use std::num::NonZero;
    use std::path::Path;

    use super::*;
    use crate::film::film_experiment;
    use crate::input::numbers::NotNegative;
    use crate::monitor::Monitor;
    use crate::tracking::store::MemoryStore;

    const SMALL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/small-experiment/experiment.toml");
    const TWO: NonZero<usize> = NonZero::<usize>::MIN.saturating_add(1);

    #[test]
    fn dampings_are_known_nearly_as_well_as_the_pixels_allow() {
        let folder = tempfile::tempdir().unwrap();
        let before = Setup::read(Path::new(SMALL), None).unwrap();
        let bound = damping_bound(&before).unwrap();
        let (path, experiment) = (Path::new(SMALL), &before.experiment);
        film_experiment(experiment, &before.table, path, folder.path(), TWO, &Monitor::SILENT).unwrap();
        for shape in ["translation", "rigid", "affine"] {
            let mut after = Setup::read(path, Some(folder.path())).unwrap();
            after.experiment.tracking.shape = shape.parse().unwrap();
            // The bound is that of a camera that is known to be square.
            after.experiment.camera.geometry_sigma = Some(NotNegative::default());
            let results = after.run(&MemoryStore::default(), TWO, &Monitor::SILENT).unwrap();
            let by_noise = results.evaluation.track_fit.as_ref().unwrap().by_noise;
            for (name, found, least) in [
                ("c_d", by_noise.chain_damping_kg_per_s, bound.chain_damping_kg_per_s),
                ("c_s", by_noise.striker_damping_kg_per_s, bound.striker_damping_kg_per_s),
            ] {
                let ratio = found.sigma / least;
                println!("{shape}: sigma of {name} by noise alone {ratio:.4} of the bound");
                // No method undercuts the bound; sigmas are estimated from pixels and residuals, within some per cent and half a per cent.
                // Above lies the aim of the project.
                assert!((0.97..1.05).contains(&ratio), "{shape}: {name} {ratio}");
            }
        }
    }

    #[test]
    fn information_adds_up_over_trials_and_falls_with_the_square_of_noise() {
        let setup = Setup::read(Path::new(SMALL), None).unwrap();
        let whole = damping_bound(&setup).unwrap().chain_damping_kg_per_s;
        let mut few = setup.clone();
        few.trials.retain(|trial| trial.trial == 1);
        // Five trials of each view have five times the information of one: nothing is shared but c_d and c_s.
        let ratio = damping_bound(&few).unwrap().chain_damping_kg_per_s / whole;
        assert!((ratio / 5.0_f64.sqrt() - 1.0).abs() < 1e-6, "{ratio}");
        let mut noisy = setup;
        let sensor = &mut noisy.experiment.synthetic.as_mut().unwrap().camera.sensor;
        // Twice the read noise and four times the counts an electron makes are four times each pixel's variance.
        (sensor.read_noise_counts, sensor.counts_per_electron) =
            (2.0 * sensor.read_noise_counts, 4.0 * sensor.counts_per_electron);
        let ratio = damping_bound(&noisy).unwrap().chain_damping_kg_per_s / whole;
        // But for what is known of strikers beforehand, which makes the bound grow by less.
        assert!((1.9..=2.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_chain_that_nothing_strikes_has_no_such_bound() {
        let mut setup = Setup::read(Path::new(SMALL), None).unwrap();
        setup.experiment.striker = None;
        assert!(damping_bound(&setup).unwrap_err().to_string().contains("striker"));
    }
}
