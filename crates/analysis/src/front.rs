//! The leading pulse in each gap: peak time, peak strain and leading edge.

use chainwave_measurement::{Estimate, median};

use crate::check::{check_fraction, check_positive};
use crate::holes::{is_behind_a_hidden_one, is_beside_a_hole};
use crate::local::{MIN_HALF_WINDOW, interpolate, interpolate_by_six, level, smooth};
use crate::top::{MIN_FALL, refine_peak};
use crate::{AnalysisError, Missing, StrainMap};

/// Share of the record's greatest compression that a leading pulse reaches at least, and of the pulse in the gap before if it comes earlier.
const MIN_SHARE_OF_MAXIMUM: f64 = 0.2;
/// Which of several humps leads must not hang on that share: half of it and twice it have to end at the same one.
const OTHER_FALLS: [f64; 2] = [0.5 * MIN_FALL, 2.0 * MIN_FALL];
/// Smoothing window on each side, as a share of the rise from 25 to 75 % of the peak: its bias at the peak of a Gaussian
/// pulse is below 1e-5 of the peak.
const SMOOTHING_OF_RISE: f64 = 0.5;

/// Share of the peak above which its polynomial is fitted at most: what lies there of any smooth top is a parabola, but for noise.
pub(crate) const NARROWEST: f64 = 0.95;

/// Noise level, as a share of the maximum, below which the search for the peak needs no averaging.
const CALM_NOISE: f64 = 0.05;

/// Something of each gap, or why a gap has none; row i is gap i + 1.
pub type OfGaps<T> = Vec<Result<T, Missing>>;

/// How the leading pulse is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontSettings {
    /// The leading edge is where the compression reaches this share of the gap's peak.
    pub edge_fraction: f64,
    /// The polynomial (order six) that gives the peak is fitted where the compression exceeds this share of the peak; [`measure`](crate::measure)
    /// takes a larger one where tops ask for it, and the largest of a motion without error.
    pub peak_fraction: f64,
    /// A pulse counts when it exceeds this many standard uncertainties of a sample.
    pub significance: f64,
}

impl Default for FrontSettings {
    fn default() -> Self {
        Self { edge_fraction: 0.1, peak_fraction: 0.8, significance: 6.0 }
    }
}

impl FrontSettings {
    /// With polynomials over half as far down from the peaks.
    pub(crate) fn narrower(&self) -> Self {
        Self { peak_fraction: 0.5 * (1.0 + self.peak_fraction), ..*self }
    }

    pub(crate) fn check(&self) -> Result<(), AnalysisError> {
        check_fraction("edge_fraction", self.edge_fraction)?;
        check_fraction("peak_fraction", self.peak_fraction)?;
        check_positive("significance", self.significance)
    }
}

/// The leading pulse as it passes one gap, with uncertainties.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GapFront {
    /// Number of the gap, from 1.
    pub gap: usize,
    /// Time of the peak in seconds.
    pub peak_time_s: Estimate,
    /// Strain at the peak, compression negative.
    pub peak_strain: Estimate,
    /// Time at which the compression reaches [`FrontSettings::edge_fraction`] of the peak, in seconds; absent when it
    /// lies before the record or among missing samples.
    pub edge_time_s: Option<Estimate>,
    /// Mean velocity of the gap's two bodies at the peak, in metres per second.
    pub particle_velocity_m_per_s: Option<Estimate>,
}

/// The leading pulse as it passes one gap: point values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeadingPulse {
    /// Number of the gap, from 1.
    pub gap: usize,
    /// Time of the peak in seconds.
    pub peak_time_s: f64,
    /// Strain at the peak, compression negative.
    pub peak_strain: f64,
    /// What the peak's polynomial leaves; absent where too few samples tell it.
    pub bends: Option<Bend>,
    /// Time of the leading edge in seconds.
    pub edge_time_s: Option<f64>,
    /// By how much it is later by six samples about it than by four: what samples are too few to tell of the onset's course between them.
    pub edge_bends_s: Option<f64>,
    /// Time of the pulse's foot in seconds: the passage of 10 % of the peak, carried back by the time from 10 to 50 %. On the
    /// chain's pulses the strain there is 1 to 2 % of the peak.
    pub foot_time_s: Option<f64>,
    /// Samples on each side over which the gap's strain may be smoothed without visible bias.
    pub half_window: usize,
    /// The sample at which the strain so smoothed peaks.
    pub summit: usize,
}

