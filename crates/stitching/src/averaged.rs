//! The mean of trials of another coordinate than the one along the chain, by drives and triggers that are known.

use chainwave_measurement::{ChainMotion, Estimate, Observation};
use ndarray::Array2;

use crate::resample::Resampling;
use crate::rest::{Displacement, displacement_from_rest};
use crate::settings::Settings;
use crate::stitched::Alignment;

/// Samples on each side whose trials say together whether they scatter by more than their sigmas: with two trials, 65 degrees of freedom,
/// which know a standard deviation to a tenth.
const HALF_WINDOW: usize = 32;

/// The motion of another coordinate of the bodies (across the chain, or their rotation), at the times of a motion along the chain that was
/// merged from the same recordings: the mean of all readings of a body, weighted by their variances, each read where its recording's
/// trigger puts it.
///
/// Nothing says how such a motion goes with the drive, so that trials are not put on one drive: where they scatter about their mean by more
/// than their sigmas (chi squared of a window of 65 samples over its degrees of freedom, R. T. Birge, Phys. Rev. 40 (1932) 207), the sigma of
/// the mean grows by the root of that ratio. `observations` and `alignments` are in one order; `position_m` is the coordinate, whatever
/// its unit, and a body of which nothing was read at rest is not seen. The place at rest counts in the total sigma alone.
pub fn averaged(
    observations: &[Observation],
    alignments: &[Alignment],
    times_s: &[f64],
    settings: &Settings,
) -> ChainMotion {
    let shape = (settings.n_bodies, times_s.len());
    let mut motion = ChainMotion::unseen(settings.n_bodies, times_s.to_vec());
    let interval_s = times_s.get(1).map_or(f64::INFINITY, |second_s| second_s - times_s[0]);
    let mut sums = Array2::from_elem(shape, SampleSums::default());
    for (observation, alignment) in observations.iter().zip(alignments) {
        let tracks = observation.bodies.iter().filter(|track| (1..=settings.n_bodies).contains(&track.body));
        let displacements: Vec<Displacement> = tracks
            .filter_map(|track| displacement_from_rest(observation, track, settings.rest_until_s).ok())
            .collect();
        let own_s = times_s.iter().map(|time_s| time_s + alignment.trigger_offset_s.value);
        let resampled = Resampling::at(observation, own_s);
        for i in 0..times_s.len() {
            for displacement in &displacements {
                let Some(read) = resampled.read(i, &displacement.samples) else { continue };
                let noise = read.noise_gain * read.sigma.powi(2);
                let n_shared = read.n_shared(interval_s);
                sums[(displacement.row, i)].add(
                    read.value,
                    noise,
                    displacement.rest_sigma_m.powi(2),
                    n_shared,
                );
            }
        }
    }
    for (row, of_body) in sums.rows().into_iter().enumerate() {
        let of_body = of_body.to_vec();
        for (i, one) in of_body.iter().enumerate().filter(|(_, one)| one.weight > 0.0) {
            let around = i.saturating_sub(HALF_WINDOW)..(i + HALF_WINDOW + 1).min(of_body.len());
            let ratio = scatter_ratio(&of_body[around]);
            motion.displacement_m[(row, i)] = Some(Estimate::new(one.mean(), (ratio / one.weight).sqrt()));
            motion.independent_sigma_m[(row, i)] = (ratio * one.noise).sqrt() / one.weight;
            motion.n_trials[(row, i)] = one.n;
        }
    }
    motion
}

/// Weighted sums over the readings of one sample.
#[derive(Debug, Clone, Copy, Default)]
struct SampleSums {
    n: u32,
    weight: f64,
    values: f64,
    squares: f64,
    /// Of the squared weights with the noise's variances.
    noise: f64,
}

impl SampleSums {
    /// A reading with the variances of its noise and of its place at rest. A reading without any error, which only a made one can be,
    /// counts as one of a tiny error. So many times share its noise, which is no smaller for being repeated.
    fn add(&mut self, value: f64, noise: f64, rest: f64, n_shared: f64) {
        let weight = (noise + rest).max(f64::MIN_POSITIVE.sqrt()).recip();
        self.n += 1;
        self.weight += weight;
        self.values += weight * value;
        self.squares += weight * value * value;
        self.noise += weight * weight * noise * n_shared;
    }

    fn mean(&self) -> f64 {
        self.values / self.weight
    }

    fn chi_squared(&self) -> f64 {
        if self.n > 1 { (self.squares - self.values * self.mean()).max(0.0) } else { 0.0 }
    }
}

