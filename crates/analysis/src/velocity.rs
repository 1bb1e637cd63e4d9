//! Group velocity: the slope of peak position against peak time, where the far end's reflection has not yet come.

use std::ops::RangeInclusive;

use chainwave_measurement::Estimate;

#[cfg(doc)]
use crate::GapFront;
use crate::measured_rates;
use crate::probability::normal_beyond;
use crate::rule::{Rule, SIGNIFICANCE_LEVEL};
use crate::spacing::Spacing;
use crate::{LeadingPulse, Missing};

/// Gaps that a line is fitted to at least.
const MIN_GAPS: usize = 3;
/// Gaps from which the variation along the chain is measured: two in each third.
const MIN_GAPS_FOR_VARIATION: usize = 6;
/// Share of the chain whose pulses give the foot's speed; nearer to the end the peak to which the foot refers is lowered
/// by the reflection.
const FOOT_SHARE: f64 = 0.8;
/// Share of its peak that a pulse keeps from one gap to the next at least.
const LEAST_KEPT: f64 = 0.5;
/// Root mean square distance of peaks from one line, as a share of the distance that they run, from which on there is no one speed. A speed that changes
/// evenly from one end to the other leaves 0.037 times its relative change, so that even one that changes by 4/3 of itself stays; peaks of which the last
/// ones are the reflection's leave 0.06 to 0.13 in chains of 6 to 12 bodies.
const MOST_OFF_LINE: f64 = 0.05;
/// Standard uncertainties by which that share must stand above it: the peaks' noise leaves them off the line as well.
const DETECTION_SIGMAS: f64 = 3.0;
/// Factor by which its rise, from foot to peak, grows or shrinks from one gap to the next at most.
const MOST_CHANGE_OF_RISE: f64 = 2.0;

/// The group velocity of the leading pulse, with uncertainties.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroupVelocity {
    /// Slope of peak position against peak time in metres per second. The position is the gap's number times the pitch: it is
    /// counted along the chain at rest (Lagrangian), not in the moving laboratory frame.
    pub velocity_m_per_s: Estimate,
    /// The same slope over the first and the last third of the gaps.
    pub thirds_m_per_s: Option<[Estimate; 2]>,
    /// Variation along the chain: last third minus first third, divided by the velocity.
    pub relative_variation: Option<Estimate>,
    /// Mean over the gaps of the bodies' velocity as the pulse's peak passes, in metres per second ([`GapFront::particle_velocity_m_per_s`]):
    /// what the group velocity falls with.
    pub particle_velocity_m_per_s: Option<Estimate>,
    /// Root mean square distance of the peaks from the line, in metres.
    pub residual_m: f64,
    /// First and last gap of the fit, of those that have a peak.
    pub gaps: (usize, usize),
    /// Number of gaps in the fit.
    pub n_gaps: usize,
}

impl GroupVelocity {
    /// Probability of so large a variation along the chain, either way, where there is none; `None` where it was not measured.
    pub fn variation_p_value(&self) -> Option<f64> {
        self.relative_variation
            .map(|variation| 2.0 * normal_beyond((variation.value / variation.sigma).abs()))
    }
}

/// The rule by which the group velocity counts as varying along the chain.
pub fn one_speed_rule() -> Rule {
    Rule {
        question: "group velocity along the chain",
        text: format!(
            "one speed unless those of the first and the last third of the gaps differ by more than their errors let them (two-sided, \
             {} % level)",
            100.0 * SIGNIFICANCE_LEVEL
        ),
        level: Some(SIGNIFICANCE_LEVEL),
        rates: measured_rates::ONE_SPEED.to_vec(),
    }
}

/// The line through peak positions over peak times: point values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SpeedFit {
    /// Slope in metres per second.
    pub(crate) velocity_m_per_s: f64,
    /// Slope over the first and the last third of the gaps.
    pub(crate) thirds_m_per_s: Option<[f64; 2]>,
    /// Root mean square distance of the peaks from the line, in metres.
    pub(crate) residual_m: f64,
    /// Distance from the first peak's place to the last one's, in metres.
    pub(crate) run_m: f64,
    /// First and last gap in the fit, of those that have a peak.
    pub(crate) gaps: (usize, usize),
    /// Number of gaps in the fit.
    pub(crate) n_gaps: usize,
}

impl SpeedFit {
    /// Root mean square distance of the peaks from the line, as a share of the distance that they run.
    pub(crate) fn off_line(&self) -> f64 {
        self.residual_m / self.run_m
    }

    /// Variation along the chain: last third minus first third, divided by the velocity.
    pub(crate) fn relative_variation(&self) -> Option<f64> {
        self.thirds_m_per_s.map(|[first, last]| (last - first) / self.velocity_m_per_s)
    }
}

