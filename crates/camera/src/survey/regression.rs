//! The difference of two frames in small blocks, freed of motion and of a change of brightness by least squares.

/// Side of a block, in pixels.
pub(super) const SIDE_PX: usize = 5;
/// Rows and columns around the blocks that the gradients reach into.
pub(super) const BORDER_PX: usize = 2;
/// Degrees of freedom that a block's residual keeps: its pixels less two displacements and one change of brightness.
pub(super) const FREEDOM: f64 = (SIDE_PX * SIDE_PX - 3) as f64;

/// What the difference between two frames is made of in one block.
pub(super) struct NoiseBlock {
    /// Mean count of both frames.
    pub(super) level: f64,
    /// Variance of the difference that neither motion nor a change of brightness explains, in counts squared.
    pub(super) residual: f64,
    /// Sum of squares of the difference that motion explains, in counts squared.
    pub(super) motion: f64,
}

/// Two frames of the same size, one after the other.
pub(super) struct Pair<'a> {
    pub(super) first: &'a [f32],
    pub(super) second: &'a [f32],
    pub(super) width_px: usize,
}

impl Pair<'_> {
    /// The block whose top left pixel is (`x`, `y`), at least [`BORDER_PX`] from the edges.
    ///
    /// A small displacement (u, v) changes the counts by -u df/dx - v df/dy to first order (Horn and Schunck, 1981), here with the
    /// gradients of the mean of both frames, so that the second order cancels. Least squares take that and a
    /// constant out of the difference. The noise of the mean is independent of the difference's.
    pub(super) fn block(&self, x: usize, y: usize) -> NoiseBlock {
        let mut sums = RegressionSums::default();
        for row in y..y + SIDE_PX {
            for at in row * self.width_px + x..row * self.width_px + x + SIDE_PX {
                let difference = f64::from(self.second[at]) - f64::from(self.first[at]);
                sums.add(self.mean(at), self.slope(at, 1), self.slope(at, self.width_px), difference);
            }
        }
        sums.block()
    }

    fn mean(&self, at: usize) -> f64 {
        0.5 * (f64::from(self.first[at]) + f64::from(self.second[at]))
    }

    /// Derivative over four neighbours, exact for polynomials of fourth degree.
    fn slope(&self, at: usize, stride: usize) -> f64 {
        let mean = |at| self.mean(at);
        (8.0 * (mean(at + stride) - mean(at - stride)) - (mean(at + 2 * stride) - mean(at - 2 * stride)))
            / 12.0
    }
}

#[derive(Default)]
struct RegressionSums {
    n: f64,
    mean: f64,
    gx: f64,
    gy: f64,
    d: f64,
    gx_gx: f64,
    gx_gy: f64,
    gy_gy: f64,
    gx_d: f64,
    gy_d: f64,
    d_d: f64,
}

impl RegressionSums {
    fn add(&mut self, mean: f64, gx: f64, gy: f64, d: f64) {
        self.n += 1.0;
        self.mean += mean;
        self.gx += gx;
        self.gy += gy;
        self.d += d;
        self.gx_gx += gx * gx;
        self.gx_gy += gx * gy;
        self.gy_gy += gy * gy;
        self.gx_d += gx * d;
        self.gy_d += gy * d;
        self.d_d += d * d;
    }

    /// Least squares with the constant eliminated: everything about the means.
    fn block(&self) -> NoiseBlock {
        let about = |ab: f64, a: f64, b: f64| ab - a * b / self.n;
        let (xx, yy) = (about(self.gx_gx, self.gx, self.gx), about(self.gy_gy, self.gy, self.gy));
        let xy = about(self.gx_gy, self.gx, self.gy);
        let (xd, yd) = (about(self.gx_d, self.gx, self.d), about(self.gy_d, self.gy, self.d));
        let dd = about(self.d_d, self.d, self.d);
        let determinant = xx * yy - xy * xy;
        let motion = if determinant > f64::EPSILON * xx * yy {
            (yy * xd * xd - 2.0 * xy * xd * yd + xx * yd * yd) / determinant
        } else {
            0.0
        };
        let residual = (dd - motion).max(0.0) / FREEDOM;
        NoiseBlock { level: self.mean / self.n, residual, motion }
    }
}
