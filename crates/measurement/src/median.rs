//! The median of numbers in any order.

/// The upper median of values in any order; `None` of no value.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_in_rank_is_found_in_any_order() {
        assert_eq!(median(Vec::new()), None);
        assert_eq!(median(vec![3.0, -1.0, 7.0]), Some(3.0));
        assert_eq!(median(vec![4.0, 3.0, -1.0, 7.0]), Some(4.0));
    }
}
