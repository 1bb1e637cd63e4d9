//! The file of corrections: read, checked against the experiment, and as a text to be written.

use std::fmt::Write;
use std::path::Path;

use sha2::{Digest, Sha256};

use super::correction::{Correction, Remedy};
use crate::configuration::{Experiment, Trial};
use crate::error::Error;
use crate::input::content::hexadecimal;
use crate::input::table::Table;
use crate::input::text_file::read_text;

/// Name of the file of corrections beside an experiment that names no other.
pub const CORRECTIONS_FILE: &str = "corrections.csv";

/// Columns of the file, in the order in which it is written.
const COLUMNS: [&str; 8] =
    ["recording", "body", "first_frame", "last_frame", "action", "x_px", "y_px", "note"];

/// The corrections of an experiment; none where there is no file of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Corrections {
    /// The file that says so.
    pub source: Option<CorrectionsSource>,
    /// What it says, in its order.
    pub list: Vec<Correction>,
}

/// A file of corrections.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectionsSource {
    /// Its name, as the experiment has it; its path where it was read by itself.
    pub name: String,
    /// SHA-256 of its bytes, in hexadecimal digits.
    pub sha256: String,
}

impl Corrections {
    /// The corrections of an experiment that stands at `path`: those of the file that it names, or of `corrections.csv` beside it where that
    /// exists.
    pub(crate) fn of(experiment: &Experiment, trials: &[Trial], path: &Path) -> Result<Self, Error> {
        let name = experiment.corrections.as_deref().unwrap_or(Path::new(CORRECTIONS_FILE));
        let file = path.with_file_name(name);
        if experiment.corrections.is_none() && !file.exists() {
            return Ok(Self::default());
        }
        let (table, found) = Self::read_with_table(&file)?;
        let known = |one: &Correction| trials.iter().any(|trial| trial.recording == one.recording);
        let n_bodies = experiment.chain.n_bodies;
        for (row, one) in found.list.iter().enumerate() {
            if !known(one) {
                return Err(table.cell(row, "recording", "one of the trials table", &one.recording));
            }
            if let Some(body) = one.body.filter(|body| *body > n_bodies) {
                return Err(table.cell(row, "body", &format!("1 to {n_bodies}"), &body.to_string()));
            }
        }
        let as_named = |source| CorrectionsSource { name: name.display().to_string(), ..source };
        Ok(Self { source: found.source.map(as_named), ..found })
    }

    /// What a file of corrections says; nothing is known of the experiment here.
    ///
    /// # Errors
    /// A file that cannot be read, a missing column, and a cell that makes no sense.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::read_with_table(path).map(|(_, found)| found)
    }

    /// As [`Corrections::read`], with the table itself, which tells where a row stands.
    fn read_with_table(path: &Path) -> Result<(Table, Self), Error> {
        let text = read_text(path)?;
        let table = Table::parse_csv(path, &text)?;
        let [recordings, actions] = ["recording", "action"].map(|name| table.texts(name));
        let (recordings, actions) = (recordings?, actions?);
        let [bodies, first, last] = ["body", "first_frame", "last_frame"].map(|name| whole(&table, name));
        let (bodies, first, last) = (bodies?, first?, last?);
        let (x_px, y_px) = (table.numbers("x_px")?, table.numbers("y_px")?);
        let notes = if table.has("note") { table.texts("note")? } else { vec![String::new(); actions.len()] };
        let of_row = |(row, recording): (usize, &String)| {
            let place_px = x_px[row].zip(y_px[row]).map(Into::into);
            let remedy = remedy(&table, row, &actions[row], place_px)?;
            let one = Correction {
                recording: recording.clone(),
                body: bodies[row],
                first_frame: first[row].unwrap_or(0),
                last_frame: last[row],
                remedy,
                note: notes[row].clone(),
            };
            check(&table, row, &one)?;
            Ok(one)
        };
        let list = recordings.iter().enumerate().map(of_row).collect::<Result<_, Error>>()?;
        let sha256 = hexadecimal(&Sha256::digest(text.as_bytes()));
        let source = Some(CorrectionsSource { name: path.display().to_string(), sha256 });
        Ok((table, Self { source, list }))
    }
}

/// A column of whole numbers from 0, whose cells may be empty.
fn whole(table: &Table, name: &str) -> Result<Vec<Option<usize>>, Error> {
    let cells = table.numbers(name)?.into_iter().enumerate();
    let of_cell = |(row, cell): (usize, Option<f64>)| match cell {
        None => Ok(None),
        Some(value) if value >= 0.0 && value.fract() == 0.0 && value < 1e15 => Ok(Some(value as usize)),
        Some(value) => Err(table.cell(row, name, "a whole number from 0, or nothing", &value.to_string())),
    };
    cells.map(of_cell).collect()
}

