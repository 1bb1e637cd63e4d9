//! The contact law F = a (Delta + delta_0)^p - a delta_0^p, fitted to a measured quasi-static compression curve.
//!
//! *What a curve knows.* Its stiffness at zero overlap, k_0 = a p delta_0^(p - 1), is known well; how a, delta_0 and p share it
//! is not: a larger p with a smaller delta_0 and a smaller a looks nearly the same. So the search varies k_0 and delta_0 (their
//! logarithms) and p, in a form of the law that does not end at p = 0, and derives a and f_0. Beside standard uncertainties
//! the fit gives their correlations, the range of p that the data cannot reject (profile likelihood), the laws along it,
//! and sentences for people.
//!
//! *Noise.* The readings' errors are taken as independent and normal; their size comes from the residuals, so intervals take
//! Student's factor ([`ContactFit::factor_95`]). All forces count alike unless the residuals tell that overlaps err
//! ([`Residual::overlap_noise_m`]): an overlap off by e puts its force off by the curve's stiffness times e, so that those of the steep part scatter more
//! (effective variance: Orear 1982, doi:10.1119/1.12972). Where residuals are correlated beyond chance, every sigma is widened
//! by what that costs a smooth fit: sqrt((1 + r)/(1 - r)) of neighbours (a first-order process), or the root of one plus twice the sum
//! of the correlations over more lags, whichever is larger.
//!
//! *Zero.* A constant error of the force and an overlap counted from the wrong place look alike in this law, so at most one of
//! them can be found unless readings were taken before contact. [`Zero`] says which; [`Zero::Auto`] decides by a rule. A law that
//! only approximates the specimen's looks like an offset too: without readings before contact an offset is not stated where the
//! residuals show such a misfit, and not taken out where it is as small as a misfit that noise may hide.

mod ambiguity;
mod branches;
mod curve;
mod error;
mod law;
mod noise;
mod outcome;
mod profile;
mod pure_power;
mod search;
mod statistics;

pub use error::ContactFitError;
pub use outcome::{
    ContactFit, Hysteresis, LawOnProfile, OutlyingReading, PARAMETERS, Profile, Residual, Zero,
};

use chainwave_measurement::Estimate;
use nalgebra::DMatrix;

use branches::{Branches, branches, hysteresis};
use curve::{Curve, LEAST_APPROACH, check_readings};
use noise::OverlapNoise;
use profile::Profiler;
use pure_power::without_offset;
use search::{Minimum, STARTS, Unknowns, descend, search};
use statistics::{covariance, derived, residual, straightness, student};

/// A load cell's offset or a curvature is real from this many standard uncertainties (with Student's factor).
const REAL: f64 = 3.0;
/// What the misfit of a good law makes an offset err by, relative to the largest force: the elastica of the paper's ring, which the law
/// follows to a thousandth, looks like an offset of two thousandths.
const MISFIT: f64 = 2e-3;

/// Fits the contact law to readings of overlap (metres) and force (newtons), both positive in compression, in the order in which
/// they were taken; the order tells loading from unloading and matters for nothing else.
///
/// # Errors
/// [`ContactFitError`] as its variants say: the readings are no compression curve, or show no curvature.
pub fn fit_contact(overlap_m: &[f64], force_n: &[f64], zero: Zero) -> Result<ContactFit, ContactFitError> {
    check_readings(overlap_m, force_n)?;
    let branches = branches(overlap_m);
    let curve = Curve::new(&branches.loading, overlap_m, force_n)?;
    let found = find_zero(&curve, zero)?;
    let mut fit = describe(&found)?;
    fit.n_runs = branches.n_runs;
    fit.hysteresis = loss(&branches, overlap_m, force_n, &found);
    fit.ambiguities = ambiguity::ambiguities(&fit);
    Ok(fit)
}

/// A curve with its zero and best law.
struct Found {
    curve: Curve,
    zero: Zero,
    unknowns: Unknowns,
    minimum: Minimum,
    residual: Residual,
    covariance: DMatrix<f64>,
    /// The load cell's offset where it was fitted along but not taken out.
    neglected_offset_n: Option<Estimate>,
}

/// Carries out the rule of [`Zero`].
fn find_zero(curve: &Curve, zero: Zero) -> Result<Found, ContactFitError> {
    let n_before = curve.approach();
    let zero = match zero {
        Zero::Auto if n_before > 0 => Zero::Contact,
        Zero::Contact if n_before == 0 => {
            return Err(ContactFitError::NoApproach { expected: LEAST_APPROACH });
        }
        zero => zero,
    };
    if zero == Zero::Contact {
        return fit_best(curve, zero, curve.overlap_m[n_before]);
    }
    let curve = curve.without_tension()?;
    if zero == Zero::LoadCell {
        return fit_best(&curve, zero, 0.0);
    }
    let mut stated = fit_best(&curve, Zero::Stated, 0.0)?;
    let Ok(with_offset) = fit_best(&curve, Zero::LoadCell, 0.0) else { return Ok(stated) };
    if with_offset.residual.widening > 1.0 {
        return Ok(stated);
    }
    if zero == Zero::Auto && with_offset.offset_is_real() {
        return Ok(with_offset);
    }
    stated.neglected_offset_n = Some(with_offset.offset_n());
    Ok(stated)
}

