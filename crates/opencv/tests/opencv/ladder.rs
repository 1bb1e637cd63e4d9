//! The measured ladder: accuracy and honesty of every method on one scene, OpenCV's among them, as tables for the book: `cargo xtask tested
//! opencv ladder::every_method_on_one_scene`.

use chainwave_correlation::{Method, ReferenceFrames, Settings};
use chainwave_measurement::{MemoryRecording, Subset, Track};

use crate::support::{Image, Speckle, floors_px, grid, moments, recorded, rms, sense, slopes};

const N_FRAMES: usize = 41;

/// Displacement in frame k: every tenth of a pixel, at 0.7 px a frame.
fn shift_px(frame: usize) -> f64 {
    0.7 * frame as f64
}

/// Films of the scene with fresh noise in each, as the noise of a film's reference is one draw for all of its frames.
const N_FILMS: usize = 6;

fn scene() -> Speckle {
    Speckle::new(11, Speckle::RADIUS_PX)
}

fn film(noise: f64, number: usize) -> MemoryRecording {
    let speckle = scene();
    let frame = |k: usize| {
        let moved = speckle.render(|[x, y]| [x + shift_px(k), y - 0.3 * shift_px(k)]);
        sense(&moved, noise, (number * N_FRAMES + k) as u64)
    };
    recorded((0..N_FRAMES).map(frame).collect())
}

/// Error in x, and error over sigma, of all positions after the reference; errors by frame.
fn errors(tracks: &[Track]) -> Vec<Vec<[f64; 2]>> {
    let of_frame = |frame: usize| {
        let error = |(track, subset): (&Track, Subset)| {
            let x = track.positions[frame].ok()?.x_px;
            let error = x.value - subset.x_px - shift_px(frame);
            Some([error, error / x.sigma])
        };
        tracks.iter().zip(grid(45)).filter_map(error).collect()
    };
    (1..N_FRAMES).map(of_frame).collect()
}

/// Errors of a method on some films, by film and frame.
fn errors_of(method: Method, films: &[MemoryRecording]) -> Vec<Vec<Vec<[f64; 2]>>> {
    let run = |film: &MemoryRecording| {
        let reference = ReferenceFrames::Single(0);
        method.track(film, &grid(45), &reference, &Settings::default(), &|_| ()).unwrap()
    };
    films.iter().map(|film| errors(&run(film))).collect()
}

/// Per cent of errors within some standard uncertainties.
fn share(errors: &[[f64; 2]], limit: f64) -> f64 {
    100.0 * errors.iter().filter(|e| e[1].abs() < limit).count() as f64 / errors.len() as f64
}

#[test]
#[ignore = "a table of the book, of some minutes"]
fn every_method_on_one_scene() {
    chainwave_opencv::register();
    let clean = [film(0.0, 0)];
    let noisy: Vec<MemoryRecording> = (0..N_FILMS).map(|number| film(0.02, number)).collect();
    let image: Image = Box::new(|[u, v]| scene().render(|[x, y]| [x + u, y + v]));
    let floors_px: Vec<f64> =
        floors_px(&slopes(&image), 0.02, &grid(45)).iter().map(|floor| floor[0]).collect();
    let floor_px = rms(&floors_px);
    println!("noise floor {:.2} mpx", 1e3 * floor_px);
    println!("count: method,bias_mpx,std_mpx,over_floor,within_68,within_95,lost");
    for method in Method::available() {
        let means: Vec<f64> = errors_of(method, &clean)[0]
            .iter()
            .map(|frame| moments(&frame.iter().map(|e| e[0]).collect::<Vec<_>>())[0])
            .collect();
        let bias =
            means.iter().fold(f64::MIN, |a, &b| a.max(b)) - means.iter().fold(f64::MAX, |a, &b| a.min(b));
        let all = errors_of(method, &noisy).concat().concat();
        let std = moments(&all.iter().map(|e| e[0]).collect::<Vec<_>>())[1];
        println!(
            "count: {method},{:.2},{:.1},{:.2},{:.1} %,{:.1} %,{}",
            1e3 * bias,
            1e3 * std,
            std / floor_px,
            share(&all, 1.0),
            share(&all, 1.96),
            N_FILMS * (N_FRAMES - 1) * grid(45).len() - all.len(),
        );
    }
}

/// Films at each noise; one has 4000 positions, whose frames share the noise of one reference.
const N_FILMS_AT_EACH_NOISE: usize = 2;

#[test]
#[ignore = "a table of the book, of some minutes"]
fn intervals_of_methods_without_a_covariance() {
    chainwave_opencv::register();
    println!("count: method,at_02,at_1,at_2,at_5,at_10");
    for method in ["opencv-lk", "opencv-ecc", "opencv-phase", "template-parabola"] {
        let held = [0.002, 0.01, 0.02, 0.05, 0.1].map(|noise| {
            let films: Vec<MemoryRecording> =
                (0..N_FILMS_AT_EACH_NOISE).map(|number| film(noise, number)).collect();
            let all = errors_of(method.parse().unwrap(), &films).concat().concat();
            format!("\"{:.1}, {:.1}\"", share(&all, 1.0), share(&all, 1.96))
        });
        println!("count: {method},{}", held.join(","));
    }
}
