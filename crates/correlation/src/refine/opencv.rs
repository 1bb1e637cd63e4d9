//! Places by OpenCV's enhanced correlation coefficient and by its phase correlation.

use opencv::core::{CV_32F, Mat, Size, TermCriteria, TermCriteria_COUNT, TermCriteria_EPS, no_array};
use opencv::imgproc::{create_hanning_window, phase_correlate};
use opencv::prelude::*;
use opencv::video::{MOTION_TRANSLATION, find_transform_ecc};

use crate::refine::Refine;
use crate::search::area::SearchArea;
use crate::simd::LANES;
use crate::warp::Warp;
use crate::window::sample::sample;
use crate::{PreparedSubset, Window};

/// `findTransformECC` (G. D. Evangelidis, E. Z. Psarakis, IEEE Trans. Pattern Anal. Mach. Intell. 30 (2008) 1858-1865):
/// translation, bilinear interpolation, without OpenCV's smoothing, which mixes other pixels into the edge of the cut subset
/// than into the frame's. OpenCV warps by places on a grid, and its steps lead to where the error is the distance from it;
/// so the last ones start on the grid.
pub(crate) struct EnhancedCorrelation;

/// Side of the Gaussian: no smoothing.
const GAUSSIAN_PX: i32 = 1;
/// Gain of the coefficient below which the iteration stops: that of some 30 mpx on speckles.
const LEAST_GAIN: f64 = 1e-4;
/// Places in a pixel that OpenCV's warp knows: it rounds coordinates to a thirty-second.
const GRID_PER_PX: f64 = 32.0;
/// Steps from such places, which are exact.
const N_LAST_STEPS: usize = 2;

impl Refine for EnhancedCorrelation {
    fn prepare(_: &PreparedSubset) -> Self {
        Self
    }

    fn refine(&self, subset: &PreparedSubset, scene: &SearchArea, start_px: [f64; 2]) -> Option<[f64; 2]> {
        // OpenCV gives an error where the iteration does not settle.
        maximise(subset, scene, start_px).ok().filter(|place| place.iter().all(|value| value.is_finite()))
    }
}

fn maximise(subset: &PreparedSubset, scene: &SearchArea, start_px: [f64; 2]) -> opencv::Result<[f64; 2]> {
    let (region, pixels) = scene.pixels();
    let first = [region.x as f64, region.y as f64];
    let template = image(subset.width, subset.height, &subset.template)?;
    let scene = image(region.width, region.height, pixels)?;
    let iterations = i32::try_from(subset.settings.max_iterations).unwrap_or(i32::MAX);
    let near = [0, 1].map(|axis| start_px[axis] + subset.first_px[axis] - first[axis]);
    let mut corner = step(&template, &scene, near, iterations)?;
    for _ in 0..N_LAST_STEPS {
        let on_grid = corner.map(|value| (value * GRID_PER_PX).round() / GRID_PER_PX);
        corner = step(&template, &scene, on_grid, 1)?;
    }
    Ok([0, 1].map(|axis| corner[axis] + first[axis] - subset.first_px[axis]))
}

/// The place of the template's first pixel in the scene after so many steps.
fn step(template: &Mat, scene: &Mat, [x, y]: [f64; 2], iterations: i32) -> opencv::Result<[f64; 2]> {
    let start = [1.0, 0.0, x as f32, 0.0, 1.0, y as f32];
    let mut warp = Mat::new_rows_cols_with_data(2, 3, &start)?.try_clone()?;
    let criteria = TermCriteria::new(TermCriteria_COUNT + TermCriteria_EPS, iterations, LEAST_GAIN)?;
    find_transform_ecc(template, scene, &mut warp, MOTION_TRANSLATION, criteria, &no_array(), GAUSSIAN_PX)?;
    let along = |axis: i32| -> opencv::Result<f64> { Ok(f64::from(*warp.at_2d::<f32>(axis, 2)?)) };
    Ok([along(0)?, along(1)?])
}

