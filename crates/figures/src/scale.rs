//! Ranges of axes and where values stand on them (plotters' coordinates).

use plotters::coord::combinators::{IntoLogRange, LogCoord};
use plotters::coord::ranged1d::Ranged;
use plotters::coord::types::RangedCoordf64;

use crate::ticks::{Tick, decade_ticks, linear_ticks, whole_ticks};

/// Largest magnitude that is drawn; beyond it differences of values overflow.
const LARGEST: f64 = 1e150;

/// Length of an axis in the whole numbers that plotters' coordinates count in; on the page one is less than a nanometre.
const UNITS: i32 = 200_000_000;
/// How many lengths of the axis outside of it a value may stand; lines to there are cut at the frame.
const FARTHEST: f64 = 9.0;

/// Whether a value has a place on an axis.
pub(crate) fn is_drawable(value: f64) -> bool {
    value.is_finite() && value.abs() < LARGEST
}

/// The range that values cover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extent {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Extent {
    /// The range of the drawable values; `None` when there are none.
    pub(crate) fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        values.into_iter().filter(|&value| is_drawable(value)).fold(None, |extent, value| {
            let Self { low, high } = extent.unwrap_or(Self { low: value, high: value });
            Some(Self { low: low.min(value), high: high.max(value) })
        })
    }

    pub(crate) fn including(self, value: f64) -> Self {
        Self { low: self.low.min(value), high: self.high.max(value) }
    }

    /// The range from zero to the padded upper end, for quantities that are positive by nature.
    pub(crate) fn padded_from_zero(self, share: f64) -> Self {
        let Self { low, high } = self.including(0.0).padded(share);
        if self.low >= 0.0 {
            Self { low: 0.0, high: high.max(f64::MIN_POSITIVE) }
        } else {
            Self { low, high }
        }
    }

    /// The range with `share` of its length more at each end, and never empty.
    pub(crate) fn padded(self, share: f64) -> Self {
        let middle = 0.5 * self.low + 0.5 * self.high;
        // Ticks need some digits to differ, so a range shorter than a millionth of its distance from zero is widened.
        let is_point = self.low >= self.high;
        let least = if middle == 0.0 && is_point { 1.0 } else { 1e-6 * middle.abs() };
        if self.high - self.low < least {
            return Self { low: middle - 0.5 * least, high: middle + 0.5 * least };
        }
        let pad = share * (self.high - self.low);
        Self { low: self.low - pad, high: self.high + pad }
    }
}

/// How an axis counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AxisKind {
    Linear,
    /// Linear, with ticks at whole numbers only.
    Whole,
    /// Logarithmic; the range is positive.
    Log,
}

/// The range of an axis and how values are placed in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale {
    extent: Option<Extent>,
    kind: AxisKind,
    /// Whether the high end is where the low one usually is.
    turned: bool,
}

impl Scale {
    /// A linear axis; without an extent it has no ticks and says "no data".
    pub(crate) fn linear(extent: Option<Extent>) -> Self {
        Self { extent: extent.map(|extent| extent.padded(0.0)), kind: AxisKind::Linear, turned: false }
    }

    pub(crate) fn whole(extent: Option<Extent>) -> Self {
        Self { kind: AxisKind::Whole, ..Self::linear(extent) }
    }

    /// A logarithmic axis; an extent that reaches zero counts as none.
    pub(crate) fn log(extent: Option<Extent>) -> Self {
        let extent = extent.filter(|extent| extent.low > 0.0);
        let widened = extent.map(|Extent { low, high }| Extent { low, high: high.max(low * 1.01) });
        Self { extent: widened, kind: AxisKind::Log, turned: false }
    }

    /// The same axis with its low end on top, as the rows of an image count.
    pub(crate) fn downwards(self) -> Self {
        Self { turned: true, ..self }
    }

    /// The same axis with its high end this many times as far from its low end.
    pub(crate) fn with_headroom(self, factor: f64) -> Self {
        let extent =
            self.extent.map(|Extent { low, high }| Extent { low, high: low + factor * (high - low) });
        Self { extent, ..self }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.extent.is_none()
    }

    pub(crate) fn extent(&self) -> Option<Extent> {
        self.extent
    }

    /// The same axis in other units: a linear axis times `factor` plus `offset`.
    pub(crate) fn converted(&self, factor: f64, offset: f64) -> Self {
        let convert = |value: f64| factor * value + offset;
        let extent = self.extent.map(|e| Extent { low: convert(e.low), high: convert(e.high) });
        Self { extent, kind: AxisKind::Linear, turned: self.turned }
    }

