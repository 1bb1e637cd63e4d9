//! Each effect of the realistic camera, alone, against what it must do to the plain picture.

#![cfg(test)]

mod support;

use chainwave_measurement::Trajectory;
use chainwave_synthetic::{Camera, Cover, Lighting, Optics, Scene, Sensor, Shapes, Shot, Tones};
use ndarray::{Array2, Array4, s};
use support::specimen;

const BLACK: f64 = 64.0;
const RANGE: f64 = 4000.0;

fn camera() -> Camera {
    let sensor =
        Sensor { bit_depth: 12, black_level: BLACK, read_noise_counts: 0.0, counts_per_electron: 0.0 };
    support::camera(100, 2.0e-5, sensor)
}

fn shot() -> Shot {
    Shot {
        stage_m: 0.0,
        first_body_px: [50.3, 49.5],
        first_image: 0,
        n_frames: 20,
        trigger_delay_s: 1.0e-3,
        frame_phase_s: 1.0e-5,
        noise_seed: 1,
        view: 1,
        covers: Vec::new(),
    }
}

/// Every body moves at 4 n m/s (n = 1, 2, 3) from 50 mm before its rest on.
fn steady() -> Trajectory {
    let times_s = vec![0.0, 4.0e-3];
    let speed_m_per_s = |body: usize| 4.0 * (body + 1) as f64;
    Trajectory {
        displacement_m: Array2::from_shape_fn((3, 2), |(body, i)| {
            speed_m_per_s(body) * (times_s[i] - 1.0e-3)
        }),
        velocity_m_per_s: Array2::from_shape_fn((3, 2), |(body, _)| speed_m_per_s(body)),
        times_s,
    }
}

/// Tones of a frame without noise and rounding.
fn seen(camera: &Camera, shot: &Shot, frame: usize) -> Array2<f64> {
    let (specimen, motion) = (specimen(), steady());
    let counts = Scene::new(camera, &specimen, shot, &motion).unwrap().expected_counts(frame).unwrap();
    counts.mapv(|count| (f64::from(count) - BLACK) / RANGE)
}

fn largest_difference(one: &Array2<f64>, other: &Array2<f64>) -> f64 {
    one.iter().zip(other).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
}

/// The mean of many short exposures that fill the long one.
fn subframes(camera: &Camera, n: usize) -> Array2<f64> {
    let sharp = Camera { blur: false, ..camera.clone() };
    let mut sum = Array2::zeros((camera.height_px, camera.width_px));
    for i in 0..n {
        let later_s = ((i as f64 + 0.5) / n as f64 - 0.5) * camera.exposure_s;
        let shot = shot();
        sum += &seen(&sharp, &Shot { trigger_delay_s: shot.trigger_delay_s + later_s, ..shot }, 1);
    }
    sum / n as f64
}

#[test]
fn the_blur_is_the_mean_of_the_subframes() {
    let camera = Camera { blur: true, ..camera() };
    let blurred = seen(&camera, &shot(), 1);
    let mean = subframes(&camera, 200);
    // Markers, which move by 0.4 and 0.8 px (the third has left): the midpoint rule, (0.8/200)^2/24 of a slope's slope,
    // and single precision.
    for (low, high) in [(32, 76), (178, 226)] {
        let part = s![25..75, low..high];
        let difference = largest_difference(&blurred.slice(part).to_owned(), &mean.slice(part).to_owned());
        assert!(difference < 2.0e-6, "{difference:e}");
        assert!(
            largest_difference(
                &blurred.slice(part).to_owned(),
                &seen(&self::camera(), &shot(), 1).slice(part).to_owned()
            ) > 1.0e-3
        );
    }
    // Everywhere: where rings meet, one hides the other in each subframe, and the mean of products is not their product.
    let difference = largest_difference(&blurred, &mean);
    assert!(difference < 0.05, "{difference:e}");
}

