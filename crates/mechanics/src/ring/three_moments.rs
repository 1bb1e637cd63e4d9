//! Clapeyron's theorem of three moments, with shear: bending moments from turns.

use nalgebra::DMatrix;

/// The theorem of three moments: turns of a rod at its nodes from the bending moments there.
///
/// Between nodes the moment is linear, so the rod bends under neighbouring moments M by
/// h / (6 EI) (M_left + 4 M + M_right), and the shear forces (M_right - M) / h add (2 M - M_left - M_right) / (h S) with the
/// shear stiffness S. At an end, half of that remains. The matrix is tridiagonal, symmetric and positive definite; it is
/// held as its factors L D L^T, here in units of h / EI.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ThreeMoments {
    diagonal: Vec<f64>,
    off_diagonal: f64,
    /// Entry i multiplies row i before it is taken from row i + 1.
    pub(crate) lower: Vec<f64>,
    /// Inverses of the pivots.
    pub(crate) inverse_pivots: Vec<f64>,
}

impl ThreeMoments {
    /// The matrix of `n_elements` elements; `shear` is EI / (S h^2).
    pub(crate) fn new(n_elements: usize, shear: f64) -> Self {
        let (end, off_diagonal) = (1.0 / 3.0 + shear, 1.0 / 6.0 - shear);
        let mut diagonal = vec![2.0 * end; n_elements + 1];
        diagonal[0] = end;
        diagonal[n_elements] = end;
        let (mut lower, mut inverse_pivots) = (Vec::with_capacity(n_elements), vec![end.recip()]);
        for i in 0..n_elements {
            let factor = off_diagonal * inverse_pivots[i];
            lower.push(factor);
            inverse_pivots.push((diagonal[i + 1] - factor * off_diagonal).recip());
        }
        Self { diagonal, off_diagonal, lower, inverse_pivots }
    }

    /// Replaces turns by the moments that make them, in units of EI / h.
    pub(crate) fn solve(&self, turns: &mut [f64]) {
        for i in 0..self.lower.len() {
            turns[i + 1] -= self.lower[i] * turns[i];
        }
        let last = self.lower.len();
        turns[last] *= self.inverse_pivots[last];
        for i in (0..last).rev() {
            turns[i] = turns[i] * self.inverse_pivots[i] - self.lower[i] * turns[i + 1];
        }
    }

    /// Moments from turns as a dense matrix, in units of EI / h.
    pub(crate) fn inverse(&self) -> DMatrix<f64> {
        let n = self.diagonal.len();
        let mut inverse = DMatrix::identity(n, n);
        for mut column in inverse.column_iter_mut() {
            self.solve(column.as_mut_slice());
        }
        inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_give_back_their_turns() {
        for shear in [0.0, 0.02, 3.0] {
            let matrix = ThreeMoments::new(6, shear);
            let moments: Vec<f64> = (0..7).map(|i| (1.3 * f64::from(i)).sin()).collect();
            let at = |i: usize| moments.get(i).copied().unwrap_or(0.0);
            let mut turns: Vec<f64> = (0..7)
                .map(|i| {
                    matrix.diagonal[i] * at(i) + matrix.off_diagonal * (at(i.wrapping_sub(1)) + at(i + 1))
                })
                .collect();
            matrix.solve(&mut turns);
            for (found, expected) in turns.iter().zip(&moments) {
                assert!((found - expected).abs() < 1e-13, "{found} {expected}");
            }
        }
    }
}
