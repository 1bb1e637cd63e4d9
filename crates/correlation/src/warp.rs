//! Where a subset lies in an image, and how it is deformed: shape functions to second order.

use crate::Shape;

/// Where a subset lies in an image: the point at `(x, y)` from its centre is found at `position_px + (1 + gradient) (x,
/// y)` and the curvature's terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Warp {
    /// The centre in the image, x and y.
    pub(crate) position_px: [f64; 2],
    /// Displacement gradient: du/dx, du/dy, dv/dx, dv/dy.
    pub(crate) gradient: [f64; 4],
    /// Coefficients of x^2, xy and y^2 in u, then in v, per pixel.
    pub(crate) curvature: [f64; 6],
}

/// Parameters of the largest shape function: u by its terms 1, x, y, x^2, xy, y^2, then v.
pub(crate) const MAX_PARAMETERS: usize = 12;

/// A polynomial of second order: the coefficients of 1, x, y, x^2, xy, y^2.
type Polynomial = [f64; 6];

impl Warp {
    /// An undeformed subset whose centre lies at `position_px`.
    pub(crate) fn at(position_px: [f64; 2]) -> Self {
        Self { position_px, gradient: [0.0; 4], curvature: [0.0; 6] }
    }

    /// The gradient that follows two others where each step deforms as the one before: of the deformations F and G that is `G F^-1 G`.
    /// `None` where F folds.
    pub(crate) fn gradient_after(before: &[f64; 4], newest: &[f64; 4]) -> Option<[f64; 4]> {
        let (newest, before) = (linear(newest), linear(before));
        let determinant = before[0] * before[3] - before[1] * before[2];
        let inverse = [before[3], -before[1], -before[2], before[0]].map(|entry| entry / determinant);
        let [xx, xy, yx, yy] = times(times(newest, inverse), newest);
        (determinant > 0.1).then_some([xx - 1.0, xy, yx, yy - 1.0])
    }

    /// The same of a subset that was deformed by a gradient before.
    pub(crate) fn after_gradient(&self, before: &[f64; 4]) -> Self {
        let [xx, xy, yx, yy] = times(linear(&self.gradient), linear(before));
        Self { gradient: [xx - 1.0, xy, yx, yy - 1.0], ..*self }
    }

    /// The same, then turned about its centre by an angle in radians.
    pub(crate) fn turned(&self, angle_rad: f64) -> Self {
        let (sin, cos) = angle_rad.sin_cos();
        let [ux, uy, vx, vy] = self.gradient;
        let (xx, yy) = (1.0 + ux, 1.0 + vy);
        let gradient =
            [cos * xx - sin * vx - 1.0, cos * uy - sin * yy, sin * xx + cos * vx, sin * uy + cos * yy - 1.0];
        Self { gradient, ..*self }
    }

    /// Whether a subset may have been so deformed: no length is less than a third of what it was, nor more than three times. A warp that
    /// gathers a subset in a spot resembles anything smooth.
    pub(crate) fn is_plausible(&self) -> bool {
        const MOST: f64 = 3.0;
        let [ux, uy, vx, vy] = self.gradient;
        let (a, b, c, d) = (1.0 + ux, uy, vx, 1.0 + vy);
        // Singular values of a matrix of two rows: half the sum and half the difference of these.
        let length = |x: f64, y: f64| (x * x + y * y).sqrt();
        let (sum, difference) = (length(a + d, b - c), length(a - d, b + c));
        let (largest, smallest) = (0.5 * (sum + difference), 0.5 * (sum - difference));
        largest <= MOST && smallest >= MOST.recip()
    }

    /// Pixels of the target on which one of the reference lies, at the centre: the determinant of the linear part, or its absolute value.
    pub(crate) fn area(&self) -> f64 {
        let [ux, uy, vx, vy] = self.gradient;
        ((1.0 + ux) * (1.0 + vy) - uy * vx).abs()
    }

    /// The angle by which the linear part turns, from x towards y, in radians: that of the rotation R in its polar decomposition F = R U.
    pub(crate) fn angle_rad(&self) -> f64 {
        let [ux, uy, vx, vy] = self.gradient;
        (vx - uy).atan2(2.0 + ux + vy)
    }

