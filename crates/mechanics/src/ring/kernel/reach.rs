//! How far rings are deformed, and the polynomials that reach so far.

/// Deformations that the shortest polynomials reach.
pub(crate) const SMALL: u8 = 0;
/// Deformations that longer polynomials reach.
pub(crate) const MODERATE: u8 = 1;
/// Deformations that roots and divisions reach.
pub(crate) const LARGE: u8 = 2;
/// Deformations that nothing reaches.
pub(crate) const BEYOND: u8 = 3;

/// Largest sine whose arc the polynomial gives: changes of turn up to 7 degrees where they are small, up to 15 where they are moderate,
/// and up to 120 with three halvings.
const LARGEST_SINE: [f64; 2] = [0.125, 0.258_819_045_102_520_8];
/// Largest change of a chord's squared length, relative to it, for which the polynomial of its root stands.
const LARGEST_STRETCH: [f64; 2] = [0.01, 0.03];

/// (asin(s) - s) / s^3 as a polynomial in s^2, lowest power first: relative errors of the arc 6e-11 and 2.7e-10 up to
/// [`LARGEST_SINE`] (interpolated at Chebyshev's nodes), and at no angle larger with the shorter one.
const ARC: [[f64; 4]; 2] = [
    [0.166_666_670_351_847_07, 0.074_995_757_388_328_35, 0.045_364_266_197_183_15, 0.0],
    [0.166_666_662_752_550_42, 0.075_001_866_734_998_9, 0.044_504_748_268_945_1, 0.033_607_901_190_141_75],
];
/// (1 - 1 / sqrt(1 + e)) / e as a polynomial in e, lowest power first: the root's relative errors are 6e-12 and 2e-11 up to
/// [`LARGEST_STRETCH`] (interpolated at Chebyshev's nodes, the first coefficient exact so that small stretches keep their
/// digits), and at no stretch larger with the shorter one.
const INVERSE_ROOT: [[f64; 5]; 2] = [
    [0.5, -0.375, 0.312_518_458_209_611_94, -0.273_454_420_050_027_8, 0.0],
    [
        0.5,
        -0.374_999_977_141_516,
        0.312_499_978_773_980_47,
        -0.273_640_666_624_914_6,
        0.246_282_406_934_921_35,
    ],
];

/// The polynomial of the arc for a reach.
pub(super) const fn arc(reach: u8) -> [f64; 4] {
    if reach == SMALL { ARC[0] } else { ARC[1] }
}

/// The polynomial of the inverse root for a reach.
pub(super) const fn inverse_root(reach: u8) -> [f64; 5] {
    if reach == SMALL { INVERSE_ROOT[0] } else { INVERSE_ROOT[1] }
}

/// What reaches a largest square of a sine and a largest change of a squared length, each found with `reach`.
///
/// Written so that values that are not numbers lie beyond.
#[inline(always)]
pub(super) fn reach_of(reach: u8, sine_square: f64, stretch: f64) -> u8 {
    let lies_within = |range: usize| {
        sine_square <= LARGEST_SINE[range] * LARGEST_SINE[range] && stretch <= LARGEST_STRETCH[range]
    };
    match reach {
        LARGE if sine_square <= LARGEST_SINE[1] * LARGEST_SINE[1] => LARGE,
        LARGE => BEYOND,
        _ if lies_within(0) => SMALL,
        _ if lies_within(1) => MODERATE,
        _ => LARGE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial(of: f64, coefficients: &[f64]) -> f64 {
        coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * of + coefficient)
    }

    /// Errors as they stand at the polynomials, and a rounding.
    #[test]
    fn polynomials_err_no_more_than_they_say() {
        for (reach, largest_arc, largest_root) in [(SMALL, 6e-11, 6.5e-12), (MODERATE, 2.8e-10, 2.2e-11)] {
            let range = usize::from(reach);
            for k in 1..=1000 {
                let share = f64::from(k) / 1000.0;
                let sine = share * LARGEST_SINE[range];
                let found = sine + sine.powi(3) * polynomial(sine * sine, &arc(reach));
                assert!((found / sine.asin() - 1.0).abs() < largest_arc, "{reach} {sine}");
                for stretch in [share, -share].map(|share| share * LARGEST_STRETCH[range]) {
                    let found = 1.0 - stretch * polynomial(stretch, &inverse_root(reach));
                    assert!((found * (1.0 + stretch).sqrt() - 1.0).abs() < largest_root, "{reach} {stretch}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_number_lies_beyond() {
        for (sine_square, stretch) in [(f64::NAN, 0.0), (0.0, f64::NAN)] {
            assert_eq!(reach_of(SMALL, sine_square, stretch), LARGE);
            assert_eq!(reach_of(MODERATE, sine_square, stretch), LARGE);
        }
        assert_eq!(reach_of(LARGE, f64::NAN, 0.0), BEYOND);
        assert_eq!(
            [0.1, 0.2, 0.3].map(|sine: f64| reach_of(SMALL, sine * sine, 0.0)),
            [SMALL, MODERATE, LARGE]
        );
    }
}