/// How a peak changes with a polynomial over half as far down from it: as much as a top that is no polynomial of order six bends away from one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    /// By how much the peak is later.
    pub later_s: f64,
    /// By how much its strain is larger.
    pub strain: f64,
}

/// The leading pulse of every gap; row i is gap i + 1.
///
/// It is the *first* compressive peak that stands out, so a reflection that is larger does not replace it. A running
/// maximum finds it: significant, and followed by a fall that is neither noise nor ripple. The peak's time and strain are
/// those of a least-squares polynomial of order six over the samples above `peak_fraction` of it; the edge is looked for backwards from
/// the peak in the smoothed strain, so that noise before the arrival does not count, and interpolated linearly.
///
/// A gap that the pulse has not reached within the record may still show what runs ahead of it: that is no pulse.
pub fn leading_pulses(map: &StrainMap, settings: &FrontSettings) -> OfGaps<LeadingPulse> {
    pulses_and_approaches(map, settings).0
}

/// The same, and what each gap was seen to do on the way to it.
pub(crate) fn pulses_and_approaches(
    map: &StrainMap,
    settings: &FrontSettings,
) -> (OfGaps<LeadingPulse>, OfGaps<Approach>) {
    let approach =
        |gap| Approach::of(&compression(map, gap), settings.significance * typical_sigma(map, gap));
    let approaches: OfGaps<Approach> = (1..=map.n_gaps()).map(approach).collect();
    let pulse = |(gap, approach): (usize, &Result<Approach, Missing>)| {
        leading_pulse(map, gap, approach.as_ref().map_err(|reason| *reason)?, settings)
    };
    let mut pulses: Vec<_> = (1..).zip(&approaches).map(pulse).collect();
    drop_forerunners(&mut pulses);
    (pulses, approaches)
}

/// Takes out peaks that come before the pulse has peaked in the gap before, and are small beside that one.
fn drop_forerunners(pulses: &mut [Result<LeadingPulse, Missing>]) {
    let mut last: Option<LeadingPulse> = None;
    for pulse in pulses {
        let Ok(found) = *pulse else { continue };
        let runs_ahead = |last: &LeadingPulse| {
            let is_small = found.peak_strain.abs() < MIN_SHARE_OF_MAXIMUM * last.peak_strain.abs();
            is_small && found.peak_time_s < last.peak_time_s
        };
        match last.as_ref().is_some_and(runs_ahead) {
            true => *pulse = Err(Missing::NoPulse),
            false => last = Some(found),
        }
    }
}

/// About where the leading pulse peaks in a gap, and the gap's compression smoothed as that allows.
#[derive(Debug)]
pub(crate) struct Approach {
    /// Index of the sample.
    coarse: usize,
    /// Samples that the rise takes.
    rise: usize,
    /// Fall before a hole on either side that tells that the peak is passed: the least of those by which humps are told apart.
    fall: f64,
    /// Samples on each side over which the compression is smoothed.
    pub(crate) half_window: usize,
    pub(crate) smoothed: Vec<Option<f64>>,
}

impl Approach {
    /// In a series of compressions that stand out where they exceed `noise`.
    fn of(series: &[Option<f64>], noise: f64) -> Result<Self, Missing> {
        let (calmed, noise) = calm(series, noise);
        let coarse = first_peak(&calmed, noise)?;
        let rise = rise_samples(&calmed, coarse);
        let is_it =
            |fall: &f64| summit(&calmed, noise, *fall).is_ok_and(|other| other.at.abs_diff(coarse) <= rise);
        if !OTHER_FALLS.iter().all(is_it) {
            return Err(Missing::SeveralHumps);
        }
        let half_window = half_window_of(rise);
        let fall = noise.max(OTHER_FALLS[0] * level(&calmed, coarse));
        Ok(Self { coarse, rise, fall, half_window, smoothed: smooth(series, half_window) })
    }
}

