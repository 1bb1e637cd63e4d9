//! The rod of co-rotational beam elements: strain energy, forces and tangent stiffness.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use super::{
    ellipse::HalfEllipse,
    section::{Ring, Section},
    three_moments::ThreeMoments,
};
use crate::{check, error::MechanicsError};

/// (a^2 + a b + b^2) times this is what a curve exceeds its chord by, relative to its length, when its curvature goes linearly
/// from a to b over that length (half the mean square of its slope against the chord, to leading order).
pub(crate) const BULGE: f64 = 1.0 / 72.0;

/// A planar rod of equal elements, straight or curved when unstressed.
///
/// Its unknowns are the displacements of its nodes and the rotations of its two ends:
/// x_0, y_0, x_1, y_1, ..., then the first and the last end's rotation. The element is that of the ring model's head.
#[derive(Debug, Clone)]
pub struct Rod {
    section: Section,
    pub(crate) arc_m: f64,
    pub(crate) chords: Vec<Chord>,
    /// Turn of the unstressed curve at each node, over one element's length.
    pub(crate) curvature_turns: Vec<f64>,
    pub(crate) three_moments: ThreeMoments,
}

/// The line between two neighbouring nodes of the unstressed rod.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Chord {
    pub(crate) vector_m: Vector2<f64>,
    pub(crate) length_m: f64,
}

/// A rod's strains in one configuration, and what carries them.
#[derive(Debug, Clone)]
pub(crate) struct Strains {
    /// Axial strain of each element.
    pub(crate) stretch: Vec<f64>,
    /// Change of turn at each node.
    pub(crate) turn: Vec<f64>,
    /// Direction and length of each chord.
    chords: Vec<(Vector2<f64>, f64)>,
}

/// Energy of a rod and its gradient.
#[derive(Debug, Clone)]
pub struct ElasticForces {
    /// Strain energy in joules.
    pub energy_j: f64,
    /// Derivatives by the unknowns: the forces in newtons and end moments in newton metres that hold the rod.
    pub forces: DVector<f64>,
}

/// Normal forces, and moments by node of bending alone and with the bulge's part.
struct Internal {
    normal_n: Vec<f64>,
    bending_nm: Vec<f64>,
    moment_nm: Vec<f64>,
}

impl Rod {
    /// A rod through points at equal distances along its curve, with the directions of the curve at its ends.
    ///
    /// # Errors
    /// [`MechanicsError::NotPhysical`] for fewer than two elements, an arc shorter than its chord, or points that coincide.
    pub fn new(
        section: Section,
        nodes_m: &[[f64; 2]],
        arc_m: f64,
        directions_rad: [f64; 2],
    ) -> Result<Self, MechanicsError> {
        let n = nodes_m.len().saturating_sub(1);
        check::require(n >= 2, "elements of a rod", "at least 2", n as f64)?;
        let chords: Vec<Chord> = nodes_m.windows(2).map(|pair| Chord::between(pair[0], pair[1])).collect();
        for (i, chord) in chords.iter().enumerate() {
            let share = chord.length_m / arc_m;
            check::require(
                share > 0.0 && share < 1.0 + 1e-12,
                format!("chord {i} of a rod over its arc"),
                "above 0, up to 1",
                share,
            )?;
        }
        let end = |rad: f64| Vector2::new(rad.cos(), rad.sin());
        let mut curvature_turns = vec![2.0 * turn(end(directions_rad[0]), chords[0].vector_m)];
        curvature_turns.extend(chords.windows(2).map(|pair| turn(pair[0].vector_m, pair[1].vector_m)));
        curvature_turns.push(2.0 * turn(chords[n - 1].vector_m, end(directions_rad[1])));
        let shear = section.bending_nm2 / (section.shear_n * arc_m * arc_m);
        Ok(Self { section, arc_m, chords, curvature_turns, three_moments: ThreeMoments::new(n, shear) })
    }

