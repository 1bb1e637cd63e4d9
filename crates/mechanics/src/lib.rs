//! Forward models of the chain: what the bodies do when the first one is struck, moved or let go.
//!
//! The crate knows the mechanics and nothing of measurements: parameters in, motion out. Three layers keep it open for
//! more laws, integrators and models:
//!
//! - contact laws ([`Law`]) give force, energy and stiffness of one gap, each in a form that keeps its digits for any
//!   overlap. What a chain's gaps hold is sorted by law once, and forces are computed for vectors of gaps, with the same bits
//!   on every [`InstructionSet`](chainwave_vectors::InstructionSet); a power law that all gaps share becomes a table, which costs a third of the formula;
//! - the model turns positions and velocities into accelerations, and knows masses, dampers, the drive and the far end;
//! - integrators ([`Method`]) know rates and forces only. Where a striker's one-sided contact opens or closes, the step is
//!   cut at that instant, so that each step sees smooth forces and every order holds. Between them and the model stands the
//!   march: it chooses steps, leaves out bodies that the wave has not reached, books energies and peaks, and records outputs.
//!
//! ```
//! use chainwave_mechanics::{Chain, Drive, PowerLaw, Schedule, Striker, simulate};
//!
//! // The paper's chain, struck more slowly and by a law of one's own.
//! let chain = Chain {
//!     contact: PowerLaw::new(60.1, 2.27e-3, 0.114)?.into(),
//!     drive: Drive::Striker(Striker { velocity_m_per_s: 1.89, ..Striker::OF_RINGS }),
//!     ..Chain::of_rings(26)
//! };
//! let c_m_per_s = simulate(&chain, &Schedule::automatic(0.02, 1e-4))?.group_velocity_m_per_s(0.030);
//! println!("the leading pulse runs at {c_m_per_s:?} m/s");
//! # let sound_m_per_s = chain.linear().map(|linear| linear.sound_speed_m_per_s(0.030));
//! # assert!(c_m_per_s.is_some() && c_m_per_s < sound_m_per_s, "a softening law slows the wave down");
//! # Ok::<(), chainwave_mechanics::MechanicsError>(())
//! ```
//!
//! Without a method asked for, a run takes the one that its scene calls for, to the accuracy asked for, and says why
//! ([`Simulation::choice`]) and how far off it may be ([`Simulation::error_estimate`]).
//! Many chains ([`scan`], [`ensemble`]) share the cores, each with the bits that it has alone. How a motion follows its parameters is
//! integrated along with it ([`simulate_with_sensitivities`]), so that a fit needs no differences of simulations.
//!
//! Energy is booked along the way: kinetic and potential energy plus what the dampers took stays constant, and
//! [`Simulation::energy_drift`] says how well. Nothing is allocated in a step, and the same input gives the same bits.
//!
//! Processor time beside a plain loop of the classical Runge-Kutta method with the library's power (`benches/chain.rs`, 300 bodies, the
//! fastest of many samples of the same minutes on two cores of an AMD EPYC (Zen 4) at 3.7 GHz, where the loop took 65 ns a body and step):
//!
//! | method | all bodies, AVX2 | AVX-512 | those that the wave has reached, AVX2 | AVX-512 |
//! |---|---|---|---|---|
//! | classical Runge-Kutta | 0.12 | 0.11 | 0.08 | 0.07 |
//! | velocity Verlet | 0.05 | 0.04 | 0.03 | 0.03 |
//!
//! Its loops have some 32 instructions a body and step with AVX2, counted: nine for the force by its table and five more where vectors want
//! look-ups, four for the keys that name them, seven for the two kicks, three for the drift, and eight for the ledger's extremes. At six a
//! cycle that would be 1.4 ns at 3.7 GHz; it takes about twice that. Besides the loops stands what a step does once: peaks, contacts that
//! switch, the front.
//!
//! A second model ([`RingChain`]) resolves each body as an elliptical ring of beams. What small motions of a chain see is told in
//! closed form ([`LinearChain`]), and of any that repeats a cell as bands ([`UnitCell`]).
//!
//! Files import each other by their full paths, and neither they nor their folders in circles. From below: vectors (`lanes`), contact laws
//! (`contact`), the chain's parameters and equations of motion (`equations`), integrators (`integrator`), the march over them (`chain`) and
//! the rings (`ring`).

mod chain;
mod check;
mod contact;
mod equations;
mod error;
mod integrator;
mod lanes;
mod ring;

pub use chain::{
    Bodies, Change, Integration, Kept, LinearChain, ReferenceMotion, Replay, Resistance, Schedule,
    Sensitivities, Simulation, Stretch, StrikerMotion, UnitCell, Variations, ensemble, scan, simulate,
    simulate_with_resistance, simulate_with_sensitivities,
};
pub use contact::{Contact, Contacts, Law, LinearLaw, PowerLaw, TableLaw, Tension};
pub use equations::{Chain, Drive, FarEnd, FarStriker, ImposedMotion, Striker};
pub use error::MechanicsError;
pub use integrator::Method;
pub use ring::{
    Boundary, Compression, ElasticForces, Equilibrium, Mode, RefinedSimulation, Ring, RingChain, RingDrive,
    RingSchedule, RingSimulation, RingStriker, Rod, Section, SelfContact, Support, Symmetry, compress,
    ring_bands, ring_modes, ring_sound_speed_m_per_s, simulate_rings, simulate_rings_within,
};
