//! Bodies that are lost for good while they should be in the picture: what they do from then on is nowhere measured.

use chainwave_measurement::{Lost, median};

use crate::finding::Finding;
use crate::tracked::TrackedRecording;
use crate::tracks::FollowedBody;
use crate::wording::named;

/// Where a body was lost for good.
#[derive(Debug, Clone, Copy, PartialEq)]
struct End {
    /// When, in seconds after the trigger.
    time_s: f64,
    /// Why, in most of the frames from then on.
    reason: Lost,
}

/// Bodies that are lost for good in some recordings of a view, not because they left the picture; one finding for each view and body.
pub(crate) fn lost_for_good(recordings: &[TrackedRecording]) -> Vec<Finding> {
    let mut places: Vec<(u32, usize)> = recordings.iter().flat_map(places_of).collect();
    places.sort_unstable();
    places.dedup();
    places.into_iter().filter_map(|(view, body)| lost_in_view(recordings, view, body)).collect()
}

fn places_of(recording: &TrackedRecording) -> impl Iterator<Item = (u32, usize)> {
    recording.tracks.bodies.iter().map(|followed| (recording.trial.view, followed.body))
}

fn lost_in_view(recordings: &[TrackedRecording], view: u32, body: usize) -> Option<Finding> {
    let of_view = recordings.iter().filter(|one| one.trial.view == view);
    let followed = of_view.filter_map(|one| {
        let followed = one.tracks.bodies.iter().find(|followed| followed.body == body)?;
        Some((one, end_of(followed, &one.tracks.times_s)))
    });
    let ends: Vec<(&TrackedRecording, Option<End>)> = followed.collect();
    let lost: Vec<(&TrackedRecording, End)> =
        ends.iter().filter_map(|(one, end)| Some((*one, (*end)?))).collect();
    let from_s = median(lost.iter().map(|(_, end)| end.time_s).collect())?;
    let (_, End { reason, .. }) = lost.first()?;
    let names: Vec<&str> = lost.iter().map(|(one, _)| one.trial.recording.as_str()).collect();
    let rest = match lost.len() == ends.len() {
        true => "nothing of this view stands for it from then on",
        false => "the other trials stand for it",
    };
    Some(Finding {
        code: "body_lost",
        subject: named(&names),
        text: format!(
            "body {body} is lost for good from {:.2} ms on ({}), in {} of {} recordings of view {view}, though it has not left the picture: {rest} (hint: \
             subsets that hold more of the marker and less of what is beside it, a shorter exposure, a higher frame rate; `chainwave view` shows it)",
            1e3 * from_s,
            reason.as_str(),
            lost.len(),
            ends.len(),
        ),
    })
}

/// Where a body is lost for good by what the picture shows of it: it was found before, is not found again, and in most of the frames
/// from then on it is neither out of view nor taken out nor unreadable.
fn end_of(followed: &FollowedBody, times_s: &[f64]) -> Option<End> {
    let last = followed.positions.iter().rposition(Result::is_ok)?;
    let behind: Vec<Lost> =
        followed.positions[last + 1..].iter().filter_map(|one| one.as_ref().err().copied()).collect();
    let of_picture = [Lost::LowCorrelation, Lost::Ambiguous, Lost::NotConverged, Lost::NoTexture];
    let most =
        of_picture.into_iter().max_by_key(|reason| behind.iter().filter(|one| *one == reason).count())?;
    let n_of_picture = behind.iter().filter(|one| of_picture.contains(one)).count();
    (n_of_picture >= LEAST_FRAMES && 2 * n_of_picture > behind.len())
        .then(|| End { time_s: times_s[last + 1], reason: most })
}

/// Frames in a row that are a loss; a film's last few may be torn or dark.
const LEAST_FRAMES: usize = 5;

#[cfg(test)]
mod tests {
    use chainwave_measurement::{Estimate, Position};

    use super::*;

    fn followed(statuses: &[Option<Lost>]) -> FollowedBody {
        let found = || Position {
            x_px: Estimate::new(10.0, 0.01),
            y_px: Estimate::new(10.0, 0.01),
            theta_rad: None,
            zncc: 0.99,
            iterations: 3,
        };
        let position = |status: &Option<Lost>| status.map_or_else(|| Ok(found()), Err);
        FollowedBody { body: 3, method: "any".into(), positions: statuses.iter().map(position).collect() }
    }

    fn end(parts: &[(usize, Option<Lost>)]) -> Option<End> {
        let statuses: Vec<Option<Lost>> =
            parts.iter().flat_map(|(n, status)| std::iter::repeat_n(*status, *n)).collect();
        let times_s: Vec<f64> = (0..statuses.len()).map(|k| 1e-3 * k as f64).collect();
        end_of(&followed(&statuses), &times_s)
    }

    #[test]
    fn a_body_that_is_lost_in_the_picture_and_not_found_again_is_lost_for_good() {
        let lost = end(&[(7, None), (2, Some(Lost::NotConverged)), (9, Some(Lost::LowCorrelation))]).unwrap();
        assert_eq!(lost, End { time_s: 7e-3, reason: Lost::LowCorrelation });
    }

    #[test]
    fn one_that_leaves_the_picture_or_comes_back_or_was_never_seen_is_not() {
        let low = Some(Lost::LowCorrelation);
        assert_eq!(end(&[(7, None), (6, low), (9, Some(Lost::OutOfView))]), None);
        assert_eq!(end(&[(7, None), (9, low), (1, None)]), None);
        assert_eq!(end(&[(7, None), (4, low)]), None);
        assert_eq!(end(&[(20, low)]), None);
        assert_eq!(end(&[(7, None), (9, Some(Lost::Excluded))]), None);
    }
}
