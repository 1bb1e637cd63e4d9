//! Friction, that of the striker, and drag among the shared unknowns of a fit.

use chainwave_mechanics::Resistance;
use nalgebra::DVector;

use crate::quantity::Quantity;

/// What resists bodies and striker among the shared unknowns.
#[derive(Debug)]
pub(super) struct SharedResistances {
    found: Vec<Found>,
}

/// One of them.
#[derive(Debug, Clone, Copy)]
struct Found {
    quantity: Quantity,
    /// Where it stands.
    unknown: usize,
    value: f64,
    step: f64,
}

impl SharedResistances {
    /// Those among quantities, with where they stand; of all unknowns, the values and the steps.
    pub(super) fn of(
        quantities: impl Iterator<Item = (Quantity, usize)>,
        shared: &DVector<f64>,
        steps: &[f64],
    ) -> Self {
        let resists = quantities.filter(|(quantity, _)| quantity.is_resistance());
        let found =
            |(quantity, unknown)| Found { quantity, unknown, value: shared[unknown], step: steps[unknown] };
        Self { found: resists.map(found).collect() }
    }

    /// All of them together, and behind that the same with each a step above; nothing where there is none.
    pub(super) fn lanes(&self) -> Vec<Resistance> {
        let values = || self.found.iter().map(|one| (one.quantity, one.value));
        let above = self.found.iter().map(|one| resistance(values().chain([(one.quantity, one.step)])));
        let here = (!self.found.is_empty()).then(|| resistance(values()));
        here.into_iter().chain(above).collect()
    }

    /// For each the lane a step above, where it stands, and the step.
    pub(super) fn steps(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        self.found.iter().zip(1..).map(|(one, lane)| (lane, one.unknown, one.step))
    }
}

/// What resists bodies and striker, of quantities with their values.
pub(super) fn resistance(values: impl Iterator<Item = (Quantity, f64)>) -> Resistance {
    values.fold(Resistance::default(), |mut sum, (quantity, value)| {
        match quantity {
            Quantity::Friction => sum.friction_n += value,
            Quantity::Drag => sum.drag_kg_per_m += value,
            Quantity::StrikerFriction => sum.striker_friction_n += value,
            _ => {}
        }
        sum
    })
}
