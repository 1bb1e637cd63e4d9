//! Views that contradict each other about a body that both show, beyond their noise: the rest of what no other hypothesis explains.
//!
//! A body that moves towards the camera is seen farther from the middle of the picture; a lens, a window that is not flat, a marker that comes
//! loose show it elsewhere too. All trials of a view see it so, and the next view, which has the body at its other end, does not. What a view makes of
//! such a body on its own tells how large these errors are and how fast they change, so that they can be counted where one view alone shows a body.

use chainwave_measurement::{
    BodyTrack, ChainMotion, Estimate, Observation, SharedReadingError, TrackDeviation,
};
use chainwave_stitching::LeftByView;
use nalgebra::{DMatrix, DVector};

use crate::finding::Finding;
use crate::merging::picture_errors::weight;

/// The kind of the finding that says so.
const VIEWS_DISAGREE: &str = "views_disagree";

/// An error that each view makes of each body on its own once that moves, alike in all trials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BetweenViews {
    /// Its standard deviation.
    sigma_m: f64,
    /// Times so far apart have errors that are alike by half.
    alike_s: f64,
    /// Pairs of neighbouring views that share a body.
    n_pairs: usize,
    /// Standard deviations by which differences of views are alike from one stretch of time to the next.
    significance: f64,
}

/// Stretches of time, at most, in which two views are compared, and the least number of times in each: the noise of a stretch is that of its readings,
/// whatever their interpolation makes of neighbours.
const MOST_STRETCHES: usize = 32;
const LEAST_TIMES: usize = 8;
/// Standard deviations beyond which differences of views are no chance: of some hundreds of experiments, none by it.
const DETECTION_SIGMAS: f64 = 5.0;
/// An error so many times as large as what lies on the sensor makes is another one: that is told to some tens of per cent by what it adds to a
/// reading's noise, and is seen apart by two views as well.
const BEYOND_PICTURES: f64 = 2.0;
/// Standard deviations of the error that are tried, over that of the noise of a stretch, each a factor beyond the one before.
const LEAST_RATIO: f64 = 0.1;
const RATIO_STEP: f64 = 1.25;
const N_RATIOS: i32 = 42;
/// Distances in time by which the error's correlation falls to exp(-1/2) that are tried: from half a stretch on, each a factor beyond the one before.
const LENGTH_STEP: f64 = std::f64::consts::SQRT_2;
const N_LENGTHS: i32 = 10;
/// A normal correlation is a half at this multiple of that distance.
const HALF: f64 = 1.177_410_022_515_474_7;
/// Parts of the error of one body in one view, at most.
const MOST_PARTS: f64 = 60.0;
/// Distance of independent parts that fade into each other, over the distance at which such errors are alike by half.
const PARTS_APART: f64 = 1.5;

/// What a view's drive and its trigger make of a body's motion: more or less of it, and earlier or later.
const N_ALIGNED: usize = 2;

/// The differences of two views of a body, in stretches of time.
struct Pair {
    /// Mean over a stretch, in metres; its sigma is that of noise.
    means_m: Vec<Estimate>,
    /// The body's place and its way in each stretch, in metres: what a drive and a trigger that are off make of the differences is in proportion.
    moves: Vec<[f64; N_ALIGNED]>,
    stretch_s: f64,
}

impl BetweenViews {
    /// What views say of each other, of bodies that rest until the times given, and move as a motion that was merged of all; `None` where that is
    /// no more than noise.
    pub(crate) fn of(left: &[LeftByView], motion: &ChainMotion, rests_until_s: &[f64]) -> Option<Self> {
        let begins_s = |body: usize| rests_until_s.get(body - 1).copied().unwrap_or(f64::NEG_INFINITY);
        let neighbours = left.windows(2).filter(|pair| pair[0].body == pair[1].body);
        let pair = |pair: &[LeftByView]| Pair::of(&pair[0], &pair[1], motion, begins_s(pair[0].body));
        let pairs: Vec<Pair> = neighbours.filter_map(pair).collect();
        // Of independent numbers of unit variance each product has unit variance, and none depends on another in the mean.
        let products: Vec<f64> = pairs.iter().flat_map(Pair::neighbours).collect();
        let significance = products.iter().sum::<f64>() / (products.len() as f64).sqrt();
        if significance.is_nan() || significance < DETECTION_SIGMAS {
            return None;
        }
        let [variance_m2, alike_s] = sizes(&pairs);
        // The difference of two views has the errors of both.
        Some(Self { sigma_m: (0.5 * variance_m2).sqrt(), alike_s, n_pairs: pairs.len(), significance })
    }

