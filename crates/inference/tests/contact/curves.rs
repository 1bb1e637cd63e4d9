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

#[test]
fn one_wild_reading_is_named_and_noise_is_not() {
    let law = PowerLaw::new(8.5e5, 1e-4, 1.4).unwrap();
    for seed in 0..20 {
        let mut curve = noisy(&law, ramp(0.0, 6e-4, 300), 0.03, seed);
        assert_eq!(fitted(&curve).residual.outlier, None);
        curve.1[120] += 3.0;
        let named = fitted(&curve).residual.outlier.unwrap();
        // The law that is bent by it follows it by a few of 300 equal weights.
        assert!(named.n_like_it == 1 && (named.off_n - 3.0).abs() < 0.3, "{named:?}");
        assert!((named.overlap_m - curve.0[120]).abs() < 1e-12);
    }
}

/// A load cell that reads in steps larger than its noise: most readings lie on the line between their neighbours, and the steps are the noise.
#[test]
fn forces_in_steps_are_fitted() {
    let law = PowerLaw::new(8.5e5, 1e-4, 1.4).unwrap();
    let mut held = 0;
    for seed in 0..20 {
        let mut curve = noisy(&law, ramp(0.0, 6e-4, 2000), 0.03, seed);
        for force_n in &mut curve.1 {
            *force_n = (*force_n / 0.2).round() * 0.2;
        }
        let fit = fitted(&curve);
        let k_0 = fit.estimates[4];
        held += u32::from((k_0.value - law.k_0_n_per_m()).abs() < fit.factor_95 * k_0.sigma);
    }
    // Of 20 at 95 %, 15 and fewer have a probability of 3e-4.
    assert!(held > 15, "{held} of 20");
}
