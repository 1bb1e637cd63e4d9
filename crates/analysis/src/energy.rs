//! Peak potential energy of every gap, and the share of its loss that damping explains.

use std::borrow::Cow;

use chainwave_measurement::Estimate;
use ndarray::Array2;

use crate::front::{FrontSettings, OfGaps, compression, pulses_and_approaches, typical_sigma};
use crate::half_width::half_windows;
use crate::local::smooth;
use crate::top::refine_peak;
use crate::{LeadingPulse, Missing, StrainMap};

/// Potential energy of a gap (from 1) in joules as a function of its overlap in metres (compression positive), such as
/// `|_, overlap_m| law.energy_j(overlap_m)` of a contact law: zero at rest. Where it falls again with the overlap, as behind the barrier of a
/// bistable contact, gaps that passed that have no peak energy.
pub type EnergyLaw<'a> = &'a (dyn Fn(usize, f64) -> f64 + Sync);

/// Peak potential energy of every gap that has one, with the covariance that a fit to them needs.
#[derive(Debug, Clone, PartialEq)]
pub struct PeakEnergies {
    /// Numbers of the gaps, from 1, increasing.
    pub gaps: Vec<usize>,
    /// Maximum over time of the gap's potential energy, in joules; one entry for each of `gaps`.
    pub energy_j: Vec<Estimate>,
    /// The same divided by the energy of gap 1; absent when gap 1 has none.
    pub relative: Option<Vec<Estimate>>,
    /// Covariance of `energy_j` in square joules, shape `[gap, gap]` over `gaps`. Errors of neighbours correlate because they
    /// share a body, those of distant gaps through the motion's error modes.
    pub covariance_j2: Array2<f64>,
    /// Replicas behind the covariance: those in which every gap of `gaps` has its peak.
    pub n_replicas: usize,
    /// How the leading pulses were found.
    pub front: FrontSettings,
    /// Gaps without a peak energy, and why.
    pub missing: Vec<(usize, Missing)>,
}

/// The leading pulse of each gap ([`leading_pulses`](crate::leading_pulses)), and the maximum over time of its potential energy, in joules; row
/// i is gap i + 1.
///
/// The greatest of many noisy samples is biased upwards. So the strain is smoothed first over a window that the leading
/// pulse allows, the greatest energy picks the extreme (of compression or tension), a least-squares polynomial through the
/// *strains* around it gives the extreme strain, and the energy is taken of that one number. What bias remains is of second
/// order in the extreme strain's own error; [`crate::measure`] estimates it from its replicas, and takes it off.
pub fn pulses_and_energies(
    map: &StrainMap,
    settings: &FrontSettings,
    energy_of: EnergyLaw<'_>,
) -> (OfGaps<LeadingPulse>, OfGaps<f64>) {
    let (pulses, energies) = pulses_and_bent_energies(map, settings, energy_of);
    (pulses, energies.into_iter().map(|energy| Ok(energy?.energy_j)).collect())
}

/// The greatest energy of a gap, in joules.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GapEnergy {
    pub(crate) energy_j: f64,
    /// By how much it is larger with a polynomial over half as far down from the extreme ([`Bend`](crate::Bend)).
    pub(crate) bend_j: Option<f64>,
}

/// The same as [`pulses_and_energies`], and how each energy bends.
pub(crate) fn pulses_and_bent_energies(
    map: &StrainMap,
    settings: &FrontSettings,
    energy_of: EnergyLaw<'_>,
) -> (OfGaps<LeadingPulse>, OfGaps<GapEnergy>) {
    let (pulses, approaches) = pulses_and_approaches(map, settings);
    let half_windows = half_windows(&pulses).into_iter().take(map.n_gaps());
    let gaps = (1..).zip(half_windows).zip(pulses.iter().zip(&approaches));
    let energies = gaps.map(|((gap, half_window), (pulse, approach))| {
        let half_window = half_window?;
        let series = compression(map, gap);
        // A gap without a pulse of its own has its neighbour's window.
        let smoothed = match approach {
            Ok(approach) if approach.half_window == half_window => {
                Cow::Borrowed(approach.smoothed.as_slice())
            }
            _ => Cow::Owned(smooth(&series, half_window)),
        };
        let seen =
            GapCompression { series: &series, smoothed: &smoothed, half_window, pulse: pulse.as_ref().ok() };
        peak_energy(&seen, map.spacing.of_gap_m(gap), |overlap_m| energy_of(gap, overlap_m), settings)
    });
    let energies = energies.collect();
    (pulses, energies)
}

