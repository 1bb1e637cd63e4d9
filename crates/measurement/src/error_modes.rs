//! Errors that many samples of a motion share.

use ndarray::{Array2, ArrayView1, s};

use crate::error_source::ErrorSource;

/// Errors that many samples of a motion share, each with a random amplitude of unit variance.
///
/// The displacement error of one mode is a sum of [`ErrorPattern`]s, each with a factor: what a recording's trigger does to the bodies that the
/// recording saw is one pattern, of which every error that moves that trigger has its part. So a pattern is kept once, for its bodies alone, and a
/// mode is a list of factors: memory grows with the samples that recordings have and not with samples times modes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ErrorModes {
    patterns: Vec<ErrorPattern>,
    modes: Vec<ErrorMode>,
}

/// A displacement error over neighbouring bodies and all times; zero in all other bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorPattern {
    first_row: usize,
    displacement_m: Array2<f64>,
}

/// One error: where it comes from, and how much it has of each pattern.
#[derive(Debug, Clone, PartialEq)]
struct ErrorMode {
    source: ErrorSource,
    /// Numbers of patterns and their factors.
    parts: Vec<(usize, f64)>,
}

impl ErrorPattern {
    /// A pattern of bodies from row `first_row` on, in metres, shape `[body, time]`.
    pub fn new(first_row: usize, displacement_m: Array2<f64>) -> Self {
        Self { first_row, displacement_m }
    }

    /// A pattern of all bodies, in metres, shape `[body, time]`; rows of nothing but zeros at either end are not kept.
    pub fn trimmed(displacement_m: &Array2<f64>) -> Self {
        let is_zero = |row: &usize| displacement_m.row(*row).iter().all(|error_m| *error_m == 0.0);
        let n = displacement_m.nrows();
        let first_row = (0..n).find(|row| !is_zero(row)).unwrap_or(n);
        let end = (first_row..n).rev().find(|row| !is_zero(row)).map_or(first_row, |row| row + 1);
        Self { first_row, displacement_m: displacement_m.slice(s![first_row..end, ..]).to_owned() }
    }

    /// The error of one row's body at each time, in metres; `None` where it has no part in the pattern.
    pub fn row(&self, row: usize) -> Option<ArrayView1<'_, f64>> {
        let own = row.checked_sub(self.first_row)?;
        (own < self.displacement_m.nrows()).then(|| self.displacement_m.row(own))
    }

    /// The error of one row and time, in metres.
    pub fn at(&self, (row, time): (usize, usize)) -> f64 {
        self.row(row).map_or(0.0, |of_body| of_body[time])
    }

    /// Bodies up to the last one that has a part, and times.
    fn dim(&self) -> (usize, usize) {
        (self.first_row + self.displacement_m.nrows(), self.displacement_m.ncols())
    }

    fn add_to(&self, factor: f64, field_m: &mut Array2<f64>) {
        let (end, _) = self.dim();
        field_m.slice_mut(s![self.first_row..end, ..]).scaled_add(factor, &self.displacement_m);
    }
}

