//! What a part of the texture that stands still keeps back: dirt on the sensor, a reflection, ground that a subset shows besides its marker.
//!
//! Let the reference be T + p, T on the body and p on the sensor, and the body move by u. A match that finds the displacement v leaves, in the mean over patterns,
//! `S(v) = E (v - u)^2 + R(v)`: the texture of energy E (its squared gradients) is off by v - u, and p, compared with itself v away, leaves R(v), twice the fall of its autocovariance
//! from 0 to v. The least S lies at
//!
//! `u - v = R'(v)/(2 E)`,                                                                             (1)
//!
//! short of the motion, as in a potential that has its valley at rest; a match's residuals say little of it, since what is left of p there is orthogonal to the gradient. But R itself is
//! seen: residuals grow with the displacement, up to the size of p. So R is taken as `A (1 - exp(-v^2/2 l^2))`, and A fitted to what the matches of a track leave beyond
//! what noise and interpolation explain, for some lengths l of which the best is taken; a constant besides is noise that the reference does not know of.
//!
//! Where A is beyond doubt, half of (1) is added to the place, since residuals may grow for another reason, and nothing is short then: a half is off by a half either way. As much is stated for what
//! single patterns of few speckles depart from the mean by, which is about the mean itself.

use chainwave_measurement::{Estimate, Lost, Position};

use crate::PreparedSubset;
use crate::icgn::outcome::Match;
use crate::simd::dot;
use crate::uncertainty::degrees_of_freedom;

/// Lengths that are tried, in pixels: standard deviations of dirt of 3 to 20 px, in steps that change a Gaussian by no more than noise does.
const LENGTHS_PX: [f64; 6] = [1.0, 1.5, 2.2, 3.3, 5.0, 7.5];
/// Standard deviations beyond which residuals grow with the displacement: of 816 tracks of noise and texture alone none does, the best of all lengths taken.
const BEYOND_DOUBT: f64 = 5.0;
/// Matches from which on a curve is fitted.
const LEAST_MATCHES: usize = 6;
/// What is added to the place of what is lacking if all that grows stands still; as much is stated, once for its cause and once for its texture.
const ADDED: f64 = 0.5;
/// Share of a reading's sigma from which on what is added is worth a word.
const WORTH_A_WORD: f64 = 0.5;
/// What is lacking over the displacement, at most: a still part with more texture than the moving one would have held the match at rest.
const MOST: f64 = 1.0;

/// What the matches of a track leave.
#[derive(Debug, Clone, Default)]
pub(crate) struct Still {
    readings: Vec<Reading>,
}

/// What one match leaves, as variance of a pixel in counts squared of the reference.
#[derive(Debug, Clone, Copy)]
struct Reading {
    frame: usize,
    /// Beyond noise and interpolation.
    excess: f64,
    /// By noise and interpolation.
    explained: f64,
}

/// How residuals grow with the displacement.
struct Growth {
    /// A, with its standard uncertainty.
    variance: Estimate,
    length_px: f64,
}

impl Still {
    /// Notes the match of a subset in a frame.
    pub(crate) fn note(&mut self, frame: usize, subset: &PreparedSubset, found: &Match) {
        let (zncc, ratio) = (found.position.zncc, found.noise_ratio);
        let left = (zncc.powi(-2) - 1.0) * subset.energy / degrees_of_freedom(subset) as f64;
        let explained = left / ratio;
        if found.is_whole && explained > 0.0 && explained.is_finite() {
            self.readings.push(Reading { frame, excess: left - explained, explained });
        }
    }

