//! Measures the wave in a motion: a pulse at 50 m/s through twelve gaps, seen with 1 um of noise.

use chainwave_analysis::{AnalysisError, MeasureSettings, measure, replicate};
use chainwave_measurement::{ChainMotion, ErrorModes, Estimate};
use ndarray::Array2;

const PITCH_M: f64 = 0.030;
const NOISE_M: f64 = 1e-6;

#[expect(clippy::print_stdout, reason = "the measured numbers are the program's result")]
fn main() -> Result<(), AnalysisError> {
    let Some(seen) = replicate(&motion(), 1, 7).next() else { return Ok(()) };
    let measured =
        measure(&seen, &MeasureSettings { end_reflects: false, ..MeasureSettings::new(PITCH_M, 1) }, None)?;
    for front in measured.fronts.iter().flatten() {
        let (peak, strain) = (front.peak_time_s, front.peak_strain);
        println!(
            "gap {:2}: peak at {:.4} +- {:.4} ms, strain {:.5} +- {:.5}",
            front.gap,
            1e3 * peak.value,
            1e3 * peak.sigma,
            strain.value,
            strain.sigma
        );
    }
    match measured.group_velocity {
        Ok(found) => {
            println!("c_g = {:.3} +- {:.3} m/s", found.velocity_m_per_s.value, found.velocity_m_per_s.sigma);
        }
        Err(reason) => println!("no group velocity: {}", reason.as_str()),
    }
    Ok(())
}

/// Each gap is closed by a pulse of 0.6 ms that comes 0.6 ms after the last gap's.
fn motion() -> ChainMotion {
    let times_s: Vec<f64> = (0..400).map(|k| 4e-5 * f64::from(k)).collect();
    let closed_m = |gap: usize, t_s: f64| {
        let since_s = t_s - 3e-3 - gap as f64 * PITCH_M / 50.0;
        0.05 * PITCH_M / (since_s / 0.6e-3).cosh().powi(2)
    };
    let displacement_m = Array2::from_shape_fn((13, times_s.len()), |(body, k)| {
        let x_m = (body..12).map(|gap| closed_m(gap, times_s[k])).sum();
        Some(Estimate::new(x_m, NOISE_M))
    });
    ChainMotion {
        independent_sigma_m: Array2::from_elem(displacement_m.dim(), NOISE_M),
        modes: ErrorModes::default(),
        n_trials: Array2::ones(displacement_m.dim()),
        times_s,
        displacement_m,
    }
}
