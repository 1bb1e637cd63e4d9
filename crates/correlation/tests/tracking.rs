//! Following bodies through recordings: large motion, loss and return, what a user may get wrong.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test fails by panicking, and shows what it measured"
)]

mod support;

use std::sync::atomic::{AtomicU64, Ordering};

use chainwave_correlation::{CorrelationError, ReferenceFrames, Settings, Shape, track};
use chainwave_measurement::{
    Lost, MemoryRecording, ReadError, Recording, RecordingInfo, Region, Subset, Track,
};
use support::{SIZE, Speckle, recorded, sense, subset};

/// A speckled body of 61 x 61 px around `centre` on a dark ground.
fn picture(body: &Speckle, centre: [f64; 2], seed: u64) -> Vec<f32> {
    let image = body.render(|[x, y]| [x - 210.0 + centre[0], y - 210.0 + centre[1]]);
    let inside = |i: usize| {
        let (x, y) = ((i % SIZE[0]) as f64, (i / SIZE[0]) as f64);
        (x - centre[0]).abs() < 30.0 && (y - centre[1]).abs() < 30.0
    };
    let image: Vec<f64> = image.iter().enumerate().map(|(i, &g)| if inside(i) { g } else { 150.0 }).collect();
    sense(&image, 0.01, seed)
}

fn film(centres: &[[f64; 2]]) -> MemoryRecording {
    let body = Speckle::new(7, Speckle::RADIUS_PX);
    recorded(centres.iter().zip(1..).map(|(&centre, seed)| picture(&body, centre, seed)).collect())
}

fn follow(recording: &dyn Recording, at: [f64; 2], reference: usize) -> Track {
    let subsets = [subset(at[0], at[1], 16)];
    let settings = Settings::default();
    let reference = ReferenceFrames::Single(reference);
    track(recording, &subsets, &reference, &settings, &|_| ()).unwrap().remove(0)
}

fn assert_close(track: &Track, frame: usize, truth: [f64; 2]) {
    let position = track.positions[frame].unwrap_or_else(|lost| panic!("frame {frame}: {lost:?}"));
    let [dx, dy] = [position.x_px.value - truth[0], position.y_px.value - truth[1]];
    // 1 % noise: sigma is 6 mpx, and six of them
    assert!(dx.hypot(dy) < 0.04, "frame {frame}: off by {dx}, {dy} px");
}

#[test]
fn a_body_is_followed_over_300_px_at_up_to_20_px_a_frame() {
    let place =
        |frame: f64| [50.3 + 320.0 * (0.5 - 0.5 * (frame * 0.12).cos()), 200.2 + 3.0 * (0.5 * frame).sin()];
    let centres: Vec<[f64; 2]> = (0..30).map(|frame| place(f64::from(frame))).collect();
    let film = film(&centres);
    for reference in [0, 17] {
        let track = follow(&film, centres[reference], reference);
        for (frame, &centre) in centres.iter().enumerate() {
            assert_close(&track, frame, centre);
        }
    }
}

/// 19 x 19 px hold about as many speckles as an affine subset has parameters twice over: where it is found undeformed, none of these was used to
/// make something else resemble it.
#[test]
fn a_small_subset_that_moves_by_6_px_a_frame_is_followed() {
    for seed in 20..26 {
        let body = Speckle::new(seed, 1.35 * Speckle::RADIUS_PX);
        let frame = |k: usize| {
            let image = body.render(|[x, y]| [x + 6.0 * k as f64, y]);
            sense(&image.iter().map(|grey| 0.7 * grey).collect::<Vec<_>>(), 0.01, 100 * seed + k as u64)
        };
        let film = recorded((0..30).map(frame).collect());
        let first = ReferenceFrames::Single(0);
        let settings = Settings { shape: Shape::Affine, ..Settings::default() };
        let tracks = track(&film, &[subset(100.0, 210.0, 9)], &first, &settings, &|_| ()).unwrap();
        let mut n_found = 0;
        for (k, found) in tracks[0].positions.iter().enumerate() {
            let Ok(found) = found else { continue };
            n_found += 1;
            let off = (found.x_px.value - 100.0 - 6.0 * k as f64).abs();
            assert!(off < 5.0 * found.x_px.sigma, "seed {seed}, frame {k}: {off} of {}", found.x_px.sigma);
        }
        println!("seed {seed}: {n_found} of 30");
        assert!(n_found >= 27, "seed {seed}: {n_found}");
    }
}

#[test]
fn a_sudden_start_is_found_by_search() {
    let centres = [[100.0, 200.0], [100.0, 200.0], [119.6, 195.3], [139.2, 190.6]];
    let track = follow(&film(&centres), centres[0], 0);
    for (frame, &centre) in centres.iter().enumerate() {
        assert_close(&track, frame, centre);
    }
}

