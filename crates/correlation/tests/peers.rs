//! Failures that users of other programs met: each is a test here.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]

mod support;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use chainwave_correlation::{Method, ReferenceFrames, Settings, track};
use chainwave_measurement::{Lost, MemoryRecording, ReadError, Recording, RecordingInfo, Region, Track};
use support::{SIZE, Speckle, recorded, sense, subset};

/// Speckle that moves by `shift` pixels a frame, in light of `gain` with an offset of some counts.
fn film(n_frames: usize, shift: [f64; 2], gain: f64, offset: f64) -> MemoryRecording {
    let speckle = Speckle::new(21, Speckle::RADIUS_PX);
    let frame = |k: usize| {
        let image = speckle.render(|[x, y]| [x + shift[0] * k as f64, y + shift[1] * k as f64]);
        let lit: Vec<f64> = image.into_iter().map(|value| gain * value + offset).collect();
        sense(&lit, 0.005, k as u64)
    };
    recorded((0..n_frames).map(frame).collect())
}

fn follow(recording: &dyn Recording, x: f64, settings: &Settings) -> Track {
    track(recording, &[subset(x, 200.0, 16)], &ReferenceFrames::Single(0), settings, &|_| ())
        .unwrap()
        .remove(0)
}

/// The largest error over its sigma, of all positions; none may be lost.
fn largest_pull(track: &Track, x: f64, speed: f64) -> f64 {
    let pull = |(k, found): (usize, &Result<chainwave_measurement::Position, Lost>)| {
        let found = found.unwrap().x_px;
        ((found.value - x - speed * k as f64) / found.sigma).abs()
    };
    track.positions.iter().enumerate().skip(1).map(pull).fold(0.0, f64::max)
}

#[test]
fn counts_of_12_bits_are_not_cut_to_8() {
    // 40 counts of contrast: less than three steps of 8 bits
    let track = follow(&film(6, [0.31, 0.0], 0.05, 300.0), 200.0, &Settings::default());
    // 20 counts of noise: the truth lies within five sigma in any of five frames
    assert!(largest_pull(&track, 200.0, 0.31) < 5.0);
}

#[test]
fn interpolated_values_below_zero_are_values() {
    // a black level of 0 clips the noise, and the spline through spots on black swings below it
    let track = follow(&film(6, [0.37, 0.0], 0.8, -160.0), 200.0, &Settings::default());
    assert!(largest_pull(&track, 200.0, 0.37) < 5.0);
}

#[test]
fn a_correlation_of_0_99_is_no_reason_to_stop() {
    // The start, 0.1 px away, correlates to 0.998 with the reference; its error would be 25 sigma.
    let track = follow(&film(3, [0.1, 0.0], 0.8, 0.0), 200.0, &Settings::default());
    assert!(largest_pull(&track, 200.0, 0.1) < 5.0);
}

#[test]
fn a_subset_at_the_edge_of_the_image_is_matched_where_it_is_seen() {
    let edge = SIZE[0] as f64 - 17.0;
    let track = follow(&film(6, [-1.3, 0.0], 0.8, 0.0), edge, &Settings::default());
    // The reference frame has no pixels beyond the subset to interpolate with.
    assert_eq!(track.positions[0], Err(Lost::OutOfView));
    let inside = |k: usize| track.positions[k].unwrap().x_px;
    for k in 3..6 {
        let error = inside(k).value - edge + 1.3 * k as f64;
        assert!(error.abs() < 5.0 * inside(k).sigma + 1e-3, "{k}: {error}");
    }
}

#[test]
fn a_track_never_goes_on_with_a_constant() {
    let mut film = film(8, [0.4, 0.0], 0.8, 0.0);
    let bare = sense(&vec![900.0; SIZE[0] * SIZE[1]], 0.005, 99);
    film.frames[4..].iter_mut().for_each(|frame| frame.clone_from(&bare));
    let track = follow(&film, 200.0, &Settings::default());
    assert!(track.positions[..4].iter().all(Result::is_ok));
    for found in &track.positions[4..] {
        assert!(matches!(found, Err(Lost::LowCorrelation | Lost::NotConverged)), "{found:?}");
    }
}

#[test]
fn errors_do_not_add_up_over_frames() {
    // Each frame is compared with the reference itself: the last of 60 is as good as the first.
    let track = follow(&film(60, [0.43, 0.0], 0.8, 0.0), 150.0, &Settings::default());
    assert!(largest_pull(&track, 150.0, 0.43) < 5.0);
    let sigma = |k: usize| track.positions[k].unwrap().x_px.sigma;
    // each residual of 1089 px tells its noise to 2.1 %: three standard errors of the ratio
    assert!((sigma(59) / sigma(1) - 1.0).abs() < 0.09, "{} {}", sigma(59), sigma(1));
}

