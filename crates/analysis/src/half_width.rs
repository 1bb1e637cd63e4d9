//! Half width at half maximum of the front, in a frame that moves with the pulse.

use chainwave_measurement::Estimate;

use crate::front::compression;
use crate::local::{cubic_weights, interpolate, smooth};
use crate::spacing::Spacing;
use crate::summit::summit;
use crate::velocity::Reflection;
use crate::{LeadingPulse, Missing, StrainMap};

/// Gaps searched on each side of the place that the peak trace gives.
const SEARCH_GAPS: f64 = 1.0;
/// Step of that search, in gaps, and how near to the highest place one behind it comes.
const SEARCH_STEP: f64 = 0.25;
const PEAK_TOLERANCE: f64 = 2e-6;
/// Steps of the search for the half height, at most, and the change in gaps at which it ends.
const N_ROOT_STEPS: usize = 40;
const ROOT_TOLERANCE: f64 = 1e-7;

/// Half width at half maximum of the leading pulse's front at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfWidth {
    /// Time in seconds.
    pub t_s: f64,
    /// Distance from the pulse's peak to half its height on the side away from the striker, in metres of the chain at rest.
    pub hwhm_m: Estimate,
}

/// Standard uncertainties that a change of the half width is allowed beyond what the pulse can do.
const ALLOWED_SIGMAS: f64 = 4.0;

/// Half widths without those of other crests. Where a width changes, from one sample to the next, by more than the pulse moves in between,
/// no front has widened: the crest has passed to another of the ripples that the far end sends back. Of the stretches between such jumps
/// the longest stays, and those on both sides of it that last for a gap at least and go on where the ones before ended, but for half a
/// gap, as no strain is known between gaps.
pub(crate) fn without_jumps(
    widths: &[HalfWidth],
    velocity_m_per_s: f64,
    mean_pitch_m: f64,
) -> Vec<HalfWidth> {
    let goes_on = |one: &HalfWidth, next: &HalfWidth, slack_m: f64| {
        let sigma_m = one.hwhm_m.sigma.hypot(next.hwhm_m.sigma);
        let most_m = velocity_m_per_s * (next.t_s - one.t_s) + ALLOWED_SIGMAS * sigma_m + slack_m;
        (next.hwhm_m.value - one.hwhm_m.value).abs() <= most_m
    };
    let stretches: Vec<&[HalfWidth]> = widths.chunk_by(|one, next| goes_on(one, next, 0.0)).collect();
    // Of two that are as long the earlier one.
    let longest = (0..stretches.len()).rev().max_by_key(|at| stretches[*at].len());
    let Some(longest) = longest else { return Vec::new() };
    let lasts = |stretch: &[HalfWidth]| {
        let (first, last) = (&stretch[0], &stretch[stretch.len() - 1]);
        velocity_m_per_s * (last.t_s - first.t_s) >= mean_pitch_m
    };
    let follows = |one: &[HalfWidth], next: &[HalfWidth]| {
        lasts(one) && lasts(next) && goes_on(&one[one.len() - 1], &next[0], 0.5 * mean_pitch_m)
    };
    let mut kept = vec![longest];
    for at in longest + 1..stretches.len() {
        if follows(stretches[kept[kept.len() - 1]], stretches[at]) {
            kept.push(at);
        }
    }
    for at in (0..longest).rev() {
        if follows(stretches[at], stretches[kept[0]]) {
            kept.insert(0, at);
        }
    }
    kept.into_iter().flat_map(|at| stretches[at].iter().copied()).collect()
}

/// Shares of the pulse's run at which profiles along the chain are shown: behind the striker, in the middle, before the far end.
const PROFILE_SHARES: [f64; 3] = [0.2, 0.5, 0.8];

/// Times in seconds at which profiles along the chain show the pulse on its way: a fifth, a half and four fifths of the time from its
/// peak in the first gap that saw it to that in the last. None where fewer than two gaps saw it pass.
pub fn profile_times(pulses: &[Result<LeadingPulse, Missing>]) -> Vec<f64> {
    let peaks_s = || pulses.iter().flatten().map(|pulse| pulse.peak_time_s);
    let first_s = peaks_s().fold(f64::INFINITY, f64::min);
    let last_s = peaks_s().fold(f64::NEG_INFINITY, f64::max);
    match last_s > first_s {
        true => PROFILE_SHARES.map(|share| first_s + share * (last_s - first_s)).to_vec(),
        false => Vec::new(),
    }
}

