//! How well a frame resembles each part of a subset: what tells a texture that has changed from something that lies over a part of it.

use crate::warp::Warp;
use crate::{PreparedSubset, Window, Workspace};

/// Parts along each axis: with halves a rod across the middle would cover all of them alike.
const N_ALONG: usize = 3;
const N_CELLS: usize = N_ALONG * N_ALONG;
/// Pixels of a part from which on its correlation is one.
const LEAST_PIXELS: f64 = 20.0;
/// Of the parts those with the least loss that may lose less than all do: what covers two thirds of a subset, from the left or
/// through its middle, leaves as many untouched, and of a few speckles a part loses half more or less than another by chance.
const N_UNTOUCHED: usize = 2;
/// Share of the whole loss that any further part has lost where all of the texture has changed.
const LEAST_LOSS: f64 = 0.5;

/// The correlation of each part of a subset with a frame, for a gain and offset of its own: light that changes along the subset is no other
/// texture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cells {
    /// None of a part that holds next to nothing of the subset.
    zncc: [Option<f64>; N_CELLS],
}

/// Sums over the pixels of a part.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    n: f64,
    /// f, g, f^2, f g and g^2 of reference and target.
    of_powers: [f64; 5],
}

impl Sums {
    fn zncc(&self) -> Option<f64> {
        let Self { n, of_powers: [f, g, ff, fg, gg] } = *self;
        let (of_reference, of_target) = (ff - f * f / n, gg - g * g / n);
        let zncc = (fg - f * g / n) / (of_reference * of_target).sqrt();
        (n >= LEAST_PIXELS && zncc.is_finite()).then_some(zncc)
    }
}

impl Cells {
    /// Of a subset under a warp; `None` where the frame does not show all of it.
    pub(crate) fn of(
        subset: &PreparedSubset,
        window: &Window,
        warp: &Warp,
        workspace: &mut Workspace,
    ) -> Option<Self> {
        subset.compare(window, warp, workspace)?;
        let mut sums = [Sums::default(); N_CELLS];
        let place = |at: usize, n: usize| (at * N_ALONG / n.max(1)).min(N_ALONG - 1);
        let pixels = subset.intensity.iter().zip(&workspace.samples).zip(subset.weights.iter());
        for (i, ((f, g), weight)) in pixels.take(subset.n_pixels()).enumerate() {
            if *weight > 0.0 {
                let (row, column) = (i / subset.width, i % subset.width);
                let sums = &mut sums[place(row, subset.height) * N_ALONG + place(column, subset.width)];
                let (f, g) = (f64::from(*f), f64::from(*g));
                sums.n += 1.0;
                sums.of_powers
                    .iter_mut()
                    .zip([f, g, f * f, f * g, g * g])
                    .for_each(|(sum, term)| *sum += term);
            }
        }
        Some(Self { zncc: sums.map(|sums| sums.zncc()) })
    }

    /// Whether all parts have lost a share of what the whole subset has since these.
    pub(crate) fn have_all_lost(&self, now: &Self, whole_loss: f64) -> bool {
        let loss = |(before, now): (&Option<f64>, &Option<f64>)| Some((*before)? - (*now)?);
        let mut losses: Vec<f64> = self.zncc.iter().zip(&now.zncc).filter_map(loss).collect();
        losses.sort_by(f64::total_cmp);
        // Of fewer parts, as an outline leaves them, fewer may be untouched.
        let n_untouched = N_UNTOUCHED * losses.len() / N_CELLS;
        losses.get(n_untouched).is_some_and(|loss| *loss >= LEAST_LOSS * whole_loss)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(zncc: [f64; N_CELLS]) -> Cells {
        Cells { zncc: zncc.map(Some) }
    }

    #[test]
    fn what_covers_a_part_leaves_others_untouched() {
        let before = cells([0.98; N_CELLS]);
        let changed = cells([0.8, 0.7, 0.85, 0.75, 0.6, 0.8, 0.9, 0.7, 0.75]);
        assert!(before.have_all_lost(&changed, 0.2));
        let from_left = cells([0.1, 0.5, 0.97, 0.0, 0.4, 0.98, 0.1, 0.5, 0.98]);
        let rod = cells([0.98, 0.3, 0.98, 0.97, 0.2, 0.98, 0.98, 0.3, 0.98]);
        assert!(!before.have_all_lost(&from_left, 0.45) && !before.have_all_lost(&rod, 0.3));
        let shadow = cells([0.97; N_CELLS]);
        assert!(!before.have_all_lost(&shadow, 0.2), "each part of it is what it was");
    }
}