    /// Place of a value: 0 at the low end, 1 at the high end (on an axis that is turned, the other way round), beyond
    /// them outside, but no farther than [`FARTHEST`]; `None` where it has no place.
    pub(crate) fn share(&self, value: f64) -> Option<f64> {
        let Extent { low, high } = self.extent?;
        if !is_drawable(value) {
            return None;
        }
        let units = match self.kind {
            AxisKind::Log if value <= 0.0 => return None,
            AxisKind::Log => {
                let reach = (high / low).powf(FARTHEST);
                let inside = value.clamp((low / reach).max(f64::MIN_POSITIVE), (high * reach).min(f64::MAX));
                LogCoord::from((low..high).log_scale()).map(&inside, (0, UNITS))
            }
            _ => {
                let reach = FARTHEST * (high - low);
                RangedCoordf64::from(low..high).map(&value.clamp(low - reach, high + reach), (0, UNITS))
            }
        };
        let share = f64::from(units) / f64::from(UNITS);
        Some(if self.turned { 1.0 - share } else { share })
    }

    /// Labelled ticks, about `at_most`.
    pub(crate) fn ticks(&self, at_most: usize) -> Vec<Tick> {
        let Some(Extent { low, high }) = self.extent else { return Vec::new() };
        match self.kind {
            AxisKind::Linear => linear_ticks(low, high, at_most),
            AxisKind::Whole => whole_ticks(low, high, at_most),
            AxisKind::Log => {
                let decades = decade_ticks(low, high, at_most);
                if decades.len() < 2 { linear_ticks(low, high, at_most) } else { decades }
            }
        }
    }

    /// Places of short ticks without labels: the multiples of each decade of a logarithmic axis that has few of them.
    pub(crate) fn minor_ticks(&self) -> Vec<f64> {
        let Some(Extent { low, high }) = self.extent.filter(|_| self.kind == AxisKind::Log) else {
            return Vec::new();
        };
        let first = low.log10().floor() as i32;
        let last = high.log10().ceil() as i32;
        if !(2..=8).contains(&(last - first)) {
            return Vec::new();
        }
        let multiples = |power: i32| (2..10).map(move |factor| f64::from(factor) * 10.0_f64.powi(power));
        (first..last).flat_map(multiples).filter(|value| (low..=high).contains(value)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_without_a_place_are_left_out() {
        let extent = Extent::of([f64::NAN, 2.0, f64::INFINITY, -1.0, 1e300]);
        assert_eq!(extent, Some(Extent { low: -1.0, high: 2.0 }));
        assert_eq!(Extent::of([f64::NAN]), None);
        assert_eq!(Scale::linear(extent).share(f64::NAN), None);
        assert_eq!(Scale::linear(None).share(1.0), None);
    }

    #[test]
    fn a_single_value_gets_a_range_with_ticks() {
        for value in [0.0, 5.0, -3e9, 1e-12] {
            let scale = Scale::linear(Extent::of([value]).map(|extent| extent.padded(0.05)));
            let share = scale.share(value).unwrap();
            // The range is a millionth of the value, so its middle is known to 1e-16 / 1e-6.
            assert!((share - 0.5).abs() < 1e-9, "{value}: {share}");
            assert!(!scale.ticks(4).is_empty(), "{value}");
        }
    }

    #[test]
    fn far_values_stay_outside_and_in_order() {
        for scale in [
            Scale::linear(Some(Extent { low: 1.0, high: 2.0 })),
            Scale::log(Some(Extent { low: 1.0, high: 2.0 })),
        ] {
            let shares = [1e-3, 0.9, 1.5, 3.0, 1e140].map(|value| scale.share(value).unwrap());
            assert!(shares.windows(2).all(|pair| pair[0] < pair[1]), "{shares:?}");
            assert!(shares[1] < 0.0 && shares[3] > 1.0 && shares[4] < 10.5);
        }
    }

    #[test]
    fn a_small_range_around_zero_stays_small() {
        let extent = Extent { low: -1e-3, high: 1e-3 };
        assert_eq!(extent.padded(0.0), extent);
    }

    #[test]
    fn a_logarithmic_axis_has_equal_decades_and_no_zero() {
        let scale = Scale::log(Some(Extent { low: 1e-4, high: 1.0 }));
        // Exact but for the whole number that it is rounded to, twice.
        assert!((scale.share(1e-2).unwrap() - 0.5).abs() < 2.0 / f64::from(UNITS));
        assert_eq!(scale.share(0.0), None);
        assert!(Scale::log(Some(Extent { low: 0.0, high: 1.0 })).is_empty());
    }
}
