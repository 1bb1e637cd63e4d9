//! A part of the texture that stands still on the sensor while the rest moves: what it keeps back is added by half and stated, on speckle in closed form.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]

mod support;

use chainwave_correlation::{ReferenceFrames, Settings, track};
use chainwave_measurement::{MemoryRecording, Track};
use support::{Speckle, grid, recorded, sense};

const N_FRAMES: usize = 9;
/// White noise of a pixel, as a share of full range.
const NOISE: f64 = 0.01;
/// Contrast of what stands still over that of what moves.
const CONTRAST: f64 = 0.15;
/// Its share of the texture: that of its square.
const SHARE: f64 = CONTRAST * CONTRAST / (1.0 + CONTRAST * CONTRAST);

/// Where speckles are in a frame: up to 2.4 px from where they were, which is less than they are wide.
fn way_px(frame: usize) -> [f64; 2] {
    [0.3 * frame as f64, 0.11 * frame as f64]
}

/// A film of speckle that moves, behind speckle of a contrast that stands still.
fn film(contrast: f64) -> MemoryRecording {
    let moving = Speckle::new(1, Speckle::RADIUS_PX);
    let still = Speckle::new(2, Speckle::RADIUS_PX).render(|place| place);
    let frame = |frame: usize| {
        let [dx, dy] = way_px(frame);
        let mut image = moving.render(|[x, y]| [x + dx, y + dy]);
        image.iter_mut().zip(&still).for_each(|(value, still)| *value += contrast * still);
        sense(&image, NOISE, frame as u64)
    };
    recorded((0..N_FRAMES).map(frame).collect())
}

fn followed(recording: &MemoryRecording) -> Vec<Track> {
    let settings = Settings { surfaces_bend: true, ..Settings::default() };
    track(recording, &grid(60), &ReferenceFrames::Single(0), &settings, &|_| ()).unwrap()
}

#[test]
fn what_stands_still_is_found_and_stated() {
    let (mut squares, mut short, mut n) = (0.0, 0.0, 0.0);
    let tracks = followed(&film(CONTRAST));
    for (subset, track) in grid(60).iter().zip(&tracks) {
        for (frame, position) in track.positions.iter().enumerate().skip(2) {
            let (found, [dx, _]) = (position.as_ref().unwrap(), way_px(frame));
            let error = found.x_px.value - subset.x_px - dx;
            squares += (error / found.x_px.sigma).powi(2);
            short -= error / dx;
            n += 1.0;
        }
    }
    let (rms, short) = ((squares / n).sqrt(), short / n);
    println!("errors over sigmas {rms:.2}, {short:.4} of the way is lacking");
    let shares: Vec<f64> =
        tracks.iter().filter_map(|track| Some(track.still_share.as_ref()?.value)).collect();
    let share = shares.iter().sum::<f64>() / shares.len() as f64;
    println!("{} of {} named, {share:.3} stands still", shares.len(), tracks.len());
    // Uncorrected, the share itself is lacking, and half of it where half is added: the bound lies between.
    assert!(short < 0.75 * SHARE, "{short}");
    // All readings of a subset share its pattern, and 81 independent errors tell their root mean square to 0.08: four of these.
    assert!(rms < 1.32, "{rms}");
    // Eight frames tell it of most of them beyond doubt.
    assert!(2 * shares.len() > tracks.len(), "{} of {}", shares.len(), tracks.len());
    // What the affine match fits takes 8 of the some 50 numbers that speckles are.
    assert!((share / SHARE - 1.0).abs() < 0.25, "{share} {SHARE}");
}

#[test]
fn what_moves_as_a_whole_is_not_taken_for_still() {
    assert!(followed(&film(0.0)).iter().all(|track| track.still_share.is_none()));
}
