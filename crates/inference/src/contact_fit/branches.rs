//! Loading and unloading told apart by the order of the readings, and the work lost between them.

use super::outcome::Hysteresis;

/// A turn is a change of direction that the overlap follows for more than this fraction of its range.
const TURN: f64 = 0.1;
/// Readings of an ordered test follow each other: between two turns lie at least so many on average. Readings in no order
/// turn at every second or third.
const READINGS_PER_RUN: usize = 8;

/// The readings by direction, each as indices in the order they were taken.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Branches {
    /// The branch to fit.
    pub(super) loading: Vec<usize>,
    /// The way back that follows it, where there is one.
    pub(super) unloading: Vec<usize>,
    /// Number of runs in which the overlap goes one way; one for readings in no order.
    pub(super) n_runs: usize,
}

/// Tells loading from unloading by the order of the readings: the first run of growing overlap is fitted. Readings that do not
/// turn, or that are in no order, make one branch.
pub(super) fn branches(overlap_m: &[f64]) -> Branches {
    let n = overlap_m.len();
    let pivots = pivots(overlap_m);
    let n_runs = pivots.len() - 1;
    if n_runs < 2 || n < READINGS_PER_RUN * n_runs {
        return Branches { loading: (0..n).collect(), unloading: Vec::new(), n_runs: 1 };
    }
    let rises = |run: usize| overlap_m[pivots[run + 1]] > overlap_m[pivots[run]];
    let first = usize::from(!rises(0));
    let (start, top) = (pivots[first], pivots[first + 1]);
    let from = if first == 0 { 0 } else { start };
    let unloading = pivots.get(first + 2).map_or(Vec::new(), |end| {
        let back = after_hold(overlap_m, top);
        (back..=*end).collect()
    });
    Branches { loading: (from..=top).collect(), unloading, n_runs }
}

/// Indices of the first reading, of each extreme where the overlap turns, and of the last reading.
fn pivots(overlap_m: &[f64]) -> Vec<usize> {
    let (lowest, highest) = range(overlap_m.iter().copied());
    let threshold = TURN * (highest - lowest);
    let (mut low, mut high) = (0, 0);
    let mut direction = 0.0;
    let mut pivots = vec![0];
    for (i, x) in overlap_m.iter().enumerate() {
        if *x > overlap_m[high] {
            high = i;
        }
        if *x < overlap_m[low] {
            low = i;
        }
        if direction >= 0.0 && overlap_m[high] - x > threshold {
            if direction > 0.0 {
                pivots.push(high);
            }
            (direction, low) = (-1.0, i);
        } else if direction <= 0.0 && x - overlap_m[low] > threshold {
            if direction < 0.0 {
                pivots.push(low);
            }
            (direction, high) = (1.0, i);
        }
    }
    pivots.push(overlap_m.len().saturating_sub(1));
    pivots
}

/// Where the way back begins: the last of the readings that hold the largest overlap (a specimen creeps while held).
fn after_hold(overlap_m: &[f64], top: usize) -> usize {
    let held = overlap_m[top..].iter().take_while(|x| **x >= overlap_m[top]).count();
    top + held.saturating_sub(1)
}

/// Work on the way in and back over the overlaps that both branches cover; forces are free of the load cell's offset.
pub(super) fn hysteresis(
    branches: &Branches,
    overlap_m: &[f64],
    force_n: impl Fn(usize) -> f64,
) -> Option<Hysteresis> {
    if branches.unloading.len() < 2 {
        return None;
    }
    let curve = |indices: &[usize]| {
        let mut curve: Vec<(f64, f64)> = indices.iter().map(|i| (overlap_m[*i], force_n(*i))).collect();
        curve.sort_by(|left, right| left.0.total_cmp(&right.0));
        curve
    };
    let (loading, unloading) = (curve(&branches.loading), curve(&branches.unloading));
    let from_m = loading.first()?.0.max(unloading.first()?.0);
    let to_m = loading.last()?.0.min(unloading.last()?.0);
    let (loading_j, unloading_j) = (work_j(&loading, from_m, to_m), work_j(&unloading, from_m, to_m));
    (to_m > from_m && loading_j > 0.0).then(|| Hysteresis {
        from_m,
        to_m,
        loading_j,
        unloading_j,
        lost_fraction: 1.0 - unloading_j / loading_j,
    })
}

