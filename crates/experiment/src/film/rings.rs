//! Bodies that move and bend as the ring model says.

use chainwave_measurement::Trajectory;
use chainwave_mechanics::{
    Ring, RingChain, RingDrive, RingSchedule, RingSimulation, RingStriker, simulate_rings,
};
use chainwave_synthetic::Shapes;
use chainwave_synthetic::trials::Draw;
use ndarray::{Array2, Array4};

use super::Studio;
use crate::configuration::FilmedRings;
use crate::error::Error;

/// Points of the outline on each element.
const POINTS_PER_ELEMENT: usize = 4;

impl FilmedRings {
    /// Motion of the bodies' centres: each halfway between its ring's poles. Markers sit there, and stay rigid.
    pub(super) fn motion(&self, studio: &Studio, draw: &Draw) -> Result<Trajectory, Error> {
        Ok(ring_centres(self.simulate(studio, draw, false)?.trajectory))
    }

    /// The rings' outlines about these centres.
    pub(super) fn shapes(&self, studio: &Studio, draw: &Draw) -> Result<Shapes, Error> {
        let simulation = self.simulate(studio, draw, true)?;
        let nodes_m = simulation.shapes_m.unwrap_or_default();
        let (n_rings, n_times, n_nodes, _) = nodes_m.dim();
        let n_points = 2 * POINTS_PER_ELEMENT * (n_nodes - 1);
        let mut centreline_m = Array4::zeros((n_rings, n_times, n_points, 2));
        for (ring, k) in (0..n_rings).flat_map(|ring| (0..n_times).map(move |k| (ring, k))) {
            let at = |node: usize, axis: usize| nodes_m[(ring, k, node, axis)];
            let centre_m = 0.5 * (at(0, 0) + at(n_nodes - 1, 0));
            let upper: Vec<[f64; 2]> =
                (0..n_nodes).map(|node| [at(node, 0) - centre_m, at(node, 1)]).collect();
            for (point, place_m) in outline(&upper).into_iter().enumerate() {
                centreline_m[(ring, k, point, 0)] = place_m[0];
                centreline_m[(ring, k, point, 1)] = place_m[1];
            }
        }
        let wall_m = studio.synthetic.specimen.ring.wall_m;
        Ok(Shapes { times_s: simulation.trajectory.times_s, centreline_m, wall_m })
    }

    fn simulate(&self, studio: &Studio, draw: &Draw, shapes: bool) -> Result<RingSimulation, Error> {
        let schedule = RingSchedule {
            duration_s: studio.last_time_s() + 1e-3,
            output_interval_s: studio.synthetic.truth_interval_s(),
            dt_s: None,
            shapes,
            n_threads: 1,
        };
        let simulation = simulate_rings(&self.chain(studio, draw), &schedule)?;
        match simulation.self_contact {
            Some(contact) => Err(Error::Value(format!(
                "[synthetic.rings]: expected rings whose walls stay apart, found ring {} folded up at t = {:.2e} s (a slower \
                 striker, or a shorter film)",
                contact.ring, contact.time_s
            ))),
            None => Ok(simulation),
        }
    }

    fn chain(&self, studio: &Studio, draw: &Draw) -> RingChain {
        let (experiment, synthetic) = (studio.experiment, studio.synthetic);
        let outer = &synthetic.specimen.ring;
        RingChain {
            ring: Ring {
                semi_major_m: outer.semi_major_m - 0.5 * outer.wall_m,
                semi_minor_m: outer.semi_minor_m - 0.5 * outer.wall_m,
                wall_m: outer.wall_m,
                width_m: self.width_m.get(),
                young_pa: self.young_pa.get(),
                poisson: self.poisson,
                density_kg_per_m3: self.density_kg_per_m3.get(),
                bond_width_m: 0.0,
            },
            n_rings: experiment.chain.n_bodies,
            elements_per_ring: self.elements_per_ring,
            damping_kg_per_s: synthetic.damping_kg_per_s.get(),
            drive: RingDrive::Striker(RingStriker {
                mass_kg: experiment.striker.as_ref().map_or(0.0, |striker| striker.mass_kg.get()),
                velocity_m_per_s: draw.striker_velocity_m_per_s,
                contact_stiffness_n_per_m: self.contact_stiffness_n_per_m.get(),
                damping_kg_per_s: synthetic.c_s_kg_per_s(),
            }),
            far_end: experiment.far_end.into(),
        }
    }
}

/// The motion of rings' centres from that of their joints, one more than there are rings: each centre lies halfway between its ring's poles.
pub fn ring_centres(joints: Trajectory) -> Trajectory {
    let centre = |joints: &Array2<f64>| {
        let shape = (joints.nrows().saturating_sub(1), joints.ncols());
        Array2::from_shape_fn(shape, |(n, k)| 0.5 * (joints[(n, k)] + joints[(n + 1, k)]))
    };
    let Trajectory { times_s, displacement_m, velocity_m_per_s } = joints;
    let [displacement_m, velocity_m_per_s] = [centre(&displacement_m), centre(&velocity_m_per_s)];
    Trajectory { times_s, displacement_m, velocity_m_per_s }
}

/// A closed line through the upper half's nodes and their mirror images: cubics whose slope at a node is that from the node before
/// to the one behind (E. Catmull, R. Rom, Computer Aided Geometric Design (1974) 317).
fn outline(upper: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let last = upper.len() - 1;
    let node = |k: usize| {
        let k = k % (2 * last);
        if k <= last { upper[k] } else { [upper[2 * last - k][0], -upper[2 * last - k][1]] }
    };
    let point = |k: usize, share: f64, axis: usize| {
        let [a, b, c, d] = [2 * last - 1, 0, 1, 2].map(|by| node(k + by)[axis]);
        let (slope_b, slope_c) = (0.5 * (c - a), 0.5 * (d - b));
        let (square, cube) = (share * share, share * share * share);
        b + (c - b) * (3.0 * square - 2.0 * cube)
            + slope_b * (share - 2.0 * square + cube)
            + slope_c * (cube - square)
    };
    let places = (0..2 * last).flat_map(|k| (0..POINTS_PER_ELEMENT).map(move |part| (k, part)));
    let share = |part: usize| part as f64 / POINTS_PER_ELEMENT as f64;
    places.map(|(k, part)| [0, 1].map(|axis| point(k, share(part), axis))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outline_of_a_circles_nodes_is_a_circle() {
        let upper: Vec<[f64; 2]> = (0..=16)
            .map(|k| std::f64::consts::PI * f64::from(k) / 16.0)
            .map(|phi| [-phi.cos(), phi.sin()])
            .collect();
        let points = outline(&upper);
        assert_eq!(points.len(), 128);
        for [x, y] in points {
            // The slopes err by h^2 / 6, a quarter of which, times h, the line errs by between nodes.
            assert!((x.hypot(y) - 1.0).abs() < 1e-4, "{x} {y}");
        }
    }
}
