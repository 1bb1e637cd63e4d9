//! Humps of one gap's strain over time, of either sign, that stand out of the noise.

use crate::StrainMap;
use crate::front::{time_at, typical_sigma};
use crate::local::{LocalPolynomial, MIN_HALF_WINDOW, level, smooth, smoothing_gain};
use crate::probability::normal_beyond;
use crate::top::tops;

/// Shares of a hump's prominence below its top down to which the polynomial that gives the top is fitted: the next where noise bends the
/// first so that it is highest at its end.
const TOPS: [f64; 2] = [0.3, 0.5];
/// The first of them for humps that noise hardly bends: what a polynomial over three tenths of an uneven top leaves, some ten thousandths of its height, is a
/// quarter over two tenths, whose place noise moves by half as much again.
const CALM_TOPS: [f64; 2] = [0.2, 0.3];
/// Deviations of a sample that such a hump is high.
const CALM: f64 = 1000.0;
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
    /// First and last sample of the polynomial that gives the top...
    top: (usize, usize),
    /// ...and of one over half as far down.
    upper_top: (usize, usize),
    /// Whether the map has it; else it is as another map had it.
    pub(crate) is_found: bool,
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

/// The humps of all gaps, gap by gap and in time, in a record that shows a false one with a probability of at most `rate`; none less
/// prominent than `least_share` of the most prominent one.
pub(crate) fn humps(map: &StrainMap, rate: f64, least_share: f64) -> Vec<Hump> {
    let n_looks = map.strain.iter().flatten().count();
    let deviations = threshold(n_looks, rate);
    let found: Vec<(Hump, f64)> =
        (1..=map.n_gaps()).flat_map(|gap| humps_of_gap(map, gap, deviations)).collect();
    let least = least_share * found.iter().map(|(_, prominence)| *prominence).fold(0.0, f64::max);
    let prominent = found.into_iter().filter(|(_, prominence)| *prominence > least);
    prominent.map(|(hump, _)| hump).collect()
}

/// The humps of a gap in time, with their prominences.
fn humps_of_gap(map: &StrainMap, gap: usize, deviations: f64) -> Vec<(Hump, f64)> {
    let half_window = window(map, gap);
    let noise = deviations * typical_sigma(map, gap) * smoothing_gain(half_window);
    let mut found: Vec<(Hump, f64)> = Vec::new();
    for sense in Sense::BOTH {
        let series = oriented(map, gap, sense);
        let smoothed = smooth(&series, half_window);
        let mut tops = maxima(&smoothed, half_window, noise);
        tops.retain(|top| top.prominence > noise * std::f64::consts::SQRT_2);
        tops.sort_by(|one, other| other.prominence.total_cmp(&one.prominence));
        tops.truncate(MOST);
        let hump = |top: &Top| {
            let hump = Hump::new(map, (gap, sense), (&series, &smoothed), half_window, top)?;
            Some((hump, top.prominence))
        };
        found.extend(tops.iter().filter_map(hump));
    }
    found.sort_by(|(one, _), (other, _)| one.t_s.total_cmp(&other.t_s));
    found
}

/// A gap's strain, positive where it has this sense.
fn oriented(map: &StrainMap, gap: usize, sense: Sense) -> Vec<Option<f64>> {
    let row = map.strain.row(gap - 1);
    row.iter().map(|sample| sample.map(|strain| sense.sign() * strain.value)).collect()
}

