//! What a frame shows is the mean of where a body is while the frame is exposed.
//!
//! About the middle of an exposure of length T the mean of x is `x + T^2 x''/24`, and what is next behind it, `T^4 x''''/1920`, is some thousandths of that
//! where T is the whole of a frame of a wave of ten frames a period. The acceleration is told by the readings around a frame. Of exposures that are short beside
//! the motion this is less than readings tell, and left alone: their noise would be in it.

use chainwave_measurement::{BodyTrack, Estimate, Observation};

/// Share of a reading's sigma from which on the difference matters: an error of a tenth of sigma, alike in all trials, has 95 % intervals of three trials
/// hold 94.8 % of cases.
const NOTICED: f64 = 0.1;
/// Time between frames that an exposure takes at most, with what headers round.
const LONGEST: f64 = 1.01;

/// Puts every reading where the body was in the middle of its exposure, of so many seconds, where that is anywhere elsewhere than the reading.
///
/// One of no length, which nothing states, or longer than the time between frames is none, and nothing is done by it.
pub(crate) fn at_middle_of_exposure(observation: &mut Observation, exposure_s: f64) {
    let is_one = exposure_s > 0.0 && exposure_s <= LONGEST * observation.frame_interval_s();
    if !is_one {
        return;
    }
    let Observation { times_s, bodies, .. } = observation;
    let found: Vec<Vec<Option<Behind>>> =
        bodies.iter().map(|track| of_track(times_s, track, exposure_s)).collect();
    let readings = || bodies.iter().zip(&found).flat_map(|(track, found)| track.position_m.iter().zip(found));
    let share = |(position, behind): (&Option<Estimate>, &Option<Behind>)| {
        position.zip(*behind).map_or(0.0, |(position, behind)| behind.mean_m.abs() / position.sigma)
    };
    if readings().map(share).fold(0.0, f64::max) < NOTICED {
        return;
    }
    for (track, found) in bodies.iter_mut().zip(&found) {
        for (position, behind) in track.position_m.iter_mut().zip(found) {
            if let (Some(position), Some(behind)) = (position, behind) {
                let sigma = position.sigma * behind.noise;
                *position = Estimate::new(position.value - behind.mean_m, sigma);
            }
        }
    }
}

/// What the mean over an exposure is ahead of its middle by.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Behind {
    mean_m: f64,
    /// Noise of a reading without it, over that of the reading.
    noise: f64,
}

/// Frame by frame; where no readings before and behind tell it that of the next frame on either side, and nothing elsewhere.
fn of_track(times_s: &[f64], track: &BodyTrack, exposure_s: f64) -> Vec<Option<Behind>> {
    let told = |k: usize| -> Option<Behind> {
        let at = |k: usize| Some((*times_s.get(k)?, track.position_m.get(k).copied().flatten()?.value));
        let [(before_s, before), (here_s, here), (behind_s, behind)] =
            [at(k.checked_sub(1)?)?, at(k)?, at(k + 1)?];
        // Of the second derivative by three readings.
        let whole = exposure_s.powi(2) / 12.0 / (behind_s - before_s);
        let weights = [whole / (here_s - before_s), whole / (behind_s - here_s)];
        let mean_m = weights[1] * (behind - here) - weights[0] * (here - before);
        let own = 1.0 + weights[0] + weights[1];
        Some(Behind { mean_m, noise: own.hypot(weights[0]).hypot(weights[1]) })
    };
    let all: Vec<Option<Behind>> = (0..track.position_m.len()).map(told).collect();
    let of_next = |k: usize| {
        let next = [k.checked_sub(1), Some(k + 1)].into_iter().flatten();
        next.filter_map(|k| all.get(k).copied().flatten()).next()
    };
    (0..all.len()).map(|k| all[k].or_else(|| of_next(k))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const INTERVAL_S: f64 = 1e-4;

    /// A body that swings at 1 kHz by 0.2 mm from the trigger on, in frames that are exposed for so long.
    fn swinging(exposure_s: f64, sigma_m: f64) -> Observation {
        let k = std::f64::consts::TAU * 1e3;
        // The mean of 1 - cos over an exposure that lies within the motion.
        let sinc = if exposure_s > 0.0 { (0.5 * k * exposure_s).sin() / (0.5 * k * exposure_s) } else { 1.0 };
        let place = |t: &f64| Some(Estimate::new(1e-4 * (1.0 - sinc * (k * t).cos()), sigma_m));
        let times_s: Vec<f64> = (0..60).map(|i| INTERVAL_S * f64::from(i)).collect();
        let track = BodyTrack { body: 1, position_m: times_s.iter().map(place).collect() };
        Observation { recording: "one".into(), view: 1, trial: 1, times_s, bodies: vec![track] }
    }

    fn farthest_m(one: &Observation, other: &Observation) -> f64 {
        let off =
            |(a, b): (&Option<Estimate>, &Option<Estimate>)| (a.unwrap().value - b.unwrap().value).abs();
        let pairs = one.bodies[0].position_m.iter().zip(&other.bodies[0].position_m);
        // At both ends the next frame's acceleration stands for the frame's own.
        pairs.skip(1).take(58).map(off).fold(0.0, f64::max)
    }

    #[test]
    fn the_middle_of_an_exposure_is_told_by_the_frames_around() {
        let exposure_s = 0.95 * INTERVAL_S;
        let (instant, mean) = (swinging(0.0, 1e-7), swinging(exposure_s, 1e-7));
        let before_m = farthest_m(&mean, &instant);
        let mut found = mean;
        at_middle_of_exposure(&mut found, exposure_s);
        // Second differences lack (k dt)^2 / 12 of the acceleration, 3.3 % at ten frames a period, and the next order of the mean is of the same kind.
        let left_m = farthest_m(&found, &instant);
        assert!(before_m > 1e-6 && left_m < 0.05 * before_m, "{left_m} of {before_m}");
        let sigma = found.bodies[0].position_m[30].unwrap().sigma;
        let weight = (exposure_s / INTERVAL_S).powi(2) / 24.0;
        let expected = ((1.0 + 2.0 * weight).powi(2) + 2.0 * weight * weight).sqrt();
        assert!((sigma / 1e-7 - expected).abs() < 1e-9, "{sigma}");
    }

    #[test]
    fn short_exposures_and_frames_alone_stay_as_they_were_read() {
        for (exposure_s, sigma_m) in [(5e-6, 1e-7), (0.95 * INTERVAL_S, 1e-4)] {
            let read = swinging(exposure_s, sigma_m);
            let mut found = read.clone();
            at_middle_of_exposure(&mut found, exposure_s);
            assert_eq!(found, read);
        }
        // Longer than from frame to frame: what a header says of a camera's dummy frame.
        let read = swinging(0.0, 1e-7);
        let mut found = read.clone();
        at_middle_of_exposure(&mut found, 2.0 * INTERVAL_S);
        assert_eq!(found, read);
        let mut gaps = swinging(0.95 * INTERVAL_S, 1e-7);
        for k in [20, 21, 23, 24] {
            gaps.bodies[0].position_m[k] = None;
        }
        let alone = gaps.bodies[0].position_m[22];
        at_middle_of_exposure(&mut gaps, 0.95 * INTERVAL_S);
        assert_eq!(gaps.bodies[0].position_m[22], alone);
    }
}
