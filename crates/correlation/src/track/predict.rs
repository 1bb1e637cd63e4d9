//! What a subset's own past says of its next place.

use chainwave_measurement::{Position, Subset};

use crate::search::patch::Deformations;
use crate::track::tracker::Found;
use crate::warp::Warp;

/// Where and how a subset is searched for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Search {
    pub(crate) around_px: [f64; 2],
    pub(crate) reach: Reach,
    /// How it may be deformed; `None` for as it is.
    pub(crate) deformations: Option<Deformations>,
}

/// Times the search radius that are searched at most, but for the whole frame.
const MOST_RADII: usize = 4;

/// Frames that a subset is lost for in which it is looked for where it would be, and searched for every time.
const EAGER: usize = 4;
/// A subset that comes back so near to where it is expected went on as it did.
const WENT_ON_PX: f64 = 1.0;

/// How far around a place is searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reach {
    /// So many times the search radius of the settings.
    Radii(usize),
    /// The frame.
    Whole,
}

impl Reach {
    /// The search radius of the settings.
    const NEAR: Self = Self::Radii(1);
    /// As far as is searched but in the whole frame.
    const FAR: Self = Self::Radii(MOST_RADII);

    /// The same in pixels, for a search radius and a frame whose longer side is `frame_px`.
    pub(crate) fn px(self, radius_px: usize, frame_px: usize) -> usize {
        match self {
            Self::Radii(1) => radius_px,
            Self::Radii(n) => radius_px.saturating_mul(n).min(frame_px),
            Self::Whole => frame_px,
        }
    }
}

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

    /// A subset where it was found in the reference, or lies in it.
    pub(crate) fn restarted(found: &Found, centre_px: [f64; 2]) -> Self {
        let at = |position: &Position| [position.x_px.value, position.y_px.value];
        Self::starting_at(Warp::at(found.as_ref().map_or(centre_px, at)))
    }

    /// Notes where, undeformed, the subset was found in the next frame, or that it was not.
    pub(crate) fn note(&mut self, found: &Found) {
        match found {
            Ok(position) => self.found(Warp::at([position.x_px.value, position.y_px.value])),
            Err(_) => self.lost(),
        }
    }

    /// Adds the place in the next frame. After a loss the past says nothing of the velocity any more, unless the subset went on with it.
    pub(crate) fn found(&mut self, warp: Warp) {
        if self.n_lost > 0 {
            let before = self.predict_after_loss().and_then(|expected| {
                let [dx, dy] = [0, 1].map(|axis| warp.position_px[axis] - expected.position_px[axis]);
                let last = self.last();
                let share = 1.0 / (self.n_lost + 1) as f64;
                let position_px = [0, 1].map(|axis| {
                    warp.position_px[axis] + share * (last.position_px[axis] - warp.position_px[axis])
                });
                (dx.hypot(dy) < WENT_ON_PX).then_some(Warp { position_px, ..warp })
            });
            self.recent.clear();
            self.recent.extend(before);
        }
        self.recent.insert(0, warp);
        self.recent.truncate(3);
        self.n_lost = 0;
    }

    /// The expected place in the next frame of a subset that is lost since few frames.
    pub(crate) fn predict_after_loss(&self) -> Option<Warp> {
        (1..=EAGER).contains(&self.n_lost).then(|| self.predict())
    }

    /// Notes that the subset was not found in the next frame.
    pub(crate) fn lost(&mut self) {
        self.n_lost += 1;
    }

    /// The same of what the subset was prepared from before it was deformed by a gradient and prepared anew.
    pub(crate) fn after_gradient(&self, before: &[f64; 4]) -> Self {
        let recent = self.recent.iter().map(|warp| warp.after_gradient(before)).collect();
        Self { recent, n_lost: self.n_lost }
    }

    /// Where the subset would be so many frames on, if it kept its velocity.
    pub(crate) fn after(&self, n_frames: usize) -> Warp {
        let last = self.last();
        let Some(before) = self.recent.get(1) else { return last };
        let [x, y] = [0, 1].map(|axis| {
            let velocity = last.position_px[axis] - before.position_px[axis];
            last.position_px[axis] + n_frames as f64 * velocity
        });
        Warp { position_px: [x, y], ..last }
    }

    /// Where the subset was seen last.
    pub(crate) fn last(&self) -> Warp {
        self.recent[0]
    }

    /// The searches of the next frame, until one of them finds the subset: as it is near where it is expected and farther around where it
    /// was, then turned, then stretched. A subset that is lost is searched for in turn where it would be by now and where it was seen
    /// last, the farther around the longer it is lost; from the fifth lost frame on in every fourth alone. The whole frame is searched when 2
    /// frames are lost and every 16, which takes one product of spectra, and for the subset turned when 2, 16 and every 64 are.
    pub(crate) fn searches(&self) -> Vec<Search> {
        const WHOLE: usize = 16;
        const WHOLE_TURNED: usize = 64;
        let turn = if self.n_lost < EAGER { self.n_lost } else { self.n_lost / EAGER };
        let expected = if turn.is_multiple_of(2) { self.predict() } else { self.last() };
        let near = |deformations| {
            let around_px = expected.position_px;
            Search { around_px, reach: Reach::NEAR, deformations }
        };
        let around = |reach, deformations| {
            let around_px = self.last().position_px;
            Search { around_px, reach, deformations }
        };
        let turns = Some(Deformations::Turns);
        let whole = around(Reach::Whole, None);
        match self.n_lost {
            0 => {
                let [upright, turned] = self.searches_near();
                let stretched = near(Some(Deformations::Stretches));
                vec![upright, around(Reach::FAR, None), turned, around(Reach::FAR, turns), stretched]
            }
            n if n == 2 || n == WHOLE || n.is_multiple_of(WHOLE_TURNED) => {
                vec![near(None), whole, near(turns), around(Reach::Whole, turns)]
            }
            n if n.is_multiple_of(WHOLE) => vec![near(None), whole, near(turns)],
            n if n < EAGER => vec![near(None), around(Reach::FAR, None), near(turns)],
            n if n.is_multiple_of(EAGER) => {
                let wider = Search { reach: Self::widened(n), ..near(None) };
                let upright = [near(None), wider].into_iter().take(if wider == near(None) { 1 } else { 2 });
                upright.chain([near(turns)]).collect()
            }
            _ => Vec::new(),
        }
    }

    /// The searches around where the subset is expected: as it is, then turned.
    pub(crate) fn searches_near(&self) -> [Search; 2] {
        let around_px = self.predict().position_px;
        [None, Some(Deformations::Turns)].map(|deformations| Search {
            around_px,
            reach: Reach::NEAR,
            deformations,
        })
    }

    /// How far a subset is searched for that is lost for so many frames: a body that changes its velocity behind an obstacle comes out the
    /// farther from where it is expected the longer it is hidden.
    fn widened(n_lost: usize) -> Reach {
        const FRAMES_A_RADIUS: usize = 8;
        Reach::Radii((1 + n_lost / FRAMES_A_RADIUS).min(MOST_RADII))
    }

    /// As [`Self::predict`], for a subset that goes on to turn and stretch as it did; `None` where it did not.
    pub(crate) fn predict_turning(&self) -> Option<Warp> {
        const NOTHING: f64 = 0.02;
        let [newest, before, ..] = self.recent.as_slice() else { return None };
        let changed =
            newest.gradient.iter().zip(before.gradient).any(|(new, old)| (new - old).abs() > NOTHING);
        let gradient = Warp::gradient_after(&before.gradient, &newest.gradient)?;
        (changed && self.n_lost == 0).then(|| Warp { gradient, ..self.predict() })
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
    fn a_turn_goes_on() {
        let turned = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            Warp { gradient: [cos - 1.0, -sin, sin, cos - 1.0], ..Warp::at([10.0, 20.0]) }
        };
        let mut history = History::starting_at(turned(0.2));
        assert_eq!(history.predict_turning(), None);
        history.found(turned(0.7));
        let next = history.predict_turning().unwrap();
        let off =
            next.gradient.iter().zip(turned(1.2).gradient).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-14, "rounding of two products: {off}");
    }

    #[test]
    fn the_whole_frame_is_searched_as_long_as_a_subset_is_lost() {
        let mut history = History::starting_at(Warp::at([0.0, 0.0]));
        let (mut upright, mut turned) = (Vec::new(), Vec::new());
        for n_lost in 0..200 {
            for search in history.searches().iter().filter(|search| search.reach == Reach::Whole) {
                if search.deformations.is_none() { upright.push(n_lost) } else { turned.push(n_lost) }
            }
            history.lost();
        }
        assert_eq!(upright, [vec![2], (16..200).step_by(16).collect()].concat());
        assert_eq!(turned, [2, 16, 64, 128, 192]);
    }

    #[test]
    fn a_subset_is_searched_for_the_farther_the_longer_it_is_lost() {
        let mut history = History::starting_at(Warp::at([0.0, 0.0]));
        let farthest = |history: &History| {
            let radii = |search: &Search| match search.reach {
                Reach::Radii(n) => n,
                Reach::Whole => 0,
            };
            history.searches().iter().map(radii).max()
        };
        let mut reached = Vec::new();
        for n_lost in 0..64 {
            if [4, 12, 20, 28, 60].contains(&n_lost) {
                reached.push(farthest(&history).unwrap());
            }
            history.lost();
        }
        assert_eq!(reached, [1, 2, 3, 4, 4]);
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
