//! The measured ladder: accuracy, honesty and speed of every method on one scene. Run it with
//! `cargo test --release -p chainwave-correlation --test ladder -- --ignored --nocapture`.

mod support;

use std::time::Instant;

use chainwave_correlation::{Method, ReferenceFrames, Settings};
use chainwave_measurement::Track;
use support::{Film, Speckle, grid, moments, sense};

const N_FRAMES: usize = 41;

/// Displacement in frame k: every tenth of a pixel, at 0.7 px a frame.
fn shift_px(frame: usize) -> f64 {
    0.7 * frame as f64
}

fn film(noise: f64) -> Film {
    let speckle = Speckle::new(11, Speckle::RADIUS_PX);
    let frame =
        |k: usize| sense(&speckle.render(|[x, y]| [x + shift_px(k), y - 0.3 * shift_px(k)]), noise, k as u64);
    Film::new((0..N_FRAMES).map(frame).collect())
}

/// Error in x, and error over sigma, of all positions after the reference; errors by frame.
fn errors(tracks: &[Track]) -> Vec<Vec<[f64; 2]>> {
    let of_frame = |frame: usize| {
        let error = |(track, subset): (&Track, chainwave_measurement::Subset)| {
            let x = track.positions[frame].ok()?.x_px;
            let error = x.value - subset.x_px - shift_px(frame);
            Some([error, error / x.sigma])
        };
        tracks.iter().zip(grid(45)).filter_map(error).collect()
    };
    (1..N_FRAMES).map(of_frame).collect()
}

#[test]
#[ignore = "a measurement of a minute, not a check"]
fn every_method_on_one_scene() {
    let (clean, noisy) = (film(0.0), film(0.02));
    let subsets = grid(45);
    println!(
        "{:26} {:>9} {:>9} {:>7} {:>7} {:>5} {:>9}",
        "method", "bias mpx", "std mpx", "68 %", "95 %", "lost", "per s"
    );
    for method in Method::all() {
        let run = |film: &Film| {
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
        let tracks = run(&noisy);
        let wall_s = start.elapsed().as_secs_f64();
        let all: Vec<[f64; 2]> = errors(&tracks).concat();
        let std = moments(&all.iter().map(|e| e[0]).collect::<Vec<_>>())[1];
        let share =
            |limit: f64| 100.0 * all.iter().filter(|e| e[1].abs() < limit).count() as f64 / all.len() as f64;
        println!(
            "{:26} {:9.2} {:9.2} {:7.1} {:7.1} {:5} {:9.0}",
            method.to_string(),
            1e3 * bias,
            1e3 * std,
            share(1.0),
            share(1.96),
            (N_FRAMES - 1) * subsets.len() - all.len(),
            (N_FRAMES * subsets.len()) as f64 / wall_s,
        );
    }
}
