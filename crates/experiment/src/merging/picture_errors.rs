//! What pictures of bodies show beyond noise once they have moved: an error that the trials of a view share.
//!
//! A reading's stated variance comes from what its match leaves over. While a body rests, a pattern of the sensor, a hot pixel, a blot on
//! the window or an edge of a compressed block lies on the same speckles as in the reference, and the match leaves noise alone. Once the
//! body has moved, it leaves the noise and twice the pattern. So the excess of the stated variance over that at rest is the variance of
//! an error that depends on the place on the sensor: all trials of a view make it alike, and neighbouring frames too, so that neither
//! repeating a trial nor taking more frames reduces it. It is tested against the scatter of the excess from trial to trial; where there
//! is none, nothing changes. Where bodies show an excess that still rest, it is the light or the focus that changes.

mod apart;
mod variogram;

use chainwave_measurement::{BodyTrack, Estimate, Observation, SharedReadingError, TrackDeviation, median};
use nalgebra::DVector;

pub(crate) use self::apart::Apart;
use self::variogram::{Variogram, between};

/// The excess of variances over those at rest.
pub(crate) struct PictureErrors {
    groups: Vec<Group>,
    /// Whether it is more than chance and interpolation make.
    is_found: bool,
    /// Relative excess of bodies that still rest after the trigger, where that is more than chance.
    at_rest: Option<f64>,
    /// Frames in which all bodies are seen much worse than just before and after, and all frames.
    n_torn: [usize; 2],
    /// Distance on the sensor over which the error changes, in metres of the chain.
    correlation_m: f64,
}

/// One body as one view saw it.
struct Group {
    body: usize,
    view: u32,
    /// Median excess over the frames in which it has moved, relative to the variance at rest: mean and scatter over trials.
    excess: Estimate,
    trials: Vec<Reading>,
}

/// One trial of a group.
struct Reading {
    recording: String,
    /// How far the body was from its place at rest, frame by frame.
    away_m: Vec<Option<f64>>,
    /// Variance beyond that at rest, frame by frame, smoothed.
    extra_m2: Vec<f64>,
    at_rest_m2: f64,
}

/// Relative excess that interpolation and unequal light may make: five times the most that films without such errors show.
const UNCLEAR_EXCESS: f64 = 0.03;
/// Standard errors beyond that by which the excess of all bodies is told, and that of a single one among many.
const TOLD_SIGMA: [f64; 2] = [3.0, 5.0];
/// The distance on the sensor over which such an error changes little, in pixels. It is alike at two places as the gradients of the texture are, whose
/// autocovariance is zero at 0.42 times the width at half height of the texture's own: at 1.3 to 2.5 px of speckles of 3 to 6 px.
const CORRELATION_PX: f64 = 1.5;
/// Stretches of the way of one body in one view, at most: 90 px. Over a longer way the errors' finest part counts as alike over more than it is.
const MOST_STRETCHES: f64 = 60.0;
/// Frames on each side over which an excess is averaged.
const SMOOTHING: usize = 5;
/// Variance of a reading over the median around it in a frame that is torn: six times the scatter from noise on 17 x 17 pixels.
const TORN: f64 = 1.5;

