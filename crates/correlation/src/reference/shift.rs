//! Pictures of a patch that has moved by a known amount, with noise: what the rungs of the ladder are tested on.
//!
//! A patch is shifted by its trigonometric interpolation, which moves every frequency of a scene exactly and belongs to
//! none of the rungs; mirrored at its edges, it has no jump there.

use chainwave_measurement::Region;

/// The pixels of a patch whose scene has moved by `shift`, by trigonometric interpolation along rows and columns.
pub(crate) fn shifted(pixels: &[f64], region: Region, [dx, dy]: [f64; 2]) -> Vec<f64> {
    let Region { width, height, .. } = region;
    let (along_x, along_y) = (shift_matrix(width, dx), shift_matrix(height, dy));
    let mut by_row = vec![0.0; pixels.len()];
    for (row, out) in pixels.chunks_exact(width).zip(by_row.chunks_exact_mut(width)) {
        for (value, weights) in row.iter().zip(along_x.chunks_exact(width)) {
            out.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * value);
        }
    }
    let mut result = vec![0.0; pixels.len()];
    for (row, weights) in by_row.chunks_exact(width).zip(along_y.chunks_exact(height)) {
        for (out, weight) in result.chunks_exact_mut(width).zip(weights) {
            out.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * value);
        }
    }
    result
}

/// What each of n values, row by row, adds to each shifted one, the line being mirrored at its ends.
fn shift_matrix(n: usize, shift: f64) -> Vec<f64> {
    let period = 2.0 * n as f64;
    let kernel = |distance: f64| {
        let t = distance.rem_euclid(period);
        if t.abs() < 1e-12 {
            return 1.0;
        }
        let angle = std::f64::consts::PI * t;
        angle.sin() / (period * (angle / period).tan())
    };
    // by the distance of the shifted value from the other
    let of_distance: Vec<f64> = (0..2 * n).map(|distance| kernel(distance as f64 - shift)).collect();
    let weight = |i: usize| {
        let (column, place) = (i / n, i % n);
        of_distance[(place + 2 * n - column) % (2 * n)] + of_distance[(place + column + 1) % (2 * n)]
    };
    (0..n * n).map(weight).collect()
}

/// Normal deviates: splitmix64 (G. Steele, D. Lea, C. Flood, OOPSLA 2014, 453-472) through Box and Muller's transform.
pub(crate) struct Normal(pub(crate) u64);

impl Normal {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn next(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_moves_a_cosine_exactly() {
        // cosines with extrema between the mirrored ends are what the mirrored line is made of
        let n = 24;
        let region = Region::whole(n, n);
        let wave = |x: f64, order: f64| (std::f64::consts::PI * order * (x + 0.5) / n as f64).cos();
        let pixels: Vec<f64> =
            (0..n * n).map(|i| wave((i % n) as f64, 3.0) * wave((i / n) as f64, 5.0)).collect();
        let found = shifted(&pixels, region, [0.3, -0.7]);
        for (i, value) in found.iter().enumerate() {
            let expected = wave((i % n) as f64 - 0.3, 3.0) * wave((i / n) as f64 + 0.7, 5.0);
            assert!((value - expected).abs() < 1e-12, "rounding: {value} {expected}");
        }
    }

    #[test]
    fn normal_deviates_have_unit_variance() {
        let mut random = Normal(7);
        let values: Vec<f64> = (0..20_000).map(|_| random.next()).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64;
        // four standard errors of a mean and of a variance
        assert!(mean.abs() < 0.028 && (variance - 1.0).abs() < 0.04, "{mean} {variance}");
    }
}
