//! What imported trials contradict of what is stated of them: errors at rest, units, the order of their bodies.

use chainwave_analysis::Measurement;
use chainwave_measurement::Observation;
use chainwave_stitching::WildReading;

use super::order;
use crate::digits::counted;

/// Standard deviations by which an error at rest is told to be another than stated.
const TOLD_SIGMAS: f64 = 5.0;
/// Errors of neighbouring samples that are less alike, and scatter that is larger by less, change intervals by less than a tenth and a quarter.
const LEAST_CORRELATION: f64 = 0.1;
const LEAST_RATIO: f64 = 1.25;
/// Samples at rest from which either can be told.
const LEAST_SAMPLES: usize = 100;

/// Everything that is to be said.
pub(super) fn remarks(
    observations: &[Observation],
    rest_until_s: f64,
    measurement: &Measurement,
) -> Vec<String> {
    let at_rest = AtRest::of(observations, rest_until_s);
    let of_rest = at_rest.iter().flat_map(AtRest::remarks);
    of_rest
        .chain(odd_speed(measurement))
        .chain(beyond_all(measurement))
        .chain(order::remarks(observations, rest_until_s))
        .collect()
}

/// What is to be said of the readings of each trial that were taken out.
pub(super) fn wild_remarks(wild: &[WildReading], observations: &[Observation]) -> Vec<String> {
    let of_trial = |(index, observation): (usize, &Observation)| {
        let own: Vec<&WildReading> = wild.iter().filter(|one| one.index == index).collect();
        let farthest = own.iter().max_by(|a, b| a.off_m.abs().total_cmp(&b.off_m.abs()))?;
        Some(format!(
            "{}: {} left out that {} far from those before and after, the farthest of body {} at {:.3} ms by {:+.2e} m (hint: did the \
             tracker jump to another mark?)",
            observation.recording,
            counted(own.len(), "reading"),
            if own.len() == 1 { "is" } else { "are" },
            farthest.body,
            1e3 * farthest.time_s,
            farthest.off_m
        ))
    };
    observations.iter().enumerate().filter_map(of_trial).collect()
}

/// Speeds of waves in chains, in metres a second: those of the slowest that fall under their weight, and beyond sound in any solid.
const USUAL_SPEEDS_M_PER_S: std::ops::Range<f64> = 0.1..1e4;

/// What is to be said of a speed that no chain has.
fn odd_speed(measurement: &Measurement) -> Option<String> {
    let speed_m_per_s = measurement.group_velocity.as_ref().ok()?.velocity_m_per_s.value;
    (!USUAL_SPEEDS_M_PER_S.contains(&speed_m_per_s.abs())).then(|| {
        format!(
            "the group velocity is {speed_m_per_s:.3e} m/s, as of no wave in a chain (hint: is chain.pitch_m in metres, displacement.unit_m in \
             metres a unit, time.unit_s in seconds a unit?)"
        )
    })
}

/// How samples scatter at rest, in their stated sigmas.
struct AtRest {
    n: f64,
    /// Mean square, and mean product of neighbours.
    square: f64,
    product: f64,
}

impl AtRest {
    fn of(observations: &[Observation], rest_until_s: f64) -> Option<Self> {
        let (mut n, mut squares, mut products) = (0.0, 0.0, 0.0);
        for (observation, track) in
            observations.iter().flat_map(|one| one.bodies.iter().map(move |b| (one, b)))
        {
            let Some(mean_m) = observation.mean_before_m(track, rest_until_s) else { continue };
            let deviations: Vec<f64> = observation
                .readings_before(track, rest_until_s)
                .filter(|x| x.sigma > 0.0)
                .map(|x| (x.value - mean_m) / x.sigma)
                .collect();
            let own = deviations.len() as f64;
            if own > 2.0 {
                // The mean took one of them, and an n-th of each from its neighbours' products.
                let square = deviations.iter().map(|one| one * one).sum::<f64>();
                squares += square * own / (own - 1.0);
                products += deviations.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() + square / own;
                n += own;
            }
        }
        (n >= LEAST_SAMPLES as f64).then(|| Self { n, square: squares / n, product: products / n })
    }

