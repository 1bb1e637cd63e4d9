//! points.csv: the subsets that were picked, as `chainwave track --points` reads them.

use std::collections::BTreeSet;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use chainwave_measurement::{RecordingInfo, Subset};
use serde::Deserialize;

use crate::refusal::Refusal;

/// Name of the table, beside the recording.
pub(crate) const FILE_NAME: &str = "points.csv";
const HEAD: &str = "name,x_px,y_px,half_width_px,half_height_px";
const MOST_CORNERS: usize = 1000;
const MOST_POINTS: usize = 10_000;
const MOST_NAME_CHARS: usize = 100;

/// Tables written by this process, which tells their temporary names apart.
static N_WRITTEN: AtomicUsize = AtomicUsize::new(0);

/// What is sent to be written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sent {
    points: Vec<SentPoint>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SentPoint {
    name: String,
    x_px: f64,
    y_px: f64,
    half_width_px: usize,
    half_height_px: usize,
    #[serde(default)]
    outline_px: Vec<[f64; 2]>,
}

/// The subsets of a request, each checked.
pub(crate) fn read(path: &str, body: &[u8], info: &RecordingInfo) -> Result<Vec<Subset>, Refusal> {
    let expected = "{\"points\": [{name, x_px, y_px, half_width_px, half_height_px, outline_px}]}";
    let sent: Sent =
        serde_json::from_slice(body).map_err(|error| Refusal::new(400, path, expected, error.to_string()))?;
    checked(path, sent.points, info)
}

/// Points as subsets, each with a name of its own and all of it inside the frame.
pub(crate) fn checked(
    path: &str,
    points: Vec<SentPoint>,
    info: &RecordingInfo,
) -> Result<Vec<Subset>, Refusal> {
    let refuse = |expected: &str, found: String| Err(Refusal::new(400, path, expected, found));
    if points.is_empty() || points.len() > MOST_POINTS {
        return refuse(&format!("1 to {MOST_POINTS} points"), points.len().to_string());
    }
    let mut names = BTreeSet::new();
    for point in &points {
        let SentPoint { name, x_px, y_px, half_width_px, half_height_px, outline_px } = point;
        let is_name = !name.trim().is_empty() && name.chars().count() <= MOST_NAME_CHARS;
        if !is_name || name.chars().any(char::is_control) || !names.insert(name.as_str()) {
            let found: String = name.chars().take(MOST_NAME_CHARS).collect();
            return refuse("a name for each point, each once", format!("{found:?}"));
        }
        let inside = |centre: f64, half: usize, n: usize| {
            half <= n && centre - half as f64 >= -0.5 && centre + half as f64 <= n as f64 - 0.5
        };
        if !inside(*x_px, *half_width_px, info.width_px) || !inside(*y_px, *half_height_px, info.height_px) {
            let expected = format!("subsets within {} x {} px", info.width_px, info.height_px);
            return refuse(
                &expected,
                format!("{name} at ({x_px}, {y_px}) +- ({half_width_px}, {half_height_px}) px"),
            );
        }
        if !is_outline(outline_px) {
            return refuse(
                &format!("no corner, or 3 to {MOST_CORNERS}"),
                format!("{} of {name}", outline_px.len()),
            );
        }
    }
    let subset = |point: SentPoint| {
        let SentPoint { name, x_px, y_px, half_width_px, half_height_px, outline_px } = point;
        Subset::new(name, x_px, y_px, half_width_px, half_height_px).within(outline_px)
    };
    Ok(points.into_iter().map(subset).collect())
}

/// Whether corners may be an outline: none, or those of a polygon.
pub(crate) fn is_outline(corners: &[[f64; 2]]) -> bool {
    let is_number = |value: &f64| value.is_finite();
    corners.is_empty()
        || (3..=MOST_CORNERS).contains(&corners.len()) && corners.iter().flatten().all(is_number)
}

/// Where the points of a recording are written.
pub(crate) fn path_beside(recording: &Path) -> PathBuf {
    recording.with_file_name(FILE_NAME)
}

/// Writes points under a temporary name in the same folder, which then becomes `path`; another file there is replaced only with
/// `overwrite`.
pub(crate) fn write(path: &Path, points: &[Subset], overwrite: bool) -> Result<(), Refusal> {
    let there = || {
        let expected = "no file there, or overwrite=true";
        Refusal::new(409, path.display().to_string(), expected, "a file of that name")
            .with_hint("nothing was written")
    };
    if path.exists() && !overwrite {
        return Err(there());
    }
    let number = N_WRITTEN.fetch_add(1, Ordering::Relaxed);
    let temporary = path.with_file_name(format!(".{FILE_NAME}.{}-{number}", std::process::id()));
    let failed = |error: std::io::Error| {
        let hint = "is the folder writable? the page can also save the table as a download";
        Refusal::new(500, path.display().to_string(), "a file that can be written", error.to_string())
            .with_hint(hint)
    };
    let text = table(points);
    let result = write_new(&temporary, text.as_bytes()).map_err(failed).and_then(|()| {
        if overwrite {
            return fs::rename(&temporary, path).map_err(failed);
        }
        // A link, unlike a renaming, never replaces what somebody else wrote meanwhile. Some file systems have none, and say so in several ways:
        // there the file is made, which replaces none either, and filled.
        match fs::hard_link(&temporary, path) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => {
                match write_new(path, text.as_bytes()) {
                    Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(there()),
                    Err(error) => {
                        // Half a table is none.
                        let _ = fs::remove_file(path);
                        Err(failed(error))
                    }
                    Ok(()) => Ok(()),
                }
            }
            Err(_) => Err(there()),
            Ok(()) => Ok(()),
        }
    });
    // After a renaming it is gone already.
    let _ = fs::remove_file(&temporary);
    result
}

fn write_new(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = fs::File::create_new(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// The table of points; corners of outlines stand one after the other in a column of their own, where there are any.
fn table(points: &[Subset]) -> String {
    let has_outline = points.iter().any(|subset| !subset.outline_px.is_empty());
    let row = |subset: &Subset| {
        let Subset { name, x_px, y_px, half_width_px, half_height_px, outline_px } = subset;
        let corners: Vec<String> = outline_px.iter().map(|[x, y]| format!("{x} {y}")).collect();
        let outline = if has_outline { format!(",{}", corners.join(" ")) } else { String::new() };
        format!("{},{x_px},{y_px},{half_width_px},{half_height_px}{outline}\n", table_cell(name))
    };
    let head = format!("{HEAD}{}\n", if has_outline { ",outline_px" } else { "" });
    std::iter::once(head).chain(points.iter().map(row)).collect()
}

/// A text as a cell of a table, in quotes where it needs them.
pub fn table_cell(text: &str) -> String {
    match text.contains([',', ';', '"']) || text.trim() != text {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}
