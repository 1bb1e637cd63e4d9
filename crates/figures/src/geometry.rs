/// A place on the page: millimetres from the top left corner, y down.
pub(crate) type Spot = (f64, f64);

/// An upright rectangle on the page, in millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) right: f64,
    pub(crate) bottom: f64,
}

impl Frame {
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

/// Cuts a polyline into dashes: `pattern` holds the lengths of dash, space, dash, space and so on, in millimetres.
pub(crate) fn dashes(points: &[Spot], pattern: &[f64]) -> Vec<Vec<Spot>> {
    let mut pieces = Vec::new();
    let mut piece: Vec<Spot> = points.first().copied().into_iter().collect();
    let mut turn = 0;
    let mut left_mm = pattern[0];
    for pair in points.windows(2) {
        let (mut from, to) = (pair[0], pair[1]);
        let mut length = (to.0 - from.0).hypot(to.1 - from.1);
        while length > left_mm {
            let share = left_mm / length;
            from = (from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1));
            length -= left_mm;
            if turn % 2 == 0 {
                piece.push(from);
                pieces.push(std::mem::take(&mut piece));
            } else {
                piece = vec![from];
            }
            turn += 1;
            left_mm = pattern[turn % pattern.len()];
        }
        left_mm -= length;
        if turn.is_multiple_of(2) {
            piece.push(to);
        }
    }
    if piece.len() > 1 {
        pieces.push(piece);
    }
    pieces
}

/// Spots at equal distances along a polyline, the first at its start.
pub(crate) fn spaced(points: &[Spot], distance_mm: f64) -> Vec<Spot> {
    let tiny = 1e-6 * distance_mm;
    dashes(points, &[tiny, distance_mm - tiny]).iter().filter_map(|dash| dash.first().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame { left: 0.0, top: 0.0, right: 10.0, bottom: 5.0 };

    #[test]
    fn clipping_cuts_at_the_border_and_splits_a_line_that_leaves() {
        let pieces = FRAME.clip(&[(-5.0, 1.0), (5.0, 1.0), (5.0, 9.0), (7.0, 9.0), (7.0, 2.0)]);
        assert_eq!(pieces, vec![vec![(0.0, 1.0), (5.0, 1.0), (5.0, 5.0)], vec![(7.0, 5.0), (7.0, 2.0)]]);
        assert!(FRAME.clip(&[(-1.0, -1.0), (11.0, -1.0)]).is_empty());
    }

    #[test]
    fn dashes_run_on_around_corners_and_keep_their_total_length() {
        let path = [(0.0, 0.0), (3.0, 0.0), (3.0, 4.0)];
        let pieces = dashes(&path, &[2.0, 1.0]);
        let drawn: f64 = pieces
            .iter()
            .flat_map(|piece| piece.windows(2).map(|p| (p[1].0 - p[0].0).hypot(p[1].1 - p[0].1)))
            .sum();
        // Of 7 mm: dash 2, space 1, dash 2, space 1, dash 1. Sums of small whole numbers are exact to rounding.
        assert!((drawn - 5.0).abs() < 1e-12);
        assert_eq!(spaced(&path, 3.5).len(), 2);
    }
}
