//! Time of the chain model beside the obvious program: a plain loop with `powf`, every body in every step.

use std::hint::black_box;
use std::num::NonZero;

use chainwave_mechanics::{
    Bodies, Chain, Change, Drive, FarEnd, Integration, MechanicsError, Method, PowerLaw, Schedule,
    Sensitivities, Simulation, Striker, scan, simulate, simulate_with_sensitivities,
};

fn main() {
    divan::main();
}

#[path = "../tests/chain/paper.rs"]
mod paper;
use paper::{MASS_KG, STRIKER_KG};

const C_D: f64 = 0.003;
const C_S: f64 = 0.2;
const V_M_PER_S: f64 = 2.73;
/// Steps of the runs that compare a step's cost.
const DT_S: f64 = 4e-5;

fn chain(n_bodies: usize) -> Chain {
    Chain {
        mass_kg: vec![MASS_KG; n_bodies],
        damping_kg_per_s: vec![C_D; n_bodies],
        ground_stiffness_n_per_m: Vec::new(),
        ground_law: None,
        contact: PowerLaw::ELLIPTICAL_RING.into(),
        drive: Drive::Striker(Striker {
            mass_kg: STRIKER_KG,
            velocity_m_per_s: V_M_PER_S,
            damping_kg_per_s: C_S,
            ground_damping_kg_per_s: 0.0,
        }),
        far_end: FarEnd::Free,
    }
}

/// 300 bodies for 150 ms, which the wave takes down the chain, in steps of 0.04 ms: all of them or those reached.
fn steps(method: Method, bodies: Bodies) -> Result<Simulation, MechanicsError> {
    let schedule = Schedule::with_steps(0.15, 0.15, method, DT_S);
    simulate(&chain(300), &Schedule { bodies, ..schedule })
}

#[divan::bench(args = [Bodies::All, Bodies::Reached])]
fn rk4_3750_steps_of_300_bodies(bodies: Bodies) -> Result<Simulation, MechanicsError> {
    steps(Method::Rk4, bodies)
}

#[divan::bench(args = [Bodies::All, Bodies::Reached])]
fn verlet_3750_steps_of_300_bodies(bodies: Bodies) -> Result<Simulation, MechanicsError> {
    steps(Method::Verlet, bodies)
}

#[divan::bench]
fn rk4_3750_steps_of_300_bodies_by_a_plain_loop() -> f64 {
    plain_rk4(black_box(301), black_box(3750))
}

#[divan::bench(args = [1e-4, 1e-6, 1e-8])]
fn study_of_300_bodies_for_150_ms_to(accuracy: f64) -> Result<Simulation, MechanicsError> {
    let integration = Integration::Automatic { accuracy };
    simulate(&chain(300), &Schedule { integration, ..Schedule::automatic(0.15, 1e-3) })
}

#[divan::bench]
fn scan_of_200_striker_velocities_on_one_thread() -> Result<usize, MechanicsError> {
    let velocities: Vec<f64> = (1..=200).map(|i| 0.02 * f64::from(i)).collect();
    Ok(scan(&chain(26), &velocities, &Schedule::automatic(0.02, 0.02), NonZero::<usize>::MIN)?.len())
}

/// The same motion as straight from the textbook; returns a displacement so that nothing is left out.
fn plain_rk4(n: usize, n_steps: usize) -> f64 {
    let (mut x, mut v) = (vec![0.0; n], vec![0.0; n]);
    v[0] = V_M_PER_S;
    let (mut x_stage, mut v_stage, mut acceleration) = (x.clone(), v.clone(), vec![0.0; n]);
    let (mut x_next, mut v_next) = (x.clone(), v.clone());
    for _ in 0..n_steps {
        for (weight, reach) in [(1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (1.0, 0.0)] {
            plain_rates(&x_stage, &v_stage, &mut acceleration);
            for i in 0..n {
                x_next[i] += weight * DT_S / 6.0 * v_stage[i];
                v_next[i] += weight * DT_S / 6.0 * acceleration[i];
                x_stage[i] = x[i] + reach * DT_S * v_stage[i];
                v_stage[i] = v[i] + reach * DT_S * acceleration[i];
            }
        }
        x.copy_from_slice(&x_next);
        v.copy_from_slice(&v_next);
        x_stage.copy_from_slice(&x);
        v_stage.copy_from_slice(&v);
    }
    x[1]
}

fn plain_rates(x: &[f64], v: &[f64], acceleration: &mut [f64]) {
    let PowerLaw { a, delta_0_m, p } = black_box(PowerLaw::ELLIPTICAL_RING);
    let f_0 = a * delta_0_m.powf(p);
    let mut before = 0.0;
    for i in 0..x.len() {
        let mut behind = 0.0;
        if i + 1 < x.len() {
            let shifted = x[i] - x[i + 1] + delta_0_m;
            behind = a * shifted.max(0.1 * delta_0_m).powf(p) - f_0;
            behind += if i == 0 { C_S * (v[0] - v[1]) } else { 0.0 };
        }
        let (mass, drag) = if i == 0 { (STRIKER_KG, 0.0) } else { (MASS_KG, C_D * v[i]) };
        acceleration[i] = (before - behind - drag) / mass;
        before = behind;
    }
}

/// 26 bodies for 20 ms, and how their motion follows eight changes (c_d and seven more bodies' dampers).
#[divan::bench]
fn eight_sensitivities_of_26_bodies() -> Result<Sensitivities, MechanicsError> {
    let chain = chain(26);
    simulate_with_sensitivities(&chain, &SCHEDULE_OF_A_FIT, &changes(&chain))
}

/// The same by central differences of simulations.
#[divan::bench]
fn eight_central_differences_of_26_bodies() -> Result<Vec<Simulation>, MechanicsError> {
    let sides = changes(&chain(26)).into_iter().flat_map(|change| [change.below, change.above]);
    sides.map(|side| simulate(&side, &SCHEDULE_OF_A_FIT)).collect()
}

const SCHEDULE_OF_A_FIT: Schedule = Schedule {
    duration_s: 0.02,
    output_interval_s: 1e-5,
    integration: Integration::Automatic { accuracy: 1e-6 },
    bodies: Bodies::Reached,
};

fn changes(chain: &Chain) -> Vec<Change> {
    let damper = |body: usize, c_kg_per_s: f64| {
        let mut chain = chain.clone();
        chain.damping_kg_per_s[body] = c_kg_per_s;
        chain
    };
    let change = |body: usize| Change { below: damper(body, 0.0), above: damper(body, C_D), width: C_D };
    (0..8).map(change).collect()
}
