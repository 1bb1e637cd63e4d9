//! Velocity of the bodies as the pulse's peak passes.

use chainwave_measurement::{ChainMotion, Estimate};

use crate::columns::are_told;
use crate::local::{LocalPolynomial, MIN_HALF_WINDOW};
use crate::{LeadingPulse, Missing, StrainMap};

/// How far the polynomials that give velocities reach from a pulse's peak, in windows over which its strain may be smoothed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SlopeReach(f64);

/// Mean velocity of a gap's two bodies as the pulse's peak passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ParticleVelocity {
    pub(crate) m_per_s: f64,
    /// How much larger it is by a narrower polynomial: as much as the motion bends away from one of order six. `None` where there is none.
    pub(crate) bend_m_per_s: Option<f64>,
}

impl SlopeReach {
    /// Displacements bend less than strains.
    const WIDEST: Self = Self(2.0);
    /// What a polynomial of order six misses of a slope falls with the sixth power of its reach: with each step to an eighth.
    const STEP: f64 = 0.7;

    fn narrower(self) -> Self {
        Self(Self::STEP * self.0)
    }

    /// First and last sample about the peak of a pulse.
    fn about(self, pulse: &LeadingPulse, place: f64, n_samples: usize) -> (usize, usize) {
        let summit = place.round() as usize;
        let reach = ((self.0 * pulse.half_window as f64).round() as usize).max(MIN_HALF_WINDOW + 1);
        (summit.saturating_sub(reach), (summit + reach).min(n_samples.saturating_sub(1)))
    }

    /// The widest with which all gaps' polynomials together follow the motion, as far as its independent noise lets that be seen; the narrowest of a
    /// motion without it.
    pub(crate) fn following(
        motion: &ChainMotion,
        map: &StrainMap,
        pulses: &[Result<LeadingPulse, Missing>],
    ) -> Self {
        let gaps: Vec<Gap<'_>> =
            pulses.iter().flatten().filter_map(|pulse| Gap::of(motion, map, pulse)).collect();
        let mut reach = Self::WIDEST;
        loop {
            let bends: Vec<f64> = gaps.iter().filter_map(|gap| gap.bend_in_sigmas(reach)).collect();
            if bends.is_empty() || !are_told(&bends) {
                return reach;
            }
            reach = reach.narrower();
        }
    }
}

/// The mean motion of a gap's two bodies, and where the pulse's peak is in it.
struct Gap<'a> {
    pulse: &'a LeadingPulse,
    mean_m: Vec<Option<f64>>,
    /// Of independent noise at the peak.
    sigma_m: f64,
    /// Fractional sample index of the peak.
    place: f64,
}

impl<'a> Gap<'a> {
    fn of(motion: &ChainMotion, map: &StrainMap, pulse: &'a LeadingPulse) -> Option<Self> {
        let rows = [pulse.gap - 1, pulse.gap];
        let [near, far] = rows.map(|row| motion.displacement_m.row(row));
        let mean_m = |(near, far): (&Option<Estimate>, &Option<Estimate>)| {
            Some(0.5 * (near.as_ref()?.value + far.as_ref()?.value))
        };
        let place = (pulse.peak_time_s - map.times_s.first()?) / map.interval_s();
        let sigma_m = |row| motion.independent_sigma_m.get([row, place.round() as usize]);
        let [near_m, far_m] = rows.map(sigma_m);
        let mean_m = near.iter().zip(far).map(mean_m).collect();
        Some(Self { pulse, mean_m, sigma_m: 0.5 * near_m?.hypot(*far_m?), place })
    }

    /// Metres from sample to sample.
    fn slope(&self, reach: SlopeReach) -> Option<f64> {
        let (first, last) = reach.about(self.pulse, self.place, self.mean_m.len());
        Some(LocalPolynomial::fit(&self.mean_m, first, last)?.slope(self.place))
    }

    /// How much larger a slope is by a narrower polynomial.
    fn bend(&self, reach: SlopeReach, slope: f64) -> Option<f64> {
        let [wide, narrow] =
            [reach, reach.narrower()].map(|reach| reach.about(self.pulse, self.place, self.mean_m.len()));
        (narrow != wide).then_some(self.slope(reach.narrower())? - slope)
    }

    /// The same over what independent noise makes of it: of two least-squares estimates from samples of which the one has all that the other has, the
    /// difference varies as much as they differ in variance. Without noise any bend is beyond it.
    fn bend_in_sigmas(&self, reach: SlopeReach) -> Option<f64> {
        let variance = |reach: SlopeReach| {
            let (first, last) = reach.about(self.pulse, self.place, self.mean_m.len());
            LocalPolynomial::variance_of_slope(first, last, self.place)
        };
        let gain = variance(reach.narrower())? - variance(reach)?;
        Some(self.bend(reach, self.slope(reach)?)? / (self.sigma_m * gain.sqrt()).max(f64::MIN_POSITIVE))
    }
}

/// Mean velocity of each gap's two bodies as the peak of the leading pulse passes; row i is gap i + 1.
///
/// In a pulse of steady shape it is the group velocity times the compression there, and both are greatest together. It is the slope
/// of a local polynomial about the peak.
pub(crate) fn particle_velocities(
    motion: &ChainMotion,
    map: &StrainMap,
    pulses: &[Result<LeadingPulse, Missing>],
    reach: SlopeReach,
) -> Vec<Option<ParticleVelocity>> {
    let velocity = |pulse: &Result<LeadingPulse, Missing>| {
        let gap = Gap::of(motion, map, pulse.as_ref().ok()?)?;
        let slope = gap.slope(reach)?;
        Some(ParticleVelocity {
            m_per_s: slope / map.interval_s(),
            bend_m_per_s: gap.bend(reach, slope).map(|bend| bend / map.interval_s()),
        })
    };
    pulses.iter().map(velocity).collect()
}