/// The strain profile between the gaps, in a frame that moves with the pulse.
///
/// A pulse is only a few gaps wide, and its rear has structure two gaps long, so a curve through the strains at one instant
/// depends on the curve. In the moving frame the strain hardly changes from gap to gap. The strain at place z (a
/// fractional gap number) and time t is therefore interpolated between gaps k at equal phase, u_k(t + (k - z) s), with the
/// slowness s of the pulse: a cubic over the two gaps on each side, and in time the smoothed series. For a pulse of steady
/// shape that moves at 1/s this is exact whatever the pitch.
#[derive(Debug, Clone)]
pub(crate) struct MovingProfile {
    first_time_s: f64,
    interval_s: f64,
    slowness_s: f64,
    smoothed: Vec<Vec<Option<f64>>>,
    /// Peak times with their gaps, both increasing.
    trace: Vec<(f64, f64)>,
}

/// The highest point of the leading pulse at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ProfilePeak {
    /// Its place, a fractional gap number.
    pub(crate) place: f64,
    /// Its compressive strain.
    pub(crate) strain: f64,
}

impl MovingProfile {
    /// The profile of a strain map whose pulse moves at `velocity_m_per_s`.
    pub(crate) fn new(
        map: &StrainMap,
        pulses: &[Result<LeadingPulse, Missing>],
        velocity_m_per_s: f64,
    ) -> Self {
        let windows = half_windows(pulses);
        let smooth_gap = |(gap, half): (usize, Result<usize, Missing>)| {
            half.map_or_else(|_| Vec::new(), |half| smooth(&compression(map, gap), half))
        };
        Self {
            first_time_s: map.times_s.first().copied().unwrap_or_default(),
            interval_s: map.interval_s(),
            slowness_s: map.spacing.mean_m() / velocity_m_per_s,
            smoothed: (1..=map.n_gaps()).zip(windows).map(smooth_gap).collect(),
            trace: rising_trace(pulses),
        }
    }

    /// Compressive strain at a time and a place, given as a fractional gap number; `None` outside the chain or the record
    /// and where a gap beside the place was not measured.
    pub(crate) fn compression(&self, t_s: f64, place: f64) -> Option<f64> {
        let last_gap = self.smoothed.len();
        if !(1.0..=last_gap as f64).contains(&place) {
            return None;
        }
        let gap = (place as usize).min(last_gap - 1).max(1);
        let z = place - gap as f64;
        let near = self.at_phase(t_s, place, gap)?;
        if z <= 0.0 {
            return Some(near);
        }
        let far = self.at_phase(t_s, place, gap + 1)?;
        let outer = (self.at_phase(t_s, place, gap - 1), self.at_phase(t_s, place, gap + 2));
        let (Some(before), Some(after)) = outer else {
            return Some(near + z * (far - near));
        };
        let [w0, w1, w2, w3] = cubic_weights(z);
        Some(w0 * before + w1 * near + w2 * far + w3 * after)
    }

    fn at_phase(&self, t_s: f64, place: f64, gap: usize) -> Option<f64> {
        let t_s = t_s + (gap as f64 - place) * self.slowness_s;
        interpolate(self.smoothed.get(gap.checked_sub(1)?)?, (t_s - self.first_time_s) / self.interval_s)
    }

