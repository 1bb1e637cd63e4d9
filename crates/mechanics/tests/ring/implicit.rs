//! An implicit scheme that keeps the energy, to hold the explicit one against: is it faster at equal accuracy?

use chainwave_mechanics::{ImposedMotion, MechanicsError, RingChain, Rod};
use nalgebra::{DMatrix, DVector};

/// Gauss's points and weights on [0, 1]: the mean force over a step is then exact to the fifth power of the displacement.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];
/// Newton steps, relative to the displacements, that count as none.
const CONVERGED: f64 = 1e-10;

/// A chain of half rings whose first joint moves as given, by the average vector field (G. R. W. Quispel, D. I. McLaren,
/// J. Phys. A 41 (2008) 045206): over a step, the velocity is the mean of its ends, the force the mean along the straight line
/// between them, so that energy is kept whatever the step. Newton's method; the inner nodes of each ring are condensed to its
/// joints, which leaves a tridiagonal system.
pub(crate) struct Implicit {
    rod: Rod,
    masses_kg: DVector<f64>,
    /// By ring: displacements of the half ring's nodes; and their velocities.
    rings_m: Vec<DVector<f64>>,
    velocities: Vec<DVector<f64>>,
    /// Tangents of rings that were factorised.
    pub(crate) factorisations: usize,
}

/// A ring's tangent and residual, condensed to its joints, and how its inner nodes follow those.
struct Condensed {
    joints: [[f64; 2]; 2],
    right: [f64; 2],
    inner: DMatrix<f64>,
}

impl Implicit {
    pub(crate) fn new(chain: &RingChain) -> Result<Self, MechanicsError> {
        let rod = Rod::half_ring(&chain.ring, chain.ring.section(), chain.elements_per_ring)?;
        let rest = vec![rod.zeros(); chain.n_rings];
        let masses_kg = rod.masses_kg();
        Ok(Self { rod, masses_kg, velocities: rest.clone(), rings_m: rest, factorisations: 0 })
    }

    /// Displacement of the joints.
    pub(crate) fn joints_m(&self) -> Vec<f64> {
        let last = self.last();
        self.rings_m.iter().map(|ring| ring[0]).chain(self.rings_m.last().map(|ring| ring[last])).collect()
    }

    /// Energy of all half rings, in joules.
    pub(crate) fn energy_j(&self) -> f64 {
        let kinetic = |v: &DVector<f64>| 0.5 * v.component_mul(v).dot(&self.masses_kg);
        let rings = self.rings_m.iter().zip(&self.velocities);
        rings.map(|(x, v)| self.rod.elastic_forces(x).energy_j + kinetic(v)).sum()
    }

    /// Takes steps to the end of a time, the first joint moving as given.
    pub(crate) fn run(&mut self, first: &ImposedMotion, duration_s: f64, n_steps: usize) {
        let dt_s = duration_s / n_steps as f64;
        for step in 1..=n_steps {
            self.step(dt_s, first.displacement_m(step as f64 * dt_s));
        }
    }

    /// Takes a step at whose end the first joint is to be at `first_m`.
    pub(crate) fn step(&mut self, dt_s: f64, first_m: f64) {
        let start = self.rings_m.clone();
        for (ring, velocity) in self.rings_m.iter_mut().zip(&self.velocities) {
            *ring += velocity * dt_s;
        }
        let mut missing_m = first_m - self.rings_m[0][0];
        for _ in 0..20 {
            let condensed: Vec<Condensed> =
                (0..start.len()).map(|r| self.condense(&start[r], r, dt_s)).collect();
            self.factorisations += condensed.len();
            let joints = solve(&condensed, missing_m);
            let largest = self.follow(&condensed, &joints);
            missing_m = 0.0;
            let extent = self.rings_m.iter().map(DVector::amax).fold(0.0, f64::max);
            if largest <= CONVERGED * extent {
                break;
            }
        }
        for ((ring, before), velocity) in self.rings_m.iter().zip(&start).zip(&mut self.velocities) {
            *velocity = (ring - before) * (2.0 / dt_s) - &*velocity;
        }
    }

    fn last(&self) -> usize {
        2 * self.rod.n_elements()
    }

    /// Linearises 2 m (x - x_0 - v_0 dt) / dt^2 + mean force = 0 about a ring's present place.
    fn condense(&self, start: &DVector<f64>, r: usize, dt_s: f64) -> Condensed {
        let (now, last) = (&self.rings_m[r], self.last());
        let change = now - start;
        let inertia =
            (&change - &self.velocities[r] * dt_s).component_mul(&self.masses_kg) * (2.0 / (dt_s * dt_s));
        let at = |share: f64| start + &change * share;
        let residual = GAUSS
            .iter()
            .fold(inertia, |sum, &(share, weight)| sum + self.rod.elastic_forces(&at(share)).forces * weight);
        let mut tangent = self.rod.stiffness(&at(0.5)) * 0.5;
        for k in 0..=last + 1 {
            tangent[(k, k)] += 2.0 * self.masses_kg[k] / (dt_s * dt_s);
        }
        let n = last - 2;
        let inside = tangent.view((2, 2), (n, n)).into_owned().lu();
        let ends = [0, last];
        // Columns: how the inner nodes answer the residual, and each joint.
        let sides = DMatrix::from_fn(n, 3, |i, k| match k {
            0 => -residual[i + 2],
            k => -tangent[(i + 2, ends[k - 1])],
        });
        let inner = inside.solve(&sides).unwrap_or(sides);
        let along =
            |end: usize, k: usize| (0..n).map(|i| tangent[(ends[end], i + 2)] * inner[(i, k)]).sum::<f64>();
        Condensed {
            joints: [0, 1].map(|i| [0, 1].map(|j| tangent[(ends[i], ends[j])] + along(i, j + 1))),
            right: [0, 1].map(|i| -residual[ends[i]] - along(i, 0)),
            inner,
        }
    }

    /// Moves joints and inner nodes by a Newton step; returns its largest component.
    fn follow(&mut self, condensed: &[Condensed], joints: &[f64]) -> f64 {
        let last = self.last();
        let mut largest = 0.0_f64;
        for (r, (ring, condensed)) in self.rings_m.iter_mut().zip(condensed).enumerate() {
            let by = DVector::from_vec(vec![1.0, joints[r], joints[r + 1]]);
            let inner = &condensed.inner * by;
            for (k, value) in inner.iter().enumerate() {
                ring[k + 2] += value;
            }
            ring[0] += joints[r];
            ring[last] += joints[r + 1];
            largest = largest.max(inner.amax()).max(joints[r].abs()).max(joints[r + 1].abs());
        }
        largest
    }
}

/// The joints' Newton step, the first one given: a tridiagonal system.
fn solve(rings: &[Condensed], first: f64) -> Vec<f64> {
    let n = rings.len();
    let mut diagonal = vec![0.0; n + 1];
    let mut right = vec![0.0; n + 1];
    for (r, ring) in rings.iter().enumerate() {
        for end in 0..2 {
            diagonal[r + end] += ring.joints[end][end];
            right[r + end] += ring.right[end];
        }
    }
    right[1] -= rings[0].joints[1][0] * first;
    for r in 1..n {
        let factor = rings[r].joints[1][0] / diagonal[r];
        diagonal[r + 1] -= factor * rings[r].joints[0][1];
        right[r + 1] -= factor * right[r];
    }
    let mut joints = vec![first; n + 1];
    joints[n] = right[n] / diagonal[n];
    for r in (1..n).rev() {
        joints[r] = (right[r] - rings[r].joints[0][1] * joints[r + 1]) / diagonal[r];
    }
    joints
}
