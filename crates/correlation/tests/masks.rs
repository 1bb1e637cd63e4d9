//! What is left out of a subset: dark ground around a marker, and pixels that saturate or are no numbers.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]

mod support;

use chainwave_correlation::{
    Interpolation, PreparedSubset, Reference, ReferenceFrames, Settings, Window, Workspace, sharp_edge,
};
use chainwave_measurement::{Lost, Region};
use support::{FULL_RANGE, SIZE, Speckle, Wrong, moments, recorded, sense, subset};

/// Centres of the markers in the reference.
fn centres() -> impl Iterator<Item = [f64; 2]> {
    let line = || (35..390).step_by(58);
    line().flat_map(move |y| line().map(move |x| [f64::from(x), f64::from(y)]))
}

/// Speckled markers of `side` px that have moved by `shift`, sampled at their edges without any smoothing, on ground of
/// `ground` counts.
fn markers(speckle: &Speckle, side: f64, ground: f64, shift: [f64; 2]) -> Vec<f64> {
    // with less light, so that no speckles saturate
    let mut image = speckle.render(|[x, y]| [x + shift[0], y + shift[1]]);
    image.iter_mut().for_each(|value| *value *= 0.6);
    let on_marker = |i: usize| {
        let [x, y] = [(i % SIZE[0]) as f64 - shift[0], (i / SIZE[0]) as f64 - shift[1]];
        centres().any(|centre| (x - centre[0]).abs() < 0.5 * side && (y - centre[1]).abs() < 0.5 * side)
    };
    image.iter_mut().enumerate().filter(|(i, _)| !on_marker(*i)).for_each(|(_, value)| *value = ground);
    image
}

/// Error in x, and over its sigma, of each marker found in `target`; and the pixels that each match used.
fn errors(
    reference: &Reference,
    target: &[f32],
    shift: [f64; 2],
    interpolation: Interpolation,
) -> Vec<[f64; 3]> {
    let window = Window::new(Region::whole(SIZE[0], SIZE[1]), target, interpolation).unwrap();
    errors_in(reference, &window, shift)
}

fn errors_in(reference: &Reference, window: &Window, shift: [f64; 2]) -> Vec<[f64; 3]> {
    let settings = Settings { interpolation: window.interpolation(), ..Settings::default() };
    let mut workspace = Workspace::default();
    let mut find = |[x, y]: [f64; 2]| {
        let prepared = PreparedSubset::new(reference, &subset(x, y, 16), &settings).unwrap();
        let start = [x + shift[0].round(), y + shift[1].round()];
        let found = prepared.match_in(window, start, &mut workspace).unwrap().position.x_px;
        let error = found.value - x - shift[0];
        [error, error / found.sigma, prepared.n_used() as f64]
    };
    centres().map(&mut find).collect()
}

fn reference(image: &[f32]) -> Reference {
    let whole = Region::whole(SIZE[0], SIZE[1]);
    Reference::new(whole, image.to_vec(), 1).unwrap().saturating_at(FULL_RANGE)
}

/// A picture of a body that has moved by a shift.
type Picture<'a> = &'a dyn Fn([f64; 2]) -> Vec<f64>;

/// Errors at ten sub-pixel shifts.
fn errors_of_shifts(picture: Picture<'_>, noise: f64, interpolation: Interpolation) -> Vec<Vec<[f64; 3]>> {
    let still = picture([0.0; 2]);
    let at = |step: u64| {
        let shift = [0.1 * step as f64, -0.3];
        let reference = reference(&sense(&still, noise, 2 * step));
        errors(&reference, &sense(&picture(shift), noise, 2 * step + 1), shift, interpolation)
    };
    (0..10).map(at).collect()
}

/// Difference of the largest and the smallest mean error over the shifts.
fn bias_px(errors: &[Vec<[f64; 3]>]) -> f64 {
    let means = errors.iter().map(|of_shift| moments(&of_shift.iter().map(|e| e[0]).collect::<Vec<_>>())[0]);
    let (low, high) = means.fold((f64::MAX, f64::MIN), |(low, high), mean| (low.min(mean), high.max(mean)));
    high - low
}

fn assert_coverage(errors: &[[f64; 3]]) {
    let pulls: Vec<f64> = errors.iter().map(|e| e[1]).collect();
    support::assert_coverage("markers", &pulls, 1, Wrong::Both);
}

/// The bias is not seen under 1 % noise: it is less, from peak to peak, than one standard error of the mean of all markers,
/// whose errors these are.
fn assert_unseen(bias_px: f64, noisy: &[[f64; 3]]) {
    let [_, std_px] = moments(&noisy.iter().map(|e| e[0]).collect::<Vec<_>>());
    let unseen_px = std_px / (centres().count() as f64).sqrt();
    assert!(bias_px < unseen_px, "{bias_px} px of {unseen_px} px");
}