    /// What a unit of a small further deformation A, F (1 + A), turns: the factors of `du/dx`, `du/dy`, `dv/dx` and `dv/dy`. With F = R U
    /// the rotation of R (U + U A) is, to first order, the antisymmetric part of U A over the trace of U.
    pub(crate) fn turn_of_step(&self) -> [f64; 4] {
        let [ux, uy, vx, vy] = self.gradient;
        let (sin, cos) = self.angle_rad().sin_cos();
        let (xx, yy) = (1.0 + ux, 1.0 + vy);
        let stretch = [cos * xx + sin * vx, cos * uy + sin * yy, cos * yy - sin * uy];
        let trace = stretch[0] + stretch[2];
        [stretch[1], -stretch[0], stretch[2], -stretch[1]].map(|factor| factor / trace)
    }

    /// Whether the subset is moved and not deformed.
    pub(crate) fn is_translation(&self) -> bool {
        self.gradient.iter().chain(&self.curvature).all(|&slope| slope == 0.0)
    }

    /// Where the point at `(x, y)` from the centre lies.
    #[inline(always)]
    pub(crate) fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [ux, uy, vx, vy] = self.gradient;
        let [cx, cy] = self.position_px;
        let [uxx, uxy, uyy, vxx, vxy, vyy] = self.curvature;
        [
            cx + (1.0 + ux) * x + uy * y + (uxx * x + uxy * y) * x + uyy * y * y,
            cy + vx * x + (1.0 + vy) * y + (vxx * x + vxy * y) * x + vyy * y * y,
        ]
    }

    /// Variances along x and y in the target of a place whose covariance (xx, xy, yy) in the subset's own coordinates is given: the diagonal of
    /// `(1 + A) cov (1 + A)^T`.
    pub(crate) fn variances_in_target(&self, [xx, xy, yy]: [f64; 3]) -> [f64; 2] {
        let [ux, uy, vx, vy] = self.gradient;
        [[1.0 + ux, uy], [vx, 1.0 + vy]].map(|[a, b]| (a * a * xx + 2.0 * a * b * xy + b * b * yy).max(0.0))
    }

    /// The point from the centre that lies at a place, by the linear part of the warp; `None` where it folds the subset.
    pub(crate) fn source(&self, place: [f64; 2]) -> Option<[f64; 2]> {
        let [ux, uy, vx, vy] = self.gradient;
        let determinant = (1.0 + ux) * (1.0 + vy) - uy * vx;
        let [dx, dy] = [place[0] - self.position_px[0], place[1] - self.position_px[1]];
        let source = [((1.0 + vy) * dx - uy * dy) / determinant, ((1.0 + ux) * dy - vx * dx) / determinant];
        (determinant > 0.0).then_some(source)
    }

    /// The column and row that no point of the rectangle from `first` to `last` (relative to the centre) comes before,
    /// and those that none comes behind.
    pub(crate) fn bounds(&self, first: [f64; 2], last: [f64; 2]) -> [[f64; 2]; 2] {
        let flat = Self { curvature: [0.0; 6], ..*self };
        let corners =
            [first, [last[0], first[1]], [first[0], last[1]], last].map(|corner| flat.apply(corner));
        let [x, y] = [0, 1].map(|axis| first[axis].abs().max(last[axis].abs()));
        let bend = |q: &[f64]| q[0].abs() * x * x + q[1].abs() * x * y + q[2].abs() * y * y;
        let bends = [bend(&self.curvature[..3]), bend(&self.curvature[3..])];
        let [mut low, mut high] = [corners[0], corners[0]];
        for corner in &corners[1..] {
            for axis in 0..2 {
                low[axis] = low[axis].min(corner[axis]);
                high[axis] = high[axis].max(corner[axis]);
            }
        }
        [[low[0] - bends[0], low[1] - bends[1]], [high[0] + bends[0], high[1] + bends[1]]]
    }

    /// This warp after the inverse of the small warp `step`, to second order in x and y: the update of the
    /// inverse-compositional method, eq. 30 of S. Baker, I. Matthews: Lucas-Kanade 20 years on, Int. J. Comput. Vis. 56
    /// (2004) 221-255; for the second order Y. Gao et al., Opt. Lasers Eng. 65 (2015) 73-80. What is left out vanishes
    /// with the step. `None` where the step folds the subset.
    pub(crate) fn compose_inverse(&self, step: &Step) -> Option<Self> {
        let [ux, uy, vx, vy] = step.gradient;
        let determinant = (1.0 + ux) * (1.0 + vy) - uy * vx;
        if determinant.is_nan() || determinant < 0.1 {
            return None;
        }
        let inverse =
            [[(1.0 + vy) / determinant, -uy / determinant], [-vx / determinant, (1.0 + ux) / determinant]];
        let [dx, dy] = step.shift_px;
        // The inverse of the step's linear part, and its products of second order.
        let back = inverse.map(|[a, b]| [-(a * dx + b * dy), a, b, 0.0, 0.0, 0.0]);
        let products =
            [product(&back[0], &back[0]), product(&back[0], &back[1]), product(&back[1], &back[1])];
        let bend = |q: &[f64]| combine(q, &products);
        let bends = [bend(&step.curvature[..3]), bend(&step.curvature[3..])];
        let inside = [0, 1].map(|axis| {
            let bent = combine(&inverse[axis], &bends);
            std::array::from_fn::<f64, 6, _>(|i| back[axis][i] - bent[i])
        });
        let [ax, ay, bx, by] = self.gradient;
        let along = |slopes: [f64; 2], q: &[f64], start: f64| {
            let (linear, bent) = (combine(&slopes, &inside), combine(q, &products));
            let mut sum: Polynomial = std::array::from_fn(|i| linear[i] + bent[i]);
            sum[0] += start;
            sum
        };
        let u = along([1.0 + ax, ay], &self.curvature[..3], self.position_px[0]);
        let v = along([bx, 1.0 + by], &self.curvature[3..], self.position_px[1]);
        Some(Self {
            position_px: [u[0], v[0]],
            gradient: [u[1] - 1.0, u[2], v[1], v[2] - 1.0],
            curvature: [u[3], u[4], u[5], v[3], v[4], v[5]],
        })
    }
}

