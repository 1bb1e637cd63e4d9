//! Energy balance, and the peaks of each gap's overlap over all steps and between them.

use pulp::{Simd, WithSimd};

use super::gap_interpolant::GapInterpolant;
use crate::equations::{
    model::ChainModel,
    state::{ChainState, Reach},
};
use crate::{
    integrator::step::TimeStep,
    lanes::{self, PADDING, PartialSums, columns::Columns, row::AlignedRow},
};

/// Relative difference of overlaps that only the interpolation between steps makes.
const SAME_OVERLAP: f64 = 1e-9;

/// What is booked after every step: how far each gap was closed and stretched, and the balance of energy.
#[derive(Debug)]
pub(crate) struct Ledger {
    /// Times a gap between bodies passed beyond its law's range in tension.
    pub(crate) tension_events: u64,
    /// Largest and smallest overlap of each gap of the row so far, in metres.
    most_m: AlignedRow,
    least_m: AlignedRow,
    /// When each gap of the row turned at its largest overlap, in seconds, and that overlap, in metres; not a number before it turned.
    turns: Vec<[f64; 2]>,
    /// Overlaps in metres below which the tension rules hold; minus infinity where no bond is.
    limits_m: Columns<1>,
    /// The first gap of each block among which one may have peaked within the step.
    may_peak: Vec<usize>,
    initial_j: Option<f64>,
    largest_j: f64,
    drift_j: f64,
}

impl Ledger {
    pub(crate) fn new(model: &ChainModel<'_>, state: &ChainState) -> Self {
        let n = model.gaps.limits_m().len();
        let mut limits_m = AlignedRow::padded(model.gaps.limits_m().iter().copied(), n);
        let bonds = model.first_gap()..model.first_gap() + model.n_gaps() + usize::from(model.has_wall());
        for (gap, limit) in limits_m.iter_mut().enumerate() {
            if !bonds.contains(&gap) {
                *limit = f64::NEG_INFINITY;
            }
        }
        let row = AlignedRow::zeros(n);
        let mut ledger = Self {
            tension_events: 0,
            most_m: row.clone(),
            turns: vec![[f64::NAN; 2]; n],
            least_m: row,
            limits_m: Columns::new([&limits_m]),
            may_peak: Vec::with_capacity(n),
            initial_j: None,
            largest_j: 0.0,
            drift_j: 0.0,
        };
        for gap in 0..model.n_masses() {
            let overlap_m = state.x_m[gap] - state.x_m[gap + 1];
            ledger.most_m[gap] = overlap_m.max(0.0);
            ledger.least_m[gap] = overlap_m.min(0.0);
            ledger.tension_events += u64::from(overlap_m < limits_m[gap]);
        }
        ledger
    }

    /// Books a step; returns the reach of all masses at its end.
    pub(crate) fn book_gaps(
        &mut self,
        model: &ChainModel<'_>,
        from: &ChainState,
        to: &ChainState,
        step: TimeStep,
    ) -> Reach {
        let reach = chainwave_vectors::dispatch(BookGaps { ledger: self, from, to, step });
        if !self.may_peak.is_empty() {
            self.book_peaks(model, [from, to], step);
        }
        reach
    }

    /// When each gap between bodies was closed the most, in seconds; none where it was never seen to open again.
    pub(crate) fn peak_times_s(&self, model: &ChainModel<'_>) -> Vec<Option<f64>> {
        let first = model.first_gap();
        let gaps = first..first + model.n_gaps();
        let most_m = self.most_m[gaps.clone()].iter();
        // A gap that is being closed further than it was when it last turned has not been seen to open again.
        let turned = |([time_s, turned_m], most_m): (&[f64; 2], &f64)| {
            (*most_m <= turned_m * (1.0 + SAME_OVERLAP)).then_some(*time_s)
        };
        self.turns[gaps].iter().zip(most_m).map(turned).collect()
    }

    /// Books the whole energy at `state`, and returns what the masses and gaps hold, in joules.
    pub(crate) fn book_total(&mut self, model: &ChainModel<'_>, state: &ChainState) -> f64 {
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

    /// Peak potential energy of each gap between bodies, in joules: the greatest between its least and its largest overlap.
    pub(crate) fn psi_max_j(&self, model: &ChainModel<'_>) -> Vec<f64> {
        let first = model.first_gap();
        (first..first + model.n_gaps())
            .map(|gap| model.spring(gap).most_energy_j(self.least_m[gap], self.most_m[gap]))
            .collect()
    }

    /// Smallest and largest overlap of a gap of the row, in metres.
    pub(crate) fn range_m(&self, gap: usize) -> [f64; 2] {
        [self.least_m[gap], self.most_m[gap]]
    }

    /// Looks for peaks between the ends of a step.
    #[cold]
    fn book_peaks(&mut self, model: &ChainModel<'_>, ends: [&ChainState; 2], step: TimeStep) {
        while let Some(first) = self.may_peak.pop() {
            for gap in first..(first + PADDING).min(model.n_masses()) {
                if self.may_peak(ends, step.h_s, gap) {
                    self.book_peak(model, ends, step, gap);
                }
            }
        }
    }

    /// Whether a gap turned within a step, and the tangent at the start leads to a new extreme before it did.
    fn may_peak(&self, ends: [&ChainState; 2], h_s: f64, gap: usize) -> bool {
        let [rate, rate_after] = ends.map(|state| state.v_m_per_s[gap] - state.v_m_per_s[gap + 1]);
        let reach_m = ends[0].x_m[gap] - ends[0].x_m[gap + 1] + h_s * rate;
        rate * rate_after < 0.0 && (reach_m > self.most_m[gap] || reach_m < self.least_m[gap])
    }

    fn book_peak(&mut self, model: &ChainModel<'_>, ends: [&ChainState; 2], step: TimeStep, gap: usize) {
        let course = GapInterpolant::of_gap(model, ends, step, gap);
        let part = course.turn();
        let peak_m = course.overlap_m(part);
        if peak_m > self.most_m[gap] || (peak_m >= self.most_m[gap] && course.rate_m_per_s(0.0) > 0.0) {
            self.most_m[gap] = peak_m;
            self.turns[gap] = [step.time_s + part * step.h_s, peak_m];
        }
        self.least_m[gap] = self.least_m[gap].min(peak_m);
    }
}

struct BookGaps<'a> {
    ledger: &'a mut Ledger,
    from: &'a ChainState,
    to: &'a ChainState,
    step: TimeStep,
}

