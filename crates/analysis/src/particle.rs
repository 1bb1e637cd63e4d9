//! Velocity of the bodies as the pulse's peak passes.

use chainwave_measurement::{ChainMotion, Estimate};

use crate::local::LocalPolynomial;
use crate::{LeadingPulse, Missing, StrainMap};

/// Mean velocity of each gap's two bodies as the peak of the leading pulse passes, in metres per second; row i is gap i + 1.
///
/// In a pulse of steady shape it is the group velocity times the compression there, and both are greatest together. It is the slope
/// of a local polynomial over the time that the front takes to rise, on each side of the peak.
pub(crate) fn particle_velocities_m_per_s(
    motion: &ChainMotion,
    map: &StrainMap,
    pulses: &[Result<LeadingPulse, Missing>],
) -> Vec<Option<f64>> {
    pulses.iter().map(|pulse| particle_velocity_m_per_s(motion, map, pulse.as_ref().ok()?)).collect()
}

fn particle_velocity_m_per_s(motion: &ChainMotion, map: &StrainMap, pulse: &LeadingPulse) -> Option<f64> {
    let (near, far) = (motion.displacement_m.row(pulse.gap - 1), motion.displacement_m.row(pulse.gap));
    let mean_m = |(near, far): (&Option<Estimate>, &Option<Estimate>)| {
        Some(0.5 * (near.as_ref()?.value + far.as_ref()?.value))
    };
    let series: Vec<Option<f64>> = near.iter().zip(far).map(mean_m).collect();
    let place = (pulse.peak_time_s - map.times_s.first()?) / map.interval_s();
    let (summit, reach) = (place.round() as usize, 2 * pulse.half_window);
    let (first, last) = (summit.saturating_sub(reach), (summit + reach).min(series.len() - 1));
    let polynomial = LocalPolynomial::fit(&series, first, last)?;
    Some(polynomial.slope(place) / map.interval_s())
}
