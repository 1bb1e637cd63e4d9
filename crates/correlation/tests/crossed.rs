//! Fields that a crack runs through, or in which an object appears: points beside it are right and known as well as elsewhere, and those whose
//! subsets it crosses are right, or say how little they know.
//!
//! The pictures are drawn in closed form by a renderer that knows no matcher.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::num::NonZero;

use chainwave_correlation::{
    Field, FieldGrid, FieldPoint, Reference, Settings, Shape, ShapeChoice, Window, correlate,
};
use chainwave_measurement::Region;
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture};

const SIZE_PX: [usize; 2] = [360, 320];
const MIDDLE_PX: [f64; 2] = [179.5, 159.5];
const GRID: FieldGrid = FieldGrid { step_px: 8, half_px: 16 };
const AFFINE: ShapeChoice = ShapeChoice::Named(Shape::Affine);
/// The row that the crack runs above, and what both sides move by.
const CRACK_ROW: usize = 160;
const SHIFT_PX: f64 = 1.5;

/// A speckled plane that has moved.
fn plane(seed: u64, shift_px: [f64; 2]) -> ndarray::Array2<f64> {
    let texture = Texture::speckles(seed, 4.5, MIDDLE_PX, [220.0; 2]);
    let moved = Deformation::rigid(MIDDLE_PX, 0.0, shift_px);
    picture(SIZE_PX, &[Surface::everywhere(texture, Deformation::NONE).deformed(moved)]).unwrap()
}

fn field(pictures: [&ndarray::Array2<f64>; 2], noise: f64, choice: ShapeChoice, n_threads: usize) -> Field {
    let [before, after] = [(pictures[0], 0), (pictures[1], 1)]
        .map(|(tones, number)| counts(tones, 12, noise, 5, number).unwrap().into_raw_vec_and_offset().0);
    let whole = Region::whole(SIZE_PX[0], SIZE_PX[1]);
    let settings = Settings::default();
    let reference = Reference::new(whole, before, 1).unwrap();
    let target = Window::new(whole, &after, settings.interpolation).unwrap();
    let n_threads = NonZero::new(n_threads).unwrap();
    correlate(&reference, &target, GRID, &settings, choice, n_threads, &|_| ()).unwrap()
}

/// A plane of which the upper half has moved up, and the lower half down.
fn torn(seed: u64) -> [ndarray::Array2<f64>; 2] {
    let mut after = plane(seed, [0.0, -SHIFT_PX]);
    let below = plane(seed, [0.0, SHIFT_PX]);
    let rows = ndarray::s![CRACK_ROW.., ..];
    after.slice_mut(rows).assign(&below.slice(rows));
    [plane(seed, [0.0; 2]), after]
}

/// Error and sigma along y of a point beside the crack, and how far its centre is from the crack.
fn beside(point: &FieldPoint) -> Option<[f64; 3]> {
    let found = point.found.as_ref().ok()?.position.y_px;
    let from_crack = point.y_px - (CRACK_ROW as f64 - 0.5);
    Some([found.value - point.y_px - SHIFT_PX.copysign(from_crack), found.sigma, from_crack.abs()])
}

/// Subsets of 33 px that end 3 px and more from the crack see nothing of it, and polynomials through neighbours across it say nothing of them.
#[test]
fn subsets_that_end_before_a_crack_are_as_good_as_elsewhere() {
    for (noise, seed) in [(0.005, 1), (0.02, 2), (0.02, 3)] {
        let [before, after] = torn(seed);
        let field = field([&before, &after], noise, AFFINE, 1);
        let of = |from: f64, to: f64| -> Vec<[f64; 2]> {
            let within =
                |[error, sigma, away]: [f64; 3]| (from..to).contains(&away).then_some([error, sigma]);
            field.points.iter().filter_map(beside).filter_map(within).collect()
        };
        let (near, far) = (of(19.0, 31.0), of(60.0, 200.0));
        let median = |errors: &[[f64; 2]]| {
            let mut sigmas: Vec<f64> = errors.iter().map(|[_, sigma]| *sigma).collect();
            sigmas.sort_by(f64::total_cmp);
            sigmas[sigmas.len() / 2]
        };
        let n_wrong = near.iter().filter(|[error, sigma]| error.abs() > 5.0 * sigma).count();
        let inside = near.iter().filter(|[error, sigma]| error.abs() < 1.96 * sigma).count() as f64;
        let inside = inside / near.len() as f64;
        let wider = median(&near) / median(&far);
        println!(
            "{noise}: {} points, {n_wrong} wrong, {:.1} % of 95, sigma {wider:.2}",
            near.len(),
            100.0 * inside
        );
        assert!(near.len() > 100, "{}", near.len());
        assert_eq!(n_wrong, 0, "{noise}");
        // Some twenty subsets lie side by side along both sides: two standard errors of their share, and what is claimed of intervals.
        assert!(inside > 0.83, "{noise}: {inside}");
        // Textures differ by a fifth; what polynomials across the crack had left was five times the noise.
        assert!(wider < 1.5, "{noise}: {wider}");
    }
}