/// The smoothing window on each side that the most prominent hump of a gap allows.
fn window(map: &StrainMap, gap: usize) -> usize {
    let of_senses = Sense::BOTH.map(|sense| oriented(map, gap, sense));
    let mut half_window = MIN_HALF_WINDOW;
    for _ in 0..N_WINDOWS {
        let of_sense = |series: &Vec<Option<f64>>| {
            let smoothed = smooth(series, half_window);
            let highest = maxima(&smoothed, half_window, 0.0)
                .into_iter()
                .max_by(|one, other| one.prominence.total_cmp(&other.prominence))?;
            let (first, last) = highest.above(&smoothed, 0.5);
            Some((highest.prominence, last - first + 1))
        };
        let widest = of_senses.iter().filter_map(of_sense).max_by(|one, other| one.0.total_cmp(&other.0));
        half_window = half_window.max(widest.map_or(0, |(_, run)| run / HALF_HEIGHT_OVER_WINDOW));
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

impl Top {
    /// First and last sample around it that lie within a share of its prominence below it.
    fn above(&self, smoothed: &[Option<f64>], share: f64) -> (usize, usize) {
        let least = level(smoothed, self.at) - share * self.prominence;
        let inside = |at: &usize| level(smoothed, *at) >= least;
        let first = (self.between.0..self.at).rev().take_while(inside).last().unwrap_or(self.at);
        let last = (self.at + 1..=self.between.1).take_while(inside).last().unwrap_or(self.at);
        (first, last)
    }
}

/// Maxima above a height, away from the ends by a window, where the smoothing knows both sides.
fn maxima(smoothed: &[Option<f64>], half_window: usize, least: f64) -> Vec<Top> {
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

/// The gaps' strains in either sense, smoothed as their humps were; each is worked out when it is first asked for.
pub(crate) struct SmoothedRows<'a> {
    map: &'a StrainMap,
    rows: Vec<Option<(Series, Series)>>,
}

type Series = Vec<Option<f64>>;

impl<'a> SmoothedRows<'a> {
    pub(crate) fn of_map(map: &'a StrainMap) -> Self {
        Self { map, rows: vec![None; Sense::BOTH.len() * map.n_gaps()] }
    }

    /// The series that a hump lies in, as it is and smoothed.
    fn of(&mut self, hump: &Hump) -> &(Series, Series) {
        let place = Sense::BOTH.len() * (hump.gap - 1) + usize::from(hump.sense == Sense::Tension);
        self.rows[place].get_or_insert_with(|| {
            let series = oriented(self.map, hump.gap, hump.sense);
            let smoothed = smooth(&series, hump.half_window);
            (series, smoothed)
        })
    }
}

impl Hump {
    fn new(
        map: &StrainMap,
        (gap, sense): (usize, Sense),
        (series, smoothed): (&[Option<f64>], &[Option<f64>]),
        half_window: usize,
        top: &Top,
    ) -> Option<Self> {
        let samples_above = |share: f64| tops(smoothed, top.at, top.above(smoothed, share));
        let of_share = |share: f64| {
            let maximum =
                |(first, last): (usize, usize)| LocalPolynomial::fit(series, first, last)?.maximum();
            let mut parts = samples_above(share).into_iter();
            parts.find_map(|samples| Some((share, samples, maximum(samples)?)))
        };
        let is_calm = top.prominence > CALM * typical_sigma(map, gap);
        let shares = if is_calm { CALM_TOPS } else { TOPS };
        let (share, samples, (place, size)) = shares.into_iter().find_map(of_share)?;
        let (from, to) = top.above(smoothed, 0.5);
        let hump = Self {
            gap,
            sense,
            t_s: time_at(map, place),
            size,
            half_width_s: None,
            span_s: (to - from + 1) as f64 * map.interval_s(),
            half_window,
            top: samples,
            upper_top: samples_above(0.5 * share)[0],
            is_found: true,
        };
        (size > 0.0).then(|| Self { half_width_s: hump.half_width_s(map, smoothed, top.between), ..hump })
    }

    /// The same hump in another map of the same chain, such as a replica of the motion.
    pub(crate) fn again(&self, rows: &mut SmoothedRows<'_>) -> Option<Self> {
        self.by(self.top, rows)
    }

    /// The same by a polynomial over half as far down from its top.
    pub(crate) fn upper(&self, rows: &mut SmoothedRows<'_>) -> Option<Self> {
        self.by(self.upper_top, rows)
    }

    fn by(&self, (first, last): (usize, usize), rows: &mut SmoothedRows<'_>) -> Option<Self> {
        let map = rows.map;
        let (series, smoothed) = rows.of(self);
        let (place, size) = LocalPolynomial::fit(series, first, last)?.maximum()?;
        let at = (place.round() as usize).min(series.len() - 1);
        let found = Self { t_s: time_at(map, place), size, ..*self };
        Some(Self { half_width_s: found.half_width_s(map, smoothed, top(smoothed, at).between), ..found })
    }

    /// The same hump where another map has lost it.
    pub(crate) fn lost(&self) -> Self {
        Self { is_found: false, ..*self }
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
    use chainwave_measurement::Estimate;
    use ndarray::Array2;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn the_threshold_is_bonferronis() {
        for (n, rate) in [(1, 0.05), (1000, 0.01), (200_000, 0.01)] {
            let found = 2.0 * n as f64 * normal_beyond(threshold(n, rate));
            assert!((found / rate - 1.0).abs() < 1e-9, "{n} {rate}");
        }
    }

    /// A bump of so many sigmas among noise, in each of 20 gaps.
    fn noisy(seed: u64, deviations: f64) -> StrainMap {
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let times_s: Vec<f64> = (0..120).map(|k| 1e-4 * f64::from(k)).collect();
        let strain = Array2::from_shape_fn((20, 120), |(_, k)| {
            let bump = deviations / ((k as f64 - 60.0) / 12.0).cosh().powi(2);
            let noise: f64 = StandardNormal.sample(&mut random);
            Some(Estimate::new(1e-3 * (noise - bump), 1e-3))
        });
        StrainMap { times_s, spacing: 0.03.into(), strain }
    }

    #[test]
    fn false_humps_are_as_rare_as_stated() {
        let n_false = (0..1000).filter(|seed| !humps(&noisy(*seed, 0.0), 0.01, 0.0).is_empty()).count();
        // One record in a hundred, 10 +- 3.2, and four deviations.
        assert!(n_false <= 23, "{n_false}");
        // Twice the threshold of one sample, 4.9 sigmas for 2400 of them, is seen in every gap, as a compression.
        let found = humps(&noisy(5000, 10.0), 0.01, 0.3);
        assert_eq!(found.len(), 20);
        assert!(found.iter().all(|hump| hump.sense == Sense::Compression && (hump.t_s - 6e-3).abs() < 1e-3));
    }
}
