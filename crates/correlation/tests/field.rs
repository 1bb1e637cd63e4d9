//! Displacement fields: truth on deformed speckle, choice of the shape function, and the same bits for any threads.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]

mod support;

use std::num::NonZero;

use chainwave_correlation::{
    Field, FieldGrid, FieldPoint, Reference, Settings, Shape, ShapeChoice, Window, correlate, strains,
};
use chainwave_measurement::{Lost, Region};
use support::{SIZE, Speckle, moments, sense};

const AFFINE: ShapeChoice = ShapeChoice::Named(Shape::Affine);

fn field(reference: &[f32], target: &[f32], step_px: usize, choice: ShapeChoice, n_threads: usize) -> Field {
    let settings = Settings::default();
    let whole = Region::whole(SIZE[0], SIZE[1]);
    let reference = Reference::new(whole, reference.to_vec(), 1).unwrap();
    let window = Window::new(whole, target, settings.interpolation).unwrap();
    let grid = FieldGrid { step_px, half_px: 16 };
    let n_threads = NonZero::new(n_threads).unwrap();
    correlate(&reference, &window, grid, &settings, choice, n_threads, &|_| ()).unwrap()
}

fn error(point: &FieldPoint, truth: impl Fn([f64; 2]) -> [f64; 2]) -> Option<[f64; 2]> {
    let position = point.found.as_ref().ok()?.position;
    let [x, y] = truth([point.x_px, point.y_px]);
    Some([position.x_px.value - x, position.y_px.value - y])
}

/// Noisy pictures of a plane that is strained by `strain` along x around the image's centre and moved by `shift`.
fn strained(seed: u64, noise: f64, strain: f64, shift: [f64; 2]) -> [Vec<f32>; 2] {
    let speckle = Speckle::new(seed, Speckle::RADIUS_PX);
    let source = |[x, y]: [f64; 2]| [210.0 + (x - 210.0 - shift[0]) / (1.0 + strain), y - shift[1]];
    let dim = |image: Vec<f64>| image.into_iter().map(|g| 0.5 * g).collect::<Vec<_>>();
    let still = dim(speckle.deformed(|place| place));
    [sense(&still, noise, 10 + seed), sense(&dim(speckle.deformed(source)), noise, 20 + seed)]
}

#[test]
fn a_strained_plane_is_found_whole_with_its_strain_and_honest_intervals() {
    let (strain, shift) = (0.05, [31.3, -12.6]);
    let [reference, target] = strained(3, 0.01, strain, shift);
    let field = field(&reference, &target, 10, AFFINE, 2);
    let truth = |[x, y]: [f64; 2]| [210.0 + shift[0] + (x - 210.0) * (1.0 + strain), y + shift[1]];
    let in_view = |point: &&FieldPoint| {
        let [x, y] = truth([point.x_px, point.y_px]);
        x + 16.0 * (1.0 + strain) < SIZE[0] as f64 - 3.0 && y - 16.0 > 3.0
    };
    let visible: Vec<&FieldPoint> = field.points.iter().filter(in_view).collect();
    let errors: Vec<f64> = visible.iter().map(|point| error(point, truth).unwrap()[0]).collect();
    assert!(errors.len() > 1000, "{}", errors.len());
    let pulls =
        visible.iter().zip(&errors).map(|(point, error)| error / point.found.unwrap().position.x_px.sigma);
    let inside = pulls.filter(|pull| pull.abs() < 1.96).count() as f64 / errors.len() as f64;
    // Subsets overlap by ten: some 100 independent ones tell a share of 95 % to 2.2 %, of which two are left, and 1 % is what
    // the crate claims.
    assert!((inside - 0.95).abs() < 0.054, "{inside}");
    let lost: Vec<Lost> =
        field.points.iter().filter(|point| !in_view(point)).filter_map(|point| point.found.err()).collect();
    assert!(lost.len() > 50 && lost.iter().all(|&lost| lost == Lost::OutOfView), "{lost:?}");

    let found: Vec<_> = strains(&field, 3, NonZero::<usize>::MIN).into_iter().flatten().collect();
    let green = strain + 0.5 * strain * strain;
    let [mean, std] = moments(&found.iter().map(|s| s.xx.value).collect::<Vec<_>>());
    let sigma = found.iter().map(|s| s.xx.sigma).sum::<f64>() / found.len() as f64;
    println!("strain {mean:.6} +- {std:.6}, stated {sigma:.6}, truth {green:.6}");
    // A strain is that of 7 x 7 points and their subsets, 93 px wide: the plane holds some 16 independent ones, which tell a
    // mean to a fourth of sigma and a standard deviation to 18 %; two of each.
    assert!((mean - green).abs() < 0.5 * sigma, "{mean}");
    assert!((std / sigma - 1.0).abs() < 0.36, "{std} {sigma}");
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let [reference, target] = strained(4, 0.02, 0.02, [3.3, 1.6]);
    let one = field(&reference, &target, 12, ShapeChoice::ByEvidence, 1);
    for n_threads in [2, 3, 7] {
        assert_eq!(field(&reference, &target, 12, ShapeChoice::ByEvidence, n_threads), one);
    }
}

