//! From pixels to metres: the scale of the picture and its direction along the chain, each with its uncertainty.
//!
//! A calibration is applied to coordinates, never to images: resampling would blur what is tracked. Its error is common to
//! everything that is measured with it, so that it stays apart from the error of a single position.

use chainwave_measurement::Estimate;

use crate::CameraError;

/// A point whose number along a row of equally spaced ones is known, such as a body of the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// Number along the row; numbers may be left out.
    pub number: i32,
    /// Column of the point, in pixels.
    pub x_px: f64,
    /// Row of the point, in pixels.
    pub y_px: f64,
}

/// How coordinates in the picture become positions along one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// Scale: metres in a pixel.
    pub m_per_px: Estimate,
    /// The point of the picture that has position 0: column and row, in pixels.
    pub origin_px: [f64; 2],
    /// Unit vector in the picture (to the right, down) along which positions increase.
    pub axis: [f64; 2],
    /// Root mean square distance of the marks from where an equally spaced straight row would have them, in pixels; 0 where
    /// nothing was left over to tell.
    pub residual_px: f64,
}

impl Calibration {
    /// The scale that the user states, along the picture's rows.
    ///
    /// # Errors
    /// [`CameraError::Calibration`] unless the scale is above 0.
    pub fn from_scale(m_per_px: Estimate) -> Result<Self, CameraError> {
        check_length("scale in metres a pixel", m_per_px)?;
        Ok(Self { m_per_px, origin_px: [0.0; 2], axis: [1.0, 0.0], residual_px: 0.0 })
    }

    /// The scale from marks at a known pitch, in metres, by a least-squares line through them in the order of their
    /// numbers; the first mark lies at 0.
    ///
    /// `sigma_px` is the standard uncertainty of a mark's place in the picture. Where the marks scatter more than that (they were
    /// not made, or not glued, at equal distances), their scatter counts instead.
    ///
    /// # Errors
    /// [`CameraError::Calibration`] for fewer than two numbers, marks all in one place, or lengths that are none.
    pub fn from_pitch(marks: &[Mark], sigma_px: f64, pitch_m: Estimate) -> Result<Self, CameraError> {
        check_length("pitch in metres", pitch_m)?;
        check_sigma(sigma_px)?;
        let row = Row::through(marks)?;
        let pitch_px = row.step[0].hypot(row.step[1]);
        if !(pitch_px.is_finite() && pitch_px > 0.0) {
            return Err(refusal("distance of neighbouring marks", "more than 0 px", pitch_px));
        }
        let axis = row.step.map(|step| step / pitch_px);
        let left_over = |mark: &Mark| {
            let expected = row.place(mark.number);
            [mark.x_px - expected[0], mark.y_px - expected[1]]
        };
        let n_free = marks.len() as f64 - 2.0;
        let along_squares: f64 = marks.iter().map(|mark| dot(left_over(mark), axis).powi(2)).sum();
        let scatter_px = if n_free > 0.0 { (along_squares / n_free).sqrt() } else { 0.0 };
        let squares: f64 = marks.iter().map(left_over).map(|rest| dot(rest, rest)).sum();
        let pitch_px = Estimate::new(pitch_px, scatter_px.max(sigma_px) / row.leverage.sqrt());
        Ok(Self {
            m_per_px: ratio(pitch_m, pitch_px),
            origin_px: row.place(row.first),
            axis,
            residual_px: (squares / marks.len() as f64).sqrt(),
        })
    }

    /// The scale from the two ends of a ruler or of any known length, which lie at 0 and at that length.
    ///
    /// `sigma_px` is the standard uncertainty of an end's place in the picture, in each direction.
    ///
    /// # Errors
    /// [`CameraError::Calibration`] for ends in one place or lengths that are none.
    pub fn from_ruler(
        ends_px: [[f64; 2]; 2],
        sigma_px: f64,
        length_m: Estimate,
    ) -> Result<Self, CameraError> {
        let [from, to] = ends_px;
        let mark = |number, [x_px, y_px]: [f64; 2]| Mark { number, x_px, y_px };
        Self::from_pitch(&[mark(0, from), mark(1, to)], sigma_px, length_m)
    }

    /// Position along the axis of a point of the picture, in metres. The first estimate holds the error of the point
    /// alone, which other points do not share; the second holds that of the scale too.
    pub fn position_m(&self, x_px: Estimate, y_px: Estimate) -> (Estimate, Estimate) {
        let [ax, ay] = self.axis;
        let along_px = dot([x_px.value - self.origin_px[0], y_px.value - self.origin_px[1]], self.axis);
        self.length_m(Estimate::new(along_px, (ax * x_px.sigma).hypot(ay * y_px.sigma)))
    }

    /// A length or displacement of the picture, in metres: without and with the error of the scale, as in
    /// [`Calibration::position_m`].
    pub fn length_m(&self, length_px: Estimate) -> (Estimate, Estimate) {
        let alone = length_px.scaled(self.m_per_px.value);
        let total = alone.sigma.hypot(length_px.value * self.m_per_px.sigma);
        (alone, Estimate::new(alone.value, total))
    }
}

/// A straight row of equally spaced points.
struct Row {
    centre: [f64; 2],
    mean_number: f64,
    /// From one number to the next, in pixels.
    step: [f64; 2],
    /// Sum of squares of the numbers about their mean.
    leverage: f64,
    first: i32,
}

