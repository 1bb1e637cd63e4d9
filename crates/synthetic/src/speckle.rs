//! Speckle patterns: sums of Gaussians that are integrated in closed form over each pixel, so that a shift by any
//! fraction of a pixel is exact.

use std::f64::consts::SQRT_2;
use std::ops::Range;

use chainwave_vectors::dispatch_loop;
use ndarray::Array2;
use rand::RngExt;

use crate::blur::Blur;
use crate::seed::{Purpose, stream};
use crate::smear::{Smear, differences};

/// Distance from a speckle's centre, in standard deviations, beyond which it is left out: exp(-18) = 1.5e-8 of its
/// depth, some 2e-5 counts at 12 bits.
pub(crate) const REACH_SIGMA: f64 = 6.0;

/// Least distance between speckles, in diameters: close enough for a dense pattern, far enough that two speckles never
/// add up to much more than one.
const SPACING_DIAMETERS: f64 = 0.9;

/// Speckles tried per squared diameter of area; random sequential placement at this effort comes within a few percent of
/// its densest packing.
const TRIES_PER_SQUARED_DIAMETER: f64 = 25.0;

/// A rectangle with speckles, in pixels relative to its centre.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    pub(crate) half_width_px: f64,
    pub(crate) half_height_px: f64,
    pub(crate) sigma_px: f64,
    pub(crate) speckles: Vec<Speckle>,
}

/// One speckle: depth exp(-r^2 / (2 sigma^2)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Speckle {
    pub(crate) x_px: f64,
    pub(crate) y_px: f64,
    pub(crate) depth: f64,
}

impl Pattern {
    /// Speckles scattered at random, no two closer than 0.9 diameters, with depths between 0.8 and 1, on a rectangle of
    /// the given half sizes. `diameter_px` is where a speckle has fallen to 1/e. The pattern follows from `seed` and
    /// `index` alone.
    pub fn scattered(seed: u64, index: u64, half_size_px: [f64; 2], diameter_px: f64) -> Self {
        let [half_width_px, half_height_px] = half_size_px;
        let margin_px = diameter_px / 2.0; // speckles that the rectangle's edge cuts
        let reach_px = [half_width_px + margin_px, half_height_px + margin_px];
        let n_tries =
            TRIES_PER_SQUARED_DIAMETER * 4.0 * reach_px[0] * reach_px[1] / (diameter_px * diameter_px);
        let mut random = stream(Purpose::Speckle, seed, index);
        let mut places = TakenCells::new(reach_px, SPACING_DIAMETERS * diameter_px);
        let mut speckles = Vec::new();
        for _ in 0..n_tries.ceil() as usize {
            let x_px = random.random_range(-reach_px[0]..reach_px[0]);
            let y_px = random.random_range(-reach_px[1]..reach_px[1]);
            let depth = random.random_range(0.8..1.0);
            if places.take([x_px, y_px]) {
                speckles.push(Speckle { x_px, y_px, depth });
            }
        }
        Self { half_width_px, half_height_px, sigma_px: diameter_px / (2.0 * SQRT_2), speckles }
    }

    /// A rectangle without speckles.
    pub(crate) fn blank(half_size_px: [f64; 2]) -> Self {
        let [half_width_px, half_height_px] = half_size_px;
        Self { half_width_px, half_height_px, sigma_px: 1.0, speckles: Vec::new() }
    }

    /// The depth of the speckles averaged over each pixel of a frame, with the pattern's centre at (column, row)
    /// `centre_px`; a pixel that the rectangle's edge cuts counts only what lies within. Shape `[height, width]`.
    pub fn depth_image(&self, width_px: usize, height_px: usize, centre_px: [f64; 2]) -> Array2<f64> {
        let still = Blur::default();
        let (columns, rows) = (self.columns(centre_px[0], still), self.rows(centre_px[1], still));
        let mut depths = Vec::new();
        self.add_up(&columns, &rows, 0..rows.n_pixels(), &mut depths);
        let inside = |axis: &AxisIntegrals, at: usize| {
            usize::try_from(at as i64 - axis.first_px).ok().filter(|&pixel| pixel < axis.n_pixels())
        };
        Array2::from_shape_fn((height_px, width_px), |(row, column)| {
            let place = inside(&rows, row).zip(inside(&columns, column));
            place.map_or(0.0, |(row, column)| depths[row * columns.n_pixels() + column])
        })
    }

