//! The geometry of pictures by where bodies at rest lie in two views, and how large their markers are there.
//!
//! What is seen `x` from the middle of a picture by one scale stands at `x + a x^2 + b x^3`: a camera that is turned makes a, a lens b. A body that lies at x
//! in one view and at y in the next, a step of the stage apart, tells `x - y + a (x^2 - y^2) + b (x^3 - y^3)`, and its marker is larger in
//! the second by `1 + 2 a (x - y) + 3 b (x^2 - y^2)`. Views that are magnified by M about their middles say `x (1 - M) - y (1 - N)` and `1 + N - M`
//! instead: markers alone cannot tell a turned camera from views that grow one after the other, but the steps can.

use std::collections::BTreeMap;

use chainwave_analysis::SIGNIFICANCE_LEVEL;
use chainwave_analysis::probability::{student, variance_ratio_beyond};
use chainwave_measurement::Estimate;
use nalgebra::{DMatrix, DVector};

use crate::geometry::scale::{Errors, SIZE_SIGMA, SharedBody, StatedScale, USUAL_STAGE_SIGMA_M, mean};

/// What an explanation of the places is charged for each number that it needs, in chi squared: three standard deviations.
const CHARGE: f64 = 9.0;
/// How much of each shape a camera has at the farthest body where nothing tells it, as a standard deviation: some tenths of a degree from near.
const USUAL_SHAPE: f64 = 1e-3;
/// Least standard uncertainty of a place at rest, in pixels: interpolation moves a marker by some thousandths.
const PLACE_SIGMA_PX: f64 = 2e-3;

/// What makes bodies lie elsewhere than one scale for all pictures has them.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Cause {
    /// Nothing.
    None,
    /// Each view's own magnification.
    Views,
    /// A turned camera, a lens, or both.
    Geometry { tilt: bool, lens: bool },
}

/// `a` in 1/m and `b` in 1/m^2, with the covariance of both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bent {
    pub(crate) values: [f64; 2],
    pub(crate) covariance: [[f64; 2]; 2],
}

/// What bodies at rest say of the pictures' geometry; `None` where they lie as one scale, or one for each view, has them.
pub(crate) fn bent(shared: &[SharedBody], stated: &StatedScale) -> Option<Bent> {
    let equations = Equations::of(shared, stated)?;
    let geometry = |tilt, lens| Cause::Geometry { tilt, lens };
    let causes =
        [Cause::None, Cause::Views, geometry(true, false), geometry(false, true), geometry(true, true)];
    let solved: Vec<Solved> = causes.into_iter().filter_map(|cause| equations.solve(cause)).collect();
    // What no cause explains is noise that was not known.
    let per_freedom = |one: &Solved| one.chi_squared / (one.degrees_of_freedom as f64).max(1.0);
    let scatter = solved.iter().map(per_freedom).fold(f64::INFINITY, f64::min).max(1.0);
    let charged = |cause: Cause| {
        let found = solved.iter().find(|one| one.cause == cause)?;
        Some(found.chi_squared / scatter + CHARGE * found.n_own as f64)
    };
    let best = causes.into_iter().filter(|cause| charged(*cause).is_some()).min_by(|a, b| {
        charged(*a).unwrap_or(f64::INFINITY).total_cmp(&charged(*b).unwrap_or(f64::INFINITY))
    })?;
    let Cause::Geometry { tilt, lens } = best else { return None };
    // What few places leave may be small by chance, and large where pictures have errors that nobody stated.
    let of = |cause: Cause| solved.iter().find(|one| one.cause == cause);
    let (plain, bent) = (of(Cause::None)?, of(best)?);
    let own = bent.n_own as f64;
    let explained = (plain.chi_squared - bent.chi_squared) / own / per_freedom(bent).max(1.0);
    if variance_ratio_beyond(explained, own, bent.degrees_of_freedom as f64) > SIGNIFICANCE_LEVEL {
        return None;
    }
    // Where the other shape explains as much, either may be behind it.
    let other = charged(geometry(lens, tilt)).unwrap_or(f64::INFINITY);
    let is_clear = tilt == lens || other - charged(best)? > CHARGE;
    let cause = if is_clear { best } else { geometry(true, true) };
    let found = of(cause)?;
    let few =
        (student(Estimate::COVERAGE_95, found.degrees_of_freedom as f64) / Estimate::COVERAGE_95).powi(2);
    let covariance = found.bent.covariance.map(|row| row.map(|value| value * scatter * few));
    Some(Bent { values: found.bent.values, covariance })
}

/// One body in two views, over all trials.
struct Row {
    views: [usize; 2],
    places_m: [f64; 2],
    /// How much longer the step is by the pictures.
    longer_m: Estimate,
    larger: Option<Estimate>,
}

struct Equations {
    rows: Vec<Row>,
    n_views: usize,
    stage_sigma_m: f64,
    /// Half of the largest distance from the middle, by which unknowns are made alike.
    half_m: f64,
}

