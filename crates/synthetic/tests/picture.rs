//! What a frame shows: the commanded motion, the same specimen in every view, nothing saturated.

#![cfg(test)]

mod support;

use chainwave_measurement::Trajectory;
use chainwave_synthetic::speckle::Pattern;
use chainwave_synthetic::{Camera, Marker, Packing, Scene, Sensor, Shot, Specimen, SyntheticError, Tones};
use ndarray::{Array2, s};
use support::specimen;

fn camera() -> Camera {
    let sensor =
        Sensor { bit_depth: 12, black_level: 64.0, read_noise_counts: 6.0, counts_per_electron: 0.2 };
    support::camera(96, 1.0e-5, sensor)
}

fn shot() -> Shot {
    Shot {
        stage_m: 0.0,
        first_body_px: [50.0, 47.5],
        first_image: -10,
        n_frames: 40,
        trigger_delay_s: 4.0e-6,
        frame_phase_s: 2.0e-5,
        noise_seed: 1,
        view: 1,
        covers: Vec::new(),
    }
}

/// Body n starts at t = 0 with the speed n m/s.
fn steady() -> Trajectory {
    let times_s = vec![0.0, 2.0e-3];
    Trajectory {
        displacement_m: Array2::from_shape_fn((3, 2), |(body, i)| (body + 1) as f64 * times_s[i]),
        velocity_m_per_s: Array2::from_shape_fn((3, 2), |(body, _)| (body + 1) as f64),
        times_s,
    }
}

fn expected(shot: &Shot, frame: usize) -> Array2<f32> {
    Scene::new(&camera(), &specimen(), shot, &steady()).unwrap().expected_counts(frame).unwrap()
}

#[test]
fn markers_show_the_closed_form_at_the_commanded_place() {
    let (camera, specimen, shot, motion) = (camera(), specimen(), shot(), steady());
    let scene = Scene::new(&camera, &specimen, &shot, &motion).unwrap();
    let tones = Tones::default();
    for frame in [0, 11, 37] {
        let motion_s = (2.0e-5 + (frame as f64 - 10.0) * 4.0e-5 + 4.0e-6_f64).max(0.0);
        let counts = scene.expected_counts(frame).unwrap();
        for body in 0..2_usize {
            let speed_m_per_s = (body + 1) as f64;
            let column_px = 50.0 + 5000.0 * (body as f64 * 0.030 + speed_m_per_s * motion_s);
            let [stated_px, row_px] = scene.body_centres_px(frame).unwrap()[body];
            // Rounding of a few hundred pixels.
            assert!((stated_px - column_px).abs() < 1.0e-10);
            let pattern = Pattern::scattered(9, body as u64 + 1, [27.5, 27.5], 4.5);
            let depths = pattern.depth_image(400, 96, [column_px, row_px]);
            let (left, right) = (column_px as usize - 25, column_px as usize + 26);
            for ((row, column), depth) in depths.indexed_iter() {
                if (22..74).contains(&row) && (left..right).contains(&column) {
                    let tone = tones.marker - tones.speckle_depth * depth;
                    // 1e-3 counts: f32 holds 24 bits of 4096.
                    assert!((f64::from(counts[[row, column]]) - (64.0 + 4000.0 * tone)).abs() < 1.0e-3);
                }
            }
        }
    }
}

#[test]
fn frames_at_rest_differ_by_noise_alone() {
    let (camera, specimen, shot, motion) = (camera(), specimen(), shot(), steady());
    let scene = Scene::new(&camera, &specimen, &shot, &motion).unwrap();
    assert_eq!(scene.expected_counts(0).unwrap(), scene.expected_counts(9).unwrap());
    assert_ne!(scene.expected_counts(9).unwrap(), scene.expected_counts(10).unwrap());
    assert_ne!(scene.recorded_counts(0).unwrap(), scene.recorded_counts(9).unwrap());
    let mean = scene.expected_counts(0).unwrap();
    let (mut squares, mut law) = (0.0, 0.0);
    for frame in 0..9 {
        for (count, mean) in scene.recorded_counts(frame).unwrap().iter().zip(&mean) {
            squares += f64::from(count - mean).powi(2);
            law += 36.0 + 0.2 * (f64::from(*mean) - 64.0) + 1.0 / 12.0;
        }
    }
    // 345 600 pixels of unequal variance: a standard error of about 1.5 sqrt(2/345600) = 0.4 %; 4.5 of them.
    assert!((squares / law - 1.0).abs() < 0.016, "{}", squares / law);
}