#[test]
fn a_rod_across_a_body_is_left_out_or_the_body_is_lost_and_found_again() {
    // A rod of 9 px passes over the subset, bright, dark or as grey as the body: right within its sigma, or lost for the
    // reason.
    for (grey, width) in [(3000.0, 9), (300.0, 9), (1200.0, 9), (3000.0, 14)] {
        let mut film = film(20, [0.4, 0.0], 0.8, 0.0);
        for (k, frame) in film.frames.iter_mut().enumerate().skip(1) {
            let first = 140 + 6 * k;
            frame.chunks_exact_mut(SIZE[0]).for_each(|row| row[first..first + width].fill(grey));
        }
        let track = follow(&film, 200.0, &Settings::default());
        for (k, found) in track.positions.iter().enumerate() {
            match found {
                Ok(found) => {
                    let error = found.x_px.value - 200.0 - 0.4 * k as f64;
                    // 80 errors, none beyond four sigma
                    assert!(error.abs() < 4.0 * found.x_px.sigma + 1e-3, "{grey}, {k}: {error} {found:?}");
                }
                // hidden in part from frame 5 to 13; a lost body is searched for in every fourth frame in the end
                Err(reason) => {
                    assert!((5..17).contains(&k) && *reason != Lost::OutOfView, "{grey}, {k}: {reason:?}");
                }
            }
        }
        let n_lost = track.positions.iter().filter(|found| found.is_err()).count();
        // with the pixels that interpolation mixes, the wider rod hides 20 of 33 columns for three frames
        assert!(n_lost <= if width < 10 { 2 } else { 4 }, "{grey}: {n_lost} frames");
    }
}

#[test]
fn motion_blur_moves_nothing() {
    // A frame that is the mean over 2 px of motion, of a body at constant speed, shows it in the middle of them.
    let speckle = Speckle::new(21, Speckle::RADIUS_PX);
    let blurred = |middle: f64| {
        let parts: Vec<Vec<f64>> =
            (-8..=8).map(|i| speckle.render(|[x, y]| [x + middle + f64::from(i) / 8.5, y])).collect();
        let mean = |i: usize| 0.8 * parts.iter().map(|part| part[i]).sum::<f64>() / parts.len() as f64;
        sense(&(0..SIZE[0] * SIZE[1]).map(mean).collect::<Vec<_>>(), 0.005, middle as u64 + 3)
    };
    let still = film(1, [0.0; 2], 0.8, 0.0).frames.remove(0);
    let film = recorded(vec![still, blurred(2.3), blurred(4.6)]);
    let track = follow(&film, 200.0, &Settings::default());
    for (k, found) in track.positions.iter().enumerate().skip(1) {
        let error = found.unwrap().x_px.value - 200.0 - 2.3 * k as f64;
        // 3 mpx of noise, of which five; a blurred and a sharp picture differ symmetrically
        assert!(error.abs() < 0.015, "{k}: {error}");
    }
}

/// Counts the pixels that are read.
struct Counted(MemoryRecording, AtomicUsize);

impl Recording for Counted {
    fn path(&self) -> &Path {
        self.0.path()
    }

    fn info(&self) -> &RecordingInfo {
        self.0.info()
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        self.1.fetch_add(region.n_pixels(), Ordering::Relaxed);
        self.0.read_region(frame, region, pixels)
    }
}

#[test]
fn what_is_read_of_a_frame_is_the_subset_and_what_its_interpolation_needs() {
    // Columns beyond the subset that its interpolation rests on: the kernel's taps, and the prefilter on both sides.
    for (name, support) in [
        ("icgn-linear-affine", 1),
        ("icgn-cubic-affine", 3 + 2 * 5),
        ("icgn-cubic-moms-affine", 3 + 2 * 9),
        ("icgn-quintic-affine", 5 + 2 * 10),
    ] {
        let frames = film(11, [0.4, 0.2], 0.8, 0.0).frames;
        let subsets = [subset(200.0, 200.0, 16)];
        let (reference, settings) = (ReferenceFrames::Single(0), Settings::default());
        let method: Method = name.parse().unwrap();
        let read = |n_frames: usize| {
            let part = Counted(recorded(frames[..n_frames].to_vec()), AtomicUsize::new(0));
            method.track(&part, &subsets, &reference, &settings, &|_| ()).unwrap();
            part.1.into_inner()
        };
        let per_frame = (read(11) - read(1)) as f64 / 10.0;
        let share = per_frame / f64::from(33 + support).powi(2);
        println!("{name}: {share:.2} times what is tracked, {:.2} times the subset", per_frame / 1089.0);
        // half a pixel of slack on each side, and whole pixels around that
        let most = (f64::from(33 + support + 3) / f64::from(33 + support)).powi(2);
        assert!(share < most.min(1.3), "{name}: {share}");
    }
}
