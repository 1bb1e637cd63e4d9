//! Motions that the simpler models describe, and the p-values that the tests give them: what the rules' measured rates are counted from.

use std::num::NonZero;
use std::ops::Range;

use chainwave_measurement::{ChainMotion, ErrorModes, Estimate, map_in_parallel};
use ndarray::Array2;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::AnalysisError;
use crate::across::motion_across;
use crate::line_test::p_value_at;
use crate::measure::{MeasureSettings, measure};
use crate::replicas::replicate;

const PITCH_M: f64 = 0.030;
const INTERVAL_S: f64 = 4e-5;
const NOISE_M: f64 = 0.4e-6;

/// P-values of motion across the chain for bodies at rest: 30 bodies over 500 frames in white noise, one draw for each seed.
pub fn of_bodies_at_rest(seeds: Range<u64>) -> Vec<f64> {
    let p_value = |seed| {
        let tracks: Vec<Vec<Option<f64>>> =
            noise(seed, 30, 500).into_iter().map(|track| track.into_iter().map(Some).collect()).collect();
        motion_across(&tracks).map(|found| found.p_value)
    };
    seeds.filter_map(p_value).collect()
}

/// P-values of a line in noise, at one frequency in the tails of six gaps of 180 frames, one draw for each seed.
pub fn of_continua(seeds: Range<u64>) -> Vec<f64> {
    const CYCLES: f64 = 0.07;
    seeds.map(|seed| p_value_at(&noise(seed, 6, 180), CYCLES)).collect()
}

/// P-values of a speed that varies, for a pulse that runs at one: 13 bodies over 400 frames, one draw of noise for each seed. With a `gain`
/// the pulse gains that share of its speed along the chain.
///
/// # Errors
/// [`AnalysisError`] as [`measure`] says.
pub fn of_one_speed(
    seeds: Range<u64>,
    gain: f64,
    n_threads: NonZero<usize>,
) -> Result<Vec<f64>, AnalysisError> {
    let stated = pulse(gain);
    let n = seeds.end.saturating_sub(seeds.start) as usize;
    let p_values = map_in_parallel(n, n_threads, |index| {
        let seed = seeds.start + index as u64;
        let settings = MeasureSettings {
            n_replicas: 100,
            end_reflects: false,
            velocity_gaps: Some(2..=11),
            // Far from the seed of the motion's own noise.
            ..MeasureSettings::new(PITCH_M, seed.wrapping_add(1_000_000))
        };
        let Some(noisy) = replicate(&stated, 1, seed).next() else { return Ok(None) };
        let velocity = measure(&noisy, &settings, None)?.group_velocity;
        Ok(velocity.ok().and_then(|velocity| velocity.variation_p_value()))
    });
    Ok(p_values.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
}

fn pulse(gain: f64) -> ChainMotion {
    const N_GAPS: usize = 12;
    const N_TIMES: usize = 400;
    const SPEED_M_PER_S: f64 = 50.0;
    let strain = |gap: usize, t_s: f64| {
        let crossed_m = gap as f64 * PITCH_M;
        let arrival_s = 3e-3 + crossed_m / SPEED_M_PER_S * (1.0 - 0.5 * gain * gap as f64 / N_GAPS as f64);
        -0.05 / ((t_s - arrival_s) / 0.6e-3).cosh().powi(2)
    };
    let times_s: Vec<f64> = (0..N_TIMES).map(|k| k as f64 * INTERVAL_S).collect();
    let mut displacement_m = Array2::from_elem((N_GAPS + 1, N_TIMES), Some(Estimate::new(0.0, NOISE_M)));
    for (k, t_s) in times_s.iter().enumerate() {
        let mut x_m = 0.0;
        for gap in 1..=N_GAPS {
            x_m += PITCH_M * strain(gap, *t_s);
            displacement_m[(gap, k)] = Some(Estimate::new(x_m, NOISE_M));
        }
    }
    ChainMotion {
        times_s,
        independent_sigma_m: Array2::from_elem(displacement_m.dim(), NOISE_M),
        modes: ErrorModes::default(),
        n_trials: Array2::ones(displacement_m.dim()),
        displacement_m,
    }
}

fn noise(seed: u64, n_tracks: usize, n_frames: usize) -> Vec<Vec<f64>> {
    let mut random = Pcg64::seed_from_u64(seed);
    (0..n_tracks).map(|_| (0..n_frames).map(|_| StandardNormal.sample(&mut random)).collect()).collect()
}
