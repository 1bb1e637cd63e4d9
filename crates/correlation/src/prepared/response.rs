//! What a subset's match makes of a displacement that its shape function cannot follow.
//!
//! To first order the match of a subset of the plane that is displaced by u gives its centre the displacement
//!
//! `sum over pixels of K(x) u(x)`, with `K_ab = (M^-1 Z')_a J_b`
//!
//! ([`crate::PreparedSubset`] has the symbols): a weighted mean of u, as of a Savitzky-Golay filter (F. Sur, B. Blaysat, M.
//! Grediac, Exp. Mech. 58 (2018) 1029-1043), whose weights are here those of this very texture. K has the sum 1, and of all
//! polynomials that the shape function follows it gives the value at the centre. So its moments say what the match makes
//! of any polynomial: what it should, and the systematic error of a shape function of too low an order (H. W. Schreier, M.
//! A. Sutton, Exp. Mech. 42 (2002) 303-310).

use crate::PreparedSubset;
use crate::prepared::linearised::{Linearised, second_order};
use crate::prepared::moments::{MAX_MONOMIALS, Places, moments};
use crate::prepared::steps::Steps;
use crate::simd::padded;
use crate::warp::Warp;

/// Moments up to the fourth order of the weights by which a displacement of the subset displaces its centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Response {
    /// Of the centre's displacement along x or y (outer) by one along x or y, per pixel to the order of the monomial
    /// ([`crate::prepared::moments::monomial`]).
    pub(crate) moments: [[[f64; MAX_MONOMIALS]; 2]; 2],
}

impl PreparedSubset {
    /// How the centre answers to displacements in the target of a subset that is found under a warp.
    pub(crate) fn response(&self, warp: &Warp) -> Response {
        let Linearised { width, height, .. } = self.linearised;
        let places = Places { width, height, columns: &self.columns, rows: &self.rows };
        let noise = self.noise.variance * self.noise.overlap;
        let steps = Steps::of(self).by_pixel();
        let own: [[[f64; MAX_MONOMIALS]; 2]; 2] = [0, 1].map(|component| {
            let polynomials = self.step_polynomials(component);
            [0, 1].map(|axis| {
                let gradient = steps[component].iter().zip(&self.plain[axis]);
                let at = self.columns.iter().zip(self.rows.iter());
                // The product of two gradients has a share of noise, as the Hessian's, which is taken off there too.
                let weight = |((step, slope), (x, y)): ((&f32, &f32), (&f32, &f32))| {
                    step * slope - noise as f32 * second_order(&polynomials[axis], *x, *y)
                };
                let weights = padded(gradient.zip(at).map(weight));
                let [moments] = moments(places, &weights, [&self.weights], 4);
                moments
            })
        });
        Response { moments: in_target(&own, warp) }
    }
}

/// Moments in the coordinates of the target: `(1 + A) m (1 + A)^-1`.
fn in_target(own: &[[[f64; MAX_MONOMIALS]; 2]; 2], warp: &Warp) -> [[[f64; MAX_MONOMIALS]; 2]; 2] {
    let [ux, uy, vx, vy] = warp.gradient;
    let forth = [[1.0 + ux, uy], [vx, 1.0 + vy]];
    let determinant = forth[0][0] * forth[1][1] - uy * vx;
    let back =
        [[forth[1][1] / determinant, -uy / determinant], [-vx / determinant, forth[0][0] / determinant]];
    let term = |component: usize, axis: usize, monomial: usize| -> f64 {
        let of = |a: usize, b: usize| forth[component][a] * own[a][b][monomial] * back[b][axis];
        of(0, 0) + of(0, 1) + of(1, 0) + of(1, 1)
    };
    [0, 1].map(|component| [0, 1].map(|axis| std::array::from_fn(|monomial| term(component, axis, monomial))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interpolation_error::alias::tests::waves;
    use crate::prepared::moments::monomial;
    use crate::{Reference, Settings, Shape};
    use chainwave_measurement::{Region, Subset};

    #[test]
    fn what_the_shape_function_follows_gives_its_value_at_the_centre() {
        let subset = Subset::new("a", 45.0, 44.0, 16, 14);
        // A checkerboard of one count is noise: what it adds to products of gradients is taken off.
        let noisy =
            waves([0.0; 2]).iter().enumerate().map(|(i, g)| g + ((i * 7919) % 13) as f32 - 6.0).collect();
        for image in [waves([0.0; 2]), noisy] {
            let reference = Reference::new(Region::whole(90, 90), image, 1).unwrap();
            for (shape, order) in [(Shape::Translation, 0), (Shape::Affine, 1), (Shape::Quadratic, 2)] {
                let settings = Settings { shape, ..Settings::default() };
                let subset = PreparedSubset::new(&reference, &subset, &settings).unwrap();
                let response = subset.response(&Warp::at([45.3, 44.2]));
                for component in 0..2 {
                    for axis in 0..2 {
                        for (i, j) in (0..=order).flat_map(|n| (0..=n).map(move |j| (n - j, j))) {
                            let expected = if i + j == 0 && component == axis { 1.0 } else { 0.0 };
                            let found = response.moments[component][axis][monomial(i, j)];
                            let of_edge = 16.0_f64.powi((i + j) as i32);
                            // sums of f32 over a thousand pixels
                            assert!(
                                (found - expected).abs() < 1e-4 * of_edge,
                                "{shape} {component} {axis} {i} {j}: {found}"
                            );
                        }
                    }
                }
            }
        }
    }
}