/// The deformation of a displacement gradient.
fn linear([xx, xy, yx, yy]: &[f64; 4]) -> [f64; 4] {
    [1.0 + xx, *xy, *yx, 1.0 + yy]
}

/// The product of two matrices of two rows.
fn times(left: [f64; 4], right: [f64; 4]) -> [f64; 4] {
    let entry = |row: usize, column: usize| left[row] * right[column] + left[row + 1] * right[column + 2];
    [entry(0, 0), entry(0, 1), entry(2, 0), entry(2, 1)]
}

/// The displacement gradient of a rotation from x towards y.
fn rotation(angle_rad: f64) -> [f64; 4] {
    let (sin, cos) = angle_rad.sin_cos();
    [cos - 1.0, -sin, sin, cos - 1.0]
}

/// The product of two linear polynomials.
fn product(a: &Polynomial, b: &Polynomial) -> Polynomial {
    [
        a[0] * b[0],
        a[0] * b[1] + a[1] * b[0],
        a[0] * b[2] + a[2] * b[0],
        a[1] * b[1],
        a[1] * b[2] + a[2] * b[1],
        a[2] * b[2],
    ]
}

/// The sum of polynomials times their factors.
fn combine(factors: &[f64], polynomials: &[Polynomial]) -> Polynomial {
    std::array::from_fn(|i| factors.iter().zip(polynomials).map(|(factor, p)| factor * p[i]).sum())
}

/// A small change of a warp, in the subset's own coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Step {
    shift_px: [f64; 2],
    gradient: [f64; 4],
    /// As in [`Warp`].
    pub(crate) curvature: [f64; 6],
}

