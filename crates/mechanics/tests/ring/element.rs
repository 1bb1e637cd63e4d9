//! The beam element: gradients, rigid motion, patch tests.

use chainwave_mechanics::{Ring, Rod, Section, Support};
use nalgebra::DVector;

use crate::scenes::straight;

fn half_ring() -> Rod {
    Rod::half_ring(&Ring::PAPER, Ring::PAPER.section(), 16).unwrap()
}

/// A smooth deformation of some millimetres and tenths of a radian.
fn bent(rod: &Rod) -> DVector<f64> {
    let mut unknowns = DVector::from_fn(rod.n_unknowns(), |k, _| 1e-3 * (0.7 * k as f64).sin());
    unknowns[rod.rotation(0)] = 0.1;
    unknowns[rod.rotation(1)] = -0.2;
    unknowns
}

#[test]
fn forces_are_the_energys_slopes_and_stiffnesses_theirs() {
    let rod = half_ring();
    let at = bent(&rod);
    let (elastic, stiffness) = (rod.elastic_forces(&at), rod.stiffness(&at));
    let largest = elastic.forces.amax();
    for k in 0..rod.n_unknowns() {
        let step = 1e-7;
        let moved = |by: f64| {
            let mut unknowns = at.clone();
            unknowns[k] += by;
            rod.elastic_forces(&unknowns)
        };
        let (up, down) = (moved(step), moved(-step));
        // Central differences: rounding of the energy over the step, and the third derivative.
        let slope = (up.energy_j - down.energy_j) / (2.0 * step);
        assert!((slope - elastic.forces[k]).abs() < 1e-6 * largest, "{k}: {slope} {}", elastic.forces[k]);
        let column = (up.forces - down.forces) / (2.0 * step);
        let error = (column - stiffness.column(k)).amax();
        assert!(error < 1e-6 * stiffness.column(k).amax().max(largest), "{k}: {error}");
    }
}

#[test]
fn a_ring_that_moves_as_a_whole_is_not_strained() {
    let rod = half_ring();
    let half = Ring::PAPER;
    let nodes: Vec<[f64; 2]> = nodes_m(&rod, &half);
    for angle in [1e-3_f64, 0.7, 3.0, -2.5] {
        let (sin, cos) = angle.sin_cos();
        let mut unknowns = DVector::zeros(rod.n_unknowns());
        for (i, [x, y]) in nodes.iter().enumerate() {
            unknowns[2 * i] = 0.3 + cos * x - sin * y - x;
            unknowns[2 * i + 1] = -0.2 + sin * x + cos * y - y;
        }
        unknowns[rod.rotation(0)] = angle;
        unknowns[rod.rotation(1)] = angle;
        let elastic = rod.elastic_forces(&unknowns);
        // Displacements of 0.3 m round to 5e-17 m, over an element of 5 mm, times the axial stiffness of 14 kN.
        assert!(elastic.forces.amax() < 2e-9, "{angle}: {}", elastic.forces.amax());
    }
}

/// Places of the nodes: a free ring's first node stands at the left pole.
fn nodes_m(rod: &Rod, ring: &Ring) -> Vec<[f64; 2]> {
    let mut place = [-ring.semi_major_m, 0.0];
    let mut nodes = vec![place];
    for chord in rod.chords_m() {
        place = [place[0] + chord[0], place[1] + chord[1]];
        nodes.push(place);
    }
    nodes
}

/// A straight rod under end forces and an end moment carries the same normal force and moment in every element.
#[test]
fn patches_of_constant_strain_are_exact() {
    let section = Section { bending_nm2: 2.0, axial_n: 300.0, shear_n: 50.0, mass_kg_per_m: 1.0 };
    let nodes_m: Vec<[f64; 2]> = (0..=7).map(|i| [0.2 * f64::from(i), 0.0]).collect();
    let rod = Rod::new(section, &nodes_m, 0.2, [0.0; 2]).unwrap();
    let clamped = vec![(0, 0.0), (1, 0.0), (rod.rotation(0), 0.0)];
    let solve = |unknown: usize, load: f64| {
        let support = Support { prescribed: clamped.clone(), loads: vec![(unknown, load)] };
        rod.equilibrium(&DVector::zeros(rod.n_unknowns()), &support).unwrap().unknowns
    };
    let pulled = solve(14, 30.0);
    for i in 0..=7 {
        assert!((pulled[2 * i] - 0.1 * 0.2 * i as f64).abs() < 1e-13, "{i}: {}", pulled[2 * i]);
    }
    let rolled = solve(rod.rotation(1), 0.5);
    assert!((rolled[rod.rotation(1)] - 0.5 * 1.4 / 2.0).abs() < 1e-12);
    for moment_nm in rod.moments_nm(&rolled) {
        assert!((moment_nm - 0.5).abs() < 1e-6, "{moment_nm}");
    }
}

/// A straight cantilever under a small end load: P L^3 / 3 EI + P L / S, exact at the nodes for any number of elements.
#[test]
fn a_straight_beam_is_exact_at_its_nodes() {
    for n in [2, 3, 8] {
        let section = Section { bending_nm2: 2.0, axial_n: 1e6, shear_n: 50.0, mass_kg_per_m: 1.0 };
        let nodes_m: Vec<[f64; 2]> = (0..=n).map(|i| [f64::from(i) / f64::from(n), 0.0]).collect();
        let rod = Rod::new(section, &nodes_m, 1.0 / f64::from(n), [0.0; 2]).unwrap();
        let prescribed = vec![(0, 0.0), (1, 0.0), (rod.rotation(0), 0.0)];
        let (tip, load) = (2 * rod.n_elements() + 1, 1e-6);
        let support = Support { prescribed, loads: vec![(tip, load)] };
        let found = rod.equilibrium(&DVector::zeros(rod.n_unknowns()), &support).unwrap().unknowns[tip];
        assert!((found / load - (1.0 / 6.0 + 1.0 / 50.0)).abs() < 1e-9, "{n}: {}", found / load);
    }
    assert_eq!(straight(5).n_unknowns(), 14);
}
