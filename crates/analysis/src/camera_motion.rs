//! Whether the camera moves, told by bodies that the wave has not reached: they rest, and what they do together the camera does.
//!
//! In one recording, body b at rest is read in frame f at o_b + d_f + noise, with its place o_b and the camera's motion d_f. Both are
//! fitted by weighted least squares over all frames that show two such bodies or more (a two-way layout without interaction). Whether
//! there is any d_f is asked by comparing what it explains with what it leaves, which is what bodies of one frame differ by: Fisher's
//! ratio of variances, so that a stated uncertainty that is a few per cent off is no motion of the camera. The noise of bodies is
//! independent; patterns on the sensor are too, and do not change while a body rests.
//!
//! Where fewer than two bodies rest, the camera's motion is not known. There its variance counts as an uncertainty: what trials do not
//! share adds to that of each reading, what they share (a motion that the strike sets off) is one error of all. A slow swing goes on to grow where
//! nobody sees it: as its square grew with time while it was known, so it is taken to go on.

use std::collections::BTreeMap;

use chainwave_measurement::{BodyTrack, Estimate, Observation};

use crate::departure::Departure;
use crate::probability::variance_ratio_beyond;
use crate::rule::Rule;

/// The camera's motion along the chain, in every recording.
#[derive(Debug, Clone)]
pub struct CameraMotion {
    /// Of a camera that stands still; its size is the root mean square of the motion after the trigger, from its mean before,
    /// in metres.
    pub departure: Departure,
    /// Root mean square of the part that all trials share, in metres: the strike sets it off.
    pub shared_m: f64,
    /// Frames in which it is known, and all frames.
    pub n_known: [usize; 2],
    growth: Growth,
    recordings: Vec<RecordingShift>,
}

/// How the motion's root mean square goes with the time: as a power of that since the middle of the rest from which it counts.
#[derive(Debug, Clone, Copy)]
struct Growth {
    /// Of the square: 0 of a shake, 1 of a walk at random, 2 of a drift.
    exponent: f64,
    /// Middle of the rest, in seconds after the trigger.
    origin_s: f64,
    /// Time since then at which it is what it is in all.
    usual_s: f64,
}

impl Growth {
    const NONE: Self = Self { exponent: 0.0, origin_s: 0.0, usual_s: 1.0 };

    /// From motions that are known, at their times after the trigger: those of the first half of the time after it against those of the second.
    fn of(known: &[(f64, Estimate)]) -> Self {
        let before: Vec<f64> =
            known.iter().map(|(time_s, _)| *time_s).filter(|time_s| *time_s < 0.0).collect();
        let origin_s = before.iter().sum::<f64>() / before.len().max(1) as f64;
        let last_s = known.iter().map(|(time_s, _)| *time_s).fold(0.0, f64::max);
        // Mean time since the middle of the rest, and mean square of the motion.
        let half = |from_s: f64, until_s: f64| {
            let inside = known.iter().filter(|(time_s, _)| (from_s..=until_s).contains(time_s));
            let sums = inside.fold([0.0; 3], |[n, since_s, square], (time_s, d)| {
                [n + 1.0, since_s + time_s - origin_s, square + d.value.powi(2) - d.sigma.powi(2)]
            });
            (sums[0] > 0.0).then(|| [sums[1] / sums[0], sums[2] / sums[0]])
        };
        let (Some([first_s, first]), Some([second_s, second])) =
            (half(0.0, 0.5 * last_s), half(0.5 * last_s, last_s))
        else {
            return Self::NONE;
        };
        if second <= 0.0 || first_s <= 0.0 {
            return Self::NONE;
        }
        let exponent = (second / first.max(f64::MIN_POSITIVE)).ln() / (second_s / first_s).ln();
        let exponent = exponent.clamp(0.0, MOST_GROWTH);
        if exponent <= 0.0 {
            return Self::NONE;
        }
        let later = || known.iter().map(|(time_s, _)| *time_s).filter(|time_s| *time_s >= 0.0);
        let powers = later().map(|time_s| (time_s - origin_s).powf(exponent));
        let mean = powers.sum::<f64>() / later().count() as f64;
        Self { exponent, origin_s, usual_s: mean.powf(exponent.recip()) }
    }

