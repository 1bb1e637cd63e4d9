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

/// A trial beside the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrialBesideOthers {
    /// Student's t.
    pub(crate) deviations: f64,
    /// Its degrees of freedom.
    pub(crate) freedom: f64,
    /// Body and frame of the reading that lies farthest from the others' mean.
    pub(crate) farthest: (usize, usize),
    /// How far, in pixels.
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
        let Sums { apart, scatter, n_readings, n_others, farthest, by_px } = sums;
        // The mean number of others, rounded down: a body that some of them lost has fewer.
        let freedom = (n_others / n_readings.max(1)).checked_sub(1).filter(|freedom| *freedom > 0)? as f64;
        let deviations = if apart > 0.0 { (apart / scatter).sqrt() } else { 0.0 };
        Some(Self { deviations, freedom, farthest, by_px })
    }
}

/// Sums over all readings of all bodies.
#[derive(Default)]
struct Sums {
    /// Of squares of the distance from the others' mean, over what that is expected to be in variances of a trial.
    apart: f64,
    /// Of variances of the others.
    scatter: f64,
    n_readings: usize,
    n_others: usize,
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
            self.n_readings += 1;
            self.n_others += others_px.len();
            let by_px = own.factor.abs() * square_px.sqrt();
            if by_px > self.by_px {
                (self.by_px, self.farthest) = (by_px, (series.body, frame));
            }
        }
    }
}
