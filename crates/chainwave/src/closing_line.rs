//! The closing line of `track` and `correlate`: how many readings hold, how well, and where it is worst.

use chainwave_measurement::{Lost, Position, median};
use serde_json::{Value, json};

use crate::error::Error;

/// What became of the readings of one point.
pub(crate) struct PointReadings {
    name: String,
    n_readings: usize,
    /// Why the others do not hold.
    lost: Vec<Lost>,
    /// Of those that hold, the larger standard uncertainty along either axis.
    sigmas_px: Vec<f64>,
}

impl PointReadings {
    /// From each reading's position along x and y, where it holds.
    pub(crate) fn new<'a>(
        name: String,
        readings: impl Iterator<Item = Result<&'a Position, &'a Lost>>,
    ) -> Self {
        let mut of_point = Self { name, n_readings: 0, lost: Vec::new(), sigmas_px: Vec::new() };
        for reading in readings {
            of_point.n_readings += 1;
            match reading {
                Ok(found) => of_point.sigmas_px.push(found.x_px.sigma.max(found.y_px.sigma)),
                Err(reason) => of_point.lost.push(*reason),
            }
        }
        of_point
    }

    /// Share of the readings that are lost, then the median sigma: whatever is larger is worse.
    fn badness(&self) -> (f64, f64) {
        let lost = 1.0 - self.sigmas_px.len() as f64 / self.n_readings.max(1) as f64;
        (lost, median(self.sigmas_px.clone()).unwrap_or(f64::INFINITY))
    }
}

/// The closing line: readings that hold, their median sigma, and the worst point. Of a field, whose points have one reading each, that is
/// the one of the largest sigma; `more_lost` are the reasons of readings beside these. Behind that stands how often each reason occurs.
pub(crate) fn closing_line(points: &[PointReadings], more_lost: &[Lost]) -> String {
    let all: Vec<f64> = points.iter().flat_map(|point| &point.sigmas_px).copied().collect();
    let n_readings = more_lost.len() + points.iter().map(|point| point.n_readings).sum::<usize>();
    let mut line = format!("{} of {n_readings} readings ok", all.len());
    let worst = points.iter().max_by(|a, b| {
        let (a, b) = (a.badness(), b.badness());
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    if let (Some(sigma), Some(worst)) = (median(all), worst) {
        line.push_str(&format!(", median sigma {sigma:.4} px, worst point {}: ", worst.name));
        let (n_ok, n_own) = (worst.sigmas_px.len(), worst.n_readings);
        line.push_str(&match median(worst.sigmas_px.clone()) {
            Some(sigma) if n_ok < n_own => format!("{n_ok} of {n_own} ok, {sigma:.4} px"),
            Some(sigma) => format!("{sigma:.4} px"),
            None => "lost".into(),
        });
    }
    let lost: Vec<&Lost> = points.iter().flat_map(|point| &point.lost).chain(more_lost).collect();
    if !lost.is_empty() {
        line.push_str(&format!("; {} lost: {}", lost.len(), counts(&lost)));
    }
    line
}

/// How often each reason occurs.
fn counts(reasons: &[&Lost]) -> String {
    let count = |reason: &Lost| reasons.iter().filter(|found| **found == reason).count();
    let told = Lost::ALL.iter().map(|reason| (count(reason), reason.as_str())).filter(|(n, _)| *n > 0);
    told.map(|(n, reason)| format!("{n} {reason}")).collect::<Vec<_>>().join(", ")
}

/// The same as an object: readings, those that hold, and their median sigma.
pub(crate) fn closing_json(points: &[PointReadings], n_lost: usize) -> Value {
    let all: Vec<f64> = points.iter().flat_map(|point| &point.sigmas_px).copied().collect();
    let n_readings = n_lost + points.iter().map(|point| point.n_readings).sum::<usize>();
    json!({ "n_readings": n_readings, "n_ok": all.len(), "median_sigma_px": median(all) })
}

/// The error of readings that are all lost, with how often each reason occurs.
pub(crate) fn all_lost<'a>(reasons: impl Iterator<Item = &'a Lost>) -> Error {
    let reasons: Vec<&Lost> = reasons.collect();
    let count = |reason: &Lost| reasons.iter().filter(|found| **found == reason).count();
    let of_texture = [Lost::NoTexture, Lost::LowCorrelation, Lost::Ambiguous, Lost::NotConverged];
    let hint = match of_texture.iter().any(|reason| count(reason) > 0) {
        true => " (hint: do the points lie on texture, and are the subsets large enough?)",
        false => "",
    };
    Error::Argument(format!(
        "expected at least one reading that holds, found all {} lost: {}{hint}",
        reasons.len(),
        counts(&reasons)
    ))
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Estimate;

    use super::*;

    fn readings(name: &str, sigmas_px: &[Option<f64>]) -> PointReadings {
        let position = |sigma: f64| Position {
            x_px: Estimate::new(0.0, sigma),
            y_px: Estimate::new(0.0, 0.5 * sigma),
            theta_rad: None,
            zncc: 1.0,
            iterations: 2,
        };
        let found: Vec<Result<Position, Lost>> =
            sigmas_px.iter().map(|sigma| sigma.map(position).ok_or(Lost::Ambiguous)).collect();
        PointReadings::new(name.into(), found.iter().map(Result::as_ref))
    }

    #[test]
    fn the_point_that_is_lost_most_often_is_worst_and_then_that_of_the_largest_sigma() {
        let good = readings("good", &[Some(0.001), Some(0.003)]);
        let noisy = readings("noisy", &[Some(0.02)]);
        let line = closing_line(&[good, noisy], &[]);
        assert_eq!(line, "3 of 3 readings ok, median sigma 0.0030 px, worst point noisy: 0.0200 px");
        let lost = readings("lost", &[None, Some(0.002)]);
        let noisy = readings("noisy", &[Some(0.02), Some(0.02)]);
        let line = closing_line(&[noisy, lost], &[Lost::NoTexture; 3]);
        assert!(
            line.starts_with("3 of 7 readings ok")
                && line
                    .ends_with("worst point lost: 1 of 2 ok, 0.0020 px; 4 lost: 3 no_texture, 1 ambiguous"),
            "{line}"
        );
    }

    #[test]
    fn reasons_are_counted_where_nothing_holds() {
        let reasons = [Lost::NoTexture, Lost::OutOfView, Lost::NoTexture];
        let told = all_lost(reasons.iter()).to_string();
        assert!(told.contains("all 3 lost: 1 out_of_view, 2 no_texture (hint: "), "{told}");
        // Texture helps no file that cannot be read.
        let told = all_lost([Lost::Unreadable, Lost::OutOfView].iter()).to_string();
        assert!(told.ends_with("all 2 lost: 1 out_of_view, 1 unreadable"), "{told}");
    }
}
