//! Tracker (physlets.org): exported data, `t` and a pair of columns `x, y` for each point mass.
//!
//! A line `#multi:` stands above several tracks, then a line with their names, each above its first column, then the names of
//! columns; older versions write the name of one track alone on the first line. Numbers may have decimal commas where tabs, semicolons or
//! blanks stand between them. Lengths are in the unit of the calibration, times in seconds. A track that was not marked has empty cells.

use std::path::Path;

use super::super::tracks::{Spot, Track, Tracks};
use crate::error::Error;
use chainwave_experiment::read_text;

pub(super) fn read(path: &Path) -> Result<Tracks, Error> {
    let text = read_text(path)?;
    let text = text.trim_start_matches('\u{feff}');
    let lines: Vec<(usize, &str)> = text
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'))
        .collect();
    let is_head = |line: &str| line.starts_with('t') && line.chars().nth(1).is_some_and(is_separator);
    let head = lines.iter().position(|(_, line)| is_head(line));
    let missing = || {
        Error::place(
            path,
            "its first lines",
            "a line of columns t, x, y",
            text.lines().next().unwrap_or("nothing"),
        )
    };
    let (head, separator) =
        head.and_then(|at| Some((at, lines[at].1.chars().nth(1)?))).ok_or_else(missing)?;
    let columns: Vec<&str> = lines[head].1.split(separator).map(str::trim).collect();
    let places = pairs(&columns);
    if places.is_empty() {
        return Err(missing());
    }
    let names = head.checked_sub(1).map_or("", |above| lines[above].1);
    let mut tracks: Vec<Track> = names_of(names, separator, &places)
        .into_iter()
        .map(|name| Track { name, ..Track::default() })
        .collect();
    let mut times_s = Vec::new();
    for (index, line) in &lines[head + 1..] {
        let cells: Vec<&str> = line.split(separator).map(str::trim).collect();
        let number = |column: usize| {
            number(path, *index, column, cells.get(column).copied().unwrap_or_default(), separator)
        };
        let time_s = number(0)?;
        let lost = || Error::place(path, &format!("line {}", index + 1), "a time", "nothing");
        for (track, (x, y)) in tracks.iter_mut().zip(&places) {
            if let (Some(x), Some(y)) = (number(*x)?, number(*y)?) {
                track.spots.insert(times_s.len(), Spot { x, y, sigma: None });
            }
        }
        times_s.push(time_s.ok_or_else(lost)?);
    }
    Ok(Tracks { tracks, times_s: Some(times_s), ..Tracks::default() })
}

fn is_separator(letter: char) -> bool {
    matches!(letter, '\t' | ',' | ';' | ' ')
}

/// The columns x and y of each track: an x begins one, and its y follows before the next.
fn pairs(columns: &[&str]) -> Vec<(usize, usize)> {
    let starts: Vec<usize> = (0..columns.len()).filter(|at| columns[*at] == "x").collect();
    let ends = starts.iter().skip(1).copied().chain([columns.len()]);
    let pair = |(x, end): (&usize, usize)| Some((*x, (*x..end).find(|at| columns[*at] == "y")?));
    starts.iter().zip(ends).filter_map(pair).collect()
}

/// The names above the columns: the last one that stands at or before a track's x.
fn names_of(line: &str, separator: char, places: &[(usize, usize)]) -> Vec<String> {
    let cells: Vec<&str> = line.split(separator).map(str::trim).collect();
    let of = |(index, (x, _)): (usize, &(usize, usize))| {
        let above = cells.iter().take(x + 1).rev().find(|cell| !cell.is_empty());
        above.map_or_else(|| (index + 1).to_string(), |name| (*name).to_owned())
    };
    places.iter().enumerate().map(of).collect()
}

/// A cell; none where it is empty.
fn number(
    path: &Path,
    index: usize,
    column: usize,
    cell: &str,
    separator: char,
) -> Result<Option<f64>, Error> {
    let decimal = if separator == ',' { cell.to_owned() } else { cell.replace(',', ".") };
    match decimal.parse::<f64>() {
        _ if cell.is_empty() => Ok(None),
        Ok(value) if value.is_finite() => Ok(Some(value)),
        Ok(value) if value.is_nan() => Ok(None),
        _ => {
            let place = format!("line {}, column {}", index + 1, column + 1);
            Err(Error::place(path, &place, "a number", &format!("{cell:?}")))
        }
    }
}
