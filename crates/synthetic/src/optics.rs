//! Lens and pose of the camera: how the picture departs from a parallel view at right angles.

use serde::{Deserialize, Serialize};

use crate::SyntheticError;
use crate::check::require;

/// How the picture departs from a parallel view at right angles: the camera's turn against the chain, and its lens.
///
/// A point of the specimen's plane that an ideal camera would show at the pixel q is shown elsewhere: with
/// (x, y, 0) = (q - principal point)/focal length, the plane is turned about the principal point by
/// R = R_z(roll) R_y(yaw) R_x(pitch), seen in perspective at (x, y)' = (X, Y)/(1 + Z), and the lens moves that point, with
/// r^2 = x^2 + y^2 (Brown 1966, in the order and signs of OpenCV's camera model), to
///
/// - x (1 + k1 r^2 + k2 r^4) + 2 p1 x y + p2 (r^2 + 2 x^2),
/// - y (1 + k1 r^2 + k2 r^4) + p1 (r^2 + 2 y^2) + 2 p2 x y.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Optics {
    /// Focal length by which pixels are normalised; the camera stands focal_length_px/scale from the specimen.
    pub focal_length_px: f64,
    /// Where the optical axis meets the picture (column, row); the frame's centre when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub principal_point_px: Option<[f64; 2]>,
    /// Radial distortion of the third order.
    #[serde(default)]
    pub k1: f64,
    /// Radial distortion of the fifth order.
    #[serde(default)]
    pub k2: f64,
    /// Tangential distortion along the rows' direction.
    #[serde(default)]
    pub p1: f64,
    /// Tangential distortion along the columns' direction.
    #[serde(default)]
    pub p2: f64,
    /// Turn of the picture about the optical axis, from x (right) towards y (down).
    #[serde(default)]
    pub roll_rad: f64,
    /// Tilt about the vertical: the chain's right end comes nearer for a positive one.
    #[serde(default)]
    pub yaw_rad: f64,
    /// Tilt about the chain: the lower edge is farther away for a positive one.
    #[serde(default)]
    pub pitch_rad: f64,
}

/// Tilts beyond this are no longer slight, and a plane seen edge-on cannot be mapped back.
const LARGEST_TILT_RAD: f64 = 0.5;

/// Newton steps that undo the lens; each doubles the digits, and a lens that needs more folds the picture over.
const UNDISTORT_STEPS: usize = 20;

impl Optics {
    /// No lens, and no turn; the focal length has no effect then.
    pub const STRAIGHT: Self = Self {
        focal_length_px: 1.0e4,
        principal_point_px: None,
        k1: 0.0,
        k2: 0.0,
        p1: 0.0,
        p2: 0.0,
        roll_rad: 0.0,
        yaw_rad: 0.0,
        pitch_rad: 0.0,
    };

    pub(crate) fn check(&self) -> Result<(), SyntheticError> {
        let focal = self.focal_length_px >= 1.0 && self.focal_length_px <= 1.0e9;
        require(focal, "camera.optics.focal_length_px", "1 to 1e9 pixels", self.focal_length_px)?;
        for at_px in self.principal_point_px.into_iter().flatten() {
            require(
                at_px.abs() <= 1.0e6,
                "camera.optics.principal_point_px",
                "within a million pixels",
                at_px,
            )?;
        }
        for (name, tilt_rad) in
            [("camera.optics.yaw_rad", self.yaw_rad), ("camera.optics.pitch_rad", self.pitch_rad)]
        {
            require(tilt_rad.abs() <= LARGEST_TILT_RAD, name, "-0.5 to 0.5", tilt_rad)?;
        }
        for (name, number) in [
            ("camera.optics.roll_rad", self.roll_rad),
            ("camera.optics.k1", self.k1),
            ("camera.optics.k2", self.k2),
            ("camera.optics.p1", self.p1),
            ("camera.optics.p2", self.p2),
        ] {
            require(number.is_finite(), name, "a finite number", number)?;
        }
        Ok(())
    }
}

/// [`Optics`] ready to map points, both ways.
#[derive(Debug, Clone)]
pub(crate) struct Mapping {
    optics: Optics,
    principal_point_px: [f64; 2],
    /// R, row by row.
    turn: [[f64; 3]; 3],
}