    /// The pattern's pixels along x when its centre is at the column `centre_px` in the middle of the exposure.
    pub(crate) fn columns(&self, centre_px: f64, blur: Blur) -> AxisIntegrals {
        let speckles_px = self.speckles.iter().map(|speckle| speckle.x_px);
        AxisIntegrals::new(Smear { half_px: self.half_width_px, blur }, self.sigma_px, centre_px, speckles_px)
    }

    /// The pattern's pixels along y when its centre is at the row `centre_px`; it moves along x only.
    pub(crate) fn rows(&self, centre_px: f64, blur: Blur) -> AxisIntegrals {
        let blur = Blur { path_px: 0.0, ..blur };
        let speckles_px = self.speckles.iter().map(|speckle| speckle.y_px);
        AxisIntegrals::new(
            Smear { half_px: self.half_height_px, blur },
            self.sigma_px,
            centre_px,
            speckles_px,
        )
    }

    /// Sets `depths` to the sum of the speckles in each pixel of some of the `rows` (counted from their first) by `columns`,
    /// row by row: a Gaussian's integral over a pixel is the product of its integrals along x and y.
    pub(crate) fn add_up(
        &self,
        columns: &AxisIntegrals,
        rows: &AxisIntegrals,
        summed: Range<usize>,
        depths: &mut Vec<f64>,
    ) {
        depths.clear();
        depths.resize(summed.len() * columns.n_pixels(), 0.0);
        dispatch_loop(
            #[inline(always)]
            || {
                for (index, speckle) in self.speckles.iter().enumerate() {
                    let (left, along_x) = columns.of_speckle(index);
                    let (top, along_y) = rows.of_speckle(index);
                    for (row, weight_y) in (top..).zip(along_y).filter(|(row, _)| summed.contains(row)) {
                        let start = (row - summed.start) * columns.n_pixels() + left;
                        let weight = speckle.depth * weight_y;
                        let depths = &mut depths[start..start + along_x.len()];
                        for (depth, weight_x) in depths.iter_mut().zip(along_x) {
                            *depth += weight * weight_x;
                        }
                    }
                }
            },
        );
    }
}

/// The pixels that a pattern covers along one axis, and each speckle's integral over them.
pub(crate) struct AxisIntegrals {
    /// First pixel, counted from the frame's edge.
    pub(crate) first_px: i64,
    /// Covered fraction of each pixel.
    pub(crate) covered: Vec<f64>,
    /// Pixels that one speckle reaches.
    span: usize,
    /// First reached pixel of each speckle, counted from `first_px`.
    starts: Vec<usize>,
    /// Integrals, `span` for each speckle.
    integrals: Vec<f64>,
}

impl AxisIntegrals {
    fn new(smear: Smear, sigma_px: f64, centre_px: f64, speckles_px: impl Iterator<Item = f64>) -> Self {
        let reach_px = smear.half_px + smear.spread_px();
        let first_px = (centre_px - reach_px + 0.5).floor() as i64;
        let last_px = (centre_px + reach_px + 0.5).floor() as i64;
        let n_pixels = (last_px - first_px) as usize + 1;
        let edge = |pixel: usize| (first_px + pixel as i64) as f64 - 0.5 - centre_px;
        let edges: Vec<f64> = (0..=n_pixels).map(edge).collect();
        let speckle_reach_px = REACH_SIGMA * smear.blur.widened(sigma_px).0 + smear.path_reach_px();
        let span = ((2.0 * speckle_reach_px).ceil() as usize + 2).min(n_pixels);
        let mut axis = Self {
            first_px,
            covered: differences(edges.iter().map(|&edge| smear.covered_up_to(edge))).collect(),
            span,
            starts: Vec::new(),
            integrals: Vec::new(),
        };
        for speckle_px in speckles_px {
            let reach_px = speckle_px + centre_px - speckle_reach_px;
            let start =
                ((reach_px + 0.5).floor() as i64 - first_px).clamp(0, (n_pixels - span) as i64) as usize;
            axis.starts.push(start);
            smear.gaussian_between(&edges[start..=start + span], speckle_px, sigma_px, &mut axis.integrals);
        }
        axis
    }

