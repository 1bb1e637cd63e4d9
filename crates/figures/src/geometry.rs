//! Places on the page: upright rectangles, the part of a line inside one, and the steps of a path.

/// A place on the page: millimetres from the top left corner, y down.
pub(crate) type Spot = (f64, f64);

/// One step of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum PathStep {
    Move(Spot),
    Line(Spot),
    /// A cubic arc: two controls and its end.
    Cubic(Spot, Spot, Spot),
    Close,
}

impl PathStep {
    /// The step with each of its spots moved by `place`.
    pub(crate) fn placed(self, place: impl Fn(Spot) -> Spot) -> Self {
        match self {
            Self::Move(to) => Self::Move(place(to)),
            Self::Line(to) => Self::Line(place(to)),
            Self::Cubic(first, second, to) => Self::Cubic(place(first), place(second), place(to)),
            Self::Close => Self::Close,
        }
    }
}

/// The steps along a polyline.
pub(crate) fn polyline(points: &[Spot]) -> impl Iterator<Item = PathStep> + '_ {
    points
        .iter()
        .enumerate()
        .map(|(i, &spot)| if i == 0 { PathStep::Move(spot) } else { PathStep::Line(spot) })
}

/// An upright rectangle on the page, in millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PageRect {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) right: f64,
    pub(crate) bottom: f64,
}

impl PageRect {
    pub(crate) fn new(left: f64, top: f64, width: f64, height: f64) -> Self {
        Self { left, top, right: left + width, bottom: top + height }
    }

    pub(crate) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(crate) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    pub(crate) fn centre(&self) -> Spot {
        (0.5 * (self.left + self.right), 0.5 * (self.top + self.bottom))
    }

    /// The rectangle grown by `margin` on all sides.
    pub(crate) fn grown(&self, margin: f64) -> Self {
        let Self { left, top, right, bottom } = *self;
        Self { left: left - margin, top: top - margin, right: right + margin, bottom: bottom + margin }
    }

    /// Whether the two have more than a border in common.
    pub(crate) fn meets(&self, other: &Self) -> bool {
        self.right > other.left
            && other.right > self.left
            && self.bottom > other.top
            && other.bottom > self.top
    }

    /// Whether the spot lies inside, or outside by less than a hundredth of a millimetre (rounding).
    pub(crate) fn holds(&self, (x, y): Spot) -> bool {
        let margin = 0.01;
        (self.left - margin..=self.right + margin).contains(&x)
            && (self.top - margin..=self.bottom + margin).contains(&y)
    }

    pub(crate) fn corners(&self) -> [Spot; 4] {
        [(self.left, self.top), (self.right, self.top), (self.right, self.bottom), (self.left, self.bottom)]
    }

    /// The part of the segment that lies inside (Liang and Barsky).
    pub(crate) fn clip_segment(&self, from: Spot, to: Spot) -> Option<(Spot, Spot)> {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let limits = [
            (-dx, from.0 - self.left),
            (dx, self.right - from.0),
            (-dy, from.1 - self.top),
            (dy, self.bottom - from.1),
        ];
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for (slope, room) in limits {
            if slope < 0.0 {
                enter = enter.max(room / slope);
            } else if slope > 0.0 {
                leave = leave.min(room / slope);
            } else if room < 0.0 {
                return None;
            }
        }
        let at = |share: f64| (from.0 + share * dx, from.1 + share * dy);
        // An end that lies inside is kept to the last bit, so that the next segment joins on.
        let start = if enter > 0.0 { at(enter) } else { from };
        let end = if leave < 1.0 { at(leave) } else { to };
        (enter <= leave).then_some((start, end))
    }

    /// The parts of a polyline that lie inside.
    pub(crate) fn clip(&self, points: &[Spot]) -> Vec<Vec<Spot>> {
        let mut pieces: Vec<Vec<Spot>> = Vec::new();
        for pair in points.windows(2) {
            let Some((from, to)) = self.clip_segment(pair[0], pair[1]) else { continue };
            match pieces.last_mut() {
                Some(piece) if piece.last() == Some(&from) => piece.push(to),
                _ => pieces.push(vec![from, to]),
            }
        }
        pieces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: PageRect = PageRect { left: 0.0, top: 0.0, right: 10.0, bottom: 5.0 };

    #[test]
    fn clipping_cuts_at_the_border_and_splits_a_line_that_leaves() {
        let pieces = FRAME.clip(&[(-5.0, 1.0), (5.0, 1.0), (5.0, 9.0), (7.0, 9.0), (7.0, 2.0)]);
        assert_eq!(pieces, vec![vec![(0.0, 1.0), (5.0, 1.0), (5.0, 5.0)], vec![(7.0, 5.0), (7.0, 2.0)]]);
        assert!(FRAME.clip(&[(-1.0, -1.0), (11.0, -1.0)]).is_empty());
    }
}
