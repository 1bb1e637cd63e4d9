//! Whether the pictures' scale is the stated one: the stage's steps and the sizes of bodies that two views show tell it.
//!
//! A body at rest that two views show lies a step of the stage apart in their pictures. Measured by the stated scale, the step is as much
//! too long as the scale is too small. Where one view is magnified against another, the marker itself is larger in it.

use chainwave_measurement::{
    BodyTrack, ChainMotion, ErrorSource, Estimate, Observation, SharedReadingError, TrackDeviation,
};
use chainwave_stitching::StageStep;
use ndarray::Array2;

use crate::geometry::magnification::{Magnifications, PairSize};
use crate::wording::estimate;

/// A step of the stage between two views, and how much larger bodies are in the second.
#[derive(Debug, Clone)]
pub(crate) struct SharedBody {
    /// Its number.
    pub(crate) body: usize,
    /// Numbers of the views.
    pub(crate) views: [u32; 2],
    /// The step as the trials table states it, in metres.
    pub(crate) stated_m: f64,
    /// The step as the pictures have it by the stated scale.
    pub(crate) found_m: Estimate,
    /// How far the body stands from the middle of the first view's picture, in metres along the chain.
    pub(crate) from_middle_m: f64,
    /// The marker's size in the second view over that in the first, less one; `None` where it is too small to be told in halves.
    pub(crate) magnified: Option<Estimate>,
}

impl SharedBody {
    /// The same where what is seen at a place from the middle of a picture stands at another one.
    pub(crate) fn mapped(&self, place_m: &impl Fn(f64) -> f64) -> Self {
        let seen_m = [self.from_middle_m, self.from_middle_m - self.found_m.value];
        let [first_m, second_m] = seen_m.map(place_m);
        let stretch = |at_m: f64| (place_m(at_m + NEARBY_M) - place_m(at_m - NEARBY_M)) / (2.0 * NEARBY_M);
        let larger = stretch(seen_m[1]) / stretch(seen_m[0]);
        let magnified = |size: Estimate| Estimate::new((1.0 + size.value) * larger - 1.0, size.sigma);
        Self {
            from_middle_m: first_m,
            found_m: Estimate::new(first_m - second_m, self.found_m.sigma),
            magnified: self.magnified.map(magnified),
            ..self.clone()
        }
    }
}

/// Half of a distance over which a map's slope is taken, in metres: far below what bends, and above rounding.
const NEARBY_M: f64 = 1e-4;

/// What the pictures say against the stated scale.
#[derive(Debug, Clone, Default)]
pub(crate) struct ScaleCheck {
    /// True scale over the stated one, less one, where the two contradict each other.
    error: Option<Estimate>,
    /// How views are magnified against others, where that is told or stated.
    views: Magnifications,
}

/// What an experiment states of its scale.
#[derive(Debug, Clone, Default)]
pub(crate) struct StatedScale {
    /// Standard uncertainty of a position of the stage, in metres.
    pub(crate) stage_sigma_m: Option<f64>,
    /// Metres for a pixel.
    pub(crate) m_per_px: f64,
    /// Standard uncertainty of the scale that all views have in common, relative to it.
    pub(crate) sigma: f64,
    /// Standard deviation of a view's scale about that, relative to it.
    pub(crate) view_sigma: Option<f64>,
    /// Numbers of the views.
    pub(crate) views: Vec<u32>,
}

/// Standard deviation of a stage's position where none is stated: a scale that is read to some hundredths of a millimetre.
pub(crate) const USUAL_STAGE_SIGMA_M: f64 = 2e-5;
/// Deviations from which on a contradiction is said.
const CONTRADICTED: f64 = 3.0;
/// Standard uncertainty of a marker's relative size beyond noise: interpolation moves each half by some thousandths of a pixel.
pub(crate) const SIZE_SIGMA: f64 = 3e-4;

