//! Recordings that contradict the others of their view, with the evidence.

use std::fmt;

use chainwave_measurement::{Observation, median};

use crate::by_trigger::SOUND_SCATTER;
use crate::error::StitchingError;
use crate::likeness::{Odd, Resting, oddest, resting};
use crate::merge::merge_as_read;
use crate::settings::Settings;
use crate::stitched::Stitched;

/// A recording that does not belong with the others of its view, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlier {
    /// Its place among the observations.
    pub index: usize,
    /// Name of the recording.
    pub recording: String,
    /// Number of its view.
    pub view: u32,
    /// What speaks against it.
    pub evidence: Evidence,
}

/// What speaks against a recording.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Evidence {
    /// Its view's recordings agree much better without it: rms scatter about a common motion, in units of the tracker's sigma.
    Scatter {
        /// With it.
        with: f64,
        /// Without it.
        without: f64,
    },
    /// Its bodies move at another time than in the others: a file under a wrong name, or a trigger that failed.
    Trigger {
        /// Its trigger's distance from the view's median, in seconds.
        offset_s: f64,
        /// Median distance of the view's triggers, in seconds.
        usual_s: f64,
    },
    /// Nothing moves in it, though a body of it does in another recording at the same times: something else has set off the camera.
    Rest {
        /// Number of the body.
        body: usize,
        /// How far it moves there, in metres (rms).
        way_m: f64,
        /// That recording.
        moves_in: String,
    },
    /// Its bodies are far from where any other recording of its view has them.
    Motion {
        /// Distance from the recording most like it, as a share of the way (rms over bodies and frames).
        apart: f64,
        /// Median of that over the view's recordings.
        usual: f64,
    },
}

impl Outlier {
    fn of(observations: &[Observation], index: usize, evidence: Evidence) -> Self {
        let Observation { recording, view, .. } = &observations[index];
        Self { index, recording: recording.clone(), view: *view, evidence }
    }
}

impl fmt::Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scatter { with, without } => write!(
                f,
                "its view scatters by {with:.1} of the tracker's sigma with it, by {without:.1} without it"
            ),
            Self::Trigger { offset_s, usual_s } => write!(
                f,
                "its motion comes {:.3} ms after that of its view's other trials, whose triggers differ by {:.3} ms",
                1e3 * offset_s,
                1e3 * usual_s
            ),
            Self::Rest { body, way_m, moves_in } => write!(
                f,
                "nothing moves in it, while body {body} moves by {:.3} mm (rms) in {moves_in} at the same times (hint: did something else trigger \
                 the camera?)",
                1e3 * way_m
            ),
            Self::Motion { apart, usual } => write!(
                f,
                "its bodies move otherwise than in all other trials of its view: {:.0} % of the way from the one most like it (rms), where {:.1} % \
                 is usual",
                100.0 * apart,
                100.0 * usual
            ),
        }
    }
}

/// A recording is an outlier when its view scatters this much less without it. Trigger, drive and the response to it are free in
/// either case, so a trial struck harder or triggered late is none; another specimen or a wrong time base is.
const LEAST_GAIN: f64 = 3.0;
/// A trigger is an outlier farther from the median than this many times the median distance...
const LATE_RATIO: f64 = 10.0;
/// ...than this many frames, as a wave passes a body in some ten frames or more...
const LATE_FRAMES: f64 = 5.0;
/// ...and than this many standard deviations of how triggers are stated to scatter.
const LATE_SIGMAS: f64 = 5.0;
/// Fewer recordings than this do not tell by their scatter or their triggers which of them is wrong.
const LEAST_TRIALS: usize = 4;

/// Finds recordings in which nothing moves, though one of their bodies does in another recording at the same times, of any view. They
/// contradict the others, and no response to the drive tells: it may be made of one recording alone.
pub fn at_rest(observations: &[Observation], settings: &Settings) -> Vec<Outlier> {
    let all: Vec<&Observation> = observations.iter().collect();
    let found = resting(&all, settings.rest_until_s).into_iter();
    let outlier = |Resting { index, body, moves_in, way_m }| {
        let moves_in = observations[moves_in].recording.clone();
        Outlier::of(observations, index, Evidence::Rest { body, way_m, moves_in })
    };
    found.map(outlier).collect()
}

