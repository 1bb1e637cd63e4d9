//! The rungs that give a place and no covariance: right within the uncertainty that they showed on the subset itself, and
//! lost where the body is gone.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]

mod support;

use std::ops::Range;

use chainwave_correlation::{Method, ReferenceFrames, Settings};
use chainwave_measurement::{Lost, Subset, Track};
use support::{Film, SIZE, Speckle, grid, sense};

/// 0.7 and -0.21 px a frame under 2 % noise.
fn film(n_frames: usize) -> Film {
    let speckle = Speckle::new(11, Speckle::RADIUS_PX);
    let frame = |k: usize| {
        let way = 0.7 * k as f64;
        sense(&speckle.render(|[x, y]| [x + way, y - 0.3 * way]), 0.02, k as u64)
    };
    Film::new((0..n_frames).map(frame).collect())
}

fn follow(name: &str, film: &Film, subsets: &[Subset]) -> Vec<Track> {
    let method: Method = name.parse().unwrap();
    method.track(film, subsets, &ReferenceFrames::Single(0), &Settings::default(), &|_| ()).unwrap()
}

/// Share of errors in x within one stated sigma, and within the 95 % interval; none may be lost.
fn coverage(name: &str) -> [f64; 2] {
    let subsets: Vec<Subset> = grid(45).into_iter().step_by(3).collect();
    let tracks = follow(name, &film(12), &subsets);
    let pulls: Vec<f64> = tracks
        .iter()
        .zip(&subsets)
        .flat_map(|(track, subset)| {
            let pull = |k: usize| {
                let found = track.positions[k].unwrap().x_px;
                ((found.value - subset.x_px - 0.7 * k as f64) / found.sigma).abs()
            };
            (1..12).map(pull).collect::<Vec<_>>()
        })
        .collect();
    [1.0, 1.96].map(|limit| pulls.iter().filter(|pull| **pull < limit).count() as f64 / pulls.len() as f64)
}

#[test]
fn a_method_without_a_covariance_states_the_errors_it_showed() {
    // 24 pictures tell a sigma to a seventh, which takes a few percent from both shares; the errors are far from normal
    // where they are mostly bias (template) or have long tails (phase correlation of so few pixels).
    const EXPECTED: &[(&str, Range<f64>, Range<f64>)] = &[
        ("template-parabola", 0.6..0.8, 0.92..0.99),
        #[cfg(feature = "opencv")]
        ("opencv-ecc", 0.55..0.75, 0.9..0.98),
        #[cfg(feature = "opencv")]
        ("opencv-phase", 0.5..0.75, 0.9..1.0),
    ];
    for (name, one_sigma, interval_95) in EXPECTED {
        let [found, found_95] = coverage(name);
        assert!(one_sigma.contains(&found) && interval_95.contains(&found_95), "{name}: {found} {found_95}");
    }
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
