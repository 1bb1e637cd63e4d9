//! Readings that the other trials of the view contradict.
//!
//! Trials differ by when they were triggered and how hard they were struck: to first order a body's displacement is that of the median of
//! all trials plus a shift of time, which takes its velocity, and a factor. Both are fitted for each body and recording by least absolute
//! deviations, which what is wrong in fewer than half of the readings does not move, and what is left is compared.

use chainwave_measurement::median;

use super::blocks::{Blocks, OfEach};
use super::series::Series;

/// Passes of the reweighted least squares; the weights settle to a per cent in fewer.
const N_PASSES: usize = 12;
/// Deviation below which a reading's weight stays, in standard uncertainties of a reading.
const SMALL: f64 = 0.1;

/// How far each reading lies from what the other trials say; none where there are no others.
pub(super) fn departures(group: &[&Series<'_>]) -> OfEach {
    let left: Vec<[Vec<Option<f64>>; 2]> = (0..group.len()).map(|member| left_over(group, member)).collect();
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
    let of_frame = |member: usize, frame: usize| {
        Some(departure(member, frame, 0)?.max(departure(member, frame, 1)?))
    };
    let of_member = |(member, series): (usize, &&Series<'_>)| {
        (0..series.n_frames()).map(|frame| of_frame(member, frame)).collect()
    };
    group.iter().enumerate().map(of_member).collect()
}

/// One reading beside the median of the trials, along one axis.
struct Beside {
    /// Of the reading from the median.
    deviation_px: f64,
    /// What a later trigger and a harder strike would add: the median's velocity, a frame, and the median.
    terms_px: [f64; 2],
    sigma_px: f64,
}

/// What is left of a member's displacements, along both axes, when the median of the trials, a shift of time and a factor are taken off.
fn left_over(group: &[&Series<'_>], member: usize) -> [Vec<Option<f64>>; 2] {
    let series = group[member];
    let medians: Vec<Option<[f64; 2]>> =
        series.times_s.iter().map(|time_s| median_at_px(group, member, *time_s)).collect();
    let beside = |frame: usize, axis: usize| {
        let of = |frame: Option<usize>| Some((*medians.get(frame?)?)?[axis]);
        let middle_px = of(Some(frame))?;
        let velocity_px = 0.5 * (of(Some(frame + 1))? - of(frame.checked_sub(1))?);
        Some(Beside {
            deviation_px: series.displacement_px(frame)?[axis] - middle_px,
            terms_px: [velocity_px, middle_px],
            sigma_px: Series::sigma_px(series.position(frame)?)[axis],
        })
    };
    let of_axis = |axis: usize| -> Vec<Option<Beside>> {
        (0..series.n_frames()).map(|frame| beside(frame, axis)).collect()
    };
    let axes = [of_axis(0), of_axis(1)];
    let known: Vec<&Beside> = axes.iter().flatten().flatten().collect();
    let factors = least_absolute_deviations(&known);
    axes.map(|of_axis| of_axis.into_iter().map(|one| one.map(|one| one.left(factors))).collect())
}

impl Beside {
    fn left(&self, factors: [f64; 2]) -> f64 {
        self.deviation_px - factors[0] * self.terms_px[0] - factors[1] * self.terms_px[1]
    }
}

/// The median displacement of a group at an instant, in pixels, with the member that asks where there are three or more; none without others.
fn median_at_px(group: &[&Series<'_>], member: usize, time_s: f64) -> Option<[f64; 2]> {
    let is_asked = |other: usize| group.len() > 2 || other != member;
    let places: Vec<[f64; 2]> = (0..group.len())
        .filter(|other| is_asked(*other))
        .filter_map(|other| group[other].displacement_at_px(time_s))
        .collect();
    // Of two that disagree nobody knows which is right.
    let enough = if group.len() > 2 { 3 } else { 1 };
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
            let wrong_px = if k % 3 == 0 { 40.0 } else { 0.0 };
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
