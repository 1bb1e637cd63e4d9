//! Bodies that are lost in the midst of a recording and found again: whether the motion knows what they did meanwhile.

use chainwave_measurement::{BodyTrack, Observation};

use crate::finding::Finding;
use crate::wording::named;

/// A body that a recording did not see for a while.
struct Unseen<'a> {
    observation: &'a Observation,
    /// The times of the frames, in seconds; one at least.
    times_s: Vec<f64>,
}

/// Whether a frame of a recording shows a picture that was seen before: what it does not show is no body's.
pub(crate) type ShowsAgain<'a> = dyn Fn(&Observation, usize) -> bool + 'a;

/// Bodies that some recordings of a view lost and found again; one finding for each view and body.
pub(crate) fn unseen_for_a_while(observations: &[Observation], shows_again: &ShowsAgain<'_>) -> Vec<Finding> {
    let places = |one: &Observation| {
        let view = one.view;
        one.bodies.iter().map(move |track| (view, track.body)).collect::<Vec<_>>()
    };
    let mut places: Vec<(u32, usize)> = observations.iter().flat_map(places).collect();
    places.sort_unstable();
    places.dedup();
    places.into_iter().filter_map(|place| unseen_in_view(observations, place, shows_again)).collect()
}

fn unseen_in_view(
    observations: &[Observation],
    (view, body): (u32, usize),
    shows_again: &ShowsAgain<'_>,
) -> Option<Finding> {
    let of_view: Vec<&Observation> = observations.iter().filter(|one| one.view == view).collect();
    let unseen: Vec<Unseen> = of_view.iter().filter_map(|one| unseen(one, body, shows_again)).collect();
    let names: Vec<&str> = unseen.iter().map(|one| one.observation.recording.as_str()).collect();
    let all_s = || unseen.iter().flat_map(|one| one.times_s.iter().copied());
    let (from_s, until_s) = (all_s().reduce(f64::min)?, all_s().reduce(f64::max)?);
    let n_frames = all_s().count();
    let nowhere = |one: &Unseen| {
        let others = || observations.iter().filter(|other| other.recording != one.observation.recording);
        let nobody_sees = |time_s: &&f64| !others().any(|other| sees(other, body, **time_s));
        one.times_s.iter().filter(nobody_sees).count()
    };
    let n_nowhere: usize = unseen.iter().map(nowhere).sum();
    let rest = match n_nowhere {
        0 => "the other trials stand for it there".to_owned(),
        n if n == n_frames => "nothing stands for it there".to_owned(),
        n => format!("in {n} of these frames nothing stands for it"),
    };
    let where_seen = match unseen.len() {
        1 => String::new(),
        n => format!(", in {n} of {} recordings of view {view}", of_view.len()),
    };
    Some(Finding {
        code: "body_unseen",
        subject: named(&names),
        text: format!(
            "body {body} was not seen in {n_frames} frames between {:.2} and {:.2} ms{where_seen}; {rest}",
            1e3 * from_s,
            1e3 * until_s
        ),
    })
}

/// The frames between the first and the last that show a body, in which it is not seen.
fn unseen<'a>(observation: &'a Observation, body: usize, shows_again: &ShowsAgain<'_>) -> Option<Unseen<'a>> {
    let positions = &track_of(observation, body)?.position_m;
    let first = positions.iter().position(Option::is_some)?;
    let last = positions.iter().rposition(Option::is_some)?;
    let is_lost = |frame: &usize| positions[*frame].is_none() && !shows_again(observation, *frame);
    let lost = (first..last).filter(is_lost);
    let times_s: Vec<f64> = lost.map(|frame| observation.times_s[frame]).collect();
    (!times_s.is_empty()).then_some(Unseen { observation, times_s })
}

/// Whether a recording sees a body at a time: in the frame that is nearest to it, and no farther than to the next one.
fn sees(observation: &Observation, body: usize, time_s: f64) -> bool {
    let Some(track) = track_of(observation, body) else { return false };
    let times_s = &observation.times_s;
    let behind = times_s.partition_point(|other| *other < time_s);
    let off_s = |frame: usize| (times_s[frame] - time_s).abs();
    let around = behind.saturating_sub(1)..(behind + 1).min(times_s.len());
    let Some(nearest) = around.min_by(|a, b| off_s(*a).total_cmp(&off_s(*b))) else { return false };
    let interval_s = match times_s.as_slice() {
        [first, .., last] => (last - first) / (times_s.len() - 1) as f64,
        _ => 0.0,
    };
    off_s(nearest) <= interval_s && track.position_m[nearest].is_some()
}

fn track_of(observation: &Observation, body: usize) -> Option<&BodyTrack> {
    observation.bodies.iter().find(|track| track.body == body)
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Estimate;

    use super::*;

    fn observation(trial: u32, seen: [bool; 5]) -> Observation {
        let position = |seen: bool| seen.then_some(Estimate::new(0.0, 1e-6));
        Observation {
            recording: format!("trial{trial}.cine"),
            view: 1,
            trial,
            // Triggers differ by a part of a frame.
            times_s: (0..5).map(|k| 1e-3 * f64::from(k) + 1e-5 * f64::from(trial)).collect(),
            bodies: vec![BodyTrack { body: 7, position_m: seen.map(position).into() }],
        }
    }

    fn only(observations: &[Observation]) -> Finding {
        let told = unseen_for_a_while(observations, &|_, _| false);
        let [said] = told.as_slice() else { panic!("one notice, found {told:?}") };
        assert_eq!(said.code, "body_unseen");
        said.clone()
    }

    #[test]
    fn a_body_that_leaves_the_view_is_no_news_and_one_that_comes_back_is() {
        let nothing = |seen: [bool; 5], again: usize| {
            unseen_for_a_while(&[observation(0, seen)], &|_, frame| frame == again).is_empty()
        };
        assert!(nothing([false, true, true, true, false], 0));
        // A frame that shows a picture again has been told of.
        assert!(nothing([true, true, false, true, true], 2) && !nothing([true, false, false, true, true], 2));
        let said = only(&[observation(0, [true, false, false, true, true])]);
        assert_eq!(said.subject, "trial0.cine");
        assert!(said.text.contains("body 7") && said.text.contains("2 frames between 1.00 and 2.00 ms"));
        assert!(said.text.ends_with("nothing stands for it there"), "{}", said.text);
    }

    #[test]
    fn what_stands_for_a_body_is_what_others_show_at_that_time() {
        let gap = [true, false, false, true, true];
        let said = only(&[observation(1, gap), observation(2, [true; 5])]);
        assert!(said.text.ends_with("the other trials stand for it there"), "{}", said.text);
        let said = only(&[observation(1, gap), observation(2, gap), observation(3, gap)]);
        assert_eq!(said.subject, "trial1.cine, trial2.cine, trial3.cine");
        assert!(
            said.text.contains("in 3 of 3 recordings of view 1; nothing stands for it there"),
            "{}",
            said.text
        );
        // One sees it in the first of two frames.
        let said = only(&[observation(1, gap), observation(2, [true, true, false, true, true])]);
        assert!(said.text.ends_with("in 2 of these frames nothing stands for it"), "{}", said.text);
    }
}
