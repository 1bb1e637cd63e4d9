//! Plane deformations in closed form: displacement, gradient and inverse.

use std::f64::consts::TAU;

/// How a surface deforms in the plane: the point X of the reference picture is found at x = X + u(X) in the deformed one.
/// Columns come first, in pixels; a gradient's rows are the components of u, its columns the directions of X.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Deformation {
    /// u = gradient (X - centre) + shift.
    Affine {
        /// Displacement gradient.
        gradient: [[f64; 2]; 2],
        /// The point that moves by the shift alone.
        centre_px: [f64; 2],
        /// Displacement of the centre.
        shift_px: [f64; 2],
    },
    /// A star pattern: u = (0, A cos(2 pi (Y - row)/p(X))), the period p growing linearly from column 0 to the last one.
    Star {
        /// A.
        amplitude_px: f64,
        /// Row along which the displacement is A.
        row_px: f64,
        /// Periods in column 0 and in column `width_px`; constant beyond.
        periods_px: [f64; 2],
        /// Where the last period is reached.
        width_px: f64,
    },
    /// A plane wave: u = A sin(2 pi (along . X)/p).
    Wave {
        /// A, along both axes.
        amplitude_px: [f64; 2],
        /// The direction in which the phase grows, a unit vector.
        along: [f64; 2],
        /// p.
        period_px: f64,
    },
    /// A band of strain: u = A tanh(along . (X - centre)/w).
    Band {
        /// A, along both axes: far from the band both sides have moved by it, against each other.
        amplitude_px: [f64; 2],
        /// The direction across the band, a unit vector.
        along: [f64; 2],
        /// A point of its middle line.
        centre_px: [f64; 2],
        /// w.
        width_px: f64,
    },
}

/// Newton steps that find a source; each doubles the digits, so more mean a fold.
const STEPS: usize = 30;

impl Deformation {
    /// Nothing moves.
    pub const NONE: Self = Self::Affine { gradient: [[0.0; 2]; 2], centre_px: [0.0; 2], shift_px: [0.0; 2] };

    /// u = `relative` (X - centre) along each axis: 0.3 makes everything 1.3 times as long.
    pub fn stretch(centre_px: [f64; 2], relative: [f64; 2]) -> Self {
        let gradient = [[relative[0], 0.0], [0.0, relative[1]]];
        Self::Affine { gradient, centre_px, shift_px: [0.0; 2] }
    }

    /// A turn about a centre, from right towards down, and a shift of it.
    pub fn rigid(centre_px: [f64; 2], turn_rad: f64, shift_px: [f64; 2]) -> Self {
        let (sine, cosine) = (libm::sin(turn_rad), libm::cos(turn_rad));
        Self::Affine { gradient: [[cosine - 1.0, -sine], [sine, cosine - 1.0]], centre_px, shift_px }
    }

    /// The truth: u at a point of the reference picture.
    pub fn displacement_px(&self, [x_px, y_px]: [f64; 2]) -> [f64; 2] {
        match *self {
            Self::Affine { gradient, centre_px, shift_px } => {
                let apart = [x_px - centre_px[0], y_px - centre_px[1]];
                [0, 1]
                    .map(|axis| gradient[axis][0] * apart[0] + gradient[axis][1] * apart[1] + shift_px[axis])
            }
            Self::Star { amplitude_px, row_px, .. } => {
                let (period_px, _) = self.star_period_px(x_px);
                [0.0, amplitude_px * libm::cos(TAU * (y_px - row_px) / period_px)]
            }
            Self::Wave { amplitude_px, along, period_px } => {
                let sine = libm::sin(TAU * (along[0] * x_px + along[1] * y_px) / period_px);
                amplitude_px.map(|amplitude_px| amplitude_px * sine)
            }
            Self::Band { amplitude_px, along, centre_px, width_px } => {
                let across = along[0] * (x_px - centre_px[0]) + along[1] * (y_px - centre_px[1]);
                amplitude_px.map(|amplitude_px| amplitude_px * libm::tanh(across / width_px))
            }
        }
    }

    /// The gradient of u at a point of the reference picture.
    pub fn gradient(&self, [x_px, y_px]: [f64; 2]) -> [[f64; 2]; 2] {
        match *self {
            Self::Affine { gradient, .. } => gradient,
            Self::Star { amplitude_px, row_px, .. } => {
                let (period_px, growth) = self.star_period_px(x_px);
                let phase = TAU * (y_px - row_px) / period_px;
                let per_phase = -amplitude_px * libm::sin(phase);
                [[0.0; 2], [-per_phase * phase / period_px * growth, per_phase * TAU / period_px]]
            }
            Self::Wave { amplitude_px, along, period_px } => {
                let wavenumber = TAU / period_px;
                let cosine = libm::cos(wavenumber * (along[0] * x_px + along[1] * y_px));
                amplitude_px.map(|amplitude_px| along.map(|along| amplitude_px * wavenumber * along * cosine))
            }
            Self::Band { amplitude_px, along, centre_px, width_px } => {
                let across = along[0] * (x_px - centre_px[0]) + along[1] * (y_px - centre_px[1]);
                let slope = libm::cosh(across / width_px).powi(-2) / width_px;
                amplitude_px.map(|amplitude_px| along.map(|along| amplitude_px * along * slope))
            }
        }
    }

    /// Where a point of the reference picture is found in the deformed one.
    pub fn displaced_px(&self, at_px: [f64; 2]) -> [f64; 2] {
        let moved_px = self.displacement_px(at_px);
        [at_px[0] + moved_px[0], at_px[1] + moved_px[1]]
    }

