//! The homography from undistorted pixels to the plane of the chain, with lens distortion undone before it.

use super::checks::refusal;
use super::lens::{Jacobian, Lens};
use crate::error::CameraError;

/// Points closer than this are the same but for rounding, however far outside the picture.
const SAME_POINT_PX: f64 = 1e-6;

/// From points of the picture to the plane in which the chain moves: the lens's distortion is undone, then the perspective.
///
/// In the plane, x points along the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneMap {
    /// The lens.
    pub lens: Lens,
    /// From an undistorted point (x px, y px, 1) to the plane (x m, y m, 1), up to a factor.
    pub plane_from_image: [[f64; 3]; 3],
}

impl PlaneMap {
    /// The point of the plane that is imaged at `at_px`, in metres.
    pub fn position_m(&self, at_px: [f64; 2]) -> [f64; 2] {
        projected(&self.plane_from_image, self.lens.undistorted_px(at_px))
    }

    /// Where the point `at_m` of the plane is imaged, in pixels; `None` so far outside the picture that the lens's
    /// distortion, as it was found inside, folds over.
    pub fn image_px(&self, at_m: [f64; 2]) -> Option<[f64; 2]> {
        let ideal_px = projected(&adjugate(&self.plane_from_image), at_m);
        let at_px = self.lens.distorted_px(ideal_px);
        let again_px = self.lens.undistorted_px(at_px);
        let is_same = (again_px[0] - ideal_px[0]).hypot(again_px[1] - ideal_px[1]) < SAME_POINT_PX;
        is_same.then_some(at_px)
    }

    /// The map of a picture that is larger by a factor about a point: what lies at `at_px` by this map lies at
    /// `about_px + factor (at_px - about_px)` by that one.
    #[must_use]
    pub fn magnified(&self, factor: f64, about_px: [f64; 2]) -> Self {
        let [x, y] = self.lens.centre_px;
        let centre_px = [about_px[0] + factor * (x - about_px[0]), about_px[1] + factor * (y - about_px[1])];
        let lens = Lens { centre_px, focal_px: factor * self.lens.focal_px, ..self.lens };
        let smaller = |[x, y, one]: [f64; 3]| {
            let kept = 1.0 - factor.recip();
            [x / factor, y / factor, one + kept * (x * about_px[0] + y * about_px[1])]
        };
        Self { lens, plane_from_image: self.plane_from_image.map(smaller) }
    }

    /// The map of the same plane by a camera with a lens, turned about the vertical through its centre so that what an ideal camera at right
    /// angles shows q to the right of the centre is shown where `q / (1 + tilt_per_px q)` gives q again.
    #[must_use]
    pub fn seen_through(&self, lens: Lens, tilt_per_px: f64) -> Self {
        let [x, y] = lens.centre_px;
        // About the centre, (q, r, 1) becomes (q, r, 1 + h q).
        let about = |[a, b, one]: [f64; 3]| {
            let at_centre = a * x + b * y + one;
            let a = a + at_centre * tilt_per_px;
            [a, b, at_centre - a * x - b * y]
        };
        Self { lens, plane_from_image: self.plane_from_image.map(about) }
    }

    /// Derivative of [`PlaneMap::position_m`]: metres of the plane for a pixel of the picture.
    pub fn m_per_px(&self, at_px: [f64; 2]) -> [[f64; 2]; 2] {
        let ideal_px = self.lens.undistorted_px(at_px);
        let perspective = projection_jacobian(&self.plane_from_image, ideal_px);
        times(perspective, inverse(self.lens.distortion_jacobian(ideal_px)))
    }

    /// Refuses a map that does not give every point of a picture one place in the plane.
    pub fn check(&self, width_px: usize, height_px: usize) -> Result<(), CameraError> {
        let refused = |what: &str, expected: &str, found| Err(refusal(what, expected, found));
        let corners_px = corners_px(width_px, height_px);
        let [cx, cy] = self.lens.centre_px;
        let radius_px = corners_px.iter().map(|[x, y]| (x - cx).hypot(y - cy)).fold(0.0, f64::max);
        if !(self.lens.focal_px.is_finite() && self.lens.focal_px > 0.0) {
            return refused("length that k1 and k2 refer to", "more than 0 px", self.lens.focal_px);
        }
        if !self.lens.is_invertible(radius_px) {
            return refused(
                "distortion k1",
                "one that can be undone in the whole picture, with k2",
                self.lens.k1,
            );
        }
        let depths = corners_px.map(|at_px| depth(&self.plane_from_image, self.lens.undistorted_px(at_px)));
        let same_side = depths.iter().all(|depth| depth * depths[0] > 0.0);
        let determinant = determinant(&self.plane_from_image);
        if !(same_side && determinant.is_finite() && determinant != 0.0) {
            return refused("perspective", "the whole picture on one side of the horizon", depths[0]);
        }
        Ok(())
    }
}

