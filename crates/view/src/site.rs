//! What stands at which address.

use std::sync::Arc;

use chainwave_camera::histogram;
use chainwave_correlation::{ReferenceFrames, Settings, expected_sigma, propose_markers};
use chainwave_measurement::{Excerpt, Lost, Recording, RecordingInfo, Subset};
use serde_json::{Value, json};

use crate::asked::Asked;
use crate::collection::{Collection, OpenRecordings, ShownRecording, ShownTrack};
use crate::cut::Cut;
use crate::match_pictures::{Matched, Part};
use crate::page::page;
use crate::picture::{greys, png_of};
use crate::points;
use crate::refusal::Refusal;
use crate::replies::Reply;
use crate::review::{Kept, Review};

/// Bars of a histogram that is sent.
const N_BARS: usize = 256;
/// Shares of the pixels below black and below white in the window that is proposed.
const WINDOW_SHARES: [f64; 2] = [0.005, 0.995];
/// Frames before the trigger that are averaged for markers and sigma; more noise less, and a rest that is sure.
const N_REST: usize = 8;

/// What is done with an address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verb {
    Get,
    Put,
}

/// The recordings and how they are asked for.
pub(crate) struct Site {
    collection: Collection,
    open: OpenRecordings,
    corrections: Kept,
}

impl Site {
    pub(crate) fn new(collection: Collection) -> Self {
        let corrections = Kept::of(collection.review.as_ref());
        Self { collection, open: OpenRecordings::default(), corrections }
    }

    /// The answer to a request that was let in.
    pub(crate) fn reply(&self, verb: Verb, asked: &Asked, body: &[u8]) -> Result<Reply, Refusal> {
        let parts: Vec<&str> = asked.parts.iter().map(String::as_str).collect();
        match (verb, parts.as_slice()) {
            (Verb::Get, []) => page(),
            (Verb::Get, ["api", "recordings"]) => Reply::json(&self.list()),
            (Verb::Get, ["api", "recording"]) => Reply::json(&self.recording(asked)?),
            (Verb::Get, ["api", "frame", frame]) => self.frame(asked, frame),
            (Verb::Get, ["api", "levels", frame]) => Reply::json(&self.levels(asked, frame)?),
            (Verb::Get, ["api", "markers"]) => Reply::json(&self.markers(asked)?),
            (Verb::Get, ["api", "sigma", frame]) => Reply::json(&self.sigma(asked, frame)?),
            (Verb::Get, ["api", "tracks", frame]) => Reply::json(&self.tracks(asked, frame)?),
            (Verb::Get, ["api", "subset", frame]) => self.subset(asked, frame),
            (Verb::Get, ["api", "wave"]) => match &self.collection.wave {
                Some(wave) => Reply::json(&wave.as_json()),
                None => Err(asked.nothing_here()),
            },
            (Verb::Get, ["api", "review"]) => Reply::json(&self.queue(asked)?),
            (Verb::Put, ["api", "corrections"]) => Reply::json(&self.correct(asked, body)?),
            (Verb::Put, ["api", "experiment"]) => Reply::json(&self.set_up(asked, body)?),
            (Verb::Put, ["api", "points"]) => Reply::json(&self.write_points(asked, body)?),
            _ => Err(asked.nothing_here()),
        }
    }

    /// The names of all recordings; none is opened.
    fn list(&self) -> Value {
        let Collection { title, recordings, notes, .. } = &self.collection;
        let names: Vec<&str> = recordings.iter().map(|shown| shown.name.as_str()).collect();
        json!({
            "title": title, "recordings": names, "notes": notes,
            "has_review": self.collection.review.is_some(), "has_wave": self.collection.wave.is_some(),
            "set_up": self.collection.set_up.as_ref().map(|set_up| json!({
                "questions": set_up.questions, "rest_until_s": set_up.rest_until_s, "path": set_up.path,
            })),
        })
    }

    /// The recording that a request names by its place in the list, the first where it names none.
    fn asked_for(&self, asked: &Asked) -> Result<(&ShownRecording, Arc<dyn Recording>), Refusal> {
        let index = asked.value("recording", "a whole number from 0", 0_usize)?;
        let n = self.collection.recordings.len();
        let shown = self.collection.recordings.get(index).ok_or_else(|| {
            Refusal::new(404, asked.path.clone(), format!("a recording below {n}"), index.to_string())
        })?;
        Ok((shown, self.open.get(index, shown)?))
    }

