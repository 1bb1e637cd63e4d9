//! The highest place of a hump, by a polynomial through the samples about it.

use crate::Missing;
use crate::local::{LocalPolynomial, MIN_HALF_WINDOW, level};

/// Fall below the running maximum that ends the search for a peak, as a share of it.
pub(crate) const MIN_FALL: f64 = 0.05;
/// How many times farther the polynomial that gives a peak may reach on one side of it than on the other. The pulses of lightly damped chains
/// are less uneven (1.9 times at most). Behind a steep rise a strongly damped one falls so slowly that a polynomial over all of it would miss the
/// peak by some thousandths.
const MOST_UNEVEN: usize = 2;
/// Samples that the shorter side counts as at least: a polynomial through few samples follows them however unevenly they lie.
const LEAST_REACH: usize = 2 * MIN_HALF_WINDOW + 1;

/// A maximum between samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Peak {
    /// Fractional sample index.
    pub(crate) place: f64,
    /// Value of the series there.
    pub(crate) value: f64,
}

/// The maximum of a series near sample `summit`, from a polynomial over the contiguous samples whose smoothed value exceeds
/// `peak_fraction` of the smoothed maximum, as far as they belong to its hump and reach not much farther on one side than on the other.
pub(crate) fn refine_peak(
    series: &[Option<f64>],
    smoothed: &[Option<f64>],
    summit: usize,
    peak_fraction: f64,
) -> Result<Peak, Missing> {
    let threshold = peak_fraction * level(smoothed, summit);
    let last_index = series.len() - 1;
    let first = end_of_hump(smoothed, summit, threshold, (0..summit).rev());
    let last = end_of_hump(smoothed, summit, threshold, summit + 1..=last_index);
    let maximum = |(first, last): (usize, usize)| {
        let polynomial = LocalPolynomial::fit(series, first, last).ok_or(Missing::TooFewSamples)?;
        polynomial.maximum().ok_or(Missing::PeakOutsideRecord)
    };
    let [even, all] = tops(smoothed, summit, (first, last));
    // Where ripples ride on a broad pulse, a part of it may be greatest at its end.
    let (place, value) = maximum(even).or_else(|_| maximum(all))?;
    Ok(Peak { place, value })
}

/// The samples that a polynomial is fitted to which gives the highest place of those around a summit: as many as determine it on either side, and
/// first not much farther on one side than on the other, then all.
pub(crate) fn tops(
    smoothed: &[Option<f64>],
    summit: usize,
    (first, last): (usize, usize),
) -> [(usize, usize); 2] {
    let [before, after] = [summit - first, last - summit].map(|reach| reach.max(MIN_HALF_WINDOW));
    // How far a side reaches that the record or a hole cuts off is not known.
    let is_seen = |at: Option<usize>| at.and_then(|at| *smoothed.get(at)?).is_some();
    let sides = [(before, first.checked_sub(1)), (after, Some(last + 1))];
    let shorter = sides.into_iter().filter(|(_, beyond)| is_seen(*beyond)).map(|(reach, _)| reach).min();
    let farthest = shorter.map_or(usize::MAX, |reach| MOST_UNEVEN * reach.max(LEAST_REACH));
    [farthest, usize::MAX].map(|farthest| {
        let [before, after] = [before, after].map(|reach| reach.min(farthest));
        (summit.saturating_sub(before), (summit + after).min(smoothed.len() - 1))
    })
}

/// The last of the samples on one side of a summit that exceed a threshold and belong to its hump. Another one begins behind a fall and a
/// rise that part two summits: where a pulse meets its reflection, all that lies between may exceed the threshold.
fn end_of_hump(
    smoothed: &[Option<f64>],
    summit: usize,
    threshold: f64,
    outwards: impl Iterator<Item = usize>,
) -> usize {
    let ripple = MIN_FALL * level(smoothed, summit);
    let mut lowest = summit;
    let mut end = summit;
    for at in outwards.take_while(|at| level(smoothed, *at) >= threshold) {
        let value = level(smoothed, at);
        let has_fallen = level(smoothed, summit) - level(smoothed, lowest) > ripple;
        if has_fallen && value - level(smoothed, lowest) > ripple {
            return lowest;
        }
        if value < level(smoothed, lowest) {
            lowest = at;
        }
        end = at;
    }
    end
}
