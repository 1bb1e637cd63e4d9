//! Where pulses meet: which goes on as which, how far that moves them, and which come back from an end.

use super::course::{Course, Line};
use super::hump::Hump;
use super::ridge::Direction;

/// Half widths of both pulses together within which they are one another's: at the distance of so many a sech^2 has left 1e-4 of its
/// height, which moves the other's top by less than that.
const APART: f64 = 3.0;
/// Passages on either side that a line needs.
const MIN_PASSES: usize = 3;
/// Gaps from an end within which a pulse comes back from it.
const NEAR_END: usize = 2;
/// Time between the last passage of a pulse and the first of what comes back, in times from gap to gap.
const TURNED_WITHIN: f64 = 6.0;

/// Two pulses that meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Meeting {
    /// Which, by their numbers.
    pub(crate) pulses: [usize; 2],
    /// When and where they are nearest to each other.
    pub(crate) t_s: f64,
    pub(crate) place: f64,
    /// Whether they run against each other; else the faster one overtakes.
    pub(crate) is_head_on: bool,
}

/// The meetings of all courses in their order of time. Where two pulses that run the same way exchange sizes without becoming one hump,
/// their courses are exchanged from there on, so that the large one stays the same pulse.
pub(crate) fn meetings(courses: &mut [Course]) -> Vec<Meeting> {
    let mut found = Vec::new();
    for second in 1..courses.len() {
        for first in 0..second {
            if let Some(meeting) = overtaking(courses, [first, second]) {
                exchange(courses, &meeting);
                found.push(meeting);
            }
        }
    }
    for second in 1..courses.len() {
        for first in 0..second {
            found.extend(head_on(courses, [first, second]));
        }
    }
    found.sort_by(|one, other| one.t_s.total_cmp(&other.t_s));
    found
}

/// When both are seen.
fn common_s(pair: [&Course; 2]) -> Option<(f64, f64)> {
    let (from_s, to_s) = (pair[0].first_s().max(pair[1].first_s()), pair[0].last_s().min(pair[1].last_s()));
    (to_s > from_s).then_some((from_s, to_s))
}

fn head_on(courses: &[Course], pulses: [usize; 2]) -> Option<Meeting> {
    let pair = pulses.map(|pulse| &courses[pulse]);
    if pair[0].direction == pair[1].direction {
        return None;
    }
    let (mut low_s, mut high_s) = common_s(pair)?;
    let apart = |t_s: f64| pair[0].place(t_s) - pair[1].place(t_s);
    let sign = apart(low_s).signum();
    if sign * apart(high_s) > 0.0 {
        return None;
    }
    for _ in 0..60 {
        let middle_s = 0.5 * (low_s + high_s);
        if sign * apart(middle_s) > 0.0 {
            low_s = middle_s;
        } else {
            high_s = middle_s;
        }
    }
    Some(Meeting { pulses, t_s: high_s, place: pair[0].place(high_s), is_head_on: true })
}

/// Two pulses of one direction and sense that come near each other between passages far apart.
fn overtaking(courses: &[Course], pulses: [usize; 2]) -> Option<Meeting> {
    let pair = pulses.map(|pulse| &courses[pulse]);
    if pair[0].direction != pair[1].direction || pair[0].passes[0].sense != pair[1].passes[0].sense {
        return None;
    }
    let (from_s, to_s) = common_s(pair)?;
    let apart = |t_s: f64| (pair[0].place(t_s) - pair[1].place(t_s)).abs();
    let times_s = pair[0].passes.iter().chain(&pair[1].passes).map(|pass| pass.t_s);
    let times_s = times_s.filter(|t_s| (from_s..=to_s).contains(t_s));
    let t_s = times_s.min_by(|one, other| apart(*one).total_cmp(&apart(*other)))?;
    let reach = APART * (pair[0].half_width_gaps() + pair[1].half_width_gaps());
    let nearest = apart(t_s);
    let is_inside =
        nearest < reach && apart(from_s) > reach.min(2.0 * nearest) && apart(to_s) > reach.min(2.0 * nearest);
    let place = 0.5 * (pair[0].place(t_s) + pair[1].place(t_s));
    is_inside.then_some(Meeting { pulses, t_s, place, is_head_on: false })
}