    /// The upper half of a ring between its bonds.
    ///
    /// # Errors
    /// [`MechanicsError::NotPhysical`] for a ring without meaning, or an odd number of elements or fewer than four.
    pub fn half_ring(
        ring: &Ring,
        section: Section,
        elements_per_ring: usize,
    ) -> Result<Self, MechanicsError> {
        Ok(Self::and_half_ring(ring, section, elements_per_ring)?.0)
    }

    /// The upper half of a ring, and the curve that it follows.
    pub(crate) fn and_half_ring(
        ring: &Ring,
        section: Section,
        elements_per_ring: usize,
    ) -> Result<(Self, HalfEllipse), MechanicsError> {
        ring.check()?;
        check::require(
            elements_per_ring >= 4 && elements_per_ring.is_multiple_of(2),
            "elements_per_ring",
            "an even number, at least 4",
            elements_per_ring as f64,
        )?;
        let half = HalfEllipse::of(ring, elements_per_ring);
        let rod = Self::new(section, &half.nodes_m, half.arc_m, half.directions_rad)?;
        Ok((rod, half))
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.chords.len()
    }

    /// Number of unknowns.
    pub fn n_unknowns(&self) -> usize {
        2 * self.n_elements() + 4
    }

    /// The unknowns of the unstressed rod.
    pub fn zeros(&self) -> DVector<f64> {
        DVector::zeros(self.n_unknowns())
    }

    /// Index of the rotation of the first (0) or last (1) end among the unknowns.
    pub fn rotation(&self, end: usize) -> usize {
        2 * self.n_elements() + 2 + end
    }

    /// The section's stiffnesses.
    pub fn section(&self) -> Section {
        self.section
    }

    /// The lines from node to node of the unstressed rod, in metres.
    pub fn chords_m(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.chords.iter().map(|chord| chord.vector_m.into())
    }

    /// Mass at each unknown, in kilograms: half an element's on either side of a node, none on rotations.
    pub fn masses_kg(&self) -> DVector<f64> {
        let element_kg = self.section.mass_kg_per_m * self.arc_m;
        let n = self.n_elements();
        DVector::from_fn(self.n_unknowns(), |unknown, _| match unknown / 2 {
            0 => 0.5 * element_kg,
            node if node == n => 0.5 * element_kg,
            node if node > n => 0.0,
            _ => element_kg,
        })
    }

    /// Energy and forces in a configuration.
    pub fn elastic_forces(&self, unknowns: &DVector<f64>) -> ElasticForces {
        let strains = self.strains(unknowns);
        let internal = self.internal(&strains);
        let turns = strains.turn.iter().zip(&internal.bending_nm);
        let bending_j: f64 = turns.map(|(turn, moment)| 0.5 * turn * moment).sum();
        let axial = strains.stretch.iter().zip(&internal.normal_n);
        let axial_j: f64 = axial.map(|(stretch, normal)| 0.5 * self.arc_m * stretch * normal).sum();
        ElasticForces { energy_j: bending_j + axial_j, forces: self.forces(&strains, &internal) }
    }

    /// Second derivatives of the energy by the unknowns.
    pub fn stiffness(&self, unknowns: &DVector<f64>) -> DMatrix<f64> {
        let strains = self.strains(unknowns);
        let internal = self.internal(&strains);
        let turns = self.turn_gradients(&strains);
        let stretches = self.stretch_gradients(&strains, &turns);
        let mut curvature = self.three_moments.inverse() * (self.section.bending_nm2 / self.arc_m);
        for (e, normal) in internal.normal_n.iter().enumerate() {
            let (w_left, w_right) = (self.weight(e), self.weight(e + 1));
            let scale = normal * self.arc_m * BULGE;
            curvature[(e, e)] += 2.0 * scale * w_left * w_left;
            curvature[(e + 1, e + 1)] += 2.0 * scale * w_right * w_right;
            curvature[(e, e + 1)] += scale * w_left * w_right;
            curvature[(e + 1, e)] += scale * w_left * w_right;
        }
        let mut stiffness = turns.transpose() * curvature * &turns;
        stiffness += stretches.transpose() * &stretches * (self.section.axial_n * self.arc_m);
        self.add_geometric_stiffness(&strains, &internal, &mut stiffness);
        stiffness
    }