fn remedy(table: &Table, row: usize, action: &str, place_px: Option<[f64; 2]>) -> Result<Remedy, Error> {
    let place = || place_px.ok_or_else(|| table.cell(row, "x_px", "the place of a seed", "nothing"));
    match action {
        "exclude" => Ok(Remedy::Exclude),
        "seed" => Ok(Remedy::Seed(place()?)),
        "place" => Ok(Remedy::Place(place()?)),
        other => Err(table.cell(row, "action", "exclude, seed or place", other)),
    }
}

/// Refuses what cannot be meant.
fn check(table: &Table, row: usize, one: &Correction) -> Result<(), Error> {
    if one.body == Some(0) {
        return Err(table.cell(row, "body", "the number of a body, from 1", "0"));
    }
    if one.body.is_none() && one.remedy != Remedy::Exclude {
        return Err(table.cell(row, "body", "the number of a body, which a place is about", "nothing"));
    }
    if one.last_frame.is_some_and(|last| last < one.first_frame) {
        let found = one.last_frame.unwrap_or(0).to_string();
        return Err(table.cell(row, "last_frame", &format!("{} or later", one.first_frame), &found));
    }
    if matches!(one.remedy, Remedy::Place(_)) && (one.first_frame, one.last_frame) != (0, None) {
        let expected = "no frames: a subset is placed in the frames at rest, for all";
        return Err(table.cell(row, "first_frame", expected, &one.first_frame.to_string()));
    }
    Ok(())
}

/// The text of a file of corrections.
pub fn corrections_csv(list: &[Correction]) -> String {
    let mut text = format!("{}\n", COLUMNS.join(","));
    for one in list {
        let number = |value: Option<usize>| value.map_or_else(String::new, |value| value.to_string());
        let [x, y] = match one.remedy.place_px() {
            Some(place_px) => place_px.map(|value| value.to_string()),
            None => [(); 2].map(|()| String::new()),
        };
        let is_about_all = matches!(one.remedy, Remedy::Place(_));
        let first = number((!is_about_all).then_some(one.first_frame));
        let (recording, note) = (cell(&one.recording), cell(&one.note));
        let (body, last, action) = (number(one.body), number(one.last_frame), one.remedy.as_str());
        let _infallible = writeln!(text, "{recording},{body},{first},{last},{action},{x},{y},{note}");
    }
    text
}

/// A cell of a CSV file, in quotes where it needs them.
fn cell(text: &str) -> String {
    match text.contains([',', ';', '\t', '"', '\n', '\r']) || text.trim() != text {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some() -> Vec<Correction> {
        let one = |body, first_frame, last_frame, remedy, note: &str| Correction {
            recording: "view1, trial \"1\".cine".into(),
            body,
            first_frame,
            last_frame,
            remedy,
            note: note.into(),
        };
        vec![
            one(Some(3), 120, Some(134), Remedy::Exclude, "a hand; twice"),
            one(None, 200, None, Remedy::Exclude, ""),
            one(Some(4), 88, None, Remedy::Seed([151.25, 23.0]), "jumped"),
            one(Some(1), 0, None, Remedy::Place([1.0 / 3.0, 23.5]), ""),
        ]
    }

    fn read(text: &str) -> Result<Vec<Correction>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(CORRECTIONS_FILE);
        std::fs::write(&path, text).unwrap();
        Corrections::read(&path).map(|found| found.list).map_err(|error| error.to_string())
    }

    #[test]
    fn what_is_written_is_read() {
        assert_eq!(read(&corrections_csv(&some())).unwrap(), some());
        assert_eq!(read(&corrections_csv(&[])).unwrap(), []);
    }

    #[test]
    fn what_makes_no_sense_is_named_with_its_line() {
        let header = "recording,body,first_frame,last_frame,action,x_px,y_px\n";
        for (row, said) in [
            ("a.cine,1,5,4,exclude,,", "line 2, column last_frame: expected 5 or later, found 4"),
            ("a.cine,0,5,6,exclude,,", "column body: expected the number of a body, from 1, found 0"),
            ("a.cine,1,,,seed,,3", "column x_px: expected the place of a seed, found nothing"),
            ("a.cine,,,,seed,1,3", "column body"),
            ("a.cine,1,3,,place,1,3", "column first_frame: expected no frames"),
            ("a.cine,1,1.5,,exclude,,", "column first_frame: expected a whole number from 0"),
            ("a.cine,1,1,,remove,,", "column action: expected exclude, seed or place, found remove"),
        ] {
            let message = read(&format!("{header}{row}\n")).unwrap_err();
            assert!(message.contains(said), "{row}: {message}");
        }
        assert!(read("recording,body\n").unwrap_err().contains("a column named action"));
    }
}
