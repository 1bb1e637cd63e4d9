//! Weak, sparse and coarse textures: sigma is the scatter of the readings wherever a subset is not refused.
//!
//! The pictures are drawn in closed form by a renderer that knows no matcher.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stdout, reason = "what each case gave is a table to be read")]

mod support;

use std::num::NonZero;

use chainwave_correlation::{
    FieldGrid, Reference, ReferenceFrames, Settings, Shape, ShapeChoice, Window, correlate, track,
};
use chainwave_measurement::Region;
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture};
use ndarray::Array2;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use support::{SIZE, recorded, rms, subset};

const MIDDLE_PX: [f64; 2] = [209.5, 209.5];
const AFFINE: ShapeChoice = ShapeChoice::Named(Shape::Affine);
const TRANSLATION: ShapeChoice = ShapeChoice::Named(Shape::Translation);
const AUTO: ShapeChoice = ShapeChoice::ByEvidence;
const SHIFT: Deformation =
    Deformation::Affine { gradient: [[0.0; 2]; 2], centre_px: MIDDLE_PX, shift_px: [0.3, -0.2] };
const STRAIN: Deformation = Deformation::Affine {
    gradient: [[0.004, 0.001], [-0.002, -0.003]],
    centre_px: MIDDLE_PX,
    shift_px: [0.3, -0.2],
};

/// Spots of a diameter scattered by chance, one on so many square pixels: of 17 x 17 px subsets with one on 250 many show a lone one.
fn sparse(seed: u64, diameter_px: f64, area_of_one_px2: f64) -> Texture {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let n = (SIZE[0] as f64 + 80.0).powi(2) / area_of_one_px2;
    let mut place = || random.random_range(-40.0..SIZE[0] as f64 + 40.0);
    let places: Vec<[f64; 2]> = (0..n as usize).map(|_| [place(), place()]).collect();
    Texture::spots(&places, diameter_px)
}

fn dense(seed: u64, diameter_px: f64) -> Texture {
    Texture::speckles(seed, diameter_px, MIDDLE_PX, [250.0; 2])
}

/// A texture before and after its deformation, without noise.
struct Pictures {
    deformation: Deformation,
    tones: [Array2<f64>; 2],
    seed: u64,
}

/// Error and sigma.
type Errors = Vec<[f64; 2]>;

impl Pictures {
    fn new(texture: Texture, deformation: Deformation, seed: u64) -> Self {
        let still = Surface::everywhere(texture, Deformation::NONE);
        let before = picture(SIZE, std::slice::from_ref(&still)).unwrap();
        let after = picture(SIZE, &[still.deformed(deformation)]).unwrap();
        Self { deformation, tones: [before, after], seed }
    }

    /// The picture before (0) or after (each other number), with a part of its contrast.
    fn counts(&self, contrast: f64, noise: f64, number: u64) -> Vec<f32> {
        let faded = self.tones[usize::from(number > 0)].mapv(|tone| 0.5 + contrast * (tone - 0.6));
        counts(&faded, 12, noise, self.seed, number).unwrap().into_raw_vec_and_offset().0
    }

    /// Errors of the points of a field whose subsets lie side by side.
    fn field(&self, [contrast, noise]: [f64; 2], half_px: usize, choice: ShapeChoice) -> Errors {
        let whole = Region::whole(SIZE[0], SIZE[1]);
        let settings = Settings::default();
        let before = self.counts(contrast, noise, 0);
        let reference = Reference::new(whole, before, 1).unwrap().saturating_at(4095.0);
        let target = Window::new(whole, &self.counts(contrast, noise, 1), settings.interpolation).unwrap();
        let grid = FieldGrid { step_px: 2 * half_px + 1, half_px };
        let one = NonZero::<usize>::MIN;
        let field = correlate(&reference, &target, grid, &settings, choice, one, &|_| ()).unwrap();
        let mut errors = Vec::new();
        for point in &field.points {
            let Ok(found) = &point.found else { continue };
            let truth = self.deformation.displaced_px([point.x_px, point.y_px]);
            for (axis, found) in [found.position.x_px, found.position.y_px].into_iter().enumerate() {
                errors.push([found.value - truth[axis], found.sigma]);
            }
        }
        errors
    }

