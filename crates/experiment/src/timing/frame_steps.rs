//! Frames that a recording lacks, or has twice, while its time stamps go on as if it had not.
//!
//! Behind such a frame every body is ahead of its time, or behind it, by the same whole number of frames; no force moves bodies by a
//! frame's way from one frame to the next. Around each frame the motion of each body is taken for a polynomial in time with a step of the time
//! behind the frame, in common for all bodies, by least squares. A step changes the velocity that it is told by, so where one stands clear
//! its size is found once more with the times put right, until that changes no more.

use std::num::NonZero;

use chainwave_measurement::{BodyTrack, Observation, map_in_parallel};
use nalgebra::{DMatrix, DVector};

/// Frames on each side of a step that tell it.
const REACH: usize = 6;
/// Of these, readings that a body needs on each side.
const LEAST_READINGS: usize = 4;
/// Coefficients of the polynomial: of fifth order, which follows a rise within eight frames to a thousandth.
const N_COEFFICIENTS: usize = 6;
/// Standard deviations from which on a step is one: of ten thousand frames and bodies, chance makes none of 6.
const CLEAR: f64 = 10.0;
/// Least step that is looked at, in frames, and how far one may be off a whole number of them, or unknown.
const LEAST: f64 = 0.4;
const OFF_WHOLE: f64 = 0.2;
/// Share of what polynomials leave over, beyond noise, that a step may leave: where motion is too fast for them, as in a tail of 3.5 frames a period,
/// a step of some frames takes away half by chance, and one of a period six sevenths; a frame that lacks leaves next to nothing.
const LARGEST_LEFT: f64 = 0.05;
/// Rounds in which its size is found.
const ROUNDS: usize = 6;
/// More steps than this are not looked for in one recording.
const MOST_STEPS: usize = 8;

/// A step of the time within a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrameStep {
    /// The last frame before it, from 0.
    pub(crate) after: usize,
    /// By how many frames later frames show the motion later than their time stamps say: frames that the recording lacks, or, below zero, that
    /// it has twice.
    pub(crate) frames: i64,
}

impl FrameStep {
    /// Whether a frame shows what was seen before.
    pub(crate) fn repeats(&self, frame: usize) -> bool {
        let n_twice = usize::try_from(-self.frames).unwrap_or(0);
        (self.after + 1..self.after + 1 + n_twice).contains(&frame)
    }

    /// What the reader should know.
    pub(crate) fn in_words(&self) -> String {
        let n = self.frames.unsigned_abs();
        let what = match (self.frames > 0, n) {
            (true, 1) => format!("a frame is missing behind frame {}", self.after),
            (true, _) => format!("{n} frames are missing behind frame {}", self.after),
            (false, 1) => format!("the frame behind frame {} shows what was seen before", self.after),
            (false, _) => format!("{n} frames behind frame {} show what was seen before", self.after),
        };
        format!(
            "{what}, though its time stamps go on: all bodies step by as much at once. Later frames count from when they were taken"
        )
    }
}

/// Puts times right; readings of frames that were seen before are left out.
pub(crate) fn put_right(observation: &mut Observation, steps: &[FrameStep]) {
    let interval_s = observation.frame_interval_s();
    for step in steps {
        let shift_s = step.frames as f64 * interval_s;
        let behind = step.after + 1;
        for time_s in observation.times_s.iter_mut().skip(behind) {
            *time_s += shift_s;
        }
        let Some(n_twice) = usize::try_from(-step.frames).ok().filter(|n| *n > 0) else { continue };
        let twice = behind..(behind + n_twice).min(observation.times_s.len());
        let last_s = observation.times_s[step.after];
        for (k, frame) in twice.clone().enumerate() {
            // Between the last time and the next one, where nothing is read.
            observation.times_s[frame] = last_s + interval_s * (k + 1) as f64 / (n_twice + 1) as f64;
            observation.bodies.iter_mut().for_each(|track| track.position_m[frame] = None);
        }
    }
}

