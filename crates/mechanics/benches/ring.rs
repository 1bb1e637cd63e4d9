//! Time of the ring model: the long study at several meshes, and the vectors' element loop beside a plain one over one ring
//! after the other. Items are elements times steps.

use chainwave_mechanics::{
    FarEnd, MechanicsError, Ring, RingChain, RingDrive, RingSchedule, RingSimulation, RingStriker, Rod,
    simulate_rings,
};
use divan::counter::ItemsCount;

fn main() {
    divan::main();
}

const RING: Ring = Ring {
    semi_major_m: 14.8e-3,
    semi_minor_m: 8.8e-3,
    wall_m: 0.4e-3,
    width_m: 12e-3,
    young_pa: 2.888e9,
    poisson: 0.35,
    density_kg_per_m3: 1237.0,
    bond_width_m: 0.0,
};

fn run(
    n_rings: usize,
    elements_per_ring: usize,
    duration_s: f64,
    n_threads: usize,
) -> Result<RingSimulation, MechanicsError> {
    let chain = RingChain {
        ring: RING,
        n_rings,
        elements_per_ring,
        damping_kg_per_s: 0.0,
        drive: RingDrive::Striker(RingStriker {
            mass_kg: 4.3e-3,
            velocity_m_per_s: 2.73,
            contact_stiffness_n_per_m: 1e5,
            damping_kg_per_s: 0.0,
        }),
        far_end: FarEnd::Free,
    };
    let schedule = RingSchedule { duration_s, output_interval_s: 5e-4, dt_s: None, shapes: false, n_threads };
    simulate_rings(&chain, &schedule)
}

#[divan::bench(args = [16, 24, 32], sample_count = 3)]
fn study_of_300_rings_for_148_ms_on_one_thread(elements: usize) -> Result<RingSimulation, MechanicsError> {
    run(300, elements, 0.148, 1)
}

#[divan::bench(args = [16, 24, 32], sample_count = 3)]
fn study_of_300_rings_for_148_ms_on_two_threads(elements: usize) -> Result<RingSimulation, MechanicsError> {
    run(300, elements, 0.148, 2)
}

#[divan::bench(args = [16, 32, 64], sample_count = 30)]
fn vectors(bencher: divan::Bencher, elements: usize) {
    let n_items = run(64, elements, 4e-3, 1).map_or(0, |simulation| simulation.element_steps);
    bencher.counter(ItemsCount::new(n_items)).bench(|| run(64, elements, 4e-3, 1));
}

/// What each run of `vectors` spends before its first step.
#[divan::bench(args = [16, 32, 64], sample_count = 30)]
fn preparation(elements: usize) -> Result<RingSimulation, MechanicsError> {
    run(64, elements, 1e-9, 1)
}

/// The same elements' forces and a Verlet step, ring after ring, by the rod's own functions.
#[divan::bench(args = [16, 32, 64], sample_count = 30)]
fn plain_loop(bencher: divan::Bencher, elements: usize) {
    const STEPS: usize = 100;
    let rod = Rod::half_ring(&RING, RING.section(), elements);
    let Ok(rod) = rod else { return };
    let masses_kg = rod.masses_kg();
    let last = 2 * rod.n_elements();
    bencher.counter(ItemsCount::new(STEPS * rod.n_elements())).bench(|| {
        let mut places = rod.zeros();
        let mut velocities = rod.zeros();
        velocities[0] = 1.0;
        for _ in 0..STEPS {
            let forces = rod.response(&places).forces;
            for k in 2..last {
                velocities[k] -= forces[k] / masses_kg[k] * 1e-7;
                places[k] += velocities[k] * 1e-7;
            }
        }
        places
    });
}
