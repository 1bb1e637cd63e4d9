//! The dynamics in slow, obvious code: velocity Verlet over the rod's own forces, one ring after the other.

use chainwave_mechanics::{RingChain, RingDrive, Rod};
use nalgebra::DVector;

/// Displacements of the joints at the end of `n_steps` of a striker's impact on a chain without dampers, with a free end.
pub(crate) fn joints_m(chain: &RingChain, dt_s: f64, n_steps: usize) -> Vec<f64> {
    let RingDrive::Striker(striker) = &chain.drive else { panic!("expected a striker") };
    let rod = Rod::half_ring(&chain.ring, chain.ring.section(), chain.elements_per_ring).unwrap();
    let (n, last) = (chain.n_rings, 2 * rod.n_elements());
    let masses_kg = rod.masses_kg();
    let mut rings = vec![DVector::<f64>::zeros(rod.n_unknowns()); n];
    let mut velocities = rings.clone();
    let (mut striker_m, mut striker_v) = (0.0, striker.velocity_m_per_s);
    for _ in 0..n_steps {
        let forces: Vec<DVector<f64>> = rings.iter().map(|ring| -rod.elastic_forces(ring).forces).collect();
        // Half of the striker strikes the upper half of the chain.
        let push_n = (0.5 * striker.contact_stiffness_n_per_m * (striker_m - rings[0][0])).max(0.0);
        striker_v -= push_n / (0.5 * striker.mass_kg) * dt_s;
        striker_m += striker_v * dt_s;
        let mut joint_v = Vec::new();
        for joint in 0..=n {
            let (mut force_n, mut mass_kg) = (if joint == 0 { push_n } else { 0.0 }, 0.0);
            let mut velocity = 0.0;
            if joint < n {
                force_n += forces[joint][0];
                mass_kg += masses_kg[0];
                velocity = velocities[joint][0];
            }
            if joint > 0 {
                force_n += forces[joint - 1][last];
                mass_kg += masses_kg[last];
                velocity = velocities[joint - 1][last];
            }
            joint_v.push(velocity + force_n / mass_kg * dt_s);
        }
        for (r, ring) in rings.iter_mut().enumerate() {
            let velocity = &mut velocities[r];
            for k in 2..last {
                velocity[k] += forces[r][k] / masses_kg[k] * dt_s;
            }
            (velocity[0], velocity[last]) = (joint_v[r], joint_v[r + 1]);
            *ring += &*velocity * dt_s;
        }
    }
    let last_joint = rings[n - 1][last];
    rings.iter().map(|ring| ring[0]).chain([last_joint]).collect()
}