/// The steps of each of some recordings. One that other trials of the view show at the same time is the chain's own, or the cameras'.
pub(crate) fn frame_steps(observations: &[Observation], n_threads: NonZero<usize>) -> Vec<Vec<FrameStep>> {
    let found = map_in_parallel(observations.len(), n_threads, |index| steps_of(&observations[index]));
    let is_alone = |index: usize, step: &FrameStep| {
        let own = &observations[index];
        let time_s = own.times_s[step.after];
        let near_s = REACH as f64 * own.frame_interval_s();
        observations.iter().zip(&found).enumerate().all(|(other, (observation, steps))| {
            let alike = |step: &FrameStep| (observation.times_s[step.after] - time_s).abs() < near_s;
            other == index || observation.view != own.view || !steps.iter().any(alike)
        })
    };
    (0..found.len())
        .map(|index| found[index].iter().filter(|step| is_alone(index, step)).copied().collect())
        .collect()
}

fn steps_of(observation: &Observation) -> Vec<FrameStep> {
    let mut seen = observation.clone();
    let mut steps: Vec<FrameStep> = Vec::new();
    while steps.len() < MOST_STEPS {
        let interval_s = seen.frame_interval_s();
        let clearest = (0..seen.times_s.len())
            .filter_map(|after| Some((after, Step::behind(&seen, interval_s, (after, 0.0))?)))
            .filter(|(_, step)| step.is_clear())
            .max_by(|(_, a), (_, b)| a.clarity().total_cmp(&b.clarity()));
        let whole =
            clearest.and_then(|(after, _)| Some((after, Step::whole_behind(&seen, interval_s, after)?)));
        let Some((after, frames)) = whole else { break };
        let step = FrameStep { after, frames };
        put_right(&mut seen, &[step]);
        steps.push(step);
    }
    steps
}

/// A step of time behind a frame, as all bodies have it.
struct Step {
    /// In frames.
    frames: f64,
    sigma: f64,
    /// What polynomials leave over of all bodies' motion without it, less what noise does, in units of the noise's variance.
    excess: f64,
}

impl Step {
    fn clarity(&self) -> f64 {
        self.frames.abs() / self.sigma
    }

    /// Whether it stands clear of noise.
    fn is_clear(&self) -> bool {
        self.frames.abs() > LEAST && self.clarity() > CLEAR
    }

    /// The frames of a step, where they are a whole number.
    fn whole_behind(observation: &Observation, interval_s: f64, after: usize) -> Option<i64> {
        let with = |frames: f64| Self::behind(observation, interval_s, (after, frames));
        let without = with(0.0)?;
        let mut frames = 0.0;
        for _ in 0..ROUNDS {
            frames += with(frames)?.frames.clamp(-2.0, 2.0);
        }
        let (left, whole) = (with(frames)?, frames.round());
        let is_told = left.frames.abs() < OFF_WHOLE && left.sigma < OFF_WHOLE;
        let is_whole = whole != 0.0 && (frames - whole).abs() < OFF_WHOLE.max(2.0 * left.sigma);
        let explains = left.excess < LARGEST_LEFT * without.excess;
        (is_told && is_whole && explains).then_some(whole as i64)
    }

    /// What is left of the step behind a frame where so much of it, in frames, is put right.
    fn behind(observation: &Observation, interval_s: f64, (after, right): (usize, f64)) -> Option<Self> {
        let of_body = |track| OfBody::around(observation, track, (after, right), interval_s);
        let of_bodies: Vec<OfBody> = observation.bodies.iter().filter_map(of_body).collect();
        let square: f64 = of_bodies.iter().map(|body| body.square).sum();
        if square <= 0.0 {
            return None;
        }
        let frames = of_bodies.iter().map(|body| body.across).sum::<f64>() / square;
        let variance: f64 = of_bodies.iter().map(|body| body.square * body.scatter(frames, square)).sum();
        let excess = of_bodies.iter().map(|body| body.left - body.degrees_of_freedom).sum();
        Some(Self { frames, sigma: variance.sqrt() / square, excess })
    }
}

/// What one body says of a step.
struct OfBody {
    /// Sum of the motion times what a step of a frame makes of it, both without what a polynomial follows, over the readings' variances.
    across: f64,
    /// The same of that twice.
    square: f64,
    /// The same of the motion twice.
    left: f64,
    /// Readings that the polynomial leaves over.
    degrees_of_freedom: f64,
}

impl OfBody {
    /// Variance of its readings about polynomial and step, over the stated one where it is more: what neither explains counts as noise. That is asked of
    /// each body for itself, as those at rest leave nothing. `square` is that of all bodies, which tell the step together.
    fn scatter(&self, frames: f64, square: f64) -> f64 {
        let left = self.left - 2.0 * frames * self.across + frames.powi(2) * self.square;
        (left / (self.degrees_of_freedom - self.square / square)).max(1.0)
    }

