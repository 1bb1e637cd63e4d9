//! Somebody's bistable specimen, compressed until it snaps: in the folder that `CHAINWAVE_REFERENCE_DATA` names; without it
//! this test says so and passes.

use chainwave_inference::contact_fit::{ContactFitError, Zero, fit_contact};
use chainwave_testkit::reference_data;

use crate::common::Curve;

/// Travel in millimetres and force in newtons.
fn measured() -> Option<Curve> {
    let path = reference_data("chain/Neel-PRL/static/22NormalTestSpecimen6.txt")?;
    let text = std::fs::read_to_string(path).unwrap();
    let number = |cell: Option<&str>| cell.and_then(|cell| cell.trim().parse::<f64>().ok());
    let rows = text.lines().skip(2).filter_map(|line| {
        let mut cells = line.split(';').skip(2);
        Some((number(cells.next())?, number(cells.next())?))
    });
    Some(rows.unzip())
}

#[test]
fn millimetres_and_a_snap_are_refused() {
    let Some((travel_mm, force_n)) = measured() else { return };
    let refused = fit_contact(&travel_mm, &force_n, Zero::Auto).unwrap_err();
    assert!(matches!(refused, ContactFitError::NotMetres { .. }), "{refused}");
    let overlap_m: Vec<f64> = travel_mm.iter().map(|travel| 1e-3 * travel).collect();
    let refused = fit_contact(&overlap_m, &force_n, Zero::Auto).unwrap_err();
    // It snaps after 76 mm.
    assert!(
        matches!(refused, ContactFitError::DroppingForce { overlap_m, .. } if (0.075..0.083).contains(&overlap_m)),
        "{refused}"
    );
}

#[test]
fn what_comes_before_the_snap_is_fitted_and_its_misfit_said() {
    let Some((travel_mm, force_n)) = measured() else { return };
    let before: Curve = travel_mm
        .iter()
        .zip(&force_n)
        .filter(|(travel, _)| **travel < 70.0)
        .map(|(x, f)| (1e-3 * x, *f))
        .unzip();
    let fit = fit_contact(&before.0, &before.1, Zero::Auto).unwrap();
    assert!(fit.law.p > 1.0, "the specimen stiffens: {:?}", fit.law);
    assert!(fit.residual.widening > 1.0, "it is no power law: {:?}", fit.residual);
}
