//! Plane waves and the linear chain in the plane of wavenumber and frequency, and lines against continua.

use std::f64::consts::PI;

use chainwave_analysis::{
    DispersionMap, FrontSettings, LineTest, dispersion_map, dominant_frequency, exact_motion, leading_pulses,
    line_test, replicate, strain_map, tail_spectrum,
};
use chainwave_measurement::ChainMotion;
use chainwave_mechanics::{Chain, Drive, FarEnd, LinearChain, LinearLaw, Schedule, Striker, simulate};

use crate::common::{INTERVAL_S, PITCH_M, motion_of_strain, with_sigma};

const SPEED: f64 = 45.0;

/// A leading pulse and, behind it, waves of (amplitude, kappa, frequency in hertz).
fn pulse_and_waves(waves: &[(f64, f64, f64)]) -> ChainMotion {
    motion_of_strain(20, 900, |gap, t_s| {
        let since_s = t_s - 4e-3 - gap as f64 * PITCH_M / SPEED;
        let pulse = -0.05 / (since_s / 1e-3).cosh().powi(2);
        let wave = |&(amplitude, kappa, frequency_hz): &(f64, f64, f64)| {
            amplitude * (kappa * gap as f64 - 2.0 * PI * frequency_hz * t_s).cos()
        };
        pulse + if since_s > 0.0 { waves.iter().map(wave).sum::<f64>() } else { 0.0 }
    })
}

fn dispersion_of(motion: &ChainMotion) -> DispersionMap {
    let map = strain_map(motion, PITCH_M).unwrap();
    dispersion_map(&map, &leading_pulses(&map, &FrontSettings::default())).unwrap()
}

/// The test of the strongest frequency above the pulse's own.
fn line_of(motion: &ChainMotion) -> Option<LineTest> {
    let map = strain_map(motion, PITCH_M).unwrap();
    let pulses = leading_pulses(&map, &FrontSettings::default());
    let frequency_hz = dominant_frequency(&tail_spectrum(&map, &pulses)).ok()?.frequency_hz;
    Some(line_test(&map, &pulses, frequency_hz).unwrap())
}

/// Amplitude, wavenumber and frequency of the highest point among wavenumbers of one sign.
fn highest(map: &DispersionMap, forwards: bool) -> (f64, f64, f64) {
    let among = map.amplitude.indexed_iter().filter(|((row, _), _)| (map.kappa_rad[*row] > 0.0) == forwards);
    let ((row, bin), amplitude) = among.max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
    (*amplitude, map.kappa_rad[row], map.frequency_hz[bin])
}

#[test]
fn waves_that_go_and_come_back_stand_at_their_wavenumber_and_frequency() {
    let waves = [(2e-3, 1.9, 430.0), (1e-3, -2.4, 500.0)];
    let map = dispersion_of(&pulse_and_waves(&waves));
    assert_eq!(map.gaps, (1, 20));
    for (forwards, (amplitude, kappa, frequency_hz)) in [true, false].into_iter().zip(waves) {
        let (found, kappa_rad, found_hz) = highest(&map, forwards);
        // The grid is a quarter of 2 pi over the gaps, and finer in frequency; the other wave and the pulse's remains lean on it.
        assert!((kappa_rad - kappa).abs() < 0.15 * map.kappa_resolution_rad, "{kappa_rad}");
        assert!((found_hz - frequency_hz).abs() < 0.15 * map.frequency_resolution_hz, "{found_hz}");
        assert!((found / amplitude - 1.0).abs() < 0.05, "{found}");
    }
}

#[test]
fn the_tail_of_a_linear_chain_lies_on_its_dispersion_curve() {
    let (stiffness_n_per_m, mass_kg) = (1474.0, 0.455e-3);
    let chain = Chain {
        mass_kg: vec![mass_kg; 60],
        damping_kg_per_s: vec![0.0; 60],
        ground_stiffness_n_per_m: Vec::new(),
        ground_law: None,
        contact: LinearLaw { k_n_per_m: stiffness_n_per_m }.into(),
        drive: Drive::Striker(Striker { velocity_m_per_s: 0.5, damping_kg_per_s: 0.0, ..Striker::OF_RINGS }),
        far_end: FarEnd::Free,
    };
    let trajectory = simulate(&chain, &Schedule::automatic(0.033, INTERVAL_S)).unwrap().trajectory;
    let map = dispersion_of(&exact_motion(&trajectory));
    let mut n = 0;
    for (row, kappa) in map.kappa_rad.iter().enumerate().filter(|(_, kappa)| (1.2..3.0).contains(*kappa)) {
        let spectrum = map.amplitude.row(row);
        let top = (0..spectrum.len()).max_by(|a, b| spectrum[*a].total_cmp(&spectrum[*b])).unwrap();
        let known_hz = LinearChain { stiffness_n_per_m, mass_kg, ground_n_per_m: 0.0 }.frequency_hz(*kappa);
        assert!(
            (map.frequency_hz[top] - known_hz).abs() < 0.5 * map.frequency_resolution_hz,
            "kappa {kappa}: {} Hz, expected {known_hz}",
            map.frequency_hz[top]
        );
        n += 1;
    }
    assert!(n > 50, "{n}");
}

#[test]
fn a_line_is_told_from_a_continuum_and_from_noise() {
    let noisy = |motion: ChainMotion, seed| replicate(&with_sigma(motion, 0.3e-6), 1, seed).next().unwrap();
    let line = line_of(&noisy(pulse_and_waves(&[(1e-4, 3.0, 531.7)]), 1)).unwrap();
    assert!(line.p_value < 1e-3 && line.n_gaps == 10, "{line:?}");
    let falsely =
        |seed: &u64| line_of(&noisy(pulse_and_waves(&[]), *seed)).is_some_and(|line| line.p_value < 0.05);
    let n_false = (0..100).filter(falsely).count();
    // At most 5 % of those few of 100 whose noise passes for a maximum.
    assert!(n_false <= 2, "{n_false} of 100");
}