/// Fits peak position (gap times pitch, Lagrangian) against peak time by total least squares over `gaps`.
///
/// What the peaks lie off the line is the trace's own bend, which is an error of neither, and hundreds of times the error of the
/// times. So the distances are those at right angles to the line, in units in which its slope is 1: the slope is then the ratio of
/// the standard deviations of positions and times. Lines of position on time and of time on position lie below and above it by the
/// same share, 8e-5 where the trace bends by 7 %.
///
/// # Errors
/// [`Missing::TooFewGaps`] when fewer than three gaps have a peak, [`Missing::NoProgress`] when they do not peak one after the other.
pub(crate) fn fit_speed(
    pulses: &[Result<LeadingPulse, Missing>],
    spacing: &Spacing,
    gaps: &RangeInclusive<usize>,
) -> Result<SpeedFit, Missing> {
    let used: Vec<&LeadingPulse> =
        pulses.iter().flatten().filter(|pulse| gaps.contains(&pulse.gap)).collect();
    let [first, .., last] = used.as_slice() else { return Err(Missing::TooFewGaps) };
    if used.len() < MIN_GAPS {
        return Err(Missing::TooFewGaps);
    }
    let point = |pulse: &&LeadingPulse| (pulse.peak_time_s, spacing.place_m(pulse.gap as f64));
    let points: Vec<(f64, f64)> = used.iter().map(point).collect();
    let line = FittedLine::total(&points).ok_or(Missing::NoProgress)?;
    let squares: f64 = points.iter().map(|&(time, place)| (place - line.at(time)).powi(2)).sum();
    Ok(SpeedFit {
        velocity_m_per_s: line.slope,
        thirds_m_per_s: slopes_of_thirds(&points),
        residual_m: (squares / points.len() as f64).sqrt(),
        run_m: points[points.len() - 1].1 - points[0].1,
        gaps: (first.gap, last.gap),
        n_gaps: points.len(),
    })
}

/// Whether peaks lie as far off a line as those of one pulse do not, by their distance from it as a share of that which they run.
pub(crate) fn is_no_line(off_line: Estimate) -> bool {
    off_line.value - DETECTION_SIGMAS * off_line.sigma > MOST_OFF_LINE
}

fn slopes_of_thirds(points: &[(f64, f64)]) -> Option<[f64; 2]> {
    if points.len() < MIN_GAPS_FOR_VARIATION {
        return None;
    }
    let third = points.len() / 3;
    Some([
        FittedLine::total(&points[..third])?.slope,
        FittedLine::total(&points[points.len() - third..])?.slope,
    ])
}

/// When the reflection of the pulse's foot at the chain's last gap comes back to a gap.
///
/// The foot's passage is extrapolated to the last gap with the line through the foot times of the gaps before, and the
/// reflection returns at the foot's own speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflection {
    foot: FittedLine,
    last_gap: f64,
}

impl Reflection {
    /// The reflection at the end of the chain whose gaps these are, by the feet from `first_gap` on. Where these are fewer than three, as in a short chain,
    /// the gaps before it help: a foot there is less formed, but to know the reflection roughly is better than not at all.
    ///
    /// # Errors
    /// [`Missing::ReflectionUntold`] when fewer than two gaps have a foot, or when the feet do not come one after the other.
    pub fn of_feet(pulses: &[Result<LeadingPulse, Missing>], first_gap: usize) -> Result<Self, Missing> {
        let n_gaps = pulses.len();
        let last_used = (FOOT_SHARE * n_gaps as f64) as usize;
        let feet_from = |first: usize| -> Vec<(f64, f64)> {
            let used = pulses.iter().flatten().filter(|pulse| (first..=last_used).contains(&pulse.gap));
            used.filter_map(|pulse| Some((pulse.gap as f64, pulse.foot_time_s?))).collect()
        };
        let formed = feet_from(first_gap);
        let points = if formed.len() < MIN_GAPS { feet_from(1) } else { formed };
        let foot =
            FittedLine::fit(&points).filter(|line| line.slope > 0.0).ok_or(Missing::ReflectionUntold)?;
        Ok(Self { foot, last_gap: n_gaps as f64 })
    }

    /// Time in seconds at which the reflected foot reaches a place, given as a fractional gap number.
    pub fn arrival_s(&self, gap: f64) -> f64 {
        self.foot.at(self.last_gap + (self.last_gap - gap))
    }
}

/// The gaps, from `first_gap` on, whose peak passes before the reflection of the foot reaches them.
///
/// They end where the peak is less than half of that of the gap before: a pulse does not lose that much from gap to gap, and what
/// stands out in a gap that it has not reached, or at a free end, which hardly strains, is a ripple. They end as well where the rise from foot
/// to peak is twice or half that of the gap before: of a flat top that is another hump.
pub(crate) fn undisturbed_gaps(
    pulses: &[Result<LeadingPulse, Missing>],
    reflection: Option<&Reflection>,
    first_gap: usize,
) -> RangeInclusive<usize> {
    let mut last: Option<&LeadingPulse> = None;
    for pulse in pulses.iter().flatten().filter(|pulse| pulse.gap >= first_gap) {
        let arrival_s = reflection.map_or(f64::INFINITY, |reflection| reflection.arrival_s(pulse.gap as f64));
        let is_same = last.is_none_or(|last| pulse.peak_strain.abs() >= LEAST_KEPT * last.peak_strain.abs());
        if pulse.peak_time_s >= arrival_s || !is_same || last.is_some_and(|last| is_another_hump(last, pulse))
        {
            break;
        }
        last = Some(pulse);
    }
    first_gap..=last.map_or(first_gap, |last| last.gap)
}

