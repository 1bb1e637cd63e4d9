use std::ops::Range;

use pulp::{Simd, WithSimd};

use crate::{
    integrator::Step,
    lanes::{Lanes, vectorised},
    model::Model,
    state::State,
};

/// What is booked after every step: how far each gap was closed and stretched, and the balance of energy.
#[derive(Debug)]
pub(crate) struct Ledger {
    /// Times a gap between bodies passed beyond its law's range in tension.
    pub(crate) tension_events: u64,
    /// Largest and smallest overlap of each gap of the row so far, in metres.
    most_m: Vec<f64>,
    least_m: Vec<f64>,
    /// When each gap of the row turned at its largest overlap, in seconds; not a number before it turned.
    most_at_s: Vec<f64>,
    /// Overlaps in metres below which the tension rules hold; minus infinity where no bond is.
    limits_m: Vec<f64>,
    initial_j: Option<f64>,
    largest_j: f64,
    drift_j: f64,
}

impl Ledger {
    pub(crate) fn new(model: &Model<'_>, state: &State) -> Self {
        let mut limits_m = model.gaps.limits_m().to_vec();
        let bonds = model.first_gap()..model.n_masses() - usize::from(!model.has_wall);
        for (gap, limit) in limits_m.iter_mut().enumerate() {
            if !bonds.contains(&gap) {
                *limit = f64::NEG_INFINITY;
            }
        }
        let row = vec![0.0; limits_m.len()];
        let mut ledger = Self {
            tension_events: 0,
            most_m: row.clone(),
            most_at_s: vec![f64::NAN; row.len()],
            least_m: row,
            limits_m,
            initial_j: None,
            largest_j: 0.0,
            drift_j: 0.0,
        };
        for gap in 0..model.n_masses() {
            let overlap_m = state.x_m[gap] - state.x_m[gap + 1];
            ledger.most_m[gap] = overlap_m.max(0.0);
            ledger.least_m[gap] = overlap_m.min(0.0);
            ledger.tension_events += u64::from(overlap_m < ledger.limits_m[gap]);
        }
        ledger
    }

    /// Books a step; returns the largest displacement (metres) and velocity (metres per second) at its end.
    pub(crate) fn book_gaps(
        &mut self,
        model: &Model<'_>,
        from: &State,
        to: &State,
        step: Step,
    ) -> (f64, f64) {
        vectorised(BookGaps { ledger: self, model, from, to, step })
    }

    /// When each gap between bodies was closed the most, in seconds; none where it was never seen to open again.
    pub(crate) fn peak_times_s(&self, model: &Model<'_>) -> Vec<Option<f64>> {
        let first = model.first_gap();
        let times_s = self.most_at_s[first..first + model.n_gaps()].iter();
        times_s.map(|time_s| time_s.is_finite().then_some(*time_s)).collect()
    }

    /// Books the whole energy at `state`, and returns what the masses and gaps hold, in joules.
    pub(crate) fn book_total(&mut self, model: &Model<'_>, state: &State) -> f64 {
        let held_j = model.energy_j(state);
        let initial_j = *self.initial_j.get_or_insert(held_j);
        self.largest_j = self.largest_j.max(held_j);
        self.drift_j = self.drift_j.max((held_j + state.lost_j - initial_j).abs());
        held_j
    }

    /// Largest change of held and lost energy, over the largest energy held; the latter is the initial energy, except
    /// for an imposed motion, which feeds energy in.
    pub(crate) fn energy_drift(&self) -> f64 {
        if self.largest_j > 0.0 { self.drift_j / self.largest_j } else { self.drift_j }
    }

    /// Peak potential energy of each gap between bodies, in joules. The energy grows with the overlap's distance from zero,
    /// so it peaks where the overlap does.
    pub(crate) fn psi_max_j(&self, model: &Model<'_>) -> Vec<f64> {
        let first = model.first_gap();
        let energy = |gap: usize, overlap_m: f64| model.spring(gap).force_and_energy(overlap_m).1;
        (first..first + model.n_gaps())
            .map(|gap| energy(gap, self.most_m[gap]).max(energy(gap, self.least_m[gap])))
            .collect()
    }