#[test]
fn images_of_different_things_have_no_field() {
    let [reference, _] = strained(5, 0.01, 0.0, [0.0; 2]);
    let [other, _] = strained(6, 0.01, 0.0, [0.0; 2]);
    let field = field(&reference, &other, 20, AFFINE, 2);
    assert!(field.points.iter().all(|point| point.found.is_err()));
}

#[test]
fn a_turned_image_is_found() {
    let speckle = Speckle::new(9, Speckle::RADIUS_PX);
    let (sin, cos) = 140.0_f64.to_radians().sin_cos();
    let image = speckle.deformed(|[x, y]| {
        let (x, y) = (x - 210.0, y - 210.0);
        [210.0 + cos * x + sin * y, 210.0 - sin * x + cos * y]
    });
    let reference = sense(&speckle.deformed(|place| place), 0.01, 1);
    let field = field(&reference, &sense(&image, 0.01, 2), 20, AFFINE, 2);
    let truth = |[x, y]: [f64; 2]| {
        let (x, y) = (x - 210.0, y - 210.0);
        [210.0 + cos * x - sin * y, 210.0 + sin * x + cos * y]
    };
    let errors: Vec<[f64; 2]> = field.points.iter().filter_map(|point| error(point, truth)).collect();
    // 1 % noise makes 6 mpx of error
    assert!(errors.iter().all(|e| e[0].hypot(e[1]) < 0.05), "six sigma");
    // the points whose turned subsets lie in the picture, with the pixels that interpolation needs
    let reach = 16.0 * (sin.abs() + cos.abs()) + 3.0;
    let visible = |point: &&FieldPoint| {
        truth([point.x_px, point.y_px]).into_iter().all(|place| place > reach && place < 419.0 - reach)
    };
    let n_visible = field.points.iter().filter(visible).count();
    assert!(errors.len() >= n_visible, "{} of {n_visible}", errors.len());
}

/// Shares of the points with each shape function that evidence chose.
fn shares(strain: f64, noise: f64) -> [f64; 3] {
    let mut counts = [0.0; 3];
    for seed in 30..34 {
        let [reference, target] = strained(seed, noise, strain, [0.37, 0.81]);
        for point in field(&reference, &target, 33, ShapeChoice::ByEvidence, 2).points {
            let shape = [Shape::Translation, Shape::Affine, Shape::Quadratic];
            counts[shape.into_iter().position(|shape| shape == point.shape).unwrap()] += 1.0;
        }
    }
    let total: f64 = counts.iter().sum();
    counts.map(|count| count / total)
}

#[test]
fn the_simplest_shape_function_is_rejected_as_often_as_the_level_says_and_a_strain_is_seen() {
    for noise in [0.005, 0.02, 0.05] {
        let [translation, affine, quadratic] = shares(0.0, noise);
        println!("noise {noise}: no strain: {translation:.3} {affine:.3} {quadratic:.3}");
        // two tests at 1 % over 484 subsets: 2 +- 0.64 %, of which three
        assert!(translation > 0.98 - 3.0 * 0.0064, "{noise}: {translation}");
        // Half the light, so twice the noise: at the highest one a strain of 2 % is seen in two of three subsets only.
        let [translation, affine, quadratic] = shares(0.05, noise);
        println!("noise {noise}: 5 % strain: {translation:.3} {affine:.3} {quadratic:.3}");
        // one test at 1 %: 1 +- 0.45 %, of which three; and a strain of twelve of its sigmas is never overlooked
        let most = 0.01 + 3.0 * 0.0045;
        assert!(translation <= 0.0 && quadratic < most, "{noise}: {translation} {affine} {quadratic}");
    }
}