    pub(crate) fn n_pixels(&self) -> usize {
        self.covered.len()
    }

    /// Which of the pixels, counted from the first, lie in a part of the frame.
    pub(crate) fn seen(&self, part: &Range<usize>) -> Range<usize> {
        let inside = |edge: usize| (edge as i64 - self.first_px).clamp(0, self.n_pixels() as i64) as usize;
        inside(part.start)..inside(part.end)
    }

    /// The first pixel that a speckle reaches, and its integrals from there on.
    fn of_speckle(&self, index: usize) -> (usize, &[f64]) {
        (self.starts[index], &self.integrals[index * self.span..(index + 1) * self.span])
    }
}

/// TakenCells already taken, in cells so small that each holds at most one.
struct TakenCells {
    reach_px: [f64; 2],
    spacing_px: f64,
    n_columns: usize,
    cells: Vec<Option<[f64; 2]>>,
}

impl TakenCells {
    fn new(reach_px: [f64; 2], spacing_px: f64) -> Self {
        let n_cells = |reach_px: f64| (2.0 * reach_px * SQRT_2 / spacing_px).ceil() as usize + 1;
        let (n_columns, n_rows) = (n_cells(reach_px[0]), n_cells(reach_px[1]));
        Self { reach_px, spacing_px, n_columns, cells: vec![None; n_columns * n_rows] }
    }

    /// Takes the place unless another is closer than the spacing; says whether it did.
    fn take(&mut self, place: [f64; 2]) -> bool {
        let [column, row] = [0, 1].map(|axis| self.cell(place[axis], axis));
        let near = |at: usize, limit: usize| at.saturating_sub(2)..(at + 3).min(limit);
        let n_rows = self.cells.len() / self.n_columns;
        let too_close = near(row, n_rows).any(|row| {
            let cells = &self.cells[row * self.n_columns..][near(column, self.n_columns)];
            cells.iter().flatten().any(|other| {
                let apart = [0, 1].map(|axis| place[axis] - other[axis]);
                apart[0] * apart[0] + apart[1] * apart[1] < self.spacing_px * self.spacing_px
            })
        });
        if !too_close {
            self.cells[row * self.n_columns + column] = Some(place);
        }
        !too_close
    }

