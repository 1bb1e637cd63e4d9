//! What oscillates behind the front, with the modes of a single ring marked.

use std::path::Path;

use chainwave_figures::{FrequencyMark, GapSpectrum, TailSpectrum};

use super::study::Tail;
use crate::error::Error;
use crate::table;

/// Modes that are marked, the lowest of each boundary: of a ring alone, and of one whose poles are held.
const MARKED: [(&str, &str, usize); 2] = [("free", "ring alone", 1), ("held", "poles held", 2)];

/// The spectra that a run found in its first gaps, and where the ring's modes of symmetric shape lie.
///
/// # Errors
/// A table that is missing or holds something else.
pub(super) fn tail(tail: &Tail, from: &Path, results: &Path, last_gap: usize) -> Result<TailSpectrum, Error> {
    let table = table::read(&results.join("spectrum.parquet"))?;
    let (gaps, frequencies_hz) = (table.counts("gap")?, table.full_numbers("frequency_hz")?);
    let amplitudes = table.numbers("amplitude")?;
    let of_gap = |gap: usize| {
        let rows = gaps.iter().enumerate().filter(|(_, found)| **found == gap);
        let points = rows.filter_map(|(row, _)| Some((frequencies_hz[row], amplitudes[row]?)));
        let (frequencies_hz, amplitude) = points.unzip();
        GapSpectrum { gap, frequencies_hz, amplitude }
    };
    let last_gap = last_gap.min(gaps.iter().copied().max().unwrap_or(0));
    Ok(TailSpectrum {
        spectra: (1..=last_gap).map(of_gap).collect(),
        marks: marks(&from.join(&tail.modes))?,
        max_frequency_hz: Some(tail.max_frequency_hz.get()),
    })
}

fn marks(path: &Path) -> Result<Vec<FrequencyMark>, Error> {
    let table = table::read(path)?;
    let (boundaries, symmetries) = (table.texts("boundary")?, table.texts("symmetry")?);
    let frequencies_hz = table.full_numbers("frequency_hz")?;
    let of = |(boundary, name, n): (&str, &str, usize)| {
        let rows = (0..frequencies_hz.len())
            .filter(|row| boundaries[*row] == boundary && symmetries[*row] == "symmetric");
        let mark = |row: usize| {
            let frequency_hz = frequencies_hz[row];
            FrequencyMark { name: format!("{name}, {frequency_hz:.0} Hz"), frequency_hz }
        };
        rows.take(n).map(mark).collect::<Vec<_>>()
    };
    Ok(MARKED.into_iter().flat_map(of).collect())
}
