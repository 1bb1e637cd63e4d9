//! Each effect of a real camera, alone, against its closed form.

#![cfg(test)]

mod support;

use std::f64::consts::TAU;

use chainwave_measurement::Trajectory;
use chainwave_synthetic::{
    Camera, DefectivePixels, Defocus, Effects, FileFaults, FixedPattern, Lighting, Optics, Reflections,
    ScaleError, Scene, Sensor, Shadow, Shake, ShakeOnset, Shot, Specimen, film,
};
use ndarray::{Array2, s};
use support::specimen;

const BLACK: f64 = 64.0;
const RANGE: f64 = 4000.0;

fn camera(effects: Effects) -> Camera {
    let sensor =
        Sensor { bit_depth: 12, black_level: BLACK, read_noise_counts: 0.0, counts_per_electron: 0.0 };
    Camera { effects, ..support::camera(100, 2.0e-5, sensor) }
}

fn plain() -> Camera {
    camera(Effects::default())
}

/// The impact lies between the frames 9 and 10.
fn shot() -> Shot {
    Shot {
        stage_m: 0.0,
        first_body_px: [50.3, 49.5],
        first_image: -10,
        n_frames: 40,
        trigger_delay_s: 5.0e-6,
        frame_phase_s: 1.0e-5,
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

/// Tones of a frame without noise and rounding.
fn seen(camera: &Camera, shot: &Shot, frame: usize) -> Array2<f64> {
    tones_of(camera, &specimen(), shot, frame)
}

fn tones_of(camera: &Camera, specimen: &Specimen, shot: &Shot, frame: usize) -> Array2<f64> {
    let motion = steady();
    let counts = Scene::new(camera, specimen, shot, &motion).unwrap().expected_counts(frame).unwrap();
    counts.mapv(|count| (f64::from(count) - BLACK) / RANGE)
}

fn recorded(camera: &Camera, shot: &Shot, frame: usize) -> Array2<f64> {
    let (specimen, motion) = (specimen(), steady());
    let scene = Scene::new(camera, &specimen, shot, &motion).unwrap();
    scene.recorded_counts(frame).unwrap().mapv(f64::from)
}

fn largest_difference(one: &Array2<f64>, other: &Array2<f64>) -> f64 {
    one.iter().zip(other).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
}

/// Checks a frame's stated centres against those of the plain camera, moved by a rule.
fn assert_centres(camera: &Camera, frame: usize, moved: impl Fn([f64; 2]) -> [f64; 2]) {
    let (specimen, shot, motion, plain) = (specimen(), shot(), steady(), plain());
    let stated = Scene::new(camera, &specimen, &shot, &motion).unwrap().body_centres_px(frame).unwrap();
    let before = Scene::new(&plain, &specimen, &shot, &motion).unwrap().body_centres_px(frame).unwrap();
    for (stated, expected) in stated.into_iter().zip(before.into_iter().map(moved)) {
        // Rounding of a few hundred pixels.
        assert!(
            (stated[0] - expected[0]).hypot(stated[1] - expected[1]) < 1.0e-10,
            "{stated:?} {expected:?}"
        );
    }
}

#[test]
fn a_shaken_picture_is_the_plain_one_displaced_by_the_stated_amount() {
    let shake = Shake {
        amplitude_px: [0.2, 0.5],
        turn_amplitude_rad: 0.0,
        frequency_hz: 700.0,
        onset: ShakeOnset::Always,
        decay_per_s: 0.0,
    };
    let camera = camera(Effects { shake: Some(shake), ..Effects::default() });
    let (specimen, shot, motion) = (specimen(), shot(), steady());
    let scene = Scene::new(&camera, &specimen, &shot, &motion).unwrap();
    let phases = scene.camera_truth().shake_phases_rad;
    for frame in [0, 13, 39] {
        let stamp_s = 1.0e-5 + (frame as f64 - 10.0) / 25_000.0;
        let swing = |axis: usize, amplitude: f64| amplitude * (TAU * 700.0 * stamp_s + phases[axis]).sin();
        let shift = [swing(0, 0.2), swing(1, 0.5)];
        let first_body_px = [shot.first_body_px[0] + shift[0], shot.first_body_px[1] + shift[1]];
        let moved = seen(&plain(), &Shot { first_body_px, ..shot.clone() }, frame);
        // 1e-6: single precision.
        let difference = largest_difference(&seen(&camera, &shot, frame), &moved);
        assert!(difference < 1.0e-6, "{frame}: {difference:e}");
        assert_centres(&camera, frame, |[x, y]| [x + shift[0], y + shift[1]]);
        let pose = scene.camera_pose(frame);
        assert!((pose.shift_px[0] - shift[0]).abs() < 1.0e-12 && pose.turn_rad.abs() < 1.0e-15);
    }
}

#[test]
fn each_recording_has_its_own_phase_of_the_shake() {
    let shake = Shake {
        amplitude_px: [0.2, 0.2],
        turn_amplitude_rad: 0.0,
        frequency_hz: 200.0,
        onset: ShakeOnset::Always,
        decay_per_s: 0.0,
    };
    let camera = camera(Effects { shake: Some(shake), ..Effects::default() });
    let (specimen, motion, n) = (specimen(), steady(), 200);
    let phases: Vec<f64> = (0..n)
        .map(|noise_seed| Shot { noise_seed, ..shot() })
        .map(|shot| {
            Scene::new(&camera, &specimen, &shot, &motion).unwrap().camera_truth().shake_phases_rad[0]
        })
        .collect();
    // Uniform: the resultant of n unit vectors has a mean square of 1/n, so its length is below 3 sqrt(1/n) but once in
    // exp(-9) = 1e-4 draws.
    let resultant = |of: fn(f64) -> f64| phases.iter().map(|&phase| of(phase)).sum::<f64>() / n as f64;
    assert!(resultant(f64::cos).hypot(resultant(f64::sin)) < 3.0 / (n as f64).sqrt());
}

#[test]
fn the_impact_sets_off_a_ring_down() {
    let shake = Shake {
        amplitude_px: [0.3, 0.1],
        turn_amplitude_rad: 0.0,
        frequency_hz: 1500.0,
        onset: ShakeOnset::Impact,
        decay_per_s: 2000.0,
    };
    let camera = camera(Effects { shake: Some(shake), ..Effects::default() });
    for frame in 0..40 {
        let time_s = 1.0e-5 + (frame as f64 - 10.0) / 25_000.0 + 5.0e-6;
        let swing = if time_s > 0.0 { (-2000.0 * time_s).exp() * (TAU * 1500.0 * time_s).sin() } else { 0.0 };
        assert_centres(&camera, frame, |[x, y]| [x + 0.3 * swing, y + 0.1 * swing]);
    }
    assert_eq!(seen(&camera, &shot(), 9), seen(&plain(), &shot(), 9), "still before the impact");
}

/// A lens and pose that do nothing.
fn no_optics() -> Optics {
    toml::from_str("focal_length_px = 1e4").unwrap()
}

#[test]
fn a_turn_is_a_roll_of_the_camera_at_each_instant() {
    let shake = Shake {
        amplitude_px: [0.0, 0.0],
        turn_amplitude_rad: 2.0e-3,
        frequency_hz: 700.0,
        onset: ShakeOnset::Impact,
        decay_per_s: 0.0,
    };
    let turning = camera(Effects { shake: Some(shake), ..Effects::default() });
    let frame = 17;
    let turn_rad = 2.0e-3 * (TAU * 700.0 * (1.5e-5 + 7.0 / 25_000.0)).sin();
    let rolled = Camera { optics: Some(Optics { roll_rad: turn_rad, ..no_optics() }), ..plain() };
    // 1e-6: single precision.
    assert!(largest_difference(&seen(&turning, &shot(), frame), &seen(&rolled, &shot(), frame)) < 1.0e-6);
    let (sine, cosine) = turn_rad.sin_cos();
    assert_centres(&turning, frame, |[x, y]| {
        let [x, y] = [x - 199.5, y - 49.5];
        [199.5 + cosine * x - sine * y, 49.5 + sine * x + cosine * y]
    });
}

/// The mean of pictures displaced by a normal distribution: what a lens out of focus shows.
fn displaced_mean(shot: &Shot, specimen: &Specimen, frame: usize, defocus_px: f64) -> Array2<f64> {
    let n = 21;
    let place = |i: i32| 9.0 * (f64::from(i) / f64::from(n - 1) - 0.5);
    let mut sum = Array2::zeros((100, 400));
    let mut total = 0.0;
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let weight = (-0.5 * (place(i).powi(2) + place(j).powi(2))).exp();
        let [x, y] = shot.first_body_px;
        let first_body_px = [x + defocus_px * place(i), y + defocus_px * place(j)];
        sum = sum + weight * tones_of(&plain(), specimen, &Shot { first_body_px, ..shot.clone() }, frame);
        total += weight;
    }
    sum / total
}

#[test]
fn defocus_is_the_mean_of_displaced_pictures() {
    let defocus = Defocus { first_px: 0.4, last_px: 1.2 };
    let camera = camera(Effects { defocus: Some(defocus), ..Effects::default() });
    let (specimen, shot) = (specimen(), Shot { n_frames: 11, ..shot() });
    // Even growth: 0.4 px and a share 5/10 of 0.8 px.
    for (frame, defocus_px) in [(0, 0.4), (5, 0.8)] {
        let (found, mean) =
            (seen(&camera, &shot, frame), displaced_mean(&shot, &specimen, frame, defocus_px));
        for (low, high) in [(36, 64), (186, 214)] {
            let part = s![36..63, low..high];
            let difference = largest_difference(&found.slice(part).to_owned(), &mean.slice(part).to_owned());
            // Inside a marker, more than 6 sigma from its edges: a sum over a normal distribution with steps of 0.45 sigma has
            // converged (aliases of exp(-2 pi^2/0.2)); left are its tails beyond 4.5 sigma, 7e-6 of what changes there, up to
            // 0.5, and single precision.
            assert!(difference < 5.0e-6, "{frame}: {difference:e}");
        }
        // At the markers' left and right edges, steps of 0.45 sigma, at most 0.36 px, meet the kinks of a sharp edge's
        // coverage: step^2/8 of a jump in slope of 0.7/px, weighed by a density of 0.5/px (1/px for half the step): 6e-3.
        for (low, high) in [(16, 84), (166, 234)] {
            let part = s![30..70, low..high];
            let difference = largest_difference(&found.slice(part).to_owned(), &mean.slice(part).to_owned());
            assert!(difference < 6.0e-3, "{frame}: {difference}");
        }
        // Everywhere: where walls meet rods, the mean of products is not the product of means; a wall covers at most all of a
        // pixel, of a tone 0.4 above what is behind, and half of it is off at worst where a rod's edge halves it.
        assert!(largest_difference(&found, &mean) < 0.1);
    }
}

#[test]
fn defocus_through_optics_that_do_nothing_is_that_of_the_straight_view() {
    let defocus = Defocus { first_px: 0.0, last_px: 1.2 };
    let straight = camera(Effects { defocus: Some(defocus), ..Effects::default() });
    let lens = Camera { optics: Some(no_optics()), ..straight.clone() };
    let shot = Shot { n_frames: 11, ..shot() };
    let (found, expected) = (seen(&lens, &shot, 10), seen(&straight, &shot, 10));
    // Body 1's marker inside its edges, and walls, rods and rings beside it: 2e-6 of the quadrature, 1e-5 of blots that end
    // at 4 sigma in squares or in circles.
    for part in [s![32..67, 33..68], s![.., 90..160]] {
        let difference = largest_difference(&found.slice(part).to_owned(), &expected.slice(part).to_owned());
        assert!(difference < 2.0e-5, "{difference:e}");
    }
    // At the markers' edges, the mean of cover times depth is taken for the product of means: off by less than the depth's
    // largest slope, 0.52 times 0.38/px, times the deviation of what lies on one side of an edge, 0.4 times 1.2 px.
    assert!(largest_difference(&found, &expected) < 0.52 * 0.38 * 0.4 * 1.2);
}

#[test]
fn contrast_falls_as_the_focus_is_lost() {
    let defocus = Defocus { first_px: 0.0, last_px: 1.2 };
    let camera = camera(Effects { defocus: Some(defocus), ..Effects::default() });
    let shot = Shot { n_frames: 11, ..shot() };
    let marker = s![23..77, 24..77];
    assert_eq!(
        seen(&camera, &shot, 0).slice(marker),
        seen(&plain(), &shot, 0).slice(marker),
        "in focus at first"
    );
    let contrast = |frame| seen(&camera, &shot, frame).slice(s![30..70, 30..70]).std(0.0);
    let contrasts: Vec<f64> = (0..10).map(contrast).collect();
    assert!(contrasts.windows(2).all(|pair| pair[1] < pair[0]), "{contrasts:?}");
}

#[test]
fn a_wrong_scale_moves_and_enlarges_everything_from_body_1_on() {
    let scale = ScaleError { error: 0.01, ..ScaleError::default() };
    let wrong = camera(Effects { scale: Some(scale), ..Effects::default() });
    assert_centres(&wrong, 30, |[x, y]| [50.3 + 1.01 * (x - 50.3), y]);
    // The markers are those of a camera whose stated scale is larger, with speckles as much larger.
    let mut larger = specimen();
    larger.marker.speckle_diameter_px *= 1.01;
    let stated = Camera { scale_px_per_m: 5050.0, ..plain() };
    let (found, expected) = (seen(&wrong, &shot(), 30), tones_of(&stated, &larger, &shot(), 30));
    let part = s![23..76, 28..81];
    // 1e-6: single precision.
    assert!(largest_difference(&found.slice(part).to_owned(), &expected.slice(part).to_owned()) < 1.0e-6);
}

#[test]
fn a_magnified_view_grows_about_the_optical_axis() {
    let scale = ScaleError { views: vec![0.0, 0.02], ..ScaleError::default() };
    let camera = camera(Effects { scale: Some(scale), ..Effects::default() });
    assert_centres(&camera, 30, |at_px| at_px);
    let (specimen, motion, second) = (specimen(), steady(), Shot { view: 2, ..shot() });
    let plain = plain();
    let scene = Scene::new(&camera, &specimen, &second, &motion).unwrap();
    let before = Scene::new(&plain, &specimen, &second, &motion).unwrap().body_centres_px(30).unwrap();
    for (found, [x, y]) in scene.body_centres_px(30).unwrap().into_iter().zip(before) {
        let expected = [199.5 + 1.02 * (x - 199.5), 49.5 + 1.02 * (y - 49.5)];
        assert!((found[0] - expected[0]).hypot(found[1] - expected[1]) < 1.0e-10); // rounding
    }
    let truth = scene.camera_truth();
    assert!(
        (truth.view_magnification - 1.02).abs() < 1.0e-15 && (truth.scale_px_per_m - 5100.0).abs() < 1.0e-9
    );
}

#[test]
fn line_k_is_exposed_k_line_times_later() {
    let line_time_s = 3.0e-7;
    let lighting = Lighting { drift_per_s: 0.0, flicker_amplitude: 0.1, flicker_hz: 5000.0 };
    let plain = Camera { lighting: Some(lighting), ..plain() };
    let effects = Effects { line_time_s: Some(line_time_s), ..Effects::default() };
    let rolling = Camera { effects, ..plain.clone() };
    let found = seen(&rolling, &shot(), 30);
    for row in [0, 1, 33, 50, 99] {
        let later_s = row as f64 * line_time_s;
        // The whole frame that much later, by the motion and by the light.
        let later = Shot { frame_phase_s: shot().frame_phase_s + later_s, ..shot() };
        let expected = seen(&plain, &later, 30);
        let part = s![row..row + 1, ..];
        // 1e-6: single precision.
        let difference = largest_difference(&found.slice(part).to_owned(), &expected.slice(part).to_owned());
        assert!(difference < 1.0e-6, "{row}: {difference:e}");
    }
    let (specimen, shot, motion) = (specimen(), shot(), steady());
    let centres = Scene::new(&rolling, &specimen, &shot, &motion).unwrap().body_centres_px(30).unwrap();
    for (body, [column, row]) in centres.into_iter().enumerate() {
        // All centres lie on row 49.5.
        let time_s = 1.5e-5 + 20.0 / 25_000.0 + 49.5 * line_time_s;
        let expected = 50.3 + 5000.0 * (0.030 * body as f64 + (body + 1) as f64 * time_s);
        assert!((column - expected).abs() < 1.0e-10 && (row - 49.5).abs() < 1.0e-12); // rounding
    }
}

#[test]
fn the_sensor_and_its_window_are_the_same_in_every_recording() {
    let effects = Effects {
        seed: 5,
        fixed_pattern: Some(FixedPattern {
            offset_sigma: 0.001,
            gain_sigma: 0.01,
            ..FixedPattern::default()
        }),
        defective_pixels: Some(DefectivePixels {
            hot_fraction: 0.001,
            hot_offset_mean: 0.1,
            dead_fraction: 0.001,
        }),
        reflections: Some(Reflections { glare: 0.06, dirt: 0.02, size_px: 15.0, per_view: false }),
        ..Effects::default()
    };
    // What the camera adds where it sees the same: pixels of the wall behind, in frames of two recordings and of two views.
    let here = shot();
    let other = Shot { noise_seed: 9, view: 2, ..shot() };
    let added =
        |shot: &Shot, frame: usize| seen(&camera(effects.clone()), shot, frame) - seen(&plain(), shot, frame);
    assert_eq!(added(&here, 0), added(&other, 0));
    assert_eq!(added(&here, 0), added(&here, 9));
    assert!(added(&here, 0) != added(&here, 30), "gain and dirt act on the moving bodies' light");
    let another_sensor = Effects { seed: 6, ..effects.clone() };
    let others = seen(&camera(another_sensor), &here, 0) - seen(&plain(), &here, 0);
    assert!(largest_difference(&added(&here, 0), &others) > 0.05);
    let (specimen, motion, camera) = (specimen(), steady(), camera(effects));
    let truth = Scene::new(&camera, &specimen, &here, &motion).unwrap().camera_truth();
    // 40 000 pixels, one in a thousand: binomial, 4.5 standard errors.
    for n in [truth.hot_pixels.len(), truth.dead_pixels.len()] {
        assert!((n as f64 - 40.0).abs() < 4.5 * 40.0_f64.sqrt(), "{n}");
    }
    let dark = seen(&camera, &here, 0);
    assert!(truth.dead_pixels.iter().all(|&[column, row]| dark[[row, column]].abs() < 1.0e-6));
}

#[test]
fn a_shadow_takes_its_share_of_the_light() {
    let shadow = Shadow { depth: 0.4, start_px: 0.0, speed_px_per_s: 2.0e5, edge_sigma_px: 10.0 };
    let found = seen(&camera(Effects { shadow: Some(shadow), ..Effects::default() }), &shot(), 30);
    let before = seen(&plain(), &shot(), 30);
    // The edge is at 2e5 (20/25000 + 1e-5) = 162 px.
    for (column, factor) in [(20, 0.6), (162, 0.8), (300, 1.0)] {
        for row in [5, 50, 90] {
            // 1e-6: single precision.
            assert!((found[[row, column]] - factor * before[[row, column]]).abs() < 1.0e-6, "{row} {column}");
        }
    }
}

#[test]
fn vignetting_stays_where_it_is_and_takes_its_share_at_the_corners() {
    for frame in [0, 30] {
        let found = seen(&camera(Effects { vignetting: Some(0.3), ..Effects::default() }), &shot(), frame);
        let before = seen(&plain(), &shot(), frame);
        let [height, width] = [before.nrows(), before.ncols()];
        let middle = [0.5 * (width as f64 - 1.0), 0.5 * (height as f64 - 1.0)];
        for (row, column) in
            [(0, 0), (0, width - 1), (height - 1, 7), (height / 2, width / 2), (height / 3, 3 * width / 4)]
        {
            let share = ((column as f64 - middle[0]).powi(2) + (row as f64 - middle[1]).powi(2))
                / (middle[0].powi(2) + middle[1].powi(2));
            let expected = (1.0 - 0.3 * share) * before[[row, column]];
            // 1e-6: single precision.
            assert!((found[[row, column]] - expected).abs() < 1.0e-6, "{row} {column}");
        }
    }
}

/// The camera with noise, so that low bits are random.
fn noisy(effects: Effects) -> Camera {
    let mut camera = camera(effects);
    camera.sensor.read_noise_counts = 20.0;
    camera
}

#[test]
fn fewer_bits_round_to_the_nearest_count_that_is_left() {
    let kept = recorded(&noisy(Effects { stored_bits: Some(8), ..Effects::default() }), &shot(), 0);
    let whole = recorded(&noisy(Effects::default()), &shot(), 0);
    assert!(kept.iter().all(|count| (count / 16.0).fract().abs() < 1.0e-12));
    let squares = kept.iter().zip(&whole).map(|(kept, whole)| (kept - whole).powi(2)).sum::<f64>();
    // Uniform over 16 counts: a mean square of (16^2 + 2)/12 (whole counts from -7 to 8), relative variance 0.8; 4.5 standard
    // errors of 40 000 pixels.
    let law = (256.0 + 2.0) / 12.0;
    assert!((squares / 4.0e4 / law - 1.0).abs() < 4.5 * (0.8_f64 / 4.0e4).sqrt(), "{}", squares / 4.0e4);
}

#[test]
fn compression_changes_counts_by_its_steps() {
    let whole = recorded(&noisy(Effects::default()), &shot(), 0);
    let rms = |quality: u32| {
        let coded =
            recorded(&noisy(Effects { jpeg_quality: Some(quality), ..Effects::default() }), &shot(), 0);
        let squares = coded.iter().zip(&whole).map(|(coded, whole)| (coded - whole).powi(2)).sum::<f64>();
        (squares / 4.0e4).sqrt()
    };
    // At quality 100 no coefficient is off by more than half of 4095/255 counts, and no count by more than half for rounding.
    let (fine, coarse) = (rms(100), rms(30));
    assert!(fine <= 4095.0 / 255.0 / 2.0 + 0.5 && fine > 0.0, "{fine}");
    assert!(coarse > fine, "{coarse}");
}

#[test]
fn repeated_lines_stand_in_the_stated_frames_and_no_others() {
    let camera = noisy(Effects { repeated_lines: Some(0.3), ..Effects::default() });
    let (specimen, shot, motion) = (specimen(), shot(), steady());
    let scene = Scene::new(&camera, &specimen, &shot, &motion).unwrap();
    let stated = scene.camera_truth().repeated_line_frames;
    // Binomial of 40 frames: 4.5 standard errors.
    assert!((stated.len() as f64 - 12.0).abs() < 4.5 * (40.0_f64 * 0.3 * 0.7).sqrt(), "{}", stated.len());
    for frame in 0..40 {
        let counts = scene.recorded_counts(frame).unwrap();
        let repeats = counts.slice(s![..;2, ..]) == counts.slice(s![1..;2, ..]);
        assert_eq!(repeats, stated.contains(&frame), "{frame}");
        let whole = recorded(&noisy(Effects::default()), &shot, frame);
        assert_eq!(counts.mapv(f64::from).slice(s![..;2, ..]), whole.slice(s![..;2, ..]));
    }
}

/// Everything at once.
fn every_effect() -> Effects {
    let text = r#"
        seed = 4
        fixed_pattern = { offset_sigma = 0.001, gain_sigma = 0.003, row_offset_sigma = 0.001, column_offset_sigma = 0.001 }
        defective_pixels = { hot_fraction = 0.001, hot_offset_mean = 0.1, dead_fraction = 0.0005 }
        reflections = { glare = 0.06, dirt = 0.02, size_px = 25.0, per_view = true }
        shadow = { depth = 0.4, start_px = 0.0, speed_px_per_s = 1e5, edge_sigma_px = 30.0 }
        defocus = { last_px = 1.2 }
        shake = { amplitude_px = [0.2, 0.1], turn_amplitude_rad = 1e-4, frequency_hz = 200.0, onset = "always" }
        scale = { error = 0.01, view_sigma = 0.004, views = [0.0, 0.02] }
        line_time_s = 3e-7
        jpeg_quality = 80
        stored_bits = 8
        repeated_lines = 0.2
    "#;
    toml::from_str(text).unwrap()
}

#[test]
fn all_effects_at_once_give_equal_bytes_in_any_thread() {
    let folder = tempfile::tempdir().unwrap();
    let camera = Camera { height_px: 40, ..noisy(every_effect()) };
    let (specimen, motion) = (specimen(), steady());
    let shot = Shot { n_frames: 6, first_body_px: [50.3, 19.5], ..shot() };
    let filmed = |name: &str| {
        let path = folder.path().join(name);
        let scene = Scene::new(&camera, &specimen, &shot, &motion).unwrap();
        film(&path, &scene, &FileFaults::default()).unwrap();
        std::fs::read(path).unwrap()
    };
    let alone = filmed("alone");
    let together: Vec<Vec<u8>> = std::thread::scope(|scope| {
        let threads: Vec<_> = ["a", "b", "c"].map(|name| scope.spawn(|| filmed(name))).into();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(together.iter().all(|bytes| *bytes == alone));
}

#[test]
fn effects_are_read_and_written_and_absent_when_off() {
    let text = toml::to_string(&plain()).unwrap();
    assert!(!text.contains("effects"), "{text}");
    let camera = camera(every_effect());
    assert_eq!(toml::from_str::<Camera>(&toml::to_string(&camera).unwrap()).unwrap(), camera);
    let message = toml::from_str::<Effects>("shakes = 1").unwrap_err().to_string();
    assert!(message.contains("shakes"), "{message}");
    assert!(toml::from_str::<Effects>("defocus = { last_px = 1.0, middle_px = 0.5 }").is_err());
    assert!(Effects::default().is_off() && !every_effect().is_off());
}

#[test]
fn impossible_effects_are_refused_by_name() {
    let shake = Shake {
        amplitude_px: [0.2, 0.2],
        turn_amplitude_rad: 0.0,
        frequency_hz: 200.0,
        onset: ShakeOnset::Always,
        decay_per_s: 1.0,
    };
    let nan = f64::NAN;
    let none = Effects::default;
    let pattern = FixedPattern { gain_sigma: nan, ..FixedPattern::default() };
    let defects = DefectivePixels { dead_fraction: 1.5, ..DefectivePixels::default() };
    for (name, effects) in [
        ("effects.shake.decay_per_s", Effects { shake: Some(shake), ..none() }),
        ("effects.fixed_pattern.gain_sigma", Effects { fixed_pattern: Some(pattern), ..none() }),
        ("effects.defective_pixels.dead_fraction", Effects { defective_pixels: Some(defects), ..none() }),
        (
            "effects.defocus.last_px",
            Effects { defocus: Some(Defocus { first_px: 0.0, last_px: 9.0 }), ..none() },
        ),
        ("effects.line_time_s", Effects { line_time_s: Some(1.0e-6), ..none() }),
        ("effects.jpeg_quality", Effects { jpeg_quality: Some(0), ..none() }),
        ("effects.stored_bits", Effects { stored_bits: Some(13), ..none() }),
        ("effects.repeated_lines", Effects { repeated_lines: Some(-0.1), ..none() }),
        (
            "effects.scale.view_sigma",
            Effects { scale: Some(ScaleError { view_sigma: 1.0, ..ScaleError::default() }), ..none() },
        ),
    ] {
        let (camera, specimen, shot, motion) = (camera(effects), specimen(), shot(), steady());
        let message = Scene::new(&camera, &specimen, &shot, &motion).err().unwrap().to_string();
        assert!(message.contains(name), "{message}");
    }
}
