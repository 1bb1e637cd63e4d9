//! Where a pulse is at a time, by its humps; straight lines through parts of its way.

use chainwave_measurement::median;

use super::hump::Hump;
use super::ridge::{Direction, Ridge};

/// A pulse's passages: times and gaps, in its order.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PulsePath {
    pub(crate) direction: Direction,
    pub(crate) passes: Vec<Hump>,
}

impl PulsePath {
    pub(crate) fn of(ridge: &Ridge, humps: &[Hump]) -> Self {
        Self { direction: ridge.direction, passes: ridge.humps.iter().map(|hump| humps[*hump]).collect() }
    }

    pub(crate) fn first_s(&self) -> f64 {
        self.passes[0].t_s
    }

    pub(crate) fn last_s(&self) -> f64 {
        self.passes[self.passes.len() - 1].t_s
    }

    /// Place (a fractional number of gaps) at a time between its first and its last gap, or a little beyond by the nearest two.
    pub(crate) fn place(&self, t_s: f64) -> f64 {
        let after = self.passes.partition_point(|pass| pass.t_s <= t_s).clamp(1, self.passes.len() - 1);
        let (one, other) = (&self.passes[after - 1], &self.passes[after]);
        let part = (t_s - one.t_s) / (other.t_s - one.t_s);
        one.gap as f64 + part * (other.gap as f64 - one.gap as f64)
    }

    /// Gaps in a second, without sign.
    pub(crate) fn gaps_per_s(&self) -> f64 {
        let gaps = self.passes[0].gap.abs_diff(self.passes[self.passes.len() - 1].gap);
        gaps as f64 / (self.last_s() - self.first_s())
    }

    /// Size of its strain: the median of its passages.
    pub(crate) fn size(&self) -> f64 {
        median(self.passes.iter().map(|pass| pass.size).collect()).unwrap_or(0.0)
    }

    /// Half width at half height in gaps: the median of its passages, one where none has a width.
    pub(crate) fn half_width_gaps(&self) -> f64 {
        let widths_s = self.passes.iter().filter_map(|pass| pass.half_width_s).collect();
        median(widths_s).map_or(1.0, |width_s| width_s * self.gaps_per_s())
    }
}

/// A straight line through times and places, by least squares of the times, whose errors the places have not.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CourseLine {
    t_s: f64,
    place: f64,
    slowness: f64,
}

impl CourseLine {
    /// Through points `(t_s, place)`; none through fewer than `least` or where time stands still.
    pub(crate) fn through(points: &[(f64, f64)], least: usize) -> Option<Self> {
        let n = points.len() as f64;
        let mean = |value: fn(&(f64, f64)) -> f64| points.iter().map(value).sum::<f64>() / n;
        let (t_s, place) = (mean(|point| point.0), mean(|point| point.1));
        let product: f64 = points.iter().map(|point| (point.0 - t_s) * (point.1 - place)).sum();
        let square: f64 = points.iter().map(|point| (point.1 - place).powi(2)).sum();
        let slowness = product / square;
        (points.len() >= least.max(2) && slowness.is_finite() && slowness.abs() > 0.0).then_some(Self {
            t_s,
            place,
            slowness,
        })
    }

    /// Place at a time.
    pub(crate) fn at(&self, t_s: f64) -> f64 {
        self.place + (t_s - self.t_s) / self.slowness
    }

    /// Places in a second.
    pub(crate) fn speed(&self) -> f64 {
        self.slowness.recip()
    }
}

/// The speed that stretches of one way have in common, each with a beginning of its own, as a meeting moves a pulse along its way: least
/// squares of the times, as of [`CourseLine::through`]. None of points that, but for one in each stretch, are fewer than `least - 1`.
pub(crate) fn common_speed(stretches: &[Vec<(f64, f64)>], least: usize) -> Option<f64> {
    let (mut product, mut square, mut n_free) = (0.0, 0.0, 0);
    for points in stretches.iter().filter(|points| points.len() > 1) {
        let n = points.len() as f64;
        let mean = |value: fn(&(f64, f64)) -> f64| points.iter().map(value).sum::<f64>() / n;
        let (t_s, place) = (mean(|point| point.0), mean(|point| point.1));
        product += points.iter().map(|point| (point.0 - t_s) * (point.1 - place)).sum::<f64>();
        square += points.iter().map(|point| (point.1 - place).powi(2)).sum::<f64>();
        n_free += points.len() - 1;
    }
    let speed = square / product;
    (n_free + 1 >= least && speed.is_finite() && speed.abs() > 0.0).then_some(speed)
}
