//! OpenCV's Lucas-Kanade method on the same analytic speckle.

use crate::support::{SIZE, Speckle, Wrong, assert_coverage, grid, moments, recorded, sense};
use chainwave_correlation::{Method, ReferenceFrames, Settings};
use chainwave_measurement::{MemoryRecording, Track};

fn follow(film: &MemoryRecording, reference: usize) -> Vec<Track> {
    chainwave_opencv::register();
    let method: Method = "opencv-lk".parse().unwrap();
    method.track(film, &grid(50), &ReferenceFrames::Single(reference), &Settings::default(), &|_| ()).unwrap()
}

/// Frames of a plane that moves by 0.9 px a frame.
fn moving(n_frames: i32, noise: f64) -> MemoryRecording {
    let speckle = Speckle::new(8, Speckle::RADIUS_PX);
    let frame = |k: i32| sense(&speckle.render(|[x, y]| [x + 0.9 * f64::from(k), y]), noise, k as u64);
    recorded((0..n_frames).map(frame).collect())
}

#[test]
fn the_bias_of_bilinear_interpolation_is_taken_off_and_the_rest_lies_within_the_stated_interval() {
    let tracks = follow(&moving(11, 0.01), 5);
    let mut pulls = Vec::new();
    let (mut means, mut sigmas) = (Vec::new(), Vec::new());
    for frame in 0..11 {
        let mut error = |(track, subset): (&Track, chainwave_measurement::Subset)| {
            let position = track.positions[frame].unwrap();
            sigmas.push(position.x_px.sigma);
            let error = position.x_px.value - subset.x_px - 0.9 * (frame as f64 - 5.0);
            (error, error / position.x_px.sigma)
        };
        let errors: Vec<(f64, f64)> = tracks.iter().zip(grid(50)).map(&mut error).collect();
        means.push(moments(&errors.iter().map(|error| error.0).collect::<Vec<_>>())[0]);
        if frame != 5 {
            pulls.extend(errors.into_iter().map(|error| error.1));
        }
    }
    let bias = means.iter().fold(f64::MIN, |a, &b| a.max(b)) - means.iter().fold(f64::MAX, |a, &b| a.min(b));
    println!("bias {:.1} mpx peak to peak, pulls {:.2}", 1e3 * bias, moments(&pulls)[1]);
    // 24 mpx before, of which a twelfth may be left; 49 errors tell each of the eleven means to a seventh of sigma, and three of
    // these errors lie to either side
    let sigma = sigmas.iter().sum::<f64>() / sigmas.len() as f64;
    assert!(bias < 0.024 / 12.0 + 6.0 * sigma / 7.0, "{bias} px, sigma {sigma} px");
    assert_coverage("opencv-lk", &pulls, 10, Wrong::TooNarrow);
}

#[test]
fn a_frame_of_something_else_is_lost_and_the_next_found() {
    let mut film = moving(6, 0.01);
    film.frames[2] = sense(&vec![1000.0; SIZE[0] * SIZE[1]], 0.01, 99);
    for track in follow(&film, 0) {
        assert!(track.positions[2].is_err(), "for one reason or another: the flow wanders");
        assert!([0, 1, 3, 4, 5].into_iter().all(|frame| track.positions[frame].is_ok()), "{track:?}");
    }
}
