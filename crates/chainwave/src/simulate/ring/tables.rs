//! Tables of ring scenes: motion, compression, modes, bands.

use std::f64::consts::PI;
use std::path::Path;

use chainwave_mechanics::{Boundary, Compression, Mode, Ring, RingSimulation, Symmetry, ring_bands};

use crate::error::Error;
use crate::table::{self, column};

use super::scene::{Bands, BandsAsked};

/// Writes the rings' upper centrelines: body n is ring n, node 0 its first joint.
pub(super) fn write_shapes(path: &Path, simulation: &RingSimulation) -> Result<(), Error> {
    let Some(shapes_m) = &simulation.shapes_m else { return Ok(()) };
    let (mut times, mut bodies, mut nodes, mut x, mut y) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (n_rings, _, n_nodes, _) = shapes_m.dim();
    for (k, time_s) in simulation.trajectory.times_s.iter().enumerate() {
        for (ring, node) in (0..n_rings).flat_map(|ring| (0..n_nodes).map(move |node| (ring, node))) {
            times.push(*time_s);
            bodies.push(ring as u32 + 1);
            nodes.push(node as u32);
            x.push(shapes_m[(ring, k, node, 0)]);
            y.push(shapes_m[(ring, k, node, 1)]);
        }
    }
    let columns = vec![
        column("t_s", times),
        column("body", bodies),
        column("node", nodes),
        column("x_m", x),
        column("y_m", y),
    ];
    table::write(path, columns)
}

/// Writes a curve of compression.
pub(super) fn write_curve(path: &Path, curve: &Compression) -> Result<(), Error> {
    let columns =
        vec![column("overlap_m", curve.overlap_m.clone()), column("force_n", curve.force_n.clone())];
    table::write(path, columns)
}

/// Writes the modes of each boundary in rising order, numbered from 1.
pub(super) fn write_modes(path: &Path, modes: &[Mode]) -> Result<(), Error> {
    let (mut boundaries, mut numbers, mut frequencies, mut symmetries) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (boundary, name) in [(Boundary::Free, "free"), (Boundary::Held, "held")] {
        let mut of: Vec<&Mode> = modes.iter().filter(|mode| mode.boundary == boundary).collect();
        of.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
        for (number, mode) in (1_u32..).zip(of) {
            boundaries.push(name);
            numbers.push(number);
            frequencies.push(mode.frequency_hz);
            symmetries.push(name_of(mode.symmetry));
        }
    }
    let columns = vec![
        column("boundary", boundaries),
        column("mode", numbers),
        column("frequency_hz", frequencies),
        column("symmetry", symmetries),
    ];
    table::write(path, columns)
}

/// The lowest symmetric mode of a ring whose poles are held: what answers locally to a wave that passes.
pub(super) fn local_resonance_hz(modes: &[Mode]) -> Option<f64> {
    let held = |mode: &&Mode| mode.boundary == Boundary::Held && mode.symmetry == Symmetry::Symmetric;
    modes.iter().find(held).map(|mode| mode.frequency_hz)
}

/// Writes the lowest bands at equal steps of kappa a from 0 to pi, numbered from 1 in rising order.
pub(super) fn write_bands(
    path: &Path,
    ring: &Ring,
    elements: usize,
    asked: &BandsAsked,
) -> Result<(), Error> {
    let kappa_a: Vec<f64> = (0..asked.n_kappa).map(|k| PI * k as f64 / (asked.n_kappa - 1) as f64).collect();
    let symmetries: &[Symmetry] = match asked.symmetry {
        Bands::Symmetric => &[Symmetry::Symmetric],
        Bands::All => &[Symmetry::Symmetric, Symmetry::Antisymmetric],
    };
    let mut points = vec![Vec::new(); asked.n_kappa];
    for &symmetry in symmetries {
        for (point, bands) in points.iter_mut().zip(ring_bands(ring, elements, symmetry, &kappa_a)?) {
            point.extend(bands.into_iter().map(|frequency_hz| (frequency_hz, symmetry)));
        }
    }
    let (mut kappas, mut numbers, mut frequencies, mut names) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (kappa_a, mut point) in kappa_a.into_iter().zip(points) {
        point.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (number, (frequency_hz, symmetry)) in (1_u32..).zip(point.into_iter().take(asked.n_bands)) {
            kappas.push(kappa_a);
            numbers.push(number);
            frequencies.push(frequency_hz);
            names.push(name_of(symmetry));
        }
    }
    let columns = vec![
        column("kappa_a", kappas),
        column("band", numbers),
        column("frequency_hz", frequencies),
        column("symmetry", names),
    ];
    table::write(path, columns)
}

fn name_of(symmetry: Symmetry) -> &'static str {
    match symmetry {
        Symmetry::Symmetric => "symmetric",
        Symmetry::Antisymmetric => "antisymmetric",
    }
}
