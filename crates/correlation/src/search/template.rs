//! What is searched for: a rectangle of grey values less their mean.

use crate::PreparedSubset;
use crate::simd::{LANES, dot, sum_of_lanes};

/// What is searched for: grey values less their mean, row by row.
pub(crate) struct Template {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Place of the first pixel, relative to the centre.
    pub(crate) first_px: [f64; 2],
    pub(crate) values: Vec<f32>,
    /// Of each row what is left behind its last whole vector, filled up with zeros.
    tails: Vec<[f32; LANES]>,
    /// Sum of the squares of `values`.
    pub(crate) energy: f64,
}

impl Template {
    /// The subset as it is.
    pub(crate) fn upright(subset: &PreparedSubset) -> Self {
        Self::new(subset.width, subset.height, subset.first_px, subset.template().to_vec())
    }

    /// Values of a rectangle, row by row; their mean is taken off.
    pub(crate) fn new(width: usize, height: usize, first_px: [f64; 2], mut values: Vec<f32>) -> Self {
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        values.iter_mut().for_each(|value| *value -= mean);
        let energy = dot(&values, &values);
        let tail = |row: &[f32]| {
            let (_, rest) = row.as_chunks::<LANES>();
            filled_up(rest)
        };
        let tails = values.chunks_exact(width).map(tail).collect();
        Self { width, height, first_px, values, tails, energy }
    }

    /// Sum of the values times the pixels under them, which go on to the right of the template where the row does: a row is whole vectors, as
    /// single values behind them take longer than they do.
    pub(crate) fn correlate(&self, width: usize, pixels: &[f32]) -> f64 {
        chainwave_vectors::dispatch_loop(
            #[inline(always)]
            || {
                let mut lanes = [0.0_f32; LANES];
                let has_tail = !self.width.is_multiple_of(LANES);
                let rows = self.values.chunks_exact(self.width).zip(&self.tails);
                for ((f, tail), g) in rows.zip(pixels.chunks(width)) {
                    let (f_lanes, _) = f.as_chunks::<LANES>();
                    let (g_lanes, g_rest) = g.as_chunks::<LANES>();
                    for (f, g) in f_lanes.iter().zip(g_lanes) {
                        add_products(&mut lanes, f, g);
                    }
                    if has_tail {
                        match g_lanes.get(f_lanes.len()) {
                            Some(g) => add_products(&mut lanes, tail, g),
                            None => add_products(&mut lanes, tail, &filled_up(g_rest)),
                        }
                    }
                }
                sum_of_lanes(lanes)
            },
        )
    }
}

/// Fewer values than a vector has, and zeros.
#[inline(always)]
fn filled_up(values: &[f32]) -> [f32; LANES] {
    let mut vector = [0.0; LANES];
    vector[..values.len()].copy_from_slice(values);
    vector
}

#[inline(always)]
fn add_products(lanes: &mut [f32; LANES], f: &[f32; LANES], g: &[f32; LANES]) {
    for i in 0..LANES {
        lanes[i] += f[i] * g[i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_correlation_is_the_sum_of_products_wherever_the_scene_ends() {
        let value = |i: usize| ((i * 7919) % 101) as f32 / 50.0 - 1.0;
        for (width, height) in [(1, 1), (15, 3), (16, 2), (17, 4), (33, 2)] {
            let template =
                Template::new(width, height, [0.0; 2], (0..width * height).map(|i| value(i + 3)).collect());
            for spare in [0, 1, 20] {
                let (columns, rows) = (width + spare, height + spare.min(2));
                let scene: Vec<f32> = (0..columns * rows).map(value).collect();
                for (x, y) in [(0, 0), (spare, rows - height)] {
                    let found = template.correlate(columns, &scene[y * columns + x..]);
                    let product =
                        |i: usize| template.values[i] * scene[(y + i / width) * columns + x + i % width];
                    let expected: f64 = (0..width * height).map(|i| f64::from(product(i))).sum();
                    assert!(
                        (found - expected).abs() < 1e-4,
                        "{width} x {height}, {spare}: {found} {expected}"
                    );
                }
            }
        }
    }
}