    /// The root mean square at a time after the trigger, over that in all.
    fn at(&self, time_s: f64) -> f64 {
        ((time_s - self.origin_s).max(0.0) / self.usual_s).powf(0.5 * self.exponent)
    }
}

/// A camera that moves steadily.
const MOST_GROWTH: f64 = 2.0;

/// The camera's motion in one recording.
#[derive(Debug, Clone)]
struct RecordingShift {
    recording: String,
    times_s: Vec<f64>,
    /// Frame by frame, in metres from the mean before the trigger, as displacements are; `None` where fewer than two bodies are known to rest.
    motion_m: Vec<Option<Estimate>>,
    /// Chi squared of the readings about their bodies' places alone, and with the camera's motion as well.
    chi_squared: [f64; 2],
    /// Degrees of freedom of the motion, and of what it leaves.
    degrees_of_freedom: [usize; 2],
}

/// A reading of a body that rests: number of the body in the recording, frame, place.
type RestReading = (usize, usize, Estimate);

/// Level of the test: three coordinates are asked of each experiment, and a motion that it lets pass, of a tenth of a reading's sigma, adds
/// nothing to the motion's.
const CAMERA_LEVEL: f64 = 1e-3;
/// Bodies that differ by less than this of the variance that is stated are read in pictures without noise, where that stands.
const WITHOUT_NOISE: f64 = 0.25;

/// The rule by which the camera counts as moving.
pub fn camera_motion_rule() -> Rule {
    Rule {
        question: "motion of the camera",
        text: format!(
            "none unless bodies that the wave has not reached move together by more than they differ (Fisher's ratio of variances, \
             {} % level)",
            100.0 * CAMERA_LEVEL
        ),
        level: Some(CAMERA_LEVEL),
        rates: Vec::new(),
    }
}

/// Follows the camera's motion. `rests_until_s` says for body 1, 2, ... until when it certainly rests, in seconds after the trigger.
/// `None` where no recording shows two such bodies at once for long enough.
pub fn camera_motion(observations: &[Observation], rests_until_s: &[f64]) -> Option<CameraMotion> {
    let recordings: Vec<RecordingShift> =
        observations.iter().map(|one| RecordingShift::of(one, rests_until_s)).collect();
    let sum = |of: fn(&RecordingShift) -> f64| recordings.iter().map(of).sum::<f64>();
    let [of_motion, left] =
        [sum(|one| one.chi_squared[0] - one.chi_squared[1]), sum(|one| one.chi_squared[1])];
    let [n_motion, n_left] =
        [0, 1].map(|which| recordings.iter().map(|one| one.degrees_of_freedom[which]).sum::<usize>());
    if n_motion == 0 || n_left == 0 {
        return None;
    }
    let left = left / n_left as f64;
    let ratio = of_motion / n_motion as f64 / if left > WITHOUT_NOISE { left } else { 1.0 };
    let p_value = variance_ratio_beyond(ratio, n_motion as f64, n_left as f64);
    let known: Vec<(f64, Estimate)> = recordings.iter().flat_map(RecordingShift::known).collect();
    let later: Vec<Estimate> = known.iter().filter(|(time_s, _)| *time_s >= 0.0).map(|(_, d)| *d).collect();
    let counted = if later.is_empty() { known.iter().map(|(_, d)| *d).collect() } else { later };
    let n = counted.len() as f64;
    let square = counted.iter().map(|d| d.value.powi(2)).sum::<f64>() / n;
    let noise = counted.iter().map(|d| d.sigma.powi(2)).sum::<f64>() / n;
    let size = (square - noise).max(0.0).sqrt();
    // The standard error of a variance from n values, over twice the deviation.
    let error = 0.5 * square * (2.0 / n).sqrt();
    let size = Estimate::new(size, error / size.max(error.sqrt()));
    let n_known = [known.len(), recordings.iter().map(|one| one.times_s.len()).sum()];
    let departure = Departure { size, chi_squared: of_motion, degrees_of_freedom: n_motion, p_value };
    let growth = Growth::of(&known);
    Some(CameraMotion { departure, shared_m: shared_m(&recordings), n_known, growth, recordings })
}