    /// What a recording says of itself, and what is drawn on it.
    fn recording(&self, asked: &Asked) -> Result<Value, Refusal> {
        let (shown, recording) = self.asked_for(asked)?;
        let info = recording.info();
        let subsets: Vec<Value> = shown.subsets.iter().map(of_subset).collect();
        let points = points::path_beside(&shown.path);
        let RecordingInfo { format, width_px, height_px, n_frames, bit_depth, rate_hz, .. } = info;
        Ok(json!({
            "name": shown.name, "format": format, "width_px": width_px, "height_px": height_px, "n_frames": n_frames,
            "bit_depth": bit_depth, "full_scale": info.full_scale(), "rate_hz": rate_hz,
            "first_image": info.first_image, "first_time_s": info.times_s.first(), "last_time_s": info.times_s.last(),
            "trigger_frame": trigger_frame(info), "camera": info.camera, "exposure_s": info.exposure_s,
            "warnings": info.warnings, "subsets": subsets, "n_tracks": shown.tracks.len(),
            "points_path": points.display().to_string(), "points_exist": points.exists(),
        }))
    }

    /// A part of a frame as a PNG, its exact time and number beside it.
    fn frame(&self, asked: &Asked, frame: &str) -> Result<Reply, Refusal> {
        let (_, recording) = self.asked_for(asked)?;
        let frame = frame_of(asked, frame, recording.info())?;
        let cut = Cut::of(asked, frame, recording.info())?;
        let greys = greys(recording.as_ref(), &cut)?;
        let png = png_of(&greys, cut.size())
            .map_err(|error| Refusal::new(500, asked.path.clone(), "a picture", error.to_string()))?;
        let info = recording.info();
        let reply = Reply::new("image/png", png)
            .with_header("X-Image", (info.first_image + frame as i64).to_string());
        Ok(match info.times_s.get(frame) {
            Some(time_s) => reply.with_header("X-Time-S", time_s.to_string()),
            None => reply,
        })
    }

    /// The counts of a frame: histogram, a window from nearly the darkest to nearly the brightest, and what may be clipped.
    fn levels(&self, asked: &Asked, frame: &str) -> Result<Value, Refusal> {
        let (_, recording) = self.asked_for(asked)?;
        let frame = frame_of(asked, frame, recording.info())?;
        let excerpt = Excerpt::new(recording.as_ref(), vec![frame]);
        let counted = histogram(&excerpt, 1).map_err(|error| Refusal::of_file(recording.path(), &error))?;
        let [low, high] = WINDOW_SHARES.map(|share| counted.quantile(share));
        let saturated = counted.saturation();
        Ok(json!({
            "low": low, "high": high.max(low + 1), "full_scale": counted.n_pixels.len() - 1, "n_pixels": counted.total(),
            "bars": counted.binned(N_BARS), "n_dark": counted.n_dark(),
            "saturation": saturated.map(|at| at.count), "n_saturated": saturated.map_or(0, |at| at.n_pixels),
        }))
    }

    /// Markers proposed in the rest frames from `frame` on, or why there are none.
    fn markers(&self, asked: &Asked) -> Result<Value, Refusal> {
        let (_, recording) = self.asked_for(asked)?;
        let frame = frame_of(asked, asked.text("frame").unwrap_or("0"), recording.info())?;
        let rest = rest_from(frame, recording.info());
        Ok(match propose_markers(recording.as_ref(), &rest) {
            Ok(row) => {
                let marker = |(number, marker): (usize, &chainwave_correlation::Marker)| {
                    json!({
                        "subset": of_subset(&marker.subset), "number": number + 1, "sigma": of_sigma(&marker.sigma_px),
                        "outline_half_px": marker.outline_half_px,
                    })
                };
                let markers: Vec<Value> = row.markers.iter().enumerate().map(marker).collect();
                let pitch = row.pitch_px.map(|pitch| [pitch.value, pitch.sigma]);
                json!({
                    "markers": markers, "pitch_px": pitch, "direction": row.direction, "missing_px": row.missing_px,
                    "noise_counts": row.noise_counts, "reason": null, "n_rest": rest.range().len(),
                })
            }
            Err(error) => json!({ "markers": [], "reason": error.to_string() }),
        })
    }

