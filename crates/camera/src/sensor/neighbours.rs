//! What the neighbours of a pixel say that it should show: interpolation over a defect.

/// How far away a neighbour may be when all nearer ones are defects.
pub(super) const MOST_REACH_PX: usize = 4;

/// A picture, or the part of one, whose pixels may be good or defective.
pub(super) struct Surroundings<'a, C, G> {
    pub(super) width_px: usize,
    pub(super) height_px: usize,
    /// Count of a pixel by its column and row.
    pub(super) count: &'a C,
    /// Whether a pixel can be relied on.
    pub(super) is_good: &'a G,
}

impl<C: Fn(usize, usize) -> f64, G: Fn(usize, usize) -> bool> Surroundings<'_, C, G> {
    /// The count that a pixel's good neighbours make likely, whatever it shows itself; `None` where none is good within
    /// [`MOST_REACH_PX`].
    ///
    /// The cubic through the two nearest pixels on each side, along the row and along the column, as far as these are good: exact to
    /// the third order of the picture. Else the straight line between the nearest on both sides, else the mean of the nearest
    /// ring with a good pixel.
    pub(super) fn expected(&self, x: usize, y: usize) -> Option<f64> {
        let axes = [(1, 0), (0, 1)];
        let cubic = |&(dx, dy): &(isize, isize)| {
            let near = self.at(x, y, (dx, dy))? + self.at(x, y, (-dx, -dy))?;
            let far = self.at(x, y, (2 * dx, 2 * dy))? + self.at(x, y, (-2 * dx, -2 * dy))?;
            Some((4.0 * near - far) / 6.0)
        };
        let linear =
            |&(dx, dy): &(isize, isize)| Some((self.at(x, y, (dx, dy))? + self.at(x, y, (-dx, -dy))?) / 2.0);
        mean(axes.iter().filter_map(cubic))
            .or_else(|| mean(axes.iter().filter_map(linear)))
            .or_else(|| (1..=MOST_REACH_PX as isize).find_map(|radius| self.ring(x, y, radius)))
    }

    /// The mean of the good pixels on a square about a pixel.
    fn ring(&self, x: usize, y: usize, radius: isize) -> Option<f64> {
        let side = -radius..=radius;
        let places = side.clone().flat_map(|dy| side.clone().map(move |dx| (dx, dy)));
        let on_ring = places.filter(|(dx, dy)| dx.abs().max(dy.abs()) == radius);
        mean(on_ring.filter_map(|step| self.at(x, y, step)))
    }

    /// The count of a good pixel some steps from another.
    fn at(&self, x: usize, y: usize, (dx, dy): (isize, isize)) -> Option<f64> {
        let (x, y) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
        (x < self.width_px && y < self.height_px && (self.is_good)(x, y)).then(|| (self.count)(x, y))
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
    (n > 0.0).then(|| sum / n)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 9;

    fn expected(
        count: impl Fn(usize, usize) -> f64,
        bad: &[(usize, usize)],
        at: (usize, usize),
    ) -> Option<f64> {
        let is_good = |x: usize, y: usize| !bad.contains(&(x, y));
        Surroundings { width_px: SIDE, height_px: SIDE, count: &count, is_good: &is_good }
            .expected(at.0, at.1)
    }

    #[test]
    fn a_cubic_picture_is_continued_exactly() {
        let cubic = |x: usize, y: usize| {
            let (x, y) = (x as f64 - 3.0, y as f64 - 5.0);
            7.0 + 2.0 * x - y + 0.5 * x * x + x * y - 0.25 * y * y + 0.125 * x * x * x - y * y * y
        };
        for at in [(4, 4), (2, 6), (4, 1), (8, 4)] {
            let found = expected(cubic, &[at], at).unwrap();
            // Near an edge one direction is left; the numbers are sums of small binary fractions.
            assert!((found - cubic(at.0, at.1)).abs() < 1e-12, "{at:?}: {found}");
        }
    }

    #[test]
    fn what_is_left_of_the_neighbours_is_used() {
        let ramp = |x: usize, y: usize| 3.0 * x as f64 + y as f64;
        // Both far neighbours are bad: the line through the near ones is exact for a ramp.
        let far = [(4, 4), (2, 4), (4, 2)];
        assert_eq!(expected(ramp, &far, (4, 4)), Some(16.0));
        // No axis is left: the corners of the ring are.
        let cross = [(4, 4), (3, 4), (4, 3), (5, 4), (4, 5)];
        assert_eq!(expected(ramp, &cross, (4, 4)), Some(16.0));
        let all: Vec<(usize, usize)> = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))).collect();
        assert_eq!(expected(ramp, &all, (4, 4)), None);
    }
}
