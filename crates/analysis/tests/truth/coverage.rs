//! Stated intervals against synthetic noise: how often they hold the truth.

use chainwave_analysis::{MeasureSettings, Measurement, exact_motion, measure, replicate};
use chainwave_measurement::{ChainMotion, Estimate};
use chainwave_mechanics::FarEnd;

use crate::common::{PITCH_M, paper_chain, ring_law, with_late_view, with_sigma};

const N_EXPERIMENTS: usize = 40;

/// Counts how many estimates hold their truth within one and within 1.96 standard uncertainties.
#[derive(Default)]
struct Coverage {
    n: f64,
    within_68: f64,
    within_95: f64,
    /// Sum of the errors in standard uncertainties.
    error: f64,
}

impl Coverage {
    fn add(&mut self, found: Estimate, truth: Estimate) {
        let distance = (found.value - truth.value).abs();
        self.error += (found.value - truth.value) / found.sigma;
        self.n += 1.0;
        self.within_68 += f64::from(u8::from(distance < found.sigma));
        self.within_95 += f64::from(u8::from(found.covers_95(truth.value)));
    }

    /// The tolerances allow for `N_EXPERIMENTS` correlated experiments of 60 replicas, whose sigma is known to 9 %.
    fn check(&self, what: &str, tolerance_68: f64, tolerance_95: f64) {
        let (share_68, share_95) = (self.within_68 / self.n, self.within_95 / self.n);
        let bias = self.error / self.n;
        println!(
            "{what}: {} values, {share_68:.3} within 68 %, {share_95:.3} within 95 %, {bias:+.3}",
            self.n
        );
        // The mean of `N_EXPERIMENTS` scatters by a sixth of a standard uncertainty where all of an experiment's errors are one.
        assert!(bias.abs() < 0.4, "{what}: errors are {bias} standard uncertainties on average");
        assert!((share_68 - 0.68).abs() < tolerance_68, "{what}: 68 % interval holds {share_68}");
        assert!(share_95 > 0.95 - tolerance_95, "{what}: 95 % interval holds {share_95}");
    }
}

fn measured(motion: &ChainMotion, seed: u64) -> Measurement {
    let law = ring_law();
    let settings =
        MeasureSettings { n_replicas: 60, velocity_gaps: Some(3..=9), ..MeasureSettings::new(PITCH_M, seed) };
    measure(motion, &settings, Some(&|overlap_m| law.energy_j(overlap_m))).unwrap()
}

fn check_coverage(sigma_m: f64, late_s: f64) {
    let exact = exact_motion(&paper_chain(16, 2.73, FarEnd::Free, 0.011).trajectory);
    let truth = measured(&exact, 0);
    let stated = with_late_view(with_late_view(with_sigma(exact, sigma_m), 0..7, late_s), 6..16, late_s);
    let [mut peaks, mut edges, mut energies, mut speeds, mut widths, mut tails] =
        [(); 6].map(|()| Coverage::default());
    for (index, noisy) in replicate(&stated, N_EXPERIMENTS, 2024).enumerate() {
        let found = measured(&noisy, index as u64);
        for (found, truth) in found.fronts.iter().zip(&truth.fronts).take(9) {
            let (found, truth) = (found.unwrap(), truth.unwrap());
            peaks.add(found.peak_time_s, truth.peak_time_s);
            peaks.add(found.peak_strain, truth.peak_strain);
            edges.add(found.edge_time_s.unwrap(), truth.edge_time_s.unwrap());
        }
        let (found_j, truth_j) = (found.energies.unwrap(), truth.energies.as_ref().unwrap());
        found_j.energy_j.iter().zip(&truth_j.energy_j).take(9).for_each(|(a, b)| energies.add(*a, *b));
        if let (Ok(found), Ok(truth)) = (found.local_resonance, &truth.local_resonance) {
            tails.add(found.frequency_hz, truth.frequency_hz);
        }
        let (speed, true_speed) = (found.group_velocity.unwrap(), truth.group_velocity.unwrap());
        speeds.add(speed.velocity_m_per_s, true_speed.velocity_m_per_s);
        for width in found.half_widths.iter().step_by(10) {
            let same = truth.half_widths.iter().find(|other| (other.t_s - width.t_s).abs() < 1e-9);
            same.into_iter().for_each(|same| widths.add(width.hwhm_m, same.hwhm_m));
        }
    }
    peaks.check("peaks", 0.06, 0.03);
    edges.check("edges", 0.08, 0.04);
    energies.check("energies", 0.08, 0.04);
    widths.check("half widths", 0.10, 0.05);
    speeds.check("group velocity", 0.20, 0.08);
    // Strong noise hides the maximum.
    if tails.n > 0.5 * N_EXPERIMENTS as f64 {
        tails.check("tail frequency", 0.20, 0.08);
    }
}

#[test]
fn independent_noise_and_late_views_are_covered() {
    check_coverage(0.3e-6, 0.5e-6);
}

#[test]
fn strong_noise_is_covered() {
    check_coverage(10e-6, 0.0);
}

/// The paper's chain, five views that are timed to 0.3 us, and 1 um of noise in each merged sample: what 2 % noise leaves.
#[test]
fn the_group_velocity_is_known_to_a_thousandth_at_the_papers_scale() {
    let exact = exact_motion(&paper_chain(26, 2.73, FarEnd::Free, 0.018).trajectory);
    let settings = |seed| MeasureSettings { n_replicas: 60, ..MeasureSettings::new(PITCH_M, seed) };
    let truth = measure(&exact, &settings(0), None).unwrap().group_velocity.unwrap();
    let late = |motion, view: usize| with_late_view(motion, 5 * view..(5 * view + 6).min(26), 0.3e-6);
    let stated = (0..5).fold(with_sigma(exact, 1e-6), late);
    for (seed, noisy) in replicate(&stated, 5, 7).enumerate() {
        let gaps = Some(truth.gaps.0..=truth.gaps.1);
        let settings = MeasureSettings { velocity_gaps: gaps, ..settings(seed as u64) };
        let found = measure(&noisy, &settings, None).unwrap().group_velocity.unwrap().velocity_m_per_s;
        let true_m_per_s = truth.velocity_m_per_s.value;
        // The sigma is 2e-4 of it.
        assert!(found.sigma < 1e-3 * true_m_per_s, "{found:?}");
        assert!((found.value - true_m_per_s).abs() < 1e-3 * true_m_per_s, "{found:?}, {true_m_per_s}");
    }
}
