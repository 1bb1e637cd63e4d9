//! Which recordings are tied to each other through bodies that both saw.

use chainwave_measurement::{BodyTrack, Observation};

/// Recordings tied to each other, directly or through others, as places among the observations; each group and the list in rising order.
/// A recording that saw no body stands alone.
pub(crate) fn tied_groups(observations: &[Observation]) -> Vec<Vec<usize>> {
    let bodies = |r: usize| seen_tracks(&observations[r]).map(|track| track.body);
    let mut group: Vec<usize> = (0..observations.len()).collect();
    for a in 0..group.len() {
        for b in 0..a {
            if group[a] != group[b] && bodies(a).any(|body| bodies(b).any(|other| other == body)) {
                let (from, to) = (group[a].max(group[b]), group[a].min(group[b]));
                group.iter_mut().filter(|label| **label == from).for_each(|label| *label = to);
            }
        }
    }
    let members = |label: usize| (0..group.len()).filter(|r| group[*r] == label).collect::<Vec<_>>();
    (0..group.len()).map(members).filter(|group| !group.is_empty()).collect()
}

/// The first body that a recording of a group saw.
pub(crate) fn first_body(observations: &[Observation], group: &[usize]) -> Option<usize> {
    group.iter().flat_map(|r| seen_tracks(&observations[*r])).map(|track| track.body).min()
}

/// The share of a body's way that a recording must have seen to tie others to it firmly.
const FIRM_SHARE: f64 = 0.5;

/// Observations without the tracks of bodies that left the picture early, where others saw them longer: a body's onset looks alike
/// under an earlier trigger and a weaker drive, so that it hardly tells them apart.
pub(crate) fn without_glimpses(observations: &[Observation]) -> Vec<Observation> {
    let farthest_m = |body: usize| {
        let tracks = observations.iter().flat_map(seen_tracks).filter(|track| track.body == body);
        tracks.map(way_m).fold(0.0, f64::max)
    };
    let without = |observation: &Observation| {
        let is_firm = |track: &&BodyTrack| way_m(track) >= FIRM_SHARE * farthest_m(track.body);
        let bodies = observation.bodies.iter().filter(is_firm).cloned().collect();
        Observation { bodies, ..observation.clone() }
    };
    observations.iter().map(without).collect()
}

fn seen_tracks(observation: &Observation) -> impl Iterator<Item = &BodyTrack> {
    observation.bodies.iter().filter(|track| track.position_m.iter().any(Option::is_some))
}

/// How far a body moved from where it was first seen.
fn way_m(track: &BodyTrack) -> f64 {
    let mut seen = track.position_m.iter().flatten().map(|position| position.value);
    let first_m = seen.next().unwrap_or(0.0);
    seen.map(|x_m| (x_m - first_m).abs()).fold(0.0, f64::max)
}
