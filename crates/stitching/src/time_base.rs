//! The common time base of all recordings.

use chainwave_measurement::{Observation, median};

/// Multiples of the frame interval that at least one recording covers.
pub(crate) fn common_times(observations: &[Observation], interval_s: f64) -> Vec<f64> {
    let spans = || observations.iter().filter_map(Observation::span_s);
    let first = spans().map(|span| span.0).fold(f64::INFINITY, f64::min);
    let last = spans().map(|span| span.1).fold(f64::NEG_INFINITY, f64::max);
    let (from, to) = ((first / interval_s).ceil() as i64, (last / interval_s).floor() as i64);
    (from..=to).map(|k| k as f64 * interval_s).collect()
}

/// A value rounded to five significant digits: stamps are only as fine as the camera's clock, and a time base of round times
/// can be joined with other tables.
fn rounded(interval_s: f64) -> f64 {
    let scale = 10.0_f64.powi(4 - interval_s.log10().floor() as i32);
    (interval_s * scale).round() / scale
}

/// The median of the recordings' frame intervals, rounded; `None` without recordings of two frames.
pub(crate) fn common_interval_s(observations: &[Observation]) -> Option<f64> {
    let intervals = observations.iter().map(Observation::frame_interval_s);
    median(intervals.filter(|interval_s| interval_s.is_finite()).collect()).map(rounded)
}