/// The best law of a curve once its zero is settled; contact begins at `start_m`, or near it where that is unknown.
fn fit_best(curve: &Curve, zero: Zero, start_m: f64) -> Result<Found, ContactFitError> {
    let unknowns = Unknowns { p: true, offset: zero != Zero::Stated, start: zero == Zero::Contact };
    check_curvature(curve, unknowns, start_m)?;
    let instead = |why| without_offset(curve, start_m).unwrap_or(why);
    let minimum = search(curve, unknowns, start_m, &STARTS).map_err(instead)?;
    let with_overlap_noise = || {
        let noise = OverlapNoise::of(curve, &minimum.parameters)?;
        let curve = curve.weighted(noise.weights);
        let minimum = descend(&curve, unknowns, minimum.parameters)?;
        Some((curve, minimum, Some(noise.sigma_m)))
    };
    let (weighted, minimum, overlap_noise_m) =
        with_overlap_noise().unwrap_or_else(|| (curve.clone(), minimum, None));
    let residual = Residual { overlap_noise_m, ..residual(&weighted, &minimum, unknowns) };
    let covariance = covariance(&weighted, &minimum, unknowns, &residual).map_err(instead)?;
    Ok(Found { curve: weighted, zero, unknowns, minimum, residual, covariance, neglected_offset_n: None })
}

/// Refuses a straight line: with no curvature, any delta_0 fits as well with p = 1.
fn check_curvature(curve: &Curve, unknowns: Unknowns, start_m: f64) -> Result<(), ContactFitError> {
    let in_contact = if unknowns.start { curve.beyond(start_m) } else { curve.clone() };
    let degrees_of_freedom = in_contact.len().saturating_sub(2 + usize::from(unknowns.offset)).max(1);
    match straightness(&in_contact, unknowns.offset) {
        Some((slope, curvature))
            if curvature.value.abs() <= student(REAL, degrees_of_freedom) * curvature.sigma =>
        {
            Err(ContactFitError::StraightLine { k_0_n_per_m: slope.value, k_0_sigma_n_per_m: slope.sigma })
        }
        _ => Ok(()),
    }
}

impl Found {
    /// What follows the law's three among the unknowns.
    fn extra(&self, index: usize, value: f64) -> Estimate {
        Estimate::new(value, self.covariance[(3 + index, 3 + index)].sqrt())
    }

    fn offset_n(&self) -> Estimate {
        self.extra(0, self.minimum.parameters.offset_n)
    }

    fn offset_is_real(&self) -> bool {
        let offset_n = self.offset_n();
        let largest_n = self.curve.force_n.iter().fold(0.0_f64, |most, force| most.max(force.abs()));
        let sigma_n = offset_n.sigma.hypot(MISFIT * largest_n);
        offset_n.value.abs() > student(REAL, self.residual.degrees_of_freedom) * sigma_n
    }
}

/// The best law with its errors and what they hide.
fn describe(found: &Found) -> Result<ContactFit, ContactFitError> {
    let undetermined =
        |wrong: chainwave_mechanics::MechanicsError| ContactFitError::NotDetermined(wrong.to_string());
    let law = found.minimum.parameters.law.power_law().map_err(undetermined)?;
    let (estimates, correlation) = derived(&law, &found.covariance);
    let factor_95 = student(Estimate::COVERAGE_95, found.residual.degrees_of_freedom);
    let error_n = factor_95 * found.residual.noise_n * found.residual.widening;
    let profiler = Profiler {
        curve: &found.curve,
        unknowns: found.unknowns,
        best: found.minimum,
        threshold: found.minimum.sum_of_squares + error_n * error_n,
    };
    Ok(ContactFit {
        law,
        estimates,
        correlation,
        factor_95,
        profile: profiler.profile(estimates[2].sigma),
        residual: found.residual,
        zero: found.zero,
        load_cell_offset_n: if found.unknowns.offset {
            Some(found.offset_n())
        } else {
            found.neglected_offset_n
        },
        contact_start_m: found.unknowns.start.then(|| found.extra(1, found.minimum.parameters.start_m)),
        n_runs: 1,
        hysteresis: None,
        ambiguities: Vec::new(),
    })
}

fn loss(branches: &Branches, overlap_m: &[f64], force_n: &[f64], found: &Found) -> Option<Hysteresis> {
    let offset_n = found.minimum.parameters.offset_n;
    hysteresis(branches, overlap_m, |i| force_n[i] - offset_n)
}
