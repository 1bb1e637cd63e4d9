//! Frames that show the picture before them once more, as a camera or a converter leaves them where it loses one.
//!
//! Two pictures of their own differ by noise wherever they are compared; a picture and its copy are matched at one place, with one correlation, to
//! the little that a search from another start leaves. Such a frame has every body a frame's way behind its time.

use chainwave_measurement::{Estimate, Lost, Observation, Position};

use crate::tracks::{FollowedBody, RecordingTracks};

/// How far from the one before a copy is found at most, in standard uncertainties of a reading: eight times what searches for one picture were seen to
/// leave. Noise has a body within it along both axes in one of 14 000 frames...
const ALIKE_SIGMAS: f64 = 0.015;
/// ...and by what of what it lacks to one its correlation differs at most: noise scatters that by some hundredths, so that one body alone is taken for a
/// copy in one of 500 000 frames.
const ALIKE_RESIDUAL: f64 = 3e-3;
/// What rounding makes of a correlation of 1: less than a hundredth of what pictures with noise lack.
const ROUNDED: f64 = 1e-7;
/// Copies that follow each other at most. Where there are more, the film has no noise, and rests...
const MOST_TOGETHER: usize = 3;
/// ...and shows one picture twice wherever bodies hardly move. A copy then is one where a body goes on by more than so many standard uncertainties from the
/// frame before it to the frame behind.
const GOES_ON_SIGMAS: f64 = 20.0;

/// The frames of a recording that are copies of the one before, from 0.
pub(crate) fn repeated_frames(tracks: &RecordingTracks) -> Vec<usize> {
    let n_frames = tracks.times_s.len();
    let is_copy = |frame: usize| {
        let both = tracks.bodies.iter().map(|body| [frame - 1, frame].map(|frame| body.positions.get(frame)));
        let mut alike = both.filter_map(|[before, own]| are_alike(before?, own?)).peekable();
        alike.peek().is_some() && alike.all(|is_alike| is_alike)
    };
    let copies: Vec<usize> = (1..n_frames).filter(|frame| is_copy(*frame)).collect();
    let together = copies.chunk_by(|one, next| one + 1 == *next);
    let (short, long): (Vec<_>, Vec<_>) = together.partition(|copies| copies.len() <= MOST_TOGETHER);
    let has_noise = long.is_empty();
    short.into_iter().flatten().copied().filter(|copy| has_noise || goes_on(tracks, *copy)).collect()
}

/// Whether any body is clearly elsewhere in the frame behind a copy than in the one before it.
fn goes_on(tracks: &RecordingTracks, copy: usize) -> bool {
    let place =
        |body: &FollowedBody, frame: usize| body.positions.get(frame)?.as_ref().ok().map(|at| at.x_px);
    tracks.bodies.iter().any(|body| {
        let both = place(body, copy - 1).zip(place(body, copy + 1));
        both.is_some_and(|(before, behind)| {
            (behind.value - before.value).abs() > GOES_ON_SIGMAS * before.sigma
        })
    })
}

/// Whether two readings of a body are of one picture; `None` where it was not read in both.
fn are_alike(before: &Result<Position, Lost>, own: &Result<Position, Lost>) -> Option<bool> {
    let (before, own) = (before.as_ref().ok()?, own.as_ref().ok()?);
    let is_near = [(before.x_px, own.x_px), (before.y_px, own.y_px)]
        .iter()
        .all(|(before, own)| (before.value - own.value).abs() <= ALIKE_SIGMAS * before.sigma);
    let lacks = (ALIKE_RESIDUAL * (1.0 - before.zncc)).max(ROUNDED);
    Some(is_near && (before.zncc - own.zncc).abs() <= lacks)
}

/// Leaves out the readings of copies.
pub(crate) fn leave_out(observation: &mut Observation, copies: &[usize]) {
    for track in &mut observation.bodies {
        for frame in copies {
            if let Some(position_m) = track.position_m.get_mut(*frame) {
                *position_m = None;
            }
        }
    }
}

/// Readings that are alike for longer than copies follow each other are one reading of a picture without noise, whose rounding repeats itself: each
/// counts for its share of one.
pub(crate) fn count_once(observation: &mut Observation) {
    let is_alike = |one: &Option<Estimate>, next: &Option<Estimate>| {
        one.zip(*next).is_some_and(|(one, next)| (one.value - next.value).abs() <= ALIKE_SIGMAS * one.sigma)
    };
    for track in &mut observation.bodies {
        for alike in track.position_m.chunk_by_mut(is_alike).filter(|alike| alike.len() > MOST_TOGETHER + 1) {
            let of_one = (alike.len() as f64).sqrt();
            alike.iter_mut().flatten().for_each(|position_m| position_m.sigma *= of_one);
        }
    }
}

