//! The highest place of a smooth function.

/// Share of a stretch that a golden section leaves on its longer side.
const GOLDEN_SHARE: f64 = 0.618_033_988_749_895;
/// Places asked for at most: golden sections alone, which always end, would need some thirty.
const MAX_PLACES: usize = 60;

/// The place between `low` and `high` where a function that rises to one maximum there is highest, to the `tolerance`, beginning at `start`: by
/// parabolas through the three highest places, and golden sections where these do not close in (R. P. Brent, Algorithms for Minimization without
/// Derivatives (1973), chapter 5). `None` where the function is not known at a place that it asks for.
pub fn summit(
    function: impl Fn(f64) -> Option<f64>,
    [mut low, mut high]: [f64; 2],
    start: f64,
    tolerance: f64,
) -> Option<f64> {
    // The three highest places.
    let mut best = (start, function(start)?);
    let (mut second, mut third) = (None, None);
    let (mut step, mut step_before) = (0.0_f64, 0.0_f64);
    for _ in 0..MAX_PLACES {
        let middle = 0.5 * (low + high);
        if (best.0 - middle).abs() <= 2.0 * tolerance - 0.5 * (high - low) {
            break;
        }
        let by_parabola = vertex(best, second, third).filter(|to| {
            (to - best.0).abs() < 0.5 * step_before.abs() && (low + tolerance..high - tolerance).contains(to)
        });
        let (to, longest) = by_parabola.map_or_else(
            || {
                let end = if best.0 < middle { high } else { low };
                (best.0 + (1.0 - GOLDEN_SHARE) * (end - best.0), end - best.0)
            },
            |to| (to, step),
        );
        (step_before, step) = (longest, to - best.0);
        // Nearer places tell nothing but rounding.
        let at = if step.abs() >= tolerance { to } else { best.0 + tolerance.copysign(step) };
        let there = (at, function(at)?);
        if there.1 >= best.1 {
            *(if at >= best.0 { &mut low } else { &mut high }) = best.0;
            (third, second, best) = (second, Some(best), there);
        } else {
            *(if at >= best.0 { &mut high } else { &mut low }) = at;
            let is_above = |other: Option<(f64, f64)>| other.is_none_or(|other| there.1 >= other.1);
            if is_above(second) {
                (third, second) = (second, Some(there));
            } else if is_above(third) {
                third = Some(there);
            }
        }
    }
    Some(best.0)
}

/// Where a parabola through three places and its values there is highest; `None` where they are not three, or its height is in none.
fn vertex(best: (f64, f64), second: Option<(f64, f64)>, third: Option<(f64, f64)>) -> Option<f64> {
    let (second, third) = (second?, third?);
    let left = (best.0 - second.0) * (best.1 - third.1);
    let right = (best.0 - third.0) * (best.1 - second.1);
    let above = (best.0 - third.0) * right - (best.0 - second.0) * left;
    let to = best.0 - 0.5 * above / (right - left);
    to.is_finite().then_some(to)
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    const TOLERANCE: f64 = 1e-6;

    /// The place that is found, and how many were asked for.
    fn found(function: impl Fn(f64) -> f64, between: [f64; 2], start: f64) -> (f64, usize) {
        let n_asked = Cell::new(0);
        let counted = |place: f64| {
            assert!((between[0]..=between[1]).contains(&place), "{place} of {between:?}");
            n_asked.set(n_asked.get() + 1);
            Some(function(place))
        };
        (summit(counted, between, start, TOLERANCE).unwrap(), n_asked.get())
    }

    #[test]
    fn it_finds_summits_that_are_smooth_sharp_flat_or_at_an_end() {
        let shapes: [(&dyn Fn(f64) -> f64, f64); 5] = [
            (&|x| -(x - 0.3).powi(2), 0.3),
            (&|x| (x + 0.1).cosh().powi(-2), -0.1),
            (&|x| -(x - 0.2).abs(), 0.2),
            (&|x| x, 1.0),
            (&|x| -x, -1.0),
        ];
        for (shape, expected) in shapes {
            for start in [-0.9, 0.0, 0.3, 0.95] {
                let (place, n_asked) = found(shape, [-1.0, 1.0], start);
                // It ends where the stretch is twice the tolerance on each side.
                assert!((place - expected).abs() <= 3.0 * TOLERANCE, "{place} for {expected}");
                assert!(n_asked <= MAX_PLACES);
            }
        }
        // Near its summit a fourth power is as flat as rounding from 1 within (2^-53)^(1/4) of it.
        let (place, _) = found(|x| 1.0 - (x - 0.4).powi(4), [-1.0, 1.0], 0.0);
        assert!((place - 0.4).abs() < 2e-4, "{place}");
    }

    #[test]
    fn a_smooth_summit_takes_a_third_of_what_golden_sections_take() {
        let (place, n_asked) = found(|x| (x - 0.05).cosh().powi(-2), [-0.25, 0.25], 0.0);
        assert!((place - 0.05).abs() <= 3.0 * TOLERANCE, "{place}");
        let by_sections = ((0.5 / TOLERANCE).ln() / GOLDEN_SHARE.recip().ln()).ceil();
        assert!(3.0 * n_asked as f64 <= by_sections, "{n_asked} of {by_sections}");
    }

    #[test]
    fn what_is_not_known_has_no_summit() {
        assert_eq!(summit(|x| (x < 0.5).then_some(x), [-1.0, 1.0], 0.0, TOLERANCE), None);
        assert_eq!(summit(|_| None, [-1.0, 1.0], 0.0, TOLERANCE), None);
    }
}