/// Exchanges two courses behind their meeting where that makes their sizes go on.
fn exchange(courses: &mut [Course], meeting: &Meeting) {
    let [first, second] = meeting.pulses;
    let split = |course: &Course| course.passes.partition_point(|pass| pass.t_s <= meeting.t_s);
    let [at_first, at_second] = [split(&courses[first]), split(&courses[second])];
    let size = |passes: &[Hump]| super::course::median(passes.iter().map(|pass| pass.size).collect());
    let before = [&courses[first].passes[..at_first], &courses[second].passes[..at_second]].map(size);
    let after = [&courses[first].passes[at_first..], &courses[second].passes[at_second..]].map(size);
    let ([Some(a), Some(b)], [Some(c), Some(d)]) = (before, after) else { return };
    let change = |one: f64, other: f64| (other / one).ln().abs();
    if change(a, d) + change(b, c) < change(a, c) + change(b, d) {
        let tail_of_first = courses[first].passes.split_off(at_first);
        let tail_of_second = courses[second].passes.split_off(at_second);
        courses[first].passes.extend(tail_of_second);
        courses[second].passes.extend(tail_of_first);
    }
}

/// Whether each passage of a pulse lies within a meeting.
pub(crate) fn within_meetings(courses: &[Course], meetings: &[Meeting], pulse: usize) -> Vec<bool> {
    let own = &courses[pulse];
    let others = meetings.iter().filter_map(|meeting| match meeting.pulses {
        [one, other] if one == pulse => Some((other, meeting)),
        [other, one] if one == pulse => Some((other, meeting)),
        _ => None,
    });
    let others: Vec<(usize, &Meeting)> = others.collect();
    let is_within = |pass: &Hump| {
        others.iter().any(|(other, meeting)| {
            let other = &courses[*other];
            let reach = APART * (own.half_width_gaps() + other.half_width_gaps());
            let seen_s = other.first_s()..=other.last_s();
            match seen_s.contains(&pass.t_s) {
                true => (other.place(pass.t_s) - pass.gap as f64).abs() < reach,
                false => (meeting.place - pass.gap as f64).abs() < reach,
            }
        })
    };
    own.passes.iter().map(is_within).collect()
}

/// How far a meeting moves one of its pulses along its own way, in gaps: the line of its passages behind it less that before it, at the
/// meeting's time. None where either has fewer than three passages out of the other's reach.
pub(crate) fn phase_shift(
    course: &Course,
    is_within: &[bool],
    meeting: &Meeting,
    others_s: &[f64],
) -> Option<f64> {
    let earlier_s =
        others_s.iter().copied().filter(|t_s| *t_s < meeting.t_s).fold(f64::NEG_INFINITY, f64::max);
    let later_s = others_s.iter().copied().filter(|t_s| *t_s > meeting.t_s).fold(f64::INFINITY, f64::min);
    let points = |from_s: f64, to_s: f64| -> Vec<(f64, f64)> {
        let free = course
            .passes
            .iter()
            .zip(is_within)
            .filter(|(pass, within)| !**within && pass.t_s > from_s && pass.t_s < to_s);
        free.map(|(pass, _)| (pass.t_s, pass.gap as f64)).collect()
    };
    let before = Line::through(&points(earlier_s, meeting.t_s), MIN_PASSES)?;
    let after = Line::through(&points(meeting.t_s, later_s), MIN_PASSES)?;
    Some(course.direction.sign() * (after.at(meeting.t_s) - before.at(meeting.t_s)))
}

/// The pulse that came back as this one from an end of the chain of so many gaps, where one did.
pub(crate) fn reflected_from(courses: &[Course], n_gaps: usize, pulse: usize) -> Option<usize> {
    let own = &courses[pulse];
    let begins = own.passes[0];
    let is_at_end = match own.direction {
        Direction::Up => begins.gap + NEAR_END > n_gaps,
        Direction::Down => begins.gap <= NEAR_END,
    };
    let came = courses.iter().enumerate().filter(|(other, course)| {
        let ends = course.passes[course.passes.len() - 1];
        let waited_s = begins.t_s - ends.t_s;
        *other != pulse
            && course.direction != own.direction
            && ends.gap.abs_diff(begins.gap) <= 2 * NEAR_END
            && waited_s > -TURNED_WITHIN / course.gaps_per_s()
            && waited_s < TURNED_WITHIN / course.gaps_per_s()
            && course.first_s() < begins.t_s
    });
    let size = |course: &Course| course.passes[course.passes.len() - 1].size;
    let largest = came.max_by(|one, other| size(one.1).total_cmp(&size(other.1)))?;
    is_at_end.then_some(largest.0)
}
