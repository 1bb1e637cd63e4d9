//! The beam element in large deflections: Mattiasson's cantilever and a rod rolled up to a circle.

use std::f64::consts::PI;

use chainwave_mechanics::{Rod, Support};
use nalgebra::DVector;

use crate::scenes::straight;

/// Cantilever under a dead end load across it: load P L^2 / EI, shortening and deflection over L, rotation (K. Mattiasson, Int.
/// J. Numer. Meth. Engng 17 (1981) 145, table I; found again here by a boundary value solver to these digits).
const MATTIASSON: [[f64; 4]; 5] = [
    [1.0, 0.056_43, 0.301_72, 0.461_35],
    [2.0, 0.160_64, 0.493_46, 0.781_75],
    [4.0, 0.328_94, 0.669_96, 1.121_24],
    [6.0, 0.434_59, 0.744_57, 1.283_70],
    [10.0, 0.555_00, 0.810_61, 1.430_29],
];

/// Clamped at the left, loaded at the right in `n_steps`.
fn bend(rod: &Rod, load: impl Fn(&Rod) -> (usize, f64), n_steps: usize) -> DVector<f64> {
    let clamped = vec![(0, 0.0), (1, 0.0), (rod.rotation(0), 0.0)];
    let (unknown, whole) = load(rod);
    (1..=n_steps).fold(DVector::zeros(rod.n_unknowns()), |from, step| {
        let loads = vec![(unknown, whole * step as f64 / n_steps as f64)];
        rod.equilibrium(&from, &Support { prescribed: clamped.clone(), loads }).unwrap().unknowns
    })
}

fn tip(rod: &Rod, unknowns: &DVector<f64>) -> [f64; 3] {
    let last = 2 * rod.n_elements();
    [unknowns[last], unknowns[last + 1], unknowns[rod.rotation(1)]]
}

fn loaded_tip(n_elements: usize, load: f64) -> [f64; 3] {
    let rod = straight(n_elements);
    tip(&rod, &bend(&rod, |rod| (2 * rod.n_elements() + 1, load), 10))
}

/// The table has five decimals; 64 elements err less.
#[test]
fn the_end_loaded_cantilever_has_mattiassons_deflections() {
    for [load, shortening, deflection, rotation] in MATTIASSON {
        let [x, y, theta] = loaded_tip(64, load);
        assert!((x + shortening).abs() < 1.5e-5, "{load}: {x}");
        assert!((y - deflection).abs() < 1.5e-5, "{load}: {y}");
        assert!((theta - rotation).abs() < 1.5e-5, "{load}: {theta}");
    }
}

#[test]
fn the_cantilevers_error_falls_with_the_fourth_power() {
    let exact = loaded_tip(128, 4.0);
    let error = |n: usize| {
        let found = loaded_tip(n, 4.0);
        (0..2).map(|k| (found[k] - exact[k]).abs()).fold(0.0, f64::max)
    };
    let order = (error(8) / error(16)).log2();
    assert!((order - 4.0).abs() < 0.5, "order {order}");
}

/// An end moment bends the rod to an arc; 2 pi closes the circle. The element's polygon is that of the circle but for the
/// series of its chord, of fourth order.
#[test]
fn an_end_moment_rolls_the_rod_up_to_a_circle() {
    let closing = |n: usize| {
        let rod = straight(n);
        tip(&rod, &bend(&rod, |rod| (rod.rotation(1), 2.0 * PI), 20))
    };
    let [x, y, theta] = closing(40);
    assert!((theta - 2.0 * PI).abs() < 1e-9, "{theta}");
    assert!((x + 1.0).abs() < 1e-5 && y.abs() < 1e-5, "{x} {y}");
}
