//! Tracks a point of a texture that moves and turns a little from frame to frame, and prints what is found beside the truth.
//!
//! `cargo run --release -p chainwave-correlation --example track_a_point`

use chainwave_correlation::{CorrelationError, ReferenceFrames, Settings, track};
use chainwave_measurement::{MemoryRecording, Subset};

const N_FRAMES: usize = 12;
const WIDTH_PX: usize = 128;
const HEIGHT_PX: usize = 100;
const MIDDLE_PX: [f64; 2] = [60.0, 50.0];
const STEP_PX: f64 = 0.3;
const TURN_RAD: f64 = 0.01;

#[expect(clippy::print_stdout, reason = "the track is the program's result")]
fn main() -> Result<(), CorrelationError> {
    let [x_px, y_px] = MIDDLE_PX;
    let marker = Subset::new("marker", x_px, y_px, 16, 16);
    let film = film();
    let tracks = track(&film, &[marker], &ReferenceFrames::Single(0), &Settings::default(), &|_| ())?;
    println!("frame   x (px)               moved by    truth");
    for (frame, found) in tracks.iter().flat_map(|track| &track.positions).enumerate() {
        match found {
            Ok(position) => {
                let (x, truth_px) = (position.x_px, STEP_PX * frame as f64);
                println!(
                    "{frame:5}   {:8.4} +- {:6.4}   {:9.4}   {truth_px:6.4}",
                    x.value,
                    x.sigma,
                    x.value - x_px
                );
            }
            Err(lost) => println!("{frame:5}   lost: {}", lost.as_str()),
        }
    }
    Ok(())
}

/// A film in memory: forty waves, seen where they have come from.
fn film() -> MemoryRecording {
    let frame = |frame: usize| {
        let (sin, cos) = (TURN_RAD * frame as f64).sin_cos();
        let pixel = |k: usize| {
            let x = (k % WIDTH_PX) as f64 - MIDDLE_PX[0] - STEP_PX * frame as f64;
            let y = (k / WIDTH_PX) as f64 - MIDDLE_PX[1];
            brightness(cos * x + sin * y, cos * y - sin * x) as f32
        };
        (0..WIDTH_PX * HEIGHT_PX).map(pixel).collect()
    };
    MemoryRecording::new(WIDTH_PX, 12, (0..N_FRAMES).map(frame).collect())
}

/// Counts of the texture at rest.
fn brightness(x: f64, y: f64) -> f64 {
    let wave = |n: i32| {
        (0.9 * f64::from(n).sin() * x + 0.9 * f64::from(2 * n + 1).sin() * y + f64::from(n * n)).sin()
    };
    2000.0 + 150.0 * (1..=40).map(wave).sum::<f64>()
}
