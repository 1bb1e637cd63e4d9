//! Readings that their neighbours in time do not lead to, from either side.
//!
//! A wrong reading spoils what is foretold of its neighbours too. So a reading is held against three forecasts, from the two frames before,
//! the two after, and one of each and their neighbours; one that any of them leads to is no spike. A body that is elsewhere for long is told by
//! the other trials.

use super::blocks::{Blocks, OfEach};
use super::series::Series;

/// Frames and weights of a forecast.
type Forecast = &'static [(isize, f64)];

const FORECASTS: [Forecast; 3] = [
    &[(-1, 2.0), (-2, -1.0)],
    &[(1, 2.0), (2, -1.0)],
    &[(-2, -1.0 / 6.0), (-1, 2.0 / 3.0), (1, 2.0 / 3.0), (2, -1.0 / 6.0)],
];

/// How far each reading lies from the forecast that suits it best.
pub(super) fn departures(group: &[&Series<'_>]) -> OfEach {
    let of_axis = |axis: usize| FORECASTS.map(|forecast| by_forecast(group, forecast, axis));
    let axes = [of_axis(0), of_axis(1)];
    let least = |member: usize, frame: usize, axis: usize| {
        let found = axes[axis].iter().filter_map(|forecast| forecast[member][frame]);
        found.min_by(f64::total_cmp)
    };
    let of_frame = |member: usize, frame: usize| {
        let (x, y) = (least(member, frame, 0)?, least(member, frame, 1)?);
        Some(x.max(y))
    };
    let of_member = |(member, series): (usize, &&Series<'_>)| {
        (0..series.n_frames()).map(|frame| of_frame(member, frame)).collect()
    };
    group.iter().enumerate().map(of_member).collect()
}

/// How far each reading lies from one forecast along one axis.
fn by_forecast(group: &[&Series<'_>], forecast: Forecast, axis: usize) -> OfEach {
    let miss = |series: &Series<'_>, frame: usize| {
        let mut miss_px = series.displacement_px(frame)?[axis];
        for (step, weight) in forecast {
            miss_px -= weight * series.displacement_px(frame.checked_add_signed(*step)?)?[axis];
        }
        Some(miss_px)
    };
    let of = |series: &&Series<'_>| -> Vec<Option<f64>> {
        (0..series.n_frames()).map(|frame| miss(series, frame)).collect()
    };
    let values: OfEach = group.iter().map(of).collect();
    let blocks = Blocks::of(group, &values);
    let departure = |series: &Series<'_>, frame: usize, value: Option<f64>| {
        let [middle, scale] = blocks.at(series.times_s[frame])?;
        let sigma = Series::sigma_px(series.position(frame)?)[axis];
        Some((value? - middle).abs() / scale.hypot(sigma))
    };
    let of_member = |(series, values): (&&Series<'_>, Vec<Option<f64>>)| {
        values.into_iter().enumerate().map(|(frame, value)| departure(series, frame, value)).collect()
    };
    group.iter().zip(values).map(of_member).collect()
}
