//! Natural modes and Bloch bands of rings against closed forms.

use std::f64::consts::PI;

use chainwave_mechanics::{
    Boundary, LinearChain, Ring, Symmetry, compress, ring_bands, ring_modes, ring_sound_speed_m_per_s,
};

use crate::scenes::circle;

/// omega_n^2 = n^2 (n^2 - 1)^2 / (n^2 + 1) EI / (m' R^4): inextensible bending of a thin circular ring (Love, art. 293).
fn circle_hz(n: f64) -> f64 {
    let (ring, section) = (circle(), circle().section());
    let square = n * n * (n * n - 1.0).powi(2) / (n * n + 1.0) * section.bending_nm2;
    (square / (section.mass_kg_per_m * ring.semi_major_m.powi(4))).sqrt() / (2.0 * PI)
}

fn free_hz(ring: &Ring, elements_per_ring: usize, symmetry: Symmetry) -> Vec<f64> {
    let modes = ring_modes(ring, elements_per_ring, 3).unwrap();
    let of = modes.iter().filter(|mode| mode.boundary == Boundary::Free && mode.symmetry == symmetry);
    of.map(|mode| mode.frequency_hz).collect()
}

/// The wall of 1/200 of the radius leaves (wall / radius)^2 for stretching and shear.
#[test]
fn a_free_circle_has_its_bending_modes_twice() {
    for symmetry in [Symmetry::Symmetric, Symmetry::Antisymmetric] {
        let found = free_hz(&circle(), 96, symmetry);
        for (frequency_hz, n) in found.iter().zip([2.0, 3.0, 4.0]) {
            let error = frequency_hz / circle_hz(n) - 1.0;
            assert!(error.abs() < 1e-4, "{symmetry:?} {n}: {error}");
        }
    }
}

#[test]
fn frequencies_converge_with_the_fourth_power() {
    for symmetry in [Symmetry::Symmetric, Symmetry::Antisymmetric] {
        let error = |elements: usize| {
            (free_hz(&circle(), elements, symmetry)[0] / free_hz(&circle(), 128, symmetry)[0] - 1.0).abs()
        };
        let order = (error(16) / error(32)).log2();
        assert!((order - 4.0).abs() < 0.5, "{symmetry:?}: order {order}");
    }
}

/// Long waves run at a sqrt(k_0 / m), as in the chain model, with the static stiffness of the same mesh.
#[test]
fn long_waves_have_the_chains_speed() {
    let ring = Ring::PAPER;
    let overlap_m = 1e-9;
    let curve = compress(&ring, ring.section(), 32, overlap_m, 1).unwrap();
    let stiffness_n_per_m = curve.force_n[1] / overlap_m;
    let mass_kg = ring.section().mass_kg_per_m * perimeter_m(&ring);
    let kappa_a = 0.01;
    let bands = ring_bands(&ring, 32, Symmetry::Symmetric, &[kappa_a]).unwrap();
    // 2 sqrt(k / m) sin(kappa / 2); the ring's own inertia enters with kappa^2.
    let linear = LinearChain { stiffness_n_per_m, mass_kg, ground_n_per_m: 0.0 };
    let expected = linear.frequency_hz(kappa_a);
    let pitch_m = 2.0 * ring.semi_major_m;
    let sound_m_per_s = ring_sound_speed_m_per_s(&ring, 32, pitch_m).unwrap();
    assert!((sound_m_per_s / linear.sound_speed_m_per_s(pitch_m) - 1.0).abs() < 1e-4, "{sound_m_per_s}");
    assert!((bands[0][0] / expected - 1.0).abs() < 1e-4, "{} {expected}", bands[0][0]);
}

/// Ramanujan's second formula; its error at this aspect is 1e-9.
fn perimeter_m(ring: &Ring) -> f64 {
    let (a, b) = (ring.semi_major_m, ring.semi_minor_m);
    let h = ((a - b) / (a + b)).powi(2);
    PI * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()))
}

/// At kappa = 0 all rings move alike, at kappa = pi neighbours move oppositely: the joints are then held, or move as a single
/// ring's free poles do.
#[test]
fn band_edges_are_modes_of_a_single_ring() {
    let ring = Ring::PAPER;
    let modes = ring_modes(&ring, 32, 2).unwrap();
    let lowest = |boundary: Boundary| {
        modes.iter().find(|mode| mode.boundary == boundary).map(|mode| mode.frequency_hz).unwrap()
    };
    let edge = &ring_bands(&ring, 32, Symmetry::Symmetric, &[PI]).unwrap()[0];
    assert!((edge[0] / lowest(Boundary::Free) - 1.0).abs() < 1e-8, "{edge:?}");
    assert!((edge[1] / lowest(Boundary::Held) - 1.0).abs() < 1e-8, "{edge:?}");
}

#[test]
fn bands_are_even_and_periodic() {
    let at = |kappa_a: f64, symmetry| ring_bands(&Ring::PAPER, 16, symmetry, &[kappa_a]).unwrap().remove(0);
    for symmetry in [Symmetry::Symmetric, Symmetry::Antisymmetric] {
        let (plus, minus, turned) = (at(1.1, symmetry), at(-1.1, symmetry), at(1.1 + 2.0 * PI, symmetry));
        for band in 0..4 {
            assert!((plus[band] / minus[band] - 1.0).abs() < 1e-9);
            assert!((plus[band] / turned[band] - 1.0).abs() < 1e-9);
        }
    }
}