    /// Whether it is more than what lies on the sensor makes, which has this size in metres.
    pub(crate) fn is_beyond(&self, of_pictures_m: f64) -> bool {
        self.sigma_m > BEYOND_PICTURES * of_pictures_m
    }

    /// The errors of all readings of bodies that move, as independent parts: each begins as another ends, with the variance kept.
    pub(crate) fn errors(
        &self,
        observations: &[Observation],
        rests_until_s: &[f64],
    ) -> Vec<SharedReadingError> {
        let mut groups: Vec<(u32, usize)> = observations
            .iter()
            .flat_map(|one| one.bodies.iter().map(|track| (one.view, track.body)))
            .collect();
        groups.sort_unstable();
        groups.dedup();
        let last_s = observations.iter().filter_map(|one| one.times_s.last().copied()).fold(0.0, f64::max);
        let of_group = |(view, body): (u32, usize)| {
            let begins_s = rests_until_s.get(body - 1).copied().unwrap_or(0.0);
            let apart_s = (PARTS_APART * self.alike_s).max((last_s - begins_s) / (MOST_PARTS - 1.0));
            let n_parts = ((last_s - begins_s) / apart_s).ceil().max(0.0) as usize + 1;
            let of_part = move |part: usize| SharedReadingError {
                source: format!("body {body} as view {view} sees it, part {}", part + 1).into(),
                of_tracks: observations
                    .iter()
                    .filter(|one| one.view == view)
                    .filter_map(|one| {
                        let track = one.bodies.iter().find(|track| track.body == body)?;
                        Some(self.of_track(one, track, [begins_s, apart_s], part))
                    })
                    .collect(),
            };
            (0..n_parts).map(of_part)
        };
        groups.into_iter().flat_map(of_group).collect()
    }

    fn of_track(
        &self,
        observation: &Observation,
        track: &BodyTrack,
        [begins_s, apart_s]: [f64; 2],
        part: usize,
    ) -> TrackDeviation {
        let error_m = |time_s: &f64| {
            let from_part = (time_s - begins_s) / apart_s - part as f64;
            if *time_s < begins_s { 0.0 } else { self.sigma_m * weight(from_part.abs().min(1.0)) }
        };
        TrackDeviation {
            recording: observation.recording.clone(),
            body: track.body,
            error_m: observation.times_s.iter().map(error_m).collect(),
        }
    }

    /// What the reader should know.
    pub(crate) fn finding(&self) -> Finding {
        let Self { sigma_m, alike_s, n_pairs, significance } = self;
        Finding {
            code: VIEWS_DISAGREE,
            subject: "bodies that two views show".into(),
            text: format!(
                "once they move, views show them apart by more than noise ({significance:.0} standard deviations, {n_pairs} pairs), as bodies that move \
                 towards the camera, a lens that distorts, a window or a marker that turns leave it, or a view of another frame rate than stated, of another \
                 striker or of a chain that was not the same that day: each view by {:.2} um, which changes within \
                 {:.2} ms. It is counted as an error of each body in each view, which trials share (hint: a camera farther away, with a longer lens, sees less \
                 of what moves towards it; `chainwave calibrate` tells a lens)",
                1e6 * sigma_m,
                1e3 * alike_s,
            ),
        }
    }
}