    /// How well a subset would be told: the expected sigma, or why there is none.
    fn sigma(&self, asked: &Asked, frame: &str) -> Result<Value, Refusal> {
        let (_, recording) = self.asked_for(asked)?;
        let info = recording.info();
        let frame = frame_of(asked, frame, info)?;
        let half = |name: &str, n: usize| {
            let half = asked.value(name, "a whole number from 2", 16_usize)?;
            match (2..=n).contains(&half) {
                true => Ok(half),
                false => Err(asked.refuse(name, &format!("2 to {n}"), &half.to_string())),
            }
        };
        let place = [asked.number("x", 0.0)?, asked.number("y", 0.0)?];
        let half = [half("half_width", info.width_px)?, half("half_height", info.height_px)?];
        let subset = Subset::new("here", place[0], place[1], half[0], half[1]).within(outline_of(asked)?);
        Ok(match expected_sigma(recording.as_ref(), &subset, &rest_from(frame, info), &Settings::default()) {
            Ok(sigma) => of_sigma(&sigma.map(|sigma| sigma.noise_px)),
            Err(error) => json!({ "sigma_px": null, "reason": error.to_string() }),
        })
    }

    /// Where tracked subsets are in a frame.
    fn tracks(&self, asked: &Asked, frame: &str) -> Result<Value, Refusal> {
        let (shown, recording) = self.asked_for(asked)?;
        let frame = frame_of(asked, frame, recording.info())?;
        let track = |track: &ShownTrack| {
            let place = |frame: usize| track.places_px.get(frame).copied().flatten();
            let first = track.places_px.iter().flatten().next();
            json!({ "name": track.name, "half_px": track.half_px, "place_px": place(frame), "rest_px": first })
        };
        let tracks: Vec<Value> = shown.tracks.iter().map(track).collect();
        Ok(json!({ "frame": frame, "tracks": tracks }))
    }

    /// A subset as its reference has it, as a frame shows it, or the difference: where it was found, or was last before it was lost.
    fn subset(&self, asked: &Asked, frame: &str) -> Result<Reply, Refusal> {
        let (shown, recording) = self.asked_for(asked)?;
        let frame = frame_of(asked, frame, recording.info())?;
        let name = asked.text("name").unwrap_or_default();
        let track = shown.tracks.iter().find(|track| track.name == name);
        let track = track.ok_or_else(|| asked.refuse("name", "the name of a track", name))?;
        let part = asked.text("part").unwrap_or("found");
        let part =
            Part::named(part).ok_or_else(|| asked.refuse("part", "reference, found or residual", part))?;
        let until = &track.places_px[..track.places_px.len().min(frame + 1)];
        let rest_px = track.places_px.iter().flatten().next();
        let (Some(rest_px), Some(found_px)) =
            (rest_px, until.iter().rev().flatten().next().or(rest_px).copied())
        else {
            return Err(asked.refuse("name", "a track that is found in some frame", name));
        };
        let matched = Matched {
            recording: recording.as_ref(),
            half_px: track.half_px,
            rest: rest_from(0, recording.info()).range(),
            rest_px: *rest_px,
            frame,
            found_px,
        };
        let png = png_of(&matched.greys(part)?, matched.size())
            .map_err(|error| Refusal::new(500, asked.path.clone(), "a picture", error.to_string()))?;
        Ok(Reply::new("image/png", png))
    }

    fn review(&self, asked: &Asked) -> Result<&Review, Refusal> {
        let hint = "chainwave view RESULTS --recordings FOLDER";
        self.collection.review.as_ref().ok_or_else(|| asked.nothing_here().with_hint(hint))
    }

    /// Readings to look at, and what is corrected.
    fn queue(&self, asked: &Asked) -> Result<Value, Refusal> {
        let Review { queue, path, .. } = self.review(asked)?;
        let (version, corrections) = self.corrections.now();
        Ok(json!({ "queue": queue, "path": path, "version": version, "corrections": corrections }))
    }