impl PictureErrors {
    /// Looks for the excess. Bodies rest until `rest_until_s` in any case, and each as long as `rests_until_s` says.
    pub(crate) fn of(
        observations: &[Observation],
        rest_until_s: f64,
        rests_until_s: &[f64],
        m_per_px: f64,
    ) -> Self {
        let mut groups: Vec<Group> = Vec::new();
        let (mut found, mut resting) = (Vec::<Vec<f64>>::new(), Vec::new());
        for observation in observations {
            for track in &observation.bodies {
                let Some(own) = Excess::of(observation, track, rest_until_s, m_per_px) else { continue };
                let until_s = rests_until_s.get(track.body - 1).copied().unwrap_or(rest_until_s);
                resting.extend(own.between(observation, rest_until_s, until_s));
                let Some(moved) = median(own.moved.clone()) else { continue };
                let reading = Reading {
                    recording: observation.recording.clone(),
                    away_m: track.position_m.iter().map(|x| x.map(|x| x.value - own.origin_m)).collect(),
                    extra_m2: own.smoothed_m2(),
                    at_rest_m2: own.at_rest_m2,
                };
                let known =
                    groups.iter().position(|one| one.body == track.body && one.view == observation.view);
                let index = known.unwrap_or(groups.len());
                if index == groups.len() {
                    let (body, view) = (track.body, observation.view);
                    groups.push(Group { body, view, excess: Estimate::new(0.0, 0.0), trials: Vec::new() });
                    found.push(Vec::new());
                }
                groups[index].trials.push(reading);
                found[index].push(moved);
            }
        }
        let scatter = scatter_within(&found);
        for (group, found) in groups.iter_mut().zip(&found) {
            let n = found.len() as f64;
            group.excess = Estimate::new(found.iter().sum::<f64>() / n, scatter / n.sqrt());
        }
        let is_told = |one: Estimate, sigmas: f64| one.value > UNCLEAR_EXCESS + sigmas * one.sigma;
        let all = mean_of(&groups.iter().map(|group| group.excess.value).collect::<Vec<_>>());
        let is_found = all.is_some_and(|all| is_told(all, TOLD_SIGMA[0]))
            || groups.iter().any(|group| group.trials.len() > 1 && is_told(group.excess, TOLD_SIGMA[1]));
        let at_rest = mean_of(&resting).filter(|rest| is_told(*rest, TOLD_SIGMA[0])).map(|rest| rest.value);
        let n_frames = observations.iter().map(|one| one.times_s.len()).sum();
        let n_torn = [observations.iter().map(torn_frames).sum(), n_frames];
        Self { groups, is_found, at_rest, n_torn, correlation_m: CORRELATION_PX * m_per_px }
    }

    /// Whether they are more than chance and interpolation make.
    pub(crate) fn is_found(&self) -> bool {
        self.is_found
    }

    /// Root mean square of the errors of bodies that have moved, in metres; 0 where there are none.
    pub(crate) fn size_m(&self) -> f64 {
        let trials = self.groups.iter().flat_map(|group| &group.trials).filter(|_| self.is_found);
        let (sum, n) = trials.flat_map(|trial| &trial.extra_m2).fold((0.0, 0_u32), |(sum, n), extra_m2| {
            if *extra_m2 > 0.0 { (sum + extra_m2, n + 1) } else { (sum, n) }
        });
        if n > 0 { (sum / f64::from(n)).sqrt() } else { 0.0 }
    }

    /// Whether they add more to the variance of a body's readings than noise does, in the mean of all.
    pub(crate) fn outweigh_noise(&self) -> bool {
        let all = mean_of(&self.groups.iter().map(|group| group.excess.value).collect::<Vec<_>>());
        self.is_found && all.is_some_and(|all| all.value > 1.0)
    }

    /// The errors that the trials of a view share, some of each body in each view, apart from the noise; none where there is no more than chance.
    pub(crate) fn apart(&self) -> Apart {
        if !self.is_found {
            return Apart::default();
        }
        let ways: Vec<Vec<(f64, f64)>> =
            self.groups.iter().map(|group| group.variances().collect()).collect();
        let variogram = Variogram::of(&ways, self.correlation_m);
        let errors = self.groups.iter().flat_map(|group| group.errors(&variogram, self.correlation_m));
        let at_rest_m2 = |recording: &str, body: usize| {
            let of_body = self.groups.iter().filter(|group| group.body == body);
            let mut trials = of_body.flat_map(|group| &group.trials);
            trials.find(|trial| trial.recording == recording).map_or(0.0, |trial| trial.at_rest_m2)
        };
        Apart::of(errors.collect(), at_rest_m2)
    }

    /// What the reader should know; where light moves across the pictures, it is behind what changes while bodies rest, and maybe more.
    pub(crate) fn warnings(&self, light_moves: bool) -> Vec<String> {
        let worst = self.groups.iter().max_by(|a, b| a.excess.value.total_cmp(&b.excess.value));
        let on_sensor = worst.filter(|_| self.is_found).map(|worst| {
            format!(
                "pictures of bodies that have moved differ from those at rest by more than noise: up to {:.0} % more variance (body {} in \
                 view {}), as {}a fixed pattern, hot pixels, dirt, reflections, uneven light, lossy compression, or edges too sharp for the pixels leave it. Trials of a view share this \
                 error; it was counted so, as far as it varies within a subset",
                100.0 * worst.excess.value,
                worst.body,
                worst.view,
                if light_moves { "the light that moves, or " } else { "" }
            )
        });
        let changing = self.at_rest.map(|excess| {
            format!(
                "the light or the focus changes while bodies still rest: their pictures differ from those before the trigger by {:.0} % more \
                 variance than noise (a shadow, a lamp, a lens out of focus); places may be off by more than stated",
                100.0 * excess
            )
        });
        let [n_torn, n_frames] = self.n_torn;
        let torn = (n_torn > 0).then(|| {
            format!(
                "in {n_torn} of {n_frames} frames all bodies are seen much worse than just before and after, as of torn pictures (repeated \
                 lines, dropouts); their readings count less"
            )
        });
        on_sensor.into_iter().chain(changing).chain(torn).collect()
    }
}

