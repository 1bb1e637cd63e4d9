//! What a subset's own past says of its next place.

use chainwave_measurement::{Position, Subset};

use crate::track::tracker::Found;
use crate::warp::Warp;

/// What a subset's own past says of its next place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct History {
    /// The last places in consecutive frames, the newest first; at least one.
    recent: Vec<Warp>,
    /// Frames since the newest.
    pub(crate) n_lost: usize,
}

impl History {
    /// A subset that was seen at one place so far.
    pub(crate) fn starting_at(warp: Warp) -> Self {
        Self { recent: vec![warp], n_lost: 0 }
    }

    /// A subset where it lies in the reference.
    pub(crate) fn of(subset: &Subset) -> Self {
        Self::starting_at(Warp::at([subset.x_px, subset.y_px]))
    }

    /// The same subset, seen at a position alone.
    pub(crate) fn restarted(&self, found: &Found) -> Self {
        let at =
            |position: &Position| Self::starting_at(Warp::at([position.x_px.value, position.y_px.value]));
        found.as_ref().map_or_else(|_| self.clone(), at)
    }

    /// Notes where, undeformed, the subset was found in the next frame, or that it was not.
    pub(crate) fn note(&mut self, found: &Found) {
        match found {
            Ok(position) => self.found(Warp::at([position.x_px.value, position.y_px.value])),
            Err(_) => self.lost(),
        }
    }

    /// Adds the place in the next frame. After a loss the past says nothing of the velocity any more.
    pub(crate) fn found(&mut self, warp: Warp) {
        if self.n_lost > 0 {
            self.recent.clear();
        }
        self.recent.insert(0, warp);
        self.recent.truncate(3);
        self.n_lost = 0;
    }

    /// Notes that the subset was not found in the next frame.
    pub(crate) fn lost(&mut self) {
        self.n_lost += 1;
    }

    /// Where the subset was seen last.
    pub(crate) fn last(&self) -> Warp {
        self.recent[0]
    }

    /// Where to search in the next frame: in turn where the subset would be by now and where it was seen last. From
    /// the fifth lost frame on only every fourth is searched.
    pub(crate) fn search_place(&self) -> Option<[f64; 2]> {
        const EAGER: usize = 4;
        let turn = if self.n_lost < EAGER { self.n_lost } else { self.n_lost / EAGER };
        let place = if turn.is_multiple_of(2) { self.predict() } else { self.last() };
        (self.n_lost < EAGER || self.n_lost.is_multiple_of(EAGER)).then_some(place.position_px)
    }

    /// The expected place in the next frame: constant acceleration, constant velocity or rest, as the past allows;
    /// constant velocity since a loss. The deformation is that of the last frame.
    pub(crate) fn predict(&self) -> Warp {
        let along = |axis: usize| {
            let at = |i: usize| self.recent[i].position_px[axis];
            match self.recent.len() {
                0 | 1 => at(0),
                3.. if self.n_lost == 0 => 3.0 * (at(0) - at(1)) + at(2),
                _ => at(0) + (at(0) - at(1)) * (self.n_lost + 1) as f64,
            }
        };
        Warp { position_px: [along(0), along(1)], ..self.last() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constant_acceleration_is_predicted_exactly() {
        let place = |t: f64| Warp::at([10.0 + 3.0 * t + 0.5 * t * t, 5.0 - t]);
        let mut history = History::starting_at(place(0.0));
        history.found(place(1.0));
        history.found(place(2.0));
        let [x, y] = history.predict().position_px;
        assert!((x - place(3.0).position_px[0]).abs() < 1e-12 && (y - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_lost_subset_goes_on_at_its_velocity_and_starts_anew_when_found() {
        let mut history = History::starting_at(Warp::at([0.0, 0.0]));
        history.found(Warp::at([2.0, 0.0]));
        history.lost();
        history.lost();
        assert_eq!(history.predict(), Warp::at([8.0, 0.0]));
        history.found(Warp::at([20.0, 1.0]));
        assert_eq!(history.predict(), Warp::at([20.0, 1.0]));
    }
}