/// The compression of a gap, as it is and smoothed over so many samples on each side.
struct GapCompression<'a> {
    series: &'a [Option<f64>],
    smoothed: &'a [Option<f64>],
    half_window: usize,
    pulse: Option<&'a LeadingPulse>,
}

impl GapCompression<'_> {
    /// The strain of the extreme about a sample, with compression (1) or tension (-1) counting as positive, and the same from half as far down. That of the
    /// leading pulse is known.
    fn extreme(
        &self,
        summit: usize,
        sign: f64,
        settings: &FrontSettings,
    ) -> Result<(f64, Option<f64>), Missing> {
        if let Some(pulse) = self.pulse.filter(|pulse| sign > 0.0 && pulse.summit == summit) {
            return Ok((-pulse.peak_strain, pulse.bends.map(|bends| -(pulse.peak_strain + bends.strain))));
        }
        let turned =
            |series: &[Option<f64>]| series.iter().map(|value| value.map(|v| sign * v)).collect::<Vec<_>>();
        let (series, smoothed) = (turned(self.series), turned(self.smoothed));
        let refined = |settings: &FrontSettings| {
            Ok(refine_peak(&series, &smoothed, summit, settings.peak_fraction)?.value)
        };
        Ok((refined(settings)?, refined(&settings.narrower()).ok()))
    }
}

fn peak_energy(
    seen: &GapCompression<'_>,
    pitch_m: f64,
    energy_of: impl Fn(f64) -> f64,
    settings: &FrontSettings,
) -> Result<GapEnergy, Missing> {
    let &GapCompression { series, smoothed, half_window, pulse } = seen;
    let (summit, sign) = extreme_of_energy(smoothed, |strain| energy_of(strain * pitch_m))?;
    if summit == 0
        || summit + 1 == series.len()
        || may_lie_in_a_hole(series, summit, half_window, pulse.is_some())
    {
        return Err(Missing::PeakOutsideRecord);
    }
    let (extreme, narrower) = seen.extreme(summit, sign, settings)?;
    let others = smoothed.iter().flatten().map(|strain| -sign * strain).fold(0.0, f64::max);
    if [extreme, -others].iter().any(|most| is_passed(&energy_of, sign * most * pitch_m)) {
        return Err(Missing::BarrierPassed);
    }
    let energy_j = energy_of(sign * extreme * pitch_m);
    let bend_j = narrower.map(|narrower| energy_of(sign * narrower * pitch_m) - energy_j);
    Ok(GapEnergy { energy_j, bend_j })
}

/// Takes out the peak energies of gaps that may have held as much at rest: those that no more than equal the greatest energy within so many
/// standard uncertainties of a sample about rest, or whose smoothed strain comes to no more. There noise picks the greatest of many samples
/// that are all alike, and what it picks is no measurement of their common value. A gap that rests in the least of its energy holds none there, and
/// keeps what it has.
///
/// Of replicas nothing is taken out: a peak that is stated has the scatter of all of them.
pub(crate) fn drop_what_rest_may_hold(
    energies: &mut [Result<GapEnergy, Missing>],
    (map, pulses): (&StrainMap, &[Result<LeadingPulse, Missing>]),
    energy_of: EnergyLaw<'_>,
    significance: f64,
) {
    for ((gap, energy), half_window) in (1..).zip(energies).zip(half_windows(pulses)) {
        let (Ok(GapEnergy { energy_j: peak_j, .. }), Ok(half_window)) = (*energy, half_window) else {
            continue;
        };
        let pitch_m = map.spacing.of_gap_m(gap);
        let within_m = significance * typical_sigma(map, gap) * pitch_m;
        let at_rest_j = [-within_m, 0.0, within_m].map(|overlap_m| energy_of(gap, overlap_m));
        if !is_held(at_rest_j) {
            continue;
        }
        let most_j = at_rest_j.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let smoothed = smooth(&compression(map, gap), half_window);
        let seen_j = smoothed.iter().flatten().map(|strain| energy_of(gap, strain * pitch_m));
        if peak_j <= most_j || seen_j.fold(f64::NEG_INFINITY, f64::max) <= most_j {
            *energy = Err(Missing::NotAboveRest);
        }
    }
}

