//! The methods of tracking that OpenCV brings: optical flow, the enhanced correlation coefficient, phase correlation.

use chainwave_correlation::{FlowSettings, GrayImage};
use opencv::core::{
    CV_32F, Mat, Point2f, Size, TermCriteria, TermCriteria_COUNT, TermCriteria_EPS, Vector, no_array,
};
use opencv::imgproc::{create_hanning_window, phase_correlate};
use opencv::prelude::*;
use opencv::video::{
    MOTION_TRANSLATION, OPTFLOW_USE_INITIAL_FLOW, calc_optical_flow_pyr_lk, find_transform_ecc,
};

/// Halvings of the image above the first.
const PYRAMID_LEVELS: i32 = 3;
/// Least eigenvalue of the window's structure tensor, OpenCV's default.
const MIN_EIGENVALUE: f64 = 1e-4;

/// `calcOpticalFlowPyrLK` (J.-Y. Bouguet, Pyramidal implementation of the Lucas Kanade feature tracker, 2000).
pub(crate) fn flow(
    [width, height]: [usize; 2],
    [still, moved]: [&[u8]; 2],
    from: &[[f64; 2]],
    starts: &[[f64; 2]],
    settings: &FlowSettings,
) -> opencv::Result<Vec<Option<[f64; 2]>>> {
    let points = |places: &[[f64; 2]]| -> Vector<Point2f> {
        places.iter().map(|&[x, y]| Point2f::new(x as f32, y as f32)).collect()
    };
    let (from, mut to) = (points(from), points(starts));
    let (mut status, mut error) = (Vector::<u8>::new(), Vector::<f32>::new());
    let kind = TermCriteria_COUNT + TermCriteria_EPS;
    let [columns, rows] = settings.window_px.map(|side| side as i32);
    calc_optical_flow_pyr_lk(
        &Mat::new_rows_cols_with_data(height as i32, width as i32, still)?,
        &Mat::new_rows_cols_with_data(height as i32, width as i32, moved)?,
        &from,
        &mut to,
        &mut status,
        &mut error,
        Size::new(columns, rows),
        PYRAMID_LEVELS,
        TermCriteria::new(kind, at_most(settings.max_iterations), settings.convergence_px)?,
        OPTFLOW_USE_INITIAL_FLOW,
        MIN_EIGENVALUE,
    )?;
    let place =
        |(point, status): (Point2f, u8)| (status == 1).then(|| [f64::from(point.x), f64::from(point.y)]);
    Ok(to.iter().zip(status.iter()).map(place).collect())
}

/// Side of the Gaussian: no smoothing.
const GAUSSIAN_PX: i32 = 1;
/// Gain of the coefficient below which the iteration stops: that of some 30 mpx on speckles.
const LEAST_GAIN: f64 = 1e-4;
/// Places in a pixel that OpenCV's warp knows: it rounds coordinates to a thirty-second.
const GRID_PER_PX: f64 = 32.0;
/// Steps from such places, which are exact.
const N_LAST_STEPS: usize = 2;

/// `findTransformECC` without OpenCV's smoothing, which mixes other pixels into the edge of the cut template than into the
/// scene's. OpenCV warps by places on a grid, and its steps lead to where the error is the distance from it; so the last ones start
/// on the grid. It gives an error where the iteration does not settle.
pub(crate) fn enhanced_correlation(
    template: GrayImage<'_>,
    scene: GrayImage<'_>,
    start: [f64; 2],
    max_iterations: u32,
) -> opencv::Result<[f64; 2]> {
    let (template, scene) = (image(template)?, image(scene)?);
    let mut corner = step(&template, &scene, start, at_most(max_iterations))?;
    for _ in 0..N_LAST_STEPS {
        let on_grid = corner.map(|value| (value * GRID_PER_PX).round() / GRID_PER_PX);
        corner = step(&template, &scene, on_grid, 1)?;
    }
    Ok(corner)
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

/// Power over that of the noise above which a frequency counts.
const NOISE_TIMES: f64 = 4.0;

/// `phaseCorrelate` (E. De Castro, C. Morandi, IEEE Trans. Pattern Anal. Mach. Intell. 9 (1987) 700-703), both pictures under a Hann
/// window; the centroid of 5 x 5 px at the peak.
pub(crate) fn phase_correlation(
    [still, moved]: [GrayImage<'_>; 2],
    variance: f64,
) -> opencv::Result<[f64; 2]> {
    let (width, height) = (still.width, still.height);
    let mut window = Mat::default();
    create_hanning_window(&mut window, Size::new(width as i32, height as i32), CV_32F)?;
    // OpenCV divides each frequency by its power plus f32's epsilon: scaled so, those where there is noise alone count little.
    // Of a pixel's variance each has the mean square of the window, 9/64.
    let noise = 9.0 / 64.0 * (width * height) as f64 * variance;
    let scale = (f64::from(f32::EPSILON).sqrt() / (NOISE_TIMES * noise)).sqrt() as f32;
    let scaled = |picture: GrayImage<'_>| -> opencv::Result<Mat> {
        let pixels: Vec<f32> = picture.pixels.iter().map(|count| scale * count).collect();
        image(GrayImage { pixels: &pixels, ..picture })
    };
    let shift = phase_correlate(&scaled(still)?, &scaled(moved)?, &window, None)?;
    Ok([shift.x, shift.y])
}

fn at_most(iterations: u32) -> i32 {
    i32::try_from(iterations).unwrap_or(i32::MAX)
}

fn image(picture: GrayImage<'_>) -> opencv::Result<Mat> {
    Mat::new_rows_cols_with_data(picture.height as i32, picture.width as i32, picture.pixels)?.try_clone()
}
