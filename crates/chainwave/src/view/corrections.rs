//! The review of results in the page: its queue, and the file that takes what is corrected there.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use chainwave_experiment::{
    CORRECTIONS_FILE, Correction, Corrections, CorrectionsSource, DoubtfulReading, Remedy, corrections_csv,
};
use chainwave_view::{KeepCorrections, QueuedReading, Review, ShownCorrection, ShownRemedy};

use crate::cli;
use crate::error::Error;
use crate::output::write_text;
use crate::review::{ReviewedResults, reasons};

/// Most readings that the page lists.
const MOST: usize = 500;

/// The queue of results, and corrections in their file. `places` are those of the recordings in the page's list, where they are there.
pub(super) fn review(
    arguments: &cli::View,
    folder: &Path,
    results: &ReviewedResults,
    places: &[Option<usize>],
) -> Result<Review, Error> {
    let file = arguments.corrections.clone().unwrap_or_else(|| folder.join(CORRECTIONS_FILE));
    let Corrections { list: found, source } = corrections_in(&file)?;
    // Names of the recordings in the page's list.
    let mut names = Vec::new();
    results.recordings.iter().zip(places).for_each(|(one, place)| {
        names.extend(place.map(|_| one.name.clone()));
    });
    let place = |name: &str| names.iter().position(|known| known == name);
    let shown: Vec<ShownCorrection> =
        found.iter().filter_map(|one| Some(shown(place(&one.recording)?, one))).collect();
    // Corrections of recordings that are not there stay as they are.
    let others: Vec<Correction> =
        found.iter().filter(|one| place(&one.recording).is_none()).cloned().collect();
    let queued = |one: DoubtfulReading| {
        Some(QueuedReading {
            recording: places[one.recording]?,
            name: one.body.to_string(),
            frame: one.frame,
            stretch: one.stretch,
            doubt: one.doubt,
            reason: reasons(&one),
        })
    };
    let queue = results.queue().into_iter().filter_map(queued).take(MOST).collect();
    let path = file.display().to_string();
    let keeper = Keeper { file, names, others, known: Mutex::new(source) };
    let keep = KeepCorrections::by(move |corrections| keeper.keep(corrections));
    Ok(Review { queue, corrections: shown, path, keep })
}

/// What a file of corrections says; none where it is not there.
fn corrections_in(file: &Path) -> Result<Corrections, Error> {
    Ok(if file.exists() { Corrections::read(file)? } else { Corrections::default() })
}

/// Writes the file of corrections, unless somebody else did meanwhile.
struct Keeper {
    file: PathBuf,
    /// Names of the recordings in the page's list.
    names: Vec<String>,
    /// Corrections of other recordings.
    others: Vec<Correction>,
    /// The file as it was read or written last; none where there was none.
    known: Mutex<Option<CorrectionsSource>>,
}

impl Keeper {
    fn keep(&self, corrections: &[ShownCorrection]) -> Result<(), String> {
        let mut known = self.known.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let now = || corrections_in(&self.file).map(|now| now.source).map_err(|error| error.to_string());
        if now()? != *known {
            return Err("one that somebody else changed meanwhile (start chainwave view again)".into());
        }
        let mut list = corrections.iter().map(|one| self.correction(one)).collect::<Result<Vec<_>, _>>()?;
        list.extend(self.others.iter().cloned());
        write_text(&self.file, &corrections_csv(&list)).map_err(|error| error.to_string())?;
        *known = now()?;
        Ok(())
    }

    fn correction(&self, one: &ShownCorrection) -> Result<Correction, String> {
        let recording = self.names.get(one.recording).ok_or("a recording that is not in the list")?;
        let body = match &one.name {
            Some(name) => Some(name.parse().map_err(|_| format!("{name:?} for the number of a body"))?),
            None => None,
        };
        let remedy = match (one.remedy, one.place_px) {
            (ShownRemedy::Exclude, _) => Remedy::Exclude,
            (ShownRemedy::Seed, Some(place_px)) => Remedy::Seed(place_px),
            (ShownRemedy::Place, Some(place_px)) => Remedy::Place(place_px),
            (_, None) => return Err("a seed without a place".into()),
        };
        let ShownCorrection { first_frame, last_frame, .. } = *one;
        Ok(Correction {
            recording: recording.clone(),
            body,
            first_frame,
            last_frame,
            remedy,
            note: one.note.clone(),
        })
    }
}

fn shown(recording: usize, one: &Correction) -> ShownCorrection {
    let remedy = match one.remedy {
        Remedy::Exclude => ShownRemedy::Exclude,
        Remedy::Seed(_) => ShownRemedy::Seed,
        Remedy::Place(_) => ShownRemedy::Place,
    };
    ShownCorrection {
        recording,
        name: one.body.map(|body| body.to_string()),
        first_frame: one.first_frame,
        last_frame: one.last_frame,
        remedy,
        place_px: one.remedy.place_px(),
        note: one.note.clone(),
    }
}