fn leading_pulse(
    map: &StrainMap,
    gap: usize,
    Approach { coarse, rise, fall, half_window, smoothed }: &Approach,
    settings: &FrontSettings,
) -> Result<LeadingPulse, Missing> {
    let series = compression(map, gap);
    let near = coarse.saturating_sub(*rise)..=(coarse + rise).min(series.len() - 1);
    let summit = near.max_by(|a, b| level(smoothed, *a).total_cmp(&level(smoothed, *b)));
    let summit = summit.filter(|at| smoothed[*at].is_some()).ok_or(Missing::TooFewSamples)?;
    if is_beside_a_hole(smoothed, summit, *fall) || is_behind_a_hidden_one(smoothed, summit, *fall) {
        return Err(Missing::PeakOutsideRecord);
    }
    let peak = refine_peak(&series, smoothed, summit, settings.peak_fraction)?;
    let narrower = refine_peak(&series, smoothed, summit, settings.narrower().peak_fraction);
    let threshold_of_edge = settings.edge_fraction * peak.value;
    let edge = crossing_before(smoothed, summit, threshold_of_edge);
    let tenth = crossing_before(smoothed, summit, 0.1 * peak.value);
    let half = crossing_before(smoothed, summit, 0.5 * peak.value);
    Ok(LeadingPulse {
        gap,
        peak_time_s: time_at(map, peak.place),
        peak_strain: -peak.value,
        bends: narrower.ok().map(|other| Bend {
            later_s: map.interval_s() * (other.place - peak.place),
            strain: peak.value - other.value,
        }),
        edge_time_s: edge.map(|place| time_at(map, place)),
        edge_bends_s: edge.and_then(|place| {
            let by_six = crossing_between(smoothed, place, threshold_of_edge, interpolate_by_six)?;
            Some(map.interval_s() * (by_six - place))
        }),
        foot_time_s: tenth.zip(half).map(|(tenth, half)| time_at(map, 2.0 * tenth - half)),
        half_window: *half_window,
        summit,
    })
}

/// Compressive strain of a gap, -u_n(t); empty for a gap that the map does not have.
pub(crate) fn compression(map: &StrainMap, gap: usize) -> Vec<Option<f64>> {
    let row = gap.checked_sub(1).and_then(|row| map.strain.outer_iter().nth(row));
    row.map_or_else(Vec::new, |row| row.iter().map(|sample| sample.map(|strain| -strain.value)).collect())
}

/// Time in seconds of a place given as a fractional sample index.
pub(crate) fn time_at(map: &StrainMap, place: f64) -> f64 {
    map.times_s.first().copied().unwrap_or_default() + map.interval_s() * place
}

/// Median standard uncertainty of a gap's samples.
pub(crate) fn typical_sigma(map: &StrainMap, gap: usize) -> f64 {
    let sigmas = map.strain.row(gap - 1).iter().flatten().map(|strain| strain.sigma).collect();
    median(sigmas).unwrap_or(0.0)
}

/// The series averaged over as many samples as bring the noise level down to [`CALM_NOISE`] of its maximum, but no more than
/// an eighth of the time that it spends above half of it; with the noise level that is left.
fn calm(series: &[Option<f64>], noise: f64) -> (Vec<Option<f64>>, f64) {
    let greatest = series.iter().flatten().copied().fold(0.0, f64::max);
    let n_above_half = series.iter().flatten().filter(|value| **value > 0.5 * greatest).count();
    let wanted = (noise / (CALM_NOISE * greatest)).powi(2);
    let half = if wanted > 1.0 { (0.5 * wanted.min(n_above_half as f64 / 8.0)) as usize } else { 0 };
    let averaged = |at: usize| {
        let window = &series[at.saturating_sub(half)..=(at + half).min(series.len() - 1)];
        let sum: f64 = window.iter().flatten().sum();
        let n = window.iter().flatten().count();
        (series[at].is_some()).then(|| sum / n as f64)
    };
    ((0..series.len()).map(averaged).collect(), noise / ((2 * half + 1) as f64).sqrt())
}

/// Index of the first sample that exceeds all before it, stands out of the noise and of the record, and is followed by a
/// clear fall.
fn first_peak(series: &[Option<f64>], noise: f64) -> Result<usize, Missing> {
    let found = summit(series, noise, MIN_FALL)?;
    if found.is_passed { Ok(found.at) } else { Err(Missing::PeakOutsideRecord) }
}