    /// Smallest and largest overlap of a gap of the row, in metres.
    pub(crate) fn range_m(&self, gap: usize) -> [f64; 2] {
        [self.least_m[gap], self.most_m[gap]]
    }

    /// Looks for peaks between the ends of a step.
    #[cold]
    fn book_peaks(&mut self, model: &Model<'_>, ends: [&State; 2], step: Step, gaps: Range<usize>) {
        for gap in gaps.start..gaps.end.min(model.n_masses()) {
            let [rate, rate_after] = ends.map(|state| state.v_m_per_s[gap] - state.v_m_per_s[gap + 1]);
            if rate * rate_after < 0.0 {
                let [before, after] = ends.map(|state| Course::of_gap(model, state, gap));
                let (part, peak_m) = peak_between(before, after, step.h_s);
                if peak_m > self.most_m[gap] || (peak_m >= self.most_m[gap] && rate > 0.0) {
                    self.most_m[gap] = peak_m;
                    self.most_at_s[gap] = step.time_s + part * step.h_s;
                }
                self.least_m[gap] = self.least_m[gap].min(peak_m);
            }
        }
    }
}

struct BookGaps<'a> {
    ledger: &'a mut Ledger,
    model: &'a Model<'a>,
    from: &'a State,
    to: &'a State,
    step: Step,
}

impl WithSimd for BookGaps<'_> {
    type Output = (f64, f64);

    /// Ends of the step for all gaps; a peak in between only where the tangent at the start leads to a new extreme before the
    /// gap turns.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> (f64, f64) {
        let Self { ledger, model, from, to, step } = self;
        let n = to.active;
        let h = Lanes::<S, 1>::splat(simd, step.h_s);
        let (zero, one) = (h.constant(0.0), h.constant(1.0));
        let (mut passes, mut x, mut v) = (zero, zero, zero);
        for vector in 0..n / S::F64_LANES {
            x = x.max(Lanes::new(simd, [S::as_simd_f64s(&to.x_m).0[vector]]).abs());
            v = v.max(Lanes::new(simd, [S::as_simd_f64s(&to.v_m_per_s).0[vector]]).abs());
            let before = differences(simd, &from.x_m[..=n], vector);
            let after = differences(simd, &to.x_m[..=n], vector);
            let rate = differences(simd, &from.v_m_per_s[..=n], vector);
            let turned = (rate * differences(simd, &to.v_m_per_s[..=n], vector)).select_less(zero, one, zero);
            let reach = h.mul_add(rate, before);
            let most = Lanes::new(simd, [S::as_simd_f64s(&ledger.most_m).0[vector]]);
            let least = Lanes::new(simd, [S::as_simd_f64s(&ledger.least_m).0[vector]]);
            let limit = Lanes::new(simd, [S::as_simd_f64s(&ledger.limits_m).0[vector]]);
            let extreme = most.select_less(reach, turned, reach.select_less(least, turned, zero));
            passes = passes + after.select_less(limit, before.select_less(limit, zero, one), zero);
            [S::as_mut_simd_f64s(&mut ledger.least_m).0[vector]] = least.min(after).values();
            if extreme.largest() > 0.0 {
                let first = vector * S::F64_LANES;
                ledger.book_peaks(model, [from, to], step, first..first + S::F64_LANES);
            }
            let most = Lanes::new(simd, [S::as_simd_f64s(&ledger.most_m).0[vector]]);
            [S::as_mut_simd_f64s(&mut ledger.most_m).0[vector]] = most.max(after).values();
        }
        ledger.tension_events += passes.total() as u64;
        (x.largest(), v.largest())
    }
}

