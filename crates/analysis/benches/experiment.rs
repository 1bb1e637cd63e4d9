//! Time of the analysis of an experiment of the paper's size: 26 bodies, 540 frames.

use std::hint::black_box;

use chainwave_analysis::{MeasureSettings, exact_motion, measure};
use chainwave_measurement::ChainMotion;
use chainwave_mechanics::{Chain, MechanicsError, PowerLaw, Schedule, simulate};

fn main() {
    divan::main();
}

const N_BODIES: usize = 26;
const FRAME_S: f64 = 4e-5;
const NOISE_M: f64 = 0.4e-6;
const PITCH_M: f64 = 0.030;

/// Everything that is measured of the motion, on 200 replicas.
#[divan::bench(sample_count = 3)]
fn measure_with_200_replicas(bencher: divan::Bencher<'_, '_>) {
    let settings = MeasureSettings::new(PITCH_M, 1);
    let law = PowerLaw::ELLIPTICAL_RING;
    if let Ok(motion) = noisy_motion() {
        bencher
            .bench(|| measure(black_box(&motion), &settings, Some(&|_, overlap_m| law.energy_j(overlap_m))));
    }
}

fn noisy_motion() -> Result<ChainMotion, MechanicsError> {
    let mut motion =
        exact_motion(&simulate(&Chain::of_rings(N_BODIES), &Schedule::automatic(0.022, FRAME_S))?.trajectory);
    motion.independent_sigma_m.fill(NOISE_M);
    motion.displacement_m.iter_mut().flatten().for_each(|x| x.sigma = NOISE_M);
    Ok(motion)
}
