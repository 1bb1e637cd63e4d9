//! What follows the leading pulse in one gap, windowed for spectra.

use crate::front::compression;
use crate::velocity::FittedLine;
use crate::{LeadingPulse, Missing, StrainMap};

/// Zero padding of a record, so that the grid of a spectrum is finer than its resolution and no peak is lost between bins.
pub(crate) const PADDING: usize = 4;
/// Width of a Hann window's main lobe at half amplitude, in units of one over the record's length.
pub(crate) const HANN_RESOLUTION: f64 = 2.0;
/// Samples that a tail needs at least.
const MIN_SAMPLES: usize = 32;

/// The compression of one gap behind the leading pulse, less its straight line.
#[derive(Debug, Clone)]
pub(crate) struct Tail {
    /// Number of the gap, from 1.
    pub(crate) gap: usize,
    /// Index of its first sample.
    pub(crate) start: usize,
    pub(crate) values: Vec<f64>,
}

impl Tail {
    /// The tail begins when the leading pulse has had as long to fall as its front took to rise from the edge; it is the longest
    /// run of samples without a hole from there on.
    pub(crate) fn of(map: &StrainMap, pulse: &LeadingPulse) -> Result<Self, Missing> {
        let edge_time_s = pulse.edge_time_s.ok_or(Missing::TooFewSamples)?;
        let start_s = 2.0 * pulse.peak_time_s - edge_time_s;
        let first = map.times_s.partition_point(|time| *time < start_s);
        let series = compression(map, pulse.gap);
        let mut offset = first;
        let mut longest = (first, &series[0..0]);
        for run in series.get(first..).unwrap_or_default().split(Option::is_none) {
            if run.len() > longest.1.len() {
                longest = (offset, run);
            }
            offset += run.len() + 1;
        }
        let (start, run) = longest;
        if run.len() < MIN_SAMPLES {
            return Err(Missing::NoTail);
        }
        let values = without_line(&run.iter().flatten().copied().collect::<Vec<_>>());
        Ok(Self { gap: pulse.gap, start, values })
    }

    /// Its length in seconds.
    pub(crate) fn duration_s(&self, map: &StrainMap) -> f64 {
        self.values.len() as f64 * map.interval_s()
    }
}

fn without_line(values: &[f64]) -> Vec<f64> {
    let points: Vec<(f64, f64)> = values.iter().enumerate().map(|(at, value)| (at as f64, *value)).collect();
    let line = FittedLine::fit(&points);
    let trend = |at: f64| line.map_or(0.0, |line| line.at(at));
    points.iter().map(|&(at, value)| value - trend(at)).collect()
}

/// Hann's window over `n` samples, at sample `at`.
pub(crate) fn hann(at: usize, n: usize) -> f64 {
    0.5 - 0.5 * (2.0 * std::f64::consts::PI * (at as f64 + 0.5) / n as f64).cos()
}
