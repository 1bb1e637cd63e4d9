//! Strikes the experiment's chain of 26 bodies and prints each gap's peak potential energy, with and without dampers.

use chainwave_mechanics::{Chain, Drive, MechanicsError, Schedule, Simulation, Striker, simulate};

/// Bodies of 0.455 g, 30 mm apart, on the contact law of a hollow elliptical cylinder.
fn struck(damping_kg_per_s: f64, striker_damping_kg_per_s: f64) -> Result<Simulation, MechanicsError> {
    let striker = Striker { damping_kg_per_s: striker_damping_kg_per_s, ..Striker::OF_RINGS };
    let chain = Chain {
        damping_kg_per_s: vec![damping_kg_per_s; 26],
        drive: Drive::Striker(striker),
        ..Chain::of_rings(26)
    };
    simulate(&chain, &Schedule::automatic(0.02, 1e-4))
}

#[expect(clippy::print_stdout, reason = "an example shows what it found")]
fn main() -> Result<(), MechanicsError> {
    let (damped, undamped) = (struck(0.003, 0.2)?, struck(0.0, 0.0)?);
    println!("{}", damped.choice);
    println!("gap   damped (mJ)   undamped (mJ)");
    for (gap, (damped_j, undamped_j)) in damped.psi_max_j.iter().zip(&undamped.psi_max_j).enumerate() {
        println!("{:3}   {:11.4}   {:13.4}", gap + 1, 1e3 * damped_j, 1e3 * undamped_j);
    }
    for (name, simulation) in [("damped", &damped), ("undamped", &undamped)] {
        println!("{name}: group velocity {:?} m/s", simulation.group_velocity_m_per_s(0.030));
    }
    Ok(())
}
