//! Noise and patterns that neighbouring pixels share: sigmas of tracks hold what errors are, on speckle in closed form.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]
#![expect(clippy::print_stdout, reason = "what each case gave is a table to be read")]

mod support;

use std::num::NonZero;

use chainwave_correlation::{
    FieldGrid, Reference, ReferenceFrames, Settings, Shape, ShapeChoice, Window, correlate, track,
};
use chainwave_measurement::{Estimate, MemoryRecording, Region, Subset};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use support::{FULL_RANGE, SIZE, Speckle, grid, recorded, sense};

const N_FRAMES: usize = 9;
/// White noise of a pixel, as a share of full range.
const NOISE: f64 = 0.01;

/// Where speckles are in a frame: each a way of its own fraction of a pixel, and far from where the pattern was at first.
fn way_px(frame: usize) -> [f64; 2] {
    [4.37 * frame as f64, 2.61 * frame as f64]
}

fn normals(seed: u64, n: usize, sigma: f64) -> Vec<f64> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    (0..n)
        .map(|_| {
            let normal: f64 = StandardNormal.sample(&mut random);
            sigma * FULL_RANGE * normal
        })
        .collect()
}

/// Offsets of rows and columns.
fn lines(seed: u64, row_sigma: f64, column_sigma: f64) -> Vec<f64> {
    let rows = normals(seed, SIZE[1], row_sigma);
    let columns = normals(seed + 1_000_003, SIZE[0], column_sigma);
    rows.iter().flat_map(|row| columns.iter().map(move |column| row + column)).collect()
}

/// Offsets that are alike over 3 x 3 pixels.
fn blots(seed: u64, sigma: f64) -> Vec<f64> {
    let [width, height] = SIZE;
    let fine = normals(seed, (width / 3 + 1) * (height / 3 + 1), sigma);
    let at = |i: usize| fine[i / width / 3 * (width / 3 + 1) + i % width / 3];
    (0..width * height).map(at).collect()
}

/// A film of speckle on which each frame has `offsets` of its own, or the same.
fn film(seed: u64, offsets: impl Fn(usize) -> Vec<f64>) -> MemoryRecording {
    let speckle = Speckle::new(seed, Speckle::RADIUS_PX);
    let frame = |frame: usize| {
        let [dx, dy] = way_px(frame);
        let mut image = speckle.render(|[x, y]| [x + dx, y + dy]);
        image.iter_mut().zip(offsets(frame)).for_each(|(value, offset)| *value += offset);
        sense(&image, NOISE, 1000 * seed + frame as u64)
    };
    recorded((0..N_FRAMES).map(frame).collect())
}

/// Root mean square of errors over sigmas along x and y, and the median sigma along x.
fn outcome(recording: &MemoryRecording, settings: &Settings) -> ([f64; 2], f64) {
    let subsets: Vec<_> = grid(60).into_iter().collect();
    let tracks = track(recording, &subsets, &ReferenceFrames::Single(0), settings, &|_| ()).unwrap();
    let (mut squares, mut sigmas) = ([0.0; 2], Vec::new());
    for (subset, track) in subsets.iter().zip(&tracks) {
        for (frame, position) in track.positions.iter().enumerate().skip(1) {
            let (found, [dx, dy]) = (position.as_ref().unwrap(), way_px(frame));
            for (square, (place, truth)) in
                squares.iter_mut().zip([(found.x_px, subset.x_px + dx), (found.y_px, subset.y_px + dy)])
            {
                *square += ((place.value - truth) / place.sigma).powi(2);
            }
            sigmas.push(found.x_px.sigma);
        }
    }
    sigmas.sort_by(f64::total_cmp);
    let n = sigmas.len();
    (squares.map(|square| (square / n as f64).sqrt()), sigmas[n / 2])
}