impl Pair {
    /// `None` where both views never show the moving body at once, or too shortly.
    fn of(one: &LeftByView, other: &LeftByView, motion: &ChainMotion, begins_s: f64) -> Option<Self> {
        let mut others = other.left_m.iter().peekable();
        let mut differences: Vec<(f64, Estimate)> = Vec::new();
        for (time_s, left_m) in one.left_m.iter().filter(|(time_s, _)| *time_s >= begins_s) {
            while others.next_if(|(other_s, _)| other_s < time_s).is_some() {}
            if let Some((_, right_m)) = others.next_if(|(other_s, _)| other_s <= time_s) {
                let sigma_m = left_m.sigma.hypot(right_m.sigma);
                differences.push((*time_s, Estimate::new(left_m.value - right_m.value, sigma_m)));
            }
        }
        let n_times = differences.len().div_ceil(MOST_STRETCHES).max(LEAST_TIMES);
        let mean = |stretch: &[(f64, Estimate)]| {
            let n = stretch.len() as f64;
            let sum = |of: fn(&Estimate) -> f64| stretch.iter().map(|(_, one)| of(one)).sum::<f64>();
            Estimate::new(sum(|one| one.value) / n, sum(|one| one.sigma.powi(2)).sqrt() / n)
        };
        let stretches = || differences.chunks_exact(n_times);
        let means_m: Vec<Estimate> = stretches().map(mean).collect();
        let place_m = |(time_s, _): &(f64, Estimate)| {
            let column = motion.columns_at(&[*time_s])[0]?;
            motion.displacement_m[(one.body - 1, column)].map(|x| x.value)
        };
        let moves = |stretch: &[(f64, Estimate)]| {
            let ends_m = [stretch.first().and_then(place_m), stretch.last().and_then(place_m)]
                .map(Option::unwrap_or_default);
            [0.5 * (ends_m[0] + ends_m[1]), ends_m[1] - ends_m[0]]
        };
        let moves: Vec<[f64; 2]> = stretches().map(moves).collect();
        let stretch_s = differences.get(n_times)?.0 - differences[0].0;
        let is_enough = means_m.len() > N_ALIGNED + 1;
        is_enough.then_some(Self { means_m, moves, stretch_s })
    }

    /// Products of neighbouring stretches, in units of their noise.
    fn neighbours(&self) -> impl Iterator<Item = f64> + '_ {
        let pairs = self.means_m.iter().zip(self.means_m.iter().skip(1));
        pairs.map(|(a, b)| a.value * b.value / (a.sigma * b.sigma))
    }

    fn noise_m2(&self) -> f64 {
        self.means_m.iter().map(|one| one.sigma.powi(2)).sum::<f64>() / self.means_m.len() as f64
    }

    /// The differences along the columns of `free`, which no drive and no trigger of a view can take up, in independent parts: how much an error of unit variance with a correlation of
    /// this length has of each, and the part's square over the noise's.
    fn parts(&self, free: &DMatrix<f64>, length_s: f64) -> Vec<Part> {
        let n = self.means_m.len();
        let apart = |i: usize, j: usize| (i as f64 - j as f64) * self.stretch_s / length_s;
        let correlation = DMatrix::from_fn(n, n, |i, j| (-0.5 * apart(i, j).powi(2)).exp());
        let left_m = DVector::from_iterator(n, self.means_m.iter().map(|one| one.value));
        let eigen = (free.transpose() * correlation * free).symmetric_eigen();
        let noise_m2 = self.noise_m2();
        let along_m = eigen.eigenvectors.transpose() * (free.transpose() * left_m);
        let part =
            |(share, m): (&f64, &f64)| Part { share: share.max(0.0), square: m * m / noise_m2, noise_m2 };
        eigen.eigenvalues.iter().zip(&along_m).map(part).collect()
    }

    /// Orthonormal columns of the differences that no drive and no trigger of one of the views makes.
    fn free(&self) -> DMatrix<f64> {
        let n = self.means_m.len();
        let taken = DMatrix::from_fn(n, N_ALIGNED, |i, k| self.moves[i][k]);
        let basis = taken.svd(true, false);
        let largest = basis.singular_values.max();
        let columns = basis.u.iter().flat_map(|u| u.column_iter().map(|column| column.clone_owned()));
        let told = columns.zip(&basis.singular_values).filter(|(_, size)| **size > 1e-9 * largest);
        let projector =
            told.fold(DMatrix::identity(n, n), |left, (column, _)| left - &column * column.transpose());
        let eigen = projector.symmetric_eigen();
        let kept: Vec<usize> = (0..n).filter(|k| eigen.eigenvalues[*k] > 0.5).collect();
        eigen.eigenvectors.select_columns(&kept)
    }
}

/// A part of the differences of two views.
struct Part {
    share: f64,
    square: f64,
    noise_m2: f64,
}

impl Part {
    /// Logarithm of the likelihood of an error of this variance (restricted likelihood; H. D. Patterson, R. Thompson, Biometrika 58 (1971) 545).
    fn likelihood(&self, variance_m2: f64) -> f64 {
        let variance = 1.0 + variance_m2 * self.share / self.noise_m2;
        -0.5 * (variance.ln() + self.square / variance)
    }
}