/// One body's variances in one recording.
struct Excess {
    at_rest_m2: f64,
    /// Mean place at rest.
    origin_m: f64,
    /// Variance frame by frame; `None` where the body was lost.
    variance_m2: Vec<Option<f64>>,
    /// Relative excess in each frame in which the body has moved by more than a pixel.
    moved: Vec<f64>,
}

impl Excess {
    /// `None` where the body was never seen at rest.
    fn of(observation: &Observation, track: &BodyTrack, rest_until_s: f64, m_per_px: f64) -> Option<Self> {
        let origin_m = observation.mean_before_m(track, rest_until_s)?;
        let at_rest = observation.readings_before(track, rest_until_s);
        let n = at_rest.clone().count() as f64;
        // The reference is the mean of these frames: it has the n-th part of each one's own noise, which no other frame's match has.
        let of_others = if n > 1.0 { (n + 1.0) / (n - 1.0) } else { 1.0 };
        let at_rest_m2 = of_others * median(at_rest.map(|x| x.sigma.powi(2)).collect())?;
        let moved = track.position_m.iter().flatten().filter(|x| (x.value - origin_m).abs() > m_per_px);
        let moved = moved.map(|x| x.sigma.powi(2) / at_rest_m2 - 1.0).collect();
        let variance_m2 = track.position_m.iter().map(|x| x.map(|x| x.sigma.powi(2))).collect();
        Some(Self { at_rest_m2, origin_m, variance_m2, moved })
    }

    /// Median relative excess between two times, where that is long enough to tell.
    fn between(&self, observation: &Observation, from_s: f64, until_s: f64) -> Option<f64> {
        let inside = |time_s: &f64| (from_s..until_s).contains(time_s);
        let frames = observation.times_s.iter().zip(&self.variance_m2).filter(|(time_s, _)| inside(time_s));
        let found: Vec<f64> = frames.filter_map(|(_, v)| Some((*v)? / self.at_rest_m2 - 1.0)).collect();
        if found.len() < 2 * SMOOTHING { None } else { median(found) }
    }

    /// The excess frame by frame, averaged over neighbours, and at least 0.
    fn smoothed_m2(&self) -> Vec<f64> {
        let n = self.variance_m2.len();
        let around = |frame: usize| {
            let seen =
                self.variance_m2[frame.saturating_sub(SMOOTHING)..(frame + SMOOTHING + 1).min(n)].iter();
            let (count, sum) = seen.flatten().fold((0.0, 0.0), |(count, sum), v| (count + 1.0, sum + v));
            if count > 0.0 { (sum / count - self.at_rest_m2).max(0.0) } else { 0.0 }
        };
        (0..n).map(around).collect()
    }
}

