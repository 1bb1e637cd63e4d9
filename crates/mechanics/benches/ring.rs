//! Time of the ring model: the long study at several meshes, and the vectors' element loop beside a plain one over one ring
//! after the other. Items are elements times steps.

#[path = "../tests/ring/implicit.rs"]
mod implicit;

use chainwave_mechanics::{
    FarEnd, ImposedMotion, MechanicsError, Ring, RingChain, RingDrive, RingSchedule, RingSimulation,
    RingStriker, Rod, simulate_rings,
};
use divan::counter::ItemsCount;

fn main() {
    divan::main();
}

fn run(
    n_rings: usize,
    elements_per_ring: usize,
    duration_s: f64,
    n_threads: usize,
) -> Result<RingSimulation, MechanicsError> {
    let chain = RingChain {
        ring: Ring::PAPER,
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
    let rod = Rod::half_ring(&Ring::PAPER, Ring::PAPER.section(), elements);
    let Ok(rod) = rod else { return };
    let masses_kg = rod.masses_kg();
    let last = 2 * rod.n_elements();
    bencher.counter(ItemsCount::new(STEPS * rod.n_elements())).bench(|| {
        let mut places = rod.zeros();
        let mut velocities = rod.zeros();
        velocities[0] = 1.0;
        for _ in 0..STEPS {
            let forces = rod.elastic_forces(&places).forces;
            for k in 2..last {
                velocities[k] -= forces[k] / masses_kg[k] * 1e-7;
                places[k] += velocities[k] * 1e-7;
            }
        }
        places
    });
}

/// A push of 2 mm through eight rings of 16 elements in 8 ms, by the implicit scheme in steps of 40 us, for an error of 0.5 %;
/// with its energy and the tangents that it took.
#[divan::bench(sample_count = 10)]
fn implicit_push() -> Result<(Vec<f64>, f64, usize), MechanicsError> {
    let push = push()?;
    let mut scheme = implicit::Implicit::new(&pushed(RingDrive::Imposed(push.clone())))?;
    scheme.run(&push, 8e-3, 200);
    Ok((scheme.joints_m(), scheme.energy_j(), scheme.factorisations))
}

/// The same by velocity Verlet, for an error of 1e-5.
#[divan::bench(sample_count = 100)]
fn explicit_push() -> Result<RingSimulation, MechanicsError> {
    let schedule =
        RingSchedule { duration_s: 8e-3, output_interval_s: 8e-3, dt_s: None, shapes: false, n_threads: 1 };
    simulate_rings(&pushed(RingDrive::Imposed(push()?)), &schedule)
}

fn push() -> Result<ImposedMotion, MechanicsError> {
    let place_m = |t: f64| 1e-3 * (1.0 + ((t - 2e-3) / 0.3e-3).tanh());
    let times_s: Vec<f64> = (0..=4000).map(|i| 2e-6 * f64::from(i)).collect();
    let x_m = times_s.iter().map(|&t| place_m(t) - place_m(0.0)).collect();
    ImposedMotion::from_samples(times_s, x_m)
}

fn pushed(drive: RingDrive) -> RingChain {
    RingChain {
        ring: Ring::PAPER,
        n_rings: 8,
        elements_per_ring: 16,
        damping_kg_per_s: 0.0,
        drive,
        far_end: FarEnd::Free,
    }
}
