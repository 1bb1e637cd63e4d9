//! A recording just made, looked at by itself and beside the shots before it, while it can still be repeated.

use std::num::NonZero;
use std::ops::Range;

use chainwave_analysis::probability::student;
use chainwave_camera::{Saturation, histogram};
use chainwave_correlation::{Method, ReferenceFrames, propose_markers};
use chainwave_measurement::{Estimate, Lost, Position, Recording, Region, Subset, median};

use crate::error::Error;
use crate::finding::Finding;
use crate::monitor::Monitor;
use crate::recordings::view::rest_frames;
use crate::review::{ReviewedRecording, TrialBesideOthers};
use crate::sanity::left_rest;
use crate::tracking::follow::follow;
use crate::tracks::{FollowedBody, RecordingTracks};

/// Frames that stand for the rest where no time stamp tells it, and the most that are averaged.
const SURE_FRAMES: usize = 8;
/// Frames that are looked at for pixels that saturate, from the first to the last: light changes, and bodies come into glare.
const LIT_FRAMES: usize = 32;
/// Share of a subset's pixels that may saturate: their place is told by the others.
const CLIPPED_SHARE: f64 = 0.01;
/// Standard uncertainties off its rest, three frames in a row, at which a body moves.
const MOVES_SIGMAS: f64 = 6.0;
const IN_A_ROW: usize = 3;
/// Trials, this one among them, from which on the others say what is usual.
const LEAST_TRIALS: usize = 3;
/// Standard deviations of a normal law that one sound shot in 200 exceeds. Two questions are asked, so at most one in 100 is told for nothing.
const ODD_SIGMAS: f64 = 2.807;
/// Scatter of strikes where none is known: by hand and by springs they repeat to some per cent. It counts as if five strikes had told it.
const USUAL_STRIKE_SCATTER: f64 = 0.02;
const USUAL_FREEDOM: f64 = 4.0;

/// How a shot is looked at.
#[derive(Debug, Clone)]
pub struct Shot<'a> {
    /// Name of the recording.
    pub recording: &'a str,
    /// The view that it shows: shots of one view are held against each other.
    pub view: u32,
    /// The subsets of bodies by number, where an experiment tells them; markers are looked for otherwise.
    pub bodies: Option<Vec<(usize, Subset)>>,
    /// Until when nothing moves, in seconds after the trigger; the trigger itself unless it is stated.
    pub rest_until_s: Option<f64>,
    /// Relative scatter of the striker's velocity, where it is known.
    pub strike_scatter: Option<f64>,
    /// How bodies are followed.
    pub method: Method,
}

/// A shot that was looked at.
#[derive(Debug, Clone)]
pub struct LookedAt {
    /// Name of the recording.
    pub recording: String,
    /// Its view.
    pub view: u32,
    /// Where its bodies were found.
    pub tracks: RecordingTracks,
    /// What speaks for another shot; nothing where it is sound.
    pub findings: Vec<Finding>,
}

