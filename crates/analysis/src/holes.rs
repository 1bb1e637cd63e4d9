//! Whether samples that are missing hide the peak that is looked for.

use crate::local::level;

/// Whether a hole begins on either side of a summit before the series has fallen by so much: then the highest sample may be the hole's edge, and the peak lie
/// within. A fall that is seen behind the hole alone does not tell. Where nothing is seen any more, up to the record's end, it is the end that counts.
pub(crate) fn is_beside_a_hole(smoothed: &[Option<f64>], summit: usize, fall: f64) -> bool {
    let lowest = level(smoothed, summit) - fall;
    let is_cut = |side: &[usize]| {
        let has_fallen = |at: &usize| smoothed[*at].is_some_and(|value| value <= lowest);
        let is_seen_behind = |hole: usize| side[hole..].iter().any(|at| smoothed[*at].is_some());
        let hole = side.iter().take_while(|at| !has_fallen(at)).position(|at| smoothed[*at].is_none());
        hole.is_some_and(is_seen_behind)
    };
    let before: Vec<usize> = (0..summit).rev().collect();
    let behind: Vec<usize> = (summit + 1..smoothed.len()).collect();
    is_cut(&before) || is_cut(&behind)
}

/// Whether a hole before a summit hides an earlier peak: what is seen behind it comes down by so much before it rises to the summit, or opens the gap,
/// which no gap does that a wave has not passed.
pub(crate) fn is_behind_a_hidden_one(smoothed: &[Option<f64>], summit: usize, fall: f64) -> bool {
    let hides = |hole: usize| {
        let lowest = smoothed[hole + 1..summit].iter().flatten().copied().fold(f64::INFINITY, f64::min);
        level(smoothed, hole + 1) - lowest > fall || lowest < -fall
    };
    (0..summit).any(|at| smoothed[at].is_none() && smoothed[at + 1].is_some() && hides(at))
}
