//! Numbers of the command line that make sense above zero alone.

/// A number above zero; what is wrong with a text that is none.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    let found = text.trim().parse::<f64>().ok().filter(|value| *value > 0.0 && value.is_finite());
    found.ok_or_else(|| format!("expected a number above 0, found {text:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_above_zero_is_refused() {
        assert_eq!(positive(" 2.5e4 "), Ok(2.5e4));
        for wrong in ["0", "-5", "abc", "", "inf", "NaN"] {
            assert!(positive(wrong).unwrap_err().contains("expected a number above 0"), "{wrong}");
        }
    }
}