/// Whether two neighbouring gaps' peaks are not of one hump, as far as both have a foot to tell it.
fn is_another_hump(last: &LeadingPulse, next: &LeadingPulse) -> bool {
    let rise_s = |pulse: &LeadingPulse| Some(pulse.peak_time_s - pulse.foot_time_s?);
    let changed = rise_s(last).zip(rise_s(next)).map(|(last_s, next_s)| next_s / last_s);
    changed.is_some_and(|ratio| !(MOST_CHANGE_OF_RISE.recip()..=MOST_CHANGE_OF_RISE).contains(&ratio))
}

/// A straight line through points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FittedLine {
    x_mean: f64,
    y_mean: f64,
    pub(crate) slope: f64,
}

impl FittedLine {
    /// By ordinary least squares of y; `None` when the points do not spread in x.
    pub(crate) fn fit(points: &[(f64, f64)]) -> Option<Self> {
        let n = points.len() as f64;
        let x_mean = points.iter().map(|point| point.0).sum::<f64>() / n;
        let y_mean = points.iter().map(|point| point.1).sum::<f64>() / n;
        let spread: f64 = points.iter().map(|point| (point.0 - x_mean).powi(2)).sum();
        let product: f64 = points.iter().map(|point| (point.0 - x_mean) * (point.1 - y_mean)).sum();
        (spread > 0.0).then(|| Self { x_mean, y_mean, slope: product / spread })
    }

    /// A rising line by total least squares, in units in which its slope is 1; `None` when the points do not rise.
    fn total(points: &[(f64, f64)]) -> Option<Self> {
        let line = Self::fit(points).filter(|line| line.slope > 0.0)?;
        let spread = |of: fn(&(f64, f64)) -> f64, mean: f64| {
            points.iter().map(|point| (of(point) - mean).powi(2)).sum::<f64>()
        };
        let slope = (spread(|point| point.1, line.y_mean) / spread(|point| point.0, line.x_mean)).sqrt();
        Some(Self { slope, ..line })
    }

    pub(crate) fn at(&self, x: f64) -> f64 {
        self.y_mean + self.slope * (x - self.x_mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ripple_ahead_of_the_pulse_is_no_undisturbed_pulse() {
        let pulse = |gap: usize, peak_time_s: f64, peak_strain: f64| {
            let foot_time_s = Some(gap as f64);
            Ok(LeadingPulse {
                summit: 0,
                gap,
                peak_time_s,
                peak_strain,
                bends: None,
                edge_time_s: None,
                edge_bends_s: None,
                foot_time_s,
                half_window: 3,
            })
        };
        // Foot and peak run at one gap a second, the peak six seconds behind; the foot's reflection meets it at gap 7.
        let mut pulses: Vec<_> = (1..=10).map(|gap| pulse(gap, gap as f64 + 6.0, -0.05)).collect();
        let reflection = Reflection::of_feet(&pulses, 1).unwrap();
        assert!((reflection.arrival_s(6.0) - 14.0).abs() < 1e-9);
        pulses[9] = pulse(10, 5.0, -0.001);
        assert_eq!(undisturbed_gaps(&pulses, Some(&reflection), 1), 1..=6);
        assert_eq!(undisturbed_gaps(&pulses, None, 1), 1..=9);
        // Behind a flat top that peaks at its second hump up to gap 4, gap 5 peaks at the first one.
        let mut flat = pulses.clone();
        for gap in 1..=4 {
            flat[gap - 1] = pulse(gap, gap as f64 + 14.0, -0.05);
        }
        assert_eq!(undisturbed_gaps(&flat, None, 1), 1..=4);
        // The feet of gaps 4 to 8 tell the reflection, or those of all where they are too few; those of two do, but not that of one.
        assert_eq!(Reflection::of_feet(&pulses, 7), Ok(reflection));
        assert!(Reflection::of_feet(&pulses[..3], 3).is_ok());
        assert_eq!(Reflection::of_feet(&pulses[..2], 1), Err(Missing::ReflectionUntold));
        // A pulse that grows, and a gap without any, change nothing.
        pulses[2] = pulse(3, 9.0, -0.02);
        pulses[4] = Err(Missing::NoProgress);
        assert_eq!(undisturbed_gaps(&pulses, None, 3), 3..=9);
    }
}
