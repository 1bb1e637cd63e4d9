//! What the first recording shows: its markers, and until when nothing moves.

use std::path::Path;

use chainwave_camera::{gray_frame, open};
use chainwave_correlation::{Marker, MarkerRow, ReferenceFrames, propose_markers};
use chainwave_figures::{Draw, Format, MarkedFrame, MarkedSubset, Style};
use chainwave_measurement::{Recording, Region, median};

use crate::error::Error;

/// Frames that surely show the chain at rest; fewer where a recording is short.
const SURE_FRAMES: usize = 8;
/// Share of the time before the first motion that is taken for rest: a pulse's foot moves bodies by less than can be seen in single pixels.
const REST_SHARE: f64 = 0.8;
/// A frame has moved where its markers differ from the first frame by this much more than noise makes them, and the next two as well.
const MOVED: f64 = 1.5;
const IN_A_ROW: usize = 3;
/// Columns of the picture at most.
const WIDTH_PX: usize = 1200;

/// What a recording shows.
pub(crate) struct SeenInRecording {
    pub(super) row: MarkerRow,
    /// Time before which nothing moves, in seconds after the trigger; `None` where nothing moves at all, or at once.
    pub(crate) rest_until_s: Option<f64>,
}

impl SeenInRecording {
    /// Looks for markers in the first frames, and for their first motion.
    pub(crate) fn of(path: &Path) -> Result<Self, Error> {
        let recording = open(path)?;
        let n_sure = SURE_FRAMES.min(recording.info().n_frames);
        let row = propose_markers(recording.as_ref(), &ReferenceFrames::Mean(0..n_sure))?;
        let rest_until_s = rest_until_s(recording.as_ref(), &row.markers)?;
        Ok(Self { row, rest_until_s })
    }

    /// Draws the markers on the first frame of the recording: `STEM.png`.
    pub(super) fn draw(&self, path: &Path, stem: &Path) -> Result<(), Error> {
        let recording = open(path)?;
        let picture = gray_frame(recording.as_ref(), 0, WIDTH_PX)?;
        let info = recording.info();
        let mark = |marker: &Marker| MarkedSubset {
            name: marker.subset.name.clone(),
            centre_px: [marker.subset.x_px, marker.subset.y_px],
            half_px: [marker.subset.half_width_px, marker.subset.half_height_px],
        };
        let frame = MarkedFrame {
            size_px: [info.width_px, info.height_px],
            picture_px: [picture.width_px, picture.height_px],
            grays: picture.pixels,
            subsets: self.row.markers.iter().map(mark).collect(),
        };
        Ok(frame.draw(&Style::default())?.write(stem, &[Format::Png])?)
    }
}

/// The pixels of all markers in one frame.
fn pixels_of(recording: &dyn Recording, markers: &[Marker], frame: usize) -> Result<Vec<f32>, Error> {
    let mut all = Vec::new();
    for Marker { subset, .. } in markers {
        let (width, height) = (2 * subset.half_width_px + 1, 2 * subset.half_height_px + 1);
        let first = |centre: f64, half: usize| (centre.round() as usize).saturating_sub(half);
        let region = Region {
            x: first(subset.x_px, subset.half_width_px),
            y: first(subset.y_px, subset.half_height_px),
            width,
            height,
        };
        let before = all.len();
        all.resize(before + region.n_pixels(), 0.0);
        recording.read_region(frame, region, &mut all[before..])?;
    }
    Ok(all)
}

fn rest_until_s(recording: &dyn Recording, markers: &[Marker]) -> Result<Option<f64>, Error> {
    let times_s = &recording.info().times_s;
    let first = pixels_of(recording, markers, 0)?;
    let differs = |frame: usize| -> Result<f64, Error> {
        let pixels = pixels_of(recording, markers, frame)?;
        let squares = pixels.iter().zip(&first).map(|(here, there)| f64::from(here - there).powi(2));
        Ok(squares.sum::<f64>() / first.len().max(1) as f64)
    };
    let n_sure = SURE_FRAMES.min(times_s.len());
    let sure = (1..n_sure).map(differs).collect::<Result<Vec<f64>, _>>()?;
    let Some(noise2) = median(sure) else { return Ok(None) };
    let mut n_moved = 0;
    for frame in n_sure..times_s.len() {
        n_moved = if differs(frame)? > MOVED * noise2 { n_moved + 1 } else { 0 };
        if n_moved == IN_A_ROW {
            let moved_s = times_s[frame + 1 - IN_A_ROW];
            return Ok(Some(times_s[0] + REST_SHARE * (moved_s - times_s[0])));
        }
    }
    Ok(None)
}
