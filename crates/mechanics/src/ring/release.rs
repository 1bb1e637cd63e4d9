//! A chain of rings let go from a given state: each ring in the equilibrium of its overlap.

use nalgebra::DVector;

use super::{
    block::{BlockStepper, RINGS, RingBlock},
    compression::advance,
    driver::Units,
    rod::Rod,
};
use crate::error::MechanicsError;

/// Overlap over half a ring's length below which the ring answers linearly: the quadratic part is then smaller still by
/// some 1e-8, and rounding would keep Newton's method from finding it.
const LINEAR: f64 = 1e-9;

/// The state in which a chain of rings is let go.
#[derive(Debug)]
pub(crate) struct Release<'a> {
    displacement_m: &'a [f64],
    velocity_m_per_s: &'a [f64],
    rings: Vec<ReleasedRing>,
}

/// A ring in the equilibrium of its overlap: displacements against its right joint, their rates, and the force that its upper
/// half pushes its joints apart with.
#[derive(Debug)]
struct ReleasedRing {
    displacement_m: DVector<f64>,
    velocity_m_per_s: DVector<f64>,
    push_n: f64,
}

impl<'a> Release<'a> {
    pub(crate) fn new(
        rod: &Rod,
        displacement_m: &'a [f64],
        velocity_m_per_s: &'a [f64],
    ) -> Result<Self, MechanicsError> {
        let joints = displacement_m.windows(2).zip(velocity_m_per_s.windows(2));
        let rings = joints.map(|(x_m, v)| ReleasedRing::new(rod, x_m[0] - x_m[1], v[0] - v[1]));
        Ok(Self { displacement_m, velocity_m_per_s, rings: rings.collect::<Result<_, _>>()? })
    }

    /// Puts blocks at rest into this state, their velocities half a step before it.
    pub(crate) fn set(&self, machine: &BlockStepper, blocks: &mut [RingBlock], units: Units) {
        let velocity_unit = units.length_m / units.dt_s;
        // v(0) is the mean of the velocities half a step before and after, keep v + f. Inner nodes are in equilibrium: no f.
        let before =
            |v_m_per_s: f64, kick: f64| (2.0 * v_m_per_s / velocity_unit - kick) / (1.0 + units.keep);
        let force_unit_n = units.element_kg * units.length_m / (units.dt_s * units.dt_s * units.gain);
        let push = |ring: Option<usize>| {
            ring.and_then(|ring| self.rings.get(ring)).map_or(0.0, |ring| ring.push_n / force_unit_n)
        };
        for (b, block) in blocks.iter_mut().enumerate() {
            let first = b * RINGS;
            for (j, joint) in (first..self.displacement_m.len().min(first + RINGS + 1)).enumerate() {
                let kick = (push(joint.checked_sub(1)) - push(Some(joint))) * block.joints.inverse_masses[j];
                block.joints.places[j] = self.displacement_m[joint] / units.length_m;
                block.joints.velocities[j] = before(self.velocity_m_per_s[joint], kick);
            }
            for (ring, released) in self.rings.iter().skip(first).take(RINGS).enumerate() {
                let x_m = self.displacement_m[first + ring + 1];
                let v_m_per_s = self.velocity_m_per_s[first + ring + 1];
                for node in 0..machine.n_inner() {
                    let [x, y] = [0, 1].map(|axis| 2 * node + 2 + axis);
                    let values = [
                        (x_m + released.displacement_m[x]) / units.length_m,
                        released.displacement_m[y] / units.length_m,
                        before(v_m_per_s + released.velocity_m_per_s[x], 0.0),
                        before(released.velocity_m_per_s[y], 0.0),
                    ];
                    machine.set_inner(block, ring, node, values);
                }
            }
        }
    }
}

impl ReleasedRing {
    fn new(rod: &Rod, overlap_m: f64, closing_m_per_s: f64) -> Result<Self, MechanicsError> {
        let mut displacement_m = rod.zeros();
        let half_m = rod.arc_m * rod.n_elements() as f64;
        let push_n = if overlap_m.abs() > LINEAR * half_m {
            0.5 * advance(rod, &mut displacement_m, overlap_m)?
        } else {
            displacement_m = closing(rod, &displacement_m, overlap_m)?;
            (rod.stiffness(&rod.zeros()) * &displacement_m)[0]
        };
        let velocity_m_per_s = closing(rod, &displacement_m, closing_m_per_s)?;
        Ok(Self { displacement_m, velocity_m_per_s, push_n })
    }
}

/// Rates of a ring's equilibrium while its left pole moves at the given rate against its right one.
fn closing(rod: &Rod, at: &DVector<f64>, rate: f64) -> Result<DVector<f64>, MechanicsError> {
    if rate == 0.0 {
        return Ok(rod.zeros());
    }
    let last = 2 * rod.n_elements();
    let held = [1, last, last + 1, rod.rotation(0), rod.rotation(1)].map(|unknown| (unknown, 0.0));
    let rates: Vec<(usize, f64)> = held.into_iter().chain([(0, rate)]).collect();
    rod.following(at, &rates)
}