impl Shot<'_> {
    /// Follows the bodies of a recording, and says what is wrong with it, by itself and beside `earlier` shots.
    ///
    /// # Errors
    /// Pixels that cannot be read, and what the correlation refuses.
    pub fn look_at(
        &self,
        recording: &dyn Recording,
        earlier: &[LookedAt],
        n_threads: NonZero<usize>,
    ) -> Result<LookedAt, Error> {
        let info = recording.info();
        let rest_until_s = self.rest_until_s.unwrap_or(0.0);
        let n_rest = rest_frames(info, rest_until_s).map_or(0, |rest| rest.end);
        let sure = 0..n_rest.clamp(1, SURE_FRAMES).min(info.n_frames);
        let mut findings = Vec::new();
        let mut say = |code: &'static str, text: String| {
            findings.push(Finding { code, subject: self.recording.to_owned(), text });
        };
        if n_rest == 0 && info.rate_hz.is_some() {
            let first_ms = 1e3 * info.times_s.first().copied().unwrap_or(0.0);
            let until_ms = 1e3 * rest_until_s;
            say(
                "late_trigger",
                format!("no frame before {until_ms:.3} ms, the first is at {first_ms:.3} ms"),
            );
        }
        let bodies = match &self.bodies {
            Some(bodies) => bodies.clone(),
            None => match propose_markers(recording, &ReferenceFrames::Mean(sure.clone())) {
                Ok(row) => (1..).zip(row.markers.into_iter().map(|marker| marker.subset)).collect(),
                Err(reason) => {
                    say("no_markers", reason.to_string());
                    Vec::new()
                }
            },
        };
        let (numbers, subsets): (Vec<usize>, Vec<Subset>) = bodies.into_iter().unzip();
        let reference = ReferenceFrames::Mean(sure);
        let tracks = match subsets.is_empty() {
            true => RecordingTracks { times_s: info.times_s.clone(), bodies: Vec::new() },
            false => follow(recording, &subsets, &reference, self.method, n_threads, &Monitor::SILENT)?
                .of_bodies(numbers),
        };
        if let Some(text) = clipped(recording, &subsets, &tracks)? {
            say("clipped", text);
        }
        tracks.bodies.iter().filter_map(lost).for_each(|text| say("body_lost", text));
        match onset(&tracks, n_rest) {
            Onset::AtRest { body, time_s, by_px } => say(
                "late_trigger",
                format!(
                    "body {body} moves from {:.3} ms on, by {by_px:+.2} px while the chain should rest until {:.3} ms",
                    1e3 * time_s,
                    1e3 * rest_until_s
                ),
            ),
            Onset::Never if !tracks.bodies.is_empty() => {
                say("nothing_moves", format!("no body moves in {} frames", info.n_frames));
            }
            _ => {}
        }
        let (recording, view) = (self.recording.to_owned(), self.view);
        let mut looked_at = LookedAt { recording, view, tracks, findings };
        let others: Vec<&LookedAt> = earlier.iter().filter(|one| one.view == self.view).collect();
        if others.len() + 1 >= LEAST_TRIALS {
            let text = unlike(&looked_at, &others, self.strike_scatter);
            looked_at.findings.extend(text.map(|text| Finding {
                code: "unlike_others",
                subject: looked_at.recording.clone(),
                text,
            }));
        }
        Ok(looked_at)
    }
}

/// The subset of which most pixels saturate where it is found in one of some frames, if those are too many; of a recording without subsets,
/// the whole frame.
fn clipped(
    recording: &dyn Recording,
    subsets: &[Subset],
    tracks: &RecordingTracks,
) -> Result<Option<String>, Error> {
    let info = recording.info();
    let counted = histogram(recording, LIT_FRAMES)?;
    let Some(Saturation { count: saturation, n_pixels: n_saturated }) = counted.saturation() else {
        return Ok(None);
    };
    if subsets.is_empty() {
        let share = n_saturated as f64 / counted.total().max(1) as f64;
        return Ok((share > CLIPPED_SHARE).then(|| is_clipped(share, "the frame", saturation)));
    }
    let mut worst = (CLIPPED_SHARE, None);
    for (subset, body) in subsets.iter().zip(&tracks.bodies) {
        let [half_x, half_y] = [subset.half_width_px as i64, subset.half_height_px as i64];
        for &frame in &counted.frames {
            let place_px = match body.positions.get(frame) {
                Some(Ok(at)) => [at.x_px.value, at.y_px.value],
                Some(Err(Lost::OutOfView)) | None => continue,
                // What saturates may be lost for that.
                Some(Err(_)) => [subset.x_px, subset.y_px],
            };
            let [x, y] = place_px.map(|place_px| place_px.round() as i64);
            let (right, below) = (x + half_x + 1, y + half_y + 1);
            let region = Region::clipped(x - half_x, y - half_y, right, below, info.width_px, info.height_px);
            let Some(region) = region else { continue };
            let mut counts = vec![0.0; region.n_pixels()];
            recording.read_region(frame, region, &mut counts)?;
            let n = counts.iter().filter(|count| f64::from(**count) >= saturation as f64).count();
            let share = n as f64 / counts.len() as f64;
            if share > worst.0 {
                worst = (share, Some(format!("subset {} in frame {frame}", subset.name)));
            }
        }
    }
    let (share, what) = worst;
    Ok(what.map(|what| is_clipped(share, &what, saturation)))
}

fn is_clipped(share: f64, what: &str, saturation: usize) -> String {
    format!("{:.1} % of the pixels of {what} are clipped at {saturation} counts", 100.0 * share)
}

