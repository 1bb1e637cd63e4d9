//! Motion that is faster than the frames: what lies beyond half the frame rate is in no x_n(t), however many trials it is made of.
//!
//! Between frames a track is read by a polynomial, which passes nothing beyond half the frame rate and little just below. Where bodies move
//! there, as rings do that ring, trials differ by the phase at which they were sampled, and their mean has lost it. It shows in the highest
//! differences of neighbouring frames, whose variance at rest is the noise's: where a body's is much larger once it moves, it moves near half
//! the frame rate, and beyond it too, as spectra of waves have no edge there.

use std::collections::BTreeMap;

use chainwave_analysis::SIGNIFICANCE_LEVEL;
use chainwave_analysis::probability::variance_ratio_beyond;
use chainwave_measurement::{BodyTrack, ChainMotion, Estimate, Observation, median, robust_sigma_about_zero};

/// What is faster than the frames, of all bodies where one is told to move so.
pub(crate) struct UnresolvedMotion {
    of_bodies: Vec<OfBody>,
    frame_interval_s: f64,
}

struct OfBody {
    body: usize,
    /// Variance of the differences while the body moves, over that at rest.
    ratio: f64,
    /// Whether that is more than chance and what a moving picture adds.
    is_told: bool,
    /// Variance of the motion that the frames do not follow, in square metres, by the number of its cell of time.
    variance_m2: BTreeMap<i64, f64>,
}

/// One difference: when, in the reading's sigmas, and that sigma.
struct Difference {
    time_s: f64,
    value: f64,
    sigma_m: f64,
}

/// Ratios from here on are told by their power of ten.
const LARGE_RATIO: f64 = 1e4;
/// Frames in one difference: its tenth, which passes 2e-5 of a wave of ten frames a period, and all that lies at half the frame rate.
const SPAN: usize = 11;
/// Binomial coefficients with their signs.
const WEIGHTS: [f64; SPAN] = [1.0, -10.0, 45.0, -120.0, 210.0, -252.0, 210.0, -120.0, 45.0, -10.0, 1.0];
/// Sum of their squares, by which a difference of white noise has the noise's variance.
const SQUARES: f64 = 184_756.0;
/// What a difference makes of the variance of a motion at half the frame rate: (sum of |weights|)^2 / sum of squares.
const GAIN_AT_HALF: f64 = 1_048_576.0 / SQUARES;
/// Differences at successive frames per independent one: the sum of their squared correlations, C(40, 20) / C(20, 10)^2.
const ALIKE: f64 = 137_846_528_820.0 / (SQUARES * SQUARES);
/// Relative variance of a variance told by a median, over that told by a mean, which single torn frames would move.
const EFFICIENCY: f64 = 0.37;
/// Readings at rest whose variance is less than this of what is stated are of pictures without noise: the sigmas of pictures with noise are right to some
/// per cent.
const OF_PICTURES: f64 = 0.25;
/// Frames in one cell of time.
const CELL: f64 = 16.0;
/// A variance that grows by less than this is no such motion that matters: what a moving picture adds to the noise (its pattern, its bias of
/// interpolation) is as white, and what swings at a third of the frame rate is followed. Chosen by films of rings: at 25 kHz it grows up to 2.1
/// times and 94 to 96 % of the stated intervals of x_n hold without this, at 12.5 kHz 2.6 times, and 75 % do.
const LEAST_RATIO: f64 = 2.3;

/// Adds to the errors of a motion what is faster than the frames of the recordings that it was merged of, whose bodies rest until `rest_until_s`; says so where
/// there is any.
pub fn add_unresolved_motion(
    motion: &mut ChainMotion,
    observations: &[Observation],
    rest_until_s: f64,
) -> Option<String> {
    let unresolved = UnresolvedMotion::of(observations, rest_until_s);
    unresolved.add_to(motion);
    unresolved.warning()
}

impl UnresolvedMotion {
    /// Looks for it; bodies rest until `rest_until_s`.
    pub(crate) fn of(observations: &[Observation], rest_until_s: f64) -> Self {
        let frame_interval_s =
            median(observations.iter().map(Observation::frame_interval_s).collect()).unwrap_or(0.0);
        let (mut at_rest, mut moving) = (Vec::new(), BTreeMap::<usize, Vec<Difference>>::new());
        for observation in observations {
            for track in &observation.bodies {
                let (rest, moves): (Vec<_>, Vec<_>) = differences(observation, track)
                    .partition(|one| one.time_s + (SPAN / 2) as f64 * frame_interval_s < rest_until_s);
                at_rest.extend(rest.into_iter().map(|one| one.value));
                moving.entry(track.body).or_default().extend(moves);
            }
        }
        // Without frames at rest the stated noise stands, as where rounding hides it while nothing moves.
        let noise = variance(at_rest.iter().copied()).filter(|noise| *noise > OF_PICTURES).unwrap_or(1.0);
        let degrees_of_freedom = |n: usize| EFFICIENCY * n as f64 / ALIKE;
        let of_body = |(body, all): (usize, Vec<Difference>)| {
            let ratio = variance(all.iter().map(|one| one.value))? / noise;
            let p_value = match at_rest.is_empty() {
                true => 0.0,
                false => variance_ratio_beyond(
                    ratio,
                    degrees_of_freedom(all.len()),
                    degrees_of_freedom(at_rest.len()),
                ),
            };
            let is_told = ratio > LEAST_RATIO && p_value < SIGNIFICANCE_LEVEL;
            Some(OfBody { body, ratio, is_told, variance_m2: by_cell(&all, noise, frame_interval_s) })
        };
        let of_bodies: Vec<OfBody> = moving.into_iter().filter_map(of_body).collect();
        // Where one body is told to move so, every other may a little less.
        let is_told = of_bodies.iter().any(|one| one.is_told);
        Self { of_bodies: if is_told { of_bodies } else { Vec::new() }, frame_interval_s }
    }