impl ScaleCheck {
    /// Compares steps and sizes with what is stated.
    pub(crate) fn of(shared: &[SharedBody], stated: &StatedScale) -> Self {
        let mut pairs: Vec<[u32; 2]> = shared.iter().map(|one| one.views).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let of_pair = |views: &[u32; 2]| shared.iter().filter(|one| one.views == *views).collect::<Vec<_>>();
        let size = |views: &[u32; 2]| {
            let sizes: Vec<Estimate> = of_pair(views).iter().filter_map(|one| one.magnified).collect();
            // Trials share what each place in the picture does to a marker.
            let size = mean(&sizes, Errors::Shared)?;
            Some((*views, Estimate::new(size.value, size.sigma.hypot(SIZE_SIGMA))))
        };
        let sizes: Vec<PairSize> = pairs.iter().filter_map(size).collect();
        let views = match stated.view_sigma {
            Some(view_sigma) => Magnifications::stated(stated.views.clone(), &sizes, view_sigma),
            None => Magnifications::told(&sizes),
        };
        let magnified = |view: u32| views.of(view);
        let step =
            |views: &[u32; 2]| relative_step(&of_pair(views), views.map(magnified), stated.stage_sigma_m);
        let steps: Vec<Estimate> = pairs.iter().filter_map(step).collect();
        let error = mean(&steps, Errors::Own)
            .filter(|error| error.value.abs() > CONTRADICTED * error.sigma.hypot(stated.sigma));
        Self { error, views }
    }

    /// Positions along the chain by the scale that all views have in common; as they are where none is magnified.
    pub(crate) fn levelled(&self, mut observations: Vec<Observation>) -> Vec<Observation> {
        for observation in &mut observations {
            let factor = (1.0 + self.views.of(observation.view).value).recip();
            let places = observation.bodies.iter_mut().flat_map(|track| &mut track.position_m);
            places.for_each(|place| *place = place.map(|x| x.scaled(factor)));
        }
        observations
    }

    /// A step of the stage by the scale that all views have in common, with what is not known of the two views' magnifications; as it is
    /// where none is magnified.
    pub(crate) fn levelled_step(&self, step: &StageStep, body: &SharedBody) -> StageStep {
        // What is seen x from the middle of a picture that is larger by m stands x m nearer to it.
        let too_long_m = |magnified: &dyn Fn(u32) -> f64| {
            let [first, second] = body.views.map(magnified);
            first * body.from_middle_m - second * (body.from_middle_m - body.found_m.value)
        };
        let known_m = too_long_m(&|view| self.views.of(view).value);
        let unknown_m =
            self.views.errors.iter().map(|error| too_long_m(&|view| self.views.error_of(view, error)));
        StageStep {
            step_m: Estimate::new(step.step_m.value - known_m, step.step_m.sigma),
            shared_m: step.shared_m.iter().copied().chain(unknown_m).collect(),
            ..step.clone()
        }
    }

    /// What is not known of the views' magnifications, as errors of the readings: in proportion to each body's way from its place at rest, before
    /// `rest_until_s`. They move triggers and drives as well as the motion.
    pub(crate) fn reading_errors(
        &self,
        observations: &[Observation],
        rest_until_s: f64,
    ) -> Vec<SharedReadingError> {
        let of_track = |observation: &Observation, track: &BodyTrack, relative: f64| {
            let rest_m = observation.mean_before_m(track, rest_until_s).unwrap_or(0.0);
            let error_m = |x: &Option<Estimate>| x.map_or(0.0, |x| relative * (x.value - rest_m));
            TrackDeviation {
                recording: observation.recording.clone(),
                body: track.body,
                error_m: track.position_m.iter().map(error_m).collect(),
            }
        };
        let of_observation = |observation: &Observation, error: &[f64]| -> Vec<TrackDeviation> {
            let relative = self.views.error_of(observation.view, error);
            observation.bodies.iter().map(|track| of_track(observation, track, relative)).collect()
        };
        let errors = self.views.errors.iter().enumerate();
        errors
            .map(|(number, error)| SharedReadingError {
                source: magnification(number),
                of_tracks: observations.iter().flat_map(|one| of_observation(one, error)).collect(),
            })
            .collect()
    }

