//! A chain that a second striker meets behind its far end, with another velocity than is stated of it.

use chainwave_inference::{Hypothesis, TrackModel};
use chainwave_mechanics::{Chain, FarEnd, FarStriker, Striker};

use crate::struck::{C_D, C_S, NOISE_M, chain, filmed_of, fitted, model};

/// Stated of the far striker; what its contact is damped by is known.
const FAR_M_PER_S: f64 = 1.9;
/// By how much it was slower.
const SLOWER: f64 = 0.01;

fn struck_behind(chain: Chain, velocity_m_per_s: f64) -> Chain {
    let striker = Striker { velocity_m_per_s, damping_kg_per_s: C_S, ..Striker::OF_RINGS };
    Chain { far_end: FarEnd::Struck(FarStriker { striker, distance_m: 0.0, contact: None }), ..chain }
}

/// By similarity a scale, with a law that bends otherwise, explains nearly as much: strikers then came out hundreds of sigma off.
#[test]
fn a_far_striker_that_is_slower_than_stated_is_named_and_leaves_the_rest_right() {
    let made = filmed_of(11, NOISE_M, |_, striker_m_per_s| {
        struck_behind(chain(C_D, C_S, striker_m_per_s), (1.0 - SLOWER) * FAR_M_PER_S)
    });
    let as_stated = model(Vec::new());
    let fit = fitted(
        &made,
        &TrackModel { chain: struck_behind(as_stated.chain.clone(), FAR_M_PER_S), ..as_stated },
    );
    assert!(fit.beyond.contains(&Hypothesis::FarStrikerVelocity), "{:?}, {:?}", fit.beyond, fit.rivals);
    // Four standard uncertainties: once in 16 000.
    for (found, truth) in
        [(fit.damping.chain_damping_kg_per_s, C_D), (fit.damping.striker_damping_kg_per_s, C_S)]
    {
        assert!((found.value - truth).abs() < 4.0 * found.sigma, "{found:?}, {truth}");
    }
    for (recording, truth) in fit.recordings.iter().zip(&made.strikers) {
        let found = recording.striker_velocity_m_per_s;
        assert!((found.value - truth).abs() < 4.0 * found.sigma, "{found:?}, {truth}");
    }
}