/// Area under a sorted curve between two overlaps, by trapezia.
fn work_j(curve: &[(f64, f64)], from_m: f64, to_m: f64) -> f64 {
    let trapezium = |pair: &[(f64, f64)]| {
        let [(x_0, f_0), (x_1, f_1)] = [pair[0], pair[1]];
        let (low, high) = (x_0.max(from_m), x_1.min(to_m));
        if high <= low {
            return 0.0;
        }
        let at = |x: f64| f_0 + (f_1 - f_0) * (x - x_0) / (x_1 - x_0);
        0.5 * (at(low) + at(high)) * (high - low)
    };
    curve.windows(2).map(trapezium).sum()
}

/// Smallest and largest of some numbers.
pub(super) fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(from: f64, to: f64, n: usize) -> impl Iterator<Item = f64> {
        (0..n).map(move |i| from + (to - from) * i as f64 / (n - 1) as f64)
    }

    #[test]
    fn one_way_is_one_branch() {
        for (from, to) in [(0.0, 0.01), (0.01, 0.0)] {
            let overlap_m: Vec<f64> = ramp(from, to, 50).collect();
            let found = branches(&overlap_m);
            assert_eq!((found.loading.len(), found.unloading.len(), found.n_runs), (50, 0, 1));
        }
    }

    #[test]
    fn up_and_back_is_two_and_a_hold_belongs_to_neither_twice() {
        let overlap_m: Vec<f64> =
            ramp(0.0, 0.01, 40).chain([0.01; 5]).chain(ramp(0.0099, 0.001, 30)).collect();
        let found = branches(&overlap_m);
        assert_eq!(found.loading, (0..40).collect::<Vec<_>>());
        assert_eq!(found.unloading, (44..75).collect::<Vec<_>>());
        assert_eq!(found.n_runs, 2);
    }

    #[test]
    fn of_several_cycles_the_first_loading_counts() {
        let cycle = || ramp(0.0, 0.01, 30).chain(ramp(0.0097, 0.0003, 30));
        let overlap_m: Vec<f64> = ramp(0.005, 0.0, 20).chain(cycle()).chain(cycle()).collect();
        let found = branches(&overlap_m);
        assert_eq!((found.loading.first(), found.loading.last()), (Some(&19), Some(&49)));
        assert_eq!((found.unloading.first(), found.n_runs), (Some(&49), 5));
    }

    #[test]
    fn jitter_is_no_turn_and_disorder_no_cycle() {
        let jitter = |i: usize| if i.is_multiple_of(2) { 2e-4 } else { 0.0 };
        let overlap_m: Vec<f64> = ramp(0.0, 0.01, 60).enumerate().map(|(i, x)| x + jitter(i)).collect();
        assert_eq!(branches(&overlap_m).n_runs, 1);
        let shuffled: Vec<f64> = (0..60).map(|i| overlap_m[(i * 37) % 60]).collect();
        assert_eq!(branches(&shuffled).loading.len(), 60);
    }

    #[test]
    fn the_loss_of_a_known_loop_is_found() {
        // Loading F = x, unloading F = x^2 over 0 to 1: 1/2 in, 1/3 back.
        let overlap_m: Vec<f64> = ramp(0.0, 1.0, 1001).chain(ramp(0.999, 0.0, 1000)).collect();
        let found = branches(&overlap_m);
        let force_n = |i: usize| if i <= 1000 { overlap_m[i] } else { overlap_m[i].powi(2) };
        let loss = hysteresis(&found, &overlap_m, force_n).unwrap();
        // Trapezia of width 1e-3: 1e-6 / 12 of the curvature.
        assert!((loss.lost_fraction - 1.0 / 3.0).abs() < 1e-6, "{loss:?}");
    }
}