#[test]
fn a_body_that_leaves_the_view_is_lost_for_that_reason_and_found_when_it_returns() {
    let place = |frame: i32| [330.0 + 9.0 * f64::from(if frame < 12 { frame } else { 24 - frame }), 200.0];
    let centres: Vec<[f64; 2]> = (0..25).map(place).collect();
    let track = follow(&film(&centres), centres[0], 0);
    for (frame, &[x, y]) in centres.iter().enumerate() {
        if x + 16.0 + 3.0 < SIZE[0] as f64 && !(12..24).contains(&frame) {
            assert_close(&track, frame, [x, y]);
        } else if x + 16.0 > SIZE[0] as f64 - 1.0 {
            assert_eq!(track.positions[frame], Err(Lost::OutOfView), "frame {frame}");
        }
    }
    assert!(
        track.positions[20..].iter().all(Result::is_ok),
        "back within four frames: {:?}",
        &track.positions[16..]
    );
}

#[test]
fn a_body_behind_an_obstacle_is_lost_and_found_again() {
    let centres: Vec<[f64; 2]> = (0..20).map(|frame| [80.0 + 12.0 * f64::from(frame), 200.0]).collect();
    let mut film = film(&centres);
    for frame in 6..11 {
        film.frames[frame].fill(900.0);
    }
    let track = follow(&film, centres[0], 0);
    for (frame, &centre) in centres.iter().enumerate() {
        match frame {
            6..11 => assert_eq!(track.positions[frame], Err(Lost::LowCorrelation), "frame {frame}"),
            11..15 => (),
            _ => assert_close(&track, frame, centre),
        }
    }
}

#[test]
fn the_reference_frame_itself_states_the_noise_of_its_own_pixels() {
    let centres = [[200.0, 200.0]; 3];
    let track = follow(&film(&centres), [200.25, 199.5], 1);
    let sigma = |frame: usize| track.positions[frame].unwrap().x_px.sigma;
    assert_close(&track, 1, [200.25, 199.5]);
    // One noise instead of two. It is told by the fourth differences of 1089 px, of which a seventh are independent, to 6 %, and
    // that of the residual to 2 %: two standard errors of 0.04.
    assert!((sigma(1) / sigma(0) - 0.5_f64.sqrt()).abs() < 0.1, "{} {}", sigma(1), sigma(0));
}

#[test]
fn a_subset_without_texture_says_so_in_every_frame() {
    let stripes: Vec<f32> =
        (0..SIZE[0] * SIZE[1]).map(|i| 500.0 + 300.0 * ((i % SIZE[0]) as f32 * 0.8).sin()).collect();
    let flat = vec![1000.0; SIZE[0] * SIZE[1]];
    let noise = sense(&vec![1000.0; SIZE[0] * SIZE[1]], 0.02, 1);
    for frame in [stripes, flat, noise] {
        for shape in Shape::ALL {
            let film = recorded(vec![frame.clone(); 2]);
            let settings = Settings { shape, ..Settings::default() };
            let tracks =
                track(&film, &[subset(200.0, 200.0, 16)], &ReferenceFrames::Single(0), &settings, &|_| ());
            assert_eq!(tracks.unwrap()[0].positions, [Err(Lost::NoTexture); 2]);
        }
    }
}

#[test]
fn a_body_that_has_turned_by_any_angle_between_two_frames_is_found() {
    let body = Speckle::new(7, Speckle::RADIUS_PX);
    let turned = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let image = body.deformed(|[x, y]| {
            let (x, y) = (x - 205.0, y - 208.0);
            [210.0 + cos * x + sin * y, 210.0 - sin * x + cos * y]
        });
        sense(&image, 0.01, degrees as u64 + 1)
    };
    for degrees in [20.0, 67.0, 90.0, 181.0, 263.0] {
        let film = recorded(vec![sense(&body.deformed(|place| place), 0.01, 0), turned(degrees)]);
        assert_close(&follow(&film, [210.0, 210.0], 0), 1, [205.0, 208.0]);
    }
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let film = film(&[[200.0, 200.0], [203.4, 199.1], [208.2, 198.0]]);
    let subsets: Vec<Subset> = [188.0, 194.0, 200.0, 206.0, 212.0].map(|x| subset(x, 200.0, 10)).into();
    let run = |n_threads: usize| {
        let settings = Settings { n_threads: n_threads.try_into().unwrap(), ..Settings::default() };
        track(&film, &subsets, &ReferenceFrames::Single(1), &settings, &|_| ()).unwrap()
    };
    let one = run(1);
    assert!([2, 3, 8].into_iter().all(|n_threads| run(n_threads) == one));
}

/// A body whose texture turns into another one over 60 frames while it moves by 0.73 px a frame.
fn changing_film() -> MemoryRecording {
    let [before, after] = [7, 8].map(|seed| Speckle::new(seed, Speckle::RADIUS_PX));
    let frame = |k: usize| {
        let place = |[x, y]: [f64; 2]| [x + 0.73 * k as f64, y - 0.21 * k as f64];
        let share = (k as f64 / 60.0).min(1.0);
        let both = before.render(place).into_iter().zip(after.render(place));
        sense(&both.map(|(a, b)| (1.0 - share) * a + share * b).collect::<Vec<_>>(), 0.01, k as u64)
    };
    recorded((0..80).map(frame).collect())
}

