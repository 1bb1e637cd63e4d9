//! The median of numbers in any order, and the scatter that it tells of normal numbers among which there are strays.

/// The median of the amounts of normal deviates over their standard deviation.
const MEDIAN_AMOUNT: f64 = 0.674_489_750_196_081_7;

/// The upper median of values in any order; `None` of no value.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The usual time between neighbouring samples, in seconds: the median, which a pause or a stamp that is off does not move;
/// `None` of fewer than two.
pub fn median_interval_s(times_s: &[f64]) -> Option<f64> {
    median(times_s.windows(2).map(|pair| pair[1] - pair[0]).collect())
}

/// Standard deviation about zero of values of which most are normal, by the median of their amounts, which few strays do not move; `None`
/// of no value.
pub fn robust_sigma_about_zero(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    Some(median(values.into_iter().map(f64::abs).collect())? / MEDIAN_AMOUNT)
}

/// Centre and standard deviation of values of which most are normal, by the median and by that of the distances from it; `None` of no value.
pub fn median_and_robust_sigma(values: Vec<f64>) -> Option<[f64; 2]> {
    let centre = median(values.clone())?;
    Some([centre, robust_sigma_about_zero(values.into_iter().map(|value| value - centre))?])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The quantiles of a normal distribution of mean 3 and standard deviation 2 at 1/10, 2/10, ... 9/10, and one stray.
    const NEARLY_NORMAL: [f64; 10] =
        [0.436_9, 1.316_76, 1.951_2, 2.493_31, 3.0, 3.506_69, 4.048_8, 4.683_24, 5.563_1, 1e9];

    #[test]
    fn a_stray_does_not_move_what_the_others_tell() {
        let [centre, scatter] = median_and_robust_sigma(NEARLY_NORMAL.to_vec()).unwrap();
        // One stray of ten moves ranks by a half: between two tenths of the distribution, which are 0.51 apart.
        assert!((centre - 3.0).abs() < 0.51 && (scatter - 2.0).abs() < 0.51, "{centre}, {scatter}");
        assert_eq!(robust_sigma_about_zero([MEDIAN_AMOUNT, -1.0, 0.1]), Some(1.0));
        assert!(median_and_robust_sigma(Vec::new()).is_none() && robust_sigma_about_zero([]).is_none());
    }

    #[test]
    fn the_middle_in_rank_is_found_in_any_order() {
        assert_eq!(median(Vec::new()), None);
        assert_eq!(median(vec![3.0, -1.0, 7.0]), Some(3.0));
        assert_eq!(median(vec![4.0, 3.0, -1.0, 7.0]), Some(4.0));
    }
}
