//! Damping from peak potential energies.

use std::num::NonZero;

use chainwave_analysis::{MeasureSettings, exact_motion, measure, replicate};
use chainwave_inference::{EnergyFit, EnergyMeasurement, EnergyModel, Known, Quantity, fit_peak_energies};
use chainwave_measurement::{ChainMotion, Estimate};
use chainwave_mechanics::{Chain, Drive, FarEnd, Striker};

use crate::common::{PITCH_M, paper_chain, ring_law, with_sigma};

const N_BODIES: usize = 12;
const N_REPLICAS: usize = 100;
const VELOCITY: Estimate = Estimate { value: 2.73, sigma: 0.01 };

fn fitted(motion: &ChainMotion, known: Vec<Known>) -> EnergyFit {
    let settings = MeasureSettings { n_replicas: N_REPLICAS, ..MeasureSettings::new(PITCH_M, 1) };
    let law = ring_law();
    let measured = measure(motion, &settings, Some(&|_, overlap_m| law.energy_j(overlap_m))).unwrap();
    let times = EnergyMeasurement { times_s: &motion.times_s };
    let striker = Striker { mass_kg: 4.3e-3, velocity_m_per_s: VELOCITY.value, damping_kg_per_s: 0.1 };
    let model = EnergyModel {
        chain: Chain {
            mass_kg: vec![0.455e-3; N_BODIES],
            damping_kg_per_s: vec![0.001; N_BODIES],
            ground_stiffness_n_per_m: Vec::new(),
            ground_law: None,
            contact: law.into(),
            drive: Drive::Striker(striker),
            far_end: FarEnd::Free,
        },
        striker_velocity_m_per_s: VELOCITY,
        drive_deviations: vec![0.0],
        drive_scale_sigma: 0.15,
        known,
        spacing: PITCH_M.into(),
        n_threads: NonZero::<usize>::MIN,
    };
    fit_peak_energies(&measured.energies.unwrap(), &times, &model).unwrap()
}

#[test]
fn quantities_known_within_an_uncertainty_are_fitted_along() {
    let exact = exact_motion(&paper_chain(N_BODIES, 2.73, FarEnd::Free, 0.011).trajectory);
    let noisy = replicate(&with_sigma(exact, 1e-6), 1, 3).next().unwrap();
    let quantities = [
        Quantity::Prefactor,
        Quantity::Offset,
        Quantity::Exponent,
        Quantity::BodyMass,
        Quantity::StrikerMass,
    ];
    let known = quantities.map(|quantity| Known { quantity, relative_sigma: 0.01 }).to_vec();
    let (exact, free) = (fitted(&noisy, Vec::new()), fitted(&noisy, known));
    for (found, truth) in [
        (exact.damping.chain_damping_kg_per_s, 0.003),
        (exact.damping.striker_damping_kg_per_s, 0.2),
        (free.damping.chain_damping_kg_per_s, 0.003),
        (free.damping.striker_damping_kg_per_s, 0.2),
    ] {
        assert!((found.value - truth).abs() < 4.0 * found.sigma, "{found:?}, expected {truth}");
    }
    // What is not known widens what is fitted, and the energies tell none of it worse than it was known.
    let sigma = |fit: &EnergyFit| fit.damping.chain_damping_kg_per_s.sigma;
    assert!(sigma(&free) > 1.5 * sigma(&exact), "{exact:?} {free:?}");
    assert_eq!(free.factors.len(), quantities.len());
    for (quantity, factor) in &free.factors {
        let inflation = free.reduced_chi_squared.max(1.0).sqrt();
        assert!(factor.sigma < 1.001 * inflation * 0.01, "{quantity:?}: {factor:?}");
        assert!((factor.value - 1.0).abs() < 4.0 * factor.sigma, "{quantity:?}: {factor:?}");
    }
}
