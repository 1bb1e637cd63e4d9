//! Whether bodies that are taken to rest do: how far apart two of them are seen then changes by noise alone.
//!
//! Bodies that bend carry waves that run ahead of the one that a chain of rigid bodies foretells, and move by micrometres before it
//! comes. What a camera does of its own moves two bodies of one frame alike, so their distance tells of the bodies alone. Its noise is
//! independent from frame to frame, and what bodies do is not: products of neighbouring frames have a mean of zero at rest, whatever the
//! noise's size.

use chainwave_measurement::{BodyTrack, Observation};

use crate::probability::normal_beyond;
use crate::rule::{Rule, SIGNIFICANCE_LEVEL};

/// Frames that a pair of bodies is looked at over at least.
const MIN_FRAMES: usize = 8;

/// The rule by which bodies count as moving although they are taken to rest.
pub fn at_rest_rule() -> Rule {
    Rule {
        question: "bodies ahead of the wave",
        text: format!(
            "at rest for as long as their distances change from frame to frame by independent noise (mean product of neighbouring frames, {} % \
             level)",
            100.0 * SIGNIFICANCE_LEVEL
        ),
        level: Some(SIGNIFICANCE_LEVEL),
        rates: Vec::new(),
    }
}

/// Probability of distances of bodies as smooth as those of some recordings where all bodies rest until `rests_until_s` (of body 1, 2, ..,
/// in seconds after the trigger); `None` where no recording shows two bodies for long enough.
pub fn at_rest_p_value(observations: &[Observation], rests_until_s: &[f64]) -> Option<f64> {
    let (products, variance) = observations
        .iter()
        .map(|observation| of_recording(observation, rests_until_s))
        .fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    (variance > 0.0).then(|| normal_beyond(products / variance.sqrt()))
}

/// Sum of the products of neighbouring frames over the mean square, less what it is at rest, and its variance at rest.
fn of_recording(observation: &Observation, rests_until_s: &[f64]) -> (f64, f64) {
    let mut sum = (0.0, 0.0);
    for pair in observation.bodies.windows(2) {
        let apart_m = apart_at_rest(observation, [&pair[0], &pair[1]], rests_until_s);
        if apart_m.len() < MIN_FRAMES {
            continue;
        }
        let n = apart_m.len() as f64;
        let mean_m = apart_m.iter().sum::<f64>() / n;
        let square_m2 = apart_m.iter().map(|x| (x - mean_m).powi(2)).sum::<f64>() / n;
        if square_m2 > 0.0 {
            let products: f64 = apart_m.windows(2).map(|x| (x[0] - mean_m) * (x[1] - mean_m)).sum();
            // The mean takes one product's worth off. Pairs that share a body share a quarter of each other's variance, and no body is in
            // more than two: half as much again is the most that it comes to.
            sum = (sum.0 + products / square_m2 + 1.0, sum.1 + 1.5 * n);
        }
    }
    sum
}

/// How far the second body is seen from the first while both rest.
fn apart_at_rest(observation: &Observation, pair: [&BodyTrack; 2], rests_until_s: &[f64]) -> Vec<f64> {
    let until_s = pair.map(|track| rests_until_s.get(track.body - 1).copied().unwrap_or(f64::NEG_INFINITY));
    let until_s = until_s[0].min(until_s[1]);
    let rests = observation.times_s.iter().take_while(|time_s| **time_s < until_s);
    let places = rests.zip(pair[0].position_m.iter().zip(&pair[1].position_m));
    places.filter_map(|(_, (first, second))| Some((*second)?.value - (*first)?.value)).collect()
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Estimate;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;

    const NOISE_M: f64 = 1e-6;

    /// Twenty recordings of three bodies over 160 frames; the camera swings by 5 um, and behind frame 80 a wave of `ahead_m` runs along the
    /// bodies, a third of its period from body to body.
    fn recordings(random: &mut Pcg64, ahead_m: f64) -> Vec<Observation> {
        let times_s: Vec<f64> = (-40..120).map(|frame| f64::from(frame) * 4e-5).collect();
        let mut noise = || -> f64 { StandardNormal.sample(random) };
        let mut recording = |trial: u32| {
            let mut body = |body: usize| {
                let place = |time_s: &f64| {
                    let camera_m = 5e-6 * (12570.0 * time_s + f64::from(trial)).sin();
                    let phase = 3000.0 * (time_s - 1.6e-3) - 2.1 * body as f64;
                    let wave_m = if *time_s > 1.6e-3 { ahead_m * phase.sin() } else { 0.0 };
                    Some(Estimate::new(0.03 * body as f64 + camera_m + wave_m + NOISE_M * noise(), NOISE_M))
                };
                BodyTrack { body, position_m: times_s.iter().map(place).collect() }
            };
            let bodies = (1..4).map(&mut body).collect();
            Observation { recording: trial.to_string(), view: 1, trial, times_s: times_s.clone(), bodies }
        };
        (0..20).map(&mut recording).collect()
    }

    #[test]
    fn bodies_at_rest_are_seldom_said_to_move_whatever_the_camera_does() {
        let mut random = Pcg64::seed_from_u64(18);
        let p = |random: &mut Pcg64| at_rest_p_value(&recordings(random, 0.0), &[5e-3; 3]).unwrap();
        let n_false = (0..300).filter(|_| p(&mut random) < 0.05).count();
        // At most 5 % of 300 are 15 +- 3.8: four standard errors. Pairs share less than what they are allowed for.
        assert!(n_false <= 30, "{n_false} of 300");
    }

    #[test]
    fn a_wave_below_the_noise_is_told_and_ends_where_it_begins() {
        let mut random = Pcg64::seed_from_u64(19);
        let found = recordings(&mut random, 0.5 * NOISE_M);
        // Bodies a third of a period apart change their distance by 1.7 amplitudes: products of 0.37 of a reading's variance in 80 of 160
        // frames, and distances of 2.2 of it: over 40 pairs a sum of 540, against a deviation of 98.
        assert!(at_rest_p_value(&found, &[5e-3; 3]).unwrap() < 1e-3);
        assert!(at_rest_p_value(&found, &[1.6e-3; 3]).unwrap() > 1e-3);
        assert!(at_rest_p_value(&found, &[-1.4e-3; 3]).is_none());
        assert!(at_rest_p_value(&[], &[]).is_none());
    }
}
