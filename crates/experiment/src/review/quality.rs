//! How well a reading's subset resembles its reference, and how certain its place is, beside its like.

use chainwave_measurement::Position;

use super::blocks::{Blocks, OfEach};
use super::series::Series;

/// Least relative scatter of what is compared here: a subset of 400 pixels tells a variance to no better than that.
const LEAST_SCATTER: f64 = 0.05;
/// Dissimilarity of a reference with itself.
const NOTHING: f64 = 1e-9;

/// Logarithm of what is left of the variance after the match.
pub(super) fn dissimilarity(position: &Position) -> Option<f64> {
    Some((1.0 - position.zncc).max(NOTHING).ln())
}

/// Logarithm of the larger standard uncertainty.
pub(super) fn uncertainty(position: &Position) -> Option<f64> {
    let [x_px, y_px] = Series::sigma_px(position);
    Some(x_px.max(y_px)).filter(|sigma| *sigma > 0.0).map(f64::ln)
}

/// How far each reading lies above its like; 0 below.
pub(super) fn departures(group: &[&Series<'_>], quantity: fn(&Position) -> Option<f64>) -> OfEach {
    let of = |series: &&Series<'_>| -> Vec<Option<f64>> {
        (0..series.n_frames()).map(|frame| series.position(frame).and_then(quantity)).collect()
    };
    let values: OfEach = group.iter().map(of).collect();
    let blocks = Blocks::of(group, &values);
    let departure = |time_s: f64, value: Option<f64>| {
        let [middle, scale] = blocks.at(time_s)?;
        Some(((value? - middle) / scale.max(LEAST_SCATTER)).max(0.0))
    };
    let of_member = |(series, values): (&&Series<'_>, Vec<Option<f64>>)| {
        series.times_s.iter().zip(values).map(|(time_s, value)| departure(*time_s, value)).collect()
    };
    group.iter().zip(values).map(of_member).collect()
}