impl Step {
    /// A step from the parameters of a shape function, in the order of its terms.
    pub(crate) fn new(shape: Shape, parameters: &[f64; MAX_PARAMETERS]) -> Self {
        let p = parameters;
        let none = [0.0; 6];
        match shape {
            Shape::Translation => Self { shift_px: [p[0], p[1]], gradient: [0.0; 4], curvature: none },
            Shape::Rigid => Self { shift_px: [p[0], p[3]], gradient: rotation(p[4]), curvature: none },
            Shape::Affine => {
                Self { shift_px: [p[0], p[3]], gradient: [p[1], p[2], p[4], p[5]], curvature: none }
            }
            Shape::Quadratic => Self {
                shift_px: [p[0], p[6]],
                gradient: [p[1], p[2], p[7], p[8]],
                curvature: [p[3], p[4], p[5], p[9], p[10], p[11]],
            },
        }
    }

    /// The step times a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self {
            shift_px: self.shift_px.map(|u| u * factor),
            gradient: self.gradient.map(|g| g * factor),
            curvature: self.curvature.map(|q| q * factor),
        }
    }

    /// The largest distance that the step can move a point of a subset of this half width and height, in pixels.
    pub(crate) fn at_edge_px(&self, [x, y]: [f64; 2]) -> f64 {
        let [ux, uy, vx, vy] = self.gradient.map(f64::abs);
        let [uxx, uxy, uyy, vxx, vxy, vyy] = self.curvature.map(f64::abs);
        let dx = self.shift_px[0].abs() + ux * x + uy * y + uxx * x * x + uxy * x * y + uyy * y * y;
        let dy = self.shift_px[1].abs() + vx * x + vy * y + vxx * x * x + vxy * x * y + vyy * y * y;
        (dx * dx + dy * dy).sqrt()
    }
}

/// How far apart two warps have the centre, in pixels.
pub(crate) fn distance_px(one: &Warp, other: &Warp) -> f64 {
    let [dx, dy] = [0, 1].map(|axis| one.position_px[axis] - other.position_px[axis]);
    (dx * dx + dy * dy).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn composing_with_the_inverse_undoes_a_step() {
        let step = Step { shift_px: [0.3, -0.2], gradient: [0.02, -0.01, 0.03, 0.04], curvature: [0.0; 6] };
        let there = Warp { position_px: step.shift_px, gradient: step.gradient, curvature: [0.0; 6] };
        let back = there.compose_inverse(&step).unwrap();
        for value in back.position_px.into_iter().chain(back.gradient).chain(back.curvature) {
            assert!(value.abs() < 1e-15, "rounding of one 2 x 2 product");
        }
    }

    #[test]
    fn a_curved_step_is_undone_but_for_third_order() {
        let error = |size: f64| {
            let curvature = [2e-3, -1e-3, 1e-3, 5e-4, 2e-3, -1e-3].map(|q| q * size);
            let step = Step { shift_px: [0.0; 2], gradient: [0.02 * size, 0.0, 0.01 * size, 0.0], curvature };
            let there = Warp { position_px: [0.0; 2], gradient: step.gradient, curvature };
            let back = there.compose_inverse(&step).unwrap();
            back.gradient.into_iter().chain(back.curvature).fold(0.0_f64, |most, g| most.max(g.abs()))
        };
        // second order is exact when nothing is shifted, so only rounding remains
        assert!(error(1.0) < 1e-15, "{}", error(1.0));
    }

    #[test]
    fn bounds_hold_every_point() {
        let curvature = [2e-3, -1e-3, 3e-3, 5e-4, 2e-3, -1e-3];
        let warp = Warp { position_px: [50.0, 40.0], gradient: [0.1, -0.3, 0.2, -0.1], curvature };
        let [low, high] = warp.bounds([-16.2, -10.0], [15.8, 10.0]);
        for i in 0..=32 {
            for j in 0..=20 {
                let point = warp.apply([f64::from(i) - 16.2, f64::from(j) - 10.0]);
                assert!(
                    (0..2).all(|axis| low[axis] <= point[axis] && point[axis] <= high[axis]),
                    "{point:?}"
                );
            }
        }
    }

    #[test]
    fn a_folding_step_is_refused() {
        let step = Step { shift_px: [0.0; 2], gradient: [-1.5, 0.0, 0.0, 0.0], curvature: [0.0; 6] };
        assert_eq!(Warp::at([0.0; 2]).compose_inverse(&step), None);
    }
}
