//! Points on surfaces that bend: what the shape function leaves is taken off their tracks or stated, so that intervals hold on both sides.
//!
//! The films are drawn in closed form by a renderer that knows no matcher.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stdout, reason = "what each case gave is a table to be read")]

#[path = "../support/intervals.rs"]
mod intervals;
#[cfg(test)]
mod tables;

use chainwave_correlation::{Method, ReferenceFrames, Settings, track, track_from};
use chainwave_measurement::{MemoryRecording, Subset};
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture_by_spots};
use intervals::Told;

const SIDE_PX: usize = 240;
const MIDDLE_PX: [f64; 2] = [119.5, 119.5];
const N_FRAMES: usize = 5;

/// A surface at rest, then bent more and more, without noise.
struct Film {
    deformations: Vec<Deformation>,
    tones: Vec<ndarray::Array2<f64>>,
    subsets: Vec<Subset>,
    seed: u64,
}

fn subset([x_px, y_px]: [f64; 2]) -> Subset {
    Subset::new(format!("{x_px} {y_px}"), x_px, y_px, 16, 16)
}

impl Film {
    /// Subsets of 33 x 33 px nearly side by side, at all phases of a wave.
    fn new(deformation: impl Fn(f64) -> Deformation, seed: u64) -> Self {
        let texture = Texture::speckles(seed, 4.5, MIDDLE_PX, [170.0; 2]);
        let surface = Surface::everywhere(texture, Deformation::NONE);
        let deformations: Vec<Deformation> =
            (0..N_FRAMES).map(|frame| deformation(frame as f64 / (N_FRAMES - 1) as f64)).collect();
        let drawn =
            |one: &Deformation| picture_by_spots([SIDE_PX; 2], &[surface.clone().deformed(*one)]).unwrap();
        let tones = deformations.iter().map(drawn).collect();
        let line = || (0..6).map(|k| 34.0 + 29.0 * f64::from(k));
        let subsets = line().flat_map(|y| line().map(move |x| subset([x, y]))).collect();
        Self { deformations, tones, subsets, seed }
    }

    fn wave(period_px: f64, seed: u64) -> Self {
        let wave =
            |share: f64| Deformation::Wave { amplitude_px: [0.0, 0.5 * share], along: [1.0, 0.0], period_px };
        Self::new(wave, seed)
    }

    /// Errors and sigmas along y of the readings after the first frame, `n_points` at a time followed together.
    fn errors(&self, noise: f64, asked: Asked) -> Vec<[f64; 2]> {
        let frame = |(number, tones): (u64, &ndarray::Array2<f64>)| {
            counts(tones, 12, noise, self.seed, number).unwrap().into_raw_vec_and_offset().0
        };
        let film = MemoryRecording::new(SIDE_PX, 12, (0..).zip(&self.tones).map(frame).collect());
        let method: Method = format!("icgn-cubic-{}", asked.shape).parse().unwrap();
        let first = ReferenceFrames::Single(0);
        let settings = Settings { surfaces_bend: asked.surfaces_bend, ..Settings::default() };
        let mut errors = Vec::new();
        for subsets in self.subsets.chunks(asked.n_points) {
            let tracks = method.track(&film, subsets, &first, &settings, &|_| ()).unwrap();
            for (subset, track) in subsets.iter().zip(&tracks) {
                for frame in 1..N_FRAMES {
                    let found = track.positions[frame].unwrap();
                    let [_, y_px] = self.deformations[frame].displaced_px([subset.x_px, subset.y_px]);
                    errors.push([found.y_px.value - y_px, found.y_px.sigma]);
                }
            }
        }
        errors
    }
}

/// How the points of a film are followed.
#[derive(Clone, Copy)]
struct Asked {
    shape: &'static str,
    surfaces_bend: bool,
    n_points: usize,
}

const AFFINE: Asked = Asked { shape: "affine", surfaces_bend: true, n_points: 36 };
const AUTO: Asked = Asked { shape: "auto", ..AFFINE };

fn told(films: &[Film], noise: f64, asked: Asked) -> Told {
    Told::of(films.iter().flat_map(|film| film.errors(noise, asked)).collect())
}

/// The readings of a subset in T = 4 frames share the noise of its reference, so they are `4 T/(T + 3)` independent ones.
fn assert_both_sides(name: &str, films: &[Film], noise: f64, asked: Asked) {
    let n_independent = 36.0 * films.len() as f64 * 16.0 / 7.0;
    told(films, noise, asked).assert_both_sides(&format!("{name}, {}", asked.shape), n_independent);
}

#[test]
fn intervals_hold_at_every_period() {
    for (period_px, noise) in [(50.0, 0.01), (100.0, 0.002), (150.0, 0.01), (200.0, 0.01), (400.0, 0.01)] {
        let films: Vec<Film> = (1..3).map(|seed| Film::wave(period_px, seed)).collect();
        for asked in [AFFINE, AUTO] {
            assert_both_sides(&format!("period {period_px} px"), &films, noise, asked);
        }
    }
}

#[test]
fn a_star_pattern_is_held() {
    let star = |share: f64| Deformation::Star {
        amplitude_px: 0.5 * share,
        row_px: 106.0,
        periods_px: [60.0, 300.0],
        width_px: SIDE_PX as f64,
    };
    let films: Vec<Film> = (1..3).map(|seed| Film::new(star, seed)).collect();
    for asked in [AFFINE, AUTO] {
        assert_both_sides("star", &films, 0.01, asked);
    }
}

#[test]
fn what_is_told_as_rigid_is_stated_as_it_was() {
    let films = [Film::wave(1e6, 1)];
    let [known, asked] =
        [false, true].map(|surfaces_bend| told(&films, 0.01, Asked { surfaces_bend, ..AFFINE }));
    // 36 subsets tell a variance of nothing to `sqrt(2/(36 16/7))` = 16 % of v, three times the affine place's: a fifth of sigma at most.
    let ratio = asked.sigma_px / known.sigma_px;
    assert!((1.0..1.2).contains(&ratio), "{ratio}");
    let turned = |share: f64| {
        let (sin, cos) = (0.1 * share).sin_cos();
        let gradient = [[cos - 1.0, -sin], [sin, cos - 1.0]];
        Deformation::Affine { gradient, centre_px: MIDDLE_PX, shift_px: [1.3 * share, 0.0] }
    };
    assert_both_sides("turned", &[Film::new(turned, 1), Film::new(turned, 2)], 0.01, AFFINE);
}

/// What a reader of the pictures has followed from a place is told as what is followed from the reference.
#[test]
fn a_track_from_a_place_has_its_bends_taken_off_too() {
    let film = Film::wave(100.0, 5);
    let frame = |(number, tones): (u64, &ndarray::Array2<f64>)| {
        counts(tones, 12, 0.005, film.seed, number).unwrap().into_raw_vec_and_offset().0
    };
    let recording = MemoryRecording::new(SIDE_PX, 12, (0..).zip(&film.tones).map(frame).collect());
    let first = ReferenceFrames::Single(0);
    let settings = Settings { surfaces_bend: true, ..Settings::default() };
    for subset in &film.subsets[7..12] {
        let tracks = track(&recording, std::slice::from_ref(subset), &first, &settings, &|_| ()).unwrap();
        let place_px = [subset.x_px, subset.y_px];
        let from = track_from(&recording, subset, &first, &settings, 0..N_FRAMES, place_px).unwrap();
        assert_eq!(tracks[0].positions, from);
    }
}
