//! Local interpolation of a track between its frames, with the noise that it passes on.

use std::f64::consts::TAU;

use chainwave_measurement::Estimate;

/// Samples taken on each side of an interpolated time.
const HALF_ORDER: usize = 3;
/// Longest interval between samples over their mean: one frame that lacks makes it 2 of 6/5, and stamps that are rounded to a third of an interval
/// less than 4/3.
const LONGEST_INTERVAL: f64 = 1.5;

/// A value read between samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Interpolated {
    pub(crate) value: f64,
    /// Time derivative, in the samples' unit per second.
    pub(crate) rate: f64,
    /// Standard uncertainty of the samples around: the noise before interpolation smoothed it.
    pub(crate) sigma: f64,
    /// Variance of `value` over `sigma` squared, 0.7 half way between samples and 1 on one.
    pub(crate) noise_gain: f64,
}

/// Six-point Lagrange interpolation at one time: which samples, and their weights.
///
/// The error is (h^6/720) |x''''''| (225/64) at most, h the frame interval: 3e-6 of the amplitude at a tenth of the frame
/// rate. The stencil is local, so a lost frame costs three frame intervals on each side and nothing else. No more does a frame that was never
/// taken: across twice the interval the error is ten times as large, and nothing would tell.
#[derive(Debug, Clone)]
pub(crate) struct Stencil {
    first: usize,
    value_weights: [f64; 2 * HALF_ORDER],
    rate_weights: [f64; 2 * HALF_ORDER],
}

impl Stencil {
    /// The stencil for `time_s`; `None` within three samples of either end, and where a frame between them was not taken.
    pub(crate) fn at(times_s: &[f64], time_s: f64) -> Option<Self> {
        let after = times_s.partition_point(|sample| *sample <= time_s);
        let first = after.checked_sub(HALF_ORDER)?;
        let nodes: &[f64; 2 * HALF_ORDER] = times_s.get(first..first + 2 * HALF_ORDER)?.try_into().ok()?;
        let mean_s = (nodes[2 * HALF_ORDER - 1] - nodes[0]) / (2 * HALF_ORDER - 1) as f64;
        if nodes.windows(2).any(|pair| pair[1] - pair[0] > LONGEST_INTERVAL * mean_s) {
            return None;
        }
        let mut stencil = Self { first, value_weights: [0.0; 6], rate_weights: [0.0; 6] };
        for (i, node) in nodes.iter().enumerate() {
            (stencil.value_weights[i], stencil.rate_weights[i]) = lagrange(nodes, i, *node, time_s);
        }
        Some(stencil)
    }

    /// Reads the samples; `None` where one of the six is missing.
    pub(crate) fn read(&self, samples: &[Option<Estimate>]) -> Option<Interpolated> {
        let mut read = Interpolated { value: 0.0, rate: 0.0, sigma: 0.0, noise_gain: 0.0 };
        for (i, sample) in samples.get(self.first..self.first + 2 * HALF_ORDER)?.iter().enumerate() {
            let sample = (*sample)?;
            read.value += self.value_weights[i] * sample.value;
            read.rate += self.rate_weights[i] * sample.value;
            read.sigma += sample.sigma / (2 * HALF_ORDER) as f64;
            read.noise_gain += self.value_weights[i].powi(2);
        }
        Some(read)
    }
}

/// Value and derivative at `time_s` of the Lagrange polynomial that is 1 at node `i` and 0 at the others.
fn lagrange(nodes: &[f64; 6], i: usize, node: f64, time_s: f64) -> (f64, f64) {
    let others = || nodes.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, other)| *other);
    let value: f64 = others().map(|other| (time_s - other) / (node - other)).product();
    let rate: f64 = others()
        .map(|left_out| {
            let rest: f64 = others()
                .filter(|other| other.to_bits() != left_out.to_bits())
                .map(|other| (time_s - other) / (node - other))
                .product();
            rest / (node - left_out)
        })
        .sum();
    (value, rate)
}