/// Whether a gap holds energy at rest, by that a little to both sides of rest and at rest itself, in the middle.
fn is_held(at_rest_j: [f64; 3]) -> bool {
    at_rest_j.iter().any(|energy_j| *energy_j < at_rest_j[1])
}

/// Whether the energy between rest and an overlap is anywhere greater than there: then it is the law's own barrier that is the greatest
/// energy, and how far the gap went tells nothing of it. What is held at rest, under a load, is no barrier.
fn is_passed(energy_of: impl Fn(f64) -> f64, most_m: f64) -> bool {
    const N_STEPS: u32 = 64;
    /// Of laws that are worked out by series and tables.
    const ROUNDING: f64 = 1e-9;
    let at_ends = energy_of(most_m).max(energy_of(0.0));
    let limit = at_ends + ROUNDING * at_ends.abs();
    (1..N_STEPS).any(|step| energy_of(f64::from(step) / f64::from(N_STEPS) * most_m) > limit)
}

/// Whether a greater energy may have passed while the gap was not seen for longer than a window: anywhere in the record where the gap has no
/// pulse, and beside the summit where it has one.
fn may_lie_in_a_hole(series: &[Option<f64>], summit: usize, half_window: usize, has_pulse: bool) -> bool {
    let mut start = 0;
    series.chunk_by(|one, next| one.is_some() == next.is_some()).any(|run| {
        let hole = start..start + run.len();
        start = hole.end;
        let is_long = run[0].is_none() && run.len() > 2 * half_window + 1;
        let is_beside = hole.start <= summit + half_window && summit <= hole.end + half_window;
        is_long && (!has_pulse || is_beside)
    })
}

/// Index of the sample of greatest energy and the sign of its strain. Where the energy rises with the strain on both sides of
/// zero, the sample is the most compressed or the most stretched one.
fn extreme_of_energy(
    strain: &[Option<f64>],
    energy_of: impl Fn(f64) -> f64,
) -> Result<(usize, f64), Missing> {
    let present = || strain.iter().enumerate().filter_map(|(at, strain)| Some((at, (*strain)?)));
    let compressed = present().max_by(|a, b| a.1.total_cmp(&b.1)).ok_or(Missing::TooFewSamples)?;
    let stretched = present().min_by(|a, b| a.1.total_cmp(&b.1)).ok_or(Missing::TooFewSamples)?;
    let is_stretched = stretched.1 < 0.0 && energy_of(stretched.1) > energy_of(compressed.1);
    Ok(if is_stretched { (stretched.0, -1.0) } else { (compressed.0, 1.0) })
}

/// What became of the peak energy on its way from gap 1 to one gap, from the same chain computed with and without damping.
///
/// All shares refer to the undamped energy of gap 1, so `spread + damped + remaining = 1`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DampingShare {
    /// Number of the gap, from 1.
    pub gap: usize,
    /// Lost to dispersion and rarefaction: 1 - Psi_undamped(n)/Psi_undamped(1).
    pub spread: f64,
    /// Lost to damping besides: (Psi_undamped(n) - Psi_damped(n))/Psi_undamped(1).
    pub damped: f64,
    /// Left: Psi_damped(n)/Psi_undamped(1).
    pub remaining: f64,
}

impl DampingShare {
    /// Damping's part of the loss, 0 to 1; `None` where nothing was lost.
    pub fn of_loss(&self) -> Option<f64> {
        let loss = self.spread + self.damped;
        (loss > 0.0).then(|| self.damped / loss)
    }
}