#[test]
fn bodies_at_rest_are_not_blurred() {
    let camera = Camera { blur: true, ..camera() };
    let resting = Shot { trigger_delay_s: -2.0e-3, ..shot() };
    assert_eq!(seen(&camera, &resting, 1), seen(&self::camera(), &resting, 1));
}

/// The frame's centre.
const MIDDLE_PX: [f64; 2] = [199.5, 49.5];

/// A lens and pose that do nothing.
fn straight() -> Optics {
    Optics {
        focal_length_px: 10_000.0,
        principal_point_px: None,
        k1: 0.0,
        k2: 0.0,
        p1: 0.0,
        p2: 0.0,
        roll_rad: 0.0,
        yaw_rad: 0.0,
        pitch_rad: 0.0,
    }
}

#[test]
fn optics_that_do_nothing_show_the_plain_picture_by_quadrature() {
    for blur in [false, true] {
        let plain = Camera { blur, ..camera() };
        let camera = Camera { optics: Some(straight()), ..plain.clone() };
        let (found, expected) = (seen(&camera, &shot(), 1), seen(&plain, &shot(), 1));
        for (low, high) in [(32, 76), (178, 226)] {
            let part = s![25..75, low..high];
            let difference =
                largest_difference(&found.slice(part).to_owned(), &expected.slice(part).to_owned());
            // 2e-6: the quadrature's 5e-7 of a depth along each side and the motion, and single precision.
            assert!(difference < 2.0e-6, "{difference:e}");
        }
        // Beside the markers, the backdrop's blots end at 4 sigma, exp(-8) of 0.03, in squares of slightly different size. At
        // the markers' edges, where they move, the speckles that the edge cuts are taken at mid exposure.
        let difference = largest_difference(&found, &expected);
        assert!(difference < if blur { 0.03 } else { 2.0e-5 }, "{difference:e}");
    }
}

#[test]
fn a_picture_upside_down_is_the_plain_one_read_backwards() {
    let optics = Optics { roll_rad: std::f64::consts::PI, ..straight() };
    let turned = seen(&Camera { optics: Some(optics), ..camera() }, &shot(), 1);
    let plain = seen(&camera(), &shot(), 1);
    let backwards = plain.slice(s![..;-1, ..;-1]).to_owned();
    // 2e-5: as above.
    let difference = largest_difference(&turned, &backwards);
    assert!(difference < 2.0e-5, "{difference:e}");
}

/// Where the optics show a point, one effect at a time: the closed forms written out.
fn shown_px(optics: &Optics, at_px: [f64; 2]) -> [f64; 2] {
    let axis_px = optics.principal_point_px.unwrap_or(MIDDLE_PX);
    let [x, y] = [0, 1].map(|axis| (at_px[axis] - axis_px[axis]) / 1.0e4);
    let (square, Optics { k1, p1, p2, .. }) = (x * x + y * y, *optics);
    let (sin_yaw, cos_yaw) = optics.yaw_rad.sin_cos();
    let (sin_pitch, cos_pitch) = optics.pitch_rad.sin_cos();
    let (sin_roll, cos_roll) = optics.roll_rad.sin_cos();
    let depth = 1.0 - x * sin_yaw + y * sin_pitch;
    let [u, v] = [x * cos_yaw / depth, y * cos_pitch / depth];
    let bent = [
        u * (1.0 + k1 * square) + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
        v * (1.0 + k1 * square) + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
    ];
    let turned = [cos_roll * bent[0] - sin_roll * bent[1], sin_roll * bent[0] + cos_roll * bent[1]];
    [0, 1].map(|axis| axis_px[axis] + 1.0e4 * turned[axis])
}

