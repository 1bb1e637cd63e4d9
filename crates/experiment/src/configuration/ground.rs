//! `[ground]`: what holds each body to ground besides springs, as a curve through points.

use chainwave_mechanics::TableLaw;
use serde::{Deserialize, Serialize};

use crate::error::Error;

/// Force of what holds a body to ground over the body's displacement, the same for every body: it may fall as well as rise, as that of a
/// bistable beam.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundTable {
    /// Displacements of the points in metres, rising.
    pub displacement_m: Vec<f64>,
    /// Forces against them in newtons.
    pub force_n: Vec<f64>,
}

impl GroundTable {
    /// The curve.
    ///
    /// # Errors
    /// Points that make no curve.
    pub(crate) fn law(&self) -> Result<TableLaw, Error> {
        TableLaw::of_ground(&self.displacement_m, &self.force_n)
            .map_err(|wrong| Error::Value(format!("ground: {wrong}")))
    }
}
