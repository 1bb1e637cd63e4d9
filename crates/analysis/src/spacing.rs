//! How far apart neighbours rest.

use crate::AnalysisError;
use crate::check::check_positive;

/// Distances between neighbours at rest: the same in every gap, or each gap's own.
#[derive(Debug, Clone, PartialEq)]
pub struct Spacing {
    /// Mean distance in metres.
    mean_m: f64,
    /// Distance in each gap in metres, from gap 1 on; none where all are alike.
    gaps_m: Vec<f64>,
}

impl From<f64> for Spacing {
    /// The same distance in metres in every gap.
    fn from(pitch_m: f64) -> Self {
        Self { mean_m: pitch_m, gaps_m: Vec::new() }
    }
}

impl From<Vec<f64>> for Spacing {
    /// A distance in metres for each gap, from gap 1 on.
    fn from(gaps_m: Vec<f64>) -> Self {
        let first_m = gaps_m.first().copied().unwrap_or(f64::NAN);
        if gaps_m.iter().all(|gap_m| gap_m.total_cmp(&first_m).is_eq()) {
            return Self::from(first_m);
        }
        Self { mean_m: gaps_m.iter().sum::<f64>() / gaps_m.len() as f64, gaps_m }
    }
}

impl Spacing {
    /// Mean distance in metres.
    pub fn mean_m(&self) -> f64 {
        self.mean_m
    }

    /// Distance in metres in a gap, from 1; beyond the last one as in that.
    pub fn of_gap_m(&self, gap: usize) -> f64 {
        let last = self.gaps_m.len().saturating_sub(1);
        self.gaps_m.get(gap.saturating_sub(1).min(last)).copied().unwrap_or(self.mean_m)
    }

    /// Distance in metres from body 1 to another at rest, both counted from 1; bodies before the first and behind the last follow at its
    /// own distance.
    pub fn of_body_m(&self, body: i64) -> f64 {
        let away = body - 1;
        if self.gaps_m.is_empty() {
            return away as f64 * self.mean_m;
        }
        match usize::try_from(away) {
            Ok(n_gaps) => (1..=n_gaps).map(|gap| self.of_gap_m(gap)).sum(),
            Err(_) => away as f64 * self.of_gap_m(1),
        }
    }

    /// Place of a gap's middle in metres, at any number between those of gaps; half a distance before body 1 is 0, so that equally spaced
    /// bodies have gap n at n distances.
    pub fn place_m(&self, gap: f64) -> f64 {
        if self.gaps_m.is_empty() {
            return gap * self.mean_m;
        }
        let middle_m = |gap: i64| {
            let own_m = self.of_gap_m(usize::try_from(gap).unwrap_or(1));
            self.of_body_m(gap) + 0.5 * (self.of_gap_m(1) + own_m)
        };
        let before = gap.floor() as i64;
        let (near_m, far_m) = (middle_m(before), middle_m(before + 1));
        near_m + (gap - before as f64) * (far_m - near_m)
    }

    /// Length in metres from one place along the gaps to another.
    pub fn between_m(&self, from: f64, to: f64) -> f64 {
        match self.gaps_m.is_empty() {
            true => (to - from) * self.mean_m,
            false => self.place_m(to) - self.place_m(from),
        }
    }

    pub(crate) fn check(&self) -> Result<(), AnalysisError> {
        check_positive("pitch_m", self.mean_m)?;
        self.gaps_m.iter().try_for_each(|gap_m| check_positive("pitch_m", *gap_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_of_equal_gaps_are_multiples_and_of_others_sums() {
        // Sums of a few numbers: rounding alone.
        let same = |found: &[f64], expected: &[f64]| {
            found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14)
        };
        let even = Spacing::from(0.03);
        let found = [even.of_body_m(0), even.of_body_m(4), even.place_m(2.5)];
        assert!(same(&found, &[-0.03, 0.09, 0.075]), "{found:?}");
        assert_eq!(Spacing::from(vec![0.03; 4]), even);
        let uneven = Spacing::from(vec![2.0, 4.0, 6.0]);
        let found = [uneven.mean_m(), uneven.of_gap_m(2), uneven.of_gap_m(9)];
        assert!(same(&found, &[4.0, 4.0, 6.0]), "{found:?}");
        // Bodies at 0, 2, 6 and 12; the middles of gaps at 1, 4 and 9, and places count from 1 before body 1.
        let found = [0, 1, 2, 3, 4].map(|body| uneven.of_body_m(body));
        assert!(same(&found, &[-2.0, 0.0, 2.0, 6.0, 12.0]), "{found:?}");
        let found =
            [uneven.place_m(1.0), uneven.place_m(2.0), uneven.place_m(3.0), uneven.between_m(1.0, 2.5)];
        assert!(same(&found, &[2.0, 5.0, 10.0, 5.5]), "{found:?}");
        assert!(Spacing::from(vec![1.0, -1.0]).check().is_err() && uneven.check().is_ok());
    }
}