/// Finds recordings that contradict the others of their view: each view is merged alone, then without each of its recordings
/// in turn. The one whose absence helps most is named if it helps enough, or else the one whose trigger is far from the others', or else the
/// one whose bodies go ways of their own, and the rest are asked again.
///
/// # Errors
/// As for [`merge`](crate::merge).
pub fn outliers(observations: &[Observation], settings: &Settings) -> Result<Vec<Outlier>, StitchingError> {
    let mut views: Vec<u32> = observations.iter().map(|observation| observation.view).collect();
    views.sort_unstable();
    views.dedup();
    let mut found = Vec::new();
    for view in views {
        let mut kept: Vec<usize> =
            (0..observations.len()).filter(|i| observations[*i].view == view).collect();
        while let Some(outlier) = worst(observations, &kept, settings)? {
            kept.retain(|index| *index != outlier.index);
            found.push(outlier);
        }
    }
    found.sort_by_key(|outlier| outlier.index);
    Ok(found)
}

/// The recording without which the others agree much better, or else one that stands out of its view by its trigger.
fn worst(
    observations: &[Observation],
    kept: &[usize],
    settings: &Settings,
) -> Result<Option<Outlier>, StitchingError> {
    let seen = |index: &&usize| !observations[**index].bodies.is_empty();
    let outlier = |index: usize, evidence: Evidence| Outlier::of(observations, index, evidence);
    // What is asked below leaves a response to the drive free, which follows one recording alone where the others are alike.
    let otherwise = || {
        let recordings: Vec<&Observation> = kept.iter().map(|index| &observations[*index]).collect();
        let odd = oddest(&recordings, settings.rest_until_s);
        odd.map(|Odd { index, apart, usual }| outlier(kept[index], Evidence::Motion { apart, usual }))
    };
    if kept.iter().filter(seen).count() < LEAST_TRIALS {
        return Ok(otherwise());
    }
    let merged = |left_out: Option<usize>| {
        let others = kept.iter().filter(|index| Some(**index) != left_out);
        let others: Vec<Observation> = others.map(|index| observations[*index].clone()).collect();
        merge_as_read(&others, settings)
    };
    let all = merged(None)?;
    let with = scatter(&all);
    if with >= SOUND_SCATTER {
        let mut best: Option<(usize, f64)> = None;
        for index in kept {
            let without = scatter(&merged(Some(*index))?);
            if best.is_none_or(|(_, least)| without < least) {
                best = Some((*index, without));
            }
        }
        if let Some((index, without)) = best.filter(|(_, without)| with > LEAST_GAIN * without) {
            return Ok(Some(outlier(index, Evidence::Scatter { with, without })));
        }
    }
    // Only now: a recording that contradicts the others throws their triggers about as well.
    let stated_s = LATE_SIGMAS * settings.trigger_sigma_s.unwrap_or(0.0);
    let late = late(&all, stated_s.max(LATE_FRAMES * observations[kept[0]].frame_interval_s()));
    Ok(late.map(|(place, evidence)| outlier(kept[place], evidence)).or_else(otherwise))
}

/// The recording whose trigger stands farthest from the view's median, where that is out of proportion, and more than is usual in any case.
fn late(stitched: &Stitched, least_s: f64) -> Option<(usize, Evidence)> {
    let offsets_s: Vec<f64> =
        stitched.alignments.iter().map(|alignment| alignment.trigger_offset_s.value).collect();
    let middle_s = median(offsets_s.clone())?;
    let usual_s = median(offsets_s.iter().map(|offset_s| (offset_s - middle_s).abs()).collect())?;
    let distance_s = |r: usize| (offsets_s[r] - middle_s).abs();
    let farthest = (0..offsets_s.len()).max_by(|a, b| distance_s(*a).total_cmp(&distance_s(*b)))?;
    let limit_s = (LATE_RATIO * usual_s).max(least_s);
    let evidence = Evidence::Trigger { offset_s: offsets_s[farthest] - middle_s, usual_s };
    (distance_s(farthest) > limit_s).then_some((farthest, evidence))
}

/// Root mean square of the recordings' scatter.
fn scatter(stitched: &Stitched) -> f64 {
    let n = stitched.alignments.len() as f64;
    (stitched.alignments.iter().map(|alignment| alignment.scatter_ratio.powi(2)).sum::<f64>() / n).sqrt()
}
