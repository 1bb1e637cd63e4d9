//! Curves as laboratories have them: with an approach, a way back, an offset, in any order and unit.

use chainwave_inference::contact_fit::{ContactFit, Zero, fit_contact};
use chainwave_mechanics::PowerLaw;

use crate::common::{Curve, fitted, noisy, ramp};

fn assert_same_law(left: &ContactFit, right: &ContactFit, tolerance: f64) {
    for (one, other) in left.estimates.iter().zip(&right.estimates) {
        assert!((one.value / other.value - 1.0).abs() < tolerance, "{one:?} {other:?}");
        assert!((one.sigma / other.sigma - 1.0).abs() < tolerance, "{one:?} {other:?}");
    }
}

fn reordered(curve: &Curve, order: impl Fn(usize) -> usize) -> Curve {
    let pick = |values: &[f64]| (0..values.len()).map(|i| values[order(i)]).collect();
    (pick(&curve.0), pick(&curve.1))
}

#[test]
fn exact_forces_give_back_their_law() {
    for (a, delta_0_m, p) in
        [(60.1, 2.27e-3, 0.114), (300.0, 5e-3, 0.5), (1e5, 0.5e-3, 1.5), (3e7, 4e-3, 3.0)]
    {
        let law = PowerLaw::new(a, delta_0_m, p).unwrap();
        let found = fitted(&noisy(&law, ramp(0.0, 0.01, 101), 0.0, 0)).law;
        // Rounding of the forces, 1e-16, times the trade between the parameters, some 1e5.
        for (value, expected) in [(found.a, a), (found.delta_0_m, delta_0_m), (found.p, p)] {
            assert!((value / expected - 1.0).abs() < 1e-8, "{found:?}, expected {law:?}");
        }
    }
}

#[test]
fn the_order_of_one_branch_does_not_matter() {
    let curve = noisy(&PowerLaw::ELLIPTICAL_RING, ramp(0.0, 0.01, 101), 3e-3, 1);
    let expected = fitted(&curve);
    assert_same_law(&fitted(&reordered(&curve, |i| 100 - i)), &expected, 1e-12);
    assert_same_law(&fitted(&reordered(&curve, |i| (i * 37) % 101)), &expected, 1e-12);
}

#[test]
fn only_loading_is_fitted_and_the_loss_reported() {
    let law = PowerLaw::ELLIPTICAL_RING;
    let loading = noisy(&law, ramp(0.0, 0.01, 101), 3e-3, 1);
    let back_m = ramp(0.01, 0.0, 101);
    let back_n: Vec<f64> = back_m.iter().map(|overlap_m| 0.8 * law.force_n(*overlap_m)).collect();
    let both = ([loading.0.clone(), back_m].concat(), [loading.1.clone(), back_n].concat());
    let fit = fitted(&both);
    assert_same_law(&fit, &fitted(&loading), 1e-12);
    assert_eq!(fit.n_runs, 2);
    let loss = fit.hysteresis.unwrap();
    // The noise of 101 forces, 3 mN each of some 4 N, averages to 1e-4; the first force of the way back is the last held, 2e-3 of all.
    assert!((loss.lost_fraction - 0.2).abs() < 2e-3, "{loss:?}");
    // Trapezia of 0.1 mm: h^2 / 12 times the change of slope, 1300 N/m, is 1e-6 J of 42 mJ.
    assert!((loss.loading_j / law.energy_j(0.01) - 1.0).abs() < 1e-3, "{loss:?}");
}

#[test]
fn the_start_of_contact_is_where_it_was() {
    let (overlaps_m, forces_n) = noisy(&PowerLaw::ELLIPTICAL_RING, ramp(-2e-3, 0.01, 241), 3e-3, 1);
    let stated_m: Vec<f64> = overlaps_m.iter().map(|overlap_m| overlap_m + 1.3e-3).collect();
    let lifted_n: Vec<f64> = forces_n.iter().map(|force_n| force_n - 0.1).collect();
    let fit = fit_contact(&stated_m, &lifted_n, Zero::Auto).unwrap();
    let (start, offset) = (fit.contact_start_m.unwrap(), fit.load_cell_offset_n.unwrap());
    assert!((start.value - 1.3e-3).abs() < 3.0 * start.sigma && start.sigma < 10e-6, "{start:?}");
    assert!((offset.value + 0.1).abs() < 3.0 * offset.sigma && offset.sigma < 1e-3, "{offset:?}");
}

#[test]
fn a_curve_without_an_offset_says_how_well_that_is_known() {
    let curve = noisy(&PowerLaw::ELLIPTICAL_RING, ramp(0.0, 0.01, 101), 3e-3, 2);
    let fit = fitted(&curve);
    assert_eq!((fit.zero, fit.contact_start_m), (Zero::Stated, None));
    let offset = fit.load_cell_offset_n.unwrap();
    assert!(offset.value.abs() < 3.0 * offset.sigma, "{offset:?}");
    let freed = fit_contact(&curve.0, &curve.1, Zero::LoadCell).unwrap();
    assert_eq!(freed.load_cell_offset_n, Some(offset));
    assert!(freed.estimates[4].sigma > fit.estimates[4].sigma, "one more unknown costs certainty");
}

#[test]
fn laws_along_the_profile_fit_as_well_and_keep_k_0() {
    let fit = fitted(&noisy(&PowerLaw::ELLIPTICAL_RING, ramp(0.0, 0.01, 101), 5e-3, 3));
    let best_n = fit.residual.rms_n;
    // At the edge the sum of squares has grown by t^2 = 3.9 of 98 residuals' worth: 2 % of the rms.
    assert!(fit.profile.laws.iter().all(|law| law.rms_n < 1.025 * best_n && law.rms_n > 0.999 * best_n));
    let change = |of: fn(&PowerLaw) -> f64| {
        let (first, last) = (fit.profile.laws.first().unwrap(), fit.profile.laws.last().unwrap());
        (of(&last.law) / of(&first.law)).ln().abs()
    };
    assert!(change(PowerLaw::k_0_n_per_m) < 0.03);
    assert!(change(|law| law.a) > 10.0 * change(PowerLaw::k_0_n_per_m));
    assert!(fit.correlation[0][2] < -0.98 && fit.correlation[1][2] < -0.98, "{:?}", fit.correlation);
}
