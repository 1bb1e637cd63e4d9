//! What is searched for: a rectangle of grey values less their mean.

use crate::PreparedSubset;
use crate::simd::{LANES, dot, sum_of_lanes, vectorised};

/// What is searched for: grey values less their mean, row by row.
pub(crate) struct Template {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Place of the first pixel, relative to the centre.
    pub(crate) first_px: [f64; 2],
    pub(crate) values: Vec<f32>,
    /// Sum of the squares of `values`.
    pub(crate) energy: f64,
}

impl Template {
    /// The subset as it is.
    pub(crate) fn upright(subset: &PreparedSubset) -> Self {
        Self::new(subset.width, subset.height, subset.first_px, subset.template.clone())
    }

    /// Values of a rectangle, row by row; their mean is taken off.
    pub(crate) fn new(width: usize, height: usize, first_px: [f64; 2], mut values: Vec<f32>) -> Self {
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        values.iter_mut().for_each(|value| *value -= mean);
        let energy = dot(&values, &values);
        Self { width, height, first_px, values, energy }
    }

    /// Sum of the values times the pixels under them.
    pub(crate) fn correlate(&self, width: usize, pixels: &[f32]) -> f64 {
        vectorised(
            #[inline(always)]
            || {
                let mut lanes = [0.0_f32; LANES];
                let mut total = 0.0_f32;
                for (f, g) in self.values.chunks_exact(self.width).zip(pixels.chunks(width)) {
                    let g = &g[..self.width];
                    let (f_lanes, f_rest) = f.as_chunks::<LANES>();
                    let (g_lanes, g_rest) = g.as_chunks::<LANES>();
                    for (f, g) in f_lanes.iter().zip(g_lanes) {
                        for i in 0..LANES {
                            lanes[i] += f[i] * g[i];
                        }
                    }
                    total += f_rest.iter().zip(g_rest).map(|(f, g)| f * g).sum::<f32>();
                }
                f64::from(total) + sum_of_lanes(lanes)
            },
        )
    }
}
