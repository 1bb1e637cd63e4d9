//! Where pulses meet: which goes on as which, how far that moves them, and which come back from an end.

use chainwave_measurement::median;

use super::hump::Hump;
use super::path::{CourseLine, PulsePath};
use super::ridge::Direction;

/// Half widths of both pulses together within which they are one another's: at the distance of so many a sech^2 has left 1e-4 of its
/// height, which moves the other's top by less than that.
const APART: f64 = 3.0;
/// Passages on either side that a line needs.
const MIN_PASSES: usize = 3;
/// Gaps from an end, and [`APART`] half widths, within which a pulse that comes back from it may be told from what ran there.
const NEAR_END: f64 = 2.0;

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

/// Change of size and speed, as a factor, over which a pulse that was hidden by another is still told to be the same.
const SAME: f64 = 1.4;

/// Joins courses of one pulse that was hidden while a larger one passed over it: one ends beside a third course and the other begins beside
/// the same on its other side, with the same size and speed.
pub(crate) fn rejoin(courses: &mut Vec<PulsePath>) {
    while let Some((before, behind)) = hidden(courses) {
        let tail = courses.remove(behind);
        let before = if behind < before { before - 1 } else { before };
        courses[before].passes.extend(tail.passes);
    }
}

/// Two courses of one pulse, where there are such.
fn hidden(courses: &[PulsePath]) -> Option<(usize, usize)> {
    let n = courses.len();
    let pairs = (0..n).flat_map(|before| (0..n).map(move |behind| (before, behind)));
    pairs.filter(|(before, behind)| before != behind).find(|(before, behind)| {
        let pair = [&courses[*before], &courses[*behind]];
        is_one_pulse(pair) && courses.iter().any(|over| passes_over(over, pair))
    })
}

fn is_one_pulse([before, behind]: [&PulsePath; 2]) -> bool {
    let alike = |one: f64, other: f64| (other / one).ln().abs() < SAME.ln();
    let sizes = [before, behind].map(PulsePath::size);
    behind.direction == before.direction
        && behind.passes[0].sense == before.passes[0].sense
        && behind.first_s() > before.last_s()
        && alike(sizes[0], sizes[1])
        && alike(before.gaps_per_s(), behind.gaps_per_s())
}

fn passes_over(over: &PulsePath, [before, behind]: [&PulsePath; 2]) -> bool {
    let (from_s, to_s) = (before.last_s(), behind.first_s());
    let reach = APART * (over.half_width_gaps() + before.half_width_gaps());
    let last = before.passes[before.passes.len() - 1].gap as f64;
    let (from, to) = (over.place(from_s) - last, over.place(to_s) - behind.passes[0].gap as f64);
    over.first_s() <= from_s && over.last_s() >= to_s && from * to < 0.0 && from.abs().max(to.abs()) < reach
}

/// The meetings of all courses in their order of time. Where two pulses that run the same way exchange sizes without becoming one hump,
/// their courses are exchanged from there on, so that the large one stays the same pulse.
pub(crate) fn meetings(courses: &mut [PulsePath]) -> Vec<Meeting> {
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
fn common_s(pair: [&PulsePath; 2]) -> Option<(f64, f64)> {
    let (from_s, to_s) = (pair[0].first_s().max(pair[1].first_s()), pair[0].last_s().min(pair[1].last_s()));
    (to_s > from_s).then_some((from_s, to_s))
}

fn head_on(courses: &[PulsePath], pulses: [usize; 2]) -> Option<Meeting> {
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
fn overtaking(courses: &[PulsePath], pulses: [usize; 2]) -> Option<Meeting> {
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
fn exchange(courses: &mut [PulsePath], meeting: &Meeting) {
    let [first, second] = meeting.pulses;
    let split = |course: &PulsePath| course.passes.partition_point(|pass| pass.t_s <= meeting.t_s);
    let [at_first, at_second] = [split(&courses[first]), split(&courses[second])];
    let size = |passes: &[Hump]| median(passes.iter().map(|pass| pass.size).collect());
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

/// Whether each passage of a pulse lies within a meeting, or so near the end that turned the pulse back that it meets itself.
pub(crate) fn within_meetings(
    courses: &[PulsePath],
    meetings: &[Meeting],
    turned_at: Option<f64>,
    pulse: usize,
) -> Vec<bool> {
    let own = &courses[pulse];
    let from_end = APART * own.half_width_gaps();
    let meets_itself = |pass: &Hump| turned_at.is_some_and(|end| (end - pass.gap as f64).abs() < from_end);
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
    own.passes.iter().map(|pass| is_within(pass) || meets_itself(pass)).collect()
}

/// How far a meeting moves one of its pulses along its own way, in gaps: the line of its passages behind it less that before it, at the
/// meeting's time. None where either has fewer than three passages out of the other's reach.
pub(crate) fn phase_shift(
    course: &PulsePath,
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
            .filter(|(pass, within)| !**within && pass.is_found && pass.t_s > from_s && pass.t_s < to_s);
        free.map(|(pass, _)| (pass.t_s, pass.gap as f64)).collect()
    };
    let before = CourseLine::through(&points(earlier_s, meeting.t_s), MIN_PASSES)?;
    let after = CourseLine::through(&points(meeting.t_s, later_s), MIN_PASSES)?;
    Some(course.direction.sign() * (after.at(meeting.t_s) - before.at(meeting.t_s)))
}

/// The end of a chain of so many gaps, as a place, from which pulses of a direction come.
pub(crate) fn begins_at(direction: Direction, n_gaps: usize) -> f64 {
    match direction {
        Direction::Up => n_gaps as f64 + 0.5,
        Direction::Down => 0.5,
    }
}

/// The pulse that came back as this one from an end of the chain of so many gaps, where one did: it ran to the end at which this one
/// begins, and between the two lies the time that the way there and back takes.
pub(crate) fn reflected_from(courses: &[PulsePath], n_gaps: usize, pulse: usize) -> Option<usize> {
    let own = &courses[pulse];
    let end = begins_at(own.direction, n_gaps);
    let (speed, half_width) = (own.gaps_per_s(), own.half_width_gaps());
    let to_end = |pass: &Hump| (end - pass.gap as f64).abs();
    let begins = &own.passes[0];
    let off_s = |course: &PulsePath| {
        let ends = &course.passes[course.passes.len() - 1];
        let way_s = (to_end(begins) + to_end(ends)) / speed;
        let is_near = to_end(begins).max(to_end(ends)) < NEAR_END + APART * half_width;
        is_near.then_some((begins.t_s - ends.t_s - way_s).abs())
    };
    let came = courses.iter().enumerate().filter(|(_, course)| course.direction != own.direction);
    let nearest = came
        .filter_map(|(index, course)| Some((index, off_s(course)?)))
        .min_by(|one, other| one.1.total_cmp(&other.1))?;
    (nearest.1 * speed < 1.0 + half_width).then_some(nearest.0)
}
