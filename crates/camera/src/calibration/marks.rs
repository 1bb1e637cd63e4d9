//! Calibration by a row of marks at a known pitch: a straight line through them.

use chainwave_measurement::Estimate;

use super::checks::{check_length, check_sigma, refusal};
use super::lens::Lens;
use super::plane::{PlaneMap, dot, scaled_plane};
use super::{Calibration, Mark, Source};
use crate::error::CameraError;

impl Calibration {
    /// The scale from marks along a row of a known pitch, in metres, by a least-squares line through them in the order of their
    /// places; the first mark lies at 0 and the row along x.
    ///
    /// `sigma_px` is the standard uncertainty of a mark's place in the picture. Where the marks scatter more than that (they were
    /// not made, or not glued, where they are said to be), their scatter counts instead.
    ///
    /// # Errors
    /// [`CameraError::Calibration`] for fewer than two places, marks all in one place, or lengths that are none.
    pub fn from_pitch(marks: &[Mark], sigma_px: f64, pitch_m: Estimate) -> Result<Self, CameraError> {
        check_length("pitch in metres", pitch_m)?;
        check_sigma(sigma_px)?;
        let row = MarkRow::through(marks)?;
        let pitch_px = row.step[0].hypot(row.step[1]);
        if !(pitch_px.is_finite() && pitch_px > 0.0) {
            return Err(refusal("distance of neighbouring marks", "more than 0 px", pitch_px));
        }
        let axis = row.step.map(|step| step / pitch_px);
        let left_over = |mark: &Mark| {
            let expected = row.at_px(mark.place);
            [mark.x_px - expected[0], mark.y_px - expected[1]]
        };
        let n_free = marks.len() as f64 - 2.0;
        let along_squares: f64 = marks.iter().map(|mark| dot(left_over(mark), axis).powi(2)).sum();
        let scatter_px = if n_free > 0.0 { (along_squares / n_free).sqrt() } else { 0.0 };
        let squares: f64 = marks.iter().map(left_over).map(|rest| dot(rest, rest)).sum();
        let step_sigma_px = scatter_px.max(sigma_px) / row.leverage.sqrt();
        let plane_from_image = scaled_plane(pitch_m.value / pitch_px, axis, row.at_px(row.first));
        let map = PlaneMap { lens: Lens::ideal(), plane_from_image };
        let residual_px = (squares / marks.len() as f64).sqrt();
        Ok(Self { residual_px, ..Self::exact(map) }
            .with_scale_error(Source::Points, step_sigma_px / pitch_px)
            .with_scale_error(Source::Length, pitch_m.sigma / pitch_m.value))
    }
}

/// A straight row of points.
struct MarkRow {
    centre: [f64; 2],
    mean_place: f64,
    /// A pitch along the row, in pixels.
    step: [f64; 2],
    /// Sum of squares of the places about their mean.
    leverage: f64,
    first: f64,
}

impl MarkRow {
    fn through(marks: &[Mark]) -> Result<Self, CameraError> {
        let n = marks.len() as f64;
        let mean = |value: fn(&Mark) -> f64| marks.iter().map(value).sum::<f64>() / n;
        let mean_place = mean(|mark| mark.place);
        let centre = [mean(|mark| mark.x_px), mean(|mark| mark.y_px)];
        let about = |mark: &Mark| mark.place - mean_place;
        let leverage: f64 = marks.iter().map(|mark| about(mark).powi(2)).sum();
        if leverage.is_nan() || leverage <= 0.0 {
            return Err(refusal("marks at different places of the row", "2 or more", n.min(1.0)));
        }
        let first = marks.iter().map(|mark| mark.place).fold(f64::INFINITY, f64::min);
        let slope = |value: fn(&Mark) -> f64| {
            marks.iter().map(|mark| about(mark) * value(mark)).sum::<f64>() / leverage
        };
        let step = [slope(|mark| mark.x_px), slope(|mark| mark.y_px)];
        Ok(Self { centre, mean_place, step, leverage, first })
    }

