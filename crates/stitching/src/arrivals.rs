//! Where an alignment starts from: when the motion arrives in each recording.
//!
//! Drives and triggers are found by steps that take each body's motion for a straight line over a trigger's change. From triggers that differ by more
//! than a wave takes to pass a body, such steps lead anywhere.

use chainwave_measurement::{Estimate, median};
use nalgebra::{DMatrix, DVector};

use crate::rest::Displacement;

/// Share of the least way that a body goes in any recording, at which it has arrived.
const SIGNIFICANCE_LEVEL: f64 = 0.5;
/// Of the ways that a body goes in its recordings, one of less than this share of the middle one is a recording that ended before.
const LEAST_WAY: f64 = 0.5;
/// Frames by which recordings differ at least where they start from their arrivals: closer ones come together by themselves, along the same way as ever.
const FRAMES_APART: f64 = 3.0;
/// Weight of zero beside that of an arrival: recordings that no body ties to the others stay about it.
const OF_ZERO: f64 = 1e-6;

/// How much later the motion comes in each recording than in all of them, in seconds; zero for all where none is far off.
pub(crate) fn starting_offsets_s(
    displacements: &[Vec<Displacement>],
    times_s: &[&[f64]],
    frame_interval_s: f64,
) -> Vec<f64> {
    let found = offsets_s(&arrivals_s(displacements, times_s), displacements.len());
    match found
        .filter(|offsets_s| offsets_s.iter().any(|offset_s| offset_s.abs() > FRAMES_APART * frame_interval_s))
    {
        Some(offsets_s) => offsets_s,
        None => vec![0.0; displacements.len()],
    }
}

/// When a body arrives in each of some recordings, by their numbers.
type Arrivals = Vec<(usize, f64)>;

/// The arrivals of each body that two recordings or more saw arrive.
fn arrivals_s(displacements: &[Vec<Displacement>], times_s: &[&[f64]]) -> Vec<Arrivals> {
    let n_rows = displacements.iter().flatten().map(|one| one.row + 1).max().unwrap_or(0);
    let of_row = |row: usize| {
        let own = displacements.iter().enumerate().filter_map(|(recording, all)| {
            let samples = &all.iter().find(|one| one.row == row)?.samples;
            let way_m = samples.iter().flatten().map(|x| x.value.abs()).fold(0.0, f64::max);
            Some((recording, samples, way_m))
        });
        let own: Vec<_> = own.collect();
        let ways_m = own.iter().map(|(_, _, way_m)| *way_m).collect();
        let least_m = LEAST_WAY * median(ways_m).unwrap_or(0.0);
        let went = || own.iter().filter(|(_, _, way_m)| *way_m >= least_m);
        let level_m = SIGNIFICANCE_LEVEL * went().map(|(_, _, way_m)| *way_m).fold(f64::INFINITY, f64::min);
        let arrival = |(recording, samples, _): &(usize, &Vec<Option<_>>, f64)| {
            Some((*recording, crossing_s(samples, times_s[*recording], level_m)?))
        };
        went().filter_map(arrival).collect::<Arrivals>()
    };
    (0..n_rows).map(of_row).filter(|arrivals| arrivals.len() > 1).collect()
}

/// When a displacement first passes a level, between the frames on either side.
fn crossing_s(samples: &[Option<Estimate>], times_s: &[f64], level_m: f64) -> Option<f64> {
    let mut before: Option<(f64, f64)> = None;
    for (sample, time_s) in samples.iter().zip(times_s) {
        let Some(x_m) = sample.map(|x| x.value.abs()) else { continue };
        if x_m >= level_m {
            let (x_before_m, before_s) = before?;
            return Some(before_s + (time_s - before_s) * (level_m - x_before_m) / (x_m - x_before_m));
        }
        before = Some((x_m, *time_s));
    }
    None
}

/// Least squares for `arrival = of the body + of the recording`, the body's own taken out.
fn offsets_s(of_bodies: &[Arrivals], n_recordings: usize) -> Option<Vec<f64>> {
    let mut normal = DMatrix::from_diagonal_element(n_recordings, n_recordings, OF_ZERO);
    let mut right = DVector::zeros(n_recordings);
    for arrivals in of_bodies {
        let n = arrivals.len() as f64;
        let mean_s = arrivals.iter().map(|(_, time_s)| time_s).sum::<f64>() / n;
        for (one, time_s) in arrivals {
            right[*one] += time_s - mean_s;
            normal[(*one, *one)] += 1.0;
            for (other, _) in arrivals {
                normal[(*one, *other)] -= n.recip();
            }
        }
    }
    Some(normal.cholesky()?.solve(&right).as_slice().to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    const INTERVAL_S: f64 = 4e-5;

    /// Bodies that go 1 mm in 20 frames, each 10 frames after the one before, as a recording sees them whose trigger leads by so much.
    fn seen(rows: std::ops::Range<usize>, lead_s: f64, n_frames: usize) -> Vec<Displacement> {
        let x_m = |row: usize, k: usize| {
            let since = (k as f64 - 60.0 - 10.0 * row as f64) - lead_s / INTERVAL_S;
            1e-3 * (since / 20.0).clamp(0.0, 1.0)
        };
        let samples = |row| (0..n_frames).map(|k| Some(Estimate::new(x_m(row, k), 1e-6))).collect();
        rows.map(|row| Displacement { row, samples: samples(row), rest_sigma_m: 0.0 }).collect()
    }

    fn found(recordings: &[(std::ops::Range<usize>, f64, usize)]) -> Vec<f64> {
        let displacements: Vec<_> =
            recordings.iter().map(|(rows, lead_s, n)| seen(rows.clone(), *lead_s, *n)).collect();
        let times_s: Vec<f64> = (0..200).map(|k| INTERVAL_S * f64::from(k)).collect();
        let times_s: Vec<&[f64]> = recordings.iter().map(|(_, _, n)| &times_s[..*n]).collect();
        starting_offsets_s(&displacements, &times_s, INTERVAL_S)
    }

    #[test]
    fn a_view_that_is_triggered_lead_starts_late_through_the_body_that_it_shares() {
        let offsets_s = found(&[(0..4, 0.0, 200), (0..4, 0.0, 200), (3..7, 1e-3, 200), (3..7, 1e-3, 200)]);
        // A body moves evenly while it passes its level, so that each arrival is exact.
        for (offset_s, expected_s) in offsets_s.iter().zip([-5e-4, -5e-4, 5e-4, 5e-4]) {
            assert!((offset_s - expected_s).abs() < 1e-8, "{offsets_s:?}");
        }
    }

    #[test]
    fn near_ones_start_alike_and_what_ended_before_says_nothing() {
        assert_eq!(found(&[(0..4, 0.0, 200), (0..4, 1e-4, 200)]), [0.0; 2]);
        // The third ends when body 1 has gone a twentieth of its way, and none else.
        let offsets_s = found(&[(0..2, 0.0, 200), (0..2, 4e-4, 200), (0..2, 0.0, 62)]);
        assert!(
            (offsets_s[1] - offsets_s[0] - 4e-4).abs() < 1e-8 && offsets_s[2].abs() < 1e-8,
            "{offsets_s:?}"
        );
    }
}