    /// Errors of subsets side by side that are followed through two frames.
    fn tracks(&self, [contrast, noise]: [f64; 2], half_px: usize, shape: Shape) -> Errors {
        let film = recorded((0..3).map(|number| self.counts(contrast, noise, number)).collect());
        let line = || (half_px + 8..SIZE[0] - half_px - 8).step_by(4 * half_px);
        let places = line().flat_map(|y| line().map(move |x| subset(x as f64, y as f64, half_px)));
        let subsets: Vec<_> = places.collect();
        let settings = Settings { shape, ..Settings::default() };
        let tracks = track(&film, &subsets, &ReferenceFrames::Single(0), &settings, &|_| ()).unwrap();
        let mut errors = Vec::new();
        for (subset, track) in subsets.iter().zip(&tracks) {
            let truth = self.deformation.displaced_px([subset.x_px, subset.y_px]);
            for found in track.positions[1..].iter().flatten() {
                for (axis, found) in [found.x_px, found.y_px].into_iter().enumerate() {
                    errors.push([found.value - truth[axis], found.sigma]);
                }
            }
        }
        errors
    }
}

/// Share of the errors that are independent: two frames share their reference, and both axes of a lone spot its direction.
const INDEPENDENT: f64 = 0.5;

/// 93 to 97 % of errors lie within 1.96 sigma, and the rms of error over sigma is 1; beyond that two standard errors of both are left. A
/// subset's own sigma is known to 40 % at worst, and to half of that on average, which adds at most an eighth to the latter.
fn assert_holds(name: &str, errors: &Errors) {
    let pulls: Vec<f64> = errors.iter().map(|[error, sigma]| error / sigma).collect();
    let n = pulls.len() as f64;
    let inside = pulls.iter().filter(|pull| pull.abs() < 1.96).count() as f64 / n;
    let mut sigmas: Vec<f64> = errors.iter().map(|[_, sigma]| *sigma).collect();
    sigmas.sort_by(f64::total_cmp);
    let (median, pull) = (sigmas[pulls.len() / 2], rms(&pulls));
    // the rms of the errors in the sharper half and in the other, over that of their sigmas
    let halves = [false, true].map(|upper| {
        let half: Vec<&[f64; 2]> = errors.iter().filter(|[_, sigma]| (*sigma > median) == upper).collect();
        let of = |i: usize| rms(&half.iter().map(|pair| pair[i]).collect::<Vec<_>>());
        of(0) / of(1)
    });
    println!(
        "| {name} | {} | {:.1} % | {:.1} mpx | {pull:.2} | {:.2}, {:.2} |",
        pulls.len(),
        100.0 * inside,
        1e3 * median,
        halves[0],
        halves[1]
    );
    let independent = INDEPENDENT * n;
    let off = 0.02 + 2.0 * (0.95 * 0.05 / independent).sqrt();
    assert!((inside - 0.95).abs() < off, "{name}: {inside}");
    assert!((pull - 1.0).abs() < 0.125 + 2.0 * (2.0 * independent).sqrt().recip(), "{name}: {pull}");
}

/// Contrasts and noises from sharp to where nearly nothing is left, as shares of full scale.
type Ladder = [[f64; 2]; 3];
/// Errors from which on a case tells something.
const LEAST_ERRORS: usize = 60;

fn hold(name: &str, textures: [Texture; 2], half_px: usize, ladder: Ladder) {
    let [first, second] = textures;
    let (strained, moved) = (Pictures::new(first, STRAIN, 1), Pictures::new(second, SHIFT, 2));
    for scene in ladder {
        let named = format!("{name}, {} contrast, {} % noise", scene[0], 100.0 * scene[1]);
        let cases = [
            ("affine field", strained.field(scene, half_px, AFFINE)),
            ("auto field", strained.field(scene, half_px, AUTO)),
            ("translation field", moved.field(scene, half_px, TRANSLATION)),
            ("affine track", strained.tracks(scene, half_px, Shape::Affine)),
            ("translation track", moved.tracks(scene, half_px, Shape::Translation)),
        ];
        for (case, errors) in cases {
            if errors.len() < LEAST_ERRORS {
                println!("| {named}: {case} | {} |", errors.len());
            } else {
                assert_holds(&format!("{named}: {case}"), &errors);
            }
        }
    }
}

#[test]
fn speckles_that_fade() {
    hold(
        "speckles of 4.5 px in 17 px",
        [dense(11, 4.5), dense(12, 4.5)],
        8,
        [[1.0, 0.002], [0.4, 0.01], [0.06, 0.002]],
    );
}

#[test]
fn coarse_speckles_that_fade() {
    hold(
        "speckles of 9 px in 25 px",
        [dense(13, 9.0), dense(14, 9.0)],
        12,
        [[1.0, 0.002], [1.0, 0.01], [0.1, 0.002]],
    );
}

#[test]
fn lone_spots_that_fade() {
    hold(
        "one spot on 250 px2 in 17 px",
        [sparse(15, 4.5, 250.0), sparse(16, 4.5, 250.0)],
        8,
        [[1.0, 0.002], [0.5, 0.002], [0.1, 0.0005]],
    );
}