impl WithSimd for BookGaps<'_> {
    type Output = Reach;

    /// Ends of the step for all gaps, and which of them want a look in between.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Reach {
        let Self { ledger, from, to, step } = self;
        let n = to.active;
        let h = simd.splat_f64s(step.h_s);
        let zero = simd.splat_f64s(0.0);
        let one = simd.splat_f64s(1.0);
        let none = simd.less_than_f64s(zero, zero);
        let (mut passes, mut x, mut v) = (zero, zero, zero);
        let n_blocks = n / PADDING;
        let (x_from, x_to) = (Neighbours::of(&from.x_m, n), Neighbours::of(&to.x_m, n));
        let (v_from, v_to) = (Neighbours::of(&from.v_m_per_s, n), Neighbours::of(&to.v_m_per_s, n));
        let rows = [&mut ledger.most_m, &mut ledger.least_m].map(|row| row[..n].as_chunks_mut::<PADDING>().0);
        let [most_m, least_m] = rows.map(|row| &mut row[..n_blocks]);
        let may_peak = &mut ledger.may_peak;
        // Loads are what this loop takes longest for; and of what is rare, one branch for a whole block asks.
        ledger.limits_m.for_each_block(
            simd,
            n_blocks,
            #[inline(always)]
            |block: usize, limits: [[S::f64s; 1]; PADDING]| {
                let (most, _) = S::as_mut_simd_f64s(&mut most_m[block]);
                let (least, _) = S::as_mut_simd_f64s(&mut least_m[block]);
                let (mut peaks, mut beyond) = (none, none);
                for i in 0..PartialSums::<S>::VECTORS {
                    x = simd.max_f64s(x, simd.abs_f64s(S::as_simd_f64s(&x_to.left[block]).0[i]));
                    v = simd.max_f64s(v, simd.abs_f64s(S::as_simd_f64s(&v_to.left[block]).0[i]));
                    let (before, after) =
                        (x_from.difference(simd, block, i), x_to.difference(simd, block, i));
                    let rate = v_from.difference(simd, block, i);
                    let turned =
                        simd.less_than_f64s(simd.mul_f64s(rate, v_to.difference(simd, block, i)), zero);
                    let reach = simd.mul_add_f64s(h, rate, before);
                    let (high, low, [limit]) = (most[i], least[i], limits[i]);
                    let extreme =
                        simd.or_m64s(simd.less_than_f64s(high, reach), simd.less_than_f64s(reach, low));
                    peaks = simd.or_m64s(peaks, simd.and_m64s(turned, extreme));
                    beyond = simd.or_m64s(beyond, simd.less_than_f64s(after, limit));
                    least[i] = simd.min_f64s(low, after);
                    most[i] = simd.max_f64s(high, after);
                }
                if simd.first_true_m64s(simd.or_m64s(peaks, beyond)) >= S::F64_LANES {
                    return;
                }
                if simd.first_true_m64s(peaks) < S::F64_LANES {
                    may_peak.push(block * PADDING);
                }
                for (i, [limit]) in limits.into_iter().enumerate().take(PartialSums::<S>::VECTORS) {
                    let (before, after) =
                        (x_from.difference(simd, block, i), x_to.difference(simd, block, i));
                    let within = simd.select_f64s(simd.less_than_f64s(before, limit), zero, one);
                    let is_beyond = simd.less_than_f64s(after, limit);
                    passes = simd.add_f64s(passes, simd.select_f64s(is_beyond, within, zero));
                }
            },
        );
        ledger.tension_events += simd.reduce_sum_f64s(passes) as u64;
        Reach { x_m: simd.reduce_max_f64s(x), v_m_per_s: simd.reduce_max_f64s(v) }
    }
}

/// A row's values, and their neighbours to the right, block by block.
struct Neighbours<'a> {
    left: &'a [[f64; PADDING]],
    right: &'a [[f64; PADDING]],
}

impl<'a> Neighbours<'a> {
    #[inline(always)]
    fn of(row: &'a [f64], n: usize) -> Self {
        Self { left: &lanes::blocks(row)[..n / PADDING], right: &lanes::blocks(&row[1..=n])[..n / PADDING] }
    }

    /// By how much the values of a block's vector number `i` exceed their neighbours.
    #[inline(always)]
    fn difference<S: Simd>(&self, simd: S, block: usize, i: usize) -> S::f64s {
        let (left, right) = (S::as_simd_f64s(&self.left[block]).0, S::as_simd_f64s(&self.right[block]).0);
        simd.sub_f64s(left[i], right[i])
    }
}
