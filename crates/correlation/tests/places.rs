//! The rungs that give a place and no covariance: lost where the body is gone, and found again.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]

mod support;

use chainwave_correlation::{Method, ReferenceFrames, Settings};
use chainwave_measurement::{Lost, MemoryRecording, Subset, Track};
use support::{SIZE, Speckle, recorded, sense};

/// 0.7 and -0.21 px a frame under 2 % noise.
fn film(n_frames: usize) -> MemoryRecording {
    let speckle = Speckle::new(11, Speckle::RADIUS_PX);
    let frame = |k: usize| {
        let way = 0.7 * k as f64;
        sense(&speckle.render(|[x, y]| [x + way, y - 0.3 * way]), 0.02, k as u64)
    };
    recorded((0..n_frames).map(frame).collect())
}

fn follow(name: &str, film: &MemoryRecording, subsets: &[Subset]) -> Vec<Track> {
    let method: Method = name.parse().unwrap();
    method.track(film, subsets, &ReferenceFrames::Single(0), &Settings::default(), &|_| ()).unwrap()
}

#[test]
fn a_body_that_is_gone_is_lost_and_found_again() {
    let mut film = film(16);
    let bare = sense(&vec![900.0; SIZE[0] * SIZE[1]], 0.02, 99);
    film.frames[4..7].iter_mut().for_each(|frame| frame.clone_from(&bare));
    let subsets = [support::subset(200.0, 200.0, 16)];
    const NAMES: &[&str] = &[
        "template-parabola",
        #[cfg(feature = "opencv")]
        "opencv-ecc",
    ];
    for name in NAMES {
        let track = follow(name, &film, &subsets).remove(0);
        for (k, found) in track.positions.iter().enumerate() {
            match (k, found) {
                (4..7, found) => {
                    assert!(
                        matches!(found, Err(Lost::LowCorrelation | Lost::NotConverged)),
                        "{k}: {found:?}"
                    );
                }
                // found by a search of whole pixels, in every fourth frame in the end
                (7..11, Err(_)) => (),
                (_, found) => {
                    let x_px = found.unwrap().x_px;
                    assert!((x_px.value - 200.0 - 0.7 * k as f64).abs() < 5.0 * x_px.sigma, "{k}: {found:?}");
                }
            }
        }
    }
}
