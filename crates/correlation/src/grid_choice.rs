//! The grid of a field by the pictures themselves: subsets by the texture, smaller ones where the field bends, points half a subset's half
//! apart.

use std::num::NonZero;

use chainwave_measurement::{Lost, median};

use crate::field::{Field, FieldGrid, FieldPoint, correlate};
use crate::subset_size::{BORDER_PX, LEAST_HALF_PX, MOST_HALF_PX, SizeReason, Tried, best_within};
use crate::{CorrelationError, Reference, Settings, ShapeChoice, Window};

/// Places along each side of the picture that are looked at.
const N_PLACES: usize = 5;
/// Share of the places with texture that a size suits.
const MOST_PLACES: f64 = 0.9;
/// Subsets, edge to edge, that the longer side of the picture holds at least, or there is no field to speak of.
const LEAST_SUBSETS: usize = 3;
/// A field that is stated worse than the floor of its noise by more than this factor may bend too much for its subsets; also the step from one
/// size to the next smaller one that is tried.
const SMALLER: f64 = std::f64::consts::SQRT_2;

/// A grid, and why it was taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChosenGrid {
    /// The grid.
    pub grid: FieldGrid,
    /// The noise floor of a point, along the worse axis, that nine of ten places keep, in pixels.
    pub floor_px: f64,
    /// What settled the size of its subsets.
    pub reason: SizeReason,
}

impl FieldGrid {
    /// Subsets of `half_px`, with the step that goes with them: half of that, rounded up.
    ///
    /// A subset passes no wave as short as its side, so a step of its half would do to sample what it passes; half of that leaves
    /// four points to the shortest wave, and makes the strain over five points one over a subset's side.
    pub fn with_half(half_px: usize) -> Self {
        Self { step_px: half_px.div_ceil(2).max(1), half_px }
    }
}