/// Centroid of the picture of a square, from its outline (the polygon's centroid by Green's theorem).
fn square_centroid_px(optics: &Optics, centre_px: [f64; 2], half_px: f64) -> [f64; 2] {
    let n = 100;
    let outline: Vec<[f64; 2]> = (0..4 * n)
        .map(|i| (i / n, 2.0 * (i % n) as f64 / n as f64 - 1.0))
        .map(|(side, along)| [[along, -1.0], [1.0, along], [-along, 1.0], [-1.0, -along]][side])
        .map(|[x, y]| shown_px(optics, [centre_px[0] + half_px * x, centre_px[1] + half_px * y]))
        .collect();
    let mut sums = [0.0; 3];
    for (index, from) in outline.iter().enumerate() {
        let to = outline[(index + 1) % outline.len()];
        // From the centre, so that nothing cancels.
        let [x0, y0, x1, y1] =
            [from[0] - centre_px[0], from[1] - centre_px[1], to[0] - centre_px[0], to[1] - centre_px[1]];
        let cross = x0 * y1 - x1 * y0;
        sums = [sums[0] + cross, sums[1] + cross * (x0 + x1), sums[2] + cross * (y0 + y1)];
    }
    [centre_px[0] + sums[1] / (3.0 * sums[0]), centre_px[1] + sums[2] / (3.0 * sums[0])]
}

/// Centroid of the light that body 2's blank marker adds to an even wall, and its stated centre; the marker's and the
/// optical axis lie `phase_px` right of and below their usual places.
fn centroid_px(optics: &Optics, phase_px: f64) -> [[f64; 2]; 2] {
    let mut specimen = specimen();
    specimen.tones = Tones { backdrop: 0.2, blot: 0.0, ring: 0.2, marker: 0.8, speckle_depth: 0.0, rod: 0.0 };
    specimen.rods.below_axis_m.clear();
    (specimen.marker.half_width_m, specimen.marker.half_height_m) = (1.5e-3, 1.5e-3);
    let axis_px = optics.principal_point_px.unwrap_or(MIDDLE_PX).map(|at_px| at_px + phase_px);
    let camera = Camera { optics: Some(Optics { principal_point_px: Some(axis_px), ..*optics }), ..camera() };
    let first_body_px = shot().first_body_px.map(|at_px| at_px + phase_px);
    let shot = Shot { trigger_delay_s: 0.0, frame_phase_s: 0.0, first_body_px, ..shot() };
    let motion = still();
    let scene = Scene::new(&camera, &specimen, &shot, &motion).unwrap();
    let light = scene.expected_counts(0).unwrap().mapv(|count| (f64::from(count) - BLACK) / RANGE - 0.2);
    let near = light.slice(s![.., 120..280]);
    let moment = |of: &dyn Fn((usize, usize)) -> f64| {
        near.indexed_iter().map(|(place, light)| of(place) * light).sum::<f64>()
    };
    let [column, row] = [moment(&|(_, column)| column as f64 + 120.0), moment(&|(row, _)| row as f64)];
    let total = moment(&|_| 1.0);
    let stated_px = scene.body_centres_px(0).unwrap()[1];
    [[column / total, row / total], stated_px].map(|at_px| at_px.map(|at_px| at_px - phase_px))
}

fn still() -> Trajectory {
    let zeros = Array2::zeros((3, 1));
    Trajectory { times_s: vec![1.0], displacement_m: zeros.clone(), velocity_m_per_s: zeros }
}

