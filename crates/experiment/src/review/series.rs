//! One body in one recording, and where it was at any time.

use chainwave_measurement::{Lost, Position, median};

use super::reviewed::ReviewedRecording;

/// Share of the frames, and least number of readings, at the beginning that tell where a body rests.
const REST_SHARE: f64 = 0.05;
const LEAST_REST: usize = 5;

/// One body in one recording.
pub(super) struct Series<'a> {
    /// Place of the recording in the list.
    pub(super) recording: usize,
    pub(super) view: u32,
    pub(super) body: usize,
    pub(super) times_s: &'a [f64],
    pub(super) positions: &'a [Result<Position, Lost>],
    /// Column and row where it rests.
    rest_px: [f64; 2],
}

impl<'a> Series<'a> {
    /// The bodies of a recording, at a place in the list.
    pub(super) fn all_of(
        recording: usize,
        one: &ReviewedRecording<'a>,
    ) -> impl Iterator<Item = Self> + use<'a> {
        let ReviewedRecording { view, tracks, .. } = *one;
        tracks.bodies.iter().map(move |body| {
            let n_rest = ((REST_SHARE * body.positions.len() as f64) as usize).max(LEAST_REST);
            let first = || body.positions.iter().flatten().take(n_rest);
            let middle = |of: fn(&Position) -> f64| median(first().map(of).collect()).unwrap_or(0.0);
            Self {
                recording,
                view,
                body: body.body,
                times_s: &tracks.times_s[..body.positions.len().min(tracks.times_s.len())],
                positions: &body.positions,
                rest_px: [middle(|at| at.x_px.value), middle(|at| at.y_px.value)],
            }
        })
    }

    pub(super) fn n_frames(&self) -> usize {
        self.times_s.len()
    }

    /// The position in a frame, where it has one.
    pub(super) fn position(&self, frame: usize) -> Option<&Position> {
        self.positions.get(frame)?.as_ref().ok()
    }

    /// Standard uncertainties of a position's column and row.
    pub(super) fn sigma_px(position: &Position) -> [f64; 2] {
        [position.x_px.sigma, position.y_px.sigma]
    }

    /// Displacement from rest in a frame, in pixels.
    pub(super) fn displacement_px(&self, frame: usize) -> Option<[f64; 2]> {
        let at = self.position(frame)?;
        Some([at.x_px.value - self.rest_px[0], at.y_px.value - self.rest_px[1]])
    }

    /// Displacement from rest at an instant, in pixels: by the cubic through the four frames around it, or the line through two; none where one
    /// of those is lost, or the recording has none.
    pub(super) fn displacement_at_px(&self, t_s: f64) -> Option<[f64; 2]> {
        let after = self.times_s.partition_point(|time_s| *time_s <= t_s);
        let before = after.checked_sub(1)?;
        if after == self.n_frames() {
            return self.displacement_px(before).filter(|_| self.times_s[before] >= t_s);
        }
        let (one, two) = (self.displacement_px(before)?, self.displacement_px(after)?);
        let w = (t_s - self.times_s[before]) / (self.times_s[after] - self.times_s[before]);
        let outer =
            before.checked_sub(1).and_then(|k| self.displacement_px(k)).zip(self.displacement_px(after + 1));
        Some([0, 1].map(|axis| match outer {
            Some((zero, three)) => cubic([zero[axis], one[axis], two[axis], three[axis]], w),
            None => one[axis] + w * (two[axis] - one[axis]),
        }))
    }
}

/// The cubic through values at -1, 0, 1 and 2.
fn cubic(values: [f64; 4], w: f64) -> f64 {
    let weights = [
        -w * (w - 1.0) * (w - 2.0) / 6.0,
        (w + 1.0) * (w - 1.0) * (w - 2.0) / 2.0,
        -(w + 1.0) * w * (w - 2.0) / 2.0,
        (w + 1.0) * w * (w - 1.0) / 6.0,
    ];
    values.iter().zip(weights).map(|(value, weight)| weight * value).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_met_everywhere() {
        let law = |t: f64| 2.0 - t + 0.5 * t.powi(2) - 0.25 * t.powi(3);
        for w in [0.0, 0.3, 0.5, 1.0] {
            let found = cubic([-1.0, 0.0, 1.0, 2.0].map(law), w);
            assert!((found - law(w)).abs() < 1e-12, "{w}: {found}");
        }
    }
}
