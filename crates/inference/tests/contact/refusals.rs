//! What is no compression curve is refused, with the reason.

use chainwave_inference::contact_fit::{ContactFitError, Zero, fit_contact};
use chainwave_mechanics::PowerLaw;

use crate::common::{noisy, ramp};

/// The refusal of a curve whose message holds a word.
fn refusal(overlap_m: &[f64], force_n: &[f64], word: &str) -> ContactFitError {
    let refused = fit_contact(overlap_m, force_n, Zero::Auto).unwrap_err();
    assert!(refused.to_string().contains(word), "expected {word:?}: {refused}");
    refused
}

fn scaled(values: &[f64], factor: f64) -> Vec<f64> {
    values.iter().map(|value| value * factor).collect()
}

#[test]
fn what_is_no_compression_curve_is_refused_with_its_reason() {
    let (x, f) = noisy(&PowerLaw::ELLIPTICAL_RING, ramp(0.0, 0.01, 101), 3e-3, 1);
    let n = x.len();
    assert!(matches!(refusal(&x[..7], &f[..7], "at least 8"), ContactFitError::TooFew { found: 7, .. }));
    assert!(matches!(refusal(&[], &[], "found 0"), ContactFitError::TooFew { .. }));
    assert!(matches!(refusal(&x, &f[1..], "found 100"), ContactFitError::Length { .. }));
    assert!(matches!(
        refusal(&scaled(&x, 1e3), &f, "divide them by 1000"),
        ContactFitError::NotMetres { .. }
    ));
    assert!(matches!(refusal(&vec![1e-3; n], &f, "0.001"), ContactFitError::ConstantOverlap { .. }));
    assert!(matches!(refusal(&scaled(&x, -1.0), &f, "sign"), ContactFitError::Tension { .. }));
    assert!(matches!(refusal(&x, &scaled(&f, -1.0), "sign"), ContactFitError::FallingForce { .. }));
    assert!(matches!(refusal(&x, &vec![2.5; n], "2.5"), ContactFitError::ConstantForce { .. }));
    let line: Vec<f64> = x.iter().zip(&f).map(|(x, f)| f - PowerLaw::ELLIPTICAL_RING.force_n(*x)).collect();
    assert!(matches!(refusal(&x, &line, "in contact?"), ContactFitError::ConstantForce { .. }));
    let straight: Vec<f64> = x.iter().zip(&line).map(|(x, noise)| 1474.0 * x + noise).collect();
    let refused = refusal(&x, &straight, "straight line");
    assert!(
        matches!(refused, ContactFitError::StraightLine { k_0_n_per_m, .. } if (k_0_n_per_m / 1474.0 - 1.0).abs() < 1e-3)
    );
}

#[test]
fn a_wrong_number_is_named_with_its_reading() {
    let (mut x, mut f) = noisy(&PowerLaw::ELLIPTICAL_RING, ramp(0.0, 0.01, 101), 3e-3, 1);
    f[17] = f64::NAN;
    assert_eq!(refusal(&x, &f, "force_n").reading(), Some(17));
    x[5] = f64::INFINITY;
    assert_eq!(refusal(&x, &f, "overlap_m").reading(), Some(5));
    x[5] = 3.0;
    f[17] = 1.0;
    assert_eq!(refusal(&x, &f, "metres").reading(), Some(5));
}

#[test]
fn a_pulled_or_broken_specimen_is_refused() {
    let law = PowerLaw::ELLIPTICAL_RING;
    let x = ramp(-1e-3, 0.01, 111);
    let f: Vec<f64> = x.iter().map(|x| law.force_n(*x)).collect();
    assert!(matches!(refusal(&x, &f, "tension"), ContactFitError::Tension { .. }));
    let (x, mut f) = noisy(&law, ramp(0.0, 0.01, 101), 3e-3, 1);
    f[98..].fill(0.2);
    assert!(matches!(refusal(&x, &f, "snapped"), ContactFitError::DroppingForce { .. }));
}

#[test]
fn a_start_of_contact_needs_readings_before_it() {
    let (x, f) = noisy(&PowerLaw::ELLIPTICAL_RING, ramp(0.0, 0.01, 101), 3e-3, 1);
    let refused = fit_contact(&x, &f, Zero::Contact).unwrap_err();
    assert_eq!(refused, ContactFitError::NoApproach { expected: 5 });
}

/// Whatever the numbers are, the answer is a finite law or a reason.
#[test]
fn random_curves_never_panic() {
    use crate::common::deviates;
    for seed in 0..200 {
        let wild = deviates(60, seed);
        let power = 10.0_f64.powf(3.0 * wild[0]);
        let x: Vec<f64> = wild[..30].iter().map(|deviate| 1e-3 * deviate.abs()).collect();
        let f: Vec<f64> = x.iter().zip(&wild[30..]).map(|(x, d)| (x / 1e-3).powf(power) + 0.1 * d).collect();
        if let Ok(fit) = fit_contact(&x, &f, Zero::Auto) {
            assert!(
                fit.estimates.iter().all(|e| e.value.is_finite() && e.sigma.is_finite()),
                "{seed}: {fit:?}"
            );
        }
    }
}

/// Spheres that nothing presses together: whatever becomes of delta_0, the exponent is told.
#[test]
fn a_power_of_the_overlap_alone_is_told_as_one() {
    const A: f64 = 1e8;
    const P: f64 = 1.5;
    let exact: Vec<f64> = ramp(0.0, 0.01, 201).iter().map(|x| A * x.powf(P)).collect();
    let refused = refusal(&ramp(0.0, 0.01, 201), &exact, "A Delta^p");
    // Golden sections leave 1e-9 of the range of exponents, and ln(1 / 0.01) as much of A.
    assert!(
        matches!(refused, ContactFitError::NoOffset { a, p } if (p.value - P).abs() < 1e-7 && (a / A - 1.0).abs() < 1e-6),
        "{refused}"
    );
    let mut n_refused = 0;
    for seed in 0..20 {
        let noise = noisy(&PowerLaw::ELLIPTICAL_RING, ramp(0.0, 0.01, 201), 0.05, seed);
        let force_n: Vec<f64> = noise
            .0
            .iter()
            .zip(&noise.1)
            .map(|(x, f)| f - PowerLaw::ELLIPTICAL_RING.force_n(*x) + A * x.powf(P))
            .collect();
        match fit_contact(&noise.0, &force_n, Zero::Stated) {
            Ok(fit) => {
                let p = fit.estimates[2];
                assert!((p.value - P).abs() < 5.0 * p.sigma, "{seed}: {p:?}");
            }
            Err(ContactFitError::NoOffset { p, .. }) => {
                n_refused += 1;
                assert!((p.value - P).abs() < 5.0 * p.sigma, "{seed}: {p:?}");
            }
            Err(other) => panic!("{seed}: {other}"),
        }
    }
    println!("{n_refused} of 20 without an offset");
}
