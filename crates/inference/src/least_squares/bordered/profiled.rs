//! Some unknowns with others at their best for each of their values.

use nalgebra::{DMatrix, DVector};

use super::SharedSystem;

/// The equations of some shared unknowns, with others following them to where the sum of squares is least: their Schur complement.
#[derive(Debug, Clone)]
pub(crate) struct Profiled {
    pub(crate) matrix: DMatrix<f64>,
    pub(crate) side: DVector<f64>,
    /// How far each of the others goes with each of them.
    pub(crate) followed: DMatrix<f64>,
}

impl SharedSystem {
    /// `None` where the others are open.
    pub(crate) fn profiled(&self, of: &[usize], others: &[usize]) -> Option<Profiled> {
        let block = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| self.matrix[(rows[i], columns[j])])
        };
        let scale = DVector::from_fn(others.len(), |i, _| self.matrix[(others[i], others[i])].sqrt().recip());
        let scaled = DMatrix::from_diagonal(&scale);
        let factor = (&scaled * block(others, others) * &scaled).cholesky()?;
        let followed = -(&scaled * factor.solve(&(&scaled * block(others, of))));
        let side_of = |places: &[usize]| DVector::from_fn(places.len(), |i, _| self.side[places[i]]);
        Some(Profiled {
            matrix: block(of, of) + block(of, others) * &followed,
            side: side_of(of) + followed.tr_mul(&side_of(others)),
            followed,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_the_covariance_and_the_step_of_the_whole() {
        // Diagonal entries from 1 to 1e8, as those of dampings and factors.
        let rows =
            DMatrix::from_fn(9, 5, |i, j| 100.0_f64.powi(j as i32) * (1.3 * (i * j) as f64 + i as f64).sin());
        let system = SharedSystem {
            matrix: rows.tr_mul(&rows),
            side: rows.tr_mul(&DVector::from_fn(9, |i, _| (i as f64).cos())),
        };
        let (of, others) = ([1, 4], [0, 2, 3]);
        let profiled = system.profiled(&of, &others).unwrap();
        let (whole, covariance) = (system.step().unwrap(), system.covariance().unwrap());
        let own = profiled.matrix.clone().try_inverse().unwrap();
        let step = &own * &profiled.side;
        for (i, place) in of.iter().enumerate() {
            assert!((step[i] / whole[*place] - 1.0).abs() < 1e-8, "{step} in {whole}");
            for (j, other) in of.iter().enumerate() {
                assert!(
                    (own[(i, j)] / covariance[(*place, *other)] - 1.0).abs() < 1e-8,
                    "{own} in {covariance}"
                );
            }
        }
        // With the numbers held at what the whole gives them, the others follow, but for what they would do alone.
        let still = system.profiled(&others, &[]).unwrap();
        let alone = still.matrix.try_inverse().unwrap() * still.side;
        for (i, place) in others.iter().enumerate() {
            let followed = alone[i] + (&profiled.followed * &step)[i];
            assert!((followed / whole[*place] - 1.0).abs() < 1e-8, "{followed} in {whole}");
        }
    }
}