    /// Bending moment at each node, in newton metres.
    pub fn moments_nm(&self, unknowns: &DVector<f64>) -> Vec<f64> {
        self.internal(&self.strains(unknowns)).bending_nm
    }

    pub(crate) fn strains(&self, unknowns: &DVector<f64>) -> Strains {
        let n = self.n_elements();
        let at = |node: usize| Vector2::new(unknowns[2 * node], unknowns[2 * node + 1]);
        let (mut elongations_m, mut chords, mut rotations) = (Vec::new(), Vec::new(), Vec::new());
        let end = |rad: f64| Vector2::new(rad.cos(), rad.sin());
        rotations.push(end(unknowns[self.rotation(0)]));
        for (e, chord) in self.chords.iter().enumerate() {
            let change_m = at(e + 1) - at(e);
            let vector_m = chord.vector_m + change_m;
            let length_m = vector_m.norm();
            // The difference of two squares, so that a small strain keeps its digits.
            elongations_m.push((vector_m + chord.vector_m).dot(&change_m) / (length_m + chord.length_m));
            let was = chord.vector_m / chord.length_m;
            let is = vector_m / length_m;
            rotations.push(Vector2::new(was.dot(&is), was.perp(&is)));
            chords.push((is, length_m));
        }
        rotations.push(end(unknowns[self.rotation(1)]));
        let turn: Vec<f64> = rotations.windows(2).map(|pair| turn(pair[0], pair[1])).collect();
        let stretch = (0..n).map(|e| elongations_m[e] / self.arc_m + self.bulge(e, &turn)).collect();
        Strains { stretch, turn, chords }
    }

    /// What a node's change of turn counts in the curvature there: at an end, the turn is that over half an element.
    fn weight(&self, node: usize) -> f64 {
        if node == 0 || node == self.n_elements() { 2.0 } else { 1.0 }
    }

    /// Change of what element `e`'s curve exceeds its chord by, relative to its length.
    fn bulge(&self, e: usize, turn: &[f64]) -> f64 {
        let (left, right) = (self.weight(e) * turn[e], self.weight(e + 1) * turn[e + 1]);
        let [a, b] = [self.curvature_turns[e], self.curvature_turns[e + 1]];
        BULGE * (left * (2.0 * a + b + left + right) + right * (2.0 * b + a + right))
    }

    /// Derivatives of [`Rod::bulge`] by the turns at the element's two nodes.
    fn bulge_slopes(&self, e: usize, turn: &[f64]) -> [f64; 2] {
        let (w_left, w_right) = (self.weight(e), self.weight(e + 1));
        let a = self.curvature_turns[e] + w_left * turn[e];
        let b = self.curvature_turns[e + 1] + w_right * turn[e + 1];
        [BULGE * w_left * (2.0 * a + b), BULGE * w_right * (2.0 * b + a)]
    }

    fn internal(&self, strains: &Strains) -> Internal {
        let mut bending_nm = strains.turn.clone();
        self.three_moments.solve(&mut bending_nm);
        for moment in &mut bending_nm {
            *moment *= self.section.bending_nm2 / self.arc_m;
        }
        let mut moment_nm = bending_nm.clone();
        let normal_n: Vec<f64> =
            strains.stretch.iter().map(|stretch| self.section.axial_n * stretch).collect();
        for (e, normal) in normal_n.iter().enumerate() {
            let slopes = self.bulge_slopes(e, &strains.turn);
            moment_nm[e] += normal * self.arc_m * slopes[0];
            moment_nm[e + 1] += normal * self.arc_m * slopes[1];
        }
        Internal { normal_n, bending_nm, moment_nm }
    }