struct Solved {
    cause: Cause,
    chi_squared: f64,
    degrees_of_freedom: usize,
    /// Numbers that the cause needs.
    n_own: usize,
    bent: Bent,
}

impl Equations {
    fn of(shared: &[SharedBody], stated: &StatedScale) -> Option<Self> {
        let mut bodies: BTreeMap<([u32; 2], usize), Vec<&SharedBody>> = BTreeMap::new();
        for one in shared {
            bodies.entry((one.views, one.body)).or_default().push(one);
        }
        let place = |view: u32| stated.views.iter().position(|other| *other == view);
        let row = |(([one, other], _), trials): (&([u32; 2], usize), &Vec<&SharedBody>)| {
            let from_middle: Vec<f64> = trials.iter().map(|one| one.from_middle_m).collect();
            let first_m = from_middle.iter().sum::<f64>() / trials.len() as f64;
            let longer: Vec<Estimate> = trials
                .iter()
                .map(|one| Estimate::new(one.found_m.value - one.stated_m, one.found_m.sigma))
                .collect();
            let sizes: Vec<Estimate> = trials.iter().filter_map(|one| one.magnified).collect();
            // Trials share what a place in the picture has of its own.
            let of_trials = |found: &[Estimate], least: f64| {
                let mean = mean(found, Errors::Shared)?;
                Some(Estimate::new(mean.value, mean.sigma.hypot(least)))
            };
            let longer_m = of_trials(&longer, PLACE_SIGMA_PX * stated.m_per_px)?;
            let second_m = first_m - trials[0].stated_m - longer_m.value;
            let larger = of_trials(&sizes, SIZE_SIGMA);
            Some(Row {
                views: [place(*one)?, place(*other)?],
                places_m: [first_m, second_m],
                longer_m,
                larger,
            })
        };
        let rows: Vec<Row> = bodies.iter().filter_map(row).collect();
        let half_m =
            rows.iter().flat_map(|row| row.places_m).fold(0.0_f64, |most, place_m| most.max(place_m.abs()));
        let stage_sigma_m = stated.stage_sigma_m.unwrap_or(USUAL_STAGE_SIGMA_M);
        (half_m > 0.0).then_some(Self { rows, n_views: stated.views.len(), stage_sigma_m, half_m })
    }