/// `phaseCorrelate` (E. De Castro, C. Morandi, IEEE Trans. Pattern Anal. Mach. Intell. 9 (1987) 700-703) of the subset and as
/// much of the frame, both under a Hann window; the centroid of 5 x 5 px at the peak.
///
/// That centroid is not the shift but some multiple of it, which depends on the noise. So the frame is sampled anew where
/// the shift leads, until there is none (the repeated passes of particle image velocimetry: M. Raffel et al., Particle
/// Image Velocimetry, 3rd ed., 2018, section 5.3.4.3), the multiple being that of the last pass.
pub(crate) struct PhaseCorrelation;

/// Power over that of the noise, and of what the window's edge makes of the contrast, above which a frequency counts.
const NOISE_TIMES: f64 = 4.0;
/// Variance of the latter over that of the grey values.
const EDGE_SHARE: f64 = 0.1;
/// Passes at most, and the shift that ends them.
const N_PASSES: usize = 12;
const NO_SHIFT_PX: f64 = 1e-3;
/// Multiples of a shift that are taken for one.
const MULTIPLES: [f64; 2] = [0.5, 4.0];

impl Refine for PhaseCorrelation {
    fn prepare(_: &PreparedSubset) -> Self {
        Self
    }

    fn refine(&self, subset: &PreparedSubset, scene: &SearchArea, start_px: [f64; 2]) -> Option<[f64; 2]> {
        let (region, pixels) = scene.pixels();
        let window = Window::new(region, pixels, subset.settings.interpolation).ok()?;
        let (mut rows, mut samples) = (Vec::new(), vec![0.0; subset.n_pixels() + LANES]);
        let (mut place, mut before, mut multiple) = (start_px, None, [1.0; 2]);
        for _ in 0..N_PASSES {
            let warp = Warp::at(place);
            if !subset.fits(&window, &warp) {
                return None;
            }
            sample(&window, &warp, subset.lattice(), &mut rows, &mut samples);
            let shift = shift(subset, &samples[..subset.n_pixels()]).ok()?;
            if shift.iter().all(|shift| shift.abs() <= NO_SHIFT_PX) {
                return Some(place);
            }
            if let Some((place_before, shift_before)) = before.replace((place, shift)) {
                multiple = [0, 1].map(|axis| {
                    let step: f64 = place[axis] - place_before[axis];
                    let [least, most] = MULTIPLES;
                    let found = (shift_before[axis] - shift[axis]) / step;
                    if found.is_finite() { found.clamp(least, most) } else { multiple[axis] }
                });
            }
            place = [0, 1].map(|axis| place[axis] + shift[axis] / multiple[axis]);
        }
        None
    }
}

/// The shift of a part of a frame, in counts.
fn shift(subset: &PreparedSubset, part: &[f32]) -> opencv::Result<[f64; 2]> {
    let (width, height) = (subset.width, subset.height);
    let mut window = Mat::default();
    create_hanning_window(&mut window, Size::new(width as i32, height as i32), CV_32F)?;
    // OpenCV divides each frequency by its power plus f32's epsilon: scaled so, those where there is noise alone count little.
    // Of a pixel's variance each has the mean square of the window, 9/64.
    let contrast = subset.signal_energy / subset.n_used as f64;
    let variance = subset.noise_variance + EDGE_SHARE * contrast;
    let noise = 9.0 / 64.0 * (width * height) as f64 * variance;
    let scale = (f64::from(f32::EPSILON).sqrt() / (NOISE_TIMES * noise)).sqrt() as f32;
    let scaled = |values: &[f32]| -> opencv::Result<Mat> {
        let values: Vec<f32> = values.iter().map(|value| scale * value).collect();
        image(width, height, &values)
    };
    let shift = phase_correlate(&scaled(&subset.template)?, &scaled(part)?, &window, None)?;
    Ok([shift.x, shift.y])
}

fn image(width: usize, height: usize, values: &[f32]) -> opencv::Result<Mat> {
    Mat::new_rows_cols_with_data(height as i32, width as i32, values)?.try_clone()
}
