//! The element loop of the ring: units and constants of its three sweeps.

mod deform;
mod load;
mod push;
mod reach;

use pulp::Simd;

pub(crate) use reach::{BEYOND, LARGE, MODERATE, SMALL};

use super::rod::{BULGE, Chord, Rod};
use crate::lanes::Lanes;

/// Values kept of each element between the sweeps: two that each of them replaces, the relative elongation of its chord, the inverse of
/// that chord's length, and the chord.
pub(crate) const KEPT: usize = 6;
/// Values of a node: its displacement and its velocity.
pub(crate) const NODE: usize = 4;

/// One value for each of several rings.
pub(crate) type Rings<S> = Lanes<S, 1>;

/// A half ring's element loop, for vectors of rings.
///
/// Masses are in units of one element's, times of the step; so a velocity is what it moves in a step, and a force what it
/// adds to that. Forces are those that remain after the dampers' share in the step.
///
/// Turns are counted in `turn_unit` of a radian's, h B, and lengths in units of B h / courant^2, with an element's arc h, the
/// [`BULGE`] B, and the Courant number, which is what a wave of the wall runs in a step, over h. Then a normal force is
/// `elongation * axial` plus the bulge, and a moment the bending's plus the normal force times the bulge's slope, with no
/// factor on either.
#[derive(Debug, Clone)]
pub(crate) struct RingKernel {
    elements: Vec<Element>,
    /// [`Element::bending_pivot`] of the last node.
    last_bending_pivot: f64,
    turn_unit: f64,
    /// Metres in a unit of length.
    length_m: f64,
    /// What the dampers leave of a velocity in a step.
    keep: f64,
    /// What they leave of a force.
    gain: f64,
    /// Their rate times the step.
    decay: f64,
}

/// One element of the unstressed half ring.
#[derive(Debug, Clone, Copy)]
struct Element {
    /// Chord.
    chord: [f64; 2],
    /// Chord over its squared length.
    inverse: [f64; 2],
    inverse_length: f64,
    /// Normal force of the chord's relative elongation.
    axial: f64,
    /// Twice the unstressed turn at either node plus the turn at the other.
    turns: [f64; 2],
    /// The factor of [`super::three_moments::ThreeMoments`] at the left node, and its inverse pivot times the bending
    /// stiffness.
    lower: f64,
    bending_pivot: f64,
}

/// Forces and energies of a vector of rings.
#[derive(Clone, Copy)]
pub(crate) struct RingForces<S: Simd> {
    /// Force along the chain on the left and right joint.
    pub(crate) ends: [Rings<S>; 2],
    pub(crate) strain_energy: Rings<S>,
    pub(crate) moved: NodeSums<S>,
}

/// Sums over inner nodes that moved, where they are asked for; a node's mass is 1.
#[derive(Clone, Copy)]
pub(crate) struct NodeSums<S: Simd> {
    /// Half the product of the velocities before and after.
    pub(crate) kinetic_energy: Rings<S>,
    /// Mean of the momentum along the chain before and after.
    pub(crate) momentum: Rings<S>,
    /// Half the square of the mean of the velocities before and after.
    pub(crate) mean_squares: Rings<S>,
}

impl RingKernel {
    /// The loop for a half ring, a time step in seconds and the rate, in 1/s, at which dampers to ground take momentum.
    pub(crate) fn new(rod: &Rod, dt_s: f64, decay_per_s: f64) -> Self {
        let (section, arc_m) = (rod.section(), rod.arc_m);
        let halved = 0.5 * decay_per_s * dt_s;
        let gain = (1.0 + halved).recip();
        // Metres that a newton moves an element's mass in a step.
        let give = gain * dt_s * dt_s / (section.mass_kg_per_m * arc_m);
        let length_m = BULGE * arc_m * arc_m / (section.axial_n * give);
        let arc = arc_m / length_m;
        let turn_unit = arc * BULGE;
        let bending = section.bending_nm2 * give / (length_m * length_m * length_m) / (arc * turn_unit);
        let element = |(e, chord): (usize, &Chord)| {
            let (vector, length) = (chord.vector_m / length_m, chord.length_m / length_m);
            let [a, b] = [rod.curvature_turns[e], rod.curvature_turns[e + 1]].map(|turn| turn * turn_unit);
            Element {
                chord: vector.into(),
                inverse: (vector / (length * length)).into(),
                inverse_length: length.recip(),
                axial: turn_unit * turn_unit / BULGE * length / arc,
                turns: [2.0 * a + b, 2.0 * b + a],
                lower: rod.three_moments.lower[e],
                bending_pivot: rod.three_moments.inverse_pivots[e] * bending,
            }
        };
        let last_pivot = rod.three_moments.inverse_pivots[rod.n_elements()];
        Self {
            elements: rod.chords.iter().enumerate().map(element).collect(),
            last_bending_pivot: last_pivot * bending,
            turn_unit,
            length_m,
            keep: (1.0 - halved) * gain,
            gain,
            decay: decay_per_s * dt_s,
        }
    }

    /// Metres in a unit of length.
    pub(crate) fn length_m(&self) -> f64 {
        self.length_m
    }

    /// The dampers' rate times the step.
    pub(crate) fn decay(&self) -> f64 {
        self.decay
    }

    /// What the dampers leave of a velocity in a step.
    pub(crate) fn keep(&self) -> f64 {
        self.keep
    }

    /// What the dampers leave of a force in a step.
    pub(crate) fn gain(&self) -> f64 {
        self.gain
    }

    /// Values that a ring needs between the two sweeps: [`KEPT`] for each element, and for the last node.
    pub(crate) fn scratch_len(&self) -> usize {
        KEPT * (self.elements.len() + 1)
    }
}

/// The same numbers in every lane.
///
/// Here and in the sweeps no closure stands between the vectors: what is not put in line is compiled without their instructions.
#[inline(always)]
fn splat<S: Simd, const N: usize>(simd: S, numbers: [f64; N]) -> [Rings<S>; N] {
    let mut lanes = [Lanes::splat(simd, 0.0); N];
    for (lanes, number) in lanes.iter_mut().zip(numbers) {
        *lanes = Lanes::splat(simd, number);
    }
    lanes
}

/// Vectors as they lie in memory.
#[inline(always)]
fn load<S: Simd, const N: usize>(simd: S, vectors: &[S::f64s; N]) -> [Rings<S>; N] {
    let mut lanes = [Lanes::splat(simd, 0.0); N];
    for (lanes, vector) in lanes.iter_mut().zip(vectors) {
        *lanes = Lanes::new(simd, [*vector]);
    }
    lanes
}

/// Writes vectors to memory.
#[inline(always)]
fn store<S: Simd, const N: usize>(lanes: [Rings<S>; N], vectors: &mut [S::f64s; N]) {
    for (vector, lanes) in vectors.iter_mut().zip(lanes) {
        *vector = lanes.vector();
    }
}