/// Ground without light along the rim of the picture has no texture, wherever it would have gone.
#[test]
fn black_ground_at_the_rim_has_no_texture() {
    let speckle = Speckle::new(9, Speckle::RADIUS_PX);
    let picture = |shift_px: f64, seed: u64| {
        let mut image = speckle.render(|[x, y]| [x + shift_px, y]);
        for (i, grey) in image.iter_mut().enumerate() {
            let [x, y] = [i % SIZE[0], i / SIZE[0]];
            if !((90..330).contains(&x) && (90..330).contains(&y)) {
                *grey = 30.0;
            }
        }
        sense(&image, 0.005, seed)
    };
    let field = field(&picture(0.0, 1), &picture(0.4, 2), 12, AFFINE, 1);
    let n_lost = |reason: Lost| field.points.iter().filter(|point| point.found == Err(reason)).count();
    let n_found = field.points.iter().filter(|point| point.found.is_ok()).count();
    assert!(n_found > 200 && n_lost(Lost::NoTexture) > 200, "{n_found}");
    assert_eq!(n_lost(Lost::OutOfView), 0);
}

/// Stripes and a disc of another texture of the same kind, so that many subsets are covered in part by what looks like them.
#[test]
fn what_covers_a_part_is_in_the_sigmas_of_what_it_pulls() {
    const SHIFT_PX: [f64; 2] = [5.3, -2.2];
    let of_three = |at: f64| (at as usize).is_multiple_of(3);
    let covers = ["stripes", "slanting stripes", "a disc"];
    let is_covered = |cover: &str, x: f64, y: f64| match cover {
        "stripes" => of_three(x / 30.0),
        "slanting stripes" => of_three((x + y) / 25.0),
        _ => (x - 210.0).hypot(y - 210.0) < 110.0,
    };
    let settings = Settings::default();
    let whole = Region::whole(SIZE[0], SIZE[1]);
    let (mut n_all, mut n_wrong) = (0, 0);
    for (seed, name) in covers.into_iter().enumerate() {
        let [own, other] = [7, 70].map(|first| Speckle::new(first + seed as u64, Speckle::RADIUS_PX));
        let half = |image: Vec<f64>| image.into_iter().map(|g| 0.5 * g).collect::<Vec<_>>();
        let mut moved = own.render(|[x, y]| [x + SHIFT_PX[0], y + SHIFT_PX[1]]);
        for (i, (grey, over)) in moved.iter_mut().zip(other.render(|place| place)).enumerate() {
            if is_covered(name, (i % SIZE[0]) as f64, (i / SIZE[0]) as f64) {
                *grey = over;
            }
        }
        let reference = sense(&half(own.render(|place| place)), 0.02, 1 + seed as u64);
        let reference = Reference::new(whole, reference, 1).unwrap();
        let window = Window::new(whole, &sense(&half(moved), 0.02, 11 + seed as u64), settings.interpolation);
        let grid = FieldGrid { step_px: 8, half_px: 12 };
        let field =
            correlate(&reference, &window.unwrap(), grid, &settings, AFFINE, NonZero::<usize>::MIN, &|_| ());
        let (mut n, mut n_held) = (0, 0);
        for point in &field.unwrap().points {
            let Ok(found) = &point.found else { continue };
            let errors = [
                (found.position.x_px, point.x_px + SHIFT_PX[0]),
                (found.position.y_px, point.y_px + SHIFT_PX[1]),
            ];
            let off = |(at, truth): &(chainwave_measurement::Estimate, f64)| (at.value - truth).abs();
            n += 2;
            n_held += errors.iter().filter(|error| off(error) <= 1.96 * error.0.sigma).count();
            n_all += 1;
            n_wrong += usize::from(errors.iter().any(|error| off(error) > (6.0 * error.0.sigma).max(0.5)));
        }
        println!("{name}: {n_held} of {n} hold");
        // Where stripes are as narrow as subsets none is seen whole, and neighbours are pulled as well: eight tenths had held, and nine are what
        // such neighbours can tell; elsewhere nine tenths had.
        let least = if name == "slanting stripes" { 0.86 } else { 0.91 };
        assert!(n > 2000 && f64::from(n_held as u32) > least * f64::from(n), "{name}: {n_held} of {n}");
    }
    println!("{n_wrong} of {n_all} wrong");
    // One in three hundred had been.
    assert!(1000 * n_wrong <= n_all, "{n_wrong} of {n_all}");
}
