use crate::Shape;

/// Where a subset lies in an image: the point at `(x, y)` from its centre is found at
/// `position_px + (1 + gradient) (x, y)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Warp {
    /// The centre in the image, x and y.
    pub(crate) position_px: [f64; 2],
    /// Displacement gradient: du/dx, du/dy, dv/dx, dv/dy.
    pub(crate) gradient: [f64; 4],
}

/// Parameters of the largest shape function: u, du/dx, du/dy, v, dv/dx, dv/dy.
pub(crate) const MAX_PARAMETERS: usize = 6;

impl Warp {
    /// An undeformed subset whose centre lies at `position_px`.
    pub(crate) fn at(position_px: [f64; 2]) -> Self {
        Self { position_px, gradient: [0.0; 4] }
    }

    /// Whether the subset is moved and not deformed.
    pub(crate) fn is_translation(&self) -> bool {
        self.gradient.iter().all(|&slope| slope == 0.0)
    }

    /// Where the point at `(x, y)` from the centre lies.
    #[inline(always)]
    pub(crate) fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [ux, uy, vx, vy] = self.gradient;
        let [cx, cy] = self.position_px;
        [cx + (1.0 + ux) * x + uy * y, cy + vx * x + (1.0 + vy) * y]
    }

    /// This warp after the inverse of the small warp `step`: the update of the inverse-compositional method, eq. 30 of
    /// S. Baker, I. Matthews: Lucas-Kanade 20 years on, Int. J. Comput. Vis. 56 (2004) 221-255. `None` where the step
    /// folds the subset.
    pub(crate) fn compose_inverse(&self, step: &Step) -> Option<Self> {
        let [ux, uy, vx, vy] = step.gradient;
        let determinant = (1.0 + ux) * (1.0 + vy) - uy * vx;
        if determinant.is_nan() || determinant < 0.1 {
            return None;
        }
        let inverse =
            [(1.0 + vy) / determinant, -uy / determinant, -vx / determinant, (1.0 + ux) / determinant];
        let [dx, dy] = step.shift_px;
        let back = [-(inverse[0] * dx + inverse[1] * dy), -(inverse[2] * dx + inverse[3] * dy)];
        let [ax, ay, bx, by] = self.gradient;
        let gradient = [
            (1.0 + ax) * inverse[0] + ay * inverse[2] - 1.0,
            (1.0 + ax) * inverse[1] + ay * inverse[3],
            bx * inverse[0] + (1.0 + by) * inverse[2],
            bx * inverse[1] + (1.0 + by) * inverse[3] - 1.0,
        ];
        Some(Self { position_px: self.apply(back), gradient })
    }
}

/// A small change of a warp, in the subset's own coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Step {
    shift_px: [f64; 2],
    gradient: [f64; 4],
}

impl Step {
    /// A step from the parameters of a shape function.
    pub(crate) fn new(shape: Shape, parameters: &[f64; MAX_PARAMETERS]) -> Self {
        match (shape, *parameters) {
            (Shape::Translation, [u, v, ..]) => Self { shift_px: [u, v], gradient: [0.0; 4] },
            (Shape::Affine, [u, ux, uy, v, vx, vy]) => Self { shift_px: [u, v], gradient: [ux, uy, vx, vy] },
        }
    }

    /// The step times a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self { shift_px: self.shift_px.map(|u| u * factor), gradient: self.gradient.map(|g| g * factor) }
    }

    /// The largest distance that the step moves a corner of a subset of this half width and height, in pixels.
    pub(crate) fn at_edge_px(&self, half: [f64; 2]) -> f64 {
        let [ux, uy, vx, vy] = self.gradient;
        let dx = self.shift_px[0].abs() + ux.abs() * half[0] + uy.abs() * half[1];
        let dy = self.shift_px[1].abs() + vx.abs() * half[0] + vy.abs() * half[1];
        dx.hypot(dy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn composing_with_the_inverse_undoes_a_step() {
        let step = Step { shift_px: [0.3, -0.2], gradient: [0.02, -0.01, 0.03, 0.04] };
        let there = Warp { position_px: step.shift_px, gradient: step.gradient };
        let back = there.compose_inverse(&step).unwrap();
        for value in back.position_px.into_iter().chain(back.gradient) {
            assert!(value.abs() < 1e-15, "rounding of one 2 x 2 product");
        }
    }

    #[test]
    fn a_folding_step_is_refused() {
        let step = Step { shift_px: [0.0; 2], gradient: [-1.5, 0.0, 0.0, 0.0] };
        assert_eq!(Warp::at([0.0; 2]).compose_inverse(&step), None);
    }
}
