//! draft
mod block;
mod chain;
mod compression;
mod driver;
mod ellipse;
mod kernel;
mod lanes;
mod linear;
mod link;
mod record;
mod rod;
mod section;
mod simulate;
mod span;
mod statics;
mod three_moments;

pub use chain::{RingChain, RingDrive, RingStriker};
pub use compression::{Compression, compress};
pub use linear::{Boundary, Mode, Symmetry, ring_bands, ring_modes};
pub use rod::{Response, Rod};
pub use section::{Ring, Section};
pub use simulate::{RingSchedule, RingSimulation, simulate_rings};
pub use statics::{Equilibrium, Support};
