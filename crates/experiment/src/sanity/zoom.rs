//! Recordings whose pictures are magnified otherwise than those of their view's other trials: the camera was touched in between.
//!
//! Bodies come back to their places, so the marker of each is looked for in each recording at rest. Where a picture is larger, they stand farther
//! apart in proportion, and their markers are larger by as much.

use std::num::NonZero;

use chainwave_analysis::probability::variance_ratio_beyond;
use chainwave_correlation::Method;
use chainwave_measurement::{Estimate, map_in_parallel, median};

use super::resting::Resting;
use crate::configuration::Trial;
use crate::finding::{Finding, Sanity};
use crate::geometry::scale::{Errors, SIZE_SIGMA, mean};
use crate::setup::Setup;
use crate::wording::estimate;

/// Probability by chance, of distances from body to body, from which on nothing is said.
const ZOOM_LEVEL: f64 = 1e-4;
/// A change that matters to no result: a share of what a scale is known to.
const LEAST: f64 = 3e-4;
/// Standard deviations from which on the sizes of markers contradict the distances.
const CONTRADICTED: f64 = 4.0;
/// Bodies that tell a slope, and how well they lie on it.
const LEAST_BODIES: usize = 4;

/// How much larger the pictures of a recording are than those of another one, less one.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Larger {
    /// By the distances of bodies at rest, with what they scatter about the proportion.
    by_distance: Estimate,
    /// Bodies less two.
    degrees_of_freedom: f64,
    /// By the sizes of their markers.
    by_size: Option<Estimate>,
}

/// Leaves out recordings whose pictures are magnified otherwise than those of most of their view's. Where markers' sizes contradict it, bodies stand farther
/// apart, and where as many recordings say the one as the other nothing tells which are right: then it is said.
pub(super) fn magnified_trials(
    setup: &Setup,
    resting: &[Vec<Resting>],
    n_threads: NonZero<usize>,
    sanity: &mut Sanity,
) {
    let is_used = |one: &&Resting| sanity.reason(&one.trial.recording).is_none();
    let views: Vec<Vec<&Resting>> =
        resting.iter().map(|of_view| of_view.iter().filter(is_used).collect()).collect();
    let compared = |of_view: &Vec<&Resting>| than_first(setup.method(), of_view);
    let than_first = map_in_parallel(views.len(), n_threads, |index| compared(&views[index]));
    for (of_view, than_first) in views.iter().zip(&than_first) {
        let of_most = than_most(than_first).into_iter().zip(of_view);
        let told: Vec<(Larger, &Trial)> =
            of_most.filter_map(|(larger, one)| Some((larger.filter(is_told)?, &one.trial))).collect();
        let most_agree = 2 * told.len() < of_view.len();
        for (larger, trial) in told {
            match most_agree && !is_contradicted(&larger) {
                true => sanity.leave_out(std::slice::from_ref(trial), &larger.why_left_out()),
                false => sanity.findings.push(larger.finding(trial)),
            }
        }
    }
}

impl Larger {
    fn in_words(&self) -> String {
        let per_cent = |of: Estimate| estimate(of.scaled(100.0));
        let of_markers = self
            .by_size
            .map_or(String::new(), |size| format!(" (their markers are {} % larger)", per_cent(size)));
        format!(
            "bodies at rest stand {} % farther apart than in most recordings of the view{of_markers}",
            per_cent(self.by_distance)
        )
    }

    fn why_left_out(&self) -> String {
        format!(
            "its pictures are magnified otherwise: {} (hint: was the camera touched? A scale_px_per_m of its own in trials.csv keeps it)",
            self.in_words()
        )
    }

    fn finding(&self, trial: &Trial) -> Finding {
        Finding {
            code: "scale",
            subject: trial.recording.clone(),
            text: format!(
                "{}: where its pictures are magnified so, so are displacements (hint: was the camera touched, or the chain?)",
                self.in_words()
            ),
        }
    }
}

/// How much larger the pictures of a view's other recordings are than those of the first.
fn than_first(method: Method, of_view: &[&Resting]) -> Vec<Option<Larger>> {
    let Some((first, others)) = of_view.split_first() else { return Vec::new() };
    others.iter().map(|other| larger(method, first, other)).collect()
}

fn is_told(larger: &Larger) -> bool {
    let Estimate { value, sigma } = larger.by_distance;
    value.abs() > LEAST
        && variance_ratio_beyond((value / sigma).powi(2), 1.0, larger.degrees_of_freedom) < ZOOM_LEVEL
}

/// Whether markers are not as much larger as the distances between them.
fn is_contradicted(larger: &Larger) -> bool {
    larger.by_size.is_some_and(|size| {
        let apart = size.value - larger.by_distance.value;
        apart.abs() > CONTRADICTED * size.sigma.hypot(larger.by_distance.sigma)
    })
}