#[test]
fn black_ground_around_a_marker_is_left_out() {
    // The subset of 33 px reaches beyond its marker of 29 px, of which 21 x 21 px are far enough from the edge.
    let speckle = Speckle::new(5, Speckle::RADIUS_PX);
    for ground in [0.0, 70.0] {
        let picture = |shift| markers(&speckle, 29.0, ground, shift);
        let exact = errors_of_shifts(&picture, 0.0, Interpolation::CubicMoms);
        let noisy = errors_of_shifts(&picture, 0.01, Interpolation::CubicMoms).concat();
        assert_unseen(bias_px(&exact), &noisy);
        assert_coverage(&noisy);
        // 21 x 21 px, but for those at dark speckles of the edge, which ground reaches into by chance
        let n_used = noisy.iter().map(|e| e[2]).sum::<f64>() / noisy.len() as f64;
        assert!((410.0..=441.0).contains(&n_used), "{n_used}");
    }
}

#[test]
fn what_is_left_out_costs_precision_and_sigma_says_so() {
    let speckle = Speckle::new(5, Speckle::RADIUS_PX);
    let sigma = |side: f64| {
        let picture = |shift| markers(&speckle, side, 20.0, shift);
        let found = errors_of_shifts(&picture, 0.01, Interpolation::CubicMoms).concat();
        found.iter().map(|e| (e[0] / e[1]).abs()).sum::<f64>() / found.len() as f64
    };
    // 33 x 33 px of a marker of 45 px, and the 21 x 21 px that one of 29 px leaves. The sum of squared slopes over 21 x 21 px
    // of some 25 independent speckles scatters by a fifth from marker to marker, so sigma by a tenth: a sixty-fifth in the
    // mean of 49. What is more, dark speckles at an edge are taken for ground: up to a fourteenth of the pixels.
    let expected = 33.0 / 21.0;
    assert!((sigma(29.0) / sigma(45.0) / expected - 1.0).abs() < 0.1, "{}", sigma(29.0) / sigma(45.0));
}

/// Speckle with glints, 3 a marker, that go with the body and are far brighter than the sensor's range.
fn with_glints(speckle: &Speckle, shift: [f64; 2]) -> Vec<f64> {
    let mut image = speckle.render(|[x, y]| [x + shift[0], y + shift[1]]);
    for [x, y] in centres().flat_map(|[x, y]| [[x - 9.3, y + 4.2], [x + 6.1, y - 8.7], [x + 2.4, y + 11.8]]) {
        let (x, y) = (x + shift[0], y + shift[1]);
        for (i, value) in image.iter_mut().enumerate() {
            let square = ((i % SIZE[0]) as f64 - x).powi(2) + ((i / SIZE[0]) as f64 - y).powi(2);
            if square < 100.0 {
                *value += 40_000.0 * (-0.5 * square / 1.5_f64.powi(2)).exp();
            }
        }
    }
    image
}

#[test]
fn glints_that_saturate_are_left_out() {
    let speckle = Speckle::new(6, Speckle::RADIUS_PX);
    let picture = |shift| with_glints(&speckle, shift);
    let exact = errors_of_shifts(&picture, 0.0, Interpolation::CubicMoms);
    let noisy = errors_of_shifts(&picture, 0.01, Interpolation::CubicMoms).concat();
    assert_unseen(bias_px(&exact), &noisy);
    assert_coverage(&noisy);
}

#[test]
fn pixels_that_are_no_numbers_are_left_out() {
    let speckle = Speckle::new(6, Speckle::RADIUS_PX);
    let image = sense(&speckle.render(|spot| spot), 0.01, 1);
    let mut broken = image.clone();
    centres().for_each(|[x, y]| broken[(y as usize + 3) * SIZE[0] + x as usize - 5] = f32::NAN);
    let target = sense(&speckle.render(|[x, y]| [x + 0.4, y]), 0.01, 2);
    let find = |image: &[f32]| errors(&reference(image), &target, [0.4, 0.0], Interpolation::CubicMoms);
    for (found, whole) in find(&broken).iter().zip(find(&image)) {
        assert!(found[2] < whole[2] && found[2] >= whole[2] - 81.0, "{found:?} {whole:?}");
        // a fourteenth fewer pixels move an estimate of 6 mpx standard deviation by a fourth of it
        assert!((found[0] - whole[0]).abs() < 8e-3, "{found:?} {whole:?}");
    }
}

