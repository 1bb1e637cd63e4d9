//! From pixels to metres in the plane in which the chain moves, with the errors that everything measured so shares.
//!
//! A calibration is applied to coordinates, never to images: resampling would blur what is tracked. Its error is common to
//! all positions, so that it stays apart from the error of a single one: a [`Calibration`] holds its map and, for each
//! independent error, the map that an error of one standard deviation would have made of it. Whoever uses the map can repeat
//! the work with each of those; the differences are the errors, with all their correlations.

mod board_fit;
mod checks;
mod lens;
mod marks;
mod plane;

use chainwave_measurement::Estimate;

use crate::error::CameraError;
use checks::{check_length, check_sigma};
pub use lens::Lens;
pub use plane::PlaneMap;
use plane::scaled_plane;

/// A point whose place along a row is known, such as a body of the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// Place along the row, in pitches: of points that are a pitch apart, their numbers.
    pub place: f64,
    /// Column of the point, in pixels.
    pub x_px: f64,
    /// Row of the point, in pixels.
    pub y_px: f64,
}

/// How coordinates in the picture become positions, and how well that is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The best estimate.
    pub map: PlaneMap,
    /// Its independent errors.
    pub errors: Vec<MapError>,
    /// Root mean square distance of the points that were used from where the map has them, in pixels; 0 where
    /// nothing was left over to tell.
    pub residual_px: f64,
}

/// One independent error of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct MapError {
    /// What is uncertain.
    pub source: Source,
    /// The map with an error of one standard deviation.
    pub map: PlaneMap,
}

/// Where an error of a calibration comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The length or scale that is taken as known.
    Length,
    /// The places in the picture of the points that are used.
    Points,
}

impl Calibration {
    /// The scale that the user states, with x along the picture's rows.
    ///
    /// # Errors
    /// [`CameraError::Calibration`] unless the scale is above 0.
    pub fn from_scale(m_per_px: Estimate) -> Result<Self, CameraError> {
        check_length("scale in metres a pixel", m_per_px)?;
        let plane_from_image = scaled_plane(m_per_px.value, [1.0, 0.0], [0.0; 2]);
        let map = PlaneMap { lens: Lens::ideal(), plane_from_image };
        Ok(Self::exact(map).with_scale_error(Source::Length, m_per_px.sigma / m_per_px.value))
    }

    /// The scale from the two ends of a ruler or of any known length, with x along the picture's rows.
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
        check_length("length of the ruler in metres", length_m)?;
        check_sigma(sigma_px)?;
        let length_px = (to[0] - from[0]).hypot(to[1] - from[1]);
        check_length("length of the ruler in pixels", Estimate::new(length_px, sigma_px))?;
        let scale = Self::from_scale(Estimate::new(length_m.value / length_px, 0.0))?;
        Ok(scale
            .with_scale_error(Source::Points, std::f64::consts::SQRT_2 * sigma_px / length_px)
            .with_scale_error(Source::Length, length_m.sigma / length_m.value))
    }

    /// A map without error.
    fn exact(map: PlaneMap) -> Self {
        Self { map, errors: Vec::new(), residual_px: 0.0 }
    }

    /// Adds a relative error of the scale, unless it is 0.
    fn with_scale_error(mut self, source: Source, relative_sigma: f64) -> Self {
        if relative_sigma > 0.0 {
            let mut map = self.map;
            for row in &mut map.plane_from_image[..2] {
                row.iter_mut().for_each(|entry| *entry *= 1.0 + relative_sigma);
            }
            self.errors.push(MapError { source, map });
        }
        self
    }

    /// Metres along the chain for a pixel in its direction, at a point of the picture: above 0 whichever way the chain goes there.
    pub fn m_per_px(&self, at_px: [f64; 2]) -> Estimate {
        let along = |map: &PlaneMap| {
            let [[by_column, by_row], _] = map.m_per_px(at_px);
            by_column.hypot(by_row)
        };
        let value = along(&self.map);
        let squares: f64 = self.errors.iter().map(|error| (along(&error.map) - value).powi(2)).sum();
        Estimate::new(value, squares.sqrt())
    }
}

impl PlaneMap {
    /// Position along the chain of a point of the picture, in metres, with the error of that point alone.
    pub fn position_of(&self, x_px: Estimate, y_px: Estimate) -> Estimate {
        let at_px = [x_px.value, y_px.value];
        let [along, _] = self.m_per_px(at_px);
        Estimate::new(self.position_m(at_px)[0], (along[0] * x_px.sigma).hypot(along[1] * y_px.sigma))
    }

    /// Position across the chain of a point of the picture, in metres, with the error of that point alone: positive on the side that is
    /// down in the picture, where the chain goes to the right.
    pub fn across_of(&self, x_px: Estimate, y_px: Estimate) -> Estimate {
        let at_px = [x_px.value, y_px.value];
        let [_, across] = self.m_per_px(at_px);
        Estimate::new(self.position_m(at_px)[1], (across[0] * x_px.sigma).hypot(across[1] * y_px.sigma))
    }

    /// A rotation that a picture shows at a point, from right towards down, as a rotation in the plane of the chain, from the direction of
    /// the chain towards the one across, in radians.
    pub fn turn_of(&self, at_px: [f64; 2], theta_rad: Estimate) -> Estimate {
        let [[xx, xy], [yx, yy]] = self.m_per_px(at_px);
        Estimate::new(theta_rad.value.copysign(theta_rad.value * (xx * yy - xy * yx)), theta_rad.sigma)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ruler_is_two_points() {
        let length_m = Estimate::new(0.1, 1e-4);
        let calibration = Calibration::from_ruler([[10.0, 20.0], [310.0, 420.0]], 0.5, length_m).unwrap();
        let scale = calibration.m_per_px([200.0, 100.0]);
        // Both ends: 0.5 px times the square root of 2 of 500 px.
        let expected = (1e-3_f64).hypot(0.5 * 2_f64.sqrt() / 500.0);
        assert!((scale.value - 2e-4).abs() < 1e-18);
        assert!((scale.sigma / 2e-4 / expected - 1.0).abs() < 1e-12);
        // It may lie askew: the chain goes along the rows all the same.
        let [from, to] = [10.0, 20.0].map(|x| calibration.map.position_m([x, 77.0]));
        assert!((to[0] - from[0] - 2e-3).abs() < 1e-15 && (to[1] - from[1]).abs() < 1e-15);
        assert!(Calibration::from_ruler([[1.0, 1.0], [1.0, 1.0]], 0.5, length_m).is_err());
    }
}
