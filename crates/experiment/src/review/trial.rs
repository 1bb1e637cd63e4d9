//! One trial beside the others of its view, by what these scatter.
//!
//! Trials that are struck differently do not only move by other factors and at other times: the wave's form depends on the strike, by as much
//! as the chain is not linear, and nobody has to know by how much. So what alignment leaves of a trial is held against what it leaves of the
//! others among themselves. Where one thing differs from trial to trial, as a strike does, e_r(t) = d_r g(t) with normal d_r, and
//!
//! t^2 = sum of (e - mean)^2 / ((1 + 1/n) sum of s^2)
//!
//! is that of Student's t with n - 1 degrees of freedom, whatever g is: mean and variance s^2 are of the n others, sums go over all readings
//! of all bodies. Where several things differ, noise among them, both sums average over them, and large ratios are rarer than that.

use super::ReviewedRecording;
use super::groups;
use super::others::aligned;
use super::series::Series;

/// Fewest others that scatter.
const LEAST_OTHERS: usize = 2;

/// A trial beside the others, as root mean squares over all readings, in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrialBesideOthers {
    /// Distance from the others' mean, over the root of 1 + 1/n: as far as one trial lies from where all would.
    pub(crate) apart_px: f64,
    /// How the others scatter.
    pub(crate) scatter_px: f64,
    /// Degrees of freedom by which that is known, where one thing differs from trial to trial.
    pub(crate) degrees_of_freedom: f64,
    /// Body and frame of the reading that lies farthest from the others' mean.
    pub(crate) farthest: (usize, usize),
    /// How far.
    pub(crate) by_px: f64,
}

impl TrialBesideOthers {
    /// The recording at a place in the list, beside the others of its view; none where fewer than two saw what it saw.
    pub(crate) fn of(recordings: &[ReviewedRecording<'_>], own: usize) -> Option<Self> {
        let series: Vec<Series<'_>> =
            recordings.iter().enumerate().flat_map(|(index, one)| Series::all_of(index, one)).collect();
        let mut sums = Sums::default();
        for group in groups(&series) {
            if let Some(member) = group.iter().position(|series| series.recording == own) {
                sums.add(&group, member);
            }
        }
        let n = Some(sums.n_readings).filter(|n| *n > 0.0)?;
        let [apart_px, scatter_px] = [sums.apart, sums.scatter].map(|sum| (sum / n).sqrt());
        let Sums { n_others, farthest, by_px, .. } = sums;
        let degrees_of_freedom = n_others / n - 1.0;
        Some(Self { apart_px, scatter_px, degrees_of_freedom, farthest, by_px })
    }
}

/// Sums over all readings of all bodies.
#[derive(Default)]
struct Sums {
    /// Of squares of the distance from the others' mean, over what that is expected to be in variances of a trial.
    apart: f64,
    /// Of variances of the others.
    scatter: f64,
    n_readings: f64,
    n_others: f64,
    farthest: (usize, usize),
    by_px: f64,
}

impl Sums {
    /// Adds the readings of one body.
    fn add(&mut self, group: &[&Series<'_>], member: usize) {
        let aligned = aligned(group);
        let (series, own) = (group[member], &aligned[member]);
        for frame in 0..series.n_frames() {
            let time_s = series.times_s[frame] + own.shift_s;
            let Some(here_px) = own.common_px(time_s) else { continue };
            let others = (0..group.len()).filter(|other| *other != member);
            let others_px: Vec<[f64; 2]> =
                others.filter_map(|other| aligned[other].common_px(time_s)).collect();
            if others_px.len() < LEAST_OTHERS {
                continue;
            }
            let n = others_px.len() as f64;
            let mut square_px = 0.0;
            for axis in [0, 1] {
                let mean = others_px.iter().map(|at| at[axis]).sum::<f64>() / n;
                let variance = others_px.iter().map(|at| (at[axis] - mean).powi(2)).sum::<f64>() / (n - 1.0);
                let square = (here_px[axis] - mean).powi(2);
                self.apart += square / (1.0 + n.recip());
                self.scatter += variance;
                square_px += square;
            }
            self.n_readings += 1.0;
            self.n_others += n;
            let by_px = own.factor.abs() * square_px.sqrt();
            if by_px > self.by_px {
                (self.by_px, self.farthest) = (by_px, (series.body, frame));
            }
        }
    }
}