impl CameraMotion {
    /// Takes the motion out of positions along the chain, with its uncertainty; where it is not known, its deviation that trials do not
    /// share joins the uncertainty. Within a frame the uncertainty counts as independent from body to body, which it is not: differences
    /// of bodies are known better than that.
    pub fn taken_out_of(&self, observations: &[Observation]) -> Vec<Observation> {
        let own_m = (self.departure.size.value.powi(2) - self.shared_m.powi(2)).max(0.0).sqrt();
        let steadied = |observation: &Observation| match self.of(&observation.recording) {
            Some(followed) => followed.taken_out_of(observation, |time_s| own_m * self.growth.at(time_s)),
            None => observation.clone(),
        };
        observations.iter().map(steadied).collect()
    }

    /// Root mean square of the motion at a time after the trigger at which it is not known, over that of all that is known.
    pub fn growth(&self, time_s: f64) -> f64 {
        self.growth.at(time_s)
    }

    /// Whether the motion is known at a time after the trigger in a recording, which then shows two bodies at rest.
    pub fn is_known(&self, recording: &str, time_s: f64) -> bool {
        self.of(recording).is_some_and(|followed| {
            let frame = followed.times_s.partition_point(|stamp_s| *stamp_s < time_s);
            followed.motion_m.get(frame).is_some_and(Option::is_some)
        })
    }

    /// The motion in each recording: its name and, frame by frame, the time after the trigger in seconds and the motion along the chain in
    /// metres from its mean before the trigger; `None` where fewer than two bodies are known to rest.
    pub fn of_recordings(&self) -> impl Iterator<Item = (&str, Vec<(f64, Option<Estimate>)>)> {
        let samples =
            |one: &RecordingShift| one.times_s.iter().copied().zip(one.motion_m.iter().copied()).collect();
        self.recordings.iter().map(move |one| (one.recording.as_str(), samples(one)))
    }

    fn of(&self, recording: &str) -> Option<&RecordingShift> {
        self.recordings.iter().find(|followed| followed.recording == recording)
    }
}

impl RecordingShift {
    fn of(observation: &Observation, rests_until_s: &[f64]) -> Self {
        let at_rest = at_rest(observation, rests_until_s);
        let (n_bodies, n_frames) = (observation.bodies.len(), observation.times_s.len());
        let (places, _) = layout(&at_rest, [n_bodies, n_frames], false);
        let without = chi_squared(&at_rest, &places, &vec![0.0; n_frames]);
        let (places, motion_m) = layout(&at_rest, [n_bodies, n_frames], true);
        let with = chi_squared(&at_rest, &places, &motion_m);
        let mut weights = vec![0.0; n_frames];
        at_rest.iter().for_each(|(_, frame, x)| weights[*frame] += x.sigma.powi(-2));
        let n_shown = weights.iter().filter(|weight| **weight > 0.0).count();
        let n_at_rest = (0..n_bodies).filter(|body| at_rest.iter().any(|reading| reading.0 == *body)).count();
        let is_before = |frame: &usize| weights[*frame] > 0.0 && observation.times_s[*frame] < 0.0;
        let before_m: Vec<f64> = (0..n_frames).filter(is_before).map(|frame| motion_m[frame]).collect();
        let origin_m = before_m.iter().sum::<f64>() / before_m.len().max(1) as f64;
        let known = |(weight, d): (&f64, &f64)| {
            (*weight > 0.0).then(|| Estimate::new(*d - origin_m, weight.sqrt().recip()))
        };
        Self {
            recording: observation.recording.clone(),
            times_s: observation.times_s.clone(),
            motion_m: weights.iter().zip(&motion_m).map(known).collect(),
            chi_squared: [without, with],
            degrees_of_freedom: [
                n_shown.saturating_sub(1),
                (at_rest.len() + 1).saturating_sub(n_shown + n_at_rest),
            ],
        }
    }