    /// The point of the reference picture that is found at a point of the deformed one, by Newton's method; `None` where the
    /// deformation folds the surface.
    pub fn source_px(&self, seen_px: [f64; 2]) -> Option<[f64; 2]> {
        let mut at_px = match *self {
            Self::Affine { centre_px, .. } => centre_px,
            _ => seen_px,
        };
        for _ in 0..STEPS {
            let shown_px = self.displaced_px(at_px);
            let [[a, b], [c, d]] = self.gradient(at_px);
            let determinant = (1.0 + a) * (1.0 + d) - b * c;
            if determinant.is_nan() || determinant <= 0.0 {
                return None;
            }
            let off = [seen_px[0] - shown_px[0], seen_px[1] - shown_px[1]];
            let step_px = [
                ((1.0 + d) * off[0] - b * off[1]) / determinant,
                ((1.0 + a) * off[1] - c * off[0]) / determinant,
            ];
            at_px = [at_px[0] + step_px[0], at_px[1] + step_px[1]];
            // Rounding of some thousand pixels.
            if step_px[0].abs().max(step_px[1].abs()) <= 1.0e-12 * (1.0 + at_px[0].abs().max(at_px[1].abs()))
            {
                return Some(at_px);
            }
        }
        None
    }

    /// A star's period in a column, and its growth per column.
    fn star_period_px(&self, x_px: f64) -> (f64, f64) {
        let Self::Star { periods_px, width_px, .. } = *self else { return (f64::INFINITY, 0.0) };
        let growth = (periods_px[1] - periods_px[0]) / width_px;
        let inside_px = x_px.clamp(0.0, width_px);
        let is_inside = (0.0..width_px).contains(&x_px);
        (periods_px[0] + growth * inside_px, if is_inside { growth } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> [Deformation; 5] {
        [
            Deformation::stretch([50.0, 40.0], [0.45, -0.1]),
            Deformation::rigid([50.0, 40.0], 2.9, [3.0, -7.0]),
            Deformation::Star { amplitude_px: 0.5, row_px: 60.0, periods_px: [50.0, 400.0], width_px: 300.0 },
            Deformation::Wave { amplitude_px: [1.5, -0.7], along: [0.6, 0.8], period_px: 80.0 },
            Deformation::Band {
                amplitude_px: [1.5, -0.7],
                along: [0.6, 0.8],
                centre_px: [40.0, 30.0],
                width_px: 20.0,
            },
        ]
    }

    const POINTS: [[f64; 2]; 5] = [[0.5, 0.0], [12.3, 45.6], [151.0, 63.2], [299.0, 119.0], [50.0, 40.0]];

    #[test]
    fn the_gradient_is_the_slope_of_the_displacement() {
        let step_px = 1.0e-4;
        for deformation in all() {
            for at_px in POINTS {
                for axis in [0, 1] {
                    let beside = |side: f64| {
                        let mut beside_px = at_px;
                        beside_px[axis] += side * step_px;
                        deformation.displacement_px(beside_px)
                    };
                    let (before, after) = (beside(-1.0), beside(1.0));
                    for component in [0, 1] {
                        let slope = (after[component] - before[component]) / (2.0 * step_px);
                        let found = deformation.gradient(at_px)[component][axis];
                        // 1e-8: rounding of some 100 px over 2e-4, and the central difference's step^2/6 of third derivatives.
                        assert!((found - slope).abs() < 1.0e-8, "{deformation:?} {at_px:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn every_point_is_found_where_it_was_displaced_to() {
        for deformation in all() {
            for at_px in POINTS {
                let found_px = deformation.source_px(deformation.displaced_px(at_px)).unwrap();
                assert!((found_px[0] - at_px[0]).hypot(found_px[1] - at_px[1]) < 1.0e-10); // rounding
            }
        }
    }

    #[test]
    fn known_displacements_come_out() {
        let [stretch, rigid, star, wave, band] = all();
        let near = |found: [f64; 2], expected: [f64; 2]| {
            (found[0] - expected[0]).hypot(found[1] - expected[1]) < 1.0e-12 // rounding
        };
        assert!(near(stretch.displacement_px([60.0, 50.0]), [4.5, -1.0]));
        assert!(near(rigid.displacement_px([50.0, 40.0]), [3.0, -7.0]));
        let turned = [50.0 + 3.0 + 10.0 * 2.9_f64.cos(), 40.0 - 7.0 + 10.0 * 2.9_f64.sin()];
        assert!(near(rigid.displaced_px([60.0, 40.0]), turned));
        // In the middle column the period is 225 px; half a period below the row the displacement is -A.
        assert!(near(star.displacement_px([150.0, 60.0]), [0.0, 0.5]));
        assert!(near(star.displacement_px([150.0, 172.5]), [0.0, -0.5]));
        assert!(near(wave.displacement_px([12.0, 16.0]), [1.5, -0.7]));
        // 20 px across the middle of a band of that width, and far from it.
        let far = [1.5, -0.7].map(|amplitude_px| amplitude_px * 1.0_f64.tanh());
        assert!(near(band.displacement_px([52.0, 46.0]), far));
        assert!(near(band.displacement_px([4000.0, 3000.0]), [1.5, -0.7]));
    }

    #[test]
    fn a_fold_has_no_source() {
        let folded = Deformation::Wave { amplitude_px: [30.0, 0.0], along: [1.0, 0.0], period_px: 60.0 };
        assert_eq!(folded.source_px([30.0, 0.0]), None);
        assert_eq!(Deformation::stretch([0.0; 2], [-2.0, 0.0]).source_px([1.0, 1.0]), None);
    }
}