/// Variance of the differences of two views, and the distance in time at which they are alike by half: means over lengths of the correlation by how
/// likely these make the differences, where before all lengths and variances were alike on a logarithmic scale. A correlation's length and
/// its variance are hardly told apart by what is smooth; so the variance at each length is that which the differences have, and not the likeliest.
fn sizes(pairs: &[Pair]) -> [f64; 2] {
    let stretch_s = pairs.iter().map(|pair| pair.stretch_s).fold(0.0, f64::max);
    let noise_m2 = pairs.iter().map(Pair::noise_m2).sum::<f64>() / pairs.len() as f64;
    let free: Vec<DMatrix<f64>> = pairs.iter().map(Pair::free).collect();
    let at_length = |k: i32| {
        let length_s = 0.5 * stretch_s * LENGTH_STEP.powi(k);
        let parts: Vec<Part> =
            pairs.iter().zip(&free).flat_map(|(pair, free)| pair.parts(free, length_s)).collect();
        let variances_m2 = (0..N_RATIOS).map(|k| noise_m2 * (LEAST_RATIO * RATIO_STEP.powi(k)).powi(2));
        let likelihoods: Vec<f64> =
            variances_m2.map(|m2| parts.iter().map(|part| part.likelihood(m2)).sum()).collect();
        let beyond_noise_m2: f64 = parts.iter().map(|part| (part.square - 1.0) * part.noise_m2).sum();
        let shares: f64 = parts.iter().map(|part| part.share).sum();
        (likelihoods, [beyond_noise_m2.max(0.0) / shares, HALF * length_s])
    };
    let tried: Vec<(Vec<f64>, [f64; 2])> = (0..N_LENGTHS).map(at_length).collect();
    let most =
        tried.iter().flat_map(|(likelihoods, _)| likelihoods).copied().fold(f64::NEG_INFINITY, f64::max);
    let likeliness = |likelihoods: &[f64]| likelihoods.iter().map(|one| (one - most).exp()).sum::<f64>();
    let all: f64 = tried.iter().map(|(likelihoods, _)| likeliness(likelihoods)).sum();
    [0, 1].map(|k| {
        tried.iter().map(|(likelihoods, sizes)| likeliness(likelihoods) * sizes[k]).sum::<f64>() / all
    })
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::ErrorModes;
    use ndarray::Array2;

    use super::*;

    const INTERVAL_S: f64 = 4e-5;
    const NOISE_M: f64 = 1e-6;
    const N: usize = 400;

    /// Numbers of unit variance that no one can tell from independent ones here: the fractional parts of multiples of an irrational number.
    fn noise(seed: usize) -> impl Fn(usize) -> f64 {
        move |i| {
            let share = ((seed * 7919 + i + 1) as f64).powi(2) * 0.618_033_988_749_894_9;
            (share.fract() - 0.5) * 12.0_f64.sqrt()
        }
    }

    /// Ten bodies, each seen by two views, one of which is off by `off_m` once the body moves.
    fn seen(off_m: impl Fn(usize, f64) -> f64) -> Vec<LeftByView> {
        let of_view = |body: usize, view: u32| {
            let own = noise(2 * body + view as usize);
            let left = |i: usize| {
                let time_s = i as f64 * INTERVAL_S;
                let sign = if view == 1 { 0.5 } else { -0.5 };
                let left_m = sign * off_m(body, time_s) + NOISE_M * own(i);
                (time_s, Estimate::new(left_m, NOISE_M))
            };
            LeftByView { body, view, left_m: (0..N).map(left).collect() }
        };
        (1..=10).flat_map(|body| [of_view(body, 1), of_view(body, 2)]).collect()
    }

    /// Bodies that go a way at a speed that changes slowly.
    fn motion() -> ChainMotion {
        let times_s: Vec<f64> = (0..N).map(|i| i as f64 * INTERVAL_S).collect();
        let place =
            |(_, i): (usize, usize)| Some(Estimate::new(1e-3 * (1.0 - (-400.0 * times_s[i]).exp()), 1e-6));
        ChainMotion {
            displacement_m: Array2::from_shape_fn((10, N), place),
            independent_sigma_m: Array2::from_elem((10, N), 1e-6),
            n_trials: Array2::from_elem((10, N), 5),
            modes: ErrorModes::default(),
            times_s,
        }
    }

    #[test]
    fn noise_alone_says_nothing() {
        assert_eq!(BetweenViews::of(&seen(|_, _| 0.0), &motion(), &[0.0; 10]), None);
        assert_eq!(BetweenViews::of(&[], &motion(), &[]), None);
    }

    #[test]
    fn what_a_drive_and_a_trigger_take_up_is_missing_in_the_differences_and_not_in_their_size() {
        let moves = motion();
        let off_m = |body: usize, time_s: f64| {
            2e-6 * (std::f64::consts::TAU * time_s / (160.0 * INTERVAL_S) + body as f64).sin()
        };
        // What is left once the body's motion and its speed were fitted to all of its readings, as merging does.
        let fitted = |body: usize| {
            let columns = DMatrix::from_fn(N, 2, |i, k| {
                let place_m = |i: usize| moves.displacement_m[(body - 1, i)].unwrap().value;
                let next = (i + 1).min(N - 1);
                if k == 0 { place_m(i) } else { place_m(next) - place_m(next - 1) }
            });
            let values = DVector::from_fn(N, |i, _| off_m(body, i as f64 * INTERVAL_S));
            let amplitudes = columns.clone().svd(true, true).solve(&values, 1e-12).unwrap();
            values - columns * amplitudes
        };
        let left: Vec<DVector<f64>> = (1..=10).map(fitted).collect();
        let left_m = |body: usize, time_s: f64| left[body - 1][(time_s / INTERVAL_S).round() as usize];
        let [whole, taken_up] =
            [seen(off_m), seen(left_m)].map(|seen| BetweenViews::of(&seen, &moves, &[0.0; 10]).unwrap());
        assert!((taken_up.sigma_m / whole.sigma_m - 1.0).abs() < 0.05, "{taken_up:?} {whole:?}");
    }

    #[test]
    fn what_views_show_apart_is_told_with_its_size_and_its_pace() {
        // A wave of 160 frames a period, other in each body: alike by half within a sixth of it.
        let off_m = |body: usize, time_s: f64| {
            2e-6 * (std::f64::consts::TAU * time_s / (160.0 * INTERVAL_S) + body as f64).sin()
        };
        let told = BetweenViews::of(&seen(off_m), &motion(), &[0.0; 10]).unwrap();
        // The difference of both has the variance of the wave, of which each has half. Of the three parts or so that a correlation this long has in the
        // recording, a drive and a trigger take up nearly half of the variance; so much is taken to be missing at most.
        let expected_m = 2e-6 / 2.0_f64.sqrt() / 2.0_f64.sqrt();
        assert!((0.9..2.0_f64.sqrt()).contains(&(told.sigma_m / expected_m)), "{told:?}");
        // A wave is alike by half at a sixth of its period, and its own opposite at half of it.
        let period_s = 160.0 * INTERVAL_S;
        assert!((period_s / 6.0..period_s / 2.0).contains(&told.alike_s), "{told:?} {period_s}");
        assert_eq!(told.n_pairs, 10);
        assert!(told.finding().to_string().contains("towards the camera"));
    }

    #[test]
    fn parts_keep_the_variance_from_when_a_body_moves() {
        let told = BetweenViews { sigma_m: 1e-6, alike_s: 1e-3, n_pairs: 1, significance: 9.0 };
        let times_s: Vec<f64> = (0..N).map(|i| i as f64 * INTERVAL_S).collect();
        let track = |body: usize| BodyTrack { body, position_m: vec![Some(Estimate::new(0.0, 1e-6)); N] };
        let recording = |view: u32, trial: u32| Observation {
            recording: format!("{view}-{trial}"),
            view,
            trial,
            times_s: times_s.clone(),
            bodies: vec![track(1), track(2)],
        };
        let observations = [recording(1, 1), recording(1, 2), recording(2, 1)];
        let begins_s = [2e-3, 4e-3];
        let errors = told.errors(&observations, &begins_s);
        for (one, body) in [("1-1", 1), ("1-2", 2), ("2-1", 2)] {
            let own = || {
                errors
                    .iter()
                    .flat_map(|error| &error.of_tracks)
                    .filter(|of| of.recording == one && of.body == body)
            };
            for (i, time_s) in times_s.iter().enumerate() {
                let variance_m2: f64 = own().map(|of| of.error_m[i].powi(2)).sum();
                let expected_m2 = if *time_s < begins_s[body - 1] { 0.0 } else { 1e-12 };
                assert!(
                    (variance_m2 - expected_m2).abs() < 1e-18,
                    "{one}, body {body}, {time_s} s: {variance_m2}"
                );
            }
        }
        let shared = |error: &SharedReadingError| {
            error.of_tracks.iter().map(|of| of.recording.clone()).collect::<Vec<_>>()
        };
        assert!(errors.iter().all(|error| shared(error) == ["1-1", "1-2"] || shared(error) == ["2-1"]));
    }
}
