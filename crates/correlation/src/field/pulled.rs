//! Points that something in a part of their subset pulls, widened by how far their neighbours say.
//!
//! What covers a part of a subset and looks like it pulls the match by little: by half a pixel with a sigma of a twentieth where it has the
//! same texture. The match shows that in its residuals, and not by how much; the points around show how much, and not whose fault it is. Both
//! together tell.
//!
//! A point is foretold by pairs of points on both sides of it, by the cubic through their places and gradients, so that no bend of a field as
//! long as some steps counts as a departure; where too few are seen on both sides, by the place and gradient of each. Where the median of
//! these is farther off than noise explains, and the point's residuals are more than noise, what it is off by joins its sigma.

use chainwave_measurement::{Estimate, median};

use crate::field::pair::{ImagePair, Settled};
use crate::field::shape_error::grid::{Grid, Reading};
use crate::field::shape_error::seen::Residuals;

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
    pair: &ImagePair<'_>,
    places: &[[f64; 2]],
    n_columns: usize,
    step_px: f64,
    settled: &mut [Option<Settled>],
) {
    let residuals = Residuals::of(settled, pair.side_px());
    let grid = Grid { n_columns, n_rows: places.len() / n_columns, step_px };
    let reading = |(one, place): (&Option<Settled>, &[f64; 2])| match one {
        Some((Ok(found), shape)) => Some(Reading::of(found, *place, *shape, &residuals)),
        _ => None,
    };
    let readings: Vec<Option<Reading>> = settled.iter().zip(places).map(reading).collect();
    for (point, one) in settled.iter_mut().enumerate() {
        let (Some((Ok(found), _)), Some(own)) = (one, &readings[point]) else { continue };
        if own.is_clean() {
            continue;
        }
        // Alone, it may be off by all that its residuals leave.
        let Some(foretold) = foretold(pair, grid, &readings, point) else {
            *found = found.with_error(own.left_px.map(|most_px| most_px / 3.0_f64.sqrt()));
            continue;
        };
        let off_px = [0, 1].map(|axis| {
            let beyond = (own.u_px[axis] - foretold[axis].value).powi(2);
            let by_noise = own.sigma_px[axis].powi(2) + foretold[axis].sigma.powi(2);
            (beyond - by_noise).max(0.0).sqrt()
        });
        *found = found.with_error(off_px);
    }
}

/// What one pair of points, or one point, says of the displacement of another.
struct Foretelling {
    u_px: [f64; 2],
    sigma_px: [f64; 2],
    is_clean: bool,
}

impl Foretelling {
    /// By points as far before as behind.
    fn by_pair(offset_px: [f64; 2], before: &Reading, behind: &Reading) -> Self {
        let slopes = [before, behind].map(|one| one.along_px(offset_px));
        Self {
            u_px: [0, 1].map(|axis| {
                let mean = 0.5 * (before.u_px[axis] + behind.u_px[axis]);
                mean + 0.25 * (slopes[0][axis] - slopes[1][axis])
            }),
            sigma_px: [0, 1].map(|axis| 0.5 * before.sigma_px[axis].hypot(behind.sigma_px[axis])),
            is_clean: before.is_clean() && behind.is_clean(),
        }
    }

    /// By a point at an offset.
    fn by_single(pair: &ImagePair<'_>, offset_px: [f64; 2], one: &Reading) -> Self {
        let slope = one.along_px(offset_px);
        let wider = 1.0_f64.hypot(pair.gradient_noise_at(offset_px));
        Self {
            u_px: [0, 1].map(|axis| one.u_px[axis] - slope[axis]),
            sigma_px: one.sigma_px.map(|sigma| sigma * wider),
            is_clean: one.is_clean(),
        }
    }
}

/// The displacement of a point along both axes by what is around it, with how far that scatters: by pairs where there are enough, clean
/// ones before others, else by single points.
fn foretold(
    pair: &ImagePair<'_>,
    grid: Grid,
    readings: &[Option<Reading>],
    point: usize,
) -> Option<[Estimate; 2]> {
    let (mut pairs, mut singles) = (Vec::new(), Vec::new());
    for offset in OFFSETS {
        let offsets = [offset.map(|steps| -steps), offset];
        let offsets_px = offsets.map(|offset| offset.map(|steps| steps as f64 * grid.step_px));
        let beside = offsets.map(|offset| readings[grid.at(point, offset)?].as_ref());
        if let [Some(before), Some(behind)] = beside {
            pairs.push(Foretelling::by_pair(offsets_px[1], before, behind));
        }
        let seen = offsets_px.into_iter().zip(beside);
        singles
            .extend(seen.filter_map(|(offset_px, one)| Some(Foretelling::by_single(pair, offset_px, one?))));
    }
    let clean = |all: &[Foretelling]| all.iter().filter(|one| one.is_clean).count();
    let (among, clean_alone) = if clean(&pairs) >= LEAST_PAIRS {
        (pairs, true)
    } else if clean(&singles) >= LEAST_SINGLES {
        (singles, true)
    } else if pairs.len() >= LEAST_PAIRS {
        (pairs, false)
    } else if singles.len() >= LEAST_SINGLES {
        (singles, false)
    } else {
        return None;
    };
    let of_axis = |axis: usize| {
        let used = || among.iter().filter(|one| one.is_clean || !clean_alone);
        let middle = median(used().map(|one| one.u_px[axis]).collect())?;
        let scatter = OF_MEDIAN * median(used().map(|one| (one.u_px[axis] - middle).abs()).collect())?;
        Some(Estimate::new(middle, scatter.hypot(median(used().map(|one| one.sigma_px[axis]).collect())?)))
    };
    Some([of_axis(0)?, of_axis(1)?])
}