/// Where and why a body is lost in view.
fn lost(body: &FollowedBody) -> Option<String> {
    let reason =
        |at: &Result<Position, Lost>| at.as_ref().err().copied().filter(|lost| *lost != Lost::OutOfView);
    let frames: Vec<(usize, Lost)> =
        body.positions.iter().enumerate().filter_map(|(frame, at)| Some((frame, reason(at)?))).collect();
    let (first, lost) = frames.first()?;
    let (n, all) = (frames.len(), body.positions.len());
    Some(format!(
        "body {} is lost in {n} of {all} frames, from frame {first} on ({})",
        body.body,
        lost.as_str()
    ))
}

/// When bodies begin to move.
enum Onset {
    /// One does while it should rest.
    AtRest { body: usize, time_s: f64, by_px: f64 },
    /// All rest as long as they should.
    Later,
    /// None does at all.
    Never,
}

fn onset(tracks: &RecordingTracks, n_rest: usize) -> Onset {
    let along = |body: &FollowedBody, axis: usize, frames: Range<usize>| -> Vec<Option<Estimate>> {
        let of = |at: &Position| if axis == 0 { at.x_px } else { at.y_px };
        body.positions[frames].iter().map(|at| at.as_ref().ok().map(of)).collect()
    };
    let mut earliest: Option<(usize, f64, usize)> = None;
    for body in &tracks.bodies {
        for axis in [0, 1] {
            let readings = along(body, axis, 0..n_rest.min(body.positions.len()));
            let Some((frame, by_px)) = left_rest(&readings) else { continue };
            if earliest.is_none_or(|(first, ..)| frame < first) {
                earliest = Some((frame, by_px, body.body));
            }
        }
    }
    if let Some((frame, by_px, body)) = earliest {
        return Onset::AtRest { body, time_s: tracks.times_s[frame], by_px };
    }
    let moves = |body: &FollowedBody| {
        let rest_px = place_at_rest(body);
        let is_off = |at: &Result<Position, Lost>| {
            at.as_ref().is_ok_and(|at| {
                let off =
                    |found: Estimate, rest: f64| (found.value - rest).abs() > MOVES_SIGMAS * found.sigma;
                rest_px.is_some_and(|[x, y]| off(at.x_px, x) || off(at.y_px, y))
            })
        };
        body.positions.windows(IN_A_ROW).any(|run| run.iter().all(is_off))
    };
    if tracks.bodies.iter().any(moves) { Onset::Later } else { Onset::Never }
}

/// Where a body was first, in pixels.
fn place_at_rest(body: &FollowedBody) -> Option<[f64; 2]> {
    let first = || body.positions.iter().flatten().take(SURE_FRAMES);
    Some([
        median(first().map(|at| at.x_px.value).collect())?,
        median(first().map(|at| at.y_px.value).collect())?,
    ])
}

/// What is said of a shot that is not like the others of its view.
pub(crate) fn unlike(shot: &LookedAt, others: &[&LookedAt], strike_scatter: Option<f64>) -> Option<String> {
    other_strike(shot, others, strike_scatter).or_else(|| off_the_others(shot, others))
}

/// What is said of a shot whose readings lie farther from the others' than these scatter. Two others hardly tell how they scatter, three do.
fn off_the_others(shot: &LookedAt, others: &[&LookedAt]) -> Option<String> {
    let all = others.iter().copied().chain([shot]);
    let reviewed: Vec<ReviewedRecording<'_>> = all
        .map(|one| ReviewedRecording { recording: &one.recording, view: one.view, tracks: &one.tracks })
        .collect();
    let found = TrialBesideOthers::of(&reviewed, reviewed.len() - 1)?;
    let (body, frame) = found.farthest;
    (found.apart_px > student(ODD_SIGMAS, found.degrees_of_freedom) * found.scatter_px).then(|| {
        format!(
            "it moves otherwise than the {} other trials of the view, by {:.3} px (rms) where these scatter by {:.3} px: body {body} is \
             {:.2} px off in frame {frame}",
            others.len(),
            found.apart_px,
            found.scatter_px,
            found.by_px
        )
    })
}

