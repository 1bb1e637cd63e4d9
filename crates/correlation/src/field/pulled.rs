//! Points that something in a part of their subset pulls, widened by how far their neighbours say.
//!
//! What covers a part of a subset and looks like it pulls the match by little: by half a pixel with a sigma of a twentieth where it has the same texture. The
//! match shows that in its residuals, and not by how much; the points around show how much, and not whose fault it is. Both together tell.
//!
//! A point is foretold by pairs of points on both sides of it, by the cubic through their places and gradients, so that no bend of a field as long as some
//! steps counts as a departure; where too few are seen on both sides, by the place and gradient of each. Where the median of these is farther off than noise explains, and the point's residuals are more than noise, what it is off by
//! joins its sigma.

use chainwave_measurement::{Estimate, median};

use crate::field::pair::Settled;
use crate::field::shape_error::grid::Grid;
use crate::field::shape_error::seen::Residuals;
use crate::icgn::outcome::Match;

/// Offsets of one point of each pair, in columns and rows: half of those up to two steps away.
const OFFSETS: [[i64; 2]; 12] =
    [[1, 0], [0, 1], [1, 1], [1, -1], [2, 0], [0, 2], [2, 1], [1, 2], [2, -1], [1, -2], [2, 2], [2, -2]];
/// Pairs from which on a point is foretold.
const LEAST_PAIRS: usize = 3;
/// Single points from which on it is, where pairs are too few.
const LEAST_SINGLES: usize = 4;
/// Standard deviation of normal numbers over the median of their absolute values.
const OF_MEDIAN: f64 = 1.4826;

/// Widens the sigmas of points that are pulled.
pub(crate) fn widen_pulled(
    settled: &mut [Option<Settled>],
    places: &[[f64; 2]],
    n_columns: usize,
    step_px: f64,
    side_px: f64,
) {
    let residuals = Residuals::of(settled, side_px);
    let grid = Grid { n_columns, n_rows: places.len() / n_columns, step_px };
    let readings: Vec<Option<Reading>> = settled
        .iter()
        .zip(places)
        .map(|(one, place)| match one {
            Some((Ok(found), _)) => Some(Reading::of(found, *place, residuals.are_noise_alone(found))),
            _ => None,
        })
        .collect();
    for (point, one) in settled.iter_mut().enumerate() {
        let (Some((Ok(found), _)), Some(own)) = (one, &readings[point]) else { continue };
        if own.is_clean {
            continue;
        }
        // Alone, it may be off by all that its residuals leave.
        let Some(foretold) = foretold(grid, &readings, point, step_px, side_px) else {
            *found =
                found.with_error(residuals.left_at_most_px(found).map(|most_px| most_px / 3.0_f64.sqrt()));
            continue;
        };
        let position = &mut found.position;
        for (axis, estimate) in [&mut position.x_px, &mut position.y_px].into_iter().enumerate() {
            let beyond = (own.u_px[axis] - foretold[axis].value).powi(2);
            let by_noise = estimate.sigma.powi(2) + foretold[axis].sigma.powi(2);
            if beyond > by_noise {
                *estimate =
                    Estimate::new(estimate.value, (estimate.sigma.powi(2) + beyond - by_noise).sqrt());
            }
        }
    }
}

/// What a point of the field says.
struct Reading {
    u_px: [f64; 2],
    sigma_px: [f64; 2],
    /// du/dx, du/dy, dv/dx, dv/dy.
    gradient: [f64; 4],
    /// Whether its whole subset leaves nothing but noise.
    is_clean: bool,
}

impl Reading {
    fn of(found: &Match, place_px: [f64; 2], leaves_noise_alone: bool) -> Self {
        let [x, y] = [found.position.x_px, found.position.y_px];
        Self {
            u_px: [x.value - place_px[0], y.value - place_px[1]],
            sigma_px: [x.sigma, y.sigma],
            gradient: found.gradient,
            is_clean: found.is_whole && leaves_noise_alone,
        }
    }

    /// Change of a displacement along an offset.
    fn along(&self, axis: usize, [x, y]: [f64; 2]) -> f64 {
        self.gradient[2 * axis] * x + self.gradient[2 * axis + 1] * y
    }
}

/// The displacement of a point along both axes by what is around it, with how far that scatters: by pairs where there are enough, clean ones before
/// others, else by single points.
fn foretold(
    grid: Grid,
    readings: &[Option<Reading>],
    point: usize,
    step_px: f64,
    side_px: f64,
) -> Option<[Estimate; 2]> {
    let there = |offset: [i64; 2]| readings[grid.at(point, offset)?].as_ref();
    let in_px = |offset: [i64; 2]| offset.map(|steps| steps as f64 * step_px);
    let mut pairs: Vec<([f64; 2], [&Reading; 2])> = Vec::with_capacity(OFFSETS.len());
    let mut singles: Vec<([f64; 2], &Reading)> = Vec::with_capacity(2 * OFFSETS.len());
    for offset in OFFSETS {
        let back = offset.map(|steps| -steps);
        let beside = [there(back), there(offset)];
        if let [Some(before), Some(behind)] = beside {
            pairs.push((in_px(offset), [before, behind]));
        }
        let here = [back, offset].into_iter().zip(beside);
        singles.extend(here.filter_map(|(offset, reading)| Some((in_px(offset), reading?))));
    }
    let by_pairs = |is_used: &dyn Fn(&Reading) -> bool| {
        let used = pairs.iter().filter(|(_, both)| both.iter().all(|one| is_used(one)));
        let of_axis = |axis: usize| {
            let foretold = |(offset, [before, behind]): &([f64; 2], [&Reading; 2])| {
                let mean = 0.5 * (before.u_px[axis] + behind.u_px[axis]);
                let bend = 0.25 * (before.along(axis, *offset) - behind.along(axis, *offset));
                [mean + bend, 0.5 * before.sigma_px[axis].hypot(behind.sigma_px[axis])]
            };
            middle(&used.clone().map(foretold).collect::<Vec<_>>(), LEAST_PAIRS)
        };
        Some([of_axis(0)?, of_axis(1)?])
    };
    let by_singles = |is_used: &dyn Fn(&Reading) -> bool| {
        let used = singles.iter().filter(|(_, one)| is_used(one));
        let of_axis = |axis: usize| {
            let foretold = |(offset, one): &([f64; 2], &Reading)| {
                // A gradient is as certain as that of a line through the pixels of a side.
                let reach = 12.0_f64.sqrt() * offset[0].hypot(offset[1]) / side_px;
                [one.u_px[axis] - one.along(axis, *offset), one.sigma_px[axis] * 1.0_f64.hypot(reach)]
            };
            middle(&used.clone().map(foretold).collect::<Vec<_>>(), LEAST_SINGLES)
        };
        Some([of_axis(0)?, of_axis(1)?])
    };
    let (clean, all) = (|one: &Reading| one.is_clean, |_: &Reading| true);
    by_pairs(&clean).or_else(|| by_singles(&clean)).or_else(|| by_pairs(&all)).or_else(|| by_singles(&all))
}

/// The median of some values, each with its noise, and how uncertain it is; none of fewer than so many.
fn middle(values: &[[f64; 2]], least: usize) -> Option<Estimate> {
    if values.len() < least {
        return None;
    }
    let of = |part: usize| values.iter().map(move |value| value[part]);
    let middle = median(of(0).collect())?;
    let scatter = OF_MEDIAN * median(of(0).map(|value| (value - middle).abs()).collect())?;
    Some(Estimate::new(middle, scatter.hypot(median(of(1).collect())?)))
}
