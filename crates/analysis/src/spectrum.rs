use chainwave_measurement::Estimate;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::line_test::LineTest;
use crate::tail::{Tail, hann};
use crate::{LeadingPulse, Missing, StrainMap};

/// Zero padding of the record, so that the frequency grid is finer than the resolution and a peak is not lost between bins.
const PADDING: usize = 4;
/// Width of a Hann window's main lobe at half amplitude, in units of 1/duration.
const HANN_RESOLUTION: f64 = 2.0;

/// Tails coarser than this times the finest resolution stay out of the average.
const MAX_RESOLUTION_RATIO: f64 = 2.0;
/// Half width of the lobe around zero frequency that a decaying tail leaves, in units of the resolution.
const DECAY_LOBE: f64 = 1.5;

/// Amplitude spectrum of each gap's strain behind the leading pulse.
#[derive(Debug, Clone, PartialEq)]
pub struct TailSpectrum {
    /// Frequencies in hertz from zero to half the sampling rate, common to all gaps.
    pub frequency_hz: Vec<f64>,
    /// The gaps with a tail.
    pub gaps: Vec<GapSpectrum>,
    /// Gaps without a tail, and why.
    pub missing: Vec<(usize, Missing)>,
}

/// Amplitude spectrum of one gap's tail.
#[derive(Debug, Clone, PartialEq)]
pub struct GapSpectrum {
    /// Number of the gap, from 1.
    pub gap: usize,
    /// First time of the tail in seconds.
    pub start_s: f64,
    /// Length of the tail in seconds.
    pub duration_s: f64,
    /// Frequencies closer than this cannot be told apart, in hertz: full width of the Hann window's main lobe at half
    /// amplitude, 2/duration. Leakage from farther than two of these lies below 1 % of a line's amplitude.
    pub resolution_hz: f64,
    /// Strain amplitude at each frequency: a sine of amplitude A far from zero frequency shows as a peak of height A.
    pub amplitude: Vec<f64>,
}

/// Where the spectrum of the tails is greatest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalResonance {
    /// Frequency in hertz; its uncertainty is that of the noise.
    pub frequency_hz: Estimate,
    /// Resolution of the longest tail in hertz: how far the frequency of a line may be shifted by another line or by the
    /// decay of the tail, which no replica of the same record shows.
    pub resolution_hz: f64,
    /// Whether it is a line at all.
    pub line: LineTest,
}

/// Spectra of all tails. The tail of a gap begins when the leading pulse has had as long to fall as its front took to rise
/// from the edge; it is the longest run of samples without a hole from there on. Its straight line is taken off, and a Hann
/// window keeps the leakage low: a single taper, because tails are so short that several would smear the band.
pub fn tail_spectrum(map: &StrainMap, pulses: &[Result<LeadingPulse, Missing>]) -> TailSpectrum {
    let n_padded = (PADDING * map.times_s.len()).next_power_of_two();
    let transform = FftPlanner::new().plan_fft_forward(n_padded);
    let mut spectrum = TailSpectrum {
        frequency_hz: (0..=n_padded / 2)
            .map(|bin| bin as f64 / (n_padded as f64 * map.interval_s()))
            .collect(),
        gaps: Vec::new(),
        missing: Vec::new(),
    };
    for (index, pulse) in pulses.iter().enumerate() {
        match pulse.and_then(|pulse| Tail::of(map, &pulse)) {
            Ok(tail) => {
                let amplitude = hann_amplitudes(&tail.values, n_padded, transform.as_ref());
                spectrum.gaps.push(gap_spectrum(map, &tail, amplitude));
            }
            Err(reason) => spectrum.missing.push((index + 1, reason)),
        }
    }
    spectrum
}

fn gap_spectrum(map: &StrainMap, tail: &Tail, amplitude: Vec<f64>) -> GapSpectrum {
    let duration_s = tail.duration_s(map);
    GapSpectrum {
        gap: tail.gap,
        start_s: map.times_s[tail.start],
        duration_s,
        resolution_hz: HANN_RESOLUTION / duration_s,
        amplitude,
    }
}

fn hann_amplitudes(values: &[f64], n_padded: usize, transform: &dyn rustfft::Fft<f64>) -> Vec<f64> {
    let n = values.len();
    let mut bins: Vec<Complex<f64>> =
        values.iter().enumerate().map(|(at, value)| Complex::new(hann(at, n) * value, 0.0)).collect();
    bins.resize(n_padded, Complex::new(0.0, 0.0));
    transform.process(&mut bins);
    let window_sum: f64 = (0..n).map(|at| hann(at, n)).sum();
    bins[..=n_padded / 2].iter().map(|bin| 2.0 * bin.norm() / window_sum).collect()
}

/// Frequency in hertz of the greatest maximum of the gaps' averaged power, and the resolution there.
///
/// Only gaps whose tail is at least half as long as the longest take part (the others would blur it), and only frequencies
/// above the main lobe that the tail's slow decay leaves around zero. The parabola through the logarithms of the three
/// highest bins gives the place between the bins.
///
/// # Errors
/// [`Missing::NoTail`] when no gap has a tail, [`Missing::NoMaximum`] when the power has no maximum in that band.
pub fn dominant_frequency(spectrum: &TailSpectrum) -> Result<(f64, f64), Missing> {
    let finest_hz =
        spectrum.gaps.iter().map(|gap| gap.resolution_hz).reduce(f64::min).ok_or(Missing::NoTail)?;
    let fine: Vec<&GapSpectrum> =
        spectrum.gaps.iter().filter(|gap| gap.resolution_hz <= MAX_RESOLUTION_RATIO * finest_hz).collect();
    let coarsest_hz = fine.iter().map(|gap| gap.resolution_hz).fold(finest_hz, f64::max);
    let power: Vec<f64> = (0..spectrum.frequency_hz.len())
        .map(|bin| fine.iter().map(|gap| gap.amplitude[bin].powi(2)).sum::<f64>() / fine.len() as f64)
        .collect();
    let first = spectrum.frequency_hz.partition_point(|f| *f < DECAY_LOBE * coarsest_hz).max(1);
    let is_maximum = |bin: &usize| power[*bin] > power[*bin - 1] && power[*bin] >= power[*bin + 1];
    let bins = (first..power.len().saturating_sub(1)).filter(is_maximum);
    let top = bins.max_by(|a, b| power[*a].total_cmp(&power[*b])).ok_or(Missing::NoMaximum)?;
    let [before, here, after] = [power[top - 1], power[top], power[top + 1]].map(f64::ln);
    let offset = 0.5 * (before - after) / (before - 2.0 * here + after);
    let bin_hz = spectrum.frequency_hz[1];
    Ok((spectrum.frequency_hz[top] + bin_hz * if offset.is_finite() { offset } else { 0.0 }, coarsest_hz))
}
