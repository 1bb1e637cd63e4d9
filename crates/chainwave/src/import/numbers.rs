//! The numbers of a text file, by column or by line.

use std::path::{Path, PathBuf};

use super::layout::{Direction, Layout, Separator};
use crate::error::Error;
use chainwave_experiment::read_text;

/// Column of a file whose bodies stand in columns, or line of one whose bodies stand in lines, from 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place(pub(super) usize);

/// The numbers of a text file, line by line.
pub(super) struct Numbers {
    path: PathBuf,
    head_lines: usize,
    bodies: Direction,
    lines: Vec<Vec<Option<f64>>>,
}

impl Numbers {
    /// Reads a file; an empty cell and one that says NaN are lost values, and one that is no number an error. Where commas part no cells they may
    /// part decimals.
    pub(super) fn read(path: &Path, layout: &Layout) -> Result<Self, Error> {
        let text = read_text(path)?;
        let mut lines = Vec::new();
        for (index, line) in text.lines().enumerate().skip(layout.head_lines) {
            let cells: Vec<&str> = match layout.separator {
                Separator::Comma => line.split(',').collect(),
                Separator::Semicolon => line.split(';').collect(),
                Separator::Blanks => line.split_whitespace().collect(),
            };
            let number = |(column, cell): (usize, &&str)| {
                let cell = cell.trim();
                let parsed = match layout.separator {
                    Separator::Comma => cell.parse::<f64>(),
                    _ => cell.replacen(',', ".", 1).parse(),
                };
                match parsed {
                    _ if cell.is_empty() => Ok(None),
                    Ok(value) if value.is_nan() => Ok(None),
                    Ok(value) if value.is_finite() => Ok(Some(value)),
                    parsed => {
                        let place = format!("line {}, column {}", index + 1, column + 1);
                        let expected = match parsed {
                            Ok(_infinite) => "a finite number, or none where it is lost",
                            Err(_) => "a number (hint: layout.head_lines and layout.separator)",
                        };
                        Err(Error::place(path, &place, expected, &format!("{cell:?}")))
                    }
                }
            };
            if !line.trim().is_empty() {
                lines.push(cells.iter().enumerate().map(number).collect::<Result<_, _>>()?);
            }
        }
        Ok(Self { path: path.to_owned(), head_lines: layout.head_lines, bodies: layout.bodies, lines })
    }

    /// Number of instants.
    pub(super) fn n_samples(&self) -> usize {
        match self.bodies {
            Direction::Columns => self.lines.len(),
            Direction::Lines => self.lines.iter().map(Vec::len).max().unwrap_or(0),
        }
    }

    /// The numbers at a place over time; `None` where lost.
    pub(super) fn series(&self, Place(place): Place) -> Result<Vec<Option<f64>>, Error> {
        let (kind, n) = match self.bodies {
            Direction::Columns => ("column", self.lines.iter().map(Vec::len).max().unwrap_or(0)),
            Direction::Lines => ("line of numbers", self.lines.len()),
        };
        let missing = || {
            let below = format!("below line {}", self.head_lines);
            Error::place(&self.path, &below, &format!("a {kind} {place}"), &format!("{n} of them"))
        };
        let index = place.checked_sub(1).filter(|index| *index < n).ok_or_else(missing)?;
        Ok(match self.bodies {
            Direction::Columns => self.lines.iter().map(|line| line.get(index).copied().flatten()).collect(),
            Direction::Lines => {
                let line = &self.lines[index];
                (0..self.n_samples()).map(|k| line.get(k).copied().flatten()).collect()
            }
        })
    }

    /// The numbers at a place, none of which may be lost.
    pub(super) fn full_series(&self, place: Place) -> Result<Vec<f64>, Error> {
        let series = self.series(place)?.into_iter().enumerate();
        let lost = |k: usize| Error::place(&self.path, &format!("sample {}", k + 1), "a time", "nothing");
        series.map(|(k, value)| value.ok_or_else(|| lost(k))).collect()
    }
}
