//! Readings that the other trials of the view contradict.
//!
//! Trials differ by when they were triggered and how hard they were struck. So each trial's displacement of a body is a common one, shifted in
//! time and scaled: u_r(t) = (1 + d_r) m(t + tau_r), where m is the median of all trials, each taken back to it. Shifts and factors are
//! found by least absolute deviations, which what is wrong in fewer than half of a trial's readings does not move, and the median by what
//! fewer than half of the trials have wrong; both in turn. Without the alignment the median would step by the scatter of strikes wherever
//! one trial is lost or wrong, and accuse the others.

use chainwave_measurement::median;

use super::blocks::{Blocks, OfEach};
use super::series::Series;

/// Rounds of median and alignment; each leaves a few per cent of what was off.
const N_ROUNDS: usize = 4;
/// Passes of the reweighted least squares; the weights settle to a per cent in fewer.
const N_PASSES: usize = 12;
/// Deviation below which a reading's weight stays, in standard uncertainties of a reading.
const SMALL: f64 = 0.1;

/// How far each reading lies from what the other trials say; none where there are no others.
pub(super) fn departures(group: &[&Series<'_>]) -> OfEach {
    let aligned = aligned(group);
    let left: Vec<[Vec<Option<f64>>; 2]> = (0..group.len())
        .map(|member| {
            let deviation_px = |one: Option<Beside>| Some(one?.deviation_px * aligned[member].factor);
            beside_the_median(&aligned, member).map(|axis| axis.into_iter().map(deviation_px).collect())
        })
        .collect();
    let axes = [0, 1].map(|axis| {
        let values: OfEach = left.iter().map(|axes| axes[axis].clone()).collect();
        let blocks = Blocks::of(group, &values);
        (values, blocks)
    });
    let departure = |member: usize, frame: usize, axis: usize| {
        let (values, blocks) = &axes[axis];
        let series = group[member];
        let [middle, scale] = blocks.at(series.times_s[frame])?;
        let sigma = Series::sigma_px(series.position(frame)?)[axis];
        Some((values[member][frame]? - middle).abs() / scale.hypot(sigma))
    };
    let of_frame =
        |member: usize, frame: usize| Some(departure(member, frame, 0)?.max(departure(member, frame, 1)?));
    let of_member = |(member, series): (usize, &&Series<'_>)| {
        (0..series.n_frames()).map(|frame| of_frame(member, frame)).collect()
    };
    group.iter().enumerate().map(of_member).collect()
}

/// The trials of a body, each with what takes it to the common displacement.
pub(super) fn aligned<'a>(group: &[&'a Series<'a>]) -> Vec<Aligned<'a>> {
    let mut aligned: Vec<Aligned<'_>> =
        group.iter().map(|series| Aligned { series, shift_s: 0.0, factor: 1.0 }).collect();
    for _ in 0..N_ROUNDS {
        let steps: Vec<[f64; 2]> = (0..group.len())
            .map(|member| {
                let axes = beside_the_median(&aligned, member);
                least_absolute_deviations(&axes.iter().flatten().flatten().collect::<Vec<_>>())
            })
            .collect();
        for (one, [shift_s, excess]) in aligned.iter_mut().zip(steps) {
            one.shift_s += shift_s;
            one.factor *= 1.0 + excess;
        }
    }
    aligned
}

/// A trial of a body with what takes it to the common displacement.
pub(super) struct Aligned<'a> {
    series: &'a Series<'a>,
    /// How much earlier than the common one it moves, in seconds.
    pub(super) shift_s: f64,
    /// How many times as far it moves.
    pub(super) factor: f64,
}

impl Aligned<'_> {
    /// The common displacement at an instant, as this trial has it, in pixels.
    pub(super) fn common_px(&self, time_s: f64) -> Option<[f64; 2]> {
        Some(self.series.displacement_at_px(time_s - self.shift_s)?.map(|px| px / self.factor))
    }
}

/// One reading beside the median, along one axis.
struct Beside {
    /// Of the reading from the median.
    deviation_px: f64,
    /// What an earlier motion (a second) and a larger one (its whole) would add: the median's velocity, and the median.
    terms_px: [f64; 2],
    sigma_px: f64,
}

