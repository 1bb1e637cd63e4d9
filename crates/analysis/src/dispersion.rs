//! The tails over wavenumber and frequency: the two-dimensional Fourier transform behind the leading pulse.

use std::f64::consts::PI;

use ndarray::Array2;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::tail::{HANN_RESOLUTION, PADDING, Tail, hann};
use crate::{LeadingPulse, Missing, StrainMap};

/// Neighbouring gaps below which wavenumbers cannot be told.
const MIN_GAPS: usize = 4;

/// Amplitude of the tails over wavenumber and frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct DispersionMap {
    /// Phase from gap to gap in radians, from -pi up to below pi: positive away from the striker, negative for what comes back.
    pub kappa_rad: Vec<f64>,
    /// Frequencies in hertz from zero to half the sampling rate.
    pub frequency_hz: Vec<f64>,
    /// Strain amplitude, shape `[kappa, frequency]`: a plane wave of amplitude A shows as a peak of height A.
    pub amplitude: Array2<f64>,
    /// First and last gap.
    pub gaps: (usize, usize),
    /// Waves closer than this in wavenumber cannot be told apart: 4 pi over the number of gaps (Hann's main lobe at half amplitude).
    pub kappa_resolution_rad: f64,
    /// The same in frequency: 2 over the median tail's length.
    pub frequency_resolution_hz: f64,
}

/// The two-dimensional Fourier transform of the strain behind the leading pulse, over the longest run of neighbouring gaps that
/// all have a tail. Hann's window lies over each gap's tail, and another one over the gaps.
///
/// # Errors
/// [`Missing::TooFewGaps`] when fewer than four neighbouring gaps have a tail.
pub fn dispersion_map(
    map: &StrainMap,
    pulses: &[Result<LeadingPulse, Missing>],
) -> Result<DispersionMap, Missing> {
    let tails = longest_run(map, pulses);
    let (Some(first), Some(last)) = (tails.first(), tails.last()) else { return Err(Missing::TooFewGaps) };
    if tails.len() < MIN_GAPS {
        return Err(Missing::TooFewGaps);
    }
    let mut lengths: Vec<usize> = tails.iter().map(|tail| tail.values.len()).collect();
    lengths.sort_unstable();
    let n_times = (PADDING * map.times_s.len()).next_power_of_two();
    let n_kappa = (PADDING * tails.len()).next_power_of_two();
    let kappa_step = 2.0 * PI / n_kappa as f64;
    Ok(DispersionMap {
        kappa_rad: (0..n_kappa).map(|row| -PI + kappa_step * row as f64).collect(),
        frequency_hz: (0..=n_times / 2).map(|bin| bin as f64 / (n_times as f64 * map.interval_s())).collect(),
        amplitude: amplitudes(&tails, n_kappa, n_times),
        gaps: (first.gap, last.gap),
        kappa_resolution_rad: HANN_RESOLUTION * 2.0 * PI / tails.len() as f64,
        frequency_resolution_hz: HANN_RESOLUTION / (lengths[lengths.len() / 2] as f64 * map.interval_s()),
    })
}

fn longest_run(map: &StrainMap, pulses: &[Result<LeadingPulse, Missing>]) -> Vec<Tail> {
    let tails: Vec<Option<Tail>> = pulses.iter().map(|pulse| Tail::of(map, &pulse.ok()?).ok()).collect();
    let runs = tails.split(Option::is_none);
    let longest = runs.max_by_key(|run| run.len()).unwrap_or_default();
    longest.iter().flatten().cloned().collect()
}

/// Transform over time, gap by gap, then over the gaps. A wave cos(kappa n - omega t) has the phase exp(-i kappa n) at +omega, so
/// the second transform turns the other way.
fn amplitudes(tails: &[Tail], n_kappa: usize, n_times: usize) -> Array2<f64> {
    let mut planner = FftPlanner::new();
    let (over_time, over_gaps) = (planner.plan_fft_forward(n_times), planner.plan_fft_inverse(n_kappa));
    let zero = Complex::new(0.0, 0.0);
    let mut weight = 0.0;
    let mut by_gap: Vec<Vec<Complex<f64>>> = Vec::with_capacity(tails.len());
    for (row, tail) in tails.iter().enumerate() {
        let mut bins = vec![zero; n_times];
        for (at, value) in tail.values.iter().enumerate() {
            let window = hann(row, tails.len()) * hann(at, tail.values.len());
            bins[tail.start + at].re = window * value;
            weight += window;
        }
        over_time.process(&mut bins);
        by_gap.push(bins);
    }
    let mut amplitude = Array2::zeros((n_kappa, n_times / 2 + 1));
    let mut column = vec![zero; n_kappa];
    for bin in 0..=n_times / 2 {
        column.fill(zero);
        column.iter_mut().zip(&by_gap).for_each(|(to, from)| *to = from[bin]);
        over_gaps.process(&mut column);
        for (row, value) in column.iter().enumerate() {
            amplitude[((row + n_kappa / 2) % n_kappa, bin)] = 2.0 * value.norm() / weight;
        }
    }
    amplitude
}
