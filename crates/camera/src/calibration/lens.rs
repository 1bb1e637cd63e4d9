//! Radial lens distortion (k1, k2): distorting and undistorting a point, and the Jacobian.

/// A lens's radial distortion, in OpenCV's convention: a ray that an ideal lens images at q, in focal lengths from the
/// centre, is imaged at q (1 + k1 |q|^2 + k2 |q|^4) (Brown, 1971).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Column and row of the optical axis, in pixels.
    pub centre_px: [f64; 2],
    /// The length that `k1` and `k2` refer to, in pixels. A flat board does not tell the focal length, nor is it needed: any
    /// other length with `k1` and `k2` scaled by its square and fourth power is the same lens.
    pub focal_px: f64,
    /// Distortion of third order.
    pub k1: f64,
    /// Distortion of fifth order.
    pub k2: f64,
}

/// A matrix of two rows.
pub(super) type Jacobian = [[f64; 2]; 2];

/// Newton's steps that undistort a point to rounding; 4 to 6 are usual.
const MAX_STEPS: usize = 30;
/// Where the picture grows by less than this along the radius, it is about to fold over, and no model of a real lens.
const LEAST_GROWTH: f64 = 0.1;

impl Lens {
    /// A lens without distortion.
    pub fn ideal() -> Self {
        Self { centre_px: [0.0; 2], focal_px: 1.0, k1: 0.0, k2: 0.0 }
    }

    /// Where the point of the picture `at_px` would lie without distortion, in pixels.
    pub fn undistorted_px(&self, at_px: [f64; 2]) -> [f64; 2] {
        let distorted = self.normalised(at_px);
        let radius = distorted[0].hypot(distorted[1]);
        let ratio = if radius > 0.0 { self.undistorted_radius(radius) / radius } else { 1.0 };
        self.pixels(distorted.map(|component| component * ratio))
    }

    /// Where a lens images the point that an ideal one images at `ideal_px`, in pixels.
    pub fn distorted_px(&self, ideal_px: [f64; 2]) -> [f64; 2] {
        let q = self.normalised(ideal_px);
        let stretch = self.stretch(q[0] * q[0] + q[1] * q[1]);
        self.pixels(q.map(|component| component * stretch))
    }

    /// Derivative of [`Lens::distorted_px`].
    pub(super) fn distortion_jacobian(&self, ideal_px: [f64; 2]) -> Jacobian {
        let [x, y] = self.normalised(ideal_px);
        let square = x * x + y * y;
        let (stretch, slope) = (self.stretch(square), 2.0 * (self.k1 + 2.0 * self.k2 * square));
        [[stretch + slope * x * x, slope * x * y], [slope * x * y, stretch + slope * y * y]]
    }

    /// Whether the distortion can be undone everywhere up to `radius_px` from the optical axis in the picture.
    pub(super) fn is_invertible(&self, radius_px: f64) -> bool {
        const N_STEPS: u32 = 256;
        let step = |index: u32| f64::from(index) / f64::from(N_STEPS) * 2.0 * radius_px / self.focal_px;
        let image = |radius: f64| radius * self.stretch(radius * radius);
        let grows = |radius: &f64| self.growth(*radius) > LEAST_GROWTH;
        let last = (0..=N_STEPS).map(step).take_while(grows).last();
        last.is_some_and(|radius| image(radius) >= radius_px / self.focal_px)
    }

    pub(super) fn normalised(&self, at_px: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| (at_px[axis] - self.centre_px[axis]) / self.focal_px)
    }

    fn pixels(&self, normalised: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| self.centre_px[axis] + self.focal_px * normalised[axis])
    }

    fn stretch(&self, square: f64) -> f64 {
        1.0 + square * (self.k1 + square * self.k2)
    }

    /// Derivative of the distorted radius by the ideal one.
    fn growth(&self, radius: f64) -> f64 {
        let square = radius * radius;
        1.0 + square * (3.0 * self.k1 + square * 5.0 * self.k2)
    }

    fn undistorted_radius(&self, distorted: f64) -> f64 {
        let mut radius = distorted;
        for _ in 0..MAX_STEPS {
            let excess = radius * self.stretch(radius * radius) - distorted;
            let step = excess / self.growth(radius).max(LEAST_GROWTH);
            radius -= step;
            if step.abs() <= 1e-15 * distorted {
                break;
            }
        }
        radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens(k1: f64, k2: f64) -> Lens {
        Lens { centre_px: [640.0, 400.0], focal_px: 750.0, k1, k2 }
    }

    #[test]
    fn undistorting_is_the_inverse_of_distorting() {
        for (k1, k2) in [(0.0, 0.0), (0.1, 0.0), (-0.2, 0.05), (-0.1, -0.02), (0.3, 0.1)] {
            let lens = lens(k1, k2);
            assert!(lens.is_invertible(760.0));
            for at_px in [[0.0, 0.0], [1279.0, 799.0], [640.0, 400.0], [640.0, 10.0], [3.5, 700.25]] {
                let again = lens.distorted_px(lens.undistorted_px(at_px));
                // Rounding of coordinates of a thousand pixels.
                assert!((again[0] - at_px[0]).hypot(again[1] - at_px[1]) < 1e-11, "{lens:?} {at_px:?}");
            }
        }
    }

    #[test]
    fn a_lens_that_folds_the_picture_is_known() {
        // r (1 - 0.5 r^2) has its largest value 0.544 at r = 0.816.
        assert!(lens(-0.5, 0.0).is_invertible(0.5 * 750.0));
        assert!(!lens(-0.5, 0.0).is_invertible(0.55 * 750.0));
    }

    #[test]
    fn the_jacobian_is_the_derivative() {
        let lens = lens(-0.2, 0.07);
        let at_px = [1100.0, 90.0];
        let jacobian = lens.distortion_jacobian(at_px);
        for axis in 0..2 {
            let moved = |by: f64| {
                let mut moved_px = at_px;
                moved_px[axis] += by;
                lens.distorted_px(moved_px)
            };
            let (ahead, behind) = (moved(0.01), moved(-0.01));
            for row in 0..2 {
                // Second order of a step of 0.01 px in 750, and rounding over the step.
                assert!((jacobian[row][axis] - (ahead[row] - behind[row]) / 0.02).abs() < 1e-9);
            }
        }
    }
}
