//! Corrections put to use: subsets placed, bodies followed anew, readings taken out.

use std::fmt::Write;

use chainwave_correlation::{Method, Reference, ReferenceFrames, Settings, ShapeChoice, track_from};
use chainwave_measurement::{Lost, Recording, Subset};

use super::correction::{Correction, Remedy};
use super::file::Corrections;
use crate::error::Error;
use crate::finding::Finding;
use crate::tracks::{FollowedBody, RecordingTracks};

impl Corrections {
    /// Places the subsets of bodies in a recording where they are told to lie.
    pub(crate) fn place(&self, recording: &str, bodies: &mut [(usize, Subset)]) {
        for one in &self.list {
            if let Remedy::Place([x_px, y_px]) = one.remedy {
                let placed = bodies.iter_mut().filter(|(body, _)| one.is_about(recording, *body));
                placed.for_each(|(_, subset)| (subset.x_px, subset.y_px) = (x_px, y_px));
            }
        }
    }

    /// What the tracks of a recording depend on beside its subsets: from where bodies are followed anew.
    pub(crate) fn seeds_as_text(&self, recording: &str) -> String {
        let mut text = String::new();
        for (one, [x_px, y_px]) in self.seeds(recording) {
            let (body, last) = (one.body.unwrap_or(0), one.last_frame);
            let _infallible =
                writeln!(text, "{body} at {x_px:?}, {y_px:?} px in frames {} to {last:?}", one.first_frame);
        }
        if text.is_empty() { "none".into() } else { text }
    }

    /// Follows bodies anew from where they are told to be; a body that the recording does not show stays as it is.
    pub(crate) fn follow_seeds(
        &self,
        recording: &dyn Recording,
        name: &str,
        subsets: &[Subset],
        reference: &ReferenceFrames,
        tracks: &mut RecordingTracks,
    ) -> Result<(), Error> {
        for (one, place_px) in self.seeds(name) {
            let followed = tracks.bodies.iter_mut().zip(subsets);
            // A subset outside of the frames was never followed.
            let is_meant = |body: &FollowedBody, subset: &Subset| {
                one.is_about(name, body.body) && Reference::lies_inside(recording, subset)
            };
            for (body, subset) in followed.filter(|(body, subset)| is_meant(body, subset)) {
                let frames = one.frames(body.positions.len());
                let (settings, first) = (settings_of(body), frames.start);
                let found = track_from(recording, subset, reference, &settings, frames, place_px)?;
                found.into_iter().enumerate().for_each(|(k, found)| body.positions[first + k] = found);
            }
        }
        Ok(())
    }

    fn seeds<'a>(&'a self, recording: &'a str) -> impl Iterator<Item = (&'a Correction, [f64; 2])> {
        let of_recording = self.list.iter().filter(move |one| one.recording == recording);
        of_recording.filter_map(|one| match one.remedy {
            Remedy::Seed(place_px) => Some((one, place_px)),
            _ => None,
        })
    }

    /// Takes out the readings of a recording that are told to be.
    pub(crate) fn exclude(&self, recording: &str, tracks: &mut RecordingTracks) {
        for one in self.list.iter().filter(|one| one.remedy == Remedy::Exclude) {
            for body in tracks.bodies.iter_mut().filter(|body| one.is_about(recording, body.body)) {
                let frames = one.frames(body.positions.len());
                body.positions[frames].fill(Err(Lost::Excluded));
            }
        }
    }

    /// What the corrections came to in recordings that were tracked: how many readings are taken out, and those that are about nothing.
    pub(crate) fn findings(&self, tracked: &[(&str, &RecordingTracks)]) -> Vec<Finding> {
        let Some(source) = &self.source else { return Vec::new() };
        let bodies = || tracked.iter().flat_map(|(_, tracks)| &tracks.bodies);
        let n_excluded =
            bodies().flat_map(|body| &body.positions).filter(|at| **at == Err(Lost::Excluded)).count();
        let count = |is: fn(&Remedy) -> bool| self.list.iter().filter(|one| is(&one.remedy)).count();
        let n_seeds = count(|remedy| matches!(remedy, Remedy::Seed(_)));
        let n_placed = count(|remedy| matches!(remedy, Remedy::Place(_)));
        let mut texts = Vec::new();
        if !self.list.is_empty() {
            texts.push(format!(
                "{n_excluded} readings are excluded, bodies are followed anew from {n_seeds} places, and {n_placed} subsets are placed by hand"
            ));
        }
        // A recording that failed, or is another velocity's, says nothing.
        let is_void = |one: &Correction| {
            let shown = tracked.iter().find(|(name, _)| *name == one.recording);
            shown.is_some_and(|(_, tracks)| {
                let is_met = |body: &FollowedBody| {
                    one.is_about(&one.recording, body.body) && !one.frames(body.positions.len()).is_empty()
                };
                !tracks.bodies.iter().any(is_met)
            })
        };
        texts.extend(self.list.iter().enumerate().filter(|(_, one)| is_void(one)).map(|(row, one)| {
            let body = one.body.map_or_else(String::new, |body| format!("body {body} of "));
            let (recording, first) = (&one.recording, one.first_frame);
            format!(
                "row {} is about {body}{recording} from frame {first} on, where nothing is followed",
                row + 1
            )
        }));
        Finding::all_of("corrections", &source.name, texts)
    }
}

/// The settings that a body was followed with; those of the program where its method is none of Gauss and Newton.
fn settings_of(body: &FollowedBody) -> Settings {
    match body.method.parse() {
        Ok(Method::IcGn { interpolation, shape: ShapeChoice::Named(shape) }) => {
            Settings { interpolation, shape, ..Settings::default() }
        }
        _ => Settings::default(),
    }
}