    /// Adds to a motion across the chain, or of turning, what is not known of the views' magnifications, each in proportion to the motion and
    /// to the share of a body's recordings that the view has, and what a contradicted scale leaves open.
    pub(crate) fn add_all_to(&self, motion: &mut ChainMotion, observations: &[Observation]) {
        let share = |row: usize, view: u32| {
            let seen = observations.iter().filter(|one| one.bodies.iter().any(|track| track.body == row + 1));
            let (of_view, all) = seen.fold((0.0, 0.0_f64), |(of_view, all), one| {
                (of_view + f64::from(u8::from(one.view == view)), all + 1.0)
            });
            of_view / all.max(1.0)
        };
        for (number, errors) in self.views.errors.iter().enumerate() {
            let of_views = || self.views.views.iter().zip(errors);
            let of_row = |row: usize| of_views().map(|((view, _), error)| share(row, *view) * error).sum();
            let relative: Vec<f64> = (0..motion.displacement_m.nrows()).map(of_row).collect();
            let error_m = |(row, i): (usize, usize)| {
                motion.displacement_m[(row, i)].map_or(0.0, |x| relative[row] * x.value)
            };
            let displacement_m = Array2::from_shape_fn(motion.displacement_m.dim(), error_m);
            motion.add_error(magnification(number), &displacement_m);
        }
        self.add_to(motion);
    }

    /// Adds to a motion what a contradicted scale leaves open: an error as large as the contradiction, in proportion to the motion.
    pub(crate) fn add_to(&self, motion: &mut ChainMotion) {
        let Some(error) = self.error else { return };
        let displacement_m = motion.displacement_m.mapv(|x| x.map_or(0.0, |x| error.value * x.value));
        motion.add_error("scale that the stage's steps contradict".into(), &displacement_m);
    }

    /// The relative uncertainty of the scale of all views that contradictions ask for; 0 without one.
    pub(crate) fn relative_sigma(&self) -> f64 {
        self.error.map_or(0.0, |error| error.value.abs()).hypot(self.views.common_sigma())
    }

    /// Views and the relative uncertainty of the scale that each has for itself.
    pub(crate) fn of_views(&self) -> impl Iterator<Item = (u32, f64)> {
        self.views.own_sigmas()
    }

    /// What the reader should know.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let percent = |value: Estimate| estimate(value.scaled(100.0));
        let wrong = self.error.map(|error| {
            format!(
                "the scale contradicts the stage: by the stated scale, bodies that two views show stand {} % farther apart than the stage \
                 went. Displacements may be wrong by as much, which their uncertainty holds (hint: calibrate the scale, or check stage_m and scale_px_per_m)",
                percent(error)
            )
        });
        let of_view = |(view, size): &(u32, Estimate)| format!("view {view} by {} %", percent(*size));
        let views: Vec<String> = self.views.views.iter().map(of_view).collect();
        let differ = self.views.differ().then(|| {
            format!(
                "views are magnified differently, by the size of bodies that two of them show: {}, counted from what they have in common. Their motions \
                 were put on one scale, and the uncertainty of that joined theirs (hint: keep focus and distance of the camera)",
                views.join(", ")
            )
        });
        wrong.into_iter().chain(differ).collect()
    }
}

/// The name of an error of the views' magnifications.
fn magnification(number: usize) -> ErrorSource {
    format!("magnification of views, {}", number + 1).into()
}