impl Group {
    /// Distances from rest, and the excess of the variance there.
    fn variances(&self) -> impl Iterator<Item = (f64, f64)> {
        let of_trial = |trial: &'_ Reading| {
            let seen = trial.away_m.iter().zip(&trial.extra_m2);
            seen.filter_map(|(away_m, extra_m2)| Some(((*away_m)?, *extra_m2))).collect::<Vec<_>>()
        };
        self.trials.iter().flat_map(of_trial)
    }

    /// The error along the body's way as independent parts of it. It is told at the ends of stretches and fades from one to the next with its variance
    /// kept; half way between two it has a little more in common with others than at the ends.
    fn errors(&self, variogram: &Variogram, correlation_m: f64) -> Vec<SharedReadingError> {
        let (from_m, until_m) = self
            .variances()
            .fold((0.0_f64, 0.0_f64), |(from, until), (x_m, _)| (from.min(x_m), until.max(x_m)));
        let stretch_m = correlation_m.max((until_m - from_m) / (MOST_STRETCHES - 1.0));
        let n_ends = ((until_m - from_m) / stretch_m).ceil() as usize + 1;
        let ends_m: Vec<f64> = (0..n_ends).map(|k| from_m + k as f64 * stretch_m).collect();
        let parts = variogram.parts(&ends_m);
        let at = |(away_m, extra_m2): (&Option<f64>, &f64)| {
            let Some(away_m) = *away_m else { return DVector::zeros(parts.ncols()) };
            let near = |end_m: &f64| weight(((away_m - end_m) / stretch_m).abs().min(1.0));
            let weights = DVector::from_iterator(n_ends, ends_m.iter().map(near));
            between(&parts, &weights) * extra_m2.sqrt()
        };
        let of_trial = |trial: &Reading| trial.away_m.iter().zip(&trial.extra_m2).map(at).collect::<Vec<_>>();
        let errors_m: Vec<Vec<DVector<f64>>> = self.trials.iter().map(of_trial).collect();
        let of_part = |k: usize| SharedReadingError {
            source: format!("pictures of body {} in view {}, part {}", self.body, self.view, k + 1).into(),
            of_tracks: self
                .trials
                .iter()
                .zip(&errors_m)
                .map(|(trial, errors_m)| TrackDeviation {
                    recording: trial.recording.clone(),
                    body: self.body,
                    error_m: errors_m.iter().map(|error_m| error_m[k]).collect(),
                })
                .collect(),
        };
        (0..parts.ncols()).map(of_part).collect()
    }
}

/// The weight of a part of an error at a share of the way to the next one, 1 at 0 and 0 at 1, smooth at both; with that of the next, its square adds
/// to one.
pub(crate) fn weight(share: f64) -> f64 {
    (1.0 - share * share * (3.0 - 2.0 * share)).max(0.0).sqrt()
}

/// Root mean square deviation of values from the means of their groups; 0 where no group has two.
fn scatter_within(groups: &[Vec<f64>]) -> f64 {
    let squares = |group: &Vec<f64>| {
        let mean = group.iter().sum::<f64>() / group.len() as f64;
        group.iter().map(|value| (value - mean).powi(2)).sum::<f64>()
    };
    let degrees_of_freedom: usize = groups.iter().map(|group| group.len() - 1).sum();
    (groups.iter().map(squares).sum::<f64>() / degrees_of_freedom.max(1) as f64).sqrt()
}

/// The mean with its standard error; `None` of fewer than two.
fn mean_of(values: &[f64]) -> Option<Estimate> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (values.len() > 1).then(|| Estimate::new(mean, (square / n).sqrt()))
}