#[test]
fn a_body_whose_texture_changes_is_prepared_anew_and_its_sigma_grows() {
    let film = changing_film();
    let follow = |renewal_share: f64| {
        let settings = Settings { renewal_share, ..Settings::default() };
        let places: Vec<Subset> = (0..9)
            .map(|i| subset(120.0 + 35.0 * f64::from(i % 3), 150.0 + 35.0 * f64::from(i / 3), 16))
            .collect();
        let tracks = track(&film, &places, &ReferenceFrames::Single(0), &settings, &|_| ()).unwrap();
        places.into_iter().zip(tracks).collect::<Vec<_>>()
    };
    for (_, track) in follow(0.0) {
        assert!(track.positions[70..].iter().all(Result::is_err), "nothing is left of the first texture");
    }
    let mut square = 0.0;
    let tracks = follow(0.85);
    for (place, track) in &tracks {
        let [early, late] = [5, 79].map(|frame| track.positions[frame].unwrap().x_px);
        // Where it is prepared anew a quarter of the picture differs from the reference, and sigma is that of a match so bad.
        assert!((2.0..40.0).contains(&(late.sigma / early.sigma)), "{early:?} {late:?}");
        square += ((late.value - place.x_px - 0.73 * 79.0) / late.sigma).powi(2);
    }
    // Nine errors in units of their sigma: their mean square is below 2.4 in 99 of 100 cases.
    let mean_square = square / tracks.len() as f64;
    println!("mean square {mean_square}");
    assert!(mean_square < 2.4, "{mean_square}");
}

#[test]
fn what_does_not_decay_is_compared_with_the_reference_to_the_end() {
    let centres: Vec<[f64; 2]> = (0..40).map(|k| [150.0 + 1.3 * f64::from(k), 200.0]).collect();
    let film = film(&centres);
    let follow = |renewal_share: f64| {
        let settings = Settings { renewal_share, ..Settings::default() };
        track(&film, &[subset(150.0, 200.0, 16)], &ReferenceFrames::Single(0), &settings, &|_| ()).unwrap()
    };
    assert_eq!(follow(0.85), follow(0.0));
}

#[test]
fn progress_counts_every_frame_once() {
    let film = film(&[[200.0, 200.0]; 5]);
    let frames = AtomicU64::new(0);
    let count = |n: u64| {
        frames.fetch_add(n, Ordering::Relaxed);
    };
    let subsets = [subset(200.0, 200.0, 16), subset(210.0, 190.0, 12)];
    let tracks = track(&film, &subsets, &ReferenceFrames::Mean(2..4), &Settings::default(), &count).unwrap();
    assert_eq!(frames.into_inner(), 5);
    assert_eq!(tracks.iter().map(|track| track.positions.len()).collect::<Vec<_>>(), [5, 5]);
    assert_eq!(tracks[1].name, "210 190");
}

#[test]
fn what_is_wrong_is_named() {
    let film = film(&[[200.0, 200.0]; 2]);
    let run =
        |subsets: &[Subset], reference| track(&film, subsets, &reference, &Settings::default(), &|_| ());
    let outside = run(&[subset(10.0, 200.0, 16)], ReferenceFrames::Single(0)).unwrap_err();
    assert!(
        outside.to_string().contains("\"10 200\" at (10, 200): expected it inside 420 x 420 px"),
        "{outside}"
    );
    let missing = run(&[], ReferenceFrames::Mean(1..3));
    assert!(missing.is_ok(), "no subset needs no reference");
    let missing = run(&[subset(200.0, 200.0, 16)], ReferenceFrames::Mean(1..3)).unwrap_err();
    assert!(matches!(missing, CorrelationError::NoSuchReference { n_frames: 2, .. }), "{missing}");
}

/// A film with one frame that cannot be read.
struct Broken(MemoryRecording);

impl Recording for Broken {
    fn path(&self) -> &std::path::Path {
        self.0.path()
    }

    fn info(&self) -> &RecordingInfo {
        self.0.info()
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        if frame == 2 {
            return Err(ReadError::Unreadable { path: self.path().into(), frame, reason: "cut off".into() });
        }
        self.0.read_region(frame, region, pixels)
    }
}

#[test]
fn a_frame_that_cannot_be_read_costs_that_frame_alone() {
    let track = follow(&Broken(film(&[[200.0, 200.0]; 5])), [200.0, 200.0], 0);
    assert_eq!(track.positions[2], Err(Lost::Unreadable));
    assert!([0, 1, 3, 4].into_iter().all(|frame| track.positions[frame].is_ok()));
}

#[test]
fn pixels_that_are_no_numbers_do_no_harm() {
    let mut film = film(&[[200.0, 200.0]; 4]);
    film.frames[1][200 * SIZE[0] + 200] = f32::NAN;
    film.frames[2][200 * SIZE[0] + 200] = f32::INFINITY;
    let track = follow(&film, [200.0, 200.0], 0);
    (1..4).for_each(|frame| assert_close(&track, frame, [200.0, 200.0]));
}
