//! Runs an experiment without writing anything, and prints its group velocity and damping beside what was decided.
//!
//! `cargo run --release -p chainwave-experiment --example run_in_memory -- EXPERIMENT.toml RECORDINGS`

use std::num::NonZero;
use std::path::Path;

use chainwave_experiment::{MemoryStore, Monitor, Setup};

#[expect(clippy::print_stdout, reason = "the results are what the program is for")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [experiment, recordings] = arguments.as_slice() else {
        return Err("expected EXPERIMENT.toml RECORDINGS".into());
    };
    let setup = Setup::read(Path::new(experiment), Some(Path::new(recordings)))?;
    let n_threads = std::thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN);
    let results = setup.run(&MemoryStore::default(), n_threads, &Monitor::SILENT)?;
    match &results.evaluation.measurement.group_velocity {
        Ok(found) => {
            println!("c_g = {:.3} +- {:.3} m/s", found.velocity_m_per_s.value, found.velocity_m_per_s.sigma);
        }
        Err(reason) => println!("no group velocity: {}", reason.as_str()),
    }
    let damping = &results.evaluation.damping;
    match &damping.chain_damping_kg_per_s {
        Ok(c_d) => {
            let source = damping.source.unwrap_or_default();
            println!("c_d = {:.6} +- {:.6} kg/s, from the {source}", c_d.value, c_d.sigma);
        }
        Err(reason) => println!("no c_d: {reason}"),
    }
    for decision in &results.decisions {
        println!("{}: {}", decision.question, decision.choice);
    }
    Ok(())
}