    /// The leading pulse's peak at a time; `None` where the profile is not known about it, or has none near the peak trace: in a chain that damps
    /// strongly, strains at one time fall from the striker on, though each gap's has a peak in time.
    pub(crate) fn peak(&self, t_s: f64) -> Option<ProfilePeak> {
        let expected = self.expected_place(t_s)?;
        let last_gap = self.smoothed.len() as f64;
        let n_steps = (2.0 * SEARCH_GAPS / SEARCH_STEP) as usize;
        let places = (0..=n_steps).map(|step| expected - SEARCH_GAPS + SEARCH_STEP * step as f64);
        let inside = places.filter(|place| (1.0..=last_gap).contains(place));
        let (best, _) = inside
            .filter_map(|place| Some((place, self.compression(t_s, place)?)))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        let about = [best - SEARCH_STEP, best + SEARCH_STEP];
        let place = summit(|place| self.compression(t_s, place), about, best, PEAK_TOLERANCE)?;
        // A summit comes no nearer to where it may not go than that.
        let is_inside = (place - best).abs() < SEARCH_STEP - 4.0 * PEAK_TOLERANCE;
        is_inside.then_some(())?;
        Some(ProfilePeak { place, strain: self.compression(t_s, place)? })
    }

    fn expected_place(&self, t_s: f64) -> Option<f64> {
        let after = self.trace.partition_point(|(peak_time, _)| *peak_time <= t_s);
        let &(t0, gap0) = self.trace.get(after.checked_sub(1)?)?;
        let &(t1, gap1) = self.trace.get(after)?;
        Some(gap0 + (gap1 - gap0) * (t_s - t0) / (t1 - t0))
    }

    /// Place (fractional gap number) ahead of the peak where the compression first falls to half of the peak's.
    fn half_height_place(&self, t_s: f64, peak: ProfilePeak) -> Option<f64> {
        let excess = |place: f64| Some(self.compression(t_s, place)? - 0.5 * peak.strain);
        let mut low = (peak.place, excess(peak.place)?);
        loop {
            let next = low.0 + SEARCH_STEP;
            let high = (next, excess(next)?);
            if high.1 <= 0.0 {
                return root_between(excess, low, high);
            }
            low = high;
        }
    }

    /// Places of the peak and of half its height ahead of it.
    pub(crate) fn peak_and_half(&self, t_s: f64) -> Option<(f64, f64)> {
        let peak = self.peak(t_s)?;
        Some((peak.place, self.half_height_place(t_s, peak)?))
    }
}

/// The root of a function between two places with its values there, positive at `low` and not at `high` (regula falsi with
/// Illinois' halving).
fn root_between(
    function: impl Fn(f64) -> Option<f64>,
    mut low: (f64, f64),
    mut high: (f64, f64),
) -> Option<f64> {
    let mut place = high.0;
    for _ in 0..N_ROOT_STEPS {
        let next = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
        let settled = (next - place).abs() < ROOT_TOLERANCE;
        place = next;
        let value = function(place)?;
        if settled {
            break;
        }
        if value > 0.0 {
            (low, high.1) = ((place, value), 0.5 * high.1);
        } else {
            (high, low.1) = ((place, value), 0.5 * low.1);
        }
    }
    Some(place)
}

/// Smoothing windows of all gaps: a gap without a pulse takes its neighbour's; no gap has one when there is no pulse at all.
pub(crate) fn half_windows(pulses: &[Result<LeadingPulse, Missing>]) -> Vec<Result<usize, Missing>> {
    let first = pulses.iter().flatten().next().map(|pulse| pulse.half_window).ok_or(Missing::NoPulse);
    let carry = |last: &mut Result<usize, Missing>, pulse: &Result<LeadingPulse, Missing>| {
        *last = pulse.as_ref().map_or(*last, |pulse| Ok(pulse.half_window));
        Some(*last)
    };
    pulses.iter().scan(first, carry).collect()
}

fn rising_trace(pulses: &[Result<LeadingPulse, Missing>]) -> Vec<(f64, f64)> {
    let mut trace: Vec<(f64, f64)> = Vec::new();
    for pulse in pulses.iter().flatten() {
        if trace.last().is_none_or(|(before, _)| pulse.peak_time_s > *before) {
            trace.push((pulse.peak_time_s, pulse.gap as f64));
        }
    }
    trace
}

/// Half widths of the front at the given times, in metres; `None` where the profile is not known.
pub(crate) fn half_widths(profile: &MovingProfile, spacing: &Spacing, times_s: &[f64]) -> Vec<Option<f64>> {
    let width = |t_s: &f64| profile.peak_and_half(*t_s).map(|(peak, half)| spacing.between_m(peak, half));
    times_s.iter().map(width).collect()
}

