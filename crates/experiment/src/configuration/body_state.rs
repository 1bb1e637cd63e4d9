//! Displacements and velocities of all bodies, as a table states them.

use crate::error::Error;
use crate::input::table::Table;

/// Displacements and velocities of all bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyState {
    /// Displacements, in metres.
    pub displacement_m: Vec<f64>,
    /// Velocities, in metres per second.
    pub velocity_m_per_s: Vec<f64>,
}

impl BodyState {
    /// Bodies that rest.
    pub(crate) fn at_rest(n_bodies: usize) -> Self {
        Self { displacement_m: vec![0.0; n_bodies], velocity_m_per_s: vec![0.0; n_bodies] }
    }

    /// A state by the rows' body numbers, from 1; bodies without a row are at rest.
    ///
    /// # Errors
    /// A missing column, a body that is none, or one twice.
    pub fn of_table(table: &Table, n_bodies: usize) -> Result<Self, Error> {
        let bodies = table.counts("body")?;
        let (x_m, v_m_per_s) = (table.full_numbers("x_m")?, table.full_numbers("v_m_per_s")?);
        let mut state = Self { displacement_m: vec![0.0; n_bodies], velocity_m_per_s: vec![0.0; n_bodies] };
        let mut seen = vec![false; n_bodies];
        for (row, body) in bodies.into_iter().enumerate() {
            let index = body.wrapping_sub(1);
            if index >= n_bodies || std::mem::replace(&mut seen[index], true) {
                let expected = format!("each body once, from 1 to {n_bodies}");
                return Err(table.cell(row, "body", &expected, &body.to_string()));
            }
            state.displacement_m[index] = x_m[row];
            state.velocity_m_per_s[index] = v_m_per_s[row];
        }
        Ok(state)
    }
}