/// Differences of a row's neighbours, for one vector of gaps.
#[inline(always)]
fn differences<S: Simd>(simd: S, row: &[f64], vector: usize) -> Lanes<S, 1> {
    let left = S::as_simd_f64s(row).0[vector];
    let right = S::as_simd_f64s(&row[1..]).0[vector];
    Lanes::new(simd, [left]) - Lanes::new(simd, [right])
}

/// Overlap of a gap with its first two derivatives in time.
#[derive(Debug, Clone, Copy)]
struct Course {
    overlap_m: f64,
    rate_m_per_s: f64,
    bend_m_per_s2: f64,
}

impl Course {
    fn of_gap(model: &Model<'_>, state: &State, gap: usize) -> Self {
        let behind_m_per_s2 =
            if gap + 1 < model.n_masses() { model.acceleration_m_per_s2(gap + 1, state) } else { 0.0 };
        Self {
            overlap_m: state.x_m[gap] - state.x_m[gap + 1],
            rate_m_per_s: state.v_m_per_s[gap] - state.v_m_per_s[gap + 1],
            bend_m_per_s2: model.acceleration_m_per_s2(gap, state) - behind_m_per_s2,
        }
    }
}

/// Corrections of a turn's place by Newton's method; at a turn the overlap changes with the square of what is left.
const CORRECTIONS: u32 = 5;

/// The turning point of the quintic through both courses, as a part of the step and an overlap, which makes the peak independent of where the steps fall, to sixth
/// order in the step.
fn peak_between(before: Course, after: Course, h_s: f64) -> (f64, f64) {
    let change = after.overlap_m - before.overlap_m;
    let (v_0, v_1) = (h_s * before.rate_m_per_s, h_s * after.rate_m_per_s);
    let (a_0, a_1) = (h_s * h_s * before.bend_m_per_s2, h_s * h_s * after.bend_m_per_s2);
    let cube = 10.0 * change - 6.0 * v_0 - 4.0 * v_1 - 1.5 * a_0 + 0.5 * a_1;
    let fourth = -15.0 * change + 8.0 * v_0 + 7.0 * v_1 + 1.5 * a_0 - a_1;
    let fifth = 6.0 * change - 3.0 * (v_0 + v_1) - 0.5 * (a_0 - a_1);
    let mut s = v_0 / (v_0 - v_1);
    for _ in 0..CORRECTIONS {
        let rate = v_0 + s * (a_0 + s * (3.0 * cube + s * (4.0 * fourth + s * 5.0 * fifth)));
        let bend = a_0 + s * (6.0 * cube + s * (12.0 * fourth + s * 20.0 * fifth));
        let next = s - rate / bend;
        s = if next > 0.0 && next < 1.0 { next } else { s };
    }
    (s, before.overlap_m + s * (v_0 + s * (0.5 * a_0 + s * (cube + s * (fourth + s * fifth)))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_of_a_quintic_is_found() {
        // x = 1 + 2 t - t^2 - t^3 + t^5 / 10 turns where 2 - 2 t - 3 t^2 + t^4 / 2 = 0, in [0, 1] near t = 0.56.
        let course = |t: f64| Course {
            overlap_m: 1.0 + t * (2.0 - t * (1.0 + t * (1.0 - t * t / 10.0))),
            rate_m_per_s: 2.0 - t * (2.0 + t * (3.0 - t * t / 2.0)),
            bend_m_per_s2: -2.0 - t * (6.0 - 2.0 * t * t),
        };
        let mut t = 0.56;
        for _ in 0..20 {
            t -= course(t).rate_m_per_s / course(t).bend_m_per_s2;
        }
        let peak_m = course(t).overlap_m;
        for (start, end) in [(0.0, 1.0), (0.5, 0.7), (0.55, 0.9)] {
            let (part, found_m) = peak_between(course(start), course(end), end - start);
            assert!((start + part * (end - start) - t).abs() < 1e-9);
            // A few roundings of numbers near 2.
            assert!((found_m - peak_m).abs() < 2e-15, "{start} {end}: {found_m} {peak_m}");
        }
    }
}
