//! Figures of where the subsets lie: a frame at rest of some views with what was followed drawn on it.

use std::path::Path;

use chainwave_camera::{gray_frame, open_with};
use chainwave_experiment::{Results, Setup, TrackedRecording};
use chainwave_figures::{MarkedFrame, MarkedSubset, marked_frame};

use super::figures::Figure;
use super::outputs::NUMBERED_FIGURE;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::figures_folder;

/// Views that are shown: the first, the one in the middle, the last.
const MOST_SHOWN: usize = 3;
/// Columns of the picture at most.
const WIDTH_PX: usize = 1000;

/// Draws them; one whose recording cannot be read any more is named, and the others are there.
pub(super) fn draw(
    setup: &Setup,
    out: &Path,
    results: &Results,
    outcome: &mut Outcome,
) -> Result<Vec<Figure>, Error> {
    let mut first: Vec<&TrackedRecording> = results.tracked.recordings.iter().collect();
    first.sort_by_key(|one| (one.trial.view, one.trial.trial));
    first.dedup_by_key(|one| one.trial.view);
    let last = first.len().saturating_sub(1);
    let mut shown: Vec<usize> = (0..MOST_SHOWN).map(|k| k * last / (MOST_SHOWN - 1)).collect();
    shown.dedup();
    let folder = figures_folder(out)?;
    let drawn = |one: &&TrackedRecording| {
        figure(setup, &folder, one).map_err(|why| outcome.fail(format!("a figure: {why}"))).ok()
    };
    Ok(shown.into_iter().filter_map(|at| first.get(at)).filter_map(drawn).collect())
}

fn figure(setup: &Setup, folder: &Path, one: &TrackedRecording) -> Result<Figure, Error> {
    let recording = open_with(&setup.path_of(&one.trial), &setup.open_options())?;
    let tracking = &setup.experiment.tracking;
    let frame = 0;
    let picture = gray_frame(recording.as_ref(), frame, WIDTH_PX)?;
    let subset = |body: &chainwave_experiment::FollowedBody| {
        let found = body.positions.get(frame)?.as_ref().ok()?;
        Some(MarkedSubset {
            name: body.body.to_string(),
            centre_px: [found.x_px.value, found.y_px.value],
            half_px: [tracking.half_width_px, tracking.half_height_px],
        })
    };
    let info = recording.info();
    let marked = MarkedFrame {
        size_px: [info.width_px, info.height_px],
        picture_px: [picture.width_px, picture.height_px],
        grays: picture.pixels,
        subsets: one.tracks.bodies.iter().filter_map(subset).collect(),
    };
    let name = format!("{NUMBERED_FIGURE}{}", one.trial.view);
    marked_frame(&folder.join(&name), &marked)?;
    Ok(Figure {
        name,
        caption: format!(
            "View {}, frame {frame} of {}: the subsets that were followed, with the numbers of their bodies.",
            one.trial.view, one.trial.recording
        ),
    })
}
