//! Local interpolation of a track between its frames, with the noise that it passes on.

use std::f64::consts::TAU;
use std::ops::Range;

use chainwave_measurement::{Estimate, Observation, median};

/// Samples taken on each side of an interpolated time.
const HALF_ORDER: usize = 3;
/// Samples that an interpolation takes.
const N_NODES: usize = 2 * HALF_ORDER;
/// Product of the distances from a time to the six samples around it, in frame intervals: at most 225/64 = 3.5 where no frame lacks, 36 where one does, half
/// way between its neighbours. The interpolation's error goes with it. In the middle of a longer hole it is more than this.
const FARTHEST: f64 = 45.0;
/// Frames on each side that are searched for samples.
const SEARCHED: usize = 8;
/// Intervals that differ by more than this factor belong to another rate, or hold a frame that lacks; stamps that are rounded to a third of an interval
/// differ by less than 4/3.
const ANOTHER_RATE: f64 = 1.5;
/// Frames on each side that tell the rate about a time where it may be another one.
const AROUND: usize = 12;
/// Frames that are longer by less than this than the times of the base are as long: a hundredth is half as much of a sigma.
const AS_LONG: f64 = 1.01;

/// A value read between samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Interpolated {
    pub(crate) value: f64,
    /// Time derivative, in the samples' unit per second.
    pub(crate) rate: f64,
    /// Standard uncertainty of the samples around: the noise before interpolation smoothed it.
    pub(crate) sigma: f64,
    /// Variance of `value` over `sigma` squared, 0.7 half way between samples and 1 on one.
    pub(crate) noise_gain: f64,
    /// Time from one sample to the next about there, in seconds.
    pub(crate) interval_s: f64,
}

impl Interpolated {
    /// How many times of a base share one sample's noise: one where its times are as far apart as the samples, or farther.
    pub(crate) fn n_shared(&self, base_interval_s: f64) -> f64 {
        let ratio = self.interval_s / base_interval_s;
        if ratio > AS_LONG { ratio } else { 1.0 }
    }
}

/// The frames of one recording, and how it is read at each of some times.
#[derive(Debug, Clone)]
pub(crate) struct Resampling<'a> {
    times_s: &'a [f64],
    stencils: Vec<Option<Stencil>>,
}

impl<'a> Resampling<'a> {
    /// Of a recording at these times by its own clock, in seconds.
    pub(crate) fn at(observation: &'a Observation, times_s: impl Iterator<Item = f64>) -> Self {
        let (own_s, usual_s) = (observation.times_s.as_slice(), observation.frame_interval_s());
        Self { times_s: own_s, stencils: times_s.map(|time_s| Stencil::at(own_s, usual_s, time_s)).collect() }
    }

    /// Whether the recording lasts over one of the times.
    pub(crate) fn covers(&self, i: usize) -> bool {
        self.stencils[i].is_some()
    }

    /// What samples, one for each frame, say at one of the times.
    pub(crate) fn read(&self, i: usize, samples: &[Option<Estimate>]) -> Option<Interpolated> {
        let stencil = self.stencils[i].as_ref()?;
        stencil.read(samples).or_else(|| stencil.read_around_lost(self.times_s, samples))
    }
}

/// Six-point Lagrange interpolation at one time: which samples, and their weights.
///
/// The error is (h^6/720) |x| (225/64) at most, h the frame interval: 3e-4 of the amplitude at a tenth of the frame
/// rate, 5e-6 at a twentieth. The stencil is local, so that a lost frame costs little: the three samples on each side that are left then lie farther away, with an
/// error up to ten times as large, which the next sample tells and which counts as noise. So it is with a frame that was never taken.
#[derive(Debug, Clone)]
struct Stencil {
    time_s: f64,
    first: usize,
    interval_s: f64,
    value_weights: [f64; N_NODES],
    rate_weights: [f64; N_NODES],
}

impl Stencil {
    /// The stencil for `time_s`; `None` within three samples of either end, and where several frames between them were not taken.
    fn at(times_s: &[f64], usual_s: f64, time_s: f64) -> Option<Self> {
        let after = times_s.partition_point(|sample| *sample <= time_s);
        let first = after.checked_sub(HALF_ORDER)?;
        let nodes: &[f64; N_NODES] = times_s.get(first..first + N_NODES)?.try_into().ok()?;
        let interval_s = interval_about(times_s, first..first + N_NODES, usual_s);
        if distance(nodes, time_s) > FARTHEST * interval_s.powi(N_NODES as i32) {
            return None;
        }
        let [value_weights, rate_weights] = weights(nodes, time_s);
        Some(Self { time_s, first, interval_s, value_weights, rate_weights })
    }