/// What the reader should know of a recording with such frames; nothing without.
pub(crate) fn in_words(copies: &[usize]) -> Option<String> {
    let first = copies.first()?;
    let how_many = match copies.len() {
        1 => format!("frame {first} shows"),
        n => format!("{n} frames, the first is frame {first}, show"),
    };
    Some(format!(
        "{how_many} the picture before once more, as where a camera or a converter loses one: nothing is read there"
    ))
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::BodyTrack;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;

    /// Bodies that rest for 50 frames and move then, in pictures of so much noise; frames show the pictures of these numbers.
    fn tracks(n_bodies: usize, noise_px: f64, shown: &[usize]) -> RecordingTracks {
        let mut random = Pcg64::seed_from_u64(7);
        let mut normal = || StandardNormal.sample(&mut random);
        let picture = |k: usize, deviates: [f64; 3]| {
            let [x, y, residual]: [f64; 3] = deviates;
            let moved_px = 0.3 * k.saturating_sub(50) as f64;
            Ok(Position {
                x_px: Estimate::new(20.0 + moved_px + noise_px * x, 5e-3),
                y_px: Estimate::new(20.0 + noise_px * y, 5e-3),
                theta_rad: None,
                zncc: 1.0 - 1e-3 * (1.0 + 10.0 * noise_px * residual),
                iterations: 3,
            })
        };
        let body = |body: usize| {
            let pictures: Vec<_> = (0..200).map(|k| picture(k, [normal(), normal(), normal()])).collect();
            let positions = shown.iter().map(|k| pictures[*k]).collect();
            FollowedBody { body, method: String::new(), positions }
        };
        let bodies = (1..=n_bodies).map(body).collect();
        RecordingTracks { times_s: (0..shown.len()).map(|k| k as f64).collect(), bodies }
    }

    #[test]
    fn a_copy_is_found_among_pictures_of_their_own() {
        let mut shown: Vec<usize> = (0..200).collect();
        assert!(repeated_frames(&tracks(3, 5e-3, &shown)).is_empty());
        (shown[80], shown[120], shown[121]) = (79, 119, 119);
        for n_bodies in [1, 3] {
            let found = repeated_frames(&tracks(n_bodies, 5e-3, &shown));
            assert_eq!(found, [80, 120, 121]);
        }
        assert!(in_words(&[80]).unwrap().starts_with("frame 80 shows the picture before once more"));
        assert_eq!(in_words(&[]), None);
    }

    #[test]
    fn pictures_without_noise_rest() {
        let mut shown: Vec<usize> = (0..200).collect();
        assert!(repeated_frames(&tracks(2, 0.0, &shown)).is_empty());
        shown[80] = 79;
        assert_eq!(repeated_frames(&tracks(2, 0.0, &shown)), [80], "the body goes on");
    }

    #[test]
    fn readings_of_one_picture_count_once() {
        let seen = |places: &[f64]| Observation {
            recording: "film".into(),
            view: 1,
            trial: 1,
            times_s: (0..places.len()).map(|frame| frame as f64).collect(),
            bodies: vec![BodyTrack {
                body: 1,
                position_m: places.iter().map(|x| Some(Estimate::new(*x, 1.0))).collect(),
            }],
        };
        let sigmas = |mut observation: Observation| -> Vec<f64> {
            count_once(&mut observation);
            observation.bodies[0].position_m.iter().flatten().map(|x| x.sigma).collect()
        };
        let alike = sigmas(seen(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 3.0, 3.0]));
        assert_eq!(alike, [3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 1.0, 1.0, 1.0]);
        assert_eq!(sigmas(seen(&[0.3, -0.4, 1.2, 0.1, 0.9])), [1.0; 5]);
    }

    #[test]
    fn a_frame_without_a_reading_is_no_copy() {
        let shown: Vec<usize> = (0..200).collect();
        let mut lost = tracks(1, 5e-3, &shown);
        lost.bodies[0].positions[80..90].fill(Err(Lost::OutOfView));
        assert!(repeated_frames(&lost).is_empty());
    }
}