impl ChosenGrid {
    /// The grid whose subsets are the smallest that keep the noise within `error_px` at nine of ten places with texture, and that chance does
    /// not resemble there.
    ///
    /// # Errors
    /// [`CorrelationError::NoTexture`] where no place has any, [`CorrelationError::GridTooLarge`] where the picture holds no subset.
    pub fn by_texture(reference: &Reference, error_px: f64) -> Result<Self, CorrelationError> {
        let region = reference.region();
        let (shorter, longer) = (region.width.min(region.height), region.width.max(region.height));
        let in_frame = (shorter.saturating_sub(1) / 2).saturating_sub(BORDER_PX);
        let most = in_frame.min(longer / (2 * LEAST_SUBSETS)).min(MOST_HALF_PX);
        if most == 0 {
            let (width_px, height_px) = (region.width, region.height);
            return Err(CorrelationError::GridTooLarge { half_px: 1, width_px, height_px });
        }
        let least = most.min(LEAST_HALF_PX) + BORDER_PX;
        let line = |first: usize, n: usize| -> Vec<usize> {
            let span = n.saturating_sub(2 * least + 1);
            let mut places: Vec<usize> =
                (0..N_PLACES).map(|i| first + least + span * (2 * i + 1) / (2 * N_PLACES)).collect();
            places.dedup();
            places
        };
        let (columns, rows) = (line(region.x, region.width), line(region.y, region.height));
        let room = |place: usize, first: usize, n: usize| {
            let from_edge = (place - first).min((first + n - 1).saturating_sub(place));
            from_edge.saturating_sub(BORDER_PX).min(most)
        };
        let at = |&x: &usize, &y: &usize| {
            let half = room(x, region.x, region.width).min(room(y, region.y, region.height));
            (best_within(reference, [x as f64, y as f64], [half; 2], error_px), half)
        };
        let tried: Vec<(Tried, usize)> =
            rows.iter().flat_map(|y| columns.iter().map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect();
        let n_places = tried.len();
        let mut sizes: Vec<(usize, SizeReason, f64)> = tried
            .into_iter()
            .filter_map(|(tried, room)| {
                let settled = tried.reason != SizeReason::Bounded;
                let floor_px = tried.floor_px?;
                // at the edge of the picture there may be too little room to tell
                (settled || room == most).then_some((tried.half_px[0], tried.reason, floor_px))
            })
            .collect();
        sizes.sort_by_key(|(half, ..)| *half);
        let index = ((MOST_PLACES * sizes.len() as f64).ceil() as usize).saturating_sub(1);
        let (half_px, reason, floor_px) =
            *sizes.get(index).ok_or(CorrelationError::NoTexture { n_places })?;
        Ok(Self { grid: FieldGrid::with_half(half_px), floor_px, reason })
    }

    /// The field of a pair of pictures on this grid, or on one of smaller subsets where the field bends too much for these; and the grid that
    /// it has.
    ///
    /// What bending leaves in a subset grows with its size. It is told by subsets that are smaller by a square root of 2: they disagree
    /// with the larger ones by more than noise has them do, or they are stated better where the larger ones are stated worse than their
    /// noise. Then they are held against smaller ones in turn.
    ///
    /// # Errors
    /// As [`correlate`].
    pub fn correlate(self, pair: &PicturePair<'_>, error_px: f64) -> Result<(Self, Field), CorrelationError> {
        let mut best = self;
        let mut field = pair.field(best.grid)?;
        let mut best_px = stated_px(&field);
        loop {
            let half_px = (best.grid.half_px as f64 / SMALLER).round() as usize;
            if half_px < LEAST_HALF_PX {
                break;
            }
            let grid = FieldGrid::with_half(half_px);
            let smaller = pair.field(grid)?;
            let smaller_px = stated_px(&smaller);
            let is_better = best_px > SMALLER * best.floor_px.max(error_px) && smaller_px < best_px;
            if !is_better && !disagrees(&field, &smaller, best_px, smaller_px) {
                break;
            }
            best = Self { grid, reason: SizeReason::Bending, ..best };
            (field, best_px) = (smaller, smaller_px);
        }
        Ok((best, field))
    }
}

/// Whether a field differs from one of smaller subsets by more than noise makes it.
///
/// Of two estimates from the same noise of which the one has all that the other has and more, the difference has the difference of their
/// variances (J. A. Hausman, Econometrica 46 (1978) 1251-1271).
fn disagrees(larger: &Field, smaller: &Field, larger_px: f64, smaller_px: f64) -> bool {
    let differences = larger.points.iter().filter_map(|point| {
        let here = moved(point)?;
        let there = smaller.interpolated([point.x_px, point.y_px])?;
        Some(0.5 * ((here[0] - there[0]).powi(2) + (here[1] - there[1]).powi(2)))
    });
    let Some(square) = median(differences.collect()) else { return false };
    // half the sum of two squares of normal numbers has its median at ln 2
    let found_px = (square / std::f64::consts::LN_2).sqrt();
    let by_noise_px = (smaller_px.powi(2) - larger_px.powi(2)).max(0.25 * smaller_px.powi(2)).sqrt();
    found_px > SMALLER * by_noise_px
}

/// The displacement of a point that was found.
fn moved(point: &FieldPoint) -> Option<[f64; 2]> {
    let position = point.found.as_ref().ok()?.position;
    Some([position.x_px.value - point.x_px, position.y_px.value - point.y_px])
}

impl Field {
    /// The displacement between four points that were found.
    fn interpolated(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let (first, step) = (self.points.first()?, self.step_px as f64);
        let n_rows = self.points.len() / self.n_columns;
        let along = |value: f64, n: usize| {
            let at = value / step;
            let index = (at.max(0.0) as usize).min(n.saturating_sub(2));
            (index, at - index as f64)
        };
        let ((column, s), (row, t)) = (along(x - first.x_px, self.n_columns), along(y - first.y_px, n_rows));
        let at = |i: usize, j: usize| {
            let (column, row) = ((column + i).min(self.n_columns - 1), (row + j).min(n_rows - 1));
            moved(&self.points[row * self.n_columns + column])
        };
        let corners = [at(0, 0)?, at(1, 0)?, at(0, 1)?, at(1, 1)?];
        let weights = [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
        Some([0, 1].map(|axis| corners.iter().zip(weights).map(|(corner, w)| corner[axis] * w).sum()))
    }
}

/// Two pictures, and how they are compared, as [`correlate`] takes them.
#[derive(Clone, Copy)]
pub struct PicturePair<'a> {
    /// The picture whose points are looked for.
    pub reference: &'a Reference,
    /// The deformed picture.
    pub target: &'a Window,
    /// How subsets are matched.
    pub settings: &'a Settings,
    /// How their shape function is settled.
    pub choice: ShapeChoice,
    /// Threads; the result does not depend on them.
    pub n_threads: NonZero<usize>,
    /// Receives the number of points settled.
    pub progress: &'a (dyn Fn(u64) + Sync),
}

impl PicturePair<'_> {
    /// The field on a grid.
    ///
    /// # Errors
    /// As [`correlate`].
    pub fn field(&self, grid: FieldGrid) -> Result<Field, CorrelationError> {
        let Self { reference, target, settings, choice, n_threads, progress } = *self;
        correlate(reference, target, grid, settings, choice, n_threads, progress)
    }
}

/// The median of what is stated along the worse axis, of points with texture that stay in the picture; what is lost counts as the worst.
fn stated_px(field: &Field) -> f64 {
    let sigma = |point: &FieldPoint| match &point.found {
        Ok(found) => Some(found.position.x_px.sigma.max(found.position.y_px.sigma)),
        Err(Lost::NoTexture | Lost::OutOfView) => None,
        Err(_) => Some(f64::INFINITY),
    };
    median(field.points.iter().filter_map(sigma).collect()).unwrap_or(f64::INFINITY)
}