impl ErrorModes {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.modes.is_empty()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.modes.len()
    }

    /// Where each comes from.
    pub fn sources(&self) -> impl Iterator<Item = &ErrorSource> {
        self.modes.iter().map(|mode| &mode.source)
    }

    /// The patterns that they are made of.
    pub fn patterns(&self) -> &[ErrorPattern] {
        &self.patterns
    }

    /// Adds a pattern that modes may have a part of; returns its number.
    pub fn add_pattern(&mut self, pattern: ErrorPattern) -> usize {
        self.patterns.push(pattern);
        self.patterns.len() - 1
    }

    /// Adds an error that is a sum of patterns, by their numbers, with factors.
    pub fn push_sum(&mut self, source: ErrorSource, parts: Vec<(usize, f64)>) {
        self.modes.push(ErrorMode { source, parts });
    }

    /// Adds an error with its displacement error in metres for an amplitude of one standard deviation, shape `[body, time]`.
    pub fn push(&mut self, source: ErrorSource, displacement_m: &Array2<f64>) {
        let pattern = self.add_pattern(ErrorPattern::trimmed(displacement_m));
        self.push_sum(source, vec![(pattern, 1.0)]);
    }

    /// Adds others to the same motion, under names that may depend on their places among all.
    pub fn append(&mut self, others: Self, named: impl Fn(ErrorSource, usize) -> ErrorSource) {
        let n_patterns = self.patterns.len();
        self.patterns.extend(others.patterns);
        for mode in others.modes {
            let parts = mode.parts.into_iter().map(|(pattern, factor)| (n_patterns + pattern, factor));
            let source = named(mode.source, self.modes.len());
            self.modes.push(ErrorMode { source, parts: parts.collect() });
        }
    }

    /// Leaves out those of some sources, and the patterns that none of the others has a part of.
    pub fn retain(&mut self, is_kept: impl Fn(&ErrorSource) -> bool) {
        self.modes.retain(|mode| is_kept(&mode.source));
        let mut is_used = vec![false; self.patterns.len()];
        self.modes.iter().flat_map(|mode| &mode.parts).for_each(|(pattern, _)| is_used[*pattern] = true);
        let mut places = Vec::with_capacity(is_used.len());
        let mut n_used = 0;
        for used in &is_used {
            places.push(n_used);
            n_used += usize::from(*used);
        }
        let mut used = is_used.into_iter();
        self.patterns.retain(|_| used.next().unwrap_or(false));
        let parts = self.modes.iter_mut().flat_map(|mode| &mut mode.parts);
        parts.for_each(|(pattern, _)| *pattern = places[*pattern]);
    }

    /// The same among `n_times` samples, of which the present ones begin at number `start`; zero at all others.
    #[must_use]
    pub fn placed(mut self, start: usize, n_times: usize) -> Self {
        for pattern in &mut self.patterns {
            let (rows, columns) = pattern.displacement_m.dim();
            let mut placed_m = Array2::zeros((rows, n_times));
            placed_m.slice_mut(s![.., start..start + columns]).assign(&pattern.displacement_m);
            pattern.displacement_m = placed_m;
        }
        self
    }

    /// The displacement error in metres for an amplitude of one standard deviation of mode number `k`, shape `[body, time]`.
    pub fn displacement_m(&self, k: usize, dim: (usize, usize)) -> Array2<f64> {
        self.sum_m(&self.modes[k].parts, dim)
    }

    /// A sum of patterns, by their numbers, with factors: a displacement error in metres, shape `[body, time]`.
    pub fn sum_m(&self, parts: &[(usize, f64)], dim: (usize, usize)) -> Array2<f64> {
        let mut sum_m = Array2::zeros(dim);
        parts.iter().for_each(|(pattern, factor)| self.patterns[*pattern].add_to(*factor, &mut sum_m));
        sum_m
    }

    /// The amplitudes of patterns that amplitudes of all modes make.
    pub fn of_patterns(&self, amplitudes: &[f64]) -> Vec<f64> {
        let mut of_patterns = vec![0.0; self.patterns.len()];
        for (mode, amplitude) in self.modes.iter().zip(amplitudes) {
            mode.parts.iter().for_each(|(pattern, factor)| of_patterns[*pattern] += amplitude * factor);
        }
        of_patterns
    }

    /// What something linear makes of each mode, from the list of numbers, of one length, that it makes of each pattern.
    pub fn combined<'a>(&'a self, of_patterns: &'a [Vec<f64>]) -> impl Iterator<Item = Vec<f64>> + 'a {
        let n = of_patterns.first().map_or(0, Vec::len);
        self.modes.iter().map(move |mode| {
            let mut sum = vec![0.0; n];
            for (pattern, factor) in &mode.parts {
                sum.iter_mut().zip(&of_patterns[*pattern]).for_each(|(sum, part)| *sum += factor * part);
            }
            sum
        })
    }

    /// The variance that all of them make of a weighted sum of rows at each time, in square metres: of one body by `[(row, 1.0)]`, of a gap by
    /// `[(row, -1.0), (row + 1, 1.0)]`.
    pub fn variance_m2(&self, rows: &[(usize, f64)]) -> Vec<f64> {
        let seen: Vec<(usize, Vec<f64>)> =
            (0..self.patterns.len()).filter_map(|j| Some((j, self.patterns[j].weighted(rows)?))).collect();
        let covariance = self.covariance(&seen.iter().map(|(j, _)| *j).collect::<Vec<_>>());
        let mut variance_m2 = vec![0.0; seen.first().map_or(0, |(_, error_m)| error_m.len())];
        for (j, (_, first_m)) in seen.iter().enumerate() {
            for (k, (_, second_m)) in seen.iter().enumerate().take(j + 1) {
                let factor = if j == k { covariance[(j, k)] } else { 2.0 * covariance[(j, k)] };
                if factor == 0.0 {
                    continue;
                }
                let products = first_m.iter().zip(second_m).map(|(a, b)| factor * a * b);
                variance_m2.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
            }
        }
        // Sums of products may round below zero where patterns cancel.
        variance_m2.into_iter().map(|variance_m2| variance_m2.max(0.0)).collect()
    }

    /// Covariance of the amplitudes of some patterns.
    fn covariance(&self, patterns: &[usize]) -> Array2<f64> {
        let mut places = vec![None; self.patterns.len()];
        patterns.iter().enumerate().for_each(|(place, j)| places[*j] = Some(place));
        let mut covariance = Array2::zeros((patterns.len(), patterns.len()));
        for mode in &self.modes {
            let parts = mode.parts.iter().filter_map(|(j, factor)| Some((places[*j]?, *factor)));
            let parts: Vec<(usize, f64)> = parts.collect();
            for (a, by_a) in &parts {
                parts.iter().for_each(|(b, by_b)| covariance[(*a, *b)] += by_a * by_b);
            }
        }
        covariance
    }

    /// The first mode whose patterns do not fit a motion's bodies and times, and up to which body and time they go.
    pub fn unfitting(&self, (n_bodies, n_times): (usize, usize)) -> Option<(&ErrorSource, (usize, usize))> {
        let found = |mode: &ErrorMode| {
            let dims = mode.parts.iter().map(|(pattern, _)| self.patterns[*pattern].dim());
            dims.into_iter().find(|dim| dim.0 > n_bodies || dim.1 != n_times)
        };
        self.modes.iter().find_map(|mode| Some((&mode.source, found(mode)?)))
    }

    /// The first row and time at which a pattern is no finite number, and what stands there.
    pub fn not_finite(&self) -> Option<((usize, usize), f64)> {
        self.patterns.iter().find_map(|pattern| {
            let mut numbers = pattern.displacement_m.indexed_iter();
            let ((row, time), found) = numbers.find(|(_, error_m)| !error_m.is_finite())?;
            Some(((pattern.first_row + row, time), *found))
        })
    }
}