/// The centres of a picture's corner pixels.
pub(super) fn corners_px(width_px: usize, height_px: usize) -> [[f64; 2]; 4] {
    let (right, bottom) = (width_px as f64 - 1.0, height_px as f64 - 1.0);
    [[0.0, 0.0], [right, 0.0], [0.0, bottom], [right, bottom]]
}

/// The plane of a picture without perspective, whose x points along `axis` in the picture from `origin_px`.
pub(super) fn scaled_plane(m_per_px: f64, axis: [f64; 2], origin_px: [f64; 2]) -> [[f64; 3]; 3] {
    let across = [-axis[1], axis[0]];
    let row = |direction: [f64; 2]| {
        let [x, y] = direction.map(|component| component * m_per_px);
        [x, y, -dot([x, y], origin_px)]
    };
    [row(axis), row(across), [0.0, 0.0, 1.0]]
}

pub(super) fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Third component of the image of (x, y, 1).
fn depth(matrix: &[[f64; 3]; 3], [x, y]: [f64; 2]) -> f64 {
    matrix[2][0] * x + matrix[2][1] * y + matrix[2][2]
}

/// The point that a homography makes of another.
pub(super) fn projected(matrix: &[[f64; 3]; 3], at: [f64; 2]) -> [f64; 2] {
    let component = |row: usize| matrix[row][0] * at[0] + matrix[row][1] * at[1] + matrix[row][2];
    [component(0) / component(2), component(1) / component(2)]
}

/// Derivative of [`projected`].
pub(super) fn projection_jacobian(matrix: &[[f64; 3]; 3], at: [f64; 2]) -> Jacobian {
    let image = projected(matrix, at);
    let w = depth(matrix, at);
    [0, 1].map(|row| [0, 1].map(|column| (matrix[row][column] - image[row] * matrix[2][column]) / w))
}

pub(super) fn times(a: Jacobian, b: Jacobian) -> Jacobian {
    [0, 1].map(|row| [0, 1].map(|column| a[row][0] * b[0][column] + a[row][1] * b[1][column]))
}

fn inverse([[a, b], [c, d]]: Jacobian) -> Jacobian {
    let determinant = a * d - b * c;
    [[d / determinant, -b / determinant], [-c / determinant, a / determinant]]
}

fn determinant(m: &[[f64; 3]; 3]) -> f64 {
    let adjugate = adjugate(m);
    (0..3).map(|k| m[0][k] * adjugate[k][0]).sum()
}

/// The inverse of a homography, which is given up to a factor.
pub(super) fn adjugate(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let minor = |row: usize, column: usize| {
        let (r, c) = ([(row + 1) % 3, (row + 2) % 3], [(column + 1) % 3, (column + 2) % 3]);
        m[r[0]][c[0]] * m[r[1]][c[1]] - m[r[0]][c[1]] * m[r[1]][c[0]]
    };
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| minor(column, row)))
}

