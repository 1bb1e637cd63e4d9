//! A field's points as columns and rows: what was found there, which of them surround another, and sums over squares of them.

use crate::Shape;

/// A point of the field as found.
#[derive(Debug, Clone, Copy)]
pub(in crate::field) struct Reading {
    pub(in crate::field) u_px: [f64; 2],
    pub(in crate::field) sigma_px: [f64; 2],
    pub(super) shape: Shape,
    /// du/dx, du/dy, dv/dx, dv/dy of its match.
    pub(super) gradient: [f64; 4],
    /// Coefficients of x^2, xy and y^2 in u, then in v.
    pub(super) curvature: [f64; 6],
    /// What its residuals leave to a systematic error of its match along x and y, at most.
    pub(in crate::field) left_px: [f64; 2],
    /// Whether its residuals need nothing but noise.
    pub(super) leaves_noise_alone: bool,
    /// Whether its whole subset was matched.
    pub(super) is_whole: bool,
}

impl Reading {
    /// Whether its whole subset leaves nothing but noise.
    pub(in crate::field) fn is_clean(&self) -> bool {
        self.is_whole && self.leaves_noise_alone
    }

    /// How its displacement changes along an offset, by its gradient.
    pub(in crate::field) fn along_px(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [ux, uy, vx, vy] = self.gradient;
        [ux * x + uy * y, vx * x + vy * y]
    }

    /// What a rotation of its own moves a point by that lies so far from it; nothing where its shape function has none, or follows any gradient.
    ///
    /// What a rigid subset cannot follow is a strain of the turned body: the gradient of a large rotation has one on its diagonal, cos - 1.
    pub(super) fn turned_px(&self, offset_px: [f64; 2]) -> [f64; 2] {
        if self.shape == Shape::Rigid { self.along_px(offset_px) } else { [0.0; 2] }
    }

    /// How that changes with the rotation, in pixels per radian, along x and y.
    pub(super) fn turning_px(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [turned_x, turned_y] = self.turned_px([x, y]);
        if self.shape == Shape::Rigid { [-(y + turned_y), x + turned_x] } else { [0.0; 2] }
    }

    /// Variance of the rotation of a square subset of equal texture, in square radians.
    pub(super) fn variance_of_turn(&self, side_px: f64) -> f64 {
        let [x, y] = self.sigma_px;
        0.5 * (x * x + y * y) / ((side_px * side_px - 1.0) / 6.0)
    }
}

/// Columns and rows of a field.
#[derive(Debug, Clone, Copy)]
pub(in crate::field) struct Grid {
    pub(in crate::field) n_columns: usize,
    pub(in crate::field) n_rows: usize,
    pub(in crate::field) step_px: f64,
}

impl Grid {
    /// The point so many columns and rows from another, if there is one.
    pub(in crate::field) fn at(&self, point: usize, [columns, rows]: [i64; 2]) -> Option<usize> {
        let place = |from: usize, by: i64, n: usize| {
            usize::try_from(from as i64 + by).ok().filter(|&place| place < n)
        };
        let column = place(point % self.n_columns, columns, self.n_columns)?;
        Some(place(point / self.n_columns, rows, self.n_rows)? * self.n_columns + column)
    }

    /// Every `stride`th point around one, five columns and rows of them, which at an edge are those nearest to it.
    pub(super) fn around(&self, point: usize, stride: usize) -> Vec<usize> {
        let line = |place: usize, n: usize| -> Vec<usize> {
            let first = place % stride;
            let (own, count) = (place / stride, (n - first).div_ceil(stride));
            let start = own.saturating_sub(2).min(count.saturating_sub(5));
            (start..(start + 5).min(count)).map(|k| first + k * stride).collect()
        };
        let columns = line(point % self.n_columns, self.n_columns);
        let rows = line(point / self.n_columns, self.n_rows);
        rows.iter().flat_map(|row| columns.iter().map(move |column| row * self.n_columns + column)).collect()
    }

    /// For each point the sum of some numbers over those up to `reach` columns and rows away.
    pub(in crate::field) fn sums<const N: usize>(&self, values: &[[f64; N]], reach: usize) -> Vec<[f64; N]> {
        let along = |values: &[[f64; N]], n: usize, place: &dyn Fn(usize) -> usize, spacing: usize| {
            let sum = |point: usize| {
                let own = place(point);
                let line = own.saturating_sub(reach)..(own + reach + 1).min(n);
                let mut sum = [0.0; N];
                for other in line {
                    let value = &values[point + other * spacing - own * spacing];
                    sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += value);
                }
                sum
            };
            (0..values.len()).map(sum).collect::<Vec<_>>()
        };
        let in_rows = along(values, self.n_columns, &|point| point % self.n_columns, 1);
        along(&in_rows, self.n_rows, &|point| point / self.n_columns, self.n_columns)
    }
}