impl Mapping {
    pub(crate) fn new(optics: &Optics, size_px: [usize; 2]) -> Self {
        let centre_px = size_px.map(|size| (size as f64 - 1.0) / 2.0);
        Self {
            principal_point_px: optics.principal_point_px.unwrap_or(centre_px),
            turn: turn(optics),
            optics: *optics,
        }
    }

    /// The pixel that shows what an ideal camera would show at `ideal_px`.
    pub(crate) fn picture_px(&self, ideal_px: [f64; 2]) -> [f64; 2] {
        self.pixels(self.distort(self.project(self.normalise(ideal_px))))
    }

    /// Where an ideal camera would show what stands at a pixel; `None` where the lens folds the picture over.
    pub(crate) fn ideal_px(&self, picture_px: [f64; 2]) -> Option<[f64; 2]> {
        self.undistort(self.normalise(picture_px)).map(|seen| self.pixels(self.back_project(seen)))
    }

    fn normalise(&self, at_px: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| (at_px[axis] - self.principal_point_px[axis]) / self.optics.focal_length_px)
    }

    fn pixels(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| self.principal_point_px[axis] + self.optics.focal_length_px * at[axis])
    }

    fn project(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [right, down, away] = self.turn.map(|row| row[0] * x + row[1] * y);
        [right / (1.0 + away), down / (1.0 + away)]
    }

    /// The inverse of [`Mapping::project`]: (x, y) solves two linear equations.
    fn back_project(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [right, down, away] = self.turn;
        let row = |seen: f64, of: [f64; 3]| [of[0] - seen * away[0], of[1] - seen * away[1]];
        solve([row(u, right), row(v, down)], [u, v])
    }

    fn distort(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let Optics { k1, k2, p1, p2, .. } = self.optics;
        let square = x * x + y * y;
        let radial = 1.0 + square * (k1 + square * k2);
        [
            x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    }

    /// Derivatives of [`Mapping::distort`]: rows are its components, columns x and y.
    fn distortion_slopes(&self, [x, y]: [f64; 2]) -> [[f64; 2]; 2] {
        let Optics { k1, k2, p1, p2, .. } = self.optics;
        let square = x * x + y * y;
        let radial = 1.0 + square * (k1 + square * k2);
        let bend = 2.0 * (k1 + 2.0 * k2 * square);
        let mixed = bend * x * y + 2.0 * (p1 * x + p2 * y);
        [
            [radial + bend * x * x + 2.0 * p1 * y + 6.0 * p2 * x, mixed],
            [mixed, radial + bend * y * y + 6.0 * p1 * y + 2.0 * p2 * x],
        ]
    }

    /// The inverse of [`Mapping::distort`], by Newton's method from the distorted point; `None` beyond the fold.
    fn undistort(&self, seen: [f64; 2]) -> Option<[f64; 2]> {
        let mut at = seen;
        for _ in 0..UNDISTORT_STEPS {
            let slopes = self.distortion_slopes(at);
            let unfolded = slopes[0][0] * slopes[1][1] - slopes[0][1] * slopes[1][0] > 0.0;
            let shown = self.distort(at);
            let step = solve(slopes, [seen[0] - shown[0], seen[1] - shown[1]]);
            at = [at[0] + step[0], at[1] + step[1]];
            // 1e-15 of the focal length: rounding.
            if step[0].abs().max(step[1].abs()) <= 1.0e-15 * (1.0 + at[0].abs().max(at[1].abs())) {
                return unfolded.then_some(at);
            }
        }
        None
    }
}

/// R_z(roll) R_y(yaw) R_x(pitch), row by row.
fn turn(optics: &Optics) -> [[f64; 3]; 3] {
    let (sin_roll, cos_roll) = (libm::sin(optics.roll_rad), libm::cos(optics.roll_rad));
    let (sin_yaw, cos_yaw) = (libm::sin(optics.yaw_rad), libm::cos(optics.yaw_rad));
    let (sin_pitch, cos_pitch) = (libm::sin(optics.pitch_rad), libm::cos(optics.pitch_rad));
    [
        [
            cos_roll * cos_yaw,
            cos_roll * sin_yaw * sin_pitch - sin_roll * cos_pitch,
            cos_roll * sin_yaw * cos_pitch + sin_roll * sin_pitch,
        ],
        [
            sin_roll * cos_yaw,
            sin_roll * sin_yaw * sin_pitch + cos_roll * cos_pitch,
            sin_roll * sin_yaw * cos_pitch - cos_roll * sin_pitch,
        ],
        [-sin_yaw, cos_yaw * sin_pitch, cos_yaw * cos_pitch],
    ]
}