/// The readings of a member beside the median of the trials, along both axes.
fn beside_the_median(aligned: &[Aligned<'_>], member: usize) -> [Vec<Option<Beside>>; 2] {
    let Aligned { series, shift_s, factor } = aligned[member];
    let medians: Vec<Option<[f64; 2]>> =
        series.times_s.iter().map(|time_s| median_at_px(aligned, member, time_s + shift_s)).collect();
    let beside = |frame: usize, axis: usize| {
        let of = |frame: usize| Some((*medians.get(frame)?)?[axis]);
        let middle_px = of(frame)?;
        let before = frame.checked_sub(1)?;
        let step_s = series.times_s.get(frame + 1)? - series.times_s[before];
        // At the ends of what is known the median has no velocity to be shifted by, and its neighbours say enough.
        let velocity_px_per_s =
            of(frame + 1).zip(of(before)).map_or(0.0, |(after, before)| (after - before) / step_s);
        Some(Beside {
            deviation_px: series.displacement_px(frame)?[axis] / factor - middle_px,
            terms_px: [velocity_px_per_s, middle_px],
            sigma_px: Series::sigma_px(series.position(frame)?)[axis] / factor,
        })
    };
    [0, 1].map(|axis| (0..series.n_frames()).map(|frame| beside(frame, axis)).collect())
}

impl Beside {
    fn left(&self, factors: [f64; 2]) -> f64 {
        self.deviation_px - factors[0] * self.terms_px[0] - factors[1] * self.terms_px[1]
    }
}

/// The median of the common displacement at an instant, in pixels, with the member that asks where there are three or more; none without others.
fn median_at_px(aligned: &[Aligned<'_>], member: usize, time_s: f64) -> Option<[f64; 2]> {
    let is_asked = |other: usize| aligned.len() > 2 || other != member;
    let places: Vec<[f64; 2]> = (0..aligned.len())
        .filter(|other| is_asked(*other))
        .filter_map(|other| aligned[other].common_px(time_s))
        .collect();
    // Of two that disagree nobody knows which is right.
    let enough = if aligned.len() > 2 { 3 } else { 1 };
    if places.len() < enough {
        return None;
    }
    let along = |axis: usize| median(places.iter().map(|place| place[axis]).collect());
    Some([along(0)?, along(1)?])
}

/// The factors of both terms that leave the least sum of absolute deviations, by reweighted least squares.
fn least_absolute_deviations(readings: &[&Beside]) -> [f64; 2] {
    let mut factors = [0.0; 2];
    for _ in 0..N_PASSES {
        let (mut aa, mut ab, mut bb, mut ya, mut yb) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for one in readings {
            let sigma_px = one.sigma_px.max(f64::MIN_POSITIVE);
            let weight = (one.left(factors).abs() / sigma_px).max(SMALL).recip() / sigma_px.powi(2);
            let [a, b] = one.terms_px;
            aa += weight * a * a;
            ab += weight * a * b;
            bb += weight * b * b;
            ya += weight * a * one.deviation_px;
            yb += weight * b * one.deviation_px;
        }
        let determinant = aa * bb - ab * ab;
        // A body at rest tells neither.
        if determinant <= 1e-9 * aa * bb || !determinant.is_normal() {
            return [0.0; 2];
        }
        factors = [(ya * bb - yb * ab) / determinant, (yb * aa - ya * ab) / determinant];
    }
    factors
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_and_a_hard_strike_are_told_beside_readings_that_are_wrong() {
        let reading = |k: usize| {
            let (velocity_px, middle_px) = ((0.1 * k as f64).sin(), (0.05 * k as f64).powi(2));
            let wrong_px = if k.is_multiple_of(3) { 40.0 } else { 0.0 };
            Beside {
                deviation_px: 0.25 * velocity_px + 0.02 * middle_px + wrong_px,
                terms_px: [velocity_px, middle_px],
                sigma_px: 0.01,
            }
        };
        let readings: Vec<Beside> = (0..300).map(reading).collect();
        let [late, hard] = least_absolute_deviations(&readings.iter().collect::<Vec<_>>());
        // A third of the readings is wrong by 4000 sigma, all to one side; the least sum of absolute deviations is still exact.
        assert!((late - 0.25).abs() < 1e-3 && (hard - 0.02).abs() < 1e-3, "{late} {hard}");
    }
}
