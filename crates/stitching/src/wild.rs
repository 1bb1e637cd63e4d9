//! Readings that are far from those before and after them, as trackers make where they jump to another mark for a few frames.

use std::collections::BTreeMap;
use std::ops::Range;

use chainwave_measurement::{BodyTrack, Observation, median, robust_sigma_about_zero};

/// A reading that was taken out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WildReading {
    /// Place of its recording among the observations.
    pub index: usize,
    /// Number of the body.
    pub body: usize,
    /// When, in seconds of the recording.
    pub time_s: f64,
    /// How far it is from a cubic through the two readings before it and the two behind, in metres.
    pub off_m: f64,
}

/// A reading is wild beyond so many deviations of its track from such cubics, and stated ones: none of 10^12 with normal errors...
const SIGMAS: f64 = 8.0;
/// ...and beyond so many times what its neighbours are off without it: of a motion that its samples hardly follow, be it a jump from one to
/// the next, neighbours are off by half as much or more.
const TIMES_NEIGHBOURS: f64 = 5.0;
/// What comes at the same time in half of the other recordings, to so many frames, is motion.
const SAME_FRAMES: f64 = 3.0;
/// Frames that a wave takes from body to body at most where its pulses are so short that they could be wild readings.
const WAVE_FRAMES: f64 = 12.0;
/// Fewer readings tell no deviations.
const LEAST_READINGS: usize = 20;
/// The longest stretch of readings that is told from motion.
const LONGEST: usize = 8;
/// Readings on each side by which the rounding of numbers is told: it is coarser for larger ones where a file has so many digits of each.
const ROUNDED_ALIKE: usize = 20;
/// Readings on each side that a cubic goes through.
const BESIDE: usize = 2;

/// Takes out readings that stand alone, up to eight in a row: far from what the readings before and after them lead to, while those agree with
/// one another, and not at the same time in half of the other recordings.
pub fn take_out_wild(observations: &mut [Observation]) -> Vec<WildReading> {
    let suspects: Vec<WildReading> = observations
        .iter()
        .enumerate()
        .flat_map(|(index, one)| one.bodies.iter().flat_map(move |track| wild_of(index, one, track)))
        .collect();
    let tracks = SuspectTimes::of(observations, &suspects);
    let wild: Vec<WildReading> = suspects
        .into_iter()
        .filter(|one| tracks.has_alone(one, observations[one.index].frame_interval_s()))
        .collect();
    for one in &wild {
        let observation = &mut observations[one.index];
        let frame = observation.times_s.partition_point(|time_s| *time_s < one.time_s);
        let track = observation.bodies.iter_mut().find(|track| track.body == one.body);
        if let Some(reading) = track.and_then(|track| track.position_m.get_mut(frame)) {
            *reading = None;
        }
    }
    wild
}

/// When each track seems to have wild readings, in seconds, by its recording's place and its body.
struct SuspectTimes {
    n_recordings: usize,
    times_s: BTreeMap<(usize, usize), Vec<f64>>,
}

impl SuspectTimes {
    fn of(observations: &[Observation], suspects: &[WildReading]) -> Self {
        let tracks = observations
            .iter()
            .enumerate()
            .flat_map(|(index, one)| one.bodies.iter().map(move |track| ((index, track.body), Vec::new())));
        let mut times_s: BTreeMap<(usize, usize), Vec<f64>> = tracks.collect();
        for one in suspects {
            times_s.entry((one.index, one.body)).or_default().push(one.time_s);
        }
        Self { n_recordings: observations.len(), times_s }
    }

    /// Whether fewer than half of the other recordings of its body show a suspect's like at the same time. Where no other one sees the body,
    /// its neighbours tell: a wave reaches them a little earlier or later.
    fn has_alone(&self, one: &WildReading, frame_s: f64) -> bool {
        let others = (0..self.n_recordings).filter(|index| *index != one.index);
        let elsewhere: Vec<&Vec<f64>> =
            others.filter_map(|index| self.times_s.get(&(index, one.body))).collect();
        let beside =
            [one.body.wrapping_sub(1), one.body + 1].map(|body| self.times_s.get(&(one.index, body)));
        let (tracks, near_s) = match elsewhere.is_empty() {
            true => (beside.into_iter().flatten().collect(), WAVE_FRAMES * frame_s),
            false => (elsewhere, SAME_FRAMES * frame_s),
        };
        let is_there_too =
            |times_s: &&&Vec<f64>| times_s.iter().any(|time_s| (time_s - one.time_s).abs() <= near_s);
        let n_alike = tracks.iter().filter(is_there_too).count();
        n_alike == 0 || 2 * n_alike < tracks.len()
    }
}

