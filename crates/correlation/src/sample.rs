//! Interpolation along the rows of a warped subset.

use crate::bspline::pieces;
use crate::{Interpolation, Window};

/// Samples the window at `start + step * column` for every column, into `out` (counts less the window's level).
///
/// `start` is in image coordinates. Every point must lie in the window ([`Window::contains`]); the caller checks the
/// subset's corners once instead of each point here.
pub(crate) fn sample_row(window: &Window, start: [f64; 2], step: [f64; 2], columns: &[f32], out: &mut [f32]) {
    let origin = [window.region.x as f64, window.region.y as f64];
    let line = Line {
        start: [(start[0] - origin[0]) as f32, (start[1] - origin[1]) as f32],
        step: step.map(|value| value as f32),
    };
    match window.interpolation {
        Interpolation::Linear => line.sample::<2, 4>(window, columns, out),
        Interpolation::Cubic => line.sample::<4, 4>(window, columns, out),
        Interpolation::Quintic => line.sample::<6, 8>(window, columns, out),
    }
}

/// A straight line of points in a window's own coordinates.
struct Line {
    start: [f32; 2],
    step: [f32; 2],
}

impl Line {
    /// In blocks of points, each in three loops of which the first and last run over the points and the second over
    /// the lanes of a vector of coefficients, so that compilers vectorise all three.
    fn sample<const TAPS: usize, const LANES: usize>(
        &self,
        window: &Window,
        columns: &[f32],
        out: &mut [f32],
    ) {
        let stride = window.region.width;
        for (columns, out) in columns.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
            let block = self.locate::<TAPS>(stride, columns);
            let mut sums = [[0.0; LANES]; BLOCK];
            for (i, sum) in sums.iter_mut().take(columns.len()).enumerate() {
                let coefficients = &window.coefficients[block.corners[i] as usize..];
                *sum =
                    weighted_rows(coefficients, stride, block.weights_y.each_ref().map(|weights| weights[i]));
            }
            let mut values = [0.0; BLOCK];
            for (tap, weights) in block.weights_x.iter().enumerate() {
                for i in 0..BLOCK {
                    values[i] += weights[i] * sums[i][tap];
                }
            }
            out.copy_from_slice(&values[..columns.len()]);
        }
    }

    /// Where a block of points lies among the coefficients, and their weights.
    #[inline(always)]
    fn locate<const TAPS: usize>(&self, stride: usize, columns: &[f32]) -> Block<TAPS> {
        let taps_before = TAPS / 2 - 1;
        let first = (taps_before * (stride + 1)) as u32;
        let mut padded = [columns[0]; BLOCK];
        padded[..columns.len()].copy_from_slice(columns);
        let mut corners = [0; BLOCK];
        let (mut t_x, mut t_y) = ([0.0; BLOCK], [0.0; BLOCK]);
        for i in 0..BLOCK {
            let x = self.start[0] + self.step[0] * padded[i];
            let y = self.start[1] + self.step[1] * padded[i];
            let (column, row) = (floor(x), floor(y));
            t_x[i] = x - column;
            t_y[i] = y - row;
            // exact: a window has fewer than 2^22 pixels
            corners[i] =
                (row * stride as f32 + column + UNIT_SPACING).to_bits() - UNIT_SPACING.to_bits() - first;
        }
        Block { corners, weights_x: weights(&t_x), weights_y: weights(&t_y) }
    }
}

/// 2^23 + 2^22: f32 near it are whole numbers, so adding it rounds, and leaves the number in the lowest bits. Compilers
/// vectorise this, and not the casts, which saturate.
const UNIT_SPACING: f32 = 12_582_912.0;

/// The whole number below a coordinate of less than 2^22. A whole number itself may give the one below, and the
/// fraction 1, where a spline has the same value.
#[inline(always)]
fn floor(x: f32) -> f32 {
    (x - 0.5 + UNIT_SPACING) - UNIT_SPACING
}

/// Points that are sampled together.
const BLOCK: usize = 8;

struct Block<const TAPS: usize> {
    corners: [u32; BLOCK],
    weights_x: [[f32; BLOCK]; TAPS],
    weights_y: [[f32; BLOCK]; TAPS],
}

/// `sum over rows of weights[row] coefficients[row * stride + lane]`.
#[inline(always)]
fn weighted_rows<const TAPS: usize, const LANES: usize>(
    coefficients: &[f32],
    stride: usize,
    weights: [f32; TAPS],
) -> [f32; LANES] {
    let rows = &coefficients[..(TAPS - 1) * stride + LANES];
    let mut sum = [0.0; LANES];
    for (tap, weight) in weights.into_iter().enumerate() {
        let row = &rows[tap * stride..tap * stride + LANES];
        for lane in 0..LANES {
            sum[lane] += weight * row[lane];
        }
    }
    sum
}

