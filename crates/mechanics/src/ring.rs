//! The ring model: each body an elliptical ring of geometrically nonlinear planar beams, bonded to its neighbours at the poles.
//!
//! **The element** is co-rotational (M. A. Crisfield, Comput. Meth. Appl. Mech. Engng 81 (1990) 131): each element is held
//! against its chord, however far that has turned. Its bending moment is linear, and it bends, stretches and shears. Three
//! choices make it fast and of fourth order:
//!
//! - Nodal rotations carry no inertia in a thin beam, so they are not unknowns: the moments' equilibrium at the nodes, which is
//!   Clapeyron's theorem of three moments (with shear), gives the moments from the turns between chords by a tridiagonal
//!   system that never changes. What is left are two displacements a node.
//! - The chord of a bent element is shorter than its curve by (a^2 + a b + b^2) / 72 of its length, a and b the turns at its
//!   ends. This averaged membrane strain keeps bending from locking; and its dependence on the turns adds the normal forces' part
//!   to the moments, so that energy and forces agree.
//! - Nodes stand at equal distances along the unstressed curve, so lumped masses are the trapezoidal rule. Its error begins with
//!   the fourth power too, for what would come before vanishes at poles that do not turn.
//!
//! Statics, modes, bands and dynamics all use this one energy ([`Rod`]). A mirror-symmetric chain needs the upper half of
//! its rings only; modes and bands treat the other symmetry by the same half with other conditions at its poles.
//!
//! **The dynamics** are velocity Verlet. The longitudinal waves of the wall limit the step to about an element's length over
//! 1500 m/s, which is far below what accuracy needs; yet a step of an element costs a nanosecond. Measured against it: an implicit
//! scheme that keeps the energy (average vector field, Newton's method, inner nodes condensed to the joints;
//! `tests/ring/implicit.rs`), on a smooth push of 2 mm through 8 rings of 16 elements in 8 ms, both in plain code, and relative to the
//! largest displacement:
//!
//! | scheme | step | steps | factorisations of each ring | error |
//! |---|---|---|---|---|
//! | Verlet | 2.8 us | 2811 | 0 | 9e-6 |
//! | implicit | 10 us | 800 | 2400 | 2e-4 |
//! | implicit | 20 us | 400 | 1530 | 9e-4 |
//! | implicit | 40 us | 200 | 890 | 5e-3 |
//! | implicit | 80 us | 100 | 570 | 1.4e-2 |
//!
//! So it is not faster at any accuracy: at 0.5 %, a factorisation with its tangent would have to cost no more than three explicit
//! steps, and at 9e-6, which Verlet has at its stability bound, less than one. Its operations alone are those of five or more.
//! It stays with the tests.
//!
//! Eight rings go side by side through vectors of any width, with the same bits on each. Threads share the blocks of eight
//! and exchange one force a step, or one goes alone where the machine is busy; the result does not depend on their number. Memory is no
//! bound: eight rings, which stay in the nearest cache, take as long for an element and step as 300 do (32 elements, one core of a Xeon: 2.4 and
//! 2.0 ns with AVX-512, 3.5 and 3.4 with AVX2), so steps taken together over a part of the chain would gain nothing. Some 60 products and
//! sums for an element are what is paid for: 36 of them are products, of which a Zen 5 core starts two vectors a cycle, so that no order of
//! them takes less than 18 cycles for the element of a vector (1.1 ns for an element and step with AVX2 at 4.2 GHz). What is loaded, stored
//! and moved besides makes some 110 instructions with AVX2, of which that core takes six a cycle, another 18. It takes 26 with 64 elements a
//! ring and 32 with 16, and 28 and 36 with AVX-512 for twice the rings: the sweeps are short, so that no chain of operations is longer than
//! its queues, and no sum that goes from element to element waits in memory.
//!
//! **The model ends** where walls of one ring touch: a compression stops before, and a motion at its last output before.

mod accuracy;
mod block;
mod chain;
mod clock;
mod compression;
mod driver;
mod ellipse;
mod harvest;
mod kernel;
mod linear;
mod link;
mod march;
mod record;
mod release;
mod rod;
mod schedule;
mod section;
mod simulate;
mod simulation;
mod span;
mod statics;
mod three_moments;
mod walls;

pub use accuracy::{RefinedSimulation, simulate_rings_within};
pub use chain::{RingChain, RingDrive, RingStriker};
pub use compression::{Compression, compress};
pub use linear::{Boundary, Mode, Symmetry, ring_bands, ring_modes, ring_sound_speed_m_per_s};
pub use rod::{ElasticForces, Rod};
pub use schedule::RingSchedule;
pub use section::{Ring, Section};
pub use simulate::simulate_rings;
pub use simulation::{RingSimulation, SelfContact};
pub use statics::{Equilibrium, Support};
