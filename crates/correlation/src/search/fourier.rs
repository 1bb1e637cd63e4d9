//! Cross-correlation of a large scene and a template by Fourier transforms.

use rustfft::num_complex::Complex32;
use rustfft::{FftDirection, FftPlanner};

/// Values row by row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Image<'a> {
    pub(crate) width: usize,
    pub(crate) values: &'a [f32],
}

impl Image<'_> {
    pub(crate) fn height(&self) -> usize {
        self.values.len() / self.width
    }
}

/// The sums of the template's values times those of the scene under it, at every place where it lies inside, row by row.
///
/// Both are filled up to sides of small prime factors. What is longer than the template wraps around only where the
/// template would reach beyond the scene.
pub(crate) fn correlations(scene: Image<'_>, template: Image<'_>) -> Vec<f32> {
    let grid = Grid { width: friendly(scene.width), height: friendly(scene.height()) };
    // The template as the imaginary part: both spectra come out of one transform.
    let mut values = vec![Complex32::default(); grid.width * grid.height];
    for (y, row) in scene.values.chunks_exact(scene.width).enumerate() {
        row.iter().zip(&mut values[y * grid.width..]).for_each(|(value, sum)| sum.re = *value);
    }
    for (y, row) in template.values.chunks_exact(template.width).enumerate() {
        row.iter().zip(&mut values[y * grid.width..]).for_each(|(value, sum)| sum.im = *value);
    }
    let spectrum = grid.transform(values, FftDirection::Forward);
    let products = (0..spectrum.len()).map(|i| {
        let (here, there) = (spectrum[i], spectrum[grid.opposite(i)].conj());
        let (of_scene, of_template) = ((here + there) * 0.5, (here - there) * Complex32::new(0.0, -0.5));
        of_scene * of_template.conj()
    });
    let sums = grid.transposed().transform(products.collect(), FftDirection::Inverse);
    let (columns, rows) = (scene.width + 1 - template.width, scene.height() + 1 - template.height());
    let scale = 1.0 / sums.len() as f32;
    sums.chunks_exact(grid.width)
        .take(rows)
        .flat_map(|row| row[..columns].iter().map(|sum| sum.re * scale))
        .collect()
}

/// The least whole number from `n` on without prime factors above 5.
fn friendly(n: usize) -> usize {
    let rest = |n: usize| {
        [2, 3, 5].into_iter().fold(n, |mut n, factor| {
            while n.is_multiple_of(factor) {
                n /= factor;
            }
            n
        })
    };
    (n.max(1)..).find(|&n| rest(n) == 1).unwrap_or(n)
}

#[derive(Debug, Clone, Copy)]
struct Grid {
    width: usize,
    height: usize,
}

impl Grid {
    /// The spectrum of the values, or the values of a spectrum, column by column.
    fn transform(self, mut values: Vec<Complex32>, direction: FftDirection) -> Vec<Complex32> {
        let mut planner = FftPlanner::new();
        planner.plan_fft(self.width, direction).process(&mut values);
        let mut columns = vec![Complex32::default(); values.len()];
        for (y, row) in values.chunks_exact(self.width).enumerate() {
            row.iter().enumerate().for_each(|(x, value)| columns[x * self.height + y] = *value);
        }
        planner.plan_fft(self.height, direction).process(&mut columns);
        columns
    }

    fn transposed(self) -> Self {
        Self { width: self.height, height: self.width }
    }

    /// The place of the frequency opposite to that at a place, column by column.
    fn opposite(self, i: usize) -> usize {
        let (x, y) = (i / self.height, i % self.height);
        (self.width - x) % self.width * self.height + (self.height - y) % self.height
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transforms_give_the_plain_sums() {
        let value = |i: usize, k: usize| ((i * k) % 101) as f32 / 50.0 - 1.0;
        for ([width, height], [columns, rows]) in
            [([40, 31], [7, 9]), ([33, 50], [33, 20]), ([64, 17], [1, 17])]
        {
            let scene: Vec<f32> = (0..width * height).map(|i| value(i, 7919)).collect();
            let template: Vec<f32> = (0..columns * rows).map(|i| value(i, 31)).collect();
            let found =
                correlations(Image { width, values: &scene }, Image { width: columns, values: &template });
            let places = (0..=height - rows).flat_map(|y| (0..=width - columns).map(move |x| (x, y)));
            for ((x, y), found) in places.zip(&found) {
                let term = |i: usize| template[i] * scene[(y + i / columns) * width + x + i % columns];
                let expected: f32 = (0..columns * rows).map(term).sum();
                assert!((found - expected).abs() < 1e-3, "f32 of up to 660 terms of 1: {found} {expected}");
            }
            assert_eq!(found.len(), (width + 1 - columns) * (height + 1 - rows));
        }
    }
}