    /// Adds it to the errors of a motion: at each time an error of its own, as the next frame is half a period on.
    pub(crate) fn add_to(&self, motion: &mut ChainMotion) {
        for one in &self.of_bodies {
            for i in 0..motion.times_s.len() {
                let cell = cell(motion.times_s[i], self.frame_interval_s);
                let missed_m = one.variance_m2.get(&cell).copied().unwrap_or(0.0).sqrt();
                let at = (one.body - 1, i);
                motion.displacement_m[at] =
                    motion.displacement_m[at].map(|x| Estimate::new(x.value, x.sigma.hypot(missed_m)));
                motion.independent_sigma_m[at] = motion.independent_sigma_m[at].hypot(missed_m);
            }
        }
    }

    /// What the reader should know.
    pub(crate) fn warning(&self) -> Option<String> {
        let told: Vec<&OfBody> = self.of_bodies.iter().filter(|one| one.is_told).collect();
        let most = told.iter().map(|one| one.ratio).fold(0.0, f64::max);
        let bodies = match told.as_slice() {
            [one] => format!("body {} swings", one.body),
            [first, .., last] if last.body - first.body + 1 == told.len() => {
                format!("bodies {} to {} swing", first.body, last.body)
            }
            several => {
                let numbers: Vec<String> = several.iter().map(|one| one.body.to_string()).collect();
                format!("bodies {} swing", numbers.join(", "))
            }
        };
        // Motions that were computed rest to the last bit.
        let most = if most < LARGE_RATIO { format!("{most:.1}") } else { format!("{most:.1e}") };
        let rms_um = 1e6 * mean(self.of_bodies.iter().flat_map(|one| one.variance_m2.values())).sqrt();
        (!told.is_empty()).then(|| {
            format!(
                "{bodies} faster than {:.0} frames a second follow: near half that rate readings vary up to {most} times as much as at rest. \
                 x_n(t) lacks what is faster, about {rms_um:.2} um (rms), which its sigma contains; strains, peaks and their times suffer most. Film \
                 at a higher rate",
                self.frame_interval_s.recip(),
            )
        })
    }
}

/// The differences of a track, each in the middle of its frames; none where one of them is missing or the frames are not equally far apart.
fn differences<'a>(
    observation: &'a Observation,
    track: &'a BodyTrack,
) -> impl Iterator<Item = Difference> + 'a {
    const UNEVEN: f64 = 0.01;
    let interval_s = observation.frame_interval_s();
    let span = move |(times_s, places): (&[f64], &[Option<Estimate>])| {
        let is_even = |pair: &[f64]| (pair[1] - pair[0] - interval_s).abs() < UNEVEN * interval_s;
        let middle = places[SPAN / 2]?;
        let sum = places.iter().zip(WEIGHTS).try_fold(0.0, |sum, (place, weight)| {
            Some(sum + weight * (place.as_ref()?.value - middle.value))
        })?;
        times_s.windows(2).all(is_even).then(|| Difference {
            time_s: times_s[SPAN / 2],
            value: sum / (SQUARES.sqrt() * middle.sigma),
            sigma_m: middle.sigma,
        })
    };
    observation.times_s.windows(SPAN).zip(track.position_m.windows(SPAN)).filter_map(span)
}

/// Variance of what is around zero, which few strays do not move.
fn variance(values: impl Iterator<Item = f64>) -> Option<f64> {
    Some(robust_sigma_about_zero(values)?.powi(2))
}

fn cell(time_s: f64, frame_interval_s: f64) -> i64 {
    (time_s / (CELL * frame_interval_s)).floor() as i64
}

/// The variance beyond noise, as of a motion at half the frame rate.
fn by_cell(all: &[Difference], noise: f64, frame_interval_s: f64) -> BTreeMap<i64, f64> {
    let mut cells: BTreeMap<i64, Vec<&Difference>> = BTreeMap::new();
    all.iter().for_each(|one| cells.entry(cell(one.time_s, frame_interval_s)).or_default().push(one));
    let of_cell = |(cell, all): (i64, Vec<&Difference>)| {
        let found = variance(all.iter().map(|one| one.value))?;
        let sigma_m2 = mean(all.iter().map(|one| one.sigma_m.powi(2)).collect::<Vec<_>>().iter());
        Some((cell, (found - noise).max(0.0) * sigma_m2 / GAIN_AT_HALF))
    };
    cells.into_iter().filter_map(of_cell).collect()
}

