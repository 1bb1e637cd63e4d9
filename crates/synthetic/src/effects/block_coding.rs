//! What lossy compression takes from a frame: the quantised cosine transform of blocks of 8 x 8 pixels, as in JPEG files.

/// Pixels of a block's side.
const SIDE: usize = 8;

/// A block's values, row by row.
type Block = [[f64; SIDE]; SIDE];

/// Steps of the luminance's coefficients at quality 50 (ITU-T T.81, table K.1), row by row from the mean on.
#[rustfmt::skip]
const STEPS: [[f64; SIDE]; SIDE] = [
    [16.0, 11.0, 10.0, 16.0,  24.0,  40.0,  51.0,  61.0],
    [12.0, 12.0, 14.0, 19.0,  26.0,  58.0,  60.0,  55.0],
    [14.0, 13.0, 16.0, 24.0,  40.0,  57.0,  69.0,  56.0],
    [14.0, 17.0, 22.0, 29.0,  51.0,  87.0,  80.0,  62.0],
    [18.0, 22.0, 37.0, 56.0,  68.0, 109.0, 103.0,  77.0],
    [24.0, 35.0, 55.0, 64.0,  81.0, 104.0, 113.0,  92.0],
    [49.0, 64.0, 78.0, 87.0, 103.0, 121.0, 120.0, 101.0],
    [72.0, 92.0, 95.0, 98.0, 112.0, 100.0, 103.0,  99.0],
];

/// A coder of one quality, for counts up to a full scale. Steps count in 255ths of it, as for 8-bit pictures; the entropy
/// coding of a file loses nothing and is left out.
pub(crate) struct BlockCoding {
    steps: Block,
    /// Row k holds the k-th cosine, of unit norm.
    cosines: Block,
    full_scale: f64,
}

impl BlockCoding {
    /// The coder of a quality from 1 to 100, in the scale that the Independent JPEG Group's library made common: steps grow as
    /// 50/quality below 50, and shrink linearly to 1 above.
    pub(crate) fn new(quality: u32, full_scale: f64) -> Self {
        let quality = f64::from(quality.clamp(1, 100));
        let percent = if quality < 50.0 { (5000.0 / quality).floor() } else { 200.0 - 2.0 * quality };
        let step = |step: f64| ((step * percent + 50.0) / 100.0).floor().clamp(1.0, 255.0);
        let cosine = |order: usize, at: usize| {
            let angle = std::f64::consts::PI * order as f64 * (2 * at + 1) as f64 / (2 * SIDE) as f64;
            libm::cos(angle)
                * if order == 0 { (1.0 / SIDE as f64).sqrt() } else { (2.0 / SIDE as f64).sqrt() }
        };
        let sides = [0, 1, 2, 3, 4, 5, 6, 7];
        Self {
            steps: STEPS.map(|row| row.map(step)),
            cosines: sides.map(|order| sides.map(|at| cosine(order, at))),
            full_scale,
        }
    }

    /// Replaces a frame's counts by what they are once coded and decoded. Blocks that the frame's edge cuts are filled up with
    /// its last column and row.
    pub(crate) fn apply(&self, counts: &mut [u16], width_px: usize) {
        let height_px = counts.len() / width_px;
        let per_count = 255.0 / self.full_scale;
        for top in (0..height_px).step_by(SIDE) {
            for left in (0..width_px).step_by(SIDE) {
                let mut block = [[0.0; SIDE]; SIDE];
                for (row, values) in block.iter_mut().enumerate() {
                    let row = (top + row).min(height_px - 1);
                    for (column, value) in values.iter_mut().enumerate() {
                        let column = (left + column).min(width_px - 1);
                        *value = f64::from(counts[row * width_px + column]) * per_count - 128.0;
                    }
                }
                let decoded = self.coded(&block);
                for (row, values) in (top..height_px).zip(&decoded) {
                    for (column, value) in (left..width_px).zip(values) {
                        let count = ((value + 128.0) / per_count).clamp(0.0, self.full_scale).round();
                        counts[row * width_px + column] = count as u16;
                    }
                }
            }
        }
    }

    /// A block coded and decoded.
    fn coded(&self, block: &Block) -> Block {
        let mut coefficients = product(&product(&self.cosines, block), &transposed(&self.cosines));
        for (row, steps) in coefficients.iter_mut().zip(&self.steps) {
            row.iter_mut().zip(steps).for_each(|(value, step)| *value = (*value / step).round() * step);
        }
        product(&product(&transposed(&self.cosines), &coefficients), &self.cosines)
    }
}