    /// The least squares by a cause: unknown are each view's error of the stage, which has a prior, the scale of all pictures, and what the cause
    /// has. `None` where it has more unknowns than bodies tell.
    fn solve(&self, cause: Cause) -> Option<Solved> {
        let n_common = self.n_views + 1;
        let shapes: Vec<usize> = match cause {
            Cause::Geometry { tilt, lens } => {
                [tilt, lens].into_iter().enumerate().filter(|(_, is)| *is).map(|(k, _)| k).collect()
            }
            Cause::None | Cause::Views => Vec::new(),
        };
        // Magnifications count from the last view's.
        let n_own = if cause == Cause::Views { self.n_views - 1 } else { shapes.len() };
        let n = n_common + n_own;
        let mut equations: Vec<(DVector<f64>, f64)> = Vec::new();
        for row in &self.rows {
            let [x, y] = row.places_m.map(|place_m| place_m / self.half_m);
            let [one, other] = row.views;
            let mut step = DVector::zeros(n);
            (step[one], step[other]) = (-1.0 / self.half_m, 1.0 / self.half_m);
            step[self.n_views] = x - y;
            let mut size = DVector::zeros(n);
            for (k, shape) in shapes.iter().enumerate() {
                let power = *shape as i32 + 2;
                step[n_common + k] = -(x.powi(power) - y.powi(power));
                size[n_common + k] = f64::from(power) * (x.powi(power - 1) - y.powi(power - 1));
            }
            if cause == Cause::Views {
                for (view, at, sign) in [(one, x, -1.0), (other, -y, 1.0)] {
                    if view < n_own {
                        step[n_common + view] = at;
                        size[n_common + view] = sign;
                    }
                }
            }
            let sigma = row.longer_m.sigma / self.half_m;
            equations.push((step / sigma, row.longer_m.value / self.half_m / sigma));
            if let Some(larger) = row.larger {
                equations.push((size / larger.sigma, larger.value / larger.sigma));
            }
        }
        let degrees_of_freedom =
            equations.len().checked_sub(1 + n_own).filter(|degrees_of_freedom| *degrees_of_freedom > 0)?;
        let of_stage = (0..self.n_views).map(|view| (view, self.stage_sigma_m));
        let of_shapes = (0..shapes.len()).map(|k| (n_common + k, USUAL_SHAPE));
        for (unknown, sigma) in of_stage.chain(of_shapes) {
            let mut prior = DVector::zeros(n);
            prior[unknown] = 1.0 / sigma;
            equations.push((prior, 0.0));
        }
        let mut normal = DMatrix::zeros(n, n);
        let mut right_side = DVector::zeros(n);
        for (coefficients, value) in &equations {
            normal += coefficients * coefficients.transpose();
            right_side += coefficients * *value;
        }
        let inverse = normal.cholesky()?.inverse();
        let found = &inverse * right_side;
        let chi_squared =
            equations.iter().map(|(coefficients, value)| (value - coefficients.dot(&found)).powi(2)).sum();
        let mut bent = Bent { values: [0.0; 2], covariance: [[0.0; 2]; 2] };
        let in_m = |shape: usize| self.half_m.powi(-(shape as i32) - 1);
        for (k, shape) in shapes.iter().enumerate() {
            bent.values[*shape] = found[n_common + k] * in_m(*shape);
            for (l, other) in shapes.iter().enumerate() {
                bent.covariance[*shape][*other] =
                    inverse[(n_common + k, n_common + l)] * in_m(*shape) * in_m(*other);
            }
        }
        Some(Solved { cause, chi_squared, degrees_of_freedom, n_own, bent })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three bodies that each of three views shares with the next, a step of 90 mm apart, as pictures show them in which what is seen x from the middle
    /// stands at `place_m(view, x)`.
    fn shared(place_m: impl Fn(usize, f64) -> f64) -> Vec<SharedBody> {
        let seen_m = |view: usize, at_m: f64| {
            // The inverse of a map that is nearly the identity.
            (0..50).fold(at_m, |seen_m, _| seen_m - (place_m(view, seen_m) - at_m))
        };
        let slope = |view: usize, at_m: f64| (place_m(view, at_m + 1e-4) - place_m(view, at_m - 1e-4)) / 2e-4;
        let mut shared = Vec::new();
        for view in 0..2 {
            for (k, at_m) in [0.020, 0.045, 0.075].into_iter().enumerate() {
                for trial in 0..3 {
                    let [first_m, second_m] = [seen_m(view, at_m), seen_m(view + 1, at_m - 0.09)];
                    let larger = slope(view, first_m) / slope(view + 1, second_m) - 1.0;
                    let off_m = 1e-7 * f64::from(trial - 1);
                    shared.push(SharedBody {
                        body: 3 * view + k,
                        views: [view as u32 + 1, view as u32 + 2],
                        stated_m: 0.09,
                        found_m: Estimate::new(first_m - second_m + off_m, 4e-7),
                        from_middle_m: first_m,
                        magnified: Some(Estimate::new(larger, 1e-4)),
                    });
                }
            }
        }
        shared
    }

    fn told(place_m: impl Fn(usize, f64) -> f64) -> Option<Bent> {
        bent(&shared(place_m), &StatedScale { views: vec![1, 2, 3], ..StatedScale::default() })
    }

    #[test]
    fn square_views_of_one_scale_or_of_several_ask_for_no_geometry() {
        assert_eq!(told(|_, x| x), None);
        assert_eq!(told(|_, x| 1.003 * x), None);
        assert_eq!(told(|view, x| x * [1.0, 1.004, 1.001][view]), None);
    }

    #[test]
    fn a_turned_camera_and_a_lens_are_told_apart() {
        // 0.3 % and 0.2 % of the distance at 80 mm from the middle.
        let (a, b): (f64, f64) = (0.003 / 0.08, 0.002 / 0.08_f64.powi(2));
        let of_tilt = told(|_, x| x + a * x * x).unwrap();
        let of_lens = told(|_, x| x - b * x.powi(3)).unwrap();
        let is_held = |found: &Bent, shape: usize, truth: f64| {
            let sigma = found.covariance[shape][shape].sqrt();
            // of a film without noise, and known well enough to be of use
            (found.values[shape] - truth).abs() < 2.0 * sigma && sigma < 0.1 * truth.abs()
        };
        assert!(is_held(&of_tilt, 0, a) && of_tilt.covariance[1][1] == 0.0, "{of_tilt:?}");
        assert!(is_held(&of_lens, 1, -b) && of_lens.covariance[0][0] == 0.0, "{of_lens:?}");
        let of_both = told(|_, x| x + a * x * x - b * x.powi(3)).unwrap();
        assert!(is_held(&of_both, 0, a) && is_held(&of_both, 1, -b), "{of_both:?}");
    }

    #[test]
    fn one_body_a_pair_leaves_open_which_shape_it_is() {
        let b = 0.002 / 0.08_f64.powi(2);
        let one = shared(|_, x| x - b * x.powi(3)).into_iter().filter(|one| one.body % 3 == 2);
        let stated = StatedScale { views: vec![1, 2, 3], ..StatedScale::default() };
        let found = bent(&one.collect::<Vec<_>>(), &stated).unwrap();
        let sigma = |shape: usize| found.covariance[shape][shape].sqrt();
        assert!(found.values[0].abs() < 2.0 * sigma(0) && (found.values[1] + b).abs() < 2.0 * sigma(1));
        // Either shape may be what makes the pictures so, and the other one with it.
        assert!(sigma(0) > 0.0 && sigma(1) > 0.0, "{found:?}");
    }
}
