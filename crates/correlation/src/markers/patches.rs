//! Patches: connected pixels whose texture is above a threshold.

use std::ops::Range;

use crate::markers::texture::{RADIUS_PX, Texture};

/// Smallest width and height of a patch, in pixels: where two edges cross, the averages make one of twice the radius.
const LEAST_SIDE_PX: usize = 2 * RADIUS_PX + 4;
/// Least share of its rectangle that a patch fills: half for a square that stands on a corner.
const LEAST_FILL: f64 = 0.4;

/// A patch of texture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Patch {
    /// First column and row.
    pub(crate) first: [usize; 2],
    /// Last column and row.
    pub(crate) last: [usize; 2],
    /// Pixels.
    pub(crate) area: usize,
    /// Its pixels times the root of its mean texture.
    pub(crate) texture: f64,
}

impl Patch {
    /// The rectangle of a half size around a place; `None` where the picture does not hold all of it.
    pub(crate) fn around(centre_px: [f64; 2], half_px: [f64; 2], size: [usize; 2]) -> Option<Self> {
        let ends = [0, 1].map(|axis| [-1.0, 1.0].map(|way| (centre_px[axis] + way * half_px[axis]).round()));
        let inside = |axis: usize| ends[axis][0] >= 0.0 && ends[axis][1] < size[axis] as f64;
        let corner = |end: usize| [0, 1].map(|axis| ends[axis][end] as usize);
        let [width, height] = ends.map(|[first, last]| last - first + 1.0);
        (inside(0) && inside(1)).then(|| Self {
            first: corner(0),
            last: corner(1),
            area: (width * height) as usize,
            texture: 0.0,
        })
    }

    /// Its width and height, in pixels.
    pub(crate) fn sides_px(&self) -> [usize; 2] {
        [0, 1].map(|axis| self.last[axis] + 1 - self.first[axis])
    }

    /// The same with the texture that all of it has, if that of its middle goes on to its edge.
    pub(crate) fn of_texture(self, in_middle: f64) -> Self {
        Self { texture: self.area as f64 * in_middle.sqrt(), ..self }
    }

    /// Half of its width and height.
    pub(crate) fn half_px(&self) -> [f64; 2] {
        [0, 1].map(|axis| 0.5 * (self.last[axis] - self.first[axis]) as f64)
    }

    /// The middle of its rectangle.
    pub(crate) fn centre_px(&self) -> [f64; 2] {
        [0, 1].map(|axis| 0.5 * (self.last[axis] + self.first[axis]) as f64)
    }

    /// The pixel in its middle.
    pub(crate) fn middle(&self) -> [usize; 2] {
        [0, 1].map(|axis| usize::midpoint(self.last[axis], self.first[axis]))
    }

    /// Columns and rows of the middle half of its rectangle.
    pub(crate) fn core(&self) -> [Range<usize>; 2] {
        [0, 1].map(|axis| {
            let quarter = (self.last[axis] - self.first[axis]) / 4;
            self.first[axis] + quarter..self.last[axis] + 1 - quarter
        })
    }

    /// Whether two thresholds show the same, to a pixel.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        [0, 1].iter().all(|&axis| {
            self.first[axis].abs_diff(other.first[axis]) <= 1
                && self.last[axis].abs_diff(other.last[axis]) <= 1
        })
    }

    /// Whether it reaches from side to side and from top to bottom.
    pub(crate) fn is_everywhere(&self, size: [usize; 2]) -> bool {
        [0, 1].iter().all(|&axis| self.is_cut(size, axis) == [true, true])
    }

    /// Whether it touches the picture's two sides along an axis, but for what the averages blur.
    pub(crate) fn is_cut(&self, size: [usize; 2], axis: usize) -> [bool; 2] {
        [self.first[axis] <= 1, self.last[axis] + 2 >= size[axis]]
    }
}

/// Adds the markers that no level before has shown.
pub(crate) fn add_new(markers: &mut Vec<Patch>, shown: impl Iterator<Item = Patch>) {
    for marker in shown {
        if !markers.iter().any(|found| found.is_same(&marker)) {
            markers.push(marker);
        }
    }
}

/// The patches above a threshold that could be markers, in the order of their first pixels.
pub(crate) fn patches(texture: &Texture, threshold: f32) -> Vec<Patch> {
    connected(texture, texture.values.iter().map(|value| *value > threshold).collect())
}

/// The patches of `open` pixels that hang together and could be markers, in the order of their first pixels.
pub(crate) fn connected(texture: &Texture, mut open: Vec<bool>) -> Vec<Patch> {
    let [width, height] = texture.size;
    let (mut found, mut stack) = (Vec::new(), Vec::new());
    for start in 0..open.len() {
        if !std::mem::take(&mut open[start]) {
            continue;
        }
        let (mut first, mut last) = ([width, height], [0, 0]);
        let (mut area, mut sum) = (0_usize, 0.0);
        stack.push(start);
        while let Some(i) = stack.pop() {
            let at = [i % width, i / width];
            for axis in [0, 1] {
                first[axis] = first[axis].min(at[axis]);
                last[axis] = last[axis].max(at[axis]);
            }
            area += 1;
            sum += f64::from(texture.values[i]);
            let beside = [
                (at[0] > 0, i.wrapping_sub(1)),
                (at[0] + 1 < width, i + 1),
                (at[1] > 0, i.wrapping_sub(width)),
                (at[1] + 1 < height, i + width),
            ];
            stack.extend(
                beside
                    .into_iter()
                    .filter(|&(inside, j)| inside && std::mem::take(&mut open[j]))
                    .map(|(_, j)| j),
            );
        }
        let sides = [0, 1].map(|axis| last[axis] + 1 - first[axis]);
        let fill = area as f64 / (sides[0] * sides[1]) as f64;
        if sides.iter().all(|side| *side >= LEAST_SIDE_PX) && fill >= LEAST_FILL {
            found.push(Patch { first, last, area, texture: (area as f64 * sum).sqrt() });
        }
    }
    found
}
