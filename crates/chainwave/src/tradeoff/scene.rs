//! What a trade-off is measured on.

use std::path::Path;

use chainwave_correlation::ReferenceFrames;
use chainwave_experiment::{Setup, View, first_view, subsets_in};
use chainwave_measurement::{Recording, Region, Subset};

use crate::cli;
use crate::error::Error;
use crate::track::read_points;

/// Half the size of the subsets that are chosen where the user names none.
const HALF_PX: usize = 16;
/// Such subsets at most.
const MOST_SUBSETS: usize = 6;
/// Pixels kept from the frame's border.
const BORDER_PX: usize = 6;

/// The scene of an experiment (its first recording and the bodies in it) or of a recording.
pub(super) fn open(input: &Path, arguments: &cli::Tradeoff) -> Result<View, Error> {
    if is_experiment(input) {
        return Ok(first_view(&Setup::read(input, None)?)?);
    }
    let recording =
        chainwave_camera::open_with(input, &arguments.reading.options(arguments.frame_rate.rate_hz))?;
    let reference = ReferenceFrames::Single(0);
    let subsets = match &arguments.points {
        Some(points) => {
            let placed = subsets_in(recording.as_ref(), &read_points(points)?, &reference, None)?;
            placed.into_iter().map(|placed| placed.subset).collect()
        }
        None => textured(recording.as_ref())?,
    };
    Ok(View { recording, subsets, reference })
}

/// Whether an input is an experiment, by its ending.
pub(super) fn is_experiment(input: &Path) -> bool {
    input.extension().is_some_and(|ending| ending == "toml")
}

/// The squares of the first frame with the steepest gradients, none overlapping another.
fn textured(recording: &dyn Recording) -> Result<Vec<Subset>, Error> {
    let info = recording.info();
    let (width, height) = (info.width_px, info.height_px);
    let mut pixels = vec![0.0; width * height];
    recording.read_region(0, Region::whole(width, height), &mut pixels)?;
    let size = 2 * HALF_PX + 1;
    let room = |length: usize| (length.saturating_sub(2 * BORDER_PX)) / size;
    let mut squares: Vec<(f64, usize, usize)> = Vec::new();
    for row in 0..room(height) {
        for column in 0..room(width) {
            let (left, top) = (BORDER_PX + column * size, BORDER_PX + row * size);
            squares.push((steepness(&pixels, width, [left, top], size), left, top));
        }
    }
    squares.sort_by(|a, b| b.0.total_cmp(&a.0));
    let subset = |(number, (_, left, top)): (usize, &(f64, usize, usize))| {
        Subset::new(
            (number + 1).to_string(),
            (left + HALF_PX) as f64,
            (top + HALF_PX) as f64,
            HALF_PX,
            HALF_PX,
        )
    };
    let subsets: Vec<Subset> = squares.iter().take(MOST_SUBSETS).enumerate().map(subset).collect();
    match subsets.is_empty() {
        false => Ok(subsets),
        true => Err(Error::configuration(
            recording.path(),
            format!(
                "expected room for a subset of {size} x {size} px, found a frame of {width} x {height} px \
                 (hint: --points names smaller ones)"
            ),
        )),
    }
}

/// Sum of squared differences between neighbouring pixels of a square.
fn steepness(pixels: &[f32], width: usize, [left, top]: [usize; 2], size: usize) -> f64 {
    let at = |x: usize, y: usize| f64::from(pixels[y * width + x]);
    let inside = (top..top + size - 1).flat_map(|y| (left..left + size - 1).map(move |x| (x, y)));
    inside.map(|(x, y)| (at(x + 1, y) - at(x, y)).powi(2) + (at(x, y + 1) - at(x, y)).powi(2)).sum()
}
