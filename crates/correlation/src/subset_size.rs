//! The smallest subset whose noise floor meets an accuracy.

use chainwave_measurement::{Recording, Subset};

use crate::{CorrelationError, PreparedSubset, Reference, ReferenceFrames, Settings, Shape};

/// Least and most pixels on each side of the centre that are considered.
const LEAST_HALF_PX: usize = 5;
const MOST_HALF_PX: usize = 60;

/// Half the width and height of the smallest square subset around a place whose noise floor is at most `error_px` along
/// both axes: `sigma sqrt(1 + 1/m) / sqrt(sum of squared gradients)`, with the noise of a pixel measured in the reference,
/// a mean of m frames. The largest that the frame holds, up to 60 px, where none is good enough.
///
/// # Errors
/// [`CorrelationError::SubsetOutside`] when not even the smallest subset lies in the frame, and as [`Reference::read`].
pub fn smallest_half_px(
    recording: &dyn Recording,
    place_px: [f64; 2],
    reference: &ReferenceFrames,
    error_px: f64,
) -> Result<usize, CorrelationError> {
    let [x_px, y_px] = place_px;
    let subset = |half: usize| Subset {
        name: format!("{x_px} {y_px}"),
        x_px,
        y_px,
        half_width_px: half,
        half_height_px: half,
    };
    let fits = |half: &usize| Reference::check_inside(recording, &subset(*half)).is_ok();
    let most = (LEAST_HALF_PX..=MOST_HALF_PX).rev().find(fits).unwrap_or(LEAST_HALF_PX);
    let reference = Reference::read(recording, &subset(most), reference)?;
    let settings = Settings { shape: Shape::Translation, ..Settings::default() };
    let good = |half: &usize| {
        let prepared = PreparedSubset::new(&reference, &subset(*half), &settings);
        prepared.is_ok_and(|prepared| floor_px(&prepared) <= error_px)
    };
    Ok((LEAST_HALF_PX..most).find(good).unwrap_or(most))
}

/// The noise of the reference and that of a frame, through the subset's gradients.
fn floor_px(subset: &PreparedSubset) -> f64 {
    let frames = subset.n_averaged + 1.0;
    (subset.noise_variance * frames * subset.covariance.largest_signal()).sqrt()
}
