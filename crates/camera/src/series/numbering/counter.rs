//! Which of the numbers in images' names counts the frames, and the order of the images.

use std::cmp::Ordering;

use super::name::{Member, Number, Pattern};

/// A number of which every other one at least is there, on average, has few gaps.
const MOST_GAPS: usize = 2;

/// Images in their order, and the place of the number that counts them.
pub(super) enum Order {
    /// By one number, which differs from image to image.
    Counted { column: usize, warning: Option<String> },
    /// By all numbers from the left, none of which counts frames.
    Uncounted { warning: String },
    /// Images that have the same last number, and no other that tells them apart by itself.
    Repeated,
}

/// Sorts a series of two or more images and finds the number that counts them.
///
/// That is the last of those that go up by one throughout, whatever stands before it. Where none does, the images are sorted by all of their numbers
/// from the left, as dates and times are written, and a number that rises from each to the next counts them: the one of the narrowest span, unless a
/// narrower one differs everywhere and has few gaps.
pub(super) fn sort(pattern: &Pattern, series: &mut [Member]) -> Order {
    let columns = Columns::of(pattern, series);
    series.sort_by(|one, other| columns.compare(&one.1, &other.1).then(one.0.cmp(&other.0)));
    let Some(&last) = columns.varying.last() else { return Order::Repeated };
    if series.windows(2).any(|pair| columns.compare(&pair[0].1, &pair[1].1).is_eq()) {
        return Order::Repeated;
    }
    let n_steps = series.len() - 1;
    let within = |most: usize| {
        columns.whole().rev().find(|&column| span(series, column).is_some_and(|span| span <= most))
    };
    let rising = columns.whole().rev().filter(|&column| rises(series, column));
    let counter = within(n_steps).or_else(|| {
        // Of two that span as much, the last. What stands first rises wherever it differs, as a temperature may.
        let rising = rising.min_by_key(|&column| spread(series, column))?;
        let dense = within(MOST_GAPS * n_steps);
        Some(dense.filter(|&dense| spread(series, dense) < spread(series, rising)).unwrap_or(rising))
    });
    if let Some(column) = counter {
        let is_sorted = rises(series, column);
        series.sort_by_key(|(_, numbers)| numbers[column].value);
        let warning = (!is_sorted).then(|| {
            format!(
                "the images are in the order of number {} in their names `{}`, which those before it contradict",
                column + 1,
                pattern.shown()
            )
        });
        return Order::Counted { column, warning };
    }
    // Cameras or trials side by side begin to count anew.
    if !columns.is_fraction[last] && span(series, last).is_none() {
        return Order::Repeated;
    }
    Order::Uncounted {
        warning: format!(
            "no number in the names `{}` counts the images: they are in the order of all of their numbers from the left, and each is taken for \
             one frame after that before it",
            pattern.shown()
        ),
    }
}

/// How the numbers of a series are compared.
struct Columns {
    /// Those that are not the same in all images.
    varying: Vec<usize>,
    /// Digits behind a decimal point that are not of one length: 5 is more than 25.
    is_fraction: Vec<bool>,
}

impl Columns {
    fn of(pattern: &Pattern, series: &[Member]) -> Self {
        let decimals = pattern.decimals().into_iter().enumerate();
        let is_fraction: Vec<bool> =
            decimals.map(|(column, is_decimal)| is_decimal && are_fractions(series, column)).collect();
        let mut columns = Self { varying: (0..is_fraction.len()).collect(), is_fraction };
        let differs = |column: usize| {
            series.iter().any(|(_, numbers)| columns.compare_one(column, numbers, &series[0].1).is_ne())
        };
        columns.varying = columns.varying.iter().copied().filter(|&column| differs(column)).collect();
        columns
    }

    /// Those that may count frames.
    fn whole(&self) -> impl DoubleEndedIterator<Item = usize> {
        self.varying.iter().copied().filter(|&column| !self.is_fraction[column])
    }

    fn compare(&self, one: &[Number], other: &[Number]) -> Ordering {
        let orderings = self.varying.iter().map(|&column| self.compare_one(column, one, other));
        orderings.fold(Ordering::Equal, Ordering::then)
    }

    fn compare_one(&self, column: usize, one: &[Number], other: &[Number]) -> Ordering {
        match self.is_fraction[column] {
            true => one[column].digits.cmp(&other[column].digits),
            false => one[column].value.cmp(&other[column].value),
        }
    }
}

/// Whether digits behind a point are of several lengths as those of decimal fractions are, and not as those of a second counter (`1.9`, `1.10`): none of
/// them ends in a zero.
fn are_fractions(series: &[Member], column: usize) -> bool {
    let digits = || series.iter().map(|(_, numbers)| numbers[column].digits.as_str());
    let is_of_first_length = |text: &str| text.len() == series[0].1[column].digits.len();
    let is_stripped = |text: &str| text == "0" || !text.ends_with('0');
    !digits().all(is_of_first_length) && digits().all(is_stripped)
}

fn rises(series: &[Member], column: usize) -> bool {
    series.windows(2).all(|pair| pair[0].1[column].value < pair[1].1[column].value)
}

/// The largest number less the smallest.
fn spread(series: &[Member], column: usize) -> i128 {
    let values = || series.iter().map(|(_, numbers)| numbers[column].value);
    values().max().unwrap_or(0) - values().min().unwrap_or(0)
}

/// As [`spread`]; `None` where a number comes twice, or the span is beyond all counting.
fn span(series: &[Member], column: usize) -> Option<usize> {
    let mut values: Vec<i128> = series.iter().map(|(_, numbers)| numbers[column].value).collect();
    values.sort_unstable();
    let is_once = values.windows(2).all(|pair| pair[0] != pair[1]);
    is_once.then(|| usize::try_from(spread(series, column)).unwrap_or(usize::MAX))
}
