//! `chainwave figures`: the figures of results once more, in another style, from what was kept of them.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use chainwave_figures::{CSV_COLUMNS, Draw, Format, Picture, Style};

use crate::cli::{self, FigureFormat};
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::found_in_place_of;
use crate::terminal::say;
use chainwave_experiment::read_toml;

/// Draws the figures that are kept in a folder and the folders in it; one that cannot be drawn is named, and the others are there.
pub(crate) fn figures(arguments: &cli::Figures) -> Result<Outcome, Error> {
    let cli::Figures { results, only, style, format } = arguments;
    let style = style.as_deref().map_or_else(|| Ok(Style::default()), read_style)?;
    let mut kept = kept_in(results)?;
    if kept.is_empty() {
        let found = found_in_place_of(results, "a folder without any");
        return Err(Error::Argument(format!(
            "{}: expected results with figures that were kept (figures/NAME.{}), found {found} (hint: the folder given to --out of `chainwave \
             run`; run again what an earlier version wrote, its tracks are used again)",
            results.display(),
            Picture::ENDING
        )));
    }
    if let Some(name) = only {
        let names: Vec<String> = kept.iter().map(|path| name_of(path)).collect();
        kept.retain(|path| name_of(path) == *name);
        if kept.is_empty() {
            return Err(Error::Argument(format!(
                "--only: expected the name of a figure that is there, one of {}; found {name:?}",
                names.join(", ")
            )));
        }
    }
    let formats: Vec<Format> = format.iter().map(|format| format_of(*format)).collect();
    let mut outcome = Outcome::default();
    let mut n_drawn = 0_usize;
    for path in &kept {
        let formats = formats_beside(path, &formats);
        let drawn = Picture::read(path)
            .and_then(|picture| picture.draw(&style)?.write(&path.with_extension(""), &formats));
        match drawn {
            Ok(()) => n_drawn += 1,
            Err(why) => outcome.fail(why.to_string()),
        }
    }
    if n_drawn == 0 {
        return Err(Error::nothing_left("figures", kept.len()));
    }
    say(results, n_drawn, format);
    Ok(outcome)
}

/// The formats of a figure, without the table of its numbers where another table stands in its place: the field that `correlate` drew, say.
fn formats_beside(kept: &Path, formats: &[Format]) -> Vec<Format> {
    let table = kept.with_extension("csv");
    let is_taken = formats.contains(&Format::Csv) && is_other_table(&table);
    if is_taken {
        Outcome::note(format!(
            "{}: holds something else than a figure's numbers, and is left as it is",
            table.display()
        ));
    }
    formats.iter().copied().filter(|format| !is_taken || *format != Format::Csv).collect()
}

/// Whether a file is there that is no figure's table.
fn is_other_table(path: &Path) -> bool {
    let Ok(file) = fs::File::open(path) else { return path.exists() };
    let mut first = Vec::new();
    let read = file.take(CSV_COLUMNS.len() as u64).read_to_end(&mut first);
    read.is_err() || first != CSV_COLUMNS.as_bytes()
}

fn say(results: &Path, n_drawn: usize, format: &[FigureFormat]) {
    let endings: Vec<String> = format.iter().map(ToString::to_string).collect();
    let plural = if n_drawn == 1 { "figure" } else { "figures" };
    say!("wrote {n_drawn} {plural} of {} as {}", results.display(), endings.join(", "));
}

fn read_style(path: &Path) -> Result<Style, Error> {
    let style: Style = read_toml(path)?;
    style.check().map_err(|wrong| Error::configuration(path, wrong.to_string()))?;
    Ok(style)
}

fn format_of(format: FigureFormat) -> Format {
    match format {
        FigureFormat::Svg => Format::Svg,
        FigureFormat::Png => Format::Png,
        FigureFormat::Pdf => Format::Pdf,
        FigureFormat::Csv => Format::Csv,
    }
}

/// The name of a figure: its file's without ending.
fn name_of(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// What is kept in a folder and the folders in it, in the order of their names; hidden folders are left out.
fn kept_in(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let entries = fs::read_dir(folder).map_err(Error::file(folder, "list"))?;
    let paths = entries.map(|entry| entry.map(|entry| entry.path()));
    let mut paths = paths.collect::<Result<Vec<_>, _>>().map_err(Error::file(folder, "list"))?;
    paths.sort();
    let mut kept = Vec::new();
    for path in paths {
        let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if path.is_dir() && !path.is_symlink() && !is_hidden {
            kept.extend(kept_in(&path)?);
        } else if path.extension().is_some_and(|ending| ending == Picture::ENDING) {
            kept.push(path);
        }
    }
    Ok(kept)
}
