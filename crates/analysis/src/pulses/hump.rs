//! Humps of one gap's strain over time, of either sign, that stand out of the noise.

use crate::StrainMap;
use crate::front::{level, time_at, typical_sigma};
use crate::local::{LocalPolynomial, MIN_HALF_WINDOW, smooth, smoothing_gain};
use crate::probability::normal_beyond;

/// Share of a hump's prominence below its top down to which the polynomial that gives the top is fitted.
const TOP: f64 = 0.2;
/// A pulse's samples above half its height over the smoothing window on each side: half the rise from 25 to 75 % of a sech^2.
const HALF_HEIGHT_OVER_WINDOW: usize = 5;
/// Times the window is fitted to the greatest hump, which it makes smoother.
const N_WINDOWS: usize = 4;
/// Humps of a gap and sign that are looked at, the most prominent.
const MOST: usize = 16;

/// Whether a pulse closes the gaps or opens them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sense {
    /// It closes them: strain below zero.
    Compression,
    /// It opens them.
    Tension,
}

impl Sense {
    const BOTH: [Self; 2] = [Self::Compression, Self::Tension];

    /// The sign of its strain.
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Compression => -1.0,
            Self::Tension => 1.0,
        }
    }

    /// The name in tables.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Compression => "compression",
            Self::Tension => "tension",
        }
    }
}

/// An extreme of one gap's strain over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hump {
    /// Number of the gap, from 1.
    pub(crate) gap: usize,
    pub(crate) sense: Sense,
    /// When it is greatest.
    pub(crate) t_s: f64,
    /// Size of the strain there, above zero.
    pub(crate) size: f64,
    /// Half of the time for which the strain exceeds half of that, where it falls to that on both sides.
    pub(crate) half_width_s: Option<f64>,
    /// Time for which the strain lies within half of the hump's prominence.
    pub(crate) span_s: f64,
    /// Samples on each side over which the gap is smoothed.
    half_window: usize,
    /// First and last sample of the polynomial that gives the top.
    top: (usize, usize),
}

/// Deviations beyond which one of so many normal numbers lies, on either side, with a probability of at most `rate` (C. E. Bonferroni's
/// bound, which holds however they correlate).
pub(crate) fn threshold(n_looks: usize, rate: f64) -> f64 {
    let each = rate / (2.0 * n_looks.max(1) as f64);
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if normal_beyond(middle) > each {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// The humps of all gaps, gap by gap and in time, in a record that shows a false one with a probability of at most `rate`; none of less
/// than `least_share` of the record's greatest strain.
pub(crate) fn humps(map: &StrainMap, rate: f64, least_share: f64) -> Vec<Hump> {
    let n_looks = map.strain.iter().flatten().count();
    let deviations = threshold(n_looks, rate);
    let greatest = map.strain.iter().flatten().map(|strain| strain.value.abs()).fold(0.0, f64::max);
    let look = Look { map, deviations, least: least_share * greatest };
    (1..=map.n_gaps()).flat_map(|gap| look.of_gap(gap)).collect()
}

struct Look<'a> {
    map: &'a StrainMap,
    deviations: f64,
    least: f64,
}

impl Look<'_> {
    fn of_gap(&self, gap: usize) -> Vec<Hump> {
        let half_window = window(self.map, gap);
        let noise = self.deviations * typical_sigma(self.map, gap) * smoothing_gain(half_window);
        let mut found: Vec<Hump> = Vec::new();
        for sense in Sense::BOTH {
            let series = oriented(self.map, gap, sense);
            let smoothed = smooth(&series, half_window);
            let mut tops = tops(&smoothed, half_window, noise.max(self.least));
            tops.retain(|top| top.prominence > (noise * std::f64::consts::SQRT_2).max(self.least));
            tops.sort_by(|one, other| other.prominence.total_cmp(&one.prominence));
            tops.truncate(MOST);
            let hump = |top: &Top| Hump::new(self.map, (gap, sense), (&series, &smoothed), half_window, top);
            found.extend(tops.iter().filter_map(hump));
        }
        found.sort_by(|one, other| one.t_s.total_cmp(&other.t_s));
        found
    }
}

/// A gap's strain, positive where it has this sense.
fn oriented(map: &StrainMap, gap: usize, sense: Sense) -> Vec<Option<f64>> {
    let row = map.strain.row(gap - 1);
    row.iter().map(|sample| sample.map(|strain| sense.sign() * strain.value)).collect()
}

/// The smoothing window on each side that the greatest hump of a gap allows.
fn window(map: &StrainMap, gap: usize) -> usize {
    let sizes: Vec<Option<f64>> =
        map.strain.row(gap - 1).iter().map(|sample| sample.map(|strain| strain.value)).collect();
    let mut half_window = MIN_HALF_WINDOW;
    for _ in 0..N_WINDOWS {
        let smoothed = smooth(&sizes, half_window);
        let size = |at: usize| smoothed[at].map_or(0.0, f64::abs);
        let Some(summit) = (0..smoothed.len()).max_by(|a, b| size(*a).total_cmp(&size(*b))) else { break };
        let sign = smoothed[summit].map_or(0.0, f64::signum);
        let above = |at: &usize| sign * smoothed[*at].unwrap_or(0.0) > 0.5 * size(summit);
        let run =
            (0..summit).rev().take_while(above).count() + (summit..smoothed.len()).take_while(above).count();
        half_window = half_window.max(run / HALF_HEIGHT_OVER_WINDOW);
    }
    half_window
}