#[test]
fn subsets_that_a_crack_crosses_are_right_or_say_how_little_they_know() {
    for (noise, choice, seed) in [
        (0.005, AFFINE, 1),
        (0.02, AFFINE, 2),
        (0.005, ShapeChoice::ByEvidence, 1),
        (0.02, ShapeChoice::ByEvidence, 2),
    ] {
        let [before, after] = torn(seed);
        let field = field([&before, &after], noise, choice, 1);
        // The rows next to the crack are in neither half, or in both.
        let errors: Vec<[f64; 3]> =
            field.points.iter().filter_map(beside).filter(|[.., away]| *away > 3.0).collect();
        let is_wrong = |[error, sigma, _]: &&[f64; 3]| error.abs() > 0.5 && error.abs() > 5.0 * sigma;
        let n_wrong = errors.iter().filter(is_wrong).count();
        let n_crossed = errors.iter().filter(|[.., away]| *away < 16.0).count();
        println!("{noise}, {choice}: {n_wrong} wrong of {n_crossed} crossed");
        assert!(n_crossed > 100);
        // Of some 150 that are crossed a quarter had been; by quadratic ones few still are.
        assert!(n_wrong * 20 < n_crossed, "{noise}, {choice}: {n_wrong} of {n_crossed}");
    }
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let [before, after] = torn(4);
    let of_one = field([&before, &after], 0.02, AFFINE, 1);
    assert_eq!(field([&before, &after], 0.02, AFFINE, 3), of_one);
}

/// Waves leave as much in the residuals as cracks do, and are no cracks.
#[test]
fn what_bends_is_not_taken_for_crossed() {
    let texture = Texture::speckles(6, 4.5, MIDDLE_PX, [220.0; 2]);
    let surface = Surface::everywhere(texture, Deformation::NONE);
    let wave = Deformation::Wave { amplitude_px: [0.0, 0.5], along: [1.0, 0.0], period_px: 70.0 };
    let [before, after] =
        [surface.clone(), surface.deformed(wave)].map(|surface| picture(SIZE_PX, &[surface]).unwrap());
    let field = field([&before, &after], 0.002, AFFINE, 1);
    let pull = |point: &FieldPoint| {
        let found = point.found.as_ref().ok()?.position.y_px;
        let [_, truth] = wave.displaced_px([point.x_px, point.y_px]);
        Some([found.value - truth, found.sigma])
    };
    let errors: Vec<[f64; 2]> = field.points.iter().filter_map(pull).collect();
    let n = errors.len() as f64;
    let inside = errors.iter().filter(|[error, sigma]| error.abs() < 1.96 * sigma).count() as f64 / n;
    let rms_px = (errors.iter().map(|[error, _]| error * error).sum::<f64>() / n).sqrt();
    println!("{:.1} % of 95, {rms_px:.4} px", 100.0 * inside);
    // Some seventy subsets side by side; taken for crossed, three in ten had been inside.
    assert!(inside > 0.88, "{inside}");
    // What affine subsets leave of such a wave, a seventh of its amplitude at the crests, with what is taken off.
    assert!(rms_px < 0.07, "{rms_px}");
}