/// What is said of a shot that was struck harder or less hard than the others.
fn other_strike(shot: &LookedAt, others: &[&LookedAt], stated_scatter: Option<f64>) -> Option<String> {
    let own_px = farthest_px(&shot.tracks);
    // Of each body, so that shots that lost some are compared by the others.
    let beside = |other: &&LookedAt| {
        let theirs_px = farthest_px(&other.tracks);
        let ratio = |(body, px): &(usize, f64)| {
            let (_, own_px) = own_px.iter().find(|(own, _)| own == body)?;
            Some(px / own_px).filter(|ratio| ratio.is_finite())
        };
        median(theirs_px.iter().filter_map(ratio).collect())
    };
    let ratios: Vec<f64> = others.iter().filter_map(beside).collect();
    let n = ratios.len() as f64;
    let usual = ratios.iter().sum::<f64>() / n;
    if ratios.is_empty() || usual <= 0.0 {
        return None;
    }
    let (scatter, most) = match stated_scatter {
        Some(stated) => (stated, ODD_SIGMAS * stated),
        None => {
            let squares: f64 = ratios.iter().map(|ratio| (ratio / usual - 1.0).powi(2)).sum();
            let degrees_of_freedom = USUAL_FREEDOM + n - 1.0;
            let scatter =
                ((USUAL_FREEDOM * USUAL_STRIKE_SCATTER.powi(2) + squares) / degrees_of_freedom).sqrt();
            (scatter, student(ODD_SIGMAS, degrees_of_freedom) * scatter)
        }
    };
    let farther = usual.recip() - 1.0;
    // The mean of the others scatters, too.
    (farther.abs() > most * (1.0 + n.recip()).sqrt()).then(|| {
        format!(
            "bodies move {:+.1} % farther than in the {} other trials of the view; strikes scatter by {:.1} %",
            100.0 * farther,
            others.len(),
            100.0 * scatter
        )
    })
}

/// How far each body comes, in pixels.
fn farthest_px(tracks: &RecordingTracks) -> Vec<(usize, f64)> {
    let of = |body: &FollowedBody| {
        let [x, y] = place_at_rest(body)?;
        let away = body.positions.iter().flatten().map(|at| (at.x_px.value - x).hypot(at.y_px.value - y));
        Some((body.body, away.max_by(f64::total_cmp)?))
    };
    tracks.bodies.iter().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::MemoryRecording;

    use super::*;

    const WIDTH_PX: usize = 60;

    /// A body of 11 x 11 px that is at (15, 15) in frame 0 and goes 1 px to the right from frame to frame, and glare right of column 45: what
    /// comes there saturates.
    fn into_glare() -> MemoryRecording {
        let count = |frame: usize, x: usize, y: usize| {
            let is_body = x.abs_diff(15 + frame) <= 5 && y.abs_diff(15) <= 5;
            match (is_body, x > 45) {
                (true, true) => 255.0,
                (true, false) => (100 + 40 * ((x - frame + y) % 3)) as f32,
                (false, _) => 20.0,
            }
        };
        let frame = |frame| (0..30 * WIDTH_PX).map(|at| count(frame, at % WIDTH_PX, at / WIDTH_PX)).collect();
        MemoryRecording::new(WIDTH_PX, 8, (0..40).map(frame).collect())
    }

    fn followed(
        recording: &MemoryRecording,
        at: impl Fn(usize) -> Result<Position, Lost>,
    ) -> RecordingTracks {
        let positions = (0..recording.frames.len()).map(at).collect();
        let body = FollowedBody { body: 1, method: String::new(), positions };
        RecordingTracks { times_s: recording.info.times_s.clone(), bodies: vec![body] }
    }

    #[test]
    fn a_body_is_clipped_where_it_comes_into_glare_and_not_before() {
        let recording = into_glare();
        let subset = Subset::new("1", 15.0, 15.0, 5, 5);
        let at = |x_px: f64| {
            let estimate = |value| Estimate { value, sigma: 0.01 };
            Position { x_px: estimate(x_px), y_px: estimate(15.0), theta_rad: None, zncc: 1.0, iterations: 1 }
        };
        let said =
            |tracks: &RecordingTracks| clipped(&recording, std::slice::from_ref(&subset), tracks).unwrap();
        let all = said(&followed(&recording, |frame| Ok(at(15.0 + frame as f64)))).unwrap();
        // At (54, 15) in the last frame, 39 of them on: columns 49 to 59, all of which glare.
        assert_eq!(all, "100.0 % of the pixels of subset 1 in frame 36 are clipped at 255 counts");
        // One that stays where the first frame shows it, and one that has left, are not clipped.
        assert_eq!(said(&followed(&recording, |_| Ok(at(15.0)))), None);
        let gone = |frame| if frame == 0 { Ok(at(15.0)) } else { Err(Lost::OutOfView) };
        assert_eq!(said(&followed(&recording, gone)), None);
    }
}
