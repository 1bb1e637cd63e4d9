//! Time of the chain model at the automatic step: the experiment (as a fit runs it) and the long study.

use chainwave_mechanics::{
    Chain, Drive, FarEnd, MechanicsError, PowerLaw, Schedule, Simulation, Striker, simulate,
};

fn main() {
    divan::main();
}

fn damped_run(n_bodies: usize, duration_s: f64) -> Result<Simulation, MechanicsError> {
    let chain = Chain {
        mass_kg: vec![0.455e-3; n_bodies],
        damping_kg_per_s: vec![0.003; n_bodies],
        contact: PowerLaw::new(60.1, 2.27e-3, 0.114)?.into(),
        drive: Drive::Striker(Striker { mass_kg: 4.3e-3, velocity_m_per_s: 2.73, damping_kg_per_s: 0.2 }),
        far_end: FarEnd::Free,
    };
    simulate(&chain, &Schedule::automatic(duration_s, 2e-5))
}

#[divan::bench]
fn experiment_of_26_bodies_for_20_ms() -> Result<Simulation, MechanicsError> {
    damped_run(26, 0.02)
}

#[divan::bench(sample_count = 10)]
fn study_of_300_bodies_for_150_ms() -> Result<Simulation, MechanicsError> {
    damped_run(300, 0.15)
}
