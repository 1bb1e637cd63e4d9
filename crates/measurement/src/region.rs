//! Rectangles of whole pixels.

/// A half-open rectangle of whole pixels: columns `x..x + width`, rows `y..y + height`, from the top left pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Region {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
}

impl Region {
    /// The whole of a frame of the given size.
    pub fn whole(width: usize, height: usize) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// Number of pixels.
    pub fn n_pixels(&self) -> usize {
        self.width * self.height
    }

    /// Whether every pixel lies in a frame of `width` by `height` pixels.
    pub fn fits_in(&self, width: usize, height: usize) -> bool {
        self.x.checked_add(self.width).is_some_and(|right| right <= width)
            && self.y.checked_add(self.height).is_some_and(|bottom| bottom <= height)
    }

    /// The least region that holds this one and another that it meets; `None` where they have no pixel in common.
    #[must_use]
    pub fn joined_with(&self, other: Self) -> Option<Self> {
        let (right, bottom) = (self.x + self.width, self.y + self.height);
        let (other_right, other_bottom) = (other.x + other.width, other.y + other.height);
        let meets = self.x < other_right && other.x < right && self.y < other_bottom && other.y < bottom;
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        let (width, height) = (right.max(other_right) - x, bottom.max(other_bottom) - y);
        meets.then_some(Self { x, y, width, height })
    }

    /// The part of the rectangle `x0..x1`, `y0..y1` (which may reach outside) that lies in a frame of `width` by
    /// `height` pixels; `None` when they do not meet.
    pub fn clipped(x0: i64, y0: i64, x1: i64, y1: i64, width: usize, height: usize) -> Option<Self> {
        let inside = |value: i64, limit: usize| usize::try_from(value).unwrap_or(0).min(limit);
        let (left, right) = (inside(x0, width), inside(x1, width));
        let (top, bottom) = (inside(y0, height), inside(y1, height));
        (left < right && top < bottom).then(|| Self {
            x: left,
            y: top,
            width: right - left,
            height: bottom - top,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clipping_keeps_the_common_part() {
        let clipped = Region::clipped(-3, 2, 5, 40, 10, 20);
        assert_eq!(clipped, Some(Region { x: 0, y: 2, width: 5, height: 18 }));
        assert_eq!(Region::clipped(10, 0, 12, 5, 10, 20), None);
        assert_eq!(Region::clipped(-5, 0, 0, 5, 10, 20), None);
    }

    #[test]
    fn regions_that_meet_are_joined_whole() {
        let one = Region { x: 2, y: 3, width: 4, height: 5 };
        let joined = one.joined_with(Region { x: 5, y: 1, width: 6, height: 3 });
        assert_eq!(joined, Some(Region { x: 2, y: 1, width: 9, height: 7 }));
        assert_eq!(one.joined_with(Region { x: 6, y: 3, width: 1, height: 1 }), None);
        assert_eq!(one.joined_with(one), Some(one));
    }

    #[test]
    fn a_region_that_overflows_does_not_fit() {
        assert!(Region::whole(10, 20).fits_in(10, 20));
        assert!(!Region { x: usize::MAX, y: 0, width: 2, height: 1 }.fits_in(10, 20));
    }
}
