//! What the rounding of grey values leaves in pictures without noise: an error that the trials of a view share.
//!
//! Noise of a third of a step of the grey values makes their rounding as random as itself. With less, all pictures of a body that rests are rounded
//! alike, and so is their mean, by which it is found once it moves: all readings of it then are off by one error, and those of every trial of the
//! view, in which it rests at the same place. It is half of the variance of such a reading; the other half is the own picture's.

use chainwave_measurement::{BodyTrack, Observation, SharedReadingError, TrackDeviation, median};

/// Readings at rest that scatter by less than this of what is stated of moving ones are of pictures without noise.
const WITHOUT_NOISE: f64 = 0.02;
/// How far a body moves, in pixels, until its picture is rounded otherwise: the steps of texture are some hundred a pixel.
const OTHERWISE_PX: f64 = 0.05;

/// One error of each body in each view whose pictures have no noise; bodies rest until `rest_until_s`.
pub(crate) fn rounding_errors(
    observations: &[Observation],
    rest_until_s: f64,
    m_per_px: f64,
) -> Vec<SharedReadingError> {
    let mut errors: Vec<SharedReadingError> = Vec::new();
    for observation in observations {
        for track in &observation.bodies {
            let Some(error_m) = of_track(observation, track, rest_until_s, m_per_px) else { continue };
            let source = format!("rounding of body {} in view {}", track.body, observation.view).into();
            let of_track =
                TrackDeviation { recording: observation.recording.clone(), body: track.body, error_m };
            match errors.iter_mut().find(|one| one.source == source) {
                Some(known) => known.of_tracks.push(of_track),
                None => errors.push(SharedReadingError { source, of_tracks: vec![of_track] }),
            }
        }
    }
    errors
}

/// The error of a body in one recording, frame by frame in metres; `None` where there is noise.
fn of_track(
    observation: &Observation,
    track: &BodyTrack,
    rest_until_s: f64,
    m_per_px: f64,
) -> Option<Vec<f64>> {
    let origin_m = observation.mean_before_m(track, rest_until_s)?;
    let away_px = |x_m: f64| (x_m - origin_m).abs() / m_per_px;
    let moved = track.position_m.iter().flatten().filter(|x| away_px(x.value) > 1.0);
    let sigma_m = median(moved.map(|x| x.sigma).collect())?;
    let farthest_m = observation
        .readings_before(track, rest_until_s)
        .map(|x| (x.value - origin_m).abs())
        .fold(0.0, f64::max);
    let of_frame = |x_m: f64| sigma_m / 2.0_f64.sqrt() * (away_px(x_m) / OTHERWISE_PX).min(1.0);
    let error_m = track.position_m.iter().map(|x| x.map_or(0.0, |x| of_frame(x.value)));
    (farthest_m < WITHOUT_NOISE * sigma_m).then(|| error_m.collect())
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Estimate;

    use super::*;

    /// A body that rests for ten frames and then moves a pixel a frame, read to a thousandth of a pixel.
    fn seen(recording: &str, at_rest_px: impl Fn(usize) -> f64) -> Observation {
        let place = |frame: usize| if frame < 10 { at_rest_px(frame) } else { (frame - 9) as f64 };
        let position_m = (0..30).map(|frame| Some(Estimate::new(1e-4 * place(frame), 1e-7))).collect();
        let bodies = vec![BodyTrack { body: 2, position_m }];
        let times_s = (0..30).map(|frame| f64::from(frame - 10)).collect();
        Observation { recording: recording.into(), view: 3, trial: 1, times_s, bodies }
    }

    #[test]
    fn trials_without_noise_share_what_their_reference_is_off_by() {
        let errors = rounding_errors(&[seen("a", |_| 0.0), seen("b", |_| 0.0)], 0.0, 1e-4);
        let [error] = errors.as_slice() else { panic!("one body in one view: {}", errors.len()) };
        assert_eq!(error.of_tracks.len(), 2);
        let own_m = &error.of_tracks[1].error_m;
        assert!(own_m[..10].iter().all(|own_m| *own_m == 0.0), "at rest it cancels");
        assert!(own_m[10..].iter().all(|own_m| (own_m / 1e-7 - 0.5_f64.sqrt()).abs() < 1e-12));
    }

    #[test]
    fn noise_makes_it_random() {
        let noisy = seen("a", |frame| 1e-4 * (frame as f64 * 2.4).sin());
        assert!(rounding_errors(&[noisy], 0.0, 1e-4).is_empty());
    }
}
