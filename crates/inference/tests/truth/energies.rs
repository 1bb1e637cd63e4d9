//! Damping from peak potential energies.

use std::num::NonZero;

use chainwave_analysis::{MeasureSettings, PeakEnergies, exact_motion, measure, replicate};
use chainwave_inference::{EnergyFit, EnergyModel, FitError, Prior, Quantity, fit_peak_energies};
use chainwave_measurement::{ChainMotion, Estimate};
use chainwave_mechanics::{Chain, Drive, FarEnd, PowerLaw, Schedule, Striker, simulate};

use crate::common::{INTERVAL_S, PITCH_M, paper_chain, with_sigma};

const N_BODIES: usize = 12;
const N_REPLICAS: usize = 100;
const VELOCITY: Estimate = Estimate { value: 2.73, sigma: 0.01 };

fn measured(motion: &ChainMotion) -> PeakEnergies {
    let settings = MeasureSettings { n_replicas: N_REPLICAS, ..MeasureSettings::new(PITCH_M, 1) };
    let law = PowerLaw::ELLIPTICAL_RING;
    let measured = measure(motion, &settings, Some(&|_, overlap_m| law.energy_j(overlap_m))).unwrap();
    measured.energies.unwrap()
}

fn model(chain: Chain, striker_velocity_m_per_s: Estimate, priors: Vec<Prior>) -> EnergyModel {
    EnergyModel {
        chain,
        striker_velocity_m_per_s,
        drive_deviations: vec![0.0],
        drive_scale_sigma: 0.15,
        priors,
        spacing: PITCH_M.into(),
        n_threads: NonZero::<usize>::MIN,
    }
}

fn fitted(motion: &ChainMotion, priors: Vec<Prior>) -> EnergyFit {
    let striker = Striker { velocity_m_per_s: VELOCITY.value, damping_kg_per_s: 0.1, ..Striker::OF_RINGS };
    let chain = Chain {
        damping_kg_per_s: vec![0.001; N_BODIES],
        drive: Drive::Striker(striker),
        ..Chain::of_rings(N_BODIES)
    };
    fit_peak_energies(&measured(motion), motion, &model(chain, VELOCITY, priors)).unwrap()
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
    let priors = quantities.map(|quantity| Prior { quantity, relative_sigma: 0.01 }).to_vec();
    let (exact, free) = (fitted(&noisy, Vec::new()), fitted(&noisy, priors));
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

/// A short chain that is struck hard, whose gaps hold more in tension, when the wave comes back from its free end, than when it passed.
fn short(c_d: f64, c_s: f64) -> Chain {
    const N_BODIES: usize = 9;
    let striker =
        Striker { mass_kg: 3e-3, velocity_m_per_s: 1.7, damping_kg_per_s: c_s, ground_damping_kg_per_s: 0.0 };
    Chain {
        mass_kg: vec![0.6e-3; N_BODIES],
        damping_kg_per_s: vec![c_d; N_BODIES],
        ground_stiffness_n_per_m: Vec::new(),
        ground_law: None,
        contact: PowerLaw::ELLIPTICAL_RING.into(),
        drive: Drive::Striker(striker),
        far_end: FarEnd::Free,
    }
}

#[test]
fn a_gap_that_leaves_the_view_before_the_wave_comes_back_is_compared_as_far_as_it_was_seen() {
    const SEEN_UNTIL_S: f64 = 7.48e-3;
    let (c_d, c_s) = (0.004, 0.15);
    let moved = simulate(&short(c_d, c_s), &Schedule::automatic(0.0105, INTERVAL_S)).unwrap().trajectory;
    let whole = replicate(&with_sigma(exact_motion(&moved), 1e-6), 1, 3).next().unwrap();
    let mut motion = whole.clone();
    let lost_from = motion.times_s.partition_point(|time_s| *time_s < SEEN_UNTIL_S);
    motion.displacement_m.slice_mut(ndarray::s![7.., lost_from..]).fill(None);
    let energies = measured(&motion);
    assert!(energies.gaps.contains(&8), "{:?}", energies.missing);
    let model = model(short(0.001, 0.1), Estimate::new(1.7, 0.01), Vec::new());
    let off = |fit: &EnergyFit| {
        let found = [fit.damping.chain_damping_kg_per_s, fit.damping.striker_damping_kg_per_s];
        [(found[0], c_d), (found[1], c_s)].map(|(found, truth)| (found.value - truth).abs() / found.sigma)
    };
    let fit = fit_peak_energies(&energies, &motion, &model).unwrap();
    // Four standard uncertainties: once in 16 000.
    assert!(off(&fit).iter().all(|off| *off < 4.0), "{:?} {fit:?}", off(&fit));
    // As if they had been seen all the time, the same energies bend both by more.
    let bent = fit_peak_energies(&energies, &whole, &model).unwrap();
    assert!(off(&bent).iter().any(|off| *off > 6.0), "{:?} {bent:?}", off(&bent));
}

#[test]
fn a_motion_of_other_bodies_is_refused() {
    let moved = simulate(&short(0.004, 0.15), &Schedule::automatic(0.005, INTERVAL_S)).unwrap().trajectory;
    let motion = with_sigma(exact_motion(&moved), 1e-6);
    let energies = measured(&motion);
    let mut chain = short(0.004, 0.15);
    chain.mass_kg.pop();
    let refused = fit_peak_energies(&energies, &motion, &model(chain, VELOCITY, Vec::new()));
    assert!(matches!(refused, Err(FitError::TooFew { what: "bodies in the model", .. })), "{refused:?}");
}
