//! What the samples around each one tell of it without it.

/// Weights of the cubic through the two samples on either side, at the place between them.
const CUBIC: [f64; 4] = [-1.0 / 6.0, 4.0 / 6.0, 4.0 / 6.0, -1.0 / 6.0];

/// Each sample by those around it alone, evenly spaced in time: by the cubic through two on either side, else by the mean of the nearest on both
/// sides, at an end by the nearest one. What has no sample stays without, and so does a sample that is the only one.
///
/// A quantity that is made of noisy readings and held against the same readings shares their noise with them, and a fit takes that for
/// the quantity: with a sensitivity of a thousandth to the place read, ten thousand readings feign what ten standard deviations of one
/// reading would (errors in variables; W. A. Fuller, Measurement Error Models, 1987). Told by its neighbours it shares nothing with a
/// reading's own noise.
pub(super) fn by_neighbours(samples: &[Option<f64>]) -> Vec<Option<f64>> {
    let before = nearest_before(samples.iter());
    let mut after = nearest_before(samples.iter().rev());
    after.reverse();
    let of_sample = |k: usize| {
        samples[k]?;
        let sample = |offset: isize| samples.get(k.checked_add_signed(offset)?).copied().flatten();
        let around = [-2, -1, 1, 2].map(sample);
        if let [Some(a), Some(b), Some(c), Some(d)] = around {
            return Some([a, b, c, d].iter().zip(CUBIC).map(|(sample, weight)| weight * sample).sum());
        }
        match (before[k], after[k]) {
            (Some(before), Some(after)) => Some(0.5 * (before + after)),
            (before, after) => before.or(after),
        }
    };
    (0..samples.len()).map(of_sample).collect()
}

/// The nearest sample in front of each, in the order given.
fn nearest_before<'a>(samples: impl Iterator<Item = &'a Option<f64>>) -> Vec<Option<f64>> {
    let nearest = |last: &mut Option<f64>, sample: &Option<f64>| {
        let before = *last;
        *last = sample.or(before);
        Some(before)
    };
    samples.scan(None, nearest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_what_it_is_and_a_sample_has_no_part_in_its_own() {
        let cubic = |k: usize| {
            let t = k as f64 - 4.0;
            0.5 - 2.0 * t + 0.3 * t * t + 0.1 * t.powi(3)
        };
        let mut samples: Vec<Option<f64>> = (0..9).map(|k| Some(cubic(k))).collect();
        let told = by_neighbours(&samples);
        // Rounding of values up to 20.
        assert!((2..7).all(|k| (told[k].unwrap() - cubic(k)).abs() < 1e-13), "{told:?}");
        samples[4] = Some(100.0);
        assert_eq!(by_neighbours(&samples)[4], told[4]);
    }

    #[test]
    fn gaps_and_ends_are_told_by_what_is_nearest() {
        let samples = [Some(1.0), Some(2.0), None, None, Some(8.0), Some(9.0)];
        let told = by_neighbours(&samples);
        assert_eq!(told, [Some(2.0), Some(4.5), None, None, Some(5.5), Some(8.0)]);
        assert_eq!(by_neighbours(&[None, Some(1.0)]), [None, None]);
    }
}