    fn at_px(&self, place: f64) -> [f64; 2] {
        let steps = place - self.mean_place;
        [self.centre[0] + steps * self.step[0], self.centre[1] + steps * self.step[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marks of a row that rises to the right, 150.3 px apart, each displaced by what `error` says.
    fn row(n: i32, error: impl Fn(i32) -> f64) -> Vec<Mark> {
        let (sine, cosine) = 0.02_f64.sin_cos();
        let mark = |number: i32| {
            let along = 150.3 * f64::from(number) + error(number);
            Mark { place: f64::from(number + 5), x_px: 40.0 + along * cosine, y_px: 300.0 - along * sine }
        };
        (0..n).map(mark).collect()
    }

    #[test]
    fn a_pitch_gives_scale_axis_and_origin() {
        let mut marks = row(8, |_| 0.0);
        marks.remove(3);
        let calibration = Calibration::from_pitch(&marks, 0.1, Estimate::new(0.03, 3e-5)).unwrap();
        for mark in &marks {
            let [x_m, y_m] = calibration.map.position_m([mark.x_px, mark.y_px]);
            // Rounding alone.
            assert!((x_m - 0.03 * (mark.place - 5.0)).abs() < 1e-12 && y_m.abs() < 1e-12);
        }
        assert!(calibration.residual_px < 1e-9);
        // Numbers 0, 1, 2, 4, 5, 6, 7 have 41.7143 about their mean; 0.1 % of pitch dominates.
        let expected = (1e-3_f64).hypot(0.1 / 41.714_285_7_f64.sqrt() / 150.3);
        let scale = calibration.m_per_px([600.0, 300.0]);
        assert!((scale.value / (0.03 / 150.3) - 1.0).abs() < 1e-12);
        assert!((scale.sigma / scale.value / expected - 1.0).abs() < 1e-8, "{scale:?}");
        let (x_px, y_px) = (Estimate::new(marks[6].x_px, 0.01), Estimate::new(marks[6].y_px, 0.01));
        assert!((calibration.map.position_of(x_px, y_px).sigma - 0.01 * 0.03 / 150.3).abs() < 1e-12);
    }

    #[test]
    fn a_chain_that_goes_to_the_left_has_the_same_scale() {
        let pitch_m = Estimate::new(0.03, 3e-5);
        let to_the_left: Vec<Mark> =
            row(8, |_| 0.0).into_iter().map(|mark| Mark { x_px: 1200.0 - mark.x_px, ..mark }).collect();
        let [there, here] = [row(8, |_| 0.0), to_the_left]
            .map(|marks| Calibration::from_pitch(&marks, 0.1, pitch_m).unwrap().m_per_px([600.0, 300.0]));
        // Rounding alone.
        assert!((there.value - here.value).abs() < 1e-15 && (there.sigma - here.sigma).abs() < 1e-15);
    }

    #[test]
    fn scatter_of_the_marks_counts_when_it_is_larger_than_stated() {
        let error = |number: i32| if number % 2 == 0 { 0.4 } else { -0.4 };
        let stated =
            |sigma_px| Calibration::from_pitch(&row(9, error), sigma_px, Estimate::new(0.03, 0.0)).unwrap();
        let relative = |sigma_px| {
            let scale = stated(sigma_px).m_per_px([0.0, 0.0]);
            scale.sigma / scale.value
        };
        // Alternating errors of 0.4 px about a mean of 0.4/9, 7 degrees of freedom, 60 about the mean number.
        let variance: f64 = (9.0 * 0.16 - 0.16 / 9.0) / 7.0 / 60.0;
        assert!((relative(0.0) / (variance.sqrt() / 150.3) - 1.0).abs() < 1e-3);
        assert!(relative(1.0) > 2.0 * relative(0.0));
        assert!((stated(0.0).residual_px - 0.4).abs() < 0.01);
    }

    #[test]
    fn what_is_no_length_is_refused() {
        let pitch_m = Estimate::new(0.03, 0.0);
        let one = row(1, |_| 0.0);
        for (marks, sigma_px, pitch_m) in [
            (one.clone(), 0.1, pitch_m),
            ([one.clone(), one].concat(), 0.1, pitch_m),
            (Vec::new(), 0.1, pitch_m),
            (row(3, |number| -150.3 * f64::from(number)), 0.1, pitch_m),
            (row(3, |_| f64::NAN), 0.1, pitch_m),
            (row(3, |_| 0.0), -0.1, pitch_m),
            (row(3, |_| 0.0), 0.1, Estimate::new(0.0, 0.0)),
            (row(3, |_| 0.0), 0.1, Estimate::new(0.03, f64::NAN)),
        ] {
            let outcome = Calibration::from_pitch(&marks, sigma_px, pitch_m);
            assert!(matches!(outcome, Err(CameraError::Calibration { .. })), "{outcome:?}");
        }
        assert!(Calibration::from_scale(Estimate::new(-1.0, 0.0)).is_err());
    }
}