    /// Adds to the places of a track what a still part keeps back, but for those that `is_other` says are of another reference; returns the share of the texture that stands
    /// still, where that is beyond doubt and to be seen in the places.
    pub(crate) fn correct(
        &self,
        subset: &PreparedSubset,
        positions: &mut [Result<Position, Lost>],
        is_other: impl Fn(usize) -> bool,
    ) -> Option<Estimate> {
        let n = degrees_of_freedom(subset) as f64;
        let growth = self.growth(positions, subset.centre_px, n)?;
        let gradients =
            0.5 * (dot(&subset.gradient_x, &subset.gradient_x) + dot(&subset.gradient_y, &subset.gradient_y));
        let per_variance = n / (2.0 * growth.length_px.powi(2) * gradients);
        let most = (growth.variance.value * per_variance).min(MOST);
        let mut is_worth_a_word = false;
        let found = positions.iter_mut().enumerate().filter(|(frame, _)| !is_other(*frame));
        for position in found.filter_map(|(_, position)| position.as_mut().ok()) {
            let moved = displacement_px(position, subset.centre_px);
            let lacking = most * (-0.5 * square(moved) / growth.length_px.powi(2)).exp();
            for (place, moved) in [&mut position.x_px, &mut position.y_px].into_iter().zip(moved) {
                let added = ADDED * lacking * moved;
                is_worth_a_word |= added.abs() > WORTH_A_WORD * place.sigma;
                *place = Estimate::new(place.value + added, place.sigma.hypot(added).hypot(added));
            }
        }
        // A still part with the share c of the texture lacks c/(1 - c) of the displacement that is found.
        let share = most / (1.0 + most);
        let sigma = growth.variance.sigma * per_variance / (1.0 + most).powi(2);
        is_worth_a_word.then(|| Estimate::new(share, sigma))
    }

    /// How residuals of `n` independent pixels grow with the displacement, where that is beyond doubt.
    fn growth(&self, positions: &[Result<Position, Lost>], centre_px: [f64; 2], n: f64) -> Option<Growth> {
        let seen = self.readings.iter().filter_map(|reading| {
            let position = positions.get(reading.frame)?.as_ref().ok()?;
            Some((square(displacement_px(position, centre_px)), reading.excess))
        });
        let seen: Vec<(f64, f64)> = seen.collect();
        if seen.len() < LEAST_MATCHES {
            return None;
        }
        let explained = self.readings.iter().map(|reading| reading.explained).sum::<f64>();
        let of_noise = explained / self.readings.len() as f64 * (2.0 / n).sqrt();
        let fitted = LENGTHS_PX.iter().filter_map(|&length_px| {
            let grown =
                |(square, excess): &(f64, f64)| (1.0 - (-0.5 * square / length_px.powi(2)).exp(), *excess);
            let Line { slope, precision, scatter } =
                Line::through(&seen.iter().map(grown).collect::<Vec<_>>())?;
            let sigma = of_noise.max(scatter) / precision.sqrt();
            (slope > 0.0).then(|| (scatter, Growth { variance: Estimate::new(slope, sigma), length_px }))
        });
        let (_, best) = fitted.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (best.variance.value > BEYOND_DOUBT * best.variance.sigma).then_some(best)
    }
}

/// A straight line through points.
struct Line {
    slope: f64,
    /// Sum of squares of the abscissas about their mean.
    precision: f64,
    /// Standard deviation of the points about it.
    scatter: f64,
}

impl Line {
    fn through(points: &[(f64, f64)]) -> Option<Self> {
        let n = points.len() as f64;
        let mean = |of: &dyn Fn((f64, f64)) -> f64| points.iter().copied().map(of).sum::<f64>() / n;
        let (x, y) = (mean(&|(x, _)| x), mean(&|(_, y)| y));
        let precision = n * mean(&|point| (point.0 - x).powi(2));
        let slope = n * mean(&|point| (point.0 - x) * (point.1 - y)) / precision;
        let left = n * mean(&|point| (point.1 - y - slope * (point.0 - x)).powi(2));
        slope.is_finite().then(|| Self { slope, precision, scatter: (left / (n - 2.0)).sqrt() })
    }
}

fn displacement_px(position: &Position, centre_px: [f64; 2]) -> [f64; 2] {
    [position.x_px.value - centre_px[0], position.y_px.value - centre_px[1]]
}

fn square([x, y]: [f64; 2]) -> f64 {
    x * x + y * y
}