/// How much longer a step is than stated, relative to it, over the bodies and trials that show it; they share the stage's error. What the
/// two views' magnifications make of it is taken off.
fn relative_step(
    shared: &[&SharedBody],
    magnified: [Estimate; 2],
    stage_sigma_m: Option<f64>,
) -> Option<Estimate> {
    let stated_m = shared.first()?.stated_m;
    let by_views = |at: f64, of: fn(Estimate) -> f64| [of(magnified[0]) * at, -of(magnified[1]) * (at - 1.0)];
    let in_steps = |one: &SharedBody| one.from_middle_m / stated_m;
    let expected = |one: &SharedBody| 1.0 + by_views(in_steps(one), |size| size.value).iter().sum::<f64>();
    let at = shared.iter().map(|one| in_steps(one)).sum::<f64>() / shared.len() as f64;
    let [first, second] = by_views(at, |size| size.sigma);
    let longer =
        |one: &&SharedBody| Estimate::new(one.found_m.value - stated_m * expected(one), one.found_m.sigma);
    let found: Vec<Estimate> = shared.iter().map(longer).collect();
    let found = mean(&found, Errors::Own)?;
    let stage_m = std::f64::consts::SQRT_2 * stage_sigma_m.unwrap_or(USUAL_STAGE_SIGMA_M);
    let is_step = stated_m.abs() > 100.0 * stage_m;
    let sigma = found.sigma.hypot(stage_m) / stated_m.abs();
    is_step.then(|| Estimate::new(found.value / stated_m, sigma.hypot(first.hypot(second))))
}

/// Whose the errors are that estimates of one thing state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Errors {
    /// Each has its own: they average out.
    Own,
    /// All have the same: the mean is as uncertain as one of them.
    Shared,
}