    fn forces(&self, strains: &Strains, internal: &Internal) -> DVector<f64> {
        let mut forces = DVector::zeros(self.n_unknowns());
        for (e, &(along, length_m)) in strains.chords.iter().enumerate() {
            let shear_n = (internal.moment_nm[e] - internal.moment_nm[e + 1]) / length_m;
            let force_n = along * internal.normal_n[e] + across(along) * shear_n;
            for axis in 0..2 {
                forces[2 * e + axis] -= force_n[axis];
                forces[2 * e + 2 + axis] += force_n[axis];
            }
        }
        forces[self.rotation(0)] = -internal.moment_nm[0];
        forces[self.rotation(1)] = internal.moment_nm[self.n_elements()];
        forces
    }

    /// Row i: derivatives of the turn at node i.
    fn turn_gradients(&self, strains: &Strains) -> DMatrix<f64> {
        let n = self.n_elements();
        let mut gradients = DMatrix::zeros(n + 1, self.n_unknowns());
        for (e, &(along, length_m)) in strains.chords.iter().enumerate() {
            let rotation = across(along) / length_m;
            for axis in 0..2 {
                for (node, sign) in [(e, 1.0), (e + 1, -1.0)] {
                    gradients[(node, 2 * e + 2 + axis)] += sign * rotation[axis];
                    gradients[(node, 2 * e + axis)] -= sign * rotation[axis];
                }
            }
        }
        gradients[(0, self.rotation(0))] = -1.0;
        gradients[(n, self.rotation(1))] = 1.0;
        gradients
    }

    /// Row e: derivatives of the axial strain of element e.
    fn stretch_gradients(&self, strains: &Strains, turns: &DMatrix<f64>) -> DMatrix<f64> {
        let mut gradients = DMatrix::zeros(self.n_elements(), self.n_unknowns());
        for (e, &(along, _)) in strains.chords.iter().enumerate() {
            let [left, right] = self.bulge_slopes(e, &strains.turn);
            gradients.set_row(e, &(turns.row(e) * left + turns.row(e + 1) * right));
            for axis in 0..2 {
                gradients[(e, 2 * e + 2 + axis)] += along[axis] / self.arc_m;
                gradients[(e, 2 * e + axis)] -= along[axis] / self.arc_m;
            }
        }
        gradients
    }

    /// The part due to the chords' rotation under the forces that they carry.
    fn add_geometric_stiffness(&self, strains: &Strains, internal: &Internal, stiffness: &mut DMatrix<f64>) {
        for (e, &(along, length_m)) in strains.chords.iter().enumerate() {
            let across = across(along);
            let shear_n = (internal.moment_nm[e] - internal.moment_nm[e + 1]) / length_m;
            let mixed = along * across.transpose();
            let block: Matrix2<f64> = across * across.transpose() * (internal.normal_n[e] / length_m)
                - (mixed + mixed.transpose()) * (shear_n / length_m);
            for (row, column, sign) in [(e, e, 1.0), (e, e + 1, -1.0), (e + 1, e, -1.0), (e + 1, e + 1, 1.0)]
            {
                let mut place = stiffness.fixed_view_mut::<2, 2>(2 * row, 2 * column);
                place += block * sign;
            }
        }
    }
}

impl Chord {
    fn between(from_m: [f64; 2], to_m: [f64; 2]) -> Self {
        let vector_m = Vector2::from(to_m) - Vector2::from(from_m);
        Self { vector_m, length_m: vector_m.norm() }
    }
}

/// The left normal.
fn across(along: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-along.y, along.x)
}

/// Angle from one direction to another, in radians, in (-pi, pi].
fn turn(from: Vector2<f64>, to: Vector2<f64>) -> f64 {
    from.perp(&to).atan2(from.dot(&to))
}
