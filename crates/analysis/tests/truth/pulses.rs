//! Travelling pulses in closed form.

use std::f64::consts::PI;

use chainwave_analysis::{DominantFrequency, MeasureSettings, Measurement, dominant_frequency, measure};

use crate::common::{PITCH_M, motion_of_strain};

const SPEED: f64 = 45.0;
const WIDTH_S: f64 = 1.2e-3;
const HEIGHT: f64 = 0.05;
const N_GAPS: usize = 14;

fn peak_time_s(gap: usize) -> f64 {
    4e-3 + gap as f64 * PITCH_M / SPEED
}

/// u = -U sech^2((t - T_n)/w).
fn strain(gap: usize, t_s: f64) -> f64 {
    -HEIGHT / ((t_s - peak_time_s(gap)) / WIDTH_S).cosh().powi(2)
}

fn measured() -> Measurement {
    let motion = motion_of_strain(N_GAPS, 600, strain);
    let settings = MeasureSettings { end_reflects: false, ..MeasureSettings::new(PITCH_M, 1) };
    measure(&motion, &settings, Some(&|_, overlap_m| 0.5 * 1474.0 * overlap_m * overlap_m)).unwrap()
}

#[test]
fn peak_and_edge_of_a_steady_pulse() {
    let edge_lead_s = WIDTH_S * 10f64.sqrt().acosh();
    for (row, front) in measured().fronts.iter().enumerate() {
        let front = front.unwrap();
        // The pulse is symmetric but its samples are not, which leaves the polynomial a small bias: a fiftieth of the noise
        // of a real recording (0.6 us).
        assert!((front.peak_time_s.value - peak_time_s(row + 1)).abs() < 1e-8, "{front:?}");
        assert!((front.peak_strain.value + HEIGHT).abs() < 2e-6, "{front:?}");
        let edge = front.edge_time_s.unwrap().value;
        // A twentieth of the noise of a real recording (0.5 us).
        assert!((edge - (peak_time_s(row + 1) - edge_lead_s)).abs() < 3e-8, "{front:?}");
        assert!(front.peak_time_s.sigma <= 0.0);
    }
}

#[test]
fn group_velocity_of_a_steady_pulse() {
    let velocity = measured().group_velocity.unwrap();
    assert_eq!(velocity.gaps, (3, N_GAPS));
    // 10 ns over 7 ms.
    assert!((velocity.velocity_m_per_s.value / SPEED - 1.0).abs() < 2e-6, "{velocity:?}");
    assert!(velocity.relative_variation.unwrap().value.abs() < 2e-5, "{velocity:?}");
    assert!(velocity.residual_m < 1e-6);
}

#[test]
fn half_width_of_a_steady_pulse() {
    let measured = measured();
    let hwhm_m = SPEED * WIDTH_S * 2f64.sqrt().acosh();
    assert!(measured.half_widths.len() > 100);
    for width in &measured.half_widths {
        // 5 um of 48 mm, a fifteenth of the noise of a real recording; the smoothing causes it.
        assert!((width.hwhm_m.value - hwhm_m).abs() < 5e-6, "{width:?}, expected {hwhm_m}");
    }
}

#[test]
fn half_width_of_a_pulse_no_wider_than_the_lattice_resolves() {
    let narrow = |gap: usize, t_s: f64| -HEIGHT * (-((t_s - peak_time_s(gap)) / 0.6e-3).powi(2)).exp();
    let motion = motion_of_strain(N_GAPS, 600, narrow);
    let settings = MeasureSettings { end_reflects: false, ..MeasureSettings::new(PITCH_M, 1) };
    let measured = measure(&motion, &settings, None).unwrap();
    let hwhm_m = SPEED * 0.6e-3 * 2f64.ln().sqrt();
    assert!(hwhm_m < PITCH_M);
    for width in &measured.half_widths {
        // The front is 0.75 gaps wide here, which no curve through one instant's strains could find; the moving frame does.
        assert!((width.hwhm_m.value / hwhm_m - 1.0).abs() < 5e-4, "{width:?}, expected {hwhm_m}");
    }
}

#[test]
fn peak_energy_of_a_linear_gap() {
    let energies = measured().energies.unwrap();
    let expected_j = 0.5 * 1474.0 * (PITCH_M * HEIGHT).powi(2);
    assert_eq!(energies.gaps, (1..=N_GAPS).collect::<Vec<_>>());
    for (energy, relative) in energies.energy_j.iter().zip(energies.relative.unwrap()) {
        // Twice the relative bias of the peak strain.
        assert!((energy.value / expected_j - 1.0).abs() < 1e-4);
        assert!((relative.value - 1.0).abs() < 1e-4);
    }
}

#[test]
fn a_sine_in_the_tail_shows_its_amplitude_and_frequency() {
    let (amplitude, frequency_hz) = (2e-3, 531.7);
    let with_tail = |gap: usize, t_s: f64| {
        let phase = 2.0 * PI * frequency_hz * t_s + gap as f64;
        strain(gap, t_s) + if t_s > peak_time_s(gap) { amplitude * phase.sin() } else { 0.0 }
    };
    let settings = MeasureSettings { end_reflects: false, ..MeasureSettings::new(PITCH_M, 1) };
    let measured = measure(&motion_of_strain(8, 800, with_tail), &settings, None).unwrap();
    for gap in &measured.spectrum.gaps {
        let top = gap.amplitude.iter().skip(40).copied().fold(0.0, f64::max);
        // A quarter of a bin beside the peak a Hann window loses 0.9 %; the pulse's own tail adds a little.
        assert!((top / amplitude - 1.0).abs() < 0.015, "gap {}: {top}", gap.gap);
        assert!(gap.start_s > peak_time_s(gap.gap));
        assert!((gap.resolution_hz * gap.duration_s - 2.0).abs() < 1e-12);
    }
    let DominantFrequency { frequency_hz: found_hz, resolution_hz } =
        dominant_frequency(&measured.spectrum).unwrap();
    // The line's own image at negative frequency and the pulse's remains shift it by less than 1 % of the resolution.
    assert!((found_hz - frequency_hz).abs() < 0.01 * resolution_hz, "{found_hz}");
}

#[test]
fn a_larger_pulse_that_comes_later_does_not_replace_the_leading_one() {
    // A pulse 1.6 times as high runs back from the far end and passes gap 14 5 ms after the first.
    let back_s = |gap: usize| peak_time_s(N_GAPS) + 5e-3 + (N_GAPS - gap) as f64 * PITCH_M / SPEED;
    let both = |gap: usize, t_s: f64| {
        strain(gap, t_s) - 1.6 * HEIGHT / ((t_s - back_s(gap)) / WIDTH_S).cosh().powi(2)
    };
    let settings = MeasureSettings::new(PITCH_M, 1);
    let measured = measure(&motion_of_strain(N_GAPS, 800, both), &settings, None).unwrap();
    for (row, front) in measured.fronts.iter().enumerate() {
        // In the last gap the second pulse's slope at the first one's peak, 1.6 * 4 exp(-2 * 5 / 1.2) * 2/w, over the curvature
        // 2/w^2 shifts the peak by 1.9 us.
        let front = front.unwrap();
        assert!((front.peak_time_s.value - peak_time_s(row + 1)).abs() < 2e-6, "{front:?}");
    }
}