/// Product of two homographies.
pub(super) fn product(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| (0..3).map(|k| a[row][k] * b[k][column]).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> PlaneMap {
        let lens = Lens { centre_px: [630.0, 410.0], focal_px: 754.0, k1: -0.12, k2: 0.03 };
        let plane_from_image = [[2e-4, 3e-6, -0.12], [-2e-6, 2.1e-4, -0.08], [1e-5, -2e-5, 1.0]];
        PlaneMap { lens, plane_from_image }
    }

    #[test]
    fn a_larger_picture_shows_the_same_plane() {
        let (factor, about_px) = (1.02, [639.5, 399.5]);
        let larger = map().magnified(factor, about_px);
        for [x, y] in [[0.0, 0.0], [639.5, 399.5], [1279.0, 120.0]] {
            let at_px = [about_px[0] + factor * (x - about_px[0]), about_px[1] + factor * (y - about_px[1])];
            let (there, here) = (larger.position_m(at_px), map().position_m([x, y]));
            // Rounding of numbers below 1 m after some tens of operations.
            assert!(
                (there[0] - here[0]).abs() < 1e-13 && (there[1] - here[1]).abs() < 1e-13,
                "{there:?} {here:?}"
            );
        }
    }

    #[test]
    fn a_turned_camera_and_a_lens_stretch_what_they_are_said_to() {
        let (centre_px, m_per_px) = ([320.0, 60.0], 3e-4);
        let plain =
            PlaneMap { lens: Lens::ideal(), plane_from_image: scaled_plane(m_per_px, [1.0, 0.0], [0.0; 2]) };
        let (tilt_per_px, k1) = (4e-6, -2e-3);
        let lens = Lens { centre_px, focal_px: 300.0, k1, k2: 0.0 };
        let bent = plain.seen_through(lens, tilt_per_px);
        for x_px in [20.0, 320.0, 500.0] {
            let d = (x_px - centre_px[0]) / 300.0;
            // q (1 + k1 q^2) = d, less 12 k1^3 d^7 and what is smaller by k1 again, and then q / (1 + h q)
            let q_px = 300.0 * (d - k1 * d.powi(3) + 3.0 * k1 * k1 * d.powi(5));
            let expected_m = m_per_px * (centre_px[0] + q_px / (1.0 + tilt_per_px * q_px));
            let found_m = bent.position_m([x_px, centre_px[1]]);
            assert!(
                (found_m[0] - expected_m).abs() < 13.0 * 300.0 * m_per_px * k1.abs().powi(3),
                "{x_px}: {found_m:?} {expected_m}"
            );
            assert!((found_m[1] - m_per_px * centre_px[1]).abs() < 1e-15, "{found_m:?}");
        }
    }

    #[test]
    fn a_point_of_the_plane_is_imaged_where_it_is_found() {
        for at_px in corners_px(1280, 800).into_iter().chain([[500.25, 333.5]]) {
            let again = map().image_px(map().position_m(at_px)).unwrap();
            // Rounding of coordinates of a thousand pixels, through an inverse.
            assert!((again[0] - at_px[0]).hypot(again[1] - at_px[1]) < 1e-9, "{at_px:?} {again:?}");
        }
    }

    #[test]
    fn a_point_far_outside_is_not_folded_into_the_picture() {
        let strong = PlaneMap { lens: Lens { k1: -0.12, k2: 0.0, ..map().lens }, ..map() };
        assert!(strong.image_px(strong.position_m([1279.0, 0.0])).is_some());
        // r (1 - 0.12 r^2) comes back to 0 at r = 2.9, which is 2180 px from the axis.
        let far_m = PlaneMap { lens: Lens::ideal(), ..map() }.position_m([630.0 + 2000.0, 410.0]);
        assert_eq!(strong.image_px(far_m), None);
    }

    #[test]
    fn the_jacobian_is_the_derivative() {
        let at_px = [1000.0, 120.0];
        let jacobian = map().m_per_px(at_px);
        let place = |dx: f64, dy: f64| map().position_m([at_px[0] + dx, at_px[1] + dy]);
        let differences = [(place(0.01, 0.0), place(-0.01, 0.0)), (place(0.0, 0.01), place(0.0, -0.01))];
        for (column, (ahead, behind)) in differences.into_iter().enumerate() {
            for row in 0..2 {
                let expected = (ahead[row] - behind[row]) / 0.02;
                // Rounding of 0.1 m over the step, 1e-14 m / px.
                assert!((jacobian[row][column] - expected).abs() < 1e-13, "{jacobian:?}");
            }
        }
    }

    #[test]
    fn a_map_that_folds_the_picture_is_refused() {
        assert!(map().check(1280, 800).is_ok());
        let folded = PlaneMap { lens: Lens { k1: -0.6, k2: 0.0, ..map().lens }, ..map() };
        assert!(folded.check(1280, 800).is_err());
        let mut horizon = map();
        horizon.plane_from_image[2] = [1e-3, 0.0, -0.5];
        assert!(horizon.check(1280, 800).is_err());
        let flat =
            PlaneMap { plane_from_image: [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]], ..map() };
        assert!(flat.check(1280, 800).is_err());
    }
}
