//! A displacement field as a table.

use chainwave_correlation::{Field, FieldPoint, Strain};
use chainwave_measurement::Estimate;

use crate::tables::result_table::{ResultTable, column};

/// A field with its strains as a table: `x_px, y_px, u_px, v_px, sigma_u_px, sigma_v_px, zncc, iterations, status, shape`, and the strains
/// `strain_xx, strain_yy, strain_xy` with their sigmas.
pub fn field_table(field: &Field, strains: &[Option<Strain>]) -> ResultTable {
    let points = &field.points;
    let displacement = |axis: usize| -> Vec<Option<Estimate>> {
        let of = |point: &FieldPoint| {
            let position = point.found.as_ref().ok()?.position;
            let (moved, place) =
                if axis == 0 { (position.x_px, point.x_px) } else { (position.y_px, point.y_px) };
            Some(Estimate::new(moved.value - place, moved.sigma))
        };
        points.iter().map(of).collect()
    };
    let (u, v) = (displacement(0), displacement(1));
    let values = |of: &[Option<Estimate>]| of.iter().map(|e| e.map(|e| e.value)).collect::<Vec<_>>();
    let sigmas = |of: &[Option<Estimate>]| of.iter().map(|e| e.map(|e| e.sigma)).collect::<Vec<_>>();
    let strain = |of: fn(&Strain) -> Estimate| -> Vec<Option<Estimate>> {
        strains.iter().map(|strain| strain.as_ref().map(of)).collect()
    };
    let (xx, yy, xy) = (strain(|s| s.xx), strain(|s| s.yy), strain(|s| s.xy));
    let positions = || points.iter().map(|point| point.found.as_ref().ok().map(|found| found.position));
    let status = |point: &FieldPoint| point.found.as_ref().err().map_or("ok", |lost| lost.as_str());
    let columns = vec![
        column("x_px", points.iter().map(|point| point.x_px).collect::<Vec<_>>()),
        column("y_px", points.iter().map(|point| point.y_px).collect::<Vec<_>>()),
        column("u_px", values(&u)),
        column("v_px", values(&v)),
        column("sigma_u_px", sigmas(&u)),
        column("sigma_v_px", sigmas(&v)),
        column("zncc", positions().map(|p| p.map(|p| p.zncc)).collect::<Vec<_>>()),
        column("iterations", positions().map(|p| p.map(|p| p.iterations)).collect::<Vec<_>>()),
        column("status", points.iter().map(status).collect::<Vec<_>>()),
        column("shape", points.iter().map(|point| point.shape.to_string()).collect::<Vec<_>>()),
        column("strain_xx", values(&xx)),
        column("strain_yy", values(&yy)),
        column("strain_xy", values(&xy)),
        column("sigma_strain_xx", sigmas(&xx)),
        column("sigma_strain_yy", sigmas(&yy)),
        column("sigma_strain_xy", sigmas(&xy)),
    ];
    ResultTable { columns }
}