/// Readings of a subset share their reference's errors, half of all: of 64 subsets along two axes some 250 are independent, and of twice as many films
/// twice. A root mean square of 1 scatters by `1/sqrt(2 * 250)` then; 4.5 of these, and what a reading's variance is known to (a fifth,
/// which makes the mean of 1/variance 4 % too large).
const BOUND: f64 = 4.5 * 0.045 + 0.04;

fn holds(name: &str, films: impl Iterator<Item = MemoryRecording>) -> f64 {
    holds_by(name, films, &Settings::default())
}

fn holds_by(name: &str, films: impl Iterator<Item = MemoryRecording>, settings: &Settings) -> f64 {
    let outcomes: Vec<([f64; 2], f64)> = films.map(|film| outcome(&film, settings)).collect();
    let n = outcomes.len() as f64;
    let rms = [0, 1].map(|axis| (outcomes.iter().map(|(rms, _)| rms[axis].powi(2)).sum::<f64>() / n).sqrt());
    let sigma_px = outcomes.iter().map(|(_, sigma)| sigma).sum::<f64>() / n;
    println!("{name}: errors over sigmas {:.2} {:.2}, sigma {sigma_px:.4} px", rms[0], rms[1]);
    assert!(rms.iter().all(|rms| *rms < 1.0 + BOUND), "{name}: {rms:?}");
    // Columns move nothing along y, and no sigma is made smaller by what neighbours share.
    assert!(rms[0] > 1.0 - BOUND, "{name}: {rms:?}");
    sigma_px
}

#[test]
fn what_neighbouring_pixels_share_is_in_sigma() {
    let none = |_| vec![0.0; SIZE[0] * SIZE[1]];
    let white = holds("white noise", (1..3).map(|seed| film(seed, none)));
    let each = |seed: u64| film(seed, move |frame| lines(100 * seed + frame as u64, 0.01, 0.01));
    let shared = holds("rows and columns of each frame", (1..3).map(each));
    // Pixels that are independent would have left sigma where the whole noise is: sqrt(3) times that of white noise.
    assert!(shared > 3.0_f64.sqrt() * white, "{shared} {white}");
    holds("columns of the sensor", (1..3).map(|seed| film(seed, move |_| lines(seed, 0.0, 0.01))));
    holds("blots of 3 px", (1..3).map(|seed| film(seed, move |_| blots(seed, 0.01))));
}

/// A surface that may bend is asked how alike its residuals are as well, and noise that neighbouring pixels share is not taken for bends.
#[test]
fn what_neighbouring_pixels_share_bends_nothing() {
    let bends = Settings { surfaces_bend: true, ..Settings::default() };
    let none = |_| vec![0.0; SIZE[0] * SIZE[1]];
    holds_by("white noise", (1..3).map(|seed| film(seed, none)), &bends);
    let of_frame = |seed: u64| film(seed, move |frame| blots(100 * seed + frame as u64, 0.01));
    holds_by("blots of each frame", (1..3).map(of_frame), &bends);
    holds_by("blots of the sensor", (1..3).map(|seed| film(seed, move |_| blots(seed, 0.01))), &bends);
    let lines_of_frame = |seed: u64| film(seed, move |frame| lines(100 * seed + frame as u64, 0.01, 0.01));
    holds_by("rows and columns of each frame", (1..3).map(lines_of_frame), &bends);
}