fn mean<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
    if n > 0.0 { sum / n } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use chainwave_measurement::ErrorModes;
    use ndarray::Array2;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;

    const SIGMA_M: f64 = 2e-6;
    const INTERVAL_S: f64 = 1e-4;
    const REST_UNTIL_S: f64 = -2e-4;

    /// Five trials of two bodies: the first goes on a slow wave of 4 mm, and swings with an amplitude on top at some share of the frame rate, each
    /// trial at its own phase; the second is hit by two torn frames a trial.
    fn trials(seed: u64, amplitude_m: f64, share: f64) -> Vec<Observation> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut noise_m = move || {
            let deviate: f64 = StandardNormal.sample(&mut random);
            SIGMA_M * deviate
        };
        let mut trial = |trial: u32| {
            let times_s: Vec<f64> = (-40..260).map(|k| f64::from(k) * INTERVAL_S).collect();
            let moves = |t: f64| match t < 0.0 {
                true => 0.0,
                false => {
                    let slow = 4e-3 * (1.0 - (TAU * 0.04 * t / INTERVAL_S).cos());
                    slow + amplitude_m * (TAU * (share * t / INTERVAL_S + 0.37 * f64::from(trial))).sin()
                }
            };
            let first: Vec<_> =
                times_s.iter().map(|t| Some(Estimate::new(moves(*t) + noise_m(), SIGMA_M))).collect();
            let torn_m = |k: usize| if k % 150 == 7 { 1e-4 } else { 0.0 };
            let second = (0..times_s.len()).map(|k| Some(Estimate::new(torn_m(k) + noise_m(), SIGMA_M)));
            let bodies = vec![
                BodyTrack { body: 1, position_m: first },
                BodyTrack { body: 2, position_m: second.collect() },
            ];
            Observation { recording: format!("trial {trial}"), view: 1, trial, times_s, bodies }
        };
        (0..5).map(&mut trial).collect()
    }

    #[test]
    fn noise_slow_waves_and_torn_frames_are_nothing_faster_than_the_frames() {
        for seed in 0..40 {
            let found = UnresolvedMotion::of(&trials(seed, 0.0, 0.4), REST_UNTIL_S);
            assert!(found.warning().is_none(), "{seed}: {:?}", found.warning());
        }
    }

    #[test]
    fn what_swings_near_half_the_frame_rate_is_told_and_counted() {
        let amplitude_m = 4e-6;
        for share in [0.45, 0.55] {
            let found = UnresolvedMotion::of(&trials(1, amplitude_m, share), REST_UNTIL_S);
            assert!(found.of_bodies.iter().all(|one| one.is_told == (one.body == 1)));
            assert!(
                found
                    .warning()
                    .is_some_and(|said| said.starts_with("body 1 swings faster than 10000 frames"))
            );
            let mut motion = ChainMotion {
                times_s: (-40..260).map(|k| f64::from(k) * INTERVAL_S).collect(),
                displacement_m: Array2::from_elem((2, 300), Some(Estimate::new(0.0, 1e-6))),
                independent_sigma_m: Array2::from_elem((2, 300), 1e-6),
                modes: ErrorModes::default(),
                n_trials: Array2::from_elem((2, 300), 5),
            };
            found.add_to(&mut motion);
            let sigma_m = |at: (usize, usize)| motion.displacement_m[at].map_or(0.0, |x| x.sigma);
            // At rest nothing is added. Of a body that rests a cell holds five trials' differences of sixteen frames, whose variance is told by a
            // median to one part in sqrt(degrees of freedom / 2): three times that.
            let degrees_of_freedom = EFFICIENCY * 5.0 * CELL / ALIKE;
            let chance_m2 = 3.0 * (2.0 / degrees_of_freedom).sqrt() * SIGMA_M.powi(2) / GAIN_AT_HALF;
            assert!(sigma_m((0, 10)) <= 1e-6 && sigma_m((1, 200)) < (1e-12 + chance_m2).sqrt());
            let added_m2: Vec<f64> = (60..240).map(|i| sigma_m((0, i)).powi(2) - 1e-12).collect();
            // Half the square of the amplitude, times the gain at 0.45 of the frame rate over that at 0.5, sin(0.45 pi)^20 = 0.78. The median of a
            // sine's squares is its variance, which of normal deviates would be 0.455 of it: up to 2.2 times as much is found. Twelve cells, each
            // told as above, leave chance a few tenths more.
            let expected_m2 = 0.5 * amplitude_m.powi(2) * 0.78;
            let ratio = mean(added_m2.iter()) / expected_m2;
            let chance = 3.0 * (2.0 / (12.0 * degrees_of_freedom)).sqrt();
            assert!((1.0 - chance..2.2 * (1.0 + chance)).contains(&ratio), "{ratio}");
        }
    }
}