/// The sample times at which the half width is well defined: the peak has passed `first_gap`, and the place of half height
/// lies within the chain and is not yet reached by the reflection of the pulse's foot.
pub(crate) fn half_width_times(
    map: &StrainMap,
    profile: &MovingProfile,
    reflection: Option<&Reflection>,
    first_gap: usize,
) -> Vec<f64> {
    let is_defined = |t_s: &f64| {
        profile.peak_and_half(*t_s).is_some_and(|(peak, half)| {
            peak >= first_gap as f64 && reflection.is_none_or(|reflection| *t_s < reflection.arrival_s(half))
        })
    };
    map.times_s.iter().copied().filter(is_defined).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twenty widths, 0.1 ms apart, that grow by 0.1 mm each; some of them are off by a jump.
    fn widths(jumped: std::ops::Range<u32>, jump_m: f64, sigma: f64) -> Vec<HalfWidth> {
        let width = |k: u32| {
            let jumped_m = if jumped.contains(&k) { jump_m } else { 0.0 };
            let hwhm_m = Estimate::new(0.1 + 1e-4 * f64::from(k) + jumped_m, sigma);
            HalfWidth { t_s: 1e-4 * f64::from(k), hwhm_m }
        };
        (0..20).map(width).collect()
    }

    /// Those that are kept where the pulse moves by 5 mm between two, and by a gap of 20 mm between five.
    fn n_kept(widths: &[HalfWidth]) -> usize {
        without_jumps(widths, 50.0, 0.02).len()
    }

    /// The profile of compressions of ten gaps whose peaks pass one every millisecond.
    fn peak(compression: impl Fn(f64, f64) -> f64) -> Option<ProfilePeak> {
        let pulse = |gap: usize| LeadingPulse {
            gap,
            peak_time_s: 1e-3 * gap as f64,
            peak_strain: -1.0,
            bends: None,
            edge_time_s: None,
            edge_bends_s: None,
            foot_time_s: None,
            half_window: 3,
            summit: 10 * gap,
        };
        let times_s: Vec<f64> = (0..120).map(|k| 1e-4 * f64::from(k)).collect();
        let strain = ndarray::Array2::from_shape_fn((10, times_s.len()), |(row, k)| {
            Some(Estimate::new(-compression((row + 1) as f64, times_s[k]), 1e-6))
        });
        let map = StrainMap { times_s, spacing: 0.03.into(), strain };
        let pulses: Vec<_> = (1..=10).map(|gap| Ok(pulse(gap))).collect();
        MovingProfile::new(&map, &pulses, 30.0).peak(5.2e-3)
    }

    #[test]
    fn a_peak_in_time_is_none_along_the_chain_where_the_wave_dies_down_faster_than_it_bends() {
        let pulse = |gap: f64, t_s: f64| (0.5 * (gap - 1e3 * t_s)).cosh().powi(-2);
        let steady = peak(pulse).unwrap();
        // A cubic in a sech^2 four gaps wide.
        assert!((steady.place - 5.2).abs() < 0.02, "{}", steady.place);
        // Of e^-gap the logarithm falls by one a gap, which that of the pulse rises by behind its peak at most.
        assert!(peak(|gap, t_s| (-gap).exp() * pulse(gap, t_s)).is_none());
    }

    #[test]
    fn half_widths_end_where_the_crest_passes_to_another_ripple() {
        assert_eq!(n_kept(&widths(14..20, -0.02, 0.0)), 14);
        assert_eq!(n_kept(&widths(0..6, -0.02, 0.0)), 14);
        assert_eq!(n_kept(&widths(14..20, -0.004, 0.0)), 20);
        assert_eq!(n_kept(&widths(14..20, -0.02, 0.003)), 20);
        assert!(without_jumps(&[], 50.0, 0.02).is_empty());
    }

    #[test]
    fn half_widths_go_on_behind_a_jump_that_is_soon_over_or_smaller_than_strains_tell() {
        assert_eq!(n_kept(&widths(12..14, 0.03, 0.0)), 18);
        assert_eq!(n_kept(&widths(14..20, -0.012, 0.0)), 20);
        assert_eq!(n_kept(&widths(17..20, -0.012, 0.0)), 17);
    }
}
