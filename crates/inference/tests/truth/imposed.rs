//! Damping behind a body whose measured motion drives the chain.

use std::num::NonZero;

use chainwave_analysis::{exact_motion, replicate};
use chainwave_inference::{FitError, ImposedModel, Prior, Quantity, fit_imposed};
use chainwave_measurement::ChainMotion;
use chainwave_mechanics::FarEnd;

use crate::common::{paper_chain, with_late_view, with_sigma};

const N_BODIES: usize = 12;
const C_D: f64 = 0.003;

fn model(priors: Vec<Prior>) -> ImposedModel {
    let chain = chainwave_mechanics::Chain {
        damping_kg_per_s: vec![0.001; N_BODIES],
        drive: chainwave_mechanics::Drive::Free { displacement_m: Vec::new(), velocity_m_per_s: Vec::new() },
        ..chainwave_mechanics::Chain::of_rings(N_BODIES)
    };
    ImposedModel { chain, priors, drive_deviations: vec![0.0], n_threads: NonZero::<usize>::MIN }
}

/// The paper's chain with noise, and a view that is seen late.
fn motion() -> ChainMotion {
    let exact = exact_motion(&paper_chain(N_BODIES, 2.73, FarEnd::Free, 0.009).trajectory);
    with_late_view(with_sigma(exact, 0.3e-6), 5..12, 0.3e-6)
}

#[test]
fn the_interval_holds_the_damping_as_often_as_it_says() {
    const N: usize = 40;
    let mut squares = 0.0;
    for noisy in replicate(&motion(), N, 77) {
        let fit = fit_imposed(&noisy, &model(Vec::new())).unwrap();
        let c_d = fit.chain_damping_kg_per_s;
        squares += ((c_d.value - C_D) / c_d.sigma).powi(2) / N as f64;
        assert!(c_d.sigma < 0.01 * C_D, "{c_d:?}");
        // The late view is one error of thousands of samples, so chi squared scatters with its square.
        assert!(fit.reduced_chi_squared < 3.0, "{}", fit.reduced_chi_squared);
        assert!(fit.n_simulations < 120, "{}", fit.n_simulations);
    }
    // The rms of 40 errors scatters by 11 %, and the stated sigma by 10 %.
    assert!((squares.sqrt() - 1.0).abs() < 0.35, "errors' rms is {} of what is stated", squares.sqrt());
}

#[test]
fn a_mass_known_within_an_uncertainty_is_fitted_along() {
    let noisy = replicate(&motion(), 1, 5).next().unwrap();
    let priors = Prior { quantity: Quantity::BodyMass, relative_sigma: 0.013 };
    let free = fit_imposed(&noisy, &model(vec![priors])).unwrap();
    let c_d = free.chain_damping_kg_per_s;
    assert!((c_d.value - C_D).abs() < 4.0 * c_d.sigma && c_d.sigma < 0.05 * C_D, "{c_d:?}");
    let (_, factor) = free.factors[0];
    assert!((factor.value - 1.0).abs() < 4.0 * factor.sigma && factor.sigma < 0.013, "{factor:?}");
}

#[test]
fn the_fit_is_the_same_on_any_number_of_threads() {
    let noisy = replicate(&motion(), 1, 5).next().unwrap();
    let on = |n_threads: usize| {
        let n_threads = NonZero::new(n_threads).unwrap();
        fit_imposed(&noisy, &ImposedModel { n_threads, ..model(Vec::new()) }).unwrap()
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn a_hole_in_the_driving_motion_is_named() {
    let mut holed = motion();
    holed.displacement_m[(0, 50)] = None;
    let refused = fit_imposed(&holed, &model(Vec::new()));
    assert!(matches!(refused, Err(FitError::TooFew { what: "samples of body 1 without a hole", .. })));
}