#[test]
fn the_picture_lies_where_the_lens_and_the_pose_put_it() {
    for (moves_px, optics) in [
        (0.2, Optics { k1: 40.0, principal_point_px: Some([50.0, 20.0]), ..straight() }),
        (0.2, Optics { p1: 0.2, p2: -0.3, principal_point_px: Some([50.0, 20.0]), ..straight() }),
        (0.2, Optics { roll_rad: 0.01, principal_point_px: Some([50.0, 20.0]), ..straight() }),
        (0.2, Optics { yaw_rad: 0.1, principal_point_px: Some([50.0, 20.0]), ..straight() }),
        (0.1, Optics { pitch_rad: -0.1, principal_point_px: Some([50.0, 20.0]), ..straight() }),
    ] {
        let plain_px = [200.3, 49.5];
        // A pixel that the marker's edge cuts counts at its middle: averaged over the edge's place in the pixel, that is right.
        let phases = (0..16).map(|phase| centroid_px(&optics, f64::from(phase) / 16.0));
        let mean = phases.fold([[0.0; 2]; 2], |sum, phase| {
            [0, 1].map(|which| [0, 1].map(|axis| sum[which][axis] + phase[which][axis] / 16.0))
        });
        let [found_px, stated_px] = mean;
        let apart = |one: [f64; 2], other: [f64; 2]| (one[0] - other[0]).hypot(one[1] - other[1]);
        assert!(apart(stated_px, plain_px) > moves_px, "{optics:?}");
        // 1e-10 px: rounding.
        assert!(apart(stated_px, shown_px(&optics, plain_px)) < 1.0e-10, "{optics:?}");
        // 1e-3 px: the edges' pixels are taken for upright; turned by up to 0.01, their coverage is off by less than 0.01/2,
        // of opposite sign at opposite ends.
        let off_px = apart(found_px, square_centroid_px(&optics, plain_px, 7.5));
        assert!(off_px < 1.0e-3, "{optics:?}: {off_px}");
    }
}

#[test]
fn a_lens_that_folds_the_picture_is_refused_by_name() {
    let camera = Camera { optics: Some(Optics { k1: -2000.0, ..straight() }), ..camera() };
    let (specimen, shot, motion) = (specimen(), shot(), steady());
    let message = Scene::new(&camera, &specimen, &shot, &motion).err().unwrap().to_string();
    assert!(message.contains("camera.optics") && message.contains("folded"), "{message}");
}

#[test]
fn the_light_drifts_and_flickers_as_stated() {
    let lighting = Lighting { drift_per_s: 3.0, flicker_amplitude: 0.05, flicker_hz: 3000.0 };
    let camera = Camera { lighting: Some(lighting), ..camera() };
    let phase_rad = shot().flicker_phase_rad();
    assert!((0.0..std::f64::consts::TAU).contains(&phase_rad));
    let half_turn = std::f64::consts::PI * 3000.0 * 2.0e-5;
    for frame in [0, 7, 19] {
        let time_s = 1.0e-5 + frame as f64 / 25_000.0;
        let sine = (std::f64::consts::TAU * 3000.0 * time_s + phase_rad).sin();
        let factor = (1.0 + 3.0 * time_s) * (1.0 + 0.05 * half_turn.sin() / half_turn * sine);
        let plain = seen(&self::camera(), &shot(), frame);
        // 1e-6: single precision.
        assert!(largest_difference(&seen(&camera, &shot(), frame), &(plain * factor)) < 1.0e-6);
    }
    assert!(
        (shot().flicker_phase_rad() - Shot { noise_seed: 2, ..shot() }.flicker_phase_rad()).abs() > 1.0e-3
    );
}

#[test]
fn a_covered_body_is_dark_for_a_while_and_its_neighbours_stay() {
    let covers = vec![Cover { body: 2, from_s: 1.0e-4, until_s: 3.0e-4 }];
    let hidden = Shot { covers, ..shot() };
    for frame in 0..20 {
        let stamp_s = hidden.stamp_s(frame, 25_000.0);
        let (with, without) = (seen(&camera(), &hidden, frame), seen(&camera(), &shot(), frame));
        if (1.0e-4..3.0e-4).contains(&stamp_s) {
            let centre_px = 200.3 + 8.0 * 5000.0 * (stamp_s);
            let middle = centre_px as usize;
            // 1e-6: single precision; the rods lie outside these rows.
            assert!(
                with.slice(s![25..75, middle - 25..middle + 25])
                    .iter()
                    .all(|tone| (tone - 0.05).abs() < 1.0e-6)
            );
            assert_eq!(with.slice(s![.., ..120]), without.slice(s![.., ..120]));
        } else {
            assert_eq!(with, without);
        }
    }
}