impl ErrorPattern {
    /// A weighted sum of rows; `None` where it has no part in any of them.
    fn weighted(&self, rows: &[(usize, f64)]) -> Option<Vec<f64>> {
        let mut sum: Option<Vec<f64>> = None;
        for (of_body, weight) in rows.iter().filter_map(|(row, weight)| Some((self.row(*row)?, weight))) {
            let sum = sum.get_or_insert_with(|| vec![0.0; of_body.len()]);
            sum.iter_mut().zip(of_body).for_each(|(sum, error_m)| *sum += weight * error_m);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    /// Two patterns that overlap in the middle one of three bodies, and three modes of them.
    fn modes() -> ErrorModes {
        let mut modes = ErrorModes::default();
        let first = modes.add_pattern(ErrorPattern::new(0, array![[1.0, 2.0], [3.0, 4.0]]));
        let second = modes.add_pattern(ErrorPattern::new(1, array![[5.0, 6.0], [7.0, 8.0]]));
        modes.push_sum("both".into(), vec![(first, 1.0), (second, -1.0)]);
        modes.push_sum("second".into(), vec![(second, 0.5)]);
        modes.push("last body".into(), &array![[0.0, 0.0], [0.0, 0.0], [0.25, -0.5]]);
        modes
    }

    #[test]
    fn a_mode_is_the_sum_of_its_patterns() {
        let (modes, dim) = (modes(), (3, 2));
        assert_eq!(modes.displacement_m(0, dim), array![[1.0, 2.0], [-2.0, -2.0], [-7.0, -8.0]]);
        assert_eq!(modes.displacement_m(1, dim), array![[0.0, 0.0], [2.5, 3.0], [3.5, 4.0]]);
        assert_eq!(modes.displacement_m(2, dim), array![[0.0, 0.0], [0.0, 0.0], [0.25, -0.5]]);
        assert_eq!((modes.patterns()[2].row(1), modes.patterns()[2].at((2, 1))), (None, -0.5));
    }

    #[test]
    fn variances_are_sums_of_squares_over_modes() {
        let modes = modes();
        for rows in
            [vec![(0, 1.0)], vec![(1, 1.0)], vec![(1, -1.0), (2, 1.0)], vec![(0, 0.5), (1, 1.0), (2, -2.0)]]
        {
            let of_mode = |k: usize, i: usize| {
                let field_m = modes.displacement_m(k, (3, 2));
                rows.iter().map(|(row, weight)| weight * field_m[(*row, i)]).sum::<f64>()
            };
            let expected: Vec<f64> = (0..2).map(|i| (0..3).map(|k| of_mode(k, i).powi(2)).sum()).collect();
            // All numbers are short binary fractions, so that no sum is rounded.
            assert_eq!(modes.variance_m2(&rows), expected);
        }
    }

    #[test]
    fn what_is_linear_may_be_asked_of_patterns() {
        let modes = modes();
        let of_patterns: Vec<Vec<f64>> =
            modes.patterns().iter().map(|one| vec![one.at((1, 1)), one.at((2, 0))]).collect();
        let combined: Vec<Vec<f64>> = modes.combined(&of_patterns).collect();
        for (k, found) in combined.into_iter().enumerate() {
            let field_m = modes.displacement_m(k, (3, 2));
            assert_eq!(found, [field_m[(1, 1)], field_m[(2, 0)]]);
        }
        assert_eq!(modes.of_patterns(&[2.0, 4.0, 3.0]), [2.0, 0.0, 3.0]);
    }

    #[test]
    fn modes_are_placed_appended_left_out_and_checked() {
        let mut all = modes();
        all.append(modes().placed(1, 4), |source, place| ErrorSource::from(format!("{source} {place}")));
        assert_eq!(all.sources().last(), Some(&"last body 5".into()));
        assert_eq!(all.displacement_m(4, (3, 4)).row(1), array![0.0, 2.5, 3.0, 0.0]);
        assert_eq!(all.unfitting((3, 2)).map(|(_, found)| found), Some((2, 4)));
        all.retain(|source| *source != "both".into());
        assert_eq!((all.len(), all.not_finite()), (5, None));
        // What only the modes that are gone had a part of is gone with them, and the others are what they were.
        let mut last = modes();
        last.retain(|source| *source == "last body".into());
        assert_eq!(last.patterns().len(), 1);
        assert_eq!(last.displacement_m(0, (3, 2)), modes().displacement_m(2, (3, 2)));
        all.push("broken".into(), &array![[0.0, 0.0], [0.0, f64::NAN]]);
        assert!(all.not_finite().is_some_and(|(place, _)| place == (1, 1)));
    }
}
