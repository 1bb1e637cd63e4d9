//! A pattern that repeats itself, followed by its own past: which of the equal places a subset is in, where no single frame can tell.
//!
//! **The condition.** At the reference the body is at rest, as reference frames are defined, and it is seen in every frame from there on, each
//! time within a tenth of the pattern's period from where the frames before lead to expect it. Then its velocity changes by less than that
//! from frame to frame, and the place where it goes on is the only one of the equal ones that a body of such an inertia can be in: the next is
//! nine times as far from the expected place. A body that jumps is near its expected place by accident in 3 of 100 frames (the area of a disc
//! of that radius over that of a cell), so a reading counts once the run is five frames long, which jumps feign in 1 of 10^6 films; it then
//! counts from the run's beginning. A gap, or a reading that is farther off, ends the run for good: what is not seen may have jumped.
//!
//! What this cannot tell is a body that from one frame to the next comes to move by a whole period a frame; a film that shows this
//! is too slow for its pattern, whoever looks at it.

use chainwave_measurement::{Lost, Position};

use crate::track::predict::History;
use crate::track::tracker::Found;

/// Share of the pattern's period within which a subset is seen where it was expected.
const NEAR: f64 = 0.1;
/// Frames of a run, the reference's among them, from which on it is no accident.
const LEAST_RUN: usize = 5;

/// The run of a subset from the reference on, and readings that hold if it lasts.
#[derive(Debug, Clone, Default)]
pub(crate) struct Continuity {
    /// Distance of the nearest place that resembles the subset in its own reference; none where nothing does.
    period_px: Option<f64>,
    /// Frames of the run; none once it has ended.
    n_frames: Option<usize>,
    /// Readings of the run that no single frame can tell.
    pending: Vec<(usize, Position)>,
    settled: Vec<(usize, Position)>,
}

impl Continuity {
    /// The beginning of a run at the reference, of a pattern with a period.
    pub(crate) fn from_rest(period_px: Option<f64>) -> Self {
        Self { period_px, n_frames: Some(0), ..Self::default() }
    }

    /// The beginning of a run the other way.
    pub(crate) fn restart(&mut self, period_px: Option<f64>) {
        let settled = std::mem::take(&mut self.settled);
        *self = Self { settled, ..Self::from_rest(period_px) };
    }

    /// Whether the run of a pattern that repeats itself lasts.
    pub(crate) fn lasts(&self) -> bool {
        self.n_frames.is_some() && self.period_px.is_some()
    }

    /// Whether the run would go on at a place.
    pub(crate) fn goes_on_at(&self, history: &History, [x, y]: [f64; 2]) -> bool {
        let [u, v] = history.predict().position_px;
        let is_near = self.period_px.is_some_and(|period| (x - u).hypot(y - v) < NEAR * period);
        self.n_frames.is_some() && history.n_lost == 0 && is_near
    }

    /// Notes a reading, which may be one that its frame cannot tell from others; it is ambiguous until the run is long enough.
    pub(crate) fn note(
        &mut self,
        frame: usize,
        position: Position,
        goes_on: bool,
        is_evident: bool,
    ) -> Found {
        if goes_on {
            self.n_frames = self.n_frames.map(|n| n + 1);
        } else {
            self.end();
        }
        let is_long = self.n_frames.is_some_and(|n| n >= LEAST_RUN);
        if is_long {
            self.settled.append(&mut self.pending);
        }
        if is_evident || is_long {
            return Ok(position);
        }
        self.pending.push((frame, position));
        Err(Lost::Ambiguous)
    }

    /// Ends the run: the subset was lost, seen elsewhere, or prepared anew.
    pub(crate) fn end(&mut self) {
        self.n_frames = None;
        self.pending.clear();
    }

    /// The readings that held later, with their frames.
    pub(crate) fn take_settled(&mut self) -> Vec<(usize, Position)> {
        std::mem::take(&mut self.settled)
    }
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Estimate;

    use super::*;
    use crate::warp::Warp;

    fn position(x: f64) -> Position {
        let estimate = |value| Estimate::new(value, 0.01);
        Position { x_px: estimate(x), y_px: estimate(0.0), theta_rad: None, zncc: 0.99, iterations: 3 }
    }

    /// Follows places of a pattern of 10 px that no frame can tell; how many are told, at once or later.
    fn told(places: &[f64]) -> usize {
        let mut history = History::starting_at(Warp::at([0.0, 0.0]));
        let mut run = Continuity::from_rest(Some(10.0));
        let mut n_at_once = 0;
        for (frame, &x) in places.iter().enumerate() {
            let goes_on = run.goes_on_at(&history, [x, 0.0]);
            n_at_once += usize::from(run.note(frame, position(x), goes_on, false).is_ok());
            history.found(Warp::at([x, 0.0]));
        }
        n_at_once + run.take_settled().len()
    }

    #[test]
    fn a_body_that_gathers_speed_is_told_from_its_first_frame_on() {
        let places: Vec<f64> = (0..20).map(|k| 0.2 * f64::from(k).powi(2)).collect();
        assert_eq!(told(&places), 20);
    }

    #[test]
    fn a_jump_ends_it_for_good() {
        assert_eq!(told(&[0.0, 0.1, 0.2, 4.0, 4.0, 4.0, 4.0, 4.0]), 0);
        assert_eq!(told(&[0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 4.0, 4.1, 4.2, 4.3]), 6);
    }
}