#[test]
fn a_subset_of_ground_alone_has_no_texture() {
    let speckle = Speckle::new(5, Speckle::RADIUS_PX);
    for noise in [0.0, 0.01] {
        let reference = reference(&sense(&markers(&speckle, 15.0, 20.0, [0.0; 2]), noise, 1));
        let prepared = PreparedSubset::new(&reference, &subset(64.0, 64.0, 12), &Settings::default());
        assert_eq!(prepared.err(), Some(Lost::NoTexture));
    }
}

#[test]
fn glints_that_do_not_go_with_the_body_are_left_out_of_the_target() {
    // Reflections stay where the lamps are while the body moves: they saturate other pixels of the subset in each picture.
    let speckle = Speckle::new(6, Speckle::RADIUS_PX);
    let picture = |shift: [f64; 2]| {
        let mut image = speckle.render(|[x, y]| [x + shift[0], y + shift[1]]);
        for [x, y] in centres().flat_map(|[x, y]| [[x - 9.0, y + 4.0], [x + 6.0, y - 8.0]]) {
            for (i, value) in image.iter_mut().enumerate().filter(|_| shift[1] < 0.0) {
                let square = ((i % SIZE[0]) as f64 - x).powi(2) + ((i / SIZE[0]) as f64 - y).powi(2);
                *value += if square < 6.0 { 40_000.0 } else { 0.0 };
            }
        }
        image
    };
    let pulls = |full_scale: f64| {
        let mut pulls = Vec::new();
        for step in 1..10 {
            let shift = [0.1 * step as f64, -0.3];
            let reference = reference(&sense(&picture([0.0; 2]), 0.01, 2 * step));
            let target = sense(&picture(shift), 0.01, 2 * step + 1);
            let whole = Region::whole(SIZE[0], SIZE[1]);
            let window = Window::saturating_at(whole, &target, Interpolation::Cubic, full_scale).unwrap();
            pulls.extend(errors_in(&reference, &window, shift));
        }
        pulls
    };
    assert_coverage(&pulls(FULL_RANGE));
    // what is not known to saturate is found by its residual
    assert_coverage(&pulls(f64::INFINITY));
}

#[test]
fn an_edge_that_rings_is_warned_of_and_one_that_does_not_is_not() {
    let speckle = Speckle::new(21, Speckle::RADIUS_PX);
    let warned = |side: f64, ground: f64, noise: f64| {
        let film = recorded(vec![sense(&markers(&speckle, side, ground, [0.0; 2]), noise, 3)]);
        let first = ReferenceFrames::Single(0);
        let edge = |[x, y]: [f64; 2]| sharp_edge(&film, &subset(x, y, 16), &first).unwrap();
        let edges: Vec<_> = centres().map(edge).collect();
        (edges.iter().flatten().count(), edges.len())
    };
    for (noise, ground) in [(0.0, 900.0), (0.01, 900.0), (0.01, 2500.0), (0.02, 900.0)] {
        // Subsets of 33 px: 2 px of marker beyond them on each side, and 7 px.
        let (near, n) = warned(37.0, ground, noise);
        assert!(near == n, "{near} of {n} at {ground} counts and {noise}");
        let (far, _) = warned(47.0, ground, noise);
        assert!(far == 0, "{far} of {n} at {ground} counts and {noise}");
    }
    // speckle alone, and ground that is left out
    assert_eq!(warned(500.0, 900.0, 0.01).0, 0);
    assert_eq!(warned(37.0, 0.0, 0.01).0, 0);
}

/// A thread goes on with the buffers of the subset that it prepared last.
#[test]
fn a_subset_is_the_same_whatever_its_thread_prepared_before() {
    let speckle = Speckle::new(3, Speckle::RADIUS_PX);
    let seen = sense(&speckle.render(|place| place), 0.01, 1);
    let moved = sense(&speckle.render(|[x, y]| [x + 0.37, y - 0.21]), 0.01, 2);
    let target = Window::new(Region::whole(SIZE[0], SIZE[1]), &moved, Interpolation::Cubic).unwrap();
    let mut broken = seen.clone();
    broken.iter_mut().step_by(7).for_each(|value| *value = f32::NAN);
    let (sound, broken) = (reference(&seen), reference(&broken));
    let bits = |half: usize| {
        let prepared =
            PreparedSubset::new(&sound, &subset(200.0, 200.0, half), &Settings::default()).unwrap();
        let found = prepared.match_in(&target, [200.0, 200.0], &mut Workspace::default()).unwrap();
        let [x, y] = [found.position.x_px, found.position.y_px];
        [x.value, x.sigma, y.value, y.sigma].map(f64::to_bits)
    };
    // In threads of their own, which have prepared nothing.
    let alone =
        [16, 10, 23, 12].map(|half| std::thread::scope(|scope| scope.spawn(|| bits(half)).join().unwrap()));
    // Of a reference of which every seventh pixel is no number a subset may or may not come about.
    let after = [16, 10, 23, 12].map(|half| {
        let _whatever = PreparedSubset::new(&broken, &subset(180.0, 190.0, 21), &Settings::default());
        bits(half)
    });
    assert_eq!(alone, after);
}