/// Chi squared about the means over its degrees of freedom, at least 1.
fn scatter_ratio(samples: &[SampleSums]) -> f64 {
    let chi_squared: f64 = samples.iter().map(SampleSums::chi_squared).sum();
    let degrees_of_freedom: u32 = samples.iter().map(|one| one.n.saturating_sub(1)).sum();
    if degrees_of_freedom == 0 { 1.0 } else { (chi_squared / f64::from(degrees_of_freedom)).max(1.0) }
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::BodyTrack;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    const SIGMA: f64 = 1e-6;
    const STEP_S: f64 = 1e-4;

    /// Trials of one body that goes to and fro at 50 Hz by `amplitude` from the trigger on, `own` of it by another share in each trial.
    fn trials(seed: u64, own: f64) -> (Vec<Observation>, Vec<Alignment>) {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut normal = move || -> f64 { StandardNormal.sample(&mut random) };
        (1..=5)
            .map(|trial| {
                let (lead_s, share) = (3e-5 * normal(), 1.0 + own * normal());
                let times_s: Vec<f64> = (-40..160).map(|frame| STEP_S * f64::from(frame)).collect();
                let place =
                    |t: &f64| Some(Estimate::new(0.02 + share * truth(t - lead_s) + SIGMA * normal(), SIGMA));
                let position_m = times_s.iter().map(place).collect();
                let recording = format!("trial {trial}");
                let alignment = Alignment {
                    recording: recording.clone(),
                    view: 1,
                    trial,
                    trigger_offset_s: Estimate::new(lead_s, 0.0),
                    drive_deviation: Estimate::new(0.0, 0.0),
                    scatter_ratio: 1.0,
                };
                let bodies = vec![BodyTrack { body: 1, position_m }];
                (Observation { recording, view: 1, trial, times_s, bodies }, alignment)
            })
            .unzip()
    }

    fn truth(time_s: f64) -> f64 {
        if time_s < 0.0 { 0.0 } else { 20e-6 * (1.0 - (314.159 * time_s).cos()) }
    }

    /// Share of samples after the trigger whose interval holds the truth, and their mean sigma, over some experiments.
    fn held(own: f64) -> [f64; 2] {
        let settings = Settings { rest_until_s: -STEP_S / 2.0, ..Settings::new(1, STEP_S) };
        let times_s: Vec<f64> = (0..150).map(|i| STEP_S * f64::from(i)).collect();
        let (mut n_held, mut sigma, mut n) = (0.0, 0.0, 0.0);
        for seed in 0..200 {
            let (observations, alignments) = trials(seed, own);
            let motion = averaged(&observations, &alignments, &times_s, &settings);
            for (time_s, found) in times_s.iter().zip(motion.displacement_m.row(0)) {
                let Some(found) = found else { continue };
                n_held += f64::from(u8::from(found.covers_95(truth(*time_s))));
                sigma += found.sigma;
                n += 1.0;
            }
        }
        [n_held / n, sigma / n]
    }

    #[test]
    fn trials_that_repeat_are_averaged_within_their_sigmas() {
        let [held, sigma] = held(0.0);
        // 200 experiments of 146 samples, whose places at rest are in common: an effective number above 200, so 0.95 +- 3 x 0.0154.
        assert!((held - 0.95).abs() < 0.046, "{held}");
        // Five trials of a noise gain of 0.7 to 1, and 1/40 of a variance for the place at rest; the ratio, at least 1, adds a little.
        let expected = SIGMA * (0.875_f64 / 5.0 + 1.0 / 200.0).sqrt();
        assert!((sigma / expected - 1.0).abs() < 0.12, "{sigma}");
    }

    #[test]
    fn trials_that_differ_say_so_in_sigma() {
        // 30 % of 20 to 40 um, from trial to trial, against a noise of 1 um: the mean of five is known to 3 to 5 um. Five trials know their
        // own scatter by 4 degrees of freedom, all samples of a window alike, so that 1.96 sigma hold what 1.96 holds of Student's t: 0.88;
        // 200 experiments know that to 0.023. Samples near rest and turning points of the motion hold more, up to the 0.95 +- 0.0154 of above.
        let [held, sigma] = held(0.3);
        assert!(held > 0.88 - 3.0 * 0.023 && held < 0.95 + 3.0 * 0.0154, "{held}");
        assert!(sigma > 5.0 * SIGMA * 0.44, "{sigma}");
    }
}