/// A sample that exceeds all before it.
struct Summit {
    at: usize,
    /// Whether a clear fall follows within the record.
    is_passed: bool,
}

/// The first summit that stands out of the noise and of the record and is followed by a fall of more than noise and than a share of it; the
/// highest sample where no such fall follows.
fn summit(series: &[Option<f64>], noise: f64, min_fall: f64) -> Result<Summit, Missing> {
    let greatest = series.iter().flatten().copied().reduce(f64::max).ok_or(Missing::TooFewSamples)?;
    let threshold = noise.max(MIN_SHARE_OF_MAXIMUM * greatest);
    if greatest <= threshold {
        return Err(Missing::NoPulse);
    }
    let mut highest: Option<(usize, f64)> = None;
    for (at, value) in series.iter().enumerate().filter_map(|(at, value)| Some((at, (*value)?))) {
        match highest {
            Some((at, peak)) if peak - value > noise.max(min_fall * peak) => {
                return Ok(Summit { at, is_passed: true });
            }
            Some((_, peak)) if value <= peak => {}
            _ if value > threshold => highest = Some((at, value)),
            _ => {}
        }
    }
    highest.map(|(at, _)| Summit { at, is_passed: false }).ok_or(Missing::PeakOutsideRecord)
}

/// Samples between the last passages of 25 and 75 % of the peak before it.
fn rise_samples(series: &[Option<f64>], peak_at: usize) -> usize {
    let peak = level(series, peak_at);
    let is_below = |at: usize, share: f64| series[at].is_some_and(|value| value < share * peak);
    let last_below = |share: f64| (0..peak_at).rev().find(|at| is_below(*at, share)).unwrap_or(0);
    last_below(0.75).saturating_sub(last_below(0.25)).max(1)
}

fn half_window_of(rise: usize) -> usize {
    ((rise as f64 * SMOOTHING_OF_RISE).round() as usize).max(MIN_HALF_WINDOW)
}

/// Fractional index at which the series last rises through `threshold` before sample `from`.
fn crossing_before(series: &[Option<f64>], from: usize, threshold: f64) -> Option<f64> {
    let below = (0..from).rev().find(|at| series[*at].is_none_or(|value| value < threshold))?;
    series[below]?;
    crossing_between(series, below as f64, threshold, interpolate)
}