    /// Reads the samples; `None` where one of the six is missing.
    fn read(&self, samples: &[Option<Estimate>]) -> Option<Interpolated> {
        let mut read =
            Interpolated { value: 0.0, rate: 0.0, sigma: 0.0, noise_gain: 0.0, interval_s: self.interval_s };
        for (i, sample) in samples.get(self.first..self.first + N_NODES)?.iter().enumerate() {
            read.add((*sample)?, [self.value_weights[i], self.rate_weights[i]]);
        }
        Some(read)
    }

    /// Reads the three samples that are left on each side; `None` where they lie too far away. What a seventh one makes of the polynomial is its error, as
    /// large as the noise allows it to be told, and counts as noise.
    fn read_around_lost(&self, times_s: &[f64], samples: &[Option<Estimate>]) -> Option<Interpolated> {
        let after = self.first + HALF_ORDER;
        let seen = |at: &usize| samples.get(*at).is_some_and(Option::is_some);
        let mut before = (after.saturating_sub(SEARCHED)..after).rev().filter(seen);
        let mut behind = (after..(after + SEARCHED).min(times_s.len())).filter(seen);
        let mut places = [0; N_NODES];
        for k in 0..HALF_ORDER {
            places[HALF_ORDER - 1 - k] = before.next()?;
            places[HALF_ORDER + k] = behind.next()?;
        }
        let nodes = places.map(|at| times_s[at]);
        let distance = distance(&nodes, self.time_s);
        if distance > FARTHEST * self.interval_s.powi(N_NODES as i32) {
            return None;
        }
        let [value_weights, rate_weights] = weights(&nodes, self.time_s);
        let usual_s = (nodes[N_NODES - 1] - nodes[0]) / (N_NODES - 1) as f64;
        let interval_s = self.interval_s.max(usual_s);
        let mut read = Interpolated { value: 0.0, rate: 0.0, sigma: 0.0, noise_gain: 0.0, interval_s };
        for (i, at) in places.into_iter().enumerate() {
            read.add(samples[at]?, [value_weights[i], rate_weights[i]]);
        }
        let next = before.next().or_else(|| behind.next())?;
        let from_polynomial: f64 = (0..N_NODES)
            .map(|i| {
                lagrange(&nodes, i, nodes[i], times_s[next]).0 * samples[places[i]].map_or(0.0, |x| x.value)
            })
            .sum();
        // Newton's form: the next divided difference, times the distances.
        let at_next: f64 = nodes.iter().map(|node| times_s[next] - node).product();
        let error = (samples[next]?.value - from_polynomial) * distance / at_next;
        if error != 0.0 {
            read.noise_gain += (error / read.sigma).powi(2);
        }
        Some(read)
    }
}

impl Interpolated {
    /// Adds one of the six samples, with its weights in value and rate.
    fn add(&mut self, sample: Estimate, [in_value, in_rate]: [f64; 2]) {
        self.value += in_value * sample.value;
        self.rate += in_rate * sample.value;
        self.sigma += sample.sigma / N_NODES as f64;
        self.noise_gain += in_value.powi(2);
    }
}

/// Product of the distances from a time to samples, in seconds to the power of their number.
fn distance(nodes: &[f64; N_NODES], time_s: f64) -> f64 {
    nodes.iter().map(|node| (time_s - node).abs()).product()
}

/// Usual interval between frames about some of them: that of all frames, unless the rate is another one there.
fn interval_about(times_s: &[f64], some: Range<usize>, usual_s: f64) -> f64 {
    let is_usual = |interval_s: f64| (ANOTHER_RATE.recip()..=ANOTHER_RATE).contains(&(interval_s / usual_s));
    if times_s[some.clone()].windows(2).all(|pair| is_usual(pair[1] - pair[0])) {
        return usual_s;
    }
    let around = &times_s[some.start.saturating_sub(AROUND)..(some.end + AROUND).min(times_s.len())];
    let local_s = median(around.windows(2).map(|pair| pair[1] - pair[0]).collect());
    local_s.filter(|local_s| !is_usual(*local_s)).unwrap_or(usual_s)
}

