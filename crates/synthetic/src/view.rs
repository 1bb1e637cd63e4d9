//! Where each pixel looks: its sight in the ideal picture, through the optics or straight on.

use std::ops::Range;

use crate::SyntheticError;
use crate::optics::{Mapping, Optics};
use crate::settings::Camera;

/// Points tried along each side of a box whose place in the picture is sought.
const SIDE_POINTS: usize = 9;

/// Pixels around such a box, for what its sides bulge between those points.
const MARGIN_PX: f64 = 2.0;

/// Where the picture shows what: for each pixel the point of an ideal picture that it looks at.
pub(crate) struct PixelView {
    width_px: usize,
    height_px: usize,
    warp: Option<PixelMap>,
}

/// The optics' mapping, and what it does to each pixel.
struct PixelMap {
    mapping: Mapping,
    /// Row of the first sight.
    first_row: usize,
    sights: Vec<Sight>,
}

/// What one pixel looks at, in the pixels of an ideal picture: its centre and its sides.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight {
    pub(crate) centre_px: [f64; 2],
    /// From the middle of the left side to that of the right one.
    pub(crate) across_px: [f64; 2],
    /// From the middle of the upper side to that of the lower one.
    pub(crate) down_px: [f64; 2],
}

impl Sight {
    /// The same sight, seen from `origin_px`.
    pub(crate) fn from(self, origin_px: [f64; 2]) -> Self {
        let centre_px = [self.centre_px[0] - origin_px[0], self.centre_px[1] - origin_px[1]];
        Self { centre_px, ..self }
    }
}

impl PixelView {
    /// # Errors
    /// [`SyntheticError::Setting`] when the lens folds the picture over within the frame.
    pub(crate) fn new(camera: &Camera) -> Result<Self, SyntheticError> {
        Self::through(camera.optics.as_ref(), camera, 0..camera.height_px)
    }

    /// The view of some rows when the camera has turned about its optical axis.
    ///
    /// # Errors
    /// As [`PixelView::new`].
    pub(crate) fn turned(camera: &Camera, turn_rad: f64, rows: Range<usize>) -> Result<Self, SyntheticError> {
        let optics = camera.optics.unwrap_or(Optics::STRAIGHT);
        let turned = Optics { roll_rad: optics.roll_rad + turn_rad, ..optics };
        Self::through(Some(&turned), camera, rows)
    }

    fn through(optics: Option<&Optics>, camera: &Camera, rows: Range<usize>) -> Result<Self, SyntheticError> {
        let [width_px, height_px] = [camera.width_px, camera.height_px];
        let warp = optics.map(|optics| {
            let mapping = Mapping::new(optics, [width_px, height_px]);
            let sight =
                |pixel: usize| sight(&mapping, [(pixel % width_px) as f64, (pixel / width_px) as f64]);
            let sights = (rows.start * width_px..rows.end * width_px).map(sight).collect::<Option<Vec<_>>>();
            let folded = || SyntheticError::Setting {
                name: "camera.optics",
                expected: "a lens that shows every point of the frame once",
                found: "a picture folded over (weaken k1, k2, p1, p2, or lengthen focal_length_px)".into(),
            };
            Ok(PixelMap { sights: sights.ok_or_else(folded)?, first_row: rows.start, mapping })
        });
        Ok(Self { width_px, height_px, warp: warp.transpose()? })
    }

    /// An ideal camera's view.
    #[cfg(test)]
    pub(crate) fn straight(width_px: usize, height_px: usize) -> Self {
        Self { width_px, height_px, warp: None }
    }

    /// Whether pixels look elsewhere than an ideal camera's.
    pub(crate) fn is_warped(&self) -> bool {
        self.warp.is_some()
    }

    pub(crate) fn sight(&self, column: usize, row: usize) -> Sight {
        match &self.warp {
            Some(warp) => warp.sights[(row - warp.first_row) * self.width_px + column],
            None => {
                Sight { centre_px: [column as f64, row as f64], across_px: [1.0, 0.0], down_px: [0.0, 1.0] }
            }
        }
    }

    /// The pixel that shows a point of the ideal picture.
    pub(crate) fn picture_px(&self, ideal_px: [f64; 2]) -> [f64; 2] {
        self.warp.as_ref().map_or(ideal_px, |warp| warp.mapping.picture_px(ideal_px))
    }

    /// The columns and rows of the frame that may show a box of the ideal picture, given by its centre and half sizes.
    pub(crate) fn region(&self, centre_px: [f64; 2], half_px: [f64; 2]) -> [Range<usize>; 2] {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        let steps = if self.is_warped() { SIDE_POINTS - 1 } else { 1 };
        let share = |step: usize| 2.0 * step as f64 / steps as f64 - 1.0;
        for along in (0..=steps).map(share) {
            for [x, y] in [[along, -1.0], [along, 1.0], [-1.0, along], [1.0, along]] {
                let seen_px = self.picture_px([centre_px[0] + x * half_px[0], centre_px[1] + y * half_px[1]]);
                for axis in 0..2 {
                    low[axis] = low[axis].min(seen_px[axis]);
                    high[axis] = high[axis].max(seen_px[axis]);
                }
            }
        }
        let pixels = |axis: usize, size_px: usize| {
            let inside = |edge_px: f64| edge_px.clamp(0.0, size_px as f64) as usize;
            inside((low[axis] - MARGIN_PX).floor())..inside((high[axis] + MARGIN_PX).ceil() + 1.0)
        };
        [pixels(0, self.width_px), pixels(1, self.height_px)]
    }
}

/// What the pixel at (column, row) looks at; `None` where the lens folds the picture over. The sides follow from their
/// middles, so what is left out is the lens's change within one pixel.
fn sight(mapping: &Mapping, [column, row]: [f64; 2]) -> Option<Sight> {
    let side = |from: [f64; 2], to: [f64; 2]| {
        let (from, to) = (mapping.ideal_px(from)?, mapping.ideal_px(to)?);
        Some([to[0] - from[0], to[1] - from[1]])
    };
    Some(Sight {
        centre_px: mapping.ideal_px([column, row])?,
        across_px: side([column - 0.5, row], [column + 0.5, row])?,
        down_px: side([column, row - 0.5], [column, row + 0.5])?,
    })
}