    /// Takes corrections in place of those that were.
    fn correct(&self, asked: &Asked, body: &[u8]) -> Result<Value, Refusal> {
        let review = self.review(asked)?;
        let info_of = |index: usize| {
            let shown = self.collection.recordings.get(index).ok_or_else(|| {
                let n = self.collection.recordings.len();
                Refusal::new(400, asked.path.clone(), format!("a recording below {n}"), index.to_string())
            })?;
            Ok(self.open.get(index, shown)?.info().clone())
        };
        let version = self.corrections.replace(review, &asked.path, body, info_of)?;
        Ok(json!({ "path": review.path, "version": version }))
    }

    /// Writes an experiment from what was picked in the recording and answered.
    fn set_up(&self, asked: &Asked, body: &[u8]) -> Result<Value, Refusal> {
        let set_up = self.collection.set_up.as_ref().ok_or_else(|| asked.nothing_here())?;
        let index = asked.value("recording", "a whole number from 0", 0_usize)?;
        let (_, recording) = self.asked_for(asked)?;
        let overwrite = asked.value("overwrite", "true or false", false)?;
        let said = set_up.write(&asked.path, body, (index, recording.info()), overwrite)?;
        Ok(json!({ "said": said }))
    }

    /// Writes points.csv beside the recording.
    fn write_points(&self, asked: &Asked, body: &[u8]) -> Result<Value, Refusal> {
        let (shown, recording) = self.asked_for(asked)?;
        let overwrite = asked.value("overwrite", "true or false", false)?;
        let subsets = points::read(&asked.path, body, recording.info())?;
        let path = points::path_beside(&shown.path);
        points::write(&path, &subsets, overwrite)?;
        Ok(json!({ "path": path.display().to_string(), "n_points": subsets.len() }))
    }
}

/// A frame's number in an address.
fn frame_of(asked: &Asked, text: &str, info: &RecordingInfo) -> Result<usize, Refusal> {
    let frame: usize = text.parse().map_err(|_| asked.refuse("frame", "a whole number from 0", text))?;
    match frame < info.n_frames {
        true => Ok(frame),
        false => {
            let expected = format!("a frame below {}", info.n_frames);
            Err(Refusal::new(404, asked.path.clone(), expected, frame.to_string()))
        }
    }
}

/// Frames at rest from one on: some before the trigger, or that one alone.
fn rest_from(frame: usize, info: &RecordingInfo) -> ReferenceFrames {
    let before_trigger = |frame: &usize| info.times_s.get(*frame).is_some_and(|time_s| *time_s < 0.0);
    let n = (frame..info.n_frames).take(N_REST).take_while(before_trigger).count();
    match n {
        0 | 1 => ReferenceFrames::Single(frame),
        n => ReferenceFrames::Mean(frame..frame + n),
    }
}

/// The first frame at or after the trigger, where frames lie on both sides of it.
fn trigger_frame(info: &RecordingInfo) -> Option<usize> {
    let after = info.times_s.iter().position(|time_s| *time_s >= 0.0)?;
    (after > 0).then_some(after)
}

/// Corners that a parameter lists, one number after the other.
fn outline_of(asked: &Asked) -> Result<Vec<[f64; 2]>, Refusal> {
    let text = asked.text("outline").unwrap_or_default();
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    let (corners, rest) = numbers.as_deref().map(<[f64]>::as_chunks).unwrap_or((&[], &[0.0]));
    match rest.is_empty() && points::is_outline(corners) {
        true => Ok(corners.to_vec()),
        false => Err(asked.refuse("outline", "three corners or more as x y x y ..", text)),
    }
}

fn of_subset(subset: &Subset) -> Value {
    let Subset { name, x_px, y_px, half_width_px, half_height_px, outline_px } = subset;
    json!({
        "name": name, "x_px": x_px, "y_px": y_px, "half_width_px": half_width_px, "half_height_px": half_height_px,
        "outline_px": outline_px,
    })
}

/// An expected sigma, or why there is none.
fn of_sigma(sigma_px: &Result<[f64; 2], Lost>) -> Value {
    match sigma_px {
        Ok(sigma_px) => json!({ "sigma_px": sigma_px, "reason": null }),
        Err(lost) => json!({ "sigma_px": null, "reason": lost.as_str() }),
    }
}