/// Weights of samples in value and rate at a time.
fn weights(nodes: &[f64; N_NODES], time_s: f64) -> [[f64; N_NODES]; 2] {
    let mut of = [[0.0; N_NODES]; 2];
    for (i, node) in nodes.iter().enumerate() {
        (of[0][i], of[1][i]) = lagrange(nodes, i, *node, time_s);
    }
    of
}

/// Value and derivative at `time_s` of the Lagrange polynomial that is 1 at node `i` and 0 at the others.
fn lagrange(nodes: &[f64; 6], i: usize, node: f64, time_s: f64) -> (f64, f64) {
    let others = || nodes.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, other)| *other);
    let value: f64 = others().map(|other| (time_s - other) / (node - other)).product();
    let rate: f64 = others()
        .map(|left_out| {
            let rest: f64 = others()
                .filter(|other| other.to_bits() != left_out.to_bits())
                .map(|other| (time_s - other) / (node - other))
                .product();
            rest / (node - left_out)
        })
        .sum();
    (value, rate)
}

/// Share of the power of waves that interpolation between frames passes, by their frequencies in cycles a frame: the mean over all places between two
/// frames. 1 of what is slow.
#[must_use]
pub fn power_passed(cycles_per_frame: &[f64]) -> Vec<f64> {
    const N_PLACES: u32 = 16;
    let nodes: [f64; 2 * HALF_ORDER] = std::array::from_fn(|i| i as f64);
    let weights_at = |place: u32| -> [f64; 2 * HALF_ORDER] {
        let time = (HALF_ORDER - 1) as f64 + (f64::from(place) + 0.5) / f64::from(N_PLACES);
        std::array::from_fn(|i| lagrange(&nodes, i, nodes[i], time).0)
    };
    let weights: Vec<_> = (0..N_PLACES).map(weights_at).collect();
    let passed = |cycles: &f64| {
        let waves = nodes.map(|node| (TAU * cycles * node).sin_cos());
        let at_place = |weights: &[f64; 2 * HALF_ORDER]| -> f64 {
            let of = |part: fn(&(f64, f64)) -> f64| -> f64 {
                weights.iter().zip(&waves).map(|(weight, wave)| weight * part(wave)).sum()
            };
            of(|wave| wave.0).powi(2) + of(|wave| wave.1).powi(2)
        };
        weights.iter().map(at_place).sum::<f64>() / f64::from(N_PLACES)
    };
    cycles_per_frame.iter().map(passed).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn interpolation_passes_less_of_what_is_faster() {
        let passed_of = |cycles: f64| power_passed(&[cycles])[0];
        assert!((passed_of(0.0) - 1.0).abs() < 1e-14);
        // Half way between frames, with the weights 150, -25 and 3 of 256 on each side, the gain is (150 cos(w/2) - 25 cos(3w/2) + 3 cos(5w/2)) / 128;
        // on a frame it is 1. What is passed on the mean lies between.
        let gain = |cycles: f64| {
            let wave = |k: f64| (k * PI * cycles).cos();
            (150.0 * wave(1.0) - 25.0 * wave(3.0) + 3.0 * wave(5.0)) / 128.0
        };
        for cycles in [0.1, 0.2, 0.285, 0.4, 0.5] {
            let (least, passed) = (gain(cycles).powi(2), passed_of(cycles));
            let lacking = (1.0 - passed) / (1.0 - least);
            assert!((0.3..0.9).contains(&lacking), "{cycles}: {passed}, half way {least}");
        }
        // The error of the sixth order, (w/2)^6 (5/16) of the amplitude half way, is the most that lacks.
        assert!(1.0 - passed_of(0.01) < 0.625 * (PI * 0.01_f64).powi(6));
    }

    fn seen_at(times_s: &[f64]) -> Observation {
        let (recording, bodies) = ("film".into(), Vec::new());
        Observation { recording, view: 1, trial: 1, times_s: times_s.to_vec(), bodies }
    }

    fn read_at(times_s: &[f64], time_s: f64, samples: &[Option<Estimate>]) -> Option<Interpolated> {
        Resampling::at(&seen_at(times_s), [time_s].into_iter()).read(0, samples)
    }

    #[test]
    fn a_quintic_is_read_exactly_with_its_rate() {
        let times: Vec<f64> = (0..12).map(|i| 0.1 * f64::from(i) + 0.003 * f64::from(i * i % 5)).collect();
        let x = |t: f64| 1.0 - t + 2.0 * t.powi(3) - 0.5 * t.powi(5);
        let rate = |t: f64| -1.0 + 6.0 * t.powi(2) - 2.5 * t.powi(4);
        let mut samples: Vec<_> = times.iter().map(|t| Some(Estimate::new(x(*t), 0.1))).collect();
        for lost in [None, Some(7)] {
            if let Some(lost) = lost {
                samples[lost] = None;
            }
            for time in [0.35, 0.5, 0.77] {
                let read = read_at(&times, time, &samples).unwrap();
                // Rounding of weights up to 1/(0.1^5) in the derivative: about 1e-12.
                assert!((read.value - x(time)).abs() < 1e-13);
                assert!((read.rate - rate(time)).abs() < 1e-11);
                // On a lost sample, half way between its neighbours: 1.3 where they are evenly spaced.
                assert!(read.noise_gain > 0.6 && read.noise_gain < 1.6, "{read:?}");
            }
        }
    }

    #[test]
    fn ends_and_long_holes_are_not_bridged_and_single_frames_are() {
        let times: Vec<f64> = (0..40).map(f64::from).collect();
        let samples = vec![Some(Estimate::new(0.0, 0.1)); 40];
        let read = |time: f64, lost: &[usize]| {
            let mut left = samples.clone();
            lost.iter().for_each(|lost| left[*lost] = None);
            read_at(&times, time, &left)
        };
        assert!(read(1.5, &[]).is_none() && read(37.5, &[]).is_none() && read(2.5, &[]).is_some());
        // A lost frame is bridged, on it as well as beside it; of two the half way next to either is not, of five none.
        assert!([19.0, 19.5, 20.0, 20.5, 21.0].iter().all(|time| read(*time, &[20]).is_some()));
        assert!(read(20.5, &[20, 21]).is_none() && read(19.1, &[20, 21]).is_some());
        assert!((0..6).all(|k| read(19.5 + f64::from(k), &[20, 21, 22, 23, 24]).is_none()));
        // A frame that is there is read where it is, whatever lacks beside it.
        assert!((read(19.0, &[20, 21, 22, 23]).unwrap().noise_gain - 1.0).abs() < 1e-12);
        // The frame at 7 was never taken, which costs no more than if it had been lost; five that were not cost their times.
        let without: Vec<f64> = (0..40).filter(|frame| *frame != 7).map(f64::from).collect();
        assert!((4..10).all(|k| read_at(&without, f64::from(k) + 0.5, &samples[1..]).is_some()));
        let without: Vec<f64> = times.iter().copied().filter(|time| !(7.0..12.0).contains(time)).collect();
        assert!((6..11).all(|k| read_at(&without, f64::from(k) + 0.5, &samples[5..]).is_none()));
        // Where frames are half as many from one on they are read all the same, at twice the interval.
        let slower: Vec<f64> =
            (0..20).map(f64::from).chain((0..30).map(|k| 20.0 + 2.0 * f64::from(k))).collect();
        let samples = vec![Some(Estimate::new(0.0, 0.1)); 50];
        assert_eq!(read_at(&slower, 47.0, &samples).map(|read| read.interval_s), Some(2.0));
        assert_eq!(read_at(&slower, 10.5, &samples).map(|read| read.n_shared(0.999)), Some(1.0));
    }

    /// Where a frame lacks the polynomial is off by more than noise alone, and says so.
    #[test]
    fn what_a_lost_frame_costs_is_stated() {
        let times: Vec<f64> = (0..40).map(f64::from).collect();
        // A tenth of the frame rate: six samples about a lost one are off by (2 pi / 10)^6 36 / 720 = 3e-3 of the amplitude.
        let x = |time: f64, phase: f64| (TAU * time / 10.0 + phase).sin();
        let (mut squares, mut stated) = (0.0, 0.0);
        for phase in (0..50).map(|k| TAU * f64::from(k) / 50.0) {
            let mut samples: Vec<_> =
                times.iter().map(|time| Some(Estimate::new(x(*time, phase), 1e-4))).collect();
            samples[20] = None;
            let read = read_at(&times, 20.0, &samples).unwrap();
            squares += (read.value - x(20.0, phase)).powi(2) / 50.0;
            stated += read.noise_gain * read.sigma.powi(2) / 50.0;
        }
        // The seventh sample lies on one side: the next derivative and the one behind it make some tens of per cent.
        let (error, stated) = (squares.sqrt(), stated.sqrt());
        assert!(error > 1e-3 && stated > 0.7 * error && stated < 3.0 * error, "{error:e} {stated:e}");
    }
}
