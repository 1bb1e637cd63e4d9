//! Every instruction set that the machine has gives the same pictures, in a process each.

#![cfg(test)]

mod support;

use chainwave_measurement::Trajectory;
use chainwave_synthetic::{Scene, Sensor, Shot};
use chainwave_testkit::{digest, hold_each_to_the_same_bits};
use ndarray::Array2;
use support::{camera, specimen};

/// Frames of bodies at rest and on their way.
const FRAMES: [usize; 3] = [2, 10, 19];

#[test]
fn every_instruction_set_gives_the_same_bits() {
    hold_each_to_the_same_bits("every_instruction_set_gives_the_same_bits", 2 * FRAMES.len(), digests);
}

/// What frames show, sharp and moving in the exposure, without noise and with it, in a word each.
fn digests() -> Vec<String> {
    let sensor =
        Sensor { bit_depth: 12, black_level: 64.0, read_noise_counts: 6.0, counts_per_electron: 0.2 };
    let mut camera = camera(96, 1.0e-5, sensor);
    camera.blur = true;
    let shot = Shot {
        stage_m: 0.0,
        first_body_px: [50.3, 47.7],
        first_image: -10,
        n_frames: 20,
        trigger_delay_s: 4.0e-6,
        frame_phase_s: 2.0e-5,
        noise_seed: 1,
        view: 1,
        covers: Vec::new(),
    };
    let times_s = vec![0.0, 2.0e-3];
    let motion = Trajectory {
        displacement_m: Array2::from_shape_fn((3, 2), |(body, i)| (body + 1) as f64 * times_s[i]),
        velocity_m_per_s: Array2::from_shape_fn((3, 2), |(body, _)| (body + 1) as f64),
        times_s,
    };
    let specimen = specimen();
    let scene = Scene::new(&camera, &specimen, &shot, &motion).unwrap();
    let pictures = |frame: usize| {
        let (expected, recorded) =
            (scene.expected_counts(frame).unwrap(), scene.recorded_counts(frame).unwrap());
        [("expected", expected), ("recorded", recorded)].map(|(name, counts)| {
            format!("{frame} {name} {:016x}", digest(counts.iter().map(|count| u64::from(count.to_bits()))))
        })
    };
    FRAMES.into_iter().flat_map(pictures).collect()
}
