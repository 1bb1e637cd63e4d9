//! The sensor: shot noise, read noise and rounding to counts.

use chainwave_vectors::dispatch_loop;
use rand::RngExt;
use rand_distr::StandardNormal;

use crate::seed::{Purpose, stream};
use crate::settings::Sensor;

/// Pixels whose noise is drawn before it is added, so that the arithmetic can be vectorised.
const BLOCK: usize = 256;

/// Sets `counts` to what the sensor gives for the expected counts of a frame.
///
/// The noise is normal with the variance read^2 + gain (count - black): shot noise in its normal approximation, which
/// holds above some 30 electrons. It is drawn from a 128-bit permuted congruential generator (PCG MCG-XSL-RR, which
/// passes BigCrush) by the ziggurat method, exact to the resolution of f64, with one stream a frame.
pub(crate) fn record(
    sensor: &Sensor,
    expected: &[f32],
    noise_seed: u64,
    frame: usize,
    counts: &mut Vec<u16>,
) {
    let mut random = stream(Purpose::Noise, noise_seed, frame as u64);
    let mut normal = [0.0_f32; BLOCK];
    let black = sensor.black_level as f32;
    let gain = sensor.counts_per_electron as f32;
    let read_variance = (sensor.read_noise_counts * sensor.read_noise_counts) as f32;
    let full_scale = sensor.full_scale() as f32;
    counts.resize(expected.len(), 0);
    for (block, counts) in expected.chunks(BLOCK).zip(counts.chunks_mut(BLOCK)) {
        normal[..block.len()].fill_with(|| random.sample(StandardNormal));
        dispatch_loop(
            #[inline(always)]
            || {
                // Their own copies, which no count that is written may be.
                let [black, gain, read_variance, full_scale] = [black, gain, read_variance, full_scale];
                for ((&mean, &normal), count) in block.iter().zip(&normal).zip(counts.iter_mut()) {
                    let sigma = (read_variance + gain * (mean - black).max(0.0)).sqrt();
                    *count = whole((mean + sigma * normal).clamp(0.0, full_scale) + 0.5);
                }
            },
        );
    }
}

/// The whole part of a number from 0 to 65 536, where a cast's care for all others would keep it out of vectors: beside 2^23 a float
/// holds whole numbers alone, and they are its lowest bits.
#[inline(always)]
fn whole(count: f32) -> u16 {
    (count.floor() + 8_388_608.0).to_bits() as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whole_part_is_that_of_a_cast() {
        for quarters in 0..4 * 65_536 {
            let count = quarters as f32 / 4.0;
            assert_eq!(whole(count), count as u16);
        }
    }

    const SENSOR: Sensor =
        Sensor { bit_depth: 12, black_level: 64.0, read_noise_counts: 3.0, counts_per_electron: 0.2 };

    fn mean_and_variance(expected: f32, n_frames: usize) -> (f64, f64) {
        let mut all = Vec::new();
        let mut counts = Vec::new();
        for frame in 0..n_frames {
            record(&SENSOR, &vec![expected; 10_000], 11, frame, &mut counts);
            all.extend(counts.iter().map(|&count| f64::from(count)));
        }
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        (mean, all.iter().map(|count| (count - mean).powi(2)).sum::<f64>() / (all.len() - 1) as f64)
    }

    #[test]
    fn the_variance_follows_the_read_and_shot_noise_law() {
        for expected in [64.0_f32, 500.3, 2000.5, 3900.0] {
            let (mean, variance) = mean_and_variance(expected, 100);
            // 1/12: rounding to whole counts.
            let law = 9.0 + 0.2 * f64::from(expected - 64.0) + 1.0 / 12.0;
            // A million samples: standard errors sqrt(law) 1e-3 and law sqrt(2) 1e-3; 4.5 of them.
            assert!((mean - f64::from(expected)).abs() < 4.5e-3 * law.sqrt(), "{expected}: mean {mean}");
            assert!(
                (variance / law - 1.0).abs() < 4.5 * 1.414e-3,
                "{expected}: variance {variance}, law {law}"
            );
        }
    }

    #[test]
    fn the_noise_is_normal_and_uncorrelated() {
        let mut counts = Vec::new();
        record(&SENSOR, &vec![2000.0; 1_000_000], 4, 0, &mut counts);
        let sigma = (9.0_f64 + 0.2 * 1936.0 + 1.0 / 12.0).sqrt();
        let scaled: Vec<f64> = counts.iter().map(|&count| (f64::from(count) - 2000.0) / sigma).collect();
        let mean_of =
            |f: &dyn Fn(f64) -> f64| scaled.iter().map(|&z| f(z)).sum::<f64>() / scaled.len() as f64;
        // Standard errors of a million normal samples: skewness sqrt(15), fourth moment sqrt(96), lag product 1, each
        // times 1e-3; 4.5 of them.
        assert!(mean_of(&|z| z.powi(3)).abs() < 4.5 * 3.9e-3);
        assert!((mean_of(&|z| z.powi(4)) - 3.0).abs() < 4.5 * 9.8e-3);
        for lag in [1, 2, 1008] {
            let products = scaled.iter().zip(&scaled[lag..]).map(|(one, other)| one * other);
            assert!((products.sum::<f64>() / 1.0e6).abs() < 4.5e-3, "lag {lag}");
        }
        let beyond_4 = scaled.iter().filter(|z| z.abs() > 4.0).count();
        // 63 expected; 4.5 times sqrt(63) on either side.
        assert!((28..=99).contains(&beyond_4), "{beyond_4}");
    }

    #[test]
    fn counts_stay_in_range() {
        let mut counts = Vec::new();
        record(&SENSOR, &[-1.0e9, 1.0e9], 1, 0, &mut counts);
        assert_eq!(counts, [0, 4095]);
    }

    #[test]
    fn frames_and_seeds_have_their_own_noise() {
        let noise = |seed, frame| {
            let mut counts = Vec::new();
            record(&SENSOR, &[1000.0; 64], seed, frame, &mut counts);
            counts
        };
        assert_eq!(noise(1, 5), noise(1, 5));
        assert_ne!(noise(1, 5), noise(1, 6));
        assert_ne!(noise(1, 5), noise(2, 5));
    }
}