    fn cell(&self, at_px: f64, axis: usize) -> usize {
        ((at_px + self.reach_px[axis]) * SQRT_2 / self.spacing_px) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn isolated(x_px: f64, y_px: f64, half_px: f64) -> Pattern {
        let speckles = vec![Speckle { x_px, y_px, depth: 1.0 }];
        Pattern { half_width_px: half_px, half_height_px: half_px, sigma_px: 4.5 / (2.0 * SQRT_2), speckles }
    }

    #[test]
    fn an_isolated_speckle_integrates_to_its_closed_form() {
        let pattern = isolated(0.3, -0.2, 20.0);
        let image = pattern.depth_image(64, 64, [31.4, 32.7]);
        let volume = 2.0 * std::f64::consts::PI * pattern.sigma_px * pattern.sigma_px;
        // 4e-8: the part left out beyond 6 sigma, exp(-18), and rounding.
        assert!((image.sum() / volume - 1.0).abs() < 4.0e-8, "{}", image.sum() / volume);
    }

    #[test]
    fn a_pattern_integrates_to_the_sum_over_its_rectangle() {
        let pattern = Pattern::scattered(7, 3, [27.5, 20.25], 4.5);
        let image = pattern.depth_image(100, 100, [50.37, 49.81]);
        let along = |at: f64, half_px: f64| {
            let smear = Smear { half_px, blur: Blur::default() };
            let mut integrals = Vec::new();
            smear.gaussian_between(&[-half_px, half_px], at, pattern.sigma_px, &mut integrals);
            integrals[0]
        };
        let expected: f64 = pattern
            .speckles
            .iter()
            .map(|speckle| speckle.depth * along(speckle.x_px, 27.5) * along(speckle.y_px, 20.25))
            .sum();
        // 4e-8: as above.
        assert!((image.sum() / expected - 1.0).abs() < 4.0e-8);
    }

    #[test]
    fn a_pixel_holds_the_gaussian_averaged_over_it() {
        let pattern = isolated(0.0, 0.0, 20.0);
        let [x_px, y_px] = [20.3, 20.9];
        let image = pattern.depth_image(41, 41, [x_px, y_px]);
        let n = 200;
        let offset = |i: usize| (i as f64 + 0.5) / n as f64 - 0.5;
        for (column, row) in [(20, 21), (22, 19), (17, 24)] {
            let mean = (0..n * n)
                .map(|i| (column as f64 + offset(i % n) - x_px, row as f64 + offset(i / n) - y_px))
                .map(|(x, y)| (-(x * x + y * y) / (2.0 * pattern.sigma_px.powi(2))).exp())
                .sum::<f64>()
                / (n * n) as f64;
            // 2e-6: the midpoint rule's h^2/24 times second derivatives of about 1, with h = 1/200, on both axes.
            assert!((image[[row, column]] - mean).abs() < 2.0e-6);
        }
    }

    #[test]
    fn the_centroid_moves_exactly_with_the_pattern() {
        let pattern = isolated(0.0, 0.0, 20.0);
        let centroid = |shift_px: f64| {
            let image = pattern.depth_image(64, 64, [30.0 + shift_px, 31.0]);
            let moment: f64 = image.indexed_iter().map(|((_, column), depth)| column as f64 * depth).sum();
            moment / image.sum()
        };
        for shift_px in [0.0, 0.013, 0.25, 0.5, 0.77, 1.001, 3.3] {
            // 1e-6 px: sampling a Gaussian of 1.6 px aliases by 2 pi sigma^2 exp(-2 pi^2 sigma^2) = 1e-21; what is left
            // out beyond 6 sigma moves the centroid by up to 6 sigma exp(-18) = 1e-7 px.
            assert!(
                (centroid(shift_px) - 30.0 - shift_px).abs() < 1.0e-6,
                "{shift_px}: {}",
                centroid(shift_px)
            );
        }
    }

    #[test]
    fn a_shift_by_whole_pixels_moves_the_values() {
        let pattern = Pattern::scattered(1, 1, [15.0, 15.0], 4.5);
        let here = pattern.depth_image(60, 40, [20.25, 20.5]);
        let there = pattern.depth_image(60, 40, [27.25, 20.5]);
        for ((row, column), depth) in here.indexed_iter().filter(|((_, column), _)| *column < 53) {
            assert!((depth - there[[row, column + 7]]).abs() < 1.0e-12); // rounding
        }
    }

    #[test]
    fn speckles_keep_their_distance_and_cover_the_rectangle() {
        let pattern = Pattern::scattered(5, 2, [60.0, 40.0], 4.5);
        let spacing_px = SPACING_DIAMETERS * 4.5;
        for (index, one) in pattern.speckles.iter().enumerate() {
            for other in &pattern.speckles[..index] {
                assert!((one.x_px - other.x_px).hypot(one.y_px - other.y_px) >= spacing_px);
            }
        }
        let filled = pattern.speckles.len() as f64 * std::f64::consts::PI / 4.0 * spacing_px * spacing_px;
        let share = filled / (4.0 * 62.25 * 42.25);
        // Random sequential placement of discs jams at a share of 0.547 (Feder 1980); a finite effort stays below it.
        assert!((0.45..0.58).contains(&share), "{share}");
    }
}
