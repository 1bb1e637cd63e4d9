//! DLTdv: digitised points, a row for each frame and a column for each point, camera and axis; NaN where a point was not digitised.
//!
//! The files are those of T. L. Hedrick, Bioinspiration & Biomimetics 3 (2008) 034001: `xypts.csv` with columns `pt1_cam1_X, pt1_cam1_Y,
//! pt2_cam1_X, ..` in pixels, y upwards, `xyzpts.csv` with `pt1_X, pt1_Y, pt1_Z` in the calibration's unit, and both as sparse tables:
//! a title, rows, columns and entries, then `row column value`, rows and columns from 1. Of several cameras the first is read.

use std::path::Path;

use super::super::tracks::{Spot, Track, Tracks};
use crate::error::Error;
use chainwave_experiment::read_text;

/// Rows and columns that a sparse table may announce: more frames and points than anybody digitises.
const MOST: [f64; 2] = [4e9, 1e6];

pub(super) fn read(path: &Path) -> Result<Tracks, Error> {
    let text = read_text(path)?;
    match text.lines().next() {
        Some(title) if title.starts_with("Sparse") => sparse(path, &text, title),
        Some(head) => flat(path, &text, head),
        None => Err(Error::place(path, "line 1", "names of columns", "nothing")),
    }
}

fn flat(path: &Path, text: &str, head: &str) -> Result<Tracks, Error> {
    let names: Vec<&str> = head.split(',').map(str::trim).collect();
    let column = |wanted: [String; 2]| names.iter().position(|name| wanted.iter().any(|one| one == name));
    let place =
        |point: usize, axis: char| column([format!("pt{point}_cam1_{axis}"), format!("pt{point}_{axis}")]);
    let points: Vec<(usize, usize)> =
        (1..=names.len()).map_while(|point| Some((place(point, 'X')?, place(point, 'Y')?))).collect();
    if points.is_empty() {
        return Err(Error::place(
            path,
            "line 1",
            "columns pt1_cam1_X and pt1_cam1_Y, or pt1_X and pt1_Y",
            head,
        ));
    }
    let mut tracks = named(points.len());
    for (index, line) in text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty()) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |column: usize| number(path, index, cells.get(column).copied().unwrap_or_default());
        for (track, (x, y)) in tracks.iter_mut().zip(&points) {
            if let (Some(x), Some(y)) = (number(*x)?, number(*y)?) {
                track.spots.insert(index - 1, Spot { x, y, sigma: None });
            }
        }
    }
    Ok(Tracks { tracks, ..Tracks::default() })
}

/// What is not listed was not digitised. A file of pixels has two columns a point, which can be told of one camera only.
fn sparse(path: &Path, text: &str, title: &str) -> Result<Tracks, Error> {
    let n_axes = if title.contains("3D") { 3 } else { 2 };
    let entries = |index: usize, line: &str| -> Result<[f64; 3], Error> {
        let cells =
            line.split_whitespace().map(|cell| number(path, index, cell)).collect::<Result<Vec<_>, _>>()?;
        match cells[..] {
            [Some(row), Some(column), Some(value)] => Ok([row, column, value]),
            _ => {
                Err(Error::place(path, &format!("line {}", index + 1), "three numbers", &format!("{line:?}")))
            }
        }
    };
    let mut lines = text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty());
    let sizes = lines.next().map(|(index, line)| entries(index, line)).transpose()?;
    let [n_frames, n_columns, _] = sizes
        .ok_or_else(|| Error::place(path, "line 2", "numbers of rows, columns and entries", "nothing"))?;
    let fits = |value: f64, n: f64| value >= 1.0 && value <= n && value.fract() == 0.0;
    if !fits(n_frames, MOST[0]) || !fits(n_columns, MOST[1]) {
        return Err(Error::place(
            path,
            "line 2",
            "a number of rows and columns",
            &format!("{n_frames} {n_columns}"),
        ));
    }
    let mut tracks = named((n_columns as usize).div_ceil(n_axes));
    for (index, line) in lines {
        let [row, column, value] = entries(index, line)?;
        if !fits(row, n_frames) || !fits(column, n_columns) {
            let expected = format!("a row to {n_frames} and a column to {n_columns}");
            return Err(Error::place(path, &format!("line {}", index + 1), &expected, line));
        }
        let (point, axis) = ((column as usize - 1) / n_axes, (column as usize - 1) % n_axes);
        let usual = Spot { x: f64::NAN, y: f64::NAN, sigma: None };
        let spot = tracks[point].spots.entry(row as usize - 1).or_insert(usual);
        match axis {
            0 => spot.x = value,
            1 => spot.y = value,
            _ => {}
        }
    }
    for track in &mut tracks {
        track.spots.retain(|_, spot| spot.x.is_finite() && spot.y.is_finite());
    }
    Ok(Tracks { tracks, ..Tracks::default() })
}

fn named(n: usize) -> Vec<Track> {
    (1..=n).map(|point| Track { name: point.to_string(), ..Track::default() }).collect()
}

/// A cell; none where it is NaN or empty.
fn number(path: &Path, index: usize, cell: &str) -> Result<Option<f64>, Error> {
    let cell = cell.trim();
    match cell.parse::<f64>() {
        Ok(value) => Ok(Some(value).filter(|value| value.is_finite())),
        Err(_) if cell.is_empty() => Ok(None),
        Err(_) => Err(Error::place(path, &format!("line {}", index + 1), "numbers", &format!("{cell:?}"))),
    }
}