#[test]
fn a_body_carries_its_pattern_from_view_to_view() {
    let here = expected(&shot(), 0);
    let moved = Shot { stage_m: 0.020, noise_seed: 5, ..shot() };
    let there = expected(&moved, 0);
    // The stage moves by 100 whole pixels, and the whole laboratory with it, backdrop and all.
    let (here, there) = (here.slice(s![.., 100..]), there.slice(s![.., ..300]));
    let largest = here.iter().zip(there).map(|(one, other)| (one - other).abs()).fold(0.0, f32::max);
    assert!(largest < 2.0e-3, "{largest}"); // f32 rounding of several layers
}

#[test]
fn nothing_saturates_and_the_speckles_have_contrast() {
    let counts = expected(&shot(), 0);
    let range = counts.mapv(|count| f64::from(count - 64.0) / 4000.0);
    assert!(range.iter().all(|tone| (0.02..0.9).contains(tone)));
    for body in 0..3_usize {
        let column = 50 + 150 * body;
        if column + 27 < 400 {
            let contrast = range.slice(s![21..75, column - 26..column + 27]).std(0.0);
            assert!((0.11..0.16).contains(&contrast), "{contrast}");
        }
    }
}

#[test]
fn a_motion_that_ends_too_early_names_the_frame() {
    let shot = Shot { n_frames: 70, ..shot() };
    let error = Scene::new(&camera(), &specimen(), &shot, &steady()).err().unwrap();
    assert!(matches!(error, SyntheticError::MotionTooShort { frame: 69, .. }), "{error}");
    let scene_error =
        |camera: &Camera, specimen: &Specimen| Scene::new(camera, specimen, &self::shot(), &steady()).err();
    assert!(scene_error(&camera(), &specimen()).is_none());
    assert!(scene_error(&camera(), &Specimen { n_bodies: 4, ..specimen() }).is_some());
}

#[test]
fn unusable_settings_are_refused_by_name() {
    let refused = |camera: Camera, specimen: Specimen, shot: Shot| {
        Scene::new(&camera, &specimen, &shot, &steady()).err().unwrap().to_string()
    };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, 1.0e300] {
        let message = refused(Camera { scale_px_per_m: bad, ..camera() }, specimen(), shot());
        assert!(message.contains("camera.scale_px_per_m"), "{message}");
        let message = refused(camera(), specimen(), Shot { frame_phase_s: bad, ..shot() });
        assert!(message.contains("shot.frame_phase_s"), "{message}");
        let marker = Marker { half_width_m: bad, ..specimen().marker };
        let message = refused(camera(), Specimen { marker, ..specimen() }, shot());
        assert!(message.contains("specimen.marker.half_width_m"), "{message}");
        let message = refused(Camera { rate_hz: bad, ..camera() }, specimen(), shot());
        assert!(message.contains("camera.rate_hz"), "{message}");
    }
    let message = refused(Camera { packing: Packing::P10, width_px: 402, ..camera() }, specimen(), shot());
    assert!(message.contains("multiple of 4"), "{message}");
    let message = refused(Camera { width_px: usize::MAX, ..camera() }, specimen(), shot());
    assert!(message.contains("camera.width_px"), "{message}");
    let message = refused(camera(), specimen(), Shot { first_image: i64::MAX, ..shot() });
    assert!(message.contains("shot.first_image"), "{message}");
}

#[test]
fn bodies_far_outside_the_view_are_left_out() {
    let far = Shot { first_body_px: [1.0e6, -1.0e6], ..shot() };
    let counts = expected(&far, 0);
    // Backdrop only: its mean with every blot at its largest.
    assert!(counts.iter().all(|&count| count < 64.0 + 4000.0 * 0.3));
}
