//! Subsets that are no rectangles: what lies beside a body rests, and may not hold it back.

#![cfg(test)]

use std::f64::consts::PI;

use chainwave_correlation::{CorrelationError, Method, ReferenceFrames, Settings};
use chainwave_measurement::{MemoryRecording, Position, Subset, Track};
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture};

const SIZE_PX: [usize; 2] = [200, 200];
const N_FRAMES: usize = 24;
/// Middles of four round bodies, and how far each goes from frame to frame, in pixels.
const BODIES: [([f64; 2], [f64; 2]); 4] = [
    ([50.0, 50.0], [0.27, 0.08]),
    ([150.0, 50.0], [-0.17, 0.23]),
    ([50.0, 150.0], [0.31, -0.13]),
    ([150.0, 150.0], [-0.08, -0.29]),
];
const RADIUS_PX: f64 = 24.0;
/// A subset as large as the body: of the square around it the body fills pi/4.
const HALF_PX: usize = 24;

fn place(body: usize, frame: usize) -> [f64; 2] {
    let ([x, y], [u, v]) = BODIES[body];
    [x + u * frame as f64, y + v * frame as f64]
}

/// Speckled discs that move over speckled ground that rests.
fn film() -> MemoryRecording {
    let ground = Texture::speckles(1, 4.5, [100.0; 2], [110.0; 2]);
    let frame = |frame: usize| -> Vec<f32> {
        let disc = |body: usize| {
            let (at_rest, [x, y]) = (BODIES[body].0, place(body, frame));
            let shift = [x - at_rest[0], y - at_rest[1]];
            Surface::turned_disc(body as u64 + 2, 4.5, (at_rest, RADIUS_PX), 0.0, shift)
        };
        let ground = Surface::everywhere(ground.clone(), Deformation::NONE);
        let surfaces: Vec<Surface> = std::iter::once(ground).chain((0..BODIES.len()).map(disc)).collect();
        counts(&picture(SIZE_PX, &surfaces).unwrap(), 12, 0.01, 5, frame as u64)
            .unwrap()
            .into_raw_vec_and_offset()
            .0
    };
    MemoryRecording::new(SIZE_PX[0], 12, (0..N_FRAMES).map(frame).collect())
}

/// An octagon 5 px within the body's edge, which rings into what is nearer than that.
fn octagon() -> Vec<[f64; 2]> {
    let corner = |k: usize| {
        let angle = PI * (0.125 + k as f64 / 4.0);
        [angle.cos(), angle.sin()].map(|part| (RADIUS_PX - 5.0) * part)
    };
    (0..8).map(corner).collect()
}

fn subsets(outline_px: &[[f64; 2]]) -> Vec<Subset> {
    let of = |(number, ([x, y], _)): (usize, &([f64; 2], [f64; 2]))| {
        Subset::new(number.to_string(), *x, *y, HALF_PX, HALF_PX).within(outline_px.to_vec())
    };
    BODIES.iter().enumerate().map(of).collect()
}

fn tracks(film: &MemoryRecording, subsets: &[Subset]) -> Vec<Track> {
    Method::default()
        .track(film, subsets, &ReferenceFrames::Single(0), &Settings::default(), &|_| ())
        .unwrap()
}

/// Errors along both axes over their sigmas, of what was found in the frames behind the reference; and how many were lost.
fn errors(tracks: &[Track]) -> (Vec<f64>, usize) {
    let (mut errors, mut n_lost) = (Vec::new(), 0);
    for (body, track) in tracks.iter().enumerate() {
        for (frame, found) in track.positions.iter().enumerate().skip(1) {
            let [x, y] = place(body, frame);
            match found {
                Ok(Position { x_px, y_px, .. }) => {
                    errors.extend([(x_px.value - x) / x_px.sigma, (y_px.value - y) / y_px.sigma]);
                }
                Err(_) => n_lost += 1,
            }
        }
    }
    (errors, n_lost)
}

#[test]
fn a_body_within_an_outline_is_found_within_its_sigma_over_ground_that_rests() {
    let film = film();
    let (within, n_lost) = errors(&tracks(&film, &subsets(&octagon())));
    assert_eq!(n_lost, 0);
    let n = within.len() as f64;
    let share = within.iter().filter(|error| error.abs() <= 1.96).count() as f64 / n;
    // Readings of a body share the noise of its reference, so an eighth of them counts as independent: 95 % within three standard errors.
    let spread = 3.0 * (0.05 * 0.95 / (n / 8.0)).sqrt();
    assert!((share - 0.95).abs() < spread, "{share} of {n} within 1.96 sigma");

    // The square around it holds the ground, which holds it back or makes it lost: the outline is what did it.
    let (whole, n_lost) = errors(&tracks(&film, &subsets(&[])));
    let n_wrong = whole.iter().filter(|error| error.abs() > 6.0).count();
    assert!(n_wrong + n_lost > 0, "the ground does not disturb the square: the test shows nothing");
}

#[test]
fn methods_that_take_rectangles_refuse_an_outline() {
    let film = film();
    let tracked = Method::PhaseCorrelation.track(
        &film,
        &subsets(&octagon()),
        &ReferenceFrames::Single(0),
        &Settings::default(),
        &|_| (),
    );
    let said = tracked.unwrap_err();
    assert!(
        matches!(said, CorrelationError::Outline { .. } | CorrelationError::NeedsOpenCv { .. }),
        "{said}"
    );
}