/// Pixels that flicker lead a quadratic match astray, by up to thousands of pixels: a place that does not explain as much more as it is far away is no bend.
#[test]
fn pixels_that_flicker_bend_nothing() {
    let bends = Settings { surfaces_bend: true, ..Settings::default() };
    let flickering = |seed: u64| {
        normals(seed, SIZE[0] * SIZE[1], 1.0)
            .into_iter()
            // One pixel in a hundred, dark or light.
            .map(
                |normal| {
                    if normal.abs() > 2.576 * FULL_RANGE { 0.5 * FULL_RANGE * normal.signum() } else { 0.0 }
                },
            )
            .collect::<Vec<f64>>()
    };
    let (mut n, mut n_false) = (0, 0);
    for seed in 1..4 {
        let recording = film(seed, |frame| flickering(100 * seed + frame as u64));
        let subsets: Vec<_> =
            grid(60).into_iter().map(|one| Subset::new(&one.name, one.x_px, one.y_px, 10, 10)).collect();
        let tracks = track(&recording, &subsets, &ReferenceFrames::Single(0), &bends, &|_| ()).unwrap();
        for (subset, track) in subsets.iter().zip(&tracks) {
            for (frame, position) in track.positions.iter().enumerate().skip(1) {
                let (Ok(found), [dx, dy]) = (position, way_px(frame)) else { continue };
                let places = [(found.x_px, subset.x_px + dx), (found.y_px, subset.y_px + dy)];
                let is_false = |(place, truth): (Estimate, f64)| {
                    let off_px = (place.value - truth).abs();
                    off_px > 5.0 * place.sigma && off_px > 0.5
                };
                n += 1;
                n_false += usize::from(places.into_iter().any(is_false));
            }
        }
    }
    println!("{n_false} of {n} false");
    // Less than one in a million is asked for.
    assert!(n > 300 && n_false == 0, "{n_false} of {n}");
}

/// Errors of a field over their sigmas, root mean square, of pictures of speckle that moved and of noise that four pixels share.
fn of_field(seed: u64, shared: f64) -> f64 {
    const SHIFT_PX: [f64; 2] = [2.37, -1.21];
    let [width, height] = SIZE;
    let whole = Region::whole(width, height);
    let speckle = Speckle::new(seed, Speckle::RADIUS_PX);
    let seen = |moved: f64, seed: u64| {
        let mut image = speckle.render(|[x, y]| [x + moved * SHIFT_PX[0], y + moved * SHIFT_PX[1]]);
        let white = normals(seed, (width + 1) * (height + 1), shared);
        for (i, value) in image.iter_mut().enumerate() {
            let at = |dx: usize, dy: usize| white[(i / width + dy) * (width + 1) + i % width + dx];
            *value += 0.5 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1));
        }
        sense(&image, if shared > 0.0 { 0.002 } else { NOISE }, seed + 77)
    };
    let settings = Settings::default();
    let reference = Reference::new(whole, seen(0.0, 100 + seed), 1).unwrap();
    let window = Window::new(whole, &seen(1.0, 200 + seed), settings.interpolation).unwrap();
    let grid = FieldGrid { step_px: 25, half_px: 12 };
    let affine = ShapeChoice::Named(Shape::Affine);
    let field =
        correlate(&reference, &window, grid, &settings, affine, NonZero::<usize>::MIN, &|_| ()).unwrap();
    let pulls = field.points.iter().filter_map(|point| {
        let position = point.found.as_ref().ok()?.position;
        let pull = |place: Estimate, from: f64| (place.value - from) / place.sigma;
        Some([pull(position.x_px, point.x_px + SHIFT_PX[0]), pull(position.y_px, point.y_px + SHIFT_PX[1])])
    });
    let pulls: Vec<f64> = pulls.flatten().collect();
    (pulls.iter().map(|pull| pull * pull).sum::<f64>() / pulls.len() as f64).sqrt()
}

#[test]
fn a_field_s_sigmas_hold_noise_that_pixels_share() {
    let rms = |shared: f64| {
        let squares = (1..=4).map(|seed| of_field(seed, shared).powi(2));
        (squares.sum::<f64>() / 4.0).sqrt()
    };
    let (white, shared) = (rms(0.0), rms(0.01));
    println!("errors over sigmas: {white:.2} of white noise, {shared:.2} of noise that four pixels share");
    // Some 1800 readings of subsets that do not overlap tell a root mean square to 0.02; matches take a part of such noise for texture's, so that it
    // hides from the residual a tenth of what it does.
    assert!((white - 1.0).abs() < 0.06, "{white}");
    assert!((0.94..1.16).contains(&shared), "{shared}");
}
