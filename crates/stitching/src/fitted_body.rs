//! One body at all times of the common base: what recordings contribute there, and the response fitted to it.

use crate::body_response::{BodyResponse, Contribution};

/// What recordings contribute at each of some times, those of all times one behind the other.
#[derive(Debug, Clone, Default)]
pub(crate) struct Readings {
    all: Vec<Contribution>,
    /// Where those of each time end.
    ends: Vec<usize>,
}

impl Readings {
    /// Adds a time behind the others.
    pub(crate) fn push_time(&mut self, of_time: impl IntoIterator<Item = Contribution>) {
        self.all.extend(of_time);
        self.ends.push(self.all.len());
    }

    /// Those of all times.
    pub(crate) fn all(&self) -> &[Contribution] {
        &self.all
    }

    /// Those of each time.
    pub(crate) fn of_times(&self) -> impl Iterator<Item = &[Contribution]> + Clone {
        (0..self.ends.len()).map(|i| self.of_time(i))
    }

    fn of_time(&self, i: usize) -> &[Contribution] {
        let begin = if i == 0 { 0 } else { self.ends[i - 1] };
        &self.all[begin..self.ends[i]]
    }
}

/// One body at all times of the common base.
#[derive(Debug, Clone)]
pub(crate) struct FittedBody {
    readings: Readings,
    /// Of each time; of one without contributions it is nothing.
    pub(crate) responses: Vec<BodyResponse>,
    /// Q and C by the stated chain at each time, in metres; zero where none is stated.
    pub(crate) stated_orders_m: Vec<[f64; 2]>,
}

/// A body at one time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FittedTime<'a> {
    /// What the recordings contribute.
    pub(crate) contributions: &'a [Contribution],
    /// What was fitted to it.
    pub(crate) response: &'a BodyResponse,
}

impl FittedBody {
    /// Of readings, and the responses fitted to those of each time.
    pub(crate) fn new(
        readings: Readings,
        responses: Vec<BodyResponse>,
        stated_orders_m: Vec<[f64; 2]>,
    ) -> Self {
        debug_assert_eq!(readings.ends.len(), responses.len());
        debug_assert_eq!(stated_orders_m.len(), responses.len());
        Self { readings, responses, stated_orders_m }
    }

    /// The body at each time.
    pub(crate) fn times(&self) -> impl Iterator<Item = FittedTime<'_>> + Clone {
        (0..self.responses.len()).map(|i| self.at(i))
    }

    /// The body at one of the times.
    pub(crate) fn at(&self, i: usize) -> FittedTime<'_> {
        FittedTime { contributions: self.readings.of_time(i), response: &self.responses[i] }
    }

    /// The body at the times at which it was seen.
    pub(crate) fn seen(&self) -> impl Iterator<Item = FittedTime<'_>> + Clone {
        self.times().filter(|at| !at.contributions.is_empty())
    }

    /// The most recordings that contribute at one time.
    pub(crate) fn most_at_once(&self) -> usize {
        self.times().map(|at| at.contributions.len()).max().unwrap_or(0)
    }
}