    fn around(
        observation: &Observation,
        track: &BodyTrack,
        (after, right): (usize, f64),
        interval_s: f64,
    ) -> Option<Self> {
        let first = (after + 1).checked_sub(REACH)?;
        let frames = first..(after + 1 + REACH).min(track.position_m.len());
        let origin_s = observation.times_s[after];
        // Behind the step, time in frames, position over its sigma, and the inverse of that.
        let reading = |frame: usize| {
            let read = track.position_m[frame]?;
            let is_behind = frame > after;
            let put_right = if is_behind { right } else { 0.0 };
            let time = (observation.times_s[frame] - origin_s) / interval_s - 0.5 + put_right;
            Some((is_behind, time, read.value / read.sigma, 1.0 / read.sigma))
        };
        let readings: Vec<(bool, f64, f64, f64)> = frames.filter_map(reading).collect();
        let n_behind = readings.iter().filter(|(is_behind, ..)| *is_behind).count();
        if n_behind < LEAST_READINGS || readings.len() - n_behind < LEAST_READINGS {
            return None;
        }
        let polynomial = DMatrix::from_fn(readings.len(), N_COEFFICIENTS, |row, power| {
            readings[row].3 * readings[row].1.powi(power as i32)
        });
        let normal = polynomial.tr_mul(&polynomial).cholesky()?;
        let motion = DVector::from_iterator(readings.len(), readings.iter().map(|reading| reading.2));
        let coefficients = normal.solve(&polynomial.tr_mul(&motion));
        let of_step = DVector::from_iterator(
            readings.len(),
            readings.iter().map(|(is_behind, time, _, weight)| {
                let velocity: f64 = (1..N_COEFFICIENTS)
                    .map(|power| power as f64 * coefficients[power] * time.powi(power as i32 - 1))
                    .sum();
                if *is_behind { weight * velocity } else { 0.0 }
            }),
        );
        let left_of_motion = motion - &polynomial * coefficients;
        let left_of_step = &of_step - &polynomial * normal.solve(&polynomial.tr_mul(&of_step));
        Some(Self {
            across: left_of_motion.dot(&left_of_step),
            square: left_of_step.dot(&left_of_step),
            left: left_of_motion.dot(&left_of_motion),
            degrees_of_freedom: (readings.len() - N_COEFFICIENTS) as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Estimate;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    const INTERVAL_S: f64 = 4e-5;
    const NOISE_M: f64 = 1e-6;

    /// A step of 10 mm in some thirty frames that comes to each body later.
    fn place_m(body: usize, frame: f64) -> f64 {
        5e-3 * (1.0 + ((frame - 100.0 - 15.0 * body as f64) / 10.0).tanh())
    }

    /// What is seen in each frame of a trial: the frames of the chain in the order in which they were kept.
    fn seen(trial: u32, kept: impl IntoIterator<Item = usize>) -> Observation {
        let mut random = Pcg64Mcg::seed_from_u64(u64::from(trial));
        let noise = Normal::new(0.0, NOISE_M).unwrap();
        let kept: Vec<usize> = kept.into_iter().collect();
        let mut of_body = |body: usize| {
            let mut read = |frame: &usize| {
                Some(Estimate::new(place_m(body, *frame as f64) + noise.sample(&mut random), NOISE_M))
            };
            BodyTrack { body, position_m: kept.iter().map(&mut read).collect() }
        };
        Observation {
            recording: format!("trial {trial}"),
            view: 1,
            trial,
            bodies: (1..4).map(&mut of_body).collect(),
            times_s: (0..kept.len()).map(|frame| frame as f64 * INTERVAL_S).collect(),
        }
    }

    fn steps_on_a_thread(observations: &[Observation]) -> Vec<Vec<FrameStep>> {
        frame_steps(observations, NonZero::<usize>::MIN)
    }

    #[test]
    fn frames_that_lack_and_frames_that_come_twice_are_found_and_put_right() {
        let lacking = || (0..300).filter(|frame| !(131..133).contains(frame));
        let twice = || (0..300).map(|frame| if frame > 120 { frame - 1 } else { frame });
        let all = [seen(1, 0..300), seen(2, lacking()), seen(3, twice()), seen(4, 0..300)];
        let steps = steps_on_a_thread(&all);
        let step = |after, frames| vec![FrameStep { after, frames }];
        assert_eq!(steps, [Vec::new(), step(130, 2), step(120, -1), Vec::new()]);
        for (observation, steps) in all.iter().zip(&steps) {
            let mut right = observation.clone();
            put_right(&mut right, steps);
            assert!(right.times_s.windows(2).all(|pair| pair[1] > pair[0]));
            for track in &right.bodies {
                for (time_s, read) in right.times_s.iter().zip(&track.position_m) {
                    let Some(read) = read else { continue };
                    // Six standard deviations of some three thousand readings.
                    assert!((read.value - place_m(track.body, time_s / INTERVAL_S)).abs() < 6.0 * NOISE_M);
                }
            }
        }
        assert!(steps[1][0].in_words().contains("2 frames are missing behind frame 130"));
    }

    /// Fifty bodies, of which three move from frame 120 on, struck by what is much heavier; noise of 6 um, as pictures of a millimetre a pixel have it.
    fn struck(late: f64) -> Observation {
        const NOISE_M: f64 = 6e-6;
        let mut random = Pcg64Mcg::seed_from_u64(late.to_bits());
        let noise = Normal::new(0.0, NOISE_M).unwrap();
        let mut of_body = |body: usize| {
            let smooth = 0.5 * (body - 1) as f64;
            let way_m = |frame: i32| {
                let since = (f64::from(frame) - 120.0 - late - smooth).max(0.0);
                12e-3 * (1.0 - (-since * since / (since + smooth + 1e-9) / 10.0).exp())
            };
            let mut read = |frame: i32| {
                let moved_m = if body <= 3 { way_m(frame) } else { 0.0 };
                Some(Estimate::new(moved_m + noise.sample(&mut random), NOISE_M))
            };
            BodyTrack { body, position_m: (0..300).map(&mut read).collect() }
        };
        Observation { bodies: (1..=50).map(&mut of_body).collect(), ..seen(1, 0..300) }
    }

    #[test]
    fn what_is_no_step_of_time_is_none() {
        // A place lost to another marker in one body; a jolt that every trial shows.
        let mut jumps = seen(1, 0..300);
        jumps.bodies[1].position_m[140..].iter_mut().flatten().for_each(|read| read.value += 4e-4);
        assert_eq!(steps_on_a_thread(&[jumps]), [Vec::new()]);
        let jolted = || (0..300).filter(|frame| *frame != 125);
        assert_eq!(steps_on_a_thread(&[seen(1, jolted()), seen(2, jolted())]), [Vec::new(), Vec::new()]);
        // An impact within a frame, wherever it comes between two of them.
        for late in 0..40 {
            let struck = struck(0.025 * f64::from(late));
            assert_eq!(steps_on_a_thread(&[struck]), [Vec::new()], "{late}");
        }
        // A pulse that four frames follow.
        assert_eq!(steps_on_a_thread(&[seen(1, (0..300).step_by(8))]), [Vec::new()]);
    }

    /// Fifty bodies whose tails have few frames a period, each period a little longer than the one before, as a front leaves them: too fast for
    /// polynomials over a dozen frames, which leave over what a step would explain in part.
    #[test]
    fn a_tail_that_polynomials_do_not_follow_has_no_steps() {
        let of_trial = |trial: u32| {
            let mut random = Pcg64Mcg::seed_from_u64(u64::from(trial));
            let noise = Normal::new(0.0, 5e-6).unwrap();
            let phase = 0.37 * f64::from(trial);
            let mut of_body = |body: usize| {
                let mut read = |frame: usize| {
                    let since = (frame as f64 + phase - 60.0 - 1.2 * body as f64).max(0.0);
                    let tail_m = 3e-4 * (1.0 - (-since / 8.0).exp()) * (1.9 * since.powf(0.97)).sin();
                    let front_m = 4e-3 * (1.0 - (-(since / 6.0).powi(2)).exp());
                    Some(Estimate::new(front_m + tail_m + noise.sample(&mut random), 5e-6))
                };
                BodyTrack { body, position_m: (0..400).map(&mut read).collect() }
            };
            Observation {
                recording: format!("trial {trial}"),
                view: trial,
                trial: 1,
                times_s: (0..400).map(|frame| 5e-4 * f64::from(frame)).collect(),
                bodies: (0..50).map(&mut of_body).collect(),
            }
        };
        let trials: Vec<Observation> = (0..12).map(of_trial).collect();
        assert!(steps_on_a_thread(&trials).iter().all(Vec::is_empty));
    }
}