/// Share of the power of waves that interpolation between frames passes, by their frequencies in cycles a frame: the mean over all places between two
/// frames. 1 of what is slow.
#[must_use]
pub fn power_passed(cycles_per_frame: &[f64]) -> Vec<f64> {
    const N_PLACES: u32 = 16;
    let nodes: [f64; 2 * HALF_ORDER] = std::array::from_fn(|i| i as f64);
    let weights_at = |place: u32| -> [f64; 2 * HALF_ORDER] {
        let time = (HALF_ORDER - 1) as f64 + (f64::from(place) + 0.5) / f64::from(N_PLACES);
        std::array::from_fn(|i| lagrange(&nodes, i, nodes[i], time).0)
    };
    let weights: Vec<_> = (0..N_PLACES).map(weights_at).collect();
    let passed = |cycles: &f64| {
        let waves = nodes.map(|node| (TAU * cycles * node).sin_cos());
        let at_place = |weights: &[f64; 2 * HALF_ORDER]| -> f64 {
            let of = |part: fn(&(f64, f64)) -> f64| -> f64 {
                weights.iter().zip(&waves).map(|(weight, wave)| weight * part(wave)).sum()
            };
            of(|wave| wave.0).powi(2) + of(|wave| wave.1).powi(2)
        };
        weights.iter().map(at_place).sum::<f64>() / f64::from(N_PLACES)
    };
    cycles_per_frame.iter().map(passed).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn interpolation_passes_less_of_what_is_faster() {
        let passed_of = |cycles: f64| power_passed(&[cycles])[0];
        assert!((passed_of(0.0) - 1.0).abs() < 1e-14);
        // Half way between frames, with the weights 150, -25 and 3 of 256 on each side, the gain is (150 cos(w/2) - 25 cos(3w/2) + 3 cos(5w/2)) / 128;
        // on a frame it is 1. What is passed on the mean lies between.
        let gain = |cycles: f64| {
            let wave = |k: f64| (k * PI * cycles).cos();
            (150.0 * wave(1.0) - 25.0 * wave(3.0) + 3.0 * wave(5.0)) / 128.0
        };
        for cycles in [0.1, 0.2, 0.285, 0.4, 0.5] {
            let (least, passed) = (gain(cycles).powi(2), passed_of(cycles));
            let lacking = (1.0 - passed) / (1.0 - least);
            assert!((0.3..0.9).contains(&lacking), "{cycles}: {passed}, half way {least}");
        }
        // The error of the sixth order, (w/2)^6 (5/16) of the amplitude half way, is the most that lacks.
        assert!(1.0 - passed_of(0.01) < 0.625 * (PI * 0.01_f64).powi(6));
    }

    #[test]
    fn a_quintic_is_read_exactly_with_its_rate() {
        let times: Vec<f64> = (0..12).map(|i| 0.1 * f64::from(i) + 0.003 * f64::from(i * i % 5)).collect();
        let x = |t: f64| 1.0 - t + 2.0 * t.powi(3) - 0.5 * t.powi(5);
        let rate = |t: f64| -1.0 + 6.0 * t.powi(2) - 2.5 * t.powi(4);
        let samples: Vec<_> = times.iter().map(|t| Some(Estimate::new(x(*t), 0.1))).collect();
        for time in [0.35, 0.5, 0.77] {
            let read = Stencil::at(&times, time).unwrap().read(&samples).unwrap();
            // Rounding of weights up to 1/(0.1^5) in the derivative: about 1e-12.
            assert!((read.value - x(time)).abs() < 1e-13);
            assert!((read.rate - rate(time)).abs() < 1e-11);
            assert!(read.noise_gain > 0.6 && read.noise_gain < 1.05);
        }
    }

    #[test]
    fn ends_and_lost_samples_are_not_bridged() {
        let times: Vec<f64> = (0..10).map(f64::from).collect();
        let mut samples = vec![Some(Estimate::new(0.0, 0.1)); 10];
        samples[6] = None;
        assert!(Stencil::at(&times, 1.5).is_none());
        assert!(Stencil::at(&times, 7.5).is_none());
        assert!(Stencil::at(&times, 3.5).unwrap().read(&samples).is_none());
        assert!(Stencil::at(&times, 2.5).unwrap().read(&samples).is_some());
        // The frame at 7 was never taken, which costs as much as if it had been lost.
        let without: Vec<f64> = (0..14).filter(|frame| *frame != 7).map(f64::from).collect();
        let is_told = |frame: &i32| Stencil::at(&without, f64::from(*frame) + 0.5).is_some();
        assert_eq!((2..11).filter(is_told).collect::<Vec<_>>(), [2, 3, 10]);
    }
}
