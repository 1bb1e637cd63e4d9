//! Places and labels of ticks, and numbers as they are written in print.

use plotters::coord::ranged1d::Ranged;
use plotters::coord::types::RangedCoordf64;

/// A labelled place on an axis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    pub(crate) value: f64,
    pub(crate) label: String,
}

/// Ticks at multiples of 1, 2 or 5 times a power of ten in `low..=high`: at most `at_most` steps, but always the two ticks
/// that tell the scale of an axis (plotters' key points).
pub(crate) fn linear_ticks(low: f64, high: f64, at_most: usize) -> Vec<Tick> {
    // Key points lose ranges that are small in absolute terms, so the range is brought near one.
    let unit = 10.0_f64.powf((high - low).log10().floor());
    let axis = RangedCoordf64::from(low / unit..high / unit);
    let values = (at_most.max(2) + 1..=2 * at_most.max(2) + 8)
        .map(|most| axis.key_points(most))
        .find(|points| points.len() > 1)
        .unwrap_or_default();
    labelled(&values.iter().map(|value| value * unit).collect::<Vec<_>>())
}

/// As [`linear_ticks`], at whole numbers only.
pub(crate) fn whole_ticks(low: f64, high: f64, at_most: usize) -> Vec<Tick> {
    let (first, last) = ((low - 1e-9).ceil(), (high + 1e-9).floor());
    if last - first < at_most as f64 {
        let count = (last - first + 1.0).max(0.0) as usize;
        return labelled(&(0..count).map(|i| first + i as f64).collect::<Vec<_>>());
    }
    linear_ticks(low, high, at_most)
}

/// The values with labels to the digit in which they differ.
fn labelled(values: &[f64]) -> Vec<Tick> {
    let step = values.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let step = if step.is_finite() { step } else { 1.0 };
    let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    values.iter().map(|&value| Tick { value, label: label(value, step, largest) }).collect()
}

/// Ticks at whole decades of `low..=high`, every second or third one when there are many; `low` must be positive.
pub(crate) fn decade_ticks(low: f64, high: f64, at_most: usize) -> Vec<Tick> {
    let (first, last) = ((low.log10() - 1e-9).ceil() as i32, (high.log10() + 1e-9).floor() as i32);
    let count = usize::try_from(last - first + 1).unwrap_or(0);
    let stride = count.div_ceil(at_most.max(1)).max(1);
    (first..=last)
        .step_by(stride)
        .map(|power| Tick { value: 10.0_f64.powi(power), label: power_of_ten(power) })
        .collect()
}

fn label(value: f64, step: f64, largest: f64) -> String {
    let plain = (1e-4..1e5).contains(&largest) && step >= 1e-5;
    if plain || largest == 0.0 {
        return fixed(value, decimals_of(step));
    }
    let power = largest.log10().floor() as i32;
    if value == 0.0 {
        return "0".into();
    }
    let unit = 10.0_f64.powi(power);
    format!("{}·{}", fixed(value / unit, decimals_of(step / unit)), power_of_ten(power))
}

/// Digits behind the point that tell multiples of `step` apart.
fn decimals_of(step: f64) -> usize {
    (-(step.log10() + 1e-9).floor()).clamp(0.0, 12.0) as usize
}

fn power_of_ten(power: i32) -> String {
    format!("$10^{{{}}}$", fixed(f64::from(power), 0))
}

/// A number with a true minus sign; rounding to zero never leaves "−0".
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|sign| matches!(sign, '0' | '.')) => digits.into(),
        Some(digits) => format!("−{digits}"),
        None => text,
    }
}

/// A number with at most `decimals` digits behind the point and no zeros at its end.
pub(crate) fn trimmed(value: f64, decimals: usize) -> String {
    let text = fixed(value, decimals);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

/// Value ± standard uncertainty, both to the second digit of the uncertainty.
pub(crate) fn with_uncertainty(value: f64, sigma: f64) -> String {
    if !(sigma.is_finite() && sigma > 0.0) {
        return trimmed(value, 3);
    }
    let decimals = (1.0 - sigma.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{} ± {}", fixed(value, decimals), fixed(sigma, decimals))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().map(|tick| tick.label.as_str()).collect()
    }

    #[test]
    fn ticks_are_few_round_and_inside() {
        assert_eq!(labels(&linear_ticks(-0.3, 5.9, 4)), ["0", "2", "4"]);
        assert_eq!(labels(&linear_ticks(-1.0, 1.0, 4)), ["−1.0", "−0.5", "0.0", "0.5", "1.0"]);
        assert_eq!(labels(&linear_ticks(0.0, 1.0, 5)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(&whole_ticks(0.5, 3.5, 8)), ["1", "2", "3"]);
        for exponent in -12..12 {
            for factor in [1.0, 1.7, 3.3, 7.9] {
                let span = factor * 10.0_f64.powi(exponent);
                let ticks = linear_ticks(0.0, span, 6);
                assert!((2..=7).contains(&ticks.len()), "{span}: {ticks:?}");
            }
        }
    }

    #[test]
    fn very_small_and_large_numbers_are_written_with_a_power_of_ten() {
        assert_eq!(labels(&linear_ticks(0.0, 2.0e-7, 2)), ["0", "1·$10^{−7}$", "2·$10^{−7}$"]);
        assert_eq!(labels(&linear_ticks(0.0, 3.0e6, 3)), ["0", "1·$10^{6}$", "2·$10^{6}$", "3·$10^{6}$"]);
    }

    #[test]
    fn decades_are_thinned() {
        assert_eq!(
            labels(&decade_ticks(2e-4, 20.0, 6)),
            ["$10^{−3}$", "$10^{−2}$", "$10^{−1}$", "$10^{0}$", "$10^{1}$"]
        );
        assert_eq!(decade_ticks(1e-12, 1.0, 5).len(), 5);
    }

    #[test]
    fn numbers_are_written_as_in_print() {
        assert_eq!(fixed(-0.04, 1), "0.0");
        assert_eq!(fixed(-2.0, 0), "−2");
        assert_eq!(trimmed(10.880, 2), "10.88");
        assert_eq!(trimmed(148.0, 2), "148");
        assert_eq!(with_uncertainty(52.3141, 0.0412), "52.314 ± 0.041");
        assert_eq!(with_uncertainty(52.3, 1.26), "52.3 ± 1.3");
        assert_eq!(with_uncertainty(52.3, 0.0), "52.3");
    }
}
