//! Chains of the experiment's rings, and rods that closed forms are known for.

use chainwave_mechanics::{FarEnd, Ring, RingChain, RingDrive, RingSchedule, RingStriker, Rod, Section};

/// A thin circular ring of radius 10 mm.
pub(crate) fn circle() -> Ring {
    Ring { semi_major_m: 10e-3, semi_minor_m: 10e-3, wall_m: 0.05e-3, ..Ring::PAPER }
}

/// The same section that hardly stretches and does not shear: stretching is left with 1e-4 of its true part.
pub(crate) fn inextensible(section: Section) -> Section {
    Section { axial_n: 1e4 * section.axial_n, shear_n: f64::INFINITY, ..section }
}

/// A straight rod of length 1 along x with unit bending stiffness, stiff in the other ways.
pub(crate) fn straight(n_elements: usize) -> Rod {
    let section = Section { bending_nm2: 1.0, axial_n: 1e8, shear_n: f64::INFINITY, mass_kg_per_m: 1.0 };
    let nodes_m: Vec<[f64; 2]> = (0..=n_elements).map(|i| [i as f64 / n_elements as f64, 0.0]).collect();
    Rod::new(section, &nodes_m, 1.0 / n_elements as f64, [0.0; 2]).unwrap()
}

pub(crate) fn striker(velocity_m_per_s: f64) -> RingDrive {
    RingDrive::Striker(RingStriker {
        mass_kg: 4.3e-3,
        velocity_m_per_s,
        contact_stiffness_n_per_m: 1e5,
        damping_kg_per_s: 0.0,
    })
}

pub(crate) fn chain(n_rings: usize, elements_per_ring: usize, velocity_m_per_s: f64) -> RingChain {
    RingChain {
        ring: Ring::PAPER,
        n_rings,
        elements_per_ring,
        damping_kg_per_s: 0.0,
        drive: striker(velocity_m_per_s),
        far_end: FarEnd::Free,
    }
}

pub(crate) fn schedule(duration_s: f64) -> RingSchedule {
    RingSchedule { duration_s, output_interval_s: 1e-4, dt_s: None, shapes: false, n_threads: 1 }
}