    /// Times and motions of the frames in which it is known.
    fn known(&self) -> impl Iterator<Item = (f64, Estimate)> + '_ {
        self.times_s.iter().zip(&self.motion_m).filter_map(|(time_s, d)| Some((*time_s, (*d)?)))
    }

    fn taken_out_of(&self, observation: &Observation, own_m: impl Fn(f64) -> f64) -> Observation {
        let place = |((x, d), time_s): ((&Option<Estimate>, &Option<Estimate>), &f64)| {
            let x = (*x)?;
            Some(match d {
                Some(d) => Estimate::new(x.value - d.value, x.sigma.hypot(d.sigma)),
                None => Estimate::new(x.value, x.sigma.hypot(own_m(*time_s))),
            })
        };
        let of_body = |track: &BodyTrack| BodyTrack {
            body: track.body,
            position_m: track.position_m.iter().zip(&self.motion_m).zip(&self.times_s).map(place).collect(),
        };
        Observation { bodies: observation.bodies.iter().map(of_body).collect(), ..observation.clone() }
    }
}

/// The readings of bodies that rest, in frames that show two of them or more.
fn at_rest(observation: &Observation, rests_until_s: &[f64]) -> Vec<RestReading> {
    let mut readings = Vec::new();
    for (frame, time_s) in observation.times_s.iter().enumerate() {
        let rests =
            |track: &BodyTrack| rests_until_s.get(track.body - 1).is_some_and(|until_s| time_s < until_s);
        let bodies = observation.bodies.iter().enumerate().filter(|(_, track)| rests(track));
        let shown: Vec<RestReading> = bodies
            .filter_map(|(body, track)| Some((body, frame, (*track.position_m.get(frame)?)?)))
            .collect();
        if shown.len() > 1 {
            readings.extend(shown);
        }
    }
    readings
}

/// Rounds of the fit of a layout: each leaves the share of bodies that do not rest all the time of what the one before left.
const ROUNDS: usize = 50;

/// The bodies' places and the camera's motion that explain readings best, but for a length that both have in common; no motion where it is
/// not asked for.
fn layout(readings: &[RestReading], [n_bodies, n_frames]: [usize; 2], moves: bool) -> (Vec<f64>, Vec<f64>) {
    let (mut places, mut motion_m) = (vec![0.0; n_bodies], vec![0.0; n_frames]);
    for _ in 0..if moves { ROUNDS } else { 1 } {
        places = means(readings, n_bodies, |(body, frame, x)| (*body, x.value - motion_m[*frame]));
        if moves {
            motion_m = means(readings, n_frames, |(body, frame, x)| (*frame, x.value - places[*body]));
        }
    }
    (places, motion_m)
}

/// Weighted means of what readings say of each of `n` unknowns.
fn means(readings: &[RestReading], n: usize, told: impl Fn(&RestReading) -> (usize, f64)) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; n];
    for reading in readings {
        let (unknown, value) = told(reading);
        let weight = reading.2.sigma.powi(-2);
        sums[unknown][0] += weight * value;
        sums[unknown][1] += weight;
    }
    sums.into_iter().map(|[sum, weight]| if weight > 0.0 { sum / weight } else { 0.0 }).collect()
}

fn chi_squared(readings: &[RestReading], places: &[f64], motion_m: &[f64]) -> f64 {
    let square =
        |(body, frame, x): &RestReading| ((x.value - places[*body] - motion_m[*frame]) / x.sigma).powi(2);
    readings.iter().map(square).sum()
}