/// Frames in which every body that is seen, two or more, has a variance far above the median of the frames around.
fn torn_frames(observation: &Observation) -> usize {
    let is_torn = |frame: &usize| {
        let worse = |track: &BodyTrack| {
            let variance = track.position_m[*frame]?.sigma.powi(2);
            let around = track.position_m[frame.saturating_sub(SMOOTHING)..].iter().take(2 * SMOOTHING + 1);
            Some(variance > TORN * median(around.flatten().map(|x| x.sigma.powi(2)).collect())?)
        };
        let seen: Vec<bool> = observation.bodies.iter().filter_map(worse).collect();
        seen.len() > 1 && seen.into_iter().all(|worse| worse)
    };
    (0..observation.times_s.len()).filter(is_torn).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PX_M: f64 = 4e-4;
    const AT_REST_M: f64 = 1e-6;

    /// Four trials of two bodies in a view: at rest until the trigger, then moving; variances scatter by some per cent, and are larger by
    /// `excess` once the body has moved.
    fn observations(excess: f64) -> Vec<Observation> {
        let times_s: Vec<f64> = (-40..100).map(|frame| f64::from(frame) * 4e-5).collect();
        let recording = |trial: u32| {
            let body = |body: usize| {
                let place = |(frame, time_s): (usize, &f64)| {
                    let moved_m = 2.0 * time_s.max(0.0);
                    let wave = (2.4 * (frame + 31 * body) as f64 + f64::from(trial)).sin();
                    let ratio = 1.0 + 0.08 * wave + if moved_m > 0.0 { excess } else { 0.0 };
                    Some(Estimate::new(moved_m, AT_REST_M * ratio.sqrt()))
                };
                BodyTrack { body, position_m: times_s.iter().enumerate().map(place).collect() }
            };
            let bodies = vec![body(1), body(2)];
            Observation { recording: trial.to_string(), view: 1, trial, times_s: times_s.clone(), bodies }
        };
        (1..5).map(recording).collect()
    }

    #[test]
    fn without_an_excess_nothing_changes() {
        let clean = observations(0.0);
        let found = PictureErrors::of(&clean, 0.0, &[0.0, 0.0], PX_M);
        assert!(found.warnings(false).is_empty(), "{:?}", found.warnings(false));
        assert!(found.apart().errors.is_empty());
        assert_eq!(found.apart().noise_of(clean.clone()), clean);
    }

    #[test]
    fn an_excess_counts_as_common_to_the_trials_of_a_view() {
        let patterned = observations(0.5);
        let found = PictureErrors::of(&patterned, 0.0, &[0.0, 0.0], PX_M);
        assert!(found.warnings(false).concat().contains("fixed pattern"), "{:?}", found.warnings(false));
        let apart = found.apart();
        let errors = &apart.errors;
        let body = 2;
        let of_body = || errors.iter().filter(|error| error.of_tracks.iter().all(|track| track.body == body));
        let variance =
            |error: &SharedReadingError, i: usize| (error.of_tracks[0].error_m[i] / AT_REST_M).powi(2);
        // Variances scatter by 8 %, the smoothed by less. Those of the 40 frames at rest count for less than a frame's that is not in the reference, which
        // these ones do not know.
        let shared = 1.5 - 41.0 / 39.0;
        for i in [60, 90, 120] {
            let all: f64 = of_body().map(|error| variance(error, i)).sum();
            assert!((all - shared).abs() < 0.04, "{all}");
        }
        // Half of it is the pattern under the body at rest, which the error has everywhere. After 15 and 75 frames the body is 3 and 15 px away, at
        // ends of stretches; half way between two of them each is a mean of two halves, which has up to 4/3 as much in common.
        let common = |frames: [usize; 2]| {
            let product = |error: &SharedReadingError| {
                let error_m = &error.of_tracks[0].error_m;
                error_m[frames[0]] * error_m[frames[1]] / AT_REST_M.powi(2)
            };
            of_body().map(product).sum::<f64>() / shared
        };
        assert!((common([55, 115]) - 0.5).abs() < 0.05, "{}", common([55, 115]));
        assert!((0.45..0.05 + 2.0 / 3.0).contains(&common([62, 122])), "{}", common([62, 122]));
        assert!(of_body().all(|error| error.of_tracks.len() == 4 && variance(error, 10) < 0.02));
        let noise = apart.noise_of(patterned.clone());
        let sigma = |observations: &[Observation], frame: usize| {
            observations[0].bodies[0].position_m[frame].unwrap().sigma
        };
        // What is counted as common is no noise: what is left is that at rest, to the 4 % by which the sigmas scatter and are known.
        for frame in [10, 60, 100] {
            assert!((sigma(&noise, frame) / AT_REST_M - 1.0).abs() < 0.08, "{}", sigma(&noise, frame));
        }
        let all: f64 = errors
            .iter()
            .filter(|error| error.of_tracks[0].body == 1)
            .map(|error| variance(error, 100))
            .sum();
        let (before, after) = (sigma(&patterned, 100) / AT_REST_M, sigma(&noise, 100) / AT_REST_M);
        assert!((after * after + all - before * before).abs() < 0.05, "{before} {after} {all}");
    }

    #[test]
    fn bodies_at_rest_that_look_different_tell_of_light_or_focus() {
        let changing = observations(0.5);
        // The bodies are said to rest for half a millisecond more.
        let found = PictureErrors::of(&changing, 0.0, &[5e-4, 5e-4], PX_M);
        assert!(found.warnings(false).concat().contains("focus"), "{:?}", found.warnings(false));
    }

    #[test]
    fn torn_frames_are_counted() {
        let mut torn = observations(0.0);
        for track in &mut torn[0].bodies {
            let place = track.position_m[70].as_mut().unwrap();
            place.sigma *= 2.0;
        }
        let found = PictureErrors::of(&torn, 0.0, &[0.0, 0.0], PX_M);
        assert!(found.warnings(false).concat().contains("in 1 of 560 frames"), "{:?}", found.warnings(false));
    }
}