/// How much larger than in the middle one of a view's recordings pictures are in each, the first included, from how much larger they are than in the
/// first.
fn than_most(than_first: &[Option<Larger>]) -> Vec<Option<Larger>> {
    let known = || than_first.iter().flatten();
    let middle = |of: &dyn Fn(&Larger) -> Option<f64>| {
        median(known().filter_map(of).chain([0.0]).collect()).unwrap_or(0.0)
    };
    let usual_sigma =
        |of: &dyn Fn(&Larger) -> Option<f64>| median(known().filter_map(of).collect()).unwrap_or(0.0);
    let (distance, size) =
        (middle(&|one| Some(one.by_distance.value)), middle(&|one| Some(one.by_size?.value)));
    let sigmas =
        [usual_sigma(&|one| Some(one.by_distance.sigma)), usual_sigma(&|one| Some(one.by_size?.sigma))];
    let less =
        |of: Estimate, middle: f64, usual: f64| Estimate::new(of.value - middle, of.sigma.hypot(usual));
    let of = |one: &Larger| Larger {
        by_distance: less(one.by_distance, distance, sigmas[0]),
        by_size: one.by_size.map(|of| less(of, size, sigmas[1])),
        ..*one
    };
    let first = known().next().map(|one| {
        let exact = Estimate::new(0.0, 0.0);
        of(&Larger { by_distance: exact, by_size: one.by_size.and(Some(exact)), ..*one })
    });
    std::iter::once(first).chain(than_first.iter().map(|one| one.as_ref().map(of))).collect()
}

/// `None` where too few bodies are found in both, or one cannot be read.
fn larger(method: Method, one: &Resting, other: &Resting) -> Option<Larger> {
    let (one, other) = (one.shown.as_ref()?, other.shown.as_ref()?);
    let (mut places, mut sizes) = (Vec::new(), Vec::new());
    for pair in one.shared_with(other) {
        if let Some(found) = pair.found_the_same(method) {
            // What the stage would have moved is how much less far a body stands in the second picture.
            let moved_m = -pair.step_to(&found, [0, 0]).step_m.value;
            places.push([pair.offset_from_middle_m(), moved_m]);
            sizes.extend(pair.magnified(method));
        }
    }
    let by_distance = slope(&places)?;
    let by_size =
        mean(&sizes, Errors::Own).map(|size| Estimate::new(size.value, size.sigma.hypot(SIZE_SIGMA)));
    Some(Larger { by_distance, degrees_of_freedom: places.len() as f64 - 2.0, by_size })
}

/// The slope of a straight line through points, with what they scatter about it; `None` of too few.
fn slope(points: &[[f64; 2]]) -> Option<Estimate> {
    let n = points.len();
    let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / n as f64;
    let (x, y) = (mean(0), mean(1));
    let sum =
        |of: &dyn Fn(f64, f64) -> f64| points.iter().map(|point| of(point[0] - x, point[1] - y)).sum::<f64>();
    let spread = sum(&|x, _| x * x);
    let slope = sum(&|x, y| x * y) / spread;
    let left = sum(&|x, y| (y - slope * x).powi(2));
    (n >= LEAST_BODIES && spread > 0.0)
        .then(|| Estimate::new(slope, (left / (n as f64 - 2.0) / spread).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn larger(by_distance: f64, by_size: f64) -> Larger {
        let estimate = |value| Estimate::new(value, 3e-4);
        Larger {
            by_distance: Estimate::new(by_distance, 1e-5),
            degrees_of_freedom: 3.0,
            by_size: Some(estimate(by_size)),
        }
    }

    fn told(than_first: &[(f64, f64)]) -> Vec<usize> {
        let than_first: Vec<_> =
            than_first.iter().map(|(distance, size)| Some(larger(*distance, *size))).collect();
        let found = than_most(&than_first).into_iter().enumerate();
        found.filter(|(_, one)| one.as_ref().is_some_and(is_told)).map(|(k, _)| k).collect()
    }

    #[test]
    fn the_recordings_that_differ_from_most_are_told_be_it_the_first_or_another() {
        assert!(told(&[(1e-5, 1e-4), (-1e-5, -2e-4)]).is_empty());
        assert_eq!(told(&[(1e-5, 1e-4), (4e-3, 4.2e-3), (0.0, 0.0)]), [2]);
        assert_eq!(told(&[(4e-3, 4.1e-3), (4e-3, 3.8e-3), (4e-3, 4e-3)]), [0]);
    }

    #[test]
    fn sizes_part_a_picture_that_is_larger_from_bodies_that_stand_farther_apart() {
        assert!(!is_contradicted(&larger(4e-3, 4.3e-3)) && !is_contradicted(&larger(1e-3, 1e-4)));
        assert!(is_contradicted(&larger(4e-3, 1e-4)));
    }

    #[test]
    fn a_slope_has_the_scatter_of_its_points() {
        let exact: Vec<[f64; 2]> = (0..5).map(|k| [f64::from(k), 0.25 * f64::from(k) - 3.0]).collect();
        let found = slope(&exact).unwrap();
        assert!((found.value - 0.25).abs() < 1e-15 && found.sigma < 1e-15, "{found:?}");
        // Residuals of +-1, symmetric: none in the slope; four squares of 1 over 2 degrees of freedom and a spread of 5.
        let bent = [[0.0, 1.0], [1.0, -1.0], [2.0, -1.0], [3.0, 1.0]];
        let found = slope(&bent).unwrap();
        assert!(found.value.abs() < 1e-15 && (found.sigma - (4.0_f64 / 2.0 / 5.0).sqrt()).abs() < 1e-15);
        assert!(slope(&bent[1..]).is_none());
    }
}