/// The readings of a track that stand alone, or with a few others: first single ones, then longer and longer stretches.
fn wild_of(index: usize, observation: &Observation, track: &BodyTrack) -> Vec<WildReading> {
    let readings = observation.times_s.iter().zip(&track.position_m);
    let present = readings.filter_map(|(time_s, reading)| Some((*time_s, (*reading)?)));
    let (mut seen, stated): (Vec<[f64; 2]>, Vec<f64>) =
        present.map(|(time_s, reading)| ([time_s, reading.value], reading.sigma)).unzip();
    let mut wild = Vec::new();
    if seen.len() < LEAST_READINGS {
        return wild;
    }
    let off = (0..seen.len()).filter_map(|at| off_m(&seen, at, &(at..at + 1)));
    let (Some(sigma_m), Some(stated_m)) = (robust_sigma_about_zero(off), median(stated)) else { return wild };
    let sigma_m = sigma_m.max(stated_m);
    for length in 1..=LONGEST {
        let mut first = 0;
        while first + length <= seen.len() {
            let stretch = first..first + length;
            if stands_alone(&seen, &stretch, sigma_m) {
                let off_m = |at: usize| off_m(&seen, at, &stretch).unwrap_or(0.0);
                wild.extend(stretch.clone().map(|at| WildReading {
                    index,
                    body: track.body,
                    time_s: seen[at][0],
                    off_m: off_m(at),
                }));
                seen.drain(stretch);
            } else {
                first += 1;
            }
        }
    }
    wild
}

/// Whether both ends of a stretch of readings are far from what those before and behind lead to, which agree with one another.
fn stands_alone(seen: &[[f64; 2]], stretch: &Range<usize>, sigma_m: f64) -> bool {
    let far = |at: usize| off_m(seen, at, stretch).map_or(0.0, f64::abs);
    let off_m_there = far(stretch.start).min(far(stretch.end - 1));
    if off_m_there <= SIGMAS * sigma_m {
        return false;
    }
    let around = stretch.start.saturating_sub(ROUNDED_ALIKE)..(stretch.end + ROUNDED_ALIKE).min(seen.len());
    if off_m_there <= SIGMAS * quantum_m(&seen[around]) {
        return false;
    }
    let before = stretch.start.saturating_sub(BESIDE)..stretch.start;
    let behind = stretch.end..(stretch.end + BESIDE).min(seen.len());
    let beside = before.chain(behind).filter_map(|near| off_m(seen, near, stretch));
    off_m_there > TIMES_NEIGHBOURS * beside.fold(0.0_f64, |most, off| most.max(off.abs()))
}

/// How far a reading is from the cubic through the two before it and the two behind, but for a stretch that is left out; `None` at the ends.
fn off_m(seen: &[[f64; 2]], at: usize, left_out: &Range<usize>) -> Option<f64> {
    let before = (0..at).rev().filter(|near| !left_out.contains(near)).take(BESIDE);
    let behind = (at + 1..seen.len()).filter(|near| !left_out.contains(near)).take(BESIDE);
    let mut nodes = [[0.0; 2]; 2 * BESIDE];
    let n_nodes = nodes.iter_mut().zip(before.chain(behind)).map(|(node, near)| *node = seen[near]).count();
    let [time_s, value_m] = seen[at];
    let weight = |own: usize| {
        let others = nodes.iter().enumerate().filter(|(other, _)| *other != own);
        others.map(|(_, [t, _])| (time_s - t) / (nodes[own][0] - t)).product::<f64>()
    };
    let expected_m = nodes.iter().enumerate().map(|(own, [_, x])| weight(own) * x).sum::<f64>();
    (n_nodes == 2 * BESIDE).then_some(value_m - expected_m)
}