/// Splits the loss of peak energy at each gap into damping on one side and dispersion and rarefaction on the other, from
/// the peak energies of gaps 1, 2, ... with and without damping (paper, Fig. 4). Empty when gap 1 holds no undamped energy.
pub fn damping_share(damped_j: &[f64], undamped_j: &[f64]) -> Vec<DampingShare> {
    let Some(&input) = undamped_j.first().filter(|input| **input > 0.0) else {
        return Vec::new();
    };
    let share = |(index, (damped, undamped)): (usize, (&f64, &f64))| DampingShare {
        gap: index + 1,
        spread: 1.0 - undamped / input,
        damped: (undamped - damped) / input,
        remaining: damped / input,
    };
    damped_j.iter().zip(undamped_j).enumerate().map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shares_of_a_known_loss() {
        let shares = damping_share(&[1.8, 0.9, 0.2], &[2.0, 1.6, 0.8]);
        let last = shares[2];
        // Rounding alone.
        let close = |found: f64, expected: f64| (found - expected).abs() < 1e-15;
        assert!(close(last.spread, 0.6) && close(last.damped, 0.3) && close(last.remaining, 0.1), "{last:?}");
        assert!(close(last.of_loss().unwrap(), 1.0 / 3.0));
        assert!(close(shares[0].damped, 0.1) && shares[0].spread.abs() < 1e-15);
        assert!(shares.iter().all(|share| close(share.spread + share.damped + share.remaining, 1.0)));
    }

    #[test]
    fn what_passes_unseen_is_no_peak() {
        let seen = |hole: std::ops::Range<usize>| {
            (0..40).map(|i| (!hole.contains(&i)).then_some(0.0)).collect::<Vec<Option<f64>>>()
        };
        let half_window = 2;
        assert!(
            may_lie_in_a_hole(&seen(30..40), 5, half_window, false),
            "the gap is lost before the pulse comes"
        );
        assert!(!may_lie_in_a_hole(&seen(30..40), 5, half_window, true), "the gap is lost behind its pulse");
        assert!(may_lie_in_a_hole(&seen(30..40), 29, half_window, true), "the gap is lost on the rise");
        assert!(may_lie_in_a_hole(&seen(0..10), 11, half_window, true), "the gap is found on the fall");
        assert!(!may_lie_in_a_hole(&seen(30..33), 29, half_window, false), "a window closes a short hole");
        assert!(!may_lie_in_a_hole(&seen(40..40), 29, half_window, false));
    }

    #[test]
    fn a_barrier_that_was_passed_is_no_peak() {
        // Two wells, at 0 and at 1, with a barrier of 1/16 between.
        let double_well = |x: f64| (x * (1.0 - x)).powi(2);
        assert!(!is_passed(double_well, 0.45) && !is_passed(double_well, -0.3));
        assert!(is_passed(double_well, 0.7) && is_passed(double_well, 1.0));
        // Beyond the second well the walls are higher than the barrier from (1 + sqrt 2)/2 = 1.207 on.
        assert!(is_passed(double_well, 1.19) && !is_passed(double_well, 1.22));
        // A spring that is held by 1 and let go loses what it held.
        let let_go = |x: f64| (1.0 + x).powi(2);
        assert!(!is_passed(let_go, -0.5) && !is_passed(let_go, 0.3));
    }

    #[test]
    fn a_gap_at_rest_in_its_well_holds_nothing_and_one_under_a_load_does() {
        let beside = |energy_of: fn(f64) -> f64| [-0.1, 0.0, 0.1].map(energy_of);
        assert!(!is_held(beside(|x| x * x)) && !is_held(beside(|x| x.max(0.0).powf(2.5))));
        assert!(is_held(beside(|x| (1.0 + x).powi(2))) && is_held(beside(|x| (1.0 - x).powi(2))));
    }

    #[test]
    fn no_input_or_no_loss_gives_no_share() {
        assert!(damping_share(&[], &[]).is_empty());
        assert!(damping_share(&[0.0], &[0.0]).is_empty());
        assert_eq!(damping_share(&[2.0], &[2.0])[0].of_loss(), None);
    }

    #[test]
    fn the_extreme_is_the_greatest_energy_on_either_side() {
        let strain = [Some(0.0), None, Some(0.02), Some(-0.03), Some(0.01)];
        let (at, sign) = extreme_of_energy(&strain, |u| u * u).unwrap();
        assert!(at == 3 && sign < 0.0);
        let softer_in_tension = |u: f64| if u < 0.0 { 0.1 * u * u } else { u * u };
        let (at, sign) = extreme_of_energy(&strain, softer_in_tension).unwrap();
        assert!(at == 2 && sign > 0.0);
    }
}