/// The solution of two linear equations.
fn solve([first, second]: [[f64; 2]; 2], right: [f64; 2]) -> [f64; 2] {
    let determinant = first[0] * second[1] - first[1] * second[0];
    let x = right[0] * second[1] - first[1] * right[1];
    let y = first[0] * right[1] - right[0] * second[0];
    [x / determinant, y / determinant]
}

#[cfg(test)]
mod tests {
    use super::*;

    const STRAIGHT: Optics = Optics { principal_point_px: Some([500.0, 50.0]), ..Optics::STRAIGHT };

    fn assert_shows(optics: Optics, ideal_px: [f64; 2], picture_px: [f64; 2]) {
        let found_px = Mapping::new(&optics, [1000, 100]).picture_px(ideal_px);
        for axis in 0..2 {
            // 1e-10 px: rounding of some thousand pixels.
            assert!((found_px[axis] - picture_px[axis]).abs() < 1.0e-10, "{found_px:?} for {picture_px:?}");
        }
    }

    #[test]
    fn each_distortion_has_its_closed_form_at_known_points() {
        // The point (0.05, 0.02) of the normalised plane: r^2 = 0.0029.
        let at_px = [1000.0, 250.0];
        let moved = |x: f64, y: f64| [1000.0 + 1.0e4 * x, 250.0 + 1.0e4 * y];
        assert_shows(STRAIGHT, at_px, at_px);
        assert_shows(Optics { k1: 2.0, ..STRAIGHT }, at_px, moved(0.05 * 0.0058, 0.02 * 0.0058));
        assert_shows(Optics { k2: 1.0e3, ..STRAIGHT }, at_px, moved(0.05 * 8.41e-3, 0.02 * 8.41e-3));
        assert_shows(Optics { p1: 0.3, ..STRAIGHT }, at_px, moved(0.3 * 2.0e-3, 0.3 * 3.7e-3));
        assert_shows(Optics { p2: 0.3, ..STRAIGHT }, at_px, moved(0.3 * 7.9e-3, 0.3 * 2.0e-3));
    }

    #[test]
    fn each_turn_has_its_closed_form_at_known_points() {
        let angle = 0.03_f64;
        // 1000 px to the right of the axis: x = 0.1.
        let right_px = [1500.0, 50.0];
        let seen = [500.0 + 1000.0 * angle.cos(), 50.0 + 1000.0 * angle.sin()];
        assert_shows(Optics { roll_rad: angle, ..STRAIGHT }, right_px, seen);
        let nearer = 1.0 - 0.1 * angle.sin();
        let seen = [500.0 + 1000.0 * angle.cos() / nearer, 50.0];
        assert_shows(Optics { yaw_rad: angle, ..STRAIGHT }, right_px, seen);
        let farther = 1.0 + 0.1 * angle.sin();
        let seen = [500.0, 50.0 + 1000.0 * angle.cos() / farther];
        assert_shows(Optics { pitch_rad: angle, ..STRAIGHT }, [500.0, 1050.0], seen);
    }

    #[test]
    fn mapping_back_undoes_everything() {
        let optics = Optics {
            k1: 1.5,
            k2: -20.0,
            p1: 0.02,
            p2: -0.03,
            roll_rad: 0.01,
            yaw_rad: -0.02,
            pitch_rad: 0.015,
            ..STRAIGHT
        };
        let mapping = Mapping::new(&optics, [1000, 100]);
        for picture_px in [[0.0, 0.0], [999.0, 0.0], [500.0, 50.0], [123.4, 99.0], [999.0, 99.0]] {
            let again_px = mapping.picture_px(mapping.ideal_px(picture_px).unwrap());
            // 1e-10 px: rounding.
            assert!((again_px[0] - picture_px[0]).hypot(again_px[1] - picture_px[1]) < 1.0e-10);
        }
    }

    #[test]
    fn a_lens_that_folds_the_picture_is_found_out() {
        // r (1 + k1 r^2) has its maximum at r = 1/sqrt(-3 k1) = 0.0408, where it is 0.0272: no point is shown beyond.
        let mapping = Mapping::new(&Optics { k1: -200.0, ..STRAIGHT }, [1000, 100]);
        assert_eq!(mapping.ideal_px([900.0, 50.0]), None);
        assert!(mapping.ideal_px([600.0, 50.0]).is_some());
    }
}