fn transposed(block: &Block) -> Block {
    let mut turned = [[0.0; SIDE]; SIDE];
    for (row, values) in block.iter().enumerate() {
        for (column, value) in values.iter().enumerate() {
            turned[column][row] = *value;
        }
    }
    turned
}

fn product(left: &Block, right: &Block) -> Block {
    left.map(|row| {
        let mut sums = [0.0; SIDE];
        for (factor, values) in row.iter().zip(right) {
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += factor * value);
        }
        sums
    })
}

#[cfg(test)]
mod tests {
    use rand::RngExt;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::seed::{Purpose, stream};

    /// A noisy frame of 12-bit counts, 64 by 48.
    fn noisy(sigma_counts: f64) -> Vec<u16> {
        let mut random = stream(Purpose::PictureNoise, 1, 0);
        (0..64 * 48)
            .map(|_| {
                (2000.0 + sigma_counts * random.sample::<f64, _>(StandardNormal)).clamp(0.0, 4095.0) as u16
            })
            .collect()
    }

    fn coded(counts: &[u16], quality: u32, width_px: usize) -> Vec<u16> {
        let mut counts = counts.to_vec();
        BlockCoding::new(quality, 4095.0).apply(&mut counts, width_px);
        counts
    }

    fn variance_of_change(counts: &[u16], quality: u32) -> f64 {
        let after = coded(counts, quality, 64);
        let squares =
            counts.iter().zip(&after).map(|(one, other)| (f64::from(*one) - f64::from(*other)).powi(2));
        squares.sum::<f64>() / counts.len() as f64
    }

    #[test]
    fn the_cosines_are_orthonormal() {
        let cosines = BlockCoding::new(50, 255.0).cosines;
        for (row, values) in product(&cosines, &transposed(&cosines)).iter().enumerate() {
            for (column, value) in values.iter().enumerate() {
                assert!((value - f64::from(u8::from(row == column))).abs() < 1.0e-14); // rounding
            }
        }
    }

    #[test]
    fn steps_much_finer_than_the_noise_add_a_uniform_error() {
        // At quality 100 every step is 1/255 of full scale, 16.06 counts: a variance of 16.06^2/12 by Parseval's theorem, and
        // 1/12 for whole counts. 3072 coefficients of relative variance 0.8: a standard error of 0.016; 4.5 of them.
        let law = (4095.0_f64 / 255.0).powi(2) / 12.0 + 1.0 / 12.0;
        let found = variance_of_change(&noisy(200.0), 100);
        assert!((found / law - 1.0).abs() < 4.5 * (0.8_f64 / 3072.0).sqrt(), "{found} {law}");
    }

    #[test]
    fn a_lower_quality_loses_no_more_than_half_a_step_of_each_coefficient() {
        let counts = noisy(300.0);
        let mut last = 0.0;
        for quality in [95, 75, 50, 20, 5] {
            let coding = BlockCoding::new(quality, 4095.0);
            let bound = coding.steps.iter().flatten().map(|step| (step / 2.0).powi(2)).sum::<f64>() / 64.0;
            let found = variance_of_change(&counts, quality);
            // The root of the variance grows by at most half a count's rounding.
            let most = bound.sqrt() * 4095.0 / 255.0 + 0.5;
            assert!(found.sqrt() <= most && found > last, "{quality}: {found}");
            last = found;
        }
    }

    #[test]
    fn an_even_frame_keeps_its_level_within_half_a_step_of_the_mean() {
        for (quality, width_px) in [(90, 64), (50, 12), (10, 64)] {
            let after = coded(&[1234; 64 * 48], quality, width_px);
            // The mean's coefficient is 8 times the mean.
            let step = BlockCoding::new(quality, 4095.0).steps[0][0];
            let most = step / 2.0 / 8.0 * 4095.0 / 255.0 + 0.5;
            assert!(after.iter().all(|&count| (f64::from(count) - 1234.0).abs() <= most), "{quality}");
        }
    }

    #[test]
    fn a_single_cosine_comes_back_as_the_nearest_multiple_of_its_step() {
        let coding = BlockCoding::new(50, 4095.0);
        let block = |height: f64| -> Block {
            let along = coding.cosines[2];
            coding.cosines[1].map(|down| along.map(|along| height * down * along))
        };
        // Row 1, column 2 of the table: a step of 14.
        for (height, kept) in [(6.9, 0.0), (7.1, 14.0), (40.0, 42.0)] {
            let (found, expected) = (coding.coded(&block(height)), block(kept));
            for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
                assert!((found - expected).abs() < 1.0e-12); // rounding
            }
        }
    }
}