/// Fractional index between a sample and the next at which a way to read the series between them rises through `threshold`.
fn crossing_between(
    series: &[Option<f64>],
    place: f64,
    threshold: f64,
    read: impl Fn(&[Option<f64>], f64) -> Option<f64>,
) -> Option<f64> {
    let (mut low, mut high) = (place.floor(), place.floor() + 1.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if read(series, middle)? < threshold {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pulse(gap: usize, peak_time_s: f64, peak_strain: f64) -> Result<LeadingPulse, Missing> {
        let (edge_time_s, foot_time_s) = (None, None);
        Ok(LeadingPulse {
            gap,
            peak_time_s,
            peak_strain,
            bends: None,
            edge_time_s,
            edge_bends_s: None,
            foot_time_s,
            half_window: 3,
            summit: 0,
        })
    }

    #[test]
    fn a_flat_top_of_several_humps_has_no_peak() {
        // A rise to 1, a dip, and a second hump that is a tenth higher, before a fall to nothing.
        let series = |dip: f64| -> Vec<Option<f64>> {
            let corners = [(0.0, 0.0), (20.0, 1.0), (30.0, 1.0 - dip), (50.0, 1.1), (80.0, 0.0)];
            let value = |t: f64| {
                let after = corners.iter().position(|corner| corner.0 >= t).unwrap().max(1);
                let ((t0, v0), (t1, v1)) = (corners[after - 1], corners[after]);
                v0 + (v1 - v0) * (t - t0) / (t1 - t0)
            };
            (0..=80).map(|t| Some(value(f64::from(t)))).collect()
        };
        let summits = |dip: f64| {
            let found = |fall: f64| summit(&series(dip), 0.0, fall).unwrap().at;
            [found(MIN_FALL), found(OTHER_FALLS[0]), found(OTHER_FALLS[1])]
        };
        // A dip of a fifth parts two pulses and one of a hundredth is a ripple, by any of the falls; by dips in between they differ.
        assert_eq!(summits(0.2), [20, 20, 20]);
        assert_eq!(summits(0.01), [50, 50, 50]);
        assert_eq!(summits(0.04), [50, 20, 50]);
        assert_eq!(summits(0.07), [20, 20, 50]);
    }

    /// A pulse and its reflection, half as large again, which come so near each other that no sample between them falls to the share of
    /// the peak where its polynomial ends.
    #[test]
    fn the_peak_of_a_pulse_is_not_that_of_the_reflection_behind_it() {
        let value =
            |t: f64| (-((t - 40.0) / 20.0).powi(2)).exp() + 1.5 * (-((t - 86.0) / 25.0).powi(2)).exp();
        let series: Vec<Option<f64>> = (0..160).map(|t| Some(value(f64::from(t)))).collect();
        let peak_fraction = FrontSettings::default().peak_fraction;
        let between = (42..86).map(|at| level(&series, at)).fold(1.0, f64::min);
        assert!(between > peak_fraction * level(&series, 42), "{between}");
        let found = summit(&series, 0.0, MIN_FALL).unwrap().at;
        let peak = refine_peak(&series, &series, found, peak_fraction).unwrap();
        // The reflection's rise moves the peak of the sum to 41.9. A tenth of a sample is a two-hundredth of the pulse's width.
        let truth = (0..4000)
            .map(|k| 38.0 + 1e-3 * f64::from(k))
            .max_by(|a, b| value(*a).total_cmp(&value(*b)))
            .unwrap();
        assert!((peak.place - truth).abs() < 0.1, "{} of {truth}", peak.place);
        assert!((peak.value / value(truth) - 1.0).abs() < 1e-3, "{}", peak.value);
    }

    /// A steep rise and a slow fall, as of a strongly damped chain: a difference of exponentials, whose peak is known in closed form.
    #[test]
    fn a_slow_fall_does_not_draw_the_peak_aside() {
        let (rise, fall) = (8.0_f64, 400.0_f64);
        let value = |t: f64| if t > 0.0 { (-t / fall).exp() - (-t / rise).exp() } else { 0.0 };
        let peak_t = (fall / rise).ln() / (1.0 / rise - 1.0 / fall);
        let series: Vec<Option<f64>> = (0..300).map(|at| Some(value(f64::from(at) - 20.3))).collect();
        let summit = (0..300).max_by(|a, b| level(&series, *a).total_cmp(&level(&series, *b))).unwrap();
        let peak = refine_peak(&series, &series, summit, FrontSettings::default().peak_fraction).unwrap();
        // Half a sample and a thousandth of the peak, less than what noise of 1 % leaves of so few samples; over all samples above 80 % of the peak,
        // 20 before it and 97 behind, the polynomial is 0.0027 too high.
        assert!((peak.place - 20.3 - peak_t).abs() < 0.5, "{} of {peak_t}", peak.place - 20.3);
        assert!((peak.value / value(peak_t) - 1.0).abs() < 1e-3, "{}", peak.value / value(peak_t));
    }

    #[test]
    fn what_runs_ahead_of_the_pulse_is_none() {
        // The pulse passes gaps 1 to 3 and has not left gap 4; gaps 5 and 6 saw ripples. A pulse from the far end, in gap 7, is one.
        let mut pulses = vec![
            pulse(1, 1.0, -0.05),
            pulse(2, 2.0, -0.048),
            pulse(3, 3.0, -0.046),
            Err(Missing::PeakOutsideRecord),
            pulse(5, 1.2, -0.001),
            pulse(6, 1.1, -0.001),
            pulse(7, 1.0, -0.03),
        ];
        drop_forerunners(&mut pulses);
        let kept: Vec<usize> = pulses.iter().flatten().map(|pulse| pulse.gap).collect();
        assert_eq!(kept, [1, 2, 3, 7]);
        assert_eq!(pulses[4], Err(Missing::NoPulse));
        // A free end hardly strains, but the pulse does get there.
        let mut pulses = vec![pulse(1, 1.0, -0.05), pulse(2, 2.0, -0.004)];
        drop_forerunners(&mut pulses);
        assert!(pulses[1].is_ok());
    }
}
