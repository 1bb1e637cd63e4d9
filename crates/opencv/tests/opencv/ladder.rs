//! The measured ladder: accuracy, honesty and speed of every method on one scene, OpenCV's among them. Run it with
//! `cargo test --release -p chainwave-opencv --test opencv -- --ignored --nocapture`; the variable METHOD names a part of the methods'
//! names.

use std::time::Instant;

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

#[test]
#[ignore = "a measurement of minutes, not a check"]
fn every_method_on_one_scene() {
    chainwave_opencv::register();
    let clean = film(0.0, 0);
    let noisy: Vec<MemoryRecording> = (0..N_FILMS).map(|number| film(0.02, number)).collect();
    let subsets = grid(45);
    let image: Image = Box::new(|[u, v]| scene().render(|[x, y]| [x + u, y + v]));
    let floors_px: Vec<f64> =
        floors_px(&slopes(&image), 0.02, &subsets).iter().map(|floor| floor[0]).collect();
    let floor_px = rms(&floors_px);
    println!("noise floor {:.2} mpx", 1e3 * floor_px);
    println!(
        "{:26} {:>9} {:>9} {:>9} {:>7} {:>7} {:>5} {:>9}",
        "method", "bias mpx", "std mpx", "std/floor", "68 %", "95 %", "lost", "per s"
    );
    let wanted = std::env::var("METHOD").unwrap_or_default();
    for method in Method::available().into_iter().filter(|method| method.to_string().contains(&wanted)) {
        let run = |film: &MemoryRecording| {
            let reference = ReferenceFrames::Single(0);
            method.track(film, &subsets, &reference, &Settings::default(), &|_| ()).unwrap()
        };
        let means: Vec<f64> = errors(&run(&clean))
            .iter()
            .map(|frame| moments(&frame.iter().map(|e| e[0]).collect::<Vec<_>>())[0])
            .collect();
        let bias =
            means.iter().fold(f64::MIN, |a, &b| a.max(b)) - means.iter().fold(f64::MAX, |a, &b| a.min(b));
        let start = Instant::now();
        let all: Vec<[f64; 2]> = noisy.iter().flat_map(|film| errors(&run(film)).concat()).collect();
        let wall_s = start.elapsed().as_secs_f64();
        let std = moments(&all.iter().map(|e| e[0]).collect::<Vec<_>>())[1];
        let share =
            |limit: f64| 100.0 * all.iter().filter(|e| e[1].abs() < limit).count() as f64 / all.len() as f64;
        println!(
            "{:26} {:9.2} {:9.2} {:9.3} {:7.1} {:7.1} {:5} {:9.0}",
            method.to_string(),
            1e3 * bias,
            1e3 * std,
            std / floor_px,
            share(1.0),
            share(1.96),
            N_FILMS * (N_FRAMES - 1) * subsets.len() - all.len(),
            (N_FILMS * N_FRAMES * subsets.len()) as f64 / wall_s,
        );
    }
}