/// What saturates is left out where the match is, and not where it began.
#[test]
fn a_match_far_from_its_start_leaves_out_what_saturates_there() {
    let speckle = Speckle::new(41, Speckle::RADIUS_PX);
    let whole = Region::whole(SIZE[0], SIZE[1]);
    let shift = [2.37, -1.62];
    let dim = |light: f64, shift: [f64; 2]| -> Vec<f64> {
        let image = speckle.render(|[x, y]| [x + shift[0], y + shift[1]]);
        image.into_iter().map(|grey| light * grey).collect()
    };
    let reference = reference(&sense(&dim(0.8, [0.0; 2]), 0.005, 1));
    // The brightest speckles are clipped.
    let target = sense(&dim(1.5, shift), 0.005, 2);
    let settings = Settings::default();
    let window = Window::saturating_at(whole, &target, settings.interpolation, FULL_RANGE).unwrap();
    let mut workspace = Workspace::default();
    let (mut n, mut largest) = (0, 0.0_f64);
    for [x, y] in centres() {
        let prepared = PreparedSubset::new(&reference, &subset(x, y, 16), &settings).unwrap();
        let mut found =
            |off: f64| prepared.match_in(&window, [x + shift[0] + off, y + shift[1]], &mut workspace).ok();
        let (Some(near), Some(far)) = (found(0.0), found(2.0)) else { continue };
        if near.is_whole {
            continue;
        }
        let off = (near.position.x_px.value - far.position.x_px.value).abs() / near.position.x_px.sigma;
        n += 1;
        largest = largest.max(off);
    }
    println!("{n} {largest}");
    assert!(n > 20, "{n}");
    // The same pixels but for those that rounding of their places leaves in or out.
    assert!(largest < 0.5, "{largest} sigmas");
}

/// A picture that is scaled to 0..1 is the same picture.
#[test]
fn pictures_scaled_to_one_show_obstacles_and_ground_as_well() {
    let speckle = Speckle::new(42, Speckle::RADIUS_PX);
    let still = sense(&markers(&speckle, 41.0, 30.0, [0.0; 2]), 0.005, 1);
    let mut moved = sense(&markers(&speckle, 41.0, 30.0, [0.3, 0.0]), 0.005, 2);
    for row in moved.chunks_exact_mut(SIZE[0]) {
        // A rod over each marker.
        (35..390).step_by(58).for_each(|x| row[x + 4..x + 10].fill(1800.0));
    }
    let whole = Region::whole(SIZE[0], SIZE[1]);
    let settings = Settings::default();
    let found = |scale: f32| {
        let scaled = |image: &[f32]| image.iter().map(|grey| scale * grey).collect::<Vec<_>>();
        let reference = Reference::new(whole, scaled(&still), 1).unwrap();
        let window = Window::new(whole, &scaled(&moved), settings.interpolation).unwrap();
        let mut workspace = Workspace::default();
        let one = |[x, y]: [f64; 2]| {
            let prepared = PreparedSubset::new(&reference, &subset(x, y, 18), &settings).unwrap();
            (prepared.n_used(), prepared.match_in(&window, [x, y], &mut workspace).unwrap())
        };
        centres().map(one).collect::<Vec<_>>()
    };
    let mut n_covered = 0;
    let (of_counts, of_one) = (found(1.0), found((FULL_RANGE as f32).recip()));
    for ((n_used, a), (n_scaled, b)) in of_counts.into_iter().zip(of_one) {
        let [a_px, b_px] = [a, b].map(|found| found.position.x_px);
        assert_eq!(a.is_whole, b.is_whole);
        n_covered += u32::from(!a.is_whole);
        // Ground of which some pixels' noise is near the bound may be a pixel more or less.
        assert!(n_used.abs_diff(n_scaled) <= 40, "{n_used} {n_scaled}");
        assert!((a_px.value - b_px.value).abs() < a_px.sigma, "{a_px:?} {b_px:?}");
    }
    assert!(n_covered > 40, "the rods are seen: {n_covered}");
}
