//! Places by OpenCV's enhanced correlation coefficient and by its phase correlation.

use opencv::core::{CV_32F, Mat, Size, TermCriteria, TermCriteria_COUNT, TermCriteria_EPS, no_array};
use opencv::imgproc::{create_hanning_window, phase_correlate};
use opencv::prelude::*;
use opencv::video::{MOTION_TRANSLATION, find_transform_ecc};

use crate::PreparedSubset;
use crate::refine::{REACH_PX, Refine};
use crate::search::Scene;

/// `findTransformECC` (G. D. Evangelidis, E. Z. Psarakis, IEEE Trans. Pattern Anal. Mach. Intell. 30 (2008) 1858-1865):
/// translation, bilinear interpolation, both images smoothed by OpenCV's usual Gaussian of 5 x 5 px.
pub(crate) struct EnhancedCorrelation;

/// Side of the Gaussian, OpenCV's default.
const GAUSSIAN_PX: i32 = 5;

impl Refine for EnhancedCorrelation {
    fn prepare(_: &PreparedSubset) -> Self {
        Self
    }

    fn refine(&self, subset: &PreparedSubset, scene: &Scene, start_px: [f64; 2]) -> Option<[f64; 2]> {
        // OpenCV gives an error where the iteration does not settle.
        maximise(subset, scene, start_px).ok().filter(|place| place.iter().all(|value| value.is_finite()))
    }
}

fn maximise(subset: &PreparedSubset, scene: &Scene, start_px: [f64; 2]) -> opencv::Result<[f64; 2]> {
    let (region, pixels) = scene.pixels();
    let first = [region.x as f64, region.y as f64];
    let [dx, dy] = [0, 1].map(|axis| (start_px[axis] + subset.first_px[axis] - first[axis]) as f32);
    let start = [1.0_f32, 0.0, dx, 0.0, 1.0, dy];
    let mut warp = Mat::new_rows_cols_with_data(2, 3, &start)?.try_clone()?;
    let settings = &subset.settings;
    let iterations = i32::try_from(settings.max_iterations).unwrap_or(i32::MAX);
    let criteria = TermCriteria::new(TermCriteria_COUNT + TermCriteria_EPS, iterations, 1e-7)?;
    find_transform_ecc(
        &image(subset.width, subset.height, &subset.template)?,
        &image(region.width, region.height, pixels)?,
        &mut warp,
        MOTION_TRANSLATION,
        criteria,
        &no_array(),
        GAUSSIAN_PX,
    )?;
    let along = |axis: usize| -> opencv::Result<f64> {
        let shift = f64::from(*warp.at_2d::<f32>(axis as i32, 2)?);
        Ok(shift + first[axis] - subset.first_px[axis])
    };
    Ok([along(0)?, along(1)?])
}

/// `phaseCorrelate` (E. De Castro, C. Morandi, IEEE Trans. Pattern Anal. Mach. Intell. 9 (1987) 700-703) of the subset
/// and the same rectangle of the frame, both under a Hann window; the centroid of 5 x 5 px at the peak.
pub(crate) struct PhaseCorrelation;

impl Refine for PhaseCorrelation {
    fn prepare(_: &PreparedSubset) -> Self {
        Self
    }

    fn refine(&self, subset: &PreparedSubset, scene: &Scene, start_px: [f64; 2]) -> Option<[f64; 2]> {
        // What both rectangles show counts, so they are laid over each other anew while they are a pixel apart.
        const TIMES: usize = 3;
        let mut place = start_px;
        for _ in 0..TIMES {
            let corner = [0, 1].map(|axis| place[axis].round() + subset.first_px[axis].round());
            let part = scene.part([corner[0] as i64, corner[1] as i64], subset.width, subset.height)?;
            let shift = shift(subset, &part).ok()?;
            place = [0, 1].map(|axis| corner[axis] - subset.first_px[axis] + shift[axis]);
            if shift.iter().all(|shift| shift.abs() <= 0.5) {
                break;
            }
        }
        let near = |axis: usize| (place[axis] - start_px[axis]).abs() <= REACH_PX as f64;
        (near(0) && near(1)).then_some(place)
    }
}

fn shift(subset: &PreparedSubset, part: &[f32]) -> opencv::Result<[f64; 2]> {
    let (width, height) = (subset.width, subset.height);
    let mut window = Mat::default();
    create_hanning_window(&mut window, Size::new(width as i32, height as i32), CV_32F)?;
    let shift = phase_correlate(
        &image(width, height, &subset.template)?,
        &image(width, height, part)?,
        &window,
        None,
    )?;
    Ok([shift.x, shift.y])
}

fn image(width: usize, height: usize, values: &[f32]) -> opencv::Result<Mat> {
    Mat::new_rows_cols_with_data(height as i32, width as i32, values)?.try_clone()
}