/// The weights of the taps at N fractions of a pixel.
#[inline(always)]
fn weights<const TAPS: usize, const N: usize>(t: &[f32; N]) -> [[f32; N]; TAPS] {
    let table = const { pieces::<TAPS, TAPS>() };
    std::array::from_fn(|tap| {
        let mut sum = [table[TAPS - 1][tap]; N];
        for power in (0..TAPS - 1).rev() {
            for i in 0..N {
                sum[i] = sum[i] * t[i] + table[power][tap];
            }
        }
        sum
    })
}

/// Samples the window on a grid of whole steps from `start`, one row of `width` values after the other in rows of
/// `stride`: a subset that is moved and not deformed has the same weights everywhere, and the two axes separate.
pub(crate) fn sample_grid(
    window: &Window,
    start: [f64; 2],
    grid: Grid,
    workspace: &mut Vec<f32>,
    out: &mut [f32],
) {
    match window.interpolation {
        Interpolation::Linear => sample_grid_with::<2>(window, start, grid, workspace, out),
        Interpolation::Cubic => sample_grid_with::<4>(window, start, grid, workspace, out),
        Interpolation::Quintic => sample_grid_with::<6>(window, start, grid, workspace, out),
    }
}

/// The size of a grid of samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Grid {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) stride: usize,
}

fn sample_grid_with<const TAPS: usize>(
    window: &Window,
    start: [f64; 2],
    grid: Grid,
    workspace: &mut Vec<f32>,
    out: &mut [f32],
) {
    let (x, y) = (start[0] - window.region.x as f64, start[1] - window.region.y as f64);
    let (column, row) = (x as usize, y as usize);
    let weight_x = weights::<TAPS, 1>(&[(x - column as f64) as f32]).map(|[weight]| weight);
    let weight_y = weights::<TAPS, 1>(&[(y - row as f64) as f32]).map(|[weight]| weight);
    let stride = window.region.width;
    let corner = (row + 1 - TAPS / 2) * stride + column + 1 - TAPS / 2;
    let n_rows = grid.height + TAPS - 1;
    workspace.resize(n_rows * grid.width, 0.0);
    for (i, sums) in workspace.chunks_exact_mut(grid.width).enumerate() {
        weighted_sum(&window.coefficients[corner + i * stride..], 1, weight_x, sums);
    }
    for (i, sums) in out.chunks_exact_mut(grid.stride).take(grid.height).enumerate() {
        weighted_sum(&workspace[i * grid.width..], grid.width, weight_y, &mut sums[..grid.width]);
    }
}

/// `sums[i] = sum over taps of weights[tap] * values[i + tap * spacing]`.
#[inline(always)]
fn weighted_sum<const TAPS: usize>(values: &[f32], spacing: usize, weights: [f32; TAPS], sums: &mut [f32]) {
    let n = sums.len();
    let lines: [&[f32]; TAPS] = std::array::from_fn(|tap| &values[tap * spacing..tap * spacing + n]);
    for (i, sum) in sums.iter_mut().enumerate() {
        let mut total = 0.0;
        for (line, weight) in lines.iter().zip(weights) {
            total += weight * line[i];
        }
        *sum = total;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chainwave_measurement::Region;

    #[test]
    fn the_grid_agrees_with_single_points() {
        let region = Region { x: 4, y: 9, width: 40, height: 30 };
        let pixels: Vec<f32> = (0..region.n_pixels()).map(|i| ((i * 7919) % 4096) as f32).collect();
        for interpolation in Interpolation::ALL {
            let window = Window::new(region, &pixels, interpolation).unwrap();
            let (start, grid) = ([10.3, 15.8], Grid { width: 9, height: 5, stride: 12 });
            let mut by_grid = vec![0.0; 12 * 5];
            sample_grid(&window, start, grid, &mut Vec::new(), &mut by_grid);
            let columns: Vec<f32> = (0..9).map(|x| x as f32).collect();
            for row in 0..5 {
                let mut by_point = [0.0; 9];
                sample_row(&window, [start[0], start[1] + row as f64], [1.0, 0.0], &columns, &mut by_point);
                for (a, b) in by_point.iter().zip(&by_grid[row * 12..]) {
                    // coordinates in f32 are good to 2e-6 px; this noise changes by 4096 counts and more a pixel
                    assert!((a - b).abs() < 0.1, "{interpolation}: {a} {b}");
                }
            }
        }
    }
}
