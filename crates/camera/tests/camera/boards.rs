//! Calibration by boards: a lens and a perspective that are known, against what is found and the errors stated for it.

use chainwave_camera::{Board, Calibration, Corner, PlaneMap, Source};
use chainwave_measurement::Estimate;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::board_truth::{DISPLACEMENTS_PX, HEIGHT, SQUARE_M, WIDTH, board, displacement_m, found_m, truth};

/// The board's inner corners that lie in the picture, each found with a normal error of `sigma_px`.
fn corners(truth: &PlaneMap, sigma_px: f64, random: &mut Pcg64) -> Vec<Corner> {
    let board = board();
    let mut corners = Vec::new();
    for (row, column) in
        (0..board.rows - 1).flat_map(|row| (0..board.columns - 1).map(move |column| (row, column)))
    {
        let at_m = [column, row].map(|number| (number as f64 + 1.0) * SQUARE_M);
        let at_px = truth.image_px(at_m).unwrap();
        let [x_px, y_px] =
            at_px.map(|at| at + sigma_px * Distribution::<f64>::sample(&StandardNormal, random));
        if (0.0..=1279.0).contains(&x_px) && (0.0..=799.0).contains(&y_px) {
            corners.push(Corner { column, row, x_px, y_px });
        }
    }
    corners
}

#[test]
fn corners_without_error_give_the_truth() {
    let mut random = Pcg64::seed_from_u64(1);
    for n_pictures in [1, 3] {
        let first = truth(&mut random);
        let mut pictures = vec![corners(&first, 0.0, &mut random)];
        pictures.extend((1..n_pictures).map(|_| {
            let other = PlaneMap { lens: first.lens, ..truth(&mut random) };
            corners(&other, 0.0, &mut random)
        }));
        let calibration = Calibration::from_boards(&pictures, &board(), (WIDTH, HEIGHT)).unwrap();
        // Where nothing scatters the prior of the centre weighs nothing.
        assert!(calibration.residual_px < 1e-6, "{} px", calibration.residual_px);
        for of_px in DISPLACEMENTS_PX {
            let (found, expected) = (found_m(&calibration, of_px).value, displacement_m(&first, of_px));
            assert!((found / expected - 1.0).abs() < 1e-8, "{n_pictures}: {found} for {expected}");
        }
    }
}

#[test]
fn stated_errors_hold_the_truth() {
    const N_SEEDS: u64 = 300;
    let (mut inside, mut squares, mut n) = (0.0, 0.0, 0.0);
    for seed in 0..N_SEEDS {
        let mut random = Pcg64::seed_from_u64(seed);
        let first = truth(&mut random);
        let mut pictures = vec![corners(&first, 0.05, &mut random)];
        if seed % 2 == 1 {
            let other = PlaneMap { lens: first.lens, ..truth(&mut random) };
            pictures.push(corners(&other, 0.05, &mut random));
        }
        let calibration = Calibration::from_boards(&pictures, &board(), (WIDTH, HEIGHT)).unwrap();
        // At least 9 x 9 corners of two coordinates less 12 unknowns leave 150 degrees of freedom, which tell a standard
        // deviation to 1 / sqrt(300); 4.5 of these are exceeded once in 150 000 times, and there are 300 seeds.
        assert!(
            (calibration.residual_px / 0.05 - 1.0).abs() < 4.5 / 300_f64.sqrt(),
            "{}",
            calibration.residual_px
        );
        for of_px in DISPLACEMENTS_PX {
            let (found, expected) = (found_m(&calibration, of_px), displacement_m(&first, of_px));
            inside += f64::from(u8::from(found.covers_95(expected)));
            squares += ((found.value - expected) / found.sigma).powi(2);
            n += 1.0;
        }
    }
    // Pictures are independent, the four displacements in one may not be: at least as many independent ones as seeds. Of so many, the
    // share inside scatters by the root of 0.95 x 0.05 over them, the mean square by the root of 2 over them; bounds are 3.3 of
    // these on both sides, which a true program exceeds once in a thousand times.
    let independent = N_SEEDS as f64;
    let bound = 3.3 * (0.95 * 0.05 / independent).sqrt();
    assert!((inside / n - 0.95).abs() < bound, "{} inside, expected 0.95 +- {bound}", inside / n);
    let bound = 3.3 * (2.0 / independent).sqrt();
    assert!((squares / n - 1.0).abs() < bound, "mean square {}, expected 1 +- {bound}", squares / n);
}

#[test]
fn an_error_of_the_squares_is_an_error_of_the_scale() {
    let mut random = Pcg64::seed_from_u64(3);
    let map = truth(&mut random);
    let pictures = [corners(&map, 0.0, &mut random)];
    let uncertain = Board { square_m: Estimate::new(SQUARE_M, 1e-3 * SQUARE_M), ..board() };
    let calibration = Calibration::from_boards(&pictures, &uncertain, (WIDTH, HEIGHT)).unwrap();
    for of_px in DISPLACEMENTS_PX {
        let found = found_m(&calibration, of_px);
        assert!((found.sigma / found.value - 1e-3).abs() < 1e-6, "{found:?}");
    }
    assert!(calibration.errors.iter().any(|error| error.source == Source::Length));
}

#[test]
fn corners_that_tell_no_perspective_are_refused() {
    let mut random = Pcg64::seed_from_u64(4);
    let all = corners(&truth(&mut random), 0.05, &mut random);
    let refused = |corners: Vec<Corner>| {
        let outcome = Calibration::from_boards(&[corners], &board(), (WIDTH, HEIGHT));
        outcome.err().map(|error| error.to_string()).unwrap_or_default()
    };
    assert!(refused(Vec::new()).contains("corners in a picture"));
    assert!(refused(all[..8].to_vec()).contains("corners in a picture"));
    let in_a_line: Vec<Corner> = all.iter().copied().filter(|corner| corner.row == 3).collect();
    assert!(in_a_line.len() > 8 && refused(in_a_line).contains("in a line"));
    let lost = all.iter().map(|corner| Corner { x_px: f64::NAN, ..*corner }).collect();
    assert!(!refused(lost).is_empty());
    assert!(Calibration::from_boards(&[], &board(), (WIDTH, HEIGHT)).is_err());
}
