//! Noise, histogram and contact sheet of scenes whose truth is known.

use chainwave_camera::{CameraError, SheetLayout, contact_sheet, gray_frames, histogram, noise, open};
use chainwave_measurement::Recording;

use crate::moving_speckle::{Camera, HEIGHT, WIDTH, moving_speckle};

const STILL: Camera = Camera {
    n_frames: 9,
    variance_at_zero: 30.0,
    variance_per_count: 0.05,
    motion_px: (0.0, 0.0),
    flicker: 0.0,
};

/// Rounding to whole counts adds 1/12 to the variance.
const ROUNDING: f64 = 1.0 / 12.0;

/// Standard deviations that a statement may be off: a normal variate exceeds them once in 16 000 times, and there are some thirty
/// statements of one seed each.
const MOST_SIGMAS: f64 = 4.0;

fn assert_finds_the_noise(camera: Camera) {
    let estimate = noise(&moving_speckle(camera), 8).unwrap();
    let truth = |count: f64| camera.variance_at_zero + ROUNDING + camera.variance_per_count * count;
    let (slope, at_zero) = (estimate.variance_per_count, estimate.variance_at_zero);
    // A block of 25 px less 3 unknowns has 22 degrees of freedom and tells a variance to sqrt(2 / 22); the median of n such is 1.25
    // times less sure than their mean, which is what a line of them tells in its middle.
    let of_middle = 1.2533 * (2.0_f64 / 22.0 / estimate.n_blocks as f64).sqrt();
    for (count, at_middle) in [(800.0, false), (estimate.median_count, true), (2500.0, false)] {
        let covariance = estimate.correlation * slope.sigma * at_zero.sigma;
        let variance = at_zero.sigma.powi(2) + 2.0 * count * covariance + (count * slope.sigma).powi(2);
        let (found, expected) = (estimate.sigma(count).powi(2), truth(count));
        let sigma = variance.sqrt();
        assert!(
            (found - expected).abs() < MOST_SIGMAS * sigma,
            "at {count}: {found} for {expected} +- {sigma}"
        );
        let relative = sigma / expected;
        // Nowhere surer than in the middle, and there not unsure without reason: of at most 24 bins, a scatter that is larger by chance
        // widens by a factor of 1.6 once in ten thousand times, and few bins or a median off the middle by a quarter more.
        let widest = if at_middle { 2.0 * of_middle } else { f64::INFINITY };
        assert!(
            (0.7 * of_middle..widest).contains(&relative),
            "at {count}: {relative} of {of_middle} ({estimate:?})"
        );
    }
    assert!((slope.value - camera.variance_per_count).abs() < MOST_SIGMAS * slope.sigma, "{estimate:?}");
    assert!(
        (at_zero.value - camera.variance_at_zero - ROUNDING).abs() < MOST_SIGMAS * at_zero.sigma,
        "{estimate:?}"
    );
    assert!(estimate.correlation < -0.5 && estimate.correlation > -1.0, "{estimate:?}");
}

#[test]
fn read_and_shot_noise_are_told_apart() {
    assert_finds_the_noise(STILL);
    assert_finds_the_noise(Camera { variance_at_zero: 4.0, variance_per_count: 0.2, ..STILL });
    assert_finds_the_noise(Camera { variance_at_zero: 100.0, variance_per_count: 0.0, ..STILL });
}

#[test]
fn motion_of_half_the_picture_and_flicker_do_not_disturb() {
    for motion_px in [(0.3, 0.0), (0.7, 0.4), (3.0, 1.0)] {
        assert_finds_the_noise(Camera { motion_px, flicker: 40.0, ..STILL });
    }
}

#[test]
fn a_recording_of_one_frame_or_of_black_says_why_it_has_no_noise() {
    let one = noise(&moving_speckle(Camera { n_frames: 1, ..STILL }), 8).unwrap_err();
    assert!(matches!(one, CameraError::TooLittle { .. }) && one.to_string().contains("2 or more"), "{one}");
}

#[test]
fn frames_that_are_copies_have_no_noise() {
    let frames = vec![crate::writer::codes(64 * 64, 4000, 1); 4];
    let file = crate::tiff_writer::TiffFile::new(64, 64, frames);
    let (_folder, path) = crate::writer::written(&file.bytes());
    let estimate = noise(&*open(&path).unwrap(), 3).unwrap();
    assert!(estimate.sigma(2000.0) < 1e-9, "{estimate:?}");
}

#[test]
fn the_histogram_counts_every_pixel_of_its_frames() {
    let scene = moving_speckle(Camera { variance_at_zero: 1e6, ..STILL });
    let histogram = histogram(&scene, 3).unwrap();
    assert_eq!((histogram.frames.as_slice(), histogram.n_pixels.len()), ([0, 4, 8].as_slice(), 4096));
    assert_eq!(histogram.total(), (3 * WIDTH * HEIGHT) as u64);
    // A standard deviation of 1000 counts about 1750 clips some per cent on each side.
    let share = |n: u64| n as f64 / histogram.total() as f64;
    assert!((0.01..0.1).contains(&share(histogram.n_dark())));
    let saturation = histogram.saturation().unwrap();
    assert!(saturation.count == 4095 && (0.001..0.1).contains(&share(saturation.n_pixels)), "{saturation:?}");
    assert!((1500..2000).contains(&histogram.quantile(0.5)));
}

#[test]
fn a_contact_sheet_shows_its_frames_with_one_mapping_to_gray() {
    let scene = moving_speckle(STILL);
    let layout = SheetLayout { n_frames: 5, n_columns: 3, tile_width_px: 40 };
    let sheet = contact_sheet(&scene, layout).unwrap();
    assert_eq!(sheet.frames, [0, 2, 4, 6, 8]);
    assert_eq!((sheet.width_px, sheet.height_px), (3 * 44 + 4, 2 * 34 + 4));
    // The gaps and the empty sixth place are white, the tiles use the whole range.
    assert!(sheet.pixels[..sheet.width_px].iter().all(|&gray| gray == 255));
    let tile: Vec<u8> = (4..34).flat_map(|y| sheet.pixels[y * 136 + 4..y * 136 + 44].to_vec()).collect();
    assert!(tile.contains(&0) && tile.contains(&255));
    let alone = gray_frames(&scene, 5, 40).unwrap();
    assert_eq!(alone.iter().map(|(frame, _)| *frame).collect::<Vec<_>>(), sheet.frames);
    assert_eq!(tile, alone[0].1.pixels);
    assert_eq!(scene.info().n_frames, 9);
}
