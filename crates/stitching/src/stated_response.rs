//! How a chain model answers to the drive, and how far the onset of its bodies departs from proportion to it.

use chainwave_measurement::Estimate;
use nalgebra::{Matrix2, Vector2};

use crate::response_sizes::ResponseSizes;

/// The first body's onset ends when it has moved this share of its way. A shorter one knows beta worse, a longer one departs farther from proportion.
pub(crate) const ONSET_SHARE: f64 = 0.1;
/// Where no chain is stated: standard deviation of what the response of a softening chain leaves of proportion within the onset, as an error of beta over
/// the onset's length: on the paper's chain beta is 9 us off, of 0.7 ms.
pub(crate) const DEPARTURE: f64 = 0.013;

/// The same as a relative error of alpha, and so of the drives' scale: on the paper's chain alpha is 0.913 at 2.73 m/s and 0.967 at
/// 0.83 m/s.
pub(crate) const DEPARTURE_OF_SCALE: f64 = 0.1;

/// One body's motion by a model, and its slope against the drive's deviation (x at 1 + s is X + s S).
#[derive(Debug, Clone, PartialEq)]
pub struct ModelResponse {
    /// Time from one sample to the next, in seconds.
    pub interval_s: f64,
    /// How far it goes from rest, in metres.
    pub furthest_m: f64,
    /// X, in metres from rest, from before it moves until its onset is over; the rest is not asked for.
    pub motion_m: Vec<f64>,
    /// S at the same times, in metres.
    pub slope_m: Vec<f64>,
}

/// What a model says of one body: as it is stated, and as it would be where something that the model leaves open were otherwise by one
/// standard deviation.
#[derive(Debug, Clone, PartialEq)]
pub struct StatedResponse {
    /// As stated.
    pub stated: ModelResponse,
    /// One for each thing that is left open.
    pub otherwise: Vec<ModelResponse>,
    /// How large the response is, as stated, while the recordings last.
    pub sizes: ResponseSizes,
    /// Its orders beyond the slope over time.
    pub orders: HigherOrders,
}

/// What a body's response to the drive has beyond X + s S, from before it moves until the recordings end.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HigherOrders {
    /// Time from one sample to the next, in seconds.
    pub interval_s: f64,
    /// How far the body has moved, in metres, when it counts as reached; and the sample in which it has.
    pub reached_m: f64,
    /// As above.
    pub reached: usize,
    /// Q and C, of s^2 and s^3, in metres.
    pub orders_m: Vec<[f64; 2]>,
}

impl HigherOrders {
    /// The orders at a time after the body was reached; zero before and behind what is known.
    pub(crate) fn at_m(&self, since_reached_s: f64) -> [f64; 2] {
        let place = self.reached as f64 + since_reached_s / self.interval_s;
        let before = place.floor();
        let share = place - before;
        let sample = |at: f64| if at >= 0.0 { self.orders_m.get(at as usize).copied() } else { None };
        let [from, to] = [before, before + 1.0].map(|at| sample(at).unwrap_or_default());
        [0, 1].map(|k| (1.0 - share) * from[k] + share * to[k])
    }
}

/// How a body's slope departs from its motion over its onset: S = scale X + delay dX/dt.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct OnsetDeparture {
    /// Scale, and delay in seconds.
    pub(crate) factors: Vector2<f64>,
    /// Their covariance.
    pub(crate) covariance: Matrix2<f64>,
}

/// Of the departure that a model has, this share may be the model's own error (a standard deviation).
pub(crate) const MISTRUST: f64 = 0.3;

impl StatedResponse {
    /// Over an onset of usual length.
    pub(crate) fn usual_departure(&self) -> Option<OnsetDeparture> {
        self.departure(ONSET_SHARE * self.stated.furthest_m)
    }

    /// Over the onset that ends when the body has moved so far; `None` where the model's body does not move as far, or in too few samples.
    pub(crate) fn departure(&self, until_m: f64) -> Option<OnsetDeparture> {
        let factors = self.stated.scale_and_delay(until_m)?;
        let proportional = Vector2::new(1.0, 0.0);
        let mistrust = MISTRUST * (factors - proportional);
        let covariance = self
            .otherwise
            .iter()
            .filter_map(|other| other.scale_and_delay(until_m))
            .map(|other| other - factors)
            .chain([mistrust])
            .map(|error| error * error.transpose())
            .sum();
        Some(OnsetDeparture { factors, covariance })
    }
}

impl OnsetDeparture {
    /// Scale, and delay in seconds.
    pub(crate) fn estimates(&self) -> [Estimate; 2] {
        [0, 1].map(|k| Estimate::new(self.factors[k], self.covariance[(k, k)].sqrt()))
    }

    /// Where no model tells it, for an onset that moves for so long: none, within what the paper's chain departs by.
    pub(crate) fn unknown(length_s: f64) -> Self {
        let error = Vector2::new(DEPARTURE_OF_SCALE, -DEPARTURE * length_s);
        Self { factors: Vector2::new(1.0, 0.0), covariance: error * error.transpose() }
    }

    /// Of a body that moves as is prescribed.
    pub(crate) fn none() -> Self {
        Self { factors: Vector2::new(1.0, 0.0), covariance: Matrix2::zeros() }
    }
}

impl ModelResponse {
    /// The slope in terms of motion and velocity, by least squares until the body has moved so far.
    fn scale_and_delay(&self, until_m: f64) -> Option<Vector2<f64>> {
        let n = self.motion_m.iter().position(|x_m| x_m.abs() >= until_m)?;
        let (mut normal, mut right_side) = (Matrix2::zeros(), Vector2::zeros());
        // The sample behind the onset is the last that a difference takes.
        for (around, slope_m) in self.motion_m[..=n].windows(3).zip(&self.slope_m[1..]) {
            let velocity_m_per_s = (around[2] - around[0]) / (2.0 * self.interval_s);
            let columns = Vector2::new(around[1], velocity_m_per_s);
            normal += columns * columns.transpose();
            right_side += columns * *slope_m;
        }
        normal.try_inverse().map(|inverse| inverse * right_side)
    }
}
