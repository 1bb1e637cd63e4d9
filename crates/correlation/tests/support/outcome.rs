//! What a field or tracks say of pictures whose truth is known: right, lost, or wrong.

#![expect(unreachable_pub, reason = "a module of several test binaries")]

use std::fmt;
use std::iter::Sum;

use chainwave_measurement::Position;

/// Errors beyond so many pixels and so many sigma more are no errors of a match, but another place.
const WRONG: (f64, f64) = (1.0, 6.0);

/// Counts of readings.
#[derive(Debug, Default, Clone, Copy)]
pub struct Outcome {
    pub n_asked: usize,
    pub n_ok: usize,
    pub n_wrong: usize,
    /// Readings whose subset the picture shows whole.
    pub n_visible: usize,
    /// Of these, right.
    pub n_found: usize,
}

impl Outcome {
    /// What one reading says where the truth is a place, or that there is none; and whether the picture shows the subset whole.
    pub fn of(found: Option<&Position>, truth: Option<[f64; 2]>, visible: bool) -> Self {
        let right = found.map(|found| truth.is_some_and(|truth| is_right(found, truth)));
        Self {
            n_asked: 1,
            n_ok: usize::from(right.is_some()),
            n_wrong: usize::from(right == Some(false)),
            n_visible: usize::from(visible),
            n_found: usize::from(visible && right == Some(true)),
        }
    }
}

fn is_right(found: &Position, truth: [f64; 2]) -> bool {
    [found.x_px, found.y_px]
        .iter()
        .zip(truth)
        .all(|(found, truth)| (found.value - truth).abs() <= WRONG.0 + WRONG.1 * found.sigma)
}

impl Sum for Outcome {
    fn sum<I: Iterator<Item = Self>>(outcomes: I) -> Self {
        outcomes.fold(Self::default(), |sum, one| Self {
            n_asked: sum.n_asked + one.n_asked,
            n_ok: sum.n_ok + one.n_ok,
            n_wrong: sum.n_wrong + one.n_wrong,
            n_visible: sum.n_visible + one.n_visible,
            n_found: sum.n_found + one.n_found,
        })
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { n_asked, n_ok, n_wrong, n_visible, n_found } = self;
        write!(
            f,
            "asked {n_asked:8}  ok {n_ok:8}  wrong {n_wrong:5}  found {n_found:8} of {n_visible:8} visible"
        )
    }
}