/// Root mean square of what recordings share after the trigger, from products of different recordings at one time.
fn shared_m(recordings: &[RecordingShift]) -> f64 {
    let later = |one: &RecordingShift| -> Vec<(f64, f64)> {
        one.known().filter(|(time_s, _)| *time_s > 0.0).map(|(time_s, d)| (time_s, d.value)).collect()
    };
    let of_each: Vec<Vec<(f64, f64)>> = recordings.iter().map(later).collect();
    let interval_s = of_each.iter().find_map(|one| Some(one.get(1)?.0 - one.first()?.0)).unwrap_or(1.0);
    let time = |(time_s, _): &(f64, f64)| (time_s / interval_s).round() as i64;
    // Recordings, the sum of their motions, and that of their squares.
    let mut by_time: BTreeMap<i64, [f64; 3]> = BTreeMap::new();
    for one in &of_each {
        // A recording counts once at a time, however many frames of its own fall there.
        for together in one.chunk_by(|a, b| time(a) == time(b)) {
            let d = together.iter().map(|(_, d)| d).sum::<f64>() / together.len() as f64;
            let [n, sum, squares] = by_time.entry(time(&together[0])).or_default();
            (*n, *sum, *squares) = (*n + 1.0, *sum + d, *squares + d * d);
        }
    }
    let products: f64 = by_time.values().map(|[_, sum, squares]| sum * sum - squares).sum();
    let pairs: f64 = by_time.values().map(|[n, ..]| n * (n - 1.0)).sum();
    if pairs > 0.0 { (products / pairs).max(0.0).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;

    const NOISE_M: f64 = 1e-6;
    const RESTS_UNTIL_S: [f64; 4] = [0.0, 1e-3, 2e-3, 3e-3];

    /// Three recordings of four bodies, which move away one after the other; the camera swings by `swing_m`, from the trigger on or, with a
    /// phase of each recording's own, all the time.
    fn recordings(random: &mut Pcg64, swing_m: f64, is_set_off: bool) -> Vec<Observation> {
        let times_s: Vec<f64> = (-40..120).map(|frame| f64::from(frame) * 4e-5).collect();
        let mut noise = || -> f64 { StandardNormal.sample(random) };
        let mut recording = |trial: u32| {
            let phase = if is_set_off { 0.0 } else { 2.0 * f64::from(trial) };
            let camera_m = |time_s: f64| {
                let swings = !is_set_off || time_s >= 0.0;
                if swings { swing_m * (12570.0 * time_s + phase).sin() } else { 0.0 }
            };
            let mut body = |body: usize| {
                let moved_m = |time_s: f64| 2.0 * (time_s - RESTS_UNTIL_S[body - 1]).max(0.0);
                let place = |time_s: &f64| {
                    let place_m = 0.03 * body as f64 + moved_m(*time_s) + camera_m(*time_s);
                    Some(Estimate::new(place_m + NOISE_M * noise(), 1.1 * NOISE_M))
                };
                BodyTrack { body, position_m: times_s.iter().map(place).collect() }
            };
            let bodies = (1..5).map(&mut body).collect();
            Observation { recording: trial.to_string(), view: 1, trial, times_s: times_s.clone(), bodies }
        };
        (1..4).map(&mut recording).collect()
    }

    #[test]
    fn a_camera_that_stands_still_is_seldom_said_to_move() {
        let mut random = Pcg64::seed_from_u64(3);
        let p = |found: Option<CameraMotion>| found.unwrap().departure.p_value;
        let n_false = (0..400)
            .filter(|_| p(camera_motion(&recordings(&mut random, 0.0, false), &RESTS_UNTIL_S)) < 0.05)
            .count();
        // 5 % of 400 is 20 +- 4.4: four standard errors. The stated sigma, 10 % too large, does not matter.
        assert!((3..=37).contains(&n_false), "{n_false} of 400");
    }

    #[test]
    fn its_motion_is_taken_out_where_bodies_rest_and_stated_where_none_does() {
        let mut random = Pcg64::seed_from_u64(4);
        for is_set_off in [false, true] {
            let shaken = recordings(&mut random, 5.0 * NOISE_M, is_set_off);
            let found = camera_motion(&shaken, &RESTS_UNTIL_S).unwrap();
            assert!(found.departure.p_value < 1e-9, "{found:?}");
            let steadied = found.taken_out_of(&shaken);
            let last = &steadied[0].bodies[3].position_m;
            let rests = |frame: &usize| shaken[0].times_s[*frame] < RESTS_UNTIL_S[2];
            let (n, squares) = (0..last.len()).filter(rests).fold((0.0, 0.0), |(n, squares), frame| {
                (n + 1.0, squares + (last[frame].unwrap().value - last[0].unwrap().value).powi(2))
            });
            // Twice the noise's variance, as the first frame has it too, 90 frames and that of a mean of bodies: far below a swing's 12.
            assert!(squares / n < 5.0 * NOISE_M.powi(2), "{}", squares / n);
            let unknown = last.last().unwrap().unwrap().sigma;
            let own_m = (found.departure.size.value.powi(2) - found.shared_m.powi(2)).max(0.0).sqrt();
            let grown_m = own_m * found.growth(shaken[0].times_s[119]);
            assert!((unknown - grown_m.hypot(1.1 * NOISE_M)).abs() < 1e-12);
            // A shake of eight periods does not grow, but by what phases make of half of that.
            assert!(found.growth(shaken[0].times_s[119]) < 1.5, "{:?}", found.growth);
            // A sine's deviation is 3.5; recordings whose phases are 2 apart share none of it.
            let shared = found.shared_m / NOISE_M;
            assert!(if is_set_off { (2.5..5.0).contains(&shared) } else { shared < 1.5 }, "{shared}");
            assert!(found.is_known("1", 1e-3) && !found.is_known("1", 2.5e-3));
        }
    }

    #[test]
    fn a_slow_swing_goes_on_to_grow_where_nobody_sees_it() {
        let mut random = Pcg64::seed_from_u64(6);
        let still = recordings(&mut random, 0.0, false);
        let rates = [0.9, -1.2, 0.7];
        let drifting = |(observation, rate): (&Observation, &f64)| {
            let mut moved = observation.clone();
            for track in &mut moved.bodies {
                for (x, time_s) in track.position_m.iter_mut().zip(&observation.times_s) {
                    *x = x.map(|x| Estimate::new(x.value + 5e-3 * rate * time_s, x.sigma));
                }
            }
            moved
        };
        let found =
            camera_motion(&still.iter().zip(&rates).map(drifting).collect::<Vec<_>>(), &RESTS_UNTIL_S)
                .unwrap();
        let rms = (rates.iter().map(|rate| rate * rate).sum::<f64>() / 3.0).sqrt();
        for time_s in [2.5e-3, 4.7e-3] {
            // Places count from the mean of the 1.6 ms before the trigger.
            let drifted_m = 5e-3 * rms * (time_s + 0.8e-3);
            let ratio = found.departure.size.value * found.growth(time_s) / drifted_m;
            // Some hundred noises of a tenth of the drift leave its power within a few per cent.
            assert!((ratio - 1.0).abs() < 0.15, "{ratio} at {time_s} s, {:?}", found.growth);
        }
    }

    #[test]
    fn without_two_bodies_at_rest_nothing_is_told() {
        let mut random = Pcg64::seed_from_u64(5);
        assert!(camera_motion(&recordings(&mut random, 0.0, false), &[-1.0, -1.0, -1.0, 3e-3]).is_none());
        assert!(camera_motion(&[], &RESTS_UNTIL_S).is_none());
    }
}
