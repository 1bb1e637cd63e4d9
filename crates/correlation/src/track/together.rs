//! Subsets of one recording held against each other: no two can be in one place.

use chainwave_measurement::{Lost, Position, Subset, Track};

use crate::{Acceptance, Settings};

/// Share of the distance that two subsets have in the reference below which one of them was taken for the other: no body is compressed so
/// far.
const COLLIDING: f64 = 0.25;

/// Takes the readings of subsets that were found where another one is: of two, that which came from farther away is [`Lost::Ambiguous`].
///
/// From frame `first` on to the end, and from there back to frame 0, as they were followed.
pub(crate) fn without_collisions(
    mut tracks: Vec<Track>,
    subsets: &[Subset],
    first: usize,
    settings: &Settings,
) -> Vec<Track> {
    let n_frames = tracks.first().map_or(0, |track| track.positions.len());
    if settings.acceptance != Acceptance::ByEvidence || tracks.len() < 2 {
        return tracks;
    }
    let start: Vec<[f64; 2]> = subsets.iter().map(|subset| [subset.x_px, subset.y_px]).collect();
    let frames: [Vec<usize>; 2] = [(first..n_frames).collect(), (0..first).rev().collect()];
    for frames in frames {
        let mut last = start.clone();
        for frame in frames {
            for intruder in intruders(&tracks, subsets, frame, &last) {
                tracks[intruder].positions[frame] = Err(Lost::Ambiguous);
            }
            for (last, track) in last.iter_mut().zip(&tracks) {
                *last = track.positions[frame].as_ref().map_or(*last, place);
            }
        }
    }
    tracks
}

fn place(position: &Position) -> [f64; 2] {
    [position.x_px.value, position.y_px.value]
}

fn distance([x, y]: [f64; 2], [u, v]: [f64; 2]) -> f64 {
    (x - u).hypot(y - v)
}

/// Of each two subsets that a frame shows in one place, the one that is farther from where it was `last`.
fn intruders(tracks: &[Track], subsets: &[Subset], frame: usize, last: &[[f64; 2]]) -> Vec<usize> {
    let found = |(i, track): (usize, &Track)| Some((i, place(track.positions[frame].as_ref().ok()?)));
    let mut places: Vec<(usize, [f64; 2])> = tracks.iter().enumerate().filter_map(found).collect();
    places.sort_by(|left, right| left.1[0].total_cmp(&right.1[0]));
    let reach = |i: usize| subsets[i].half_width_px.min(subsets[i].half_height_px) as f64;
    let mut intruders = Vec::new();
    for (k, &(i, here)) in places.iter().enumerate() {
        let near = places[k + 1..].iter().take_while(|(_, there)| there[0] - here[0] < reach(i));
        for &(j, there) in near {
            let before = distance([subsets[i].x_px, subsets[i].y_px], [subsets[j].x_px, subsets[j].y_px]);
            let apart = distance(here, there);
            if apart < reach(i).min(reach(j)).min(COLLIDING * before) {
                let came = |index: usize, place| distance(place, last[index]);
                intruders.push(if came(i, here) > came(j, there) { i } else { j });
            }
        }
    }
    intruders
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Estimate;

    use super::*;

    #[test]
    fn the_one_that_came_from_farther_is_the_intruder() {
        let at = |x: f64| {
            let estimate = |value| Estimate::new(value, 0.01);
            Ok(Position {
                x_px: estimate(x),
                y_px: estimate(50.0),
                theta_rad: None,
                zncc: 0.99,
                iterations: 3,
            })
        };
        let subset = |x_px| Subset::new("", x_px, 50.0, 10, 10);
        let track =
            |xs: [f64; 4]| Track { name: String::new(), positions: xs.map(at).to_vec(), still_share: None };
        let tracks = vec![track([40.0, 41.0, 100.5, 102.0]), track([100.0, 100.0, 101.0, 102.0])];
        let subsets = [subset(40.0), subset(100.0)];
        let judged = without_collisions(tracks, &subsets, 0, &Settings::default());
        let is_ok = |track: &Track| track.positions.iter().map(Result::is_ok).collect::<Vec<_>>();
        assert_eq!(is_ok(&judged[0]), [true, true, false, false]);
        assert_eq!(is_ok(&judged[1]), [true; 4]);
    }
}