/// The least difference between neighbouring readings that differ: numbers may be rounded to it. Infinite where none differ.
fn quantum_m(seen: &[[f64; 2]]) -> f64 {
    let steps = seen.windows(2).map(|pair| (pair[1][1] - pair[0][1]).abs()).filter(|step| *step > 0.0);
    steps.fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chainwave_measurement::Estimate;

    /// Bodies that follow one another by half a frame, with errors of 1 um (rms).
    fn film(trial: u32) -> Observation {
        let times_s: Vec<f64> = (0..120).map(|frame| 1e-4 * f64::from(frame)).collect();
        let mut seed = u64::from(trial) + 1;
        let mut noise_m = || {
            let uniform: f64 = (0..12).map(|_| uniform(&mut seed)).sum();
            1e-6 * (uniform - 6.0)
        };
        let bodies = (1..=3).map(|body| {
            let front_s = 5e-3 + 5e-5 * f64::from(body);
            let place = |time_s: &f64| 4e-4 * (1.0 + ((time_s - front_s) / 2e-4).tanh());
            let position_m = times_s.iter().map(|t| Some(Estimate::new(place(t) + noise_m(), 0.0))).collect();
            BodyTrack { body: body as usize, position_m }
        });
        let bodies = bodies.collect();
        Observation { recording: format!("trial {trial}"), view: 1, trial, times_s, bodies }
    }

    /// Of a linear congruential generator (D. E. Knuth's MMIX), in [0, 1).
    fn uniform(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn shift(observation: &mut Observation, body: usize, frame: usize, by_m: f64) {
        let reading = observation.bodies[body - 1].position_m[frame].as_mut().unwrap();
        reading.value += by_m;
    }

    #[test]
    fn a_reading_that_stands_alone_is_taken_out_and_no_other() {
        let mut films: Vec<Observation> = (1..=4).map(film).collect();
        let whole = films.clone();
        assert_eq!(take_out_wild(&mut films), []);
        assert_eq!(films, whole);
        // At rest, on the front, and near the end.
        for (film, body, frame, by_m) in [(1, 2, 20, 1e-3), (2, 1, 50, -5e-4), (0, 3, 117, 4e-5)] {
            shift(&mut films[film], body, frame, by_m);
        }
        let found = take_out_wild(&mut films);
        let names: Vec<(usize, usize)> = found.iter().map(|one| (one.index, one.body)).collect();
        assert_eq!(names, [(0, 3), (1, 2), (2, 1)]);
        // Five errors of 1 um, of which four by weights of at most two thirds.
        assert!((found[1].off_m - 1e-3).abs() < 1e-5, "{}", found[1].off_m);
        let lost =
            |one: &Observation| one.bodies.iter().flat_map(|b| &b.position_m).filter(|x| x.is_none()).count();
        assert_eq!(films.iter().map(lost).collect::<Vec<_>>(), [1, 1, 1, 0]);
    }

    #[test]
    fn what_the_stated_sigma_explains_stays() {
        let film_of = |sigma_m: f64| {
            let mut film = film(1);
            film.bodies
                .iter_mut()
                .flat_map(|body| body.position_m.iter_mut().flatten())
                .for_each(|x| x.sigma = sigma_m);
            shift(&mut film, 2, 20, 4e-5);
            film
        };
        // 40 um are beyond eight times 4 um, and not beyond eight times 6 um.
        assert_eq!(take_out_wild(&mut [film_of(4e-6)]).len(), 1);
        assert_eq!(take_out_wild(&mut [film_of(6e-6)]), []);
    }

    #[test]
    fn so_are_stretches_and_single_ones_close_to_each_other() {
        let mut films: Vec<Observation> = (1..=4).map(film).collect();
        let marks: Vec<usize> = (80..88).chain([100, 102]).collect();
        for frame in &marks {
            let reading = films[3].bodies[0].position_m[*frame].as_mut().unwrap();
            reading.value = 0.0;
        }
        take_out_wild(&mut films);
        let left = &films[3].bodies[0].position_m;
        assert!(marks.iter().all(|frame| left[*frame].is_none()));
        // With two wild ones the one between them goes.
        assert_eq!(left.iter().filter(|reading| reading.is_none()).count(), marks.len() + 1);
    }

    #[test]
    fn smooth_motions_of_any_period_stay_whole() {
        for period in (35..300).map(|tenths| 0.1 * f64::from(tenths)) {
            let mut film = film(1);
            for (frame, reading) in film.bodies[0].position_m.iter_mut().enumerate() {
                *reading = Some(Estimate::new((std::f64::consts::TAU * frame as f64 / period).sin(), 0.0));
            }
            // Pulses of a body that comes back, down to 1.75 samples on each side (1 / e).
            for (frame, reading) in film.bodies[1].position_m.iter_mut().enumerate() {
                let far = (frame as f64 - 60.3) / (0.5 * period);
                *reading = Some(Estimate::new((-far * far).exp(), 0.0));
            }
            assert_eq!(take_out_wild(&mut [film]), [], "{period}");
        }
    }

    #[test]
    fn a_short_pulse_that_runs_from_body_to_body_stays() {
        let mut film = film(1);
        for (body, track) in film.bodies.iter_mut().enumerate() {
            for (frame, reading) in track.position_m.iter_mut().enumerate() {
                let far = frame as f64 - 60.3 - 2.4 * body as f64;
                *reading = Some(Estimate::new((-far * far).exp(), 0.0));
            }
        }
        assert_eq!(take_out_wild(&mut [film]), []);
    }

    #[test]
    fn what_other_trials_show_too_is_motion() {
        let mut films: Vec<Observation> = (1..=4).map(film).collect();
        for (late, film) in films.iter_mut().enumerate() {
            shift(film, 2, 80 + late % 2, 3e-4);
        }
        assert_eq!(take_out_wild(&mut films), []);
    }

    #[test]
    fn jumps_and_steps_of_rounding_are_no_wild_readings() {
        let mut film = film(1);
        for (frame, reading) in film.bodies[0].position_m.iter_mut().enumerate() {
            *reading = Some(Estimate::new(if frame < 60 { 0.0 } else { 1e-3 }, 0.0));
        }
        for (frame, reading) in film.bodies[1].position_m.iter_mut().enumerate() {
            *reading = Some(Estimate::new(if frame % 17 == 0 { 1e-5 } else { 0.0 }, 0.0));
        }
        // Six digits of each number, as files have them, of a motion that grows from next to nothing and settles.
        for (frame, reading) in film.bodies[2].position_m.iter_mut().enumerate() {
            let place = 5.0 / (1.0 + (-(frame as f64 - 60.0) / 3.0).exp());
            let digits: f64 = format!("{place:.5e}").parse().unwrap();
            *reading = Some(Estimate::new(digits, 0.0));
        }
        assert_eq!(take_out_wild(&mut [film]), []);
    }
}
