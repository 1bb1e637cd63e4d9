//! Where a picture has texture in both directions: the smaller eigenvalue of its structure tensor, less what noise adds.

/// Pixels on each side of a pixel over which gradients are averaged: two speckles or so.
pub(crate) const RADIUS_PX: usize = 5;
/// Share of a pixel's noise in the square of a gradient: central differences, each smoothed across by 1/4, 1/2, 1/4.
const NOISE_SHARE: f64 = 0.5 * 0.375;
/// Rounding to counts alone.
const LEAST_VARIANCE: f64 = 1.0 / 12.0;
/// Side of the blocks that noise is looked for in, in pixels.
const BLOCK_PX: usize = 16;
/// Share of the blocks that are smoother than the one whose noise is taken: ground without texture.
const SMOOTH_SHARE: f64 = 0.2;

/// The texture of a picture.
pub(crate) struct Texture {
    /// Columns and rows.
    pub(crate) size: [usize; 2],
    /// Mean square of the gradient in the direction in which it is smaller, in counts squared per pixel squared.
    pub(crate) values: Vec<f32>,
    /// Mean of the pixels around each, in counts.
    pub(crate) shades: Vec<f32>,
    /// Derivatives along x and y, in counts per pixel.
    pub(crate) gradients: [Vec<f32>; 2],
    /// Mean square of a derivative of noise alone, which smaller eigenvalues of noise alone do not exceed once it is taken off.
    pub(crate) least: f32,
    /// Variance of the picture's noise, in counts squared.
    pub(crate) noise_variance: f64,
}

impl Texture {
    /// The texture of a picture of the given columns and rows; the variance of its noise is estimated where it is not known.
    pub(crate) fn of(pixels: &[f32], size: [usize; 2], noise_variance: Option<f64>) -> Self {
        let noise_variance =
            noise_variance.unwrap_or_else(|| smoothest_noise(pixels, size)).max(LEAST_VARIANCE);
        let of_noise = (NOISE_SHARE * noise_variance) as f32;
        let [x, y] = gradients(pixels, size);
        let mean_of = |a: &[f32], b: &[f32]| {
            let products: Vec<f32> = a.iter().zip(b).map(|(a, b)| a * b).collect();
            box_mean(&products, size)
        };
        let [xx, xy, yy] = [mean_of(&x, &x), mean_of(&x, &y), mean_of(&y, &y)];
        let smaller = |i: usize| 0.5 * (xx[i] + yy[i] - (xx[i] - yy[i]).hypot(2.0 * xy[i])) - of_noise;
        let values = (0..pixels.len()).map(smaller).collect();
        // Averages over 121 pixels, which share their noise with neighbours, scatter by a quarter: four times that is once their mean.
        let shades = box_mean(pixels, size);
        Self { size, values, shades, gradients: [x, y], least: of_noise, noise_variance }
    }

    /// The strongest texture.
    pub(crate) fn most(&self) -> f32 {
        self.values.iter().copied().fold(0.0, f32::max)
    }

    /// The texture at a pixel.
    pub(crate) fn at(&self, (x, y): (usize, usize)) -> f32 {
        self.values[y * self.size[0] + x]
    }
}

/// Derivatives along x and y, smoothed across; 0 at the rim, where there are none.
fn gradients(pixels: &[f32], [width, height]: [usize; 2]) -> [Vec<f32>; 2] {
    let (mut x, mut y) = (vec![0.0; pixels.len()], vec![0.0; pixels.len()]);
    for row in 1..height.saturating_sub(1) {
        for column in 1..width.saturating_sub(1) {
            let at = |i: usize, j: usize| pixels[(row + j - 1) * width + column + i - 1];
            let across = |a: f32, b: f32, c: f32| 0.25 * (a + c) + 0.5 * b;
            let i = row * width + column;
            x[i] = 0.5 * (across(at(2, 0), at(2, 1), at(2, 2)) - across(at(0, 0), at(0, 1), at(0, 2)));
            y[i] = 0.5 * (across(at(0, 2), at(1, 2), at(2, 2)) - across(at(0, 0), at(1, 0), at(2, 0)));
        }
    }
    [x, y]
}

/// The mean over the pixels within a radius along both axes, beyond the rim none.
fn box_mean(values: &[f32], [width, height]: [usize; 2]) -> Vec<f32> {
    let mut along = vec![0.0; values.len()];
    for (row, out) in values.chunks_exact(width).zip(along.chunks_exact_mut(width)) {
        running_sum(width, |x| f64::from(row[x]), |x, sum| out[x] = sum as f32);
    }
    let mut mean = vec![0.0; values.len()];
    let n = |i: usize, n: usize| ((i + RADIUS_PX).min(n - 1) - i.saturating_sub(RADIUS_PX) + 1) as f32;
    for x in 0..width {
        running_sum(
            height,
            |y| f64::from(along[y * width + x]),
            |y, sum| mean[y * width + x] = sum as f32 / (n(x, width) * n(y, height)),
        );
    }
    mean
}

/// Sums over the radius, each from the one before.
fn running_sum(n: usize, value: impl Fn(usize) -> f64, mut put: impl FnMut(usize, f64)) {
    let mut sum: f64 = (0..RADIUS_PX.min(n)).map(&value).sum();
    for i in 0..n {
        if i + RADIUS_PX < n {
            sum += value(i + RADIUS_PX);
        }
        if i > RADIUS_PX {
            sum -= value(i - RADIUS_PX - 1);
        }
        put(i, sum);
    }
}

/// The variance of the noise in the smoothest blocks of a picture, by its mixed fourth differences (J. Immerkaer, Comput. Vis. Image
/// Underst. 64 (1996) 300-302); blocks without any noise are black or saturated.
fn smoothest_noise(pixels: &[f32], [width, height]: [usize; 2]) -> f64 {
    let mut variances = Vec::new();
    for y in (1..height.saturating_sub(BLOCK_PX)).step_by(BLOCK_PX) {
        for x in (1..width.saturating_sub(BLOCK_PX)).step_by(BLOCK_PX) {
            let mut sum = 0.0;
            for row in y..y + BLOCK_PX {
                for column in x..x + BLOCK_PX {
                    let at = |i: usize, j: usize| f64::from(pixels[(row + j - 1) * width + column + i - 1]);
                    let second = |j: usize| at(0, j) - 2.0 * at(1, j) + at(2, j);
                    sum += (second(0) - 2.0 * second(1) + second(2)).powi(2);
                }
            }
            if sum > 0.0 {
                // The squares of the filter's coefficients add up to 36.
                variances.push(sum / (36 * BLOCK_PX * BLOCK_PX) as f64);
            }
        }
    }
    variances.sort_by(f64::total_cmp);
    variances.get((SMOOTH_SHARE * variances.len() as f64) as usize).copied().unwrap_or(0.0)
}
