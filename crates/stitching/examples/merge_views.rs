//! Merges synthetic tracks of two views that share a body, and prints x_n with its standard uncertainty.

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use chainwave_measurement::{BodyTrack, Estimate, Observation};
use chainwave_stitching::{Settings, StitchingError, merge};

/// One frame at 25 kHz.
const FRAME_S: f64 = 4e-5;
/// What a tracker states: 5 mpx at 5 px/mm.
const SIGMA_M: f64 = 1e-6;

fn main() -> Result<(), StitchingError> {
    // Bodies 1 to 3 in the first view, 3 to 5 in the second; three trials each, with the drive (relative to the mean) and the trigger's
    // offset that nobody tells the program.
    let trials = [(0.02, 5e-6), (-0.01, -8e-6), (0.0, 2e-6), (-0.02, 4e-6), (0.015, -1e-6), (-0.005, -2e-6)];
    let recordings: Vec<Observation> =
        (0..).zip(trials).map(|(k, trial)| filmed(k / 3, k % 3, trial)).collect();

    let stitched = merge(&recordings, &Settings::new(5, 2.0 * FRAME_S))?;

    for alignment in &stitched.alignments {
        let (offset_s, drive) = (alignment.trigger_offset_s, alignment.drive_deviation);
        println!(
            "{}: trigger {:+6.2} +- {:.2} us, drive {:+5.2} +- {:.2} %",
            alignment.recording,
            1e6 * offset_s.value,
            1e6 * offset_s.sigma,
            100.0 * drive.value,
            100.0 * drive.sigma
        );
    }
    let last = stitched.motion.times_s.len() - 40;
    println!("at {:.2} ms:", 1e3 * stitched.motion.times_s[last]);
    for (body, x) in (1..).zip(stitched.motion.displacement_m.column(last)) {
        match x {
            Some(x) => println!("x_{body} = {:.4} +- {:.4} mm", 1e3 * x.value, 1e3 * x.sigma),
            None => println!("x_{body} was not seen"),
        }
    }
    for warning in &stitched.warnings {
        println!("warning: {warning}");
    }
    Ok(())
}

/// What a perfect tracker makes of one trial.
fn filmed(view: u32, trial: u32, (drive, offset_s): (f64, f64)) -> Observation {
    let times_s: Vec<f64> = (-50..250).map(|frame| f64::from(frame) * FRAME_S).collect();
    let first = 2 * view as usize + 1;
    let track = |body: usize| {
        let position =
            |time_s: &f64| Some(Estimate::new(displacement_m(body, time_s - offset_s, drive), SIGMA_M));
        BodyTrack { body, position_m: times_s.iter().map(position).collect() }
    };
    let bodies = (first..first + 3).map(track).collect();
    Observation { recording: format!("view {view} trial {trial}"), view, trial, times_s, bodies }
}

/// A travelling step in proportion to the drive; a harder strike is slower, as in a softening chain.
fn displacement_m(body: usize, time_s: f64, drive: f64) -> f64 {
    let arrival_s = 0.6e-3 * (body - 1) as f64 * (1.0 + 0.1 * drive);
    let since = ((time_s - arrival_s) / 2e-3).max(0.0);
    14e-3 * (1.0 + drive) * (1.0 - (-since * since).exp())
}