impl Row {
    fn through(marks: &[Mark]) -> Result<Self, CameraError> {
        let n = marks.len() as f64;
        let mean = |value: fn(&Mark) -> f64| marks.iter().map(value).sum::<f64>() / n;
        let mean_number = mean(|mark| mark.number.into());
        let centre = [mean(|mark| mark.x_px), mean(|mark| mark.y_px)];
        let about = |mark: &Mark| f64::from(mark.number) - mean_number;
        let leverage: f64 = marks.iter().map(|mark| about(mark).powi(2)).sum();
        let first = marks.iter().map(|mark| mark.number).min();
        let (Some(first), true) = (first, leverage > 0.0) else {
            return Err(refusal("marks of different numbers", "2 or more", n.min(1.0)));
        };
        let slope = |value: fn(&Mark) -> f64| {
            marks.iter().map(|mark| about(mark) * value(mark)).sum::<f64>() / leverage
        };
        let step = [slope(|mark| mark.x_px), slope(|mark| mark.y_px)];
        Ok(Self { centre, mean_number, step, leverage, first })
    }

    fn place(&self, number: i32) -> [f64; 2] {
        let steps = f64::from(number) - self.mean_number;
        [self.centre[0] + steps * self.step[0], self.centre[1] + steps * self.step[1]]
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// A quotient, whose relative uncertainties add in squares.
fn ratio(above: Estimate, below: Estimate) -> Estimate {
    let value = above.value / below.value;
    Estimate::new(value, value * (above.sigma / above.value).hypot(below.sigma / below.value))
}

fn check_length(what: &str, length: Estimate) -> Result<(), CameraError> {
    if !(length.value.is_finite() && length.value > 0.0) {
        return Err(refusal(what, "a finite number above 0", length.value));
    }
    check_sigma(length.sigma)
}

fn check_sigma(sigma: f64) -> Result<(), CameraError> {
    let valid = sigma.is_finite() && sigma >= 0.0;
    valid.then_some(()).ok_or_else(|| refusal("standard uncertainty", "a finite number, 0 or above", sigma))
}

fn refusal(what: &str, expected: &str, found: f64) -> CameraError {
    CameraError::Calibration { what: what.into(), expected: expected.into(), found }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marks of a row that rises to the right, 150.3 px apart, each displaced by what `error` says.
    fn row(n: i32, error: impl Fn(i32) -> f64) -> Vec<Mark> {
        let (sine, cosine) = 0.02_f64.sin_cos();
        let mark = |number: i32| {
            let along = 150.3 * f64::from(number) + error(number);
            Mark { number: number + 5, x_px: 40.0 + along * cosine, y_px: 300.0 - along * sine }
        };
        (0..n).map(mark).collect()
    }

    #[test]
    fn a_pitch_gives_scale_axis_and_origin() {
        let mut marks = row(8, |_| 0.0);
        marks.remove(3);
        let calibration = Calibration::from_pitch(&marks, 0.1, Estimate::new(0.03, 3e-5)).unwrap();
        // Rounding alone.
        assert!((calibration.m_per_px.value / (0.03 / 150.3) - 1.0).abs() < 1e-12);
        assert!((calibration.axis[0] - 0.02_f64.cos()).abs() < 1e-12);
        assert!((calibration.axis[1] + 0.02_f64.sin()).abs() < 1e-12);
        assert!((calibration.origin_px[0] - 40.0).abs() < 1e-9 && calibration.residual_px < 1e-9);
        // Numbers 0, 1, 2, 4, 5, 6, 7 have 41.7143 about their mean; 0.1 % of pitch dominates.
        let expected = (1e-3_f64).hypot(0.1 / 41.714_285_7_f64.sqrt() / 150.3);
        let relative = calibration.m_per_px.sigma / calibration.m_per_px.value;
        assert!((relative / expected - 1.0).abs() < 1e-8, "{relative}");
        let [x_px, y_px] = [marks[6].x_px, marks[6].y_px].map(|value| Estimate::new(value, 0.01));
        let (alone, total) = calibration.position_m(x_px, y_px);
        assert!((total.value - 7.0 * 0.03).abs() < 1e-12);
        assert!((alone.sigma - 0.01 * 0.03 / 150.3).abs() < 1e-12 && total.sigma > 7.0 * 3e-5);
    }

    #[test]
    fn scatter_of_the_marks_counts_when_it_is_larger_than_stated() {
        let error = |number: i32| if number % 2 == 0 { 0.4 } else { -0.4 };
        let stated =
            |sigma_px| Calibration::from_pitch(&row(9, error), sigma_px, Estimate::new(0.03, 0.0)).unwrap();
        let relative = stated(0.0).m_per_px.sigma / stated(0.0).m_per_px.value;
        // Alternating errors of 0.4 px about a mean of 0.4/9, 7 degrees of freedom, 60 about the mean number.
        let variance: f64 = (9.0 * 0.16 - 0.16 / 9.0) / 7.0 / 60.0;
        assert!((relative / (variance.sqrt() / 150.3) - 1.0).abs() < 1e-3, "{relative}");
        assert!(stated(1.0).m_per_px.sigma > 2.0 * stated(0.0).m_per_px.sigma);
        assert!((stated(0.0).residual_px - 0.4).abs() < 0.01);
    }

    #[test]
    fn a_ruler_is_two_points() {
        let length_m = Estimate::new(0.1, 1e-4);
        let calibration = Calibration::from_ruler([[10.0, 20.0], [310.0, 420.0]], 0.5, length_m).unwrap();
        assert!((calibration.m_per_px.value - 2e-4).abs() < 1e-18 && calibration.residual_px < 1e-9);
        // Both ends: 0.5 px times the square root of 2 of 500 px.
        let expected = (1e-3_f64).hypot(0.5 * 2_f64.sqrt() / 500.0);
        assert!((calibration.m_per_px.sigma / 2e-4 / expected - 1.0).abs() < 1e-12);
        assert!((calibration.axis[0] - 0.6).abs() < 1e-15 && (calibration.axis[1] - 0.8).abs() < 1e-15);
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
