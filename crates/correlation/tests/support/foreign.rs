//! What a method that gives a place and no covariance states of its errors, against what they are on films of known motion.

#![expect(unreachable_pub, reason = "a module of several test binaries")]

use chainwave_correlation::{Method, ReferenceFrames, Settings};
use chainwave_measurement::{Lost, MemoryRecording, Track};

use crate::support::{SIZE, Speckle, Wrong, assert_coverage, grid, recorded, rms, sense, subset};

/// Frames after the reference, which move by 0.7 px along x from one to the next, and by 0.21 px back along y.
const N_FRAMES: usize = 5;

/// A still frame, and as many more.
fn film(seed: u64, noise: f64) -> MemoryRecording {
    let speckle = Speckle::new(50 + seed, Speckle::RADIUS_PX);
    // with a little less light, so that hardly a speckle saturates
    let lit = |image: Vec<f64>| image.into_iter().map(|g| 0.85 * g).collect::<Vec<_>>();
    let first = 0.1 * seed as f64;
    let frame = |k: usize| {
        let way = if k == 0 { 0.0 } else { first + 0.7 * k as f64 };
        sense(&lit(speckle.render(|[x, y]| [x + way, y - 0.3 * way])), noise, 100 * seed + k as u64)
    };
    recorded((0..=N_FRAMES).map(frame).collect())
}

/// Errors over sigma of a method on some films.
fn pulls(name: &str, noise: f64, n_films: u64) -> Vec<f64> {
    let method: Method = name.parse().unwrap();
    let subsets = grid(110);
    let of_film = |seed: u64| {
        let reference = ReferenceFrames::Single(0);
        let film = film(seed, noise);
        let tracks = method.track(&film, &subsets, &reference, &Settings::default(), &|_| ()).unwrap();
        let of_track = |(track, start): (&Track, &chainwave_measurement::Subset)| {
            let of_frame = |k: usize| {
                let way = 0.1 * seed as f64 + 0.7 * k as f64;
                let found = track.positions[k].ok()?;
                let pulls = [(found.x_px, start.x_px + way), (found.y_px, start.y_px - 0.3 * way)]
                    .map(|(found, truth)| (found.value - truth) / found.sigma);
                Some(pulls)
            };
            (1..=N_FRAMES).filter_map(of_frame).flatten().collect::<Vec<_>>()
        };
        tracks.iter().zip(&subsets).flat_map(of_track).collect::<Vec<_>>()
    };
    (0..n_films).flat_map(of_film).collect()
}

/// At 2 and 10 % noise: five frames share a reference.
pub fn assert_coverage_of_noise(name: &str, wrong: Wrong) {
    for noise in [0.02, 0.1] {
        let pulls = pulls(name, noise, 2);
        // where the least contrasted subsets are refused
        assert!(pulls.len() as f64 >= if noise < 0.1 { 1.0 } else { 0.9 } * 720.0, "{}", pulls.len());
        assert_coverage(&format!("{name} at {noise}"), &pulls, N_FRAMES, wrong);
    }
}

/// At 0.2 % noise errors are what is left of a bias, which all subsets of a frame have in common: the ten places between
/// pixels that two films show along each axis tell the mean square of errors over sigma as twenty errors do. It is 1, as sigma
/// is a standard deviation, or, two of its standard errors off, no more.
pub fn assert_mean_square_of_bias(name: &str) {
    let pulls = pulls(name, 0.002, 2);
    assert_eq!(pulls.len(), 720, "no point is lost");
    let standard_error = (2.0_f64 / 20.0).sqrt();
    let mean_square = rms(&pulls).powi(2);
    assert!(mean_square < 1.0 + 2.0 * standard_error, "{name}: {mean_square}");
}

/// Frames that move by 0.7 and -0.21 px from one to the next, under 2 % noise.
fn steady(n_frames: usize) -> MemoryRecording {
    let speckle = Speckle::new(11, Speckle::RADIUS_PX);
    let frame = |k: usize| {
        let way = 0.7 * k as f64;
        sense(&speckle.render(|[x, y]| [x + way, y - 0.3 * way]), 0.02, k as u64)
    };
    recorded((0..n_frames).map(frame).collect())
}

/// A body that is gone is lost, and found again.
pub fn assert_lost_and_found(name: &str) {
    let mut film = steady(16);
    let bare = sense(&vec![900.0; SIZE[0] * SIZE[1]], 0.02, 99);
    film.frames[4..7].iter_mut().for_each(|frame| frame.clone_from(&bare));
    let (method, subsets): (Method, _) = (name.parse().unwrap(), [subset(200.0, 200.0, 16)]);
    let first = ReferenceFrames::Single(0);
    let tracks = method.track(&film, &subsets, &first, &Settings::default(), &|_| ()).unwrap();
    for (k, found) in tracks[0].positions.iter().enumerate() {
        match (k, found) {
            (4..7, found) => {
                assert!(matches!(found, Err(Lost::LowCorrelation | Lost::NotConverged)), "{k}: {found:?}");
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