/// The mean, as uncertain as stated or as the scatter shows, whichever is more; `None` of nothing.
pub(crate) fn mean(found: &[Estimate], errors: Errors) -> Option<Estimate> {
    let n = found.len() as f64;
    let mean = found.iter().map(|one| one.value).sum::<f64>() / n;
    let variances = found.iter().map(|one| one.sigma.powi(2)).sum::<f64>();
    let stated = match errors {
        Errors::Own => variances.sqrt() / n,
        Errors::Shared => (variances / n).sqrt(),
    };
    let squares = found.iter().map(|one| (one.value - mean).powi(2)).sum::<f64>();
    let scatter = (squares / (n - 1.0).max(1.0) / n).sqrt();
    (!found.is_empty()).then(|| Estimate::new(mean, stated.max(scatter)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_their_own_average_out_and_shared_ones_do_not() {
        let alike = [Estimate::new(2.0, 0.3); 9];
        assert_eq!(mean(&alike, Errors::Shared), Some(Estimate::new(2.0, 0.3)));
        let own = mean(&alike, Errors::Own).unwrap();
        assert!((own.sigma - 0.1).abs() < 1e-15, "{own:?}");
        // Two that differ by 2 are known to 1 by their scatter, however small their errors are said to be.
        let apart = [1.0, 3.0].map(|value| Estimate::new(value, 1e-3));
        for errors in [Errors::Own, Errors::Shared] {
            assert_eq!(mean(&apart, errors), Some(Estimate::new(2.0, 1.0)));
            assert_eq!(mean(&[], errors), None);
        }
    }

    /// Two steps of 120 mm, seen in three trials each.
    fn shared(scale_error: f64, second_view: f64) -> Vec<SharedBody> {
        let one = |(views, trial): ([u32; 2], u32)| SharedBody {
            body: 3,
            views,
            stated_m: 0.12,
            found_m: Estimate::new(0.12 * (1.0 + scale_error) + 1e-6 * f64::from(trial), 1e-6),
            from_middle_m: 0.06,
            magnified: Some(Estimate::new(if views == [1, 2] { second_view } else { -second_view }, 2e-4)),
        };
        [[1, 2], [2, 3]]
            .into_iter()
            .flat_map(|views| (0..3).map(move |trial| (views, trial)))
            .map(one)
            .collect()
    }

    #[test]
    fn a_scale_that_steps_contradict_is_said() {
        let sound = ScaleCheck::of(&shared(2e-4, 2e-4), &StatedScale::default());
        assert!(sound.warnings().is_empty(), "{:?}", sound.warnings());
        let wrong = ScaleCheck::of(&shared(5e-3, 0.0), &StatedScale::default());
        assert!(wrong.warnings().concat().contains("0.50"), "{:?}", wrong.warnings());
        // One that is stated to be no better known does not contradict anything.
        assert!(
            ScaleCheck::of(&shared(5e-3, 0.0), &StatedScale { sigma: 3e-3, ..StatedScale::default() })
                .warnings()
                .is_empty()
        );
        assert!(ScaleCheck::of(&[], &StatedScale::default()).warnings().is_empty());
    }

    #[test]
    fn a_view_that_is_magnified_is_said() {
        // A step of which the body stands half before the middle of one view and half behind that of the other grows by half of 0.4 %.
        let found = ScaleCheck::of(&shared(2e-3, 4e-3), &StatedScale::default());
        let said = found.warnings().concat();
        assert!(
            said.contains("view 2 by 0.40") && said.contains("view 1 by") && !said.contains("contradicts"),
            "{said}"
        );
        let one = |view: u32| Observation {
            recording: view.to_string(),
            view,
            trial: 1,
            times_s: vec![0.0],
            bodies: vec![BodyTrack { body: 1, position_m: vec![Some(Estimate::new(0.1, 1e-6))] }],
        };
        let levelled = found.levelled(vec![one(1), one(2)]);
        let place_m = |index: usize| levelled[index].bodies[0].position_m[0].unwrap().value;
        assert!((place_m(0) - 0.1).abs() < 1e-9 && (place_m(1) - 0.1 / 1.004).abs() < 1e-9);
    }

    #[test]
    fn a_step_to_a_view_that_is_magnified_is_put_on_one_scale() {
        let bodies = shared(2e-3, 4e-3);
        let found = ScaleCheck::of(&bodies, &StatedScale::default());
        let step = StageStep { from: 0, to: 1, step_m: bodies[0].found_m, shared_m: vec![1e-6] };
        let levelled = found.levelled_step(&step, &bodies[0]);
        // The body stands 60.24 mm before the middle of the second view, by whose size 0.4 % of that are too much.
        assert!((levelled.step_m.value - 0.12).abs() < 2e-6, "{levelled:?}");
        // Each of three views has an error, of which the third has no part in this step, and they have one in common.
        let shared_m = &levelled.shared_m;
        assert!(shared_m.len() == 5 && shared_m[1] > 1e-5 && shared_m[2] > 1e-5 && shared_m[3].abs() < 1e-18);
        let alone = ScaleCheck::default().levelled_step(&step, &bodies[0]);
        assert_eq!(alone, step);
    }

    #[test]
    fn what_is_not_known_of_a_magnification_goes_with_the_way_from_rest() {
        let found = ScaleCheck::of(&shared(2e-3, 4e-3), &StatedScale::default());
        let place = |x_m: f64| Some(Estimate::new(0.1 + x_m, 1e-6));
        let track =
            BodyTrack { body: 4, position_m: vec![place(0.0), place(0.0), None, place(5e-3), place(-1e-3)] };
        let times_s = (-2..3).map(|k| f64::from(k) * 1e-3).collect();
        let seen = Observation { recording: "one".into(), view: 2, trial: 1, times_s, bodies: vec![track] };
        let errors = found.reading_errors(std::slice::from_ref(&seen), 0.0);
        assert!(!errors.is_empty());
        let of_way = |way_m: f64, frame: usize| {
            let variance: f64 = errors.iter().map(|error| error.of_tracks[0].error_m[frame].powi(2)).sum();
            let own = found.of_views().find(|(view, _)| *view == 2).map_or(0.0, |(_, sigma)| sigma);
            // For itself, and with all views.
            let expected = own.hypot(found.views.common_sigma()) * way_m;
            assert!(
                (variance.sqrt() - expected).abs() < 1e-3 * expected + 1e-15,
                "{frame}: {variance} {expected}"
            );
        };
        [(0.0, 0), (0.0, 1), (0.0, 2), (5e-3, 3), (1e-3, 4)]
            .into_iter()
            .for_each(|(way_m, frame)| of_way(way_m, frame));
        let alike = ScaleCheck::of(&shared(2e-4, 2e-4), &StatedScale::default());
        assert!(alike.reading_errors(&[seen], 0.0).is_empty());
    }
}
