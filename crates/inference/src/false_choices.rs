//! Synthetic experiments that the simpler models describe, and the p-values that the tests give them: what the rules' measured rates are
//! counted from.

use std::num::NonZero;
use std::ops::Range;

use chainwave_measurement::{BodyTrack, Estimate, Observation, map_in_parallel};
use chainwave_mechanics::{Chain, Contacts, Drive, FarEnd, LinearLaw, PowerLaw, Schedule, Striker, simulate};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::error::FitError;
use crate::tracks::{NullTest, TrackModel};

const N_BODIES: usize = 8;
const N_TRIALS: u32 = 3;
const INTERVAL_S: f64 = 4e-5;
const NOISE_M: f64 = 0.4e-6;
/// So slow a strike that the law hardly bends: 0.3 mm of 2.27 mm.
const VELOCITY: Estimate = Estimate { value: 0.08, sigma: 0.002 };
const BODY_KG: f64 = 0.455e-3;
const C_S_KG_PER_S: f64 = 0.2;

/// What is true of a chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NullChain {
    /// Whether contacts soften (the ring's law) or are springs of the same stiffness.
    pub softens: bool,
    /// c_d.
    pub chain_damping_kg_per_s: f64,
    /// Relative standard deviation of the bodies' masses.
    pub mass_scatter: f64,
}

/// Probabilities, under the simpler models, of what the tests find in one experiment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PValues {
    /// Of the contact law's softening.
    pub softening: f64,
    /// Of the scatter of bodies.
    pub scatter: f64,
    /// Of c_d.
    pub chain_damping: f64,
    /// Of structure in what the model leaves over.
    pub structure: f64,
    /// Of the best of all single hypotheses.
    pub hypothesis: f64,
}

/// Fits an experiment for each seed, three trials that see all eight bodies, from one starting point, and tests what it asks for.
///
/// # Errors
/// [`FitError`] as the fit says.
pub fn p_values(
    truth: &NullChain,
    seeds: Range<u64>,
    n_threads: NonZero<usize>,
) -> Result<Vec<PValues>, FitError> {
    let law = PowerLaw::ELLIPTICAL_RING;
    let model = TrackModel {
        chain: chain(law.into(), 0.001, VELOCITY.value),
        striker_velocity_m_per_s: VELOCITY,
        priors: Vec::new(),
        reading_errors: Vec::new(),
        usual_errors: Vec::new(),
        n_threads: NonZero::<usize>::MIN,
    };
    let contact = if truth.softens { law.into() } else { LinearLaw { k_n_per_m: law.k_0_n_per_m() }.into() };
    let n = seeds.end.saturating_sub(seeds.start) as usize;
    let found = map_in_parallel(n, n_threads, |index| {
        let observations = filmed(truth, &contact, seeds.start + index as u64)?;
        let found = NullTest::of(&observations, &model)?;
        Ok(PValues {
            softening: found.softening.p_value,
            scatter: found.scatter.p_value,
            chain_damping: found.damping.told_from_zero()[0],
            structure: found.structure.p_value,
            hypothesis: found.hypothesis_p_value,
        })
    });
    found.into_iter().collect()
}

fn chain(contact: Contacts, c_d: f64, velocity_m_per_s: f64) -> Chain {
    Chain {
        mass_kg: vec![BODY_KG; N_BODIES],
        damping_kg_per_s: vec![c_d; N_BODIES],
        ground_stiffness_n_per_m: Vec::new(),
        ground_law: None,
        contact,
        drive: Drive::Striker(Striker {
            velocity_m_per_s,
            damping_kg_per_s: C_S_KG_PER_S,
            ..Striker::OF_RINGS
        }),
        far_end: FarEnd::Free,
    }
}

fn filmed(truth: &NullChain, contact: &Contacts, seed: u64) -> Result<Vec<Observation>, FitError> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut normal = |sigma: f64| -> f64 {
        let deviate: f64 = StandardNormal.sample(&mut random);
        sigma * deviate
    };
    let mass_kg: Vec<f64> = (0..N_BODIES).map(|_| BODY_KG * (1.0 + normal(truth.mass_scatter))).collect();
    let mut observations = Vec::new();
    for trial in 0..N_TRIALS {
        let velocity_m_per_s = VELOCITY.value + normal(VELOCITY.sigma);
        let struck = Chain {
            mass_kg: mass_kg.clone(),
            ..chain(contact.clone(), truth.chain_damping_kg_per_s, velocity_m_per_s)
        };
        let moved = simulate(&struck, &Schedule::automatic(0.0075, 1e-5))?.trajectory;
        let impact_s = normal(1e-5);
        let times_s: Vec<f64> = (-20..180).map(|k| (f64::from(k) + 0.3) * INTERVAL_S).collect();
        let mut track = |body: usize| {
            let at =
                |t_s: f64| moved.at(t_s - impact_s).map_or(0.0, |moment| moment.displacement_m(body - 1));
            let position = |t_s: &f64| Some(Estimate::new(at(*t_s) + normal(NOISE_M), NOISE_M));
            BodyTrack { body, position_m: times_s.iter().map(position).collect() }
        };
        let bodies = (1..=N_BODIES).map(&mut track).collect();
        observations.push(Observation {
            recording: format!("trial{trial}"),
            view: 0,
            trial,
            times_s,
            bodies,
        });
    }
    Ok(observations)
}
