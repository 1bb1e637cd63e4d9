//! Estimates, probabilities and lists of recordings in words.

use chainwave_measurement::Estimate;

/// A value and its standard uncertainty, with as many decimals as give the latter two digits.
pub(crate) fn estimate(found: Estimate) -> String {
    const MOST: f64 = 12.0;
    let decimals = (1.0 - found.sigma.abs().log10().floor()).clamp(0.0, MOST);
    // A sigma of zero or none at all asks for infinitely many, or for no number of them.
    let decimals = if decimals.is_nan() { 0 } else { decimals as usize };
    format!("{:.decimals$} +- {:.decimals$}", found.value, found.sigma)
}

/// A probability; below what a number can hold, its bound.
pub(crate) fn probability(p: f64) -> String {
    const LEAST: f64 = 1e-300;
    if p < LEAST { format!("p < {LEAST:e}") } else { format!("p = {p:.2e}") }
}

/// Recordings of which the same is said stand together, before what is said.
pub(crate) fn grouped(remarks: &[(String, String)]) -> Vec<(String, String)> {
    let mut groups: Vec<(&str, Vec<&str>)> = Vec::new();
    for (recording, remark) in remarks {
        match groups.iter_mut().find(|(said, _)| said == remark) {
            Some((_, recordings)) => recordings.push(recording),
            None => groups.push((remark, vec![recording])),
        }
    }
    groups.into_iter().map(|(remark, recordings)| (named(&recordings), remark.to_owned())).collect()
}

/// All of a few recordings, or the first of many.
pub(crate) fn named(recordings: &[&str]) -> String {
    const MOST: usize = 3;
    match recordings {
        [first, others @ ..] if others.len() >= MOST => format!("{first} and {} others", others.len()),
        few => few.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_of_which_the_same_is_said_stand_together() {
        let said = |recording: &str, remark: &str| (recording.to_owned(), remark.to_owned());
        let mut remarks = vec![said("a", "late"), said("b", "dark"), said("c", "late")];
        assert_eq!(grouped(&remarks), [said("a, c", "late"), said("b", "dark")]);
        remarks.extend([said("d", "late"), said("e", "late")]);
        assert_eq!(grouped(&remarks)[0], said("a and 3 others", "late"));
    }

    #[test]
    fn estimates_have_two_digits_of_sigma() {
        let text = |value, sigma| estimate(Estimate::new(value, sigma));
        assert_eq!(text(1.0, 9.6e-6), "1.0000000 +- 0.0000096");
        assert_eq!(text(-4.738, 0.0123), "-4.738 +- 0.012");
        assert_eq!(text(1234.5, 67.0), "1234 +- 67");
        assert_eq!(text(2.5, f64::NAN), "2 +- NaN");
        assert_eq!(probability(0.0), "p < 1e-300");
        assert_eq!(probability(0.0123), "p = 1.23e-2");
    }
}
