//! What is usual among like readings, piece by piece of time: medians over all trials of a view.

use std::collections::BTreeMap;

use chainwave_measurement::{median, median_and_robust_sigma};

use super::series::Series;

/// Frames of a piece; with its two neighbours it gives 48 values a trial, whose median absolute deviation is known to a tenth, and the
/// wave changes little meanwhile.
const PIECE: f64 = 16.0;

/// What each reading of a group shows, in the order of its members and frames; none where there is nothing to show.
pub(super) type OfEach = Vec<Vec<Option<f64>>>;

/// Medians of a quantity of a group, by pieces of time.
pub(super) struct Blocks {
    first_s: f64,
    piece_s: f64,
    /// The median of a piece and its neighbours, and the standard deviation that the median absolute deviation tells.
    usual: BTreeMap<usize, [f64; 2]>,
}

impl Blocks {
    /// Of values of a group's readings.
    pub(super) fn of(group: &[&Series<'_>], values: &OfEach) -> Self {
        let firsts = group.iter().filter_map(|one| one.times_s.first().copied());
        let first_s = firsts.fold(f64::INFINITY, f64::min);
        let steps = group.iter().flat_map(|one| one.times_s.windows(2).map(|pair| pair[1] - pair[0]));
        let piece_s = PIECE * median(steps.collect()).filter(|step_s| *step_s > 0.0).unwrap_or(1.0);
        let mut blocks = Self { first_s, piece_s, usual: BTreeMap::new() };
        let mut pieces: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for (series, values) in group.iter().zip(values) {
            for (time_s, value) in series.times_s.iter().zip(values) {
                if let Some(value) = value {
                    pieces.entry(blocks.piece(*time_s)).or_default().push(*value);
                }
            }
        }
        for piece in pieces.keys() {
            let near = pieces.range(piece.saturating_sub(1)..=piece.saturating_add(1));
            let around: Vec<f64> = near.flat_map(|(_, values)| values).copied().collect();
            blocks.usual.extend(median_and_robust_sigma(around).map(|usual| (*piece, usual)));
        }
        blocks
    }

    /// The median at an instant, and the standard deviation that the median absolute deviation tells.
    pub(super) fn at(&self, time_s: f64) -> Option<[f64; 2]> {
        self.usual.get(&self.piece(time_s)).copied()
    }

    fn piece(&self, time_s: f64) -> usize {
        ((time_s - self.first_s) / self.piece_s) as usize // casts saturate
    }
}
