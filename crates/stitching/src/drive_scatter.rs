//! The scale of the drives' deviations from the scatter that they are stated to have.

use chainwave_measurement::Estimate;

/// One strike in so many is of another kind...
const STRAYS: f64 = 1.0 / 20.0;
/// ...whose drives scatter so many times as far.
const STRAYS_SCATTER: f64 = 4.0;
/// Drives smaller than this share of the scatter are rounding's.
const ALIKE: f64 = 1e-9;
/// Places at which the density of the scale is summed, evenly over its logarithm...
const N_PLACES: usize = 600;
/// ...from the inverse of this to it.
const WIDEST: f64 = 30.0;

/// The factor that brings drives, known but for it, to their true scale: what a reading of it says together with the scatter that
/// drives are stated to have.
///
/// The drives are `n` draws from that scatter, a few strays among them, with their mean taken out and divided by the factor; so of
/// the factor `a` they say `a^(n-2)` times the densities at `a s_r`. `None` where the drives are all alike.
pub(crate) fn scale_of(drive: &[f64], scatter: f64, read: Estimate) -> Option<Estimate> {
    if drive.iter().all(|s| s.abs() < ALIKE * scatter) {
        return None;
    }
    let log_density = |scale: f64| {
        let of_drives: f64 = drive.iter().map(|s| log_density_of_drive(scale * s / scatter)).sum();
        let of_reading = -0.5 * ((scale - read.value) / read.sigma).powi(2);
        // One more power of the factor, because the sum runs over its logarithm.
        of_reading + of_drives + (drive.len() as f64 - 1.0) * scale.ln()
    };
    let place = |k: usize| WIDEST.powf(2.0 * k as f64 / (N_PLACES - 1) as f64 - 1.0);
    let logs: Vec<(f64, f64)> = (0..N_PLACES).map(place).map(|scale| (scale, log_density(scale))).collect();
    let highest = logs.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<(f64, f64)> = logs.iter().map(|(scale, log)| (*scale, (log - highest).exp())).collect();
    let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
    let mean = weights.iter().map(|(scale, weight)| scale * weight).sum::<f64>() / total;
    let variance = weights.iter().map(|(scale, weight)| (scale - mean).powi(2) * weight).sum::<f64>() / total;
    Some(Estimate::new(mean, variance.sqrt()))
}

/// Standard deviations between what a reading and what the stated scatter say of the factor, from which on they contradict each other.
const CONTRADICTION: f64 = 4.0;

/// The scatter of the drives by the reading of their scale alone, if that contradicts the stated one.
pub(crate) fn contradicted(drive: &[f64], stated: f64, read: Estimate) -> Option<f64> {
    let degrees_of_freedom = drive.len() as f64 - 1.0;
    let scatter = (drive.iter().map(|s| s * s).sum::<f64>() / degrees_of_freedom).sqrt();
    let expected = Estimate::new(stated / scatter, stated / scatter / (2.0 * degrees_of_freedom).sqrt());
    let distance = (read.value - expected.value).abs() / read.sigma.hypot(expected.sigma);
    (distance > CONTRADICTION).then_some(read.value * scatter)
}

/// Logarithm of the density of a drive in units of the scatter, but for a constant.
fn log_density_of_drive(z: f64) -> f64 {
    let of_stray = -0.5 * (z / STRAYS_SCATTER).powi(2);
    let ratio = (-0.5 * z * z - of_stray).exp();
    of_stray + ((1.0 - STRAYS) * ratio + STRAYS / STRAYS_SCATTER).ln()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    /// As many drives as a small experiment has, known but for their scale; the factor that brings them there.
    fn drives(random: &mut Pcg64Mcg, scatter: f64) -> Vec<f64> {
        let drawn: Vec<f64> = (0..15)
            .map(|_| scatter * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, random))
            .collect();
        let mean = drawn.iter().sum::<f64>() / drawn.len() as f64;
        drawn.iter().map(|s| s - mean).collect()
    }

    #[test]
    fn the_scale_is_found_within_its_interval() {
        let mut random = Pcg64Mcg::seed_from_u64(5);
        let (mut inside, mut sigmas) = (0, Vec::new());
        for _ in 0..2000 {
            let drive: Vec<f64> = drives(&mut random, 0.02).iter().map(|s| s / 1.3).collect();
            let error: f64 = StandardNormal.sample(&mut random);
            let found = scale_of(&drive, 0.02, Estimate::new(1.3 + 0.4 * error, 0.4)).unwrap();
            inside += usize::from(found.covers_95(1.3));
            sigmas.push(found.sigma);
        }
        // 15 drives tell their scatter to 19 %, the reading tells it to 31 %: together 16 % of 1.3.
        sigmas.sort_by(f64::total_cmp);
        assert!((0.18..0.25).contains(&sigmas[1000]), "{}", sigmas[1000]);
        // 2000 draws tell 95 % within 0.5 %; the strays that the density allows and the draws do not have widen it by 1 %.
        assert!((0.94..0.975).contains(&(inside as f64 / 2000.0)), "{inside} of 2000");
    }

    #[test]
    fn drives_all_alike_tell_no_scale_and_a_sharp_reading_stands_alone() {
        let read = Estimate::new(1.1, 0.05);
        assert_eq!(scale_of(&[0.0; 15], 0.02, read), None);
        let drive = drives(&mut Pcg64Mcg::seed_from_u64(6), 0.02);
        let found = scale_of(&drive, 0.02, Estimate::new(1.1, 0.02)).unwrap();
        assert!((found.value - 1.1).abs() < 0.02 && found.sigma < 0.021, "{found:?}");
    }

    #[test]
    fn a_stated_scatter_ten_times_too_wide_is_contradicted() {
        let drive = drives(&mut Pcg64Mcg::seed_from_u64(7), 0.02);
        let read = Estimate::new(1.0, 0.3);
        assert_eq!(contradicted(&drive, 0.02, read), None);
        let found = contradicted(&drive, 0.2, read).unwrap();
        assert!((found - 0.02).abs() < 0.01, "{found}");
    }
}
