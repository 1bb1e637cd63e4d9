use chainwave_mechanics::{Ring, Rod, Section, Support};
use nalgebra::DVector;

pub(crate) fn paper_ring() -> Ring {
    Ring { semi_major_m: 14.8e-3, semi_minor_m: 8.8e-3, wall_m: 0.4e-3, width_m: 12e-3, young_pa: 2.888e9, poisson: 0.35, density_kg_per_m3: 1237.0, bond_width_m: 0.0 }
}

fn compress(rod: &Rod, overlap: f64, from: &DVector<f64>) -> (f64, DVector<f64>) {
    let n = rod.n_elements();
    let support = Support { prescribed: vec![(0, overlap), (1, 0.0), (2 * n, 0.0), (2 * n + 1, 0.0), (rod.rotation(0), 0.0), (rod.rotation(1), 0.0)], loads: vec![] };
    let e = rod.equilibrium(from, &support).unwrap();
    (2.0 * e.forces[0], e.unknowns)
}

#[test]
fn explore() {
    let ring = paper_ring();
    let section = ring.section();
    let stiff = Section { axial_n: 1e4 * section.axial_n, shear_n: f64::INFINITY, ..section };
    for s in [stiff, Section { shear_n: f64::INFINITY, ..section }, section] {
        for n in [4, 8, 12, 16, 24, 32, 64, 128] {
            let rod = Rod::half_ring(&ring, s, n).unwrap();
            let mut u = DVector::zeros(rod.n_unknowns());
            let (k0, _) = compress(&rod, 1e-8, &u);
            print!("{n:4} k0 {:.5} ", k0 / 1e-8);
            for mm in [0.51, 1.01, 2.01, 3.00, 4.01, 6.03, 8.0, 10.01] {
                let (f, v) = compress(&rod, mm * 1e-3, &u);
                u = v;
                print!("{f:.5} ");
            }
            println!();
        }
    }
}