/// A maximum of a smoothed series.
struct Top {
    at: usize,
    /// Height above the higher of the lowest places, or of zero, that part it from something higher on each side.
    prominence: f64,
    /// The samples between those places.
    between: (usize, usize),
}

/// Maxima above a height, away from the ends by a window, where the smoothing knows both sides.
fn tops(smoothed: &[Option<f64>], half_window: usize, least: f64) -> Vec<Top> {
    let inner = half_window.max(1)..smoothed.len().saturating_sub(half_window.max(1));
    let is_top = |at: &usize| {
        let here = level(smoothed, *at);
        here > least && here > level(smoothed, at - 1) && here >= level(smoothed, at + 1)
    };
    inner.filter(is_top).map(|at| top(smoothed, at)).collect()
}

fn top(smoothed: &[Option<f64>], at: usize) -> Top {
    let here = level(smoothed, at);
    // The way to something higher, or to where nothing is known.
    let lowest = |way: &mut dyn Iterator<Item = usize>| {
        let mut low = (at, here);
        for place in way {
            let Some(value) = smoothed[place] else { break };
            if value > here {
                break;
            }
            if value < low.1 {
                low = (place, value);
            }
        }
        low
    };
    let (before, after) = (lowest(&mut (0..at).rev()), lowest(&mut (at + 1..smoothed.len())));
    Top { at, prominence: here - before.1.max(after.1).max(0.0), between: (before.0, after.0) }
}

impl Hump {
    fn new(
        map: &StrainMap,
        (gap, sense): (usize, Sense),
        (series, smoothed): (&[Option<f64>], &[Option<f64>]),
        half_window: usize,
        top: &Top,
    ) -> Option<Self> {
        let height = level(smoothed, top.at);
        let above = |share: f64| {
            let inside = move |at: &usize| level(smoothed, *at) >= height - share * top.prominence;
            let first = (top.between.0..top.at).rev().take_while(inside).last().unwrap_or(top.at);
            let last = (top.at + 1..=top.between.1).take_while(inside).last().unwrap_or(top.at);
            (first, last)
        };
        let (first, last) = above(TOP);
        let first = first.min(top.at.saturating_sub(MIN_HALF_WINDOW));
        let last = last.max(top.at + MIN_HALF_WINDOW).min(series.len() - 1);
        let (place, size) = LocalPolynomial::fit(series, first, last)?.maximum()?;
        let (from, to) = above(0.5);
        let hump = Self {
            gap,
            sense,
            t_s: time_at(map, place),
            size,
            half_width_s: None,
            span_s: (to - from + 1) as f64 * map.interval_s(),
            half_window,
            top: (first, last),
        };
        (size > 0.0).then(|| Self { half_width_s: hump.half_width_s(map, smoothed, top.between), ..hump })
    }

    /// The same hump in another map of the same chain, such as a replica of the motion.
    pub(crate) fn again(&self, map: &StrainMap) -> Option<Self> {
        let series = oriented(map, self.gap, self.sense);
        let (first, last) = self.top;
        let (place, size) = LocalPolynomial::fit(&series, first, last)?.maximum()?;
        let smoothed = smooth(&series, self.half_window);
        let at = (place.round() as usize).min(series.len() - 1);
        let found = Self { t_s: time_at(map, place), size, ..*self };
        Some(Self { half_width_s: found.half_width_s(map, &smoothed, top(&smoothed, at).between), ..found })
    }

    /// Half of the time between the passages of half the height, within the samples that are the hump's own.
    fn half_width_s(
        &self,
        map: &StrainMap,
        smoothed: &[Option<f64>],
        between: (usize, usize),
    ) -> Option<f64> {
        let half = 0.5 * self.size;
        let summit = ((self.t_s - map.times_s.first()?) / map.interval_s()).round() as usize;
        let crossing = |inside: usize, outside: usize| {
            let (above, below) = (smoothed[inside]?, smoothed[outside]?);
            let part = (above - half) / (above - below);
            Some(inside as f64 + part * (outside as f64 - inside as f64))
        };
        let before = (between.0..summit).rev().find(|at| level(smoothed, *at) < half)?;
        let after = (summit + 1..=between.1).find(|at| level(smoothed, *at) < half)?;
        let width = crossing(after - 1, after)? - crossing(before + 1, before)?;
        Some(0.5 * width * map.interval_s())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_threshold_is_bonferronis() {
        for (n, rate) in [(1, 0.05), (1000, 0.01), (200_000, 0.01)] {
            let found = 2.0 * n as f64 * normal_beyond(threshold(n, rate));
            assert!((found / rate - 1.0).abs() < 1e-9, "{n} {rate}");
        }
    }
}