#[test]
fn the_stage_moves_the_picture_by_its_error() {
    let plain = seen(&camera(), &shot(), 0);
    // 0.4 mm: two whole pixels, so that the pictures can be compared pixel by pixel.
    let moved = seen(&camera(), &Shot { stage_m: 0.4e-3, ..shot() }, 0);
    let difference =
        largest_difference(&plain.slice(s![.., 2..]).to_owned(), &moved.slice(s![.., ..398]).to_owned());
    assert!(difference < 2.0e-6, "{difference:e}"); // single precision
}

/// Ellipses of the rings' centreline whose axes change with time: at the second sample, 10 % shorter and 10 % higher.
fn breathing() -> Shapes {
    let point = |(_, time, point, axis): (usize, usize, usize, usize)| {
        let angle = point as f64 * std::f64::consts::TAU / 256.0;
        let grown = 0.1 * time as f64;
        match axis {
            0 => 14.8e-3 * (1.0 - grown) * angle.cos(),
            _ => 8.8e-3 * (1.0 + grown) * angle.sin(),
        }
    };
    Shapes {
        times_s: vec![1.0e-3, 2.0e-3],
        centreline_m: Array4::from_shape_fn((3, 2, 256, 2), point),
        wall_m: 0.4e-3,
    }
}

/// Lowest and highest row of body 2's wall above its centre, as light outweighs the wall behind: rows of a column.
fn wall_rows(picture: &Array2<f64>, column: usize) -> f64 {
    let above = picture.slice(s![..20, column]);
    let light: f64 = above.iter().map(|tone| (tone - 0.2).max(0.0)).sum();
    above.iter().enumerate().map(|(row, tone)| row as f64 * (tone - 0.2).max(0.0)).sum::<f64>() / light
}

#[test]
fn shapes_are_drawn_as_given_and_change_in_time() {
    let mut specimen = specimen();
    specimen.tones = Tones { backdrop: 0.2, blot: 0.0, ..Tones::default() };
    specimen.rods.below_axis_m.clear();
    let (camera, shapes, motion) = (camera(), breathing(), still());
    let picture = |delay_s: f64, shapes: Option<&Shapes>, optics: Option<Optics>| {
        let camera = Camera { optics, ..camera.clone() };
        let shot = Shot { trigger_delay_s: delay_s, frame_phase_s: 0.0, ..shot() };
        let scene = Scene::new(&camera, &specimen, &shot, &motion).unwrap();
        let scene = match shapes {
            Some(shapes) => scene.with_shapes(shapes).unwrap(),
            None => scene,
        };
        scene.expected_counts(0).unwrap().mapv(|count| (f64::from(count) - BLACK) / RANGE)
    };
    let (rigid, shaped) = (picture(0.0, None, None), picture(0.0, Some(&shapes), None));
    // The rigid ring's wall lies between two ellipses and the shape's is 2 px thick along its normal: away from the poles
    // they differ by 0.03 px of wall, at a tone of 0.3 above the wall behind.
    let middle = s![.., 165..235];
    let difference = largest_difference(&rigid.slice(middle).to_owned(), &shaped.slice(middle).to_owned());
    assert!(difference < 0.02, "{difference}");
    // Its upper wall lies 44 px above the centre at the first sample, 48.4 px at the second, half way between in between.
    for (delay_s, height_px) in [(1.0e-3, 44.0), (1.5e-3, 46.2), (0.5e-3, 44.0)] {
        let row_px = wall_rows(&picture(delay_s, Some(&shapes), None), 200);
        // 0.01 px: 0.3 px beside the middle of an ellipse of 125 px radius there, and the wall's straight pieces.
        assert!((49.5 - row_px - height_px).abs() < 0.01, "{delay_s}: {row_px}");
    }
    let warped = picture(1.5e-3, Some(&shapes), Some(straight()));
    let difference = largest_difference(&warped, &picture(1.5e-3, Some(&shapes), None));
    assert!(difference < 1.0e-5, "{difference}"); // as for rings
}