    fn remarks(&self) -> Vec<String> {
        let ratio = self.square.sqrt();
        let correlation = self.product / self.square;
        // Of n independent normal numbers.
        let is_wide = ratio > LEAST_RATIO && self.square > 1.0 + TOLD_SIGMAS * (2.0 / self.n).sqrt();
        let is_alike = correlation > LEAST_CORRELATION && correlation > TOLD_SIGMAS / self.n.sqrt();
        let wide = is_wide.then(|| {
            format!(
                "at rest the samples scatter {ratio:.1} times as much as their stated sigma says: what follows from few trials is less certain by as \
                 much (hint: the mapping's [sigma])"
            )
        });
        let alike = is_alike.then(|| {
            format!(
                "at rest the errors of neighbouring samples are alike (correlation {correlation:.2}), as a filter or an average over frames leaves \
                 them, and sigmas count them as independent: peaks, edges and speeds may be off by up to {:.1} times as much as stated (hint: displacements \
                 before any smoothing)",
                ((1.0 + correlation) / (1.0 - correlation)).sqrt()
            )
        });
        wide.into_iter().chain(alike).collect()
    }
}

/// What no chain does: a gap that closes by more than its pitch.
fn beyond_all(measurement: &Measurement) -> Option<String> {
    let fronts = measurement.fronts.iter().flatten();
    let strongest = fronts.min_by(|one, other| one.peak_strain.value.total_cmp(&other.peak_strain.value))?;
    let strain = strongest.peak_strain.value;
    (strain < -1.0).then(|| {
        format!(
            "gap {} closes by {:.3e} times its pitch: bodies would pass through each other (hint: is displacement.unit_m that of the files, and \
             chain.pitch_m in metres?)",
            strongest.gap, -strain
        )
    })
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::{BodyTrack, Estimate};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;

    const SIGMA_M: f64 = 2e-6;

    /// Ten bodies that rest for 30 samples, with errors so many times as large as stated, and so alike from one to the next.
    fn resting(seed: u64, ratio: f64, correlation: f64) -> Vec<Observation> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut track = |body: usize| {
            let mut last: f64 = StandardNormal.sample(&mut random);
            let position_m = (0..40).map(|_| {
                let own: f64 = StandardNormal.sample(&mut random);
                last = correlation * last + (1.0 - correlation * correlation).sqrt() * own;
                Some(Estimate::new(ratio * SIGMA_M * last, SIGMA_M))
            });
            BodyTrack { body, position_m: position_m.collect() }
        };
        let bodies = (1..=10).map(&mut track).collect();
        let times_s = (-30..10).map(|k| 1e-4 * f64::from(k)).collect();
        vec![Observation { recording: "one".into(), view: 1, trial: 1, times_s, bodies }]
    }

    fn told(observations: &[Observation]) -> Vec<String> {
        AtRest::of(observations, -5e-5).unwrap().remarks()
    }

    #[test]
    fn white_errors_of_the_stated_size_are_nothing_to_say() {
        // 300 samples tell a mean square to 8 % and a correlation to 6 %: five of these are passed once in a million.
        assert!((0..300).all(|seed| told(&resting(seed, 1.0, 0.0)).is_empty()));
    }

    #[test]
    fn errors_that_are_larger_or_alike_are_named() {
        for seed in 0..30 {
            let wide = told(&resting(seed, 3.0, 0.0));
            assert!(wide.len() == 1 && wide[0].contains("times as much as their stated sigma"), "{wide:?}");
            let alike = told(&resting(seed, 1.0, 0.7));
            assert!(alike.iter().any(|one| one.contains("neighbouring samples are alike")), "{alike:?}");
        }
        assert!(AtRest::of(&resting(1, 1.0, 0.0), -2.5e-3).is_none(), "50 samples tell neither");
    }
}
