//! The way of matching that a user asks for: a method by name, or an accuracy that one is chosen by.

use chainwave_correlation::{Interpolation, Method, ReferenceFrames, Settings, ShapeChoice, cheapest_within};
use chainwave_measurement::{Recording, Subset};

use crate::error::Error;

/// A method, or the accuracy that one is chosen by.
#[derive(Debug, Clone, Copy)]
pub enum MethodChoice {
    /// This method.
    Method(Method),
    /// The cheapest method with such an error.
    Accuracy {
        /// Largest root mean square error, in pixels.
        error_px: f64,
        /// The shape function, where it is named.
        shape: Option<ShapeChoice>,
    },
}

/// What a user names of the way of matching, and leaves open.
#[derive(Debug, Clone, Copy, Default)]
pub struct NamedMatching {
    /// A rung of the ladder.
    pub method: Option<Method>,
    /// Largest root mean square error, in pixels.
    pub accuracy_px: Option<f64>,
    /// The shape function.
    pub shape: Option<ShapeChoice>,
    /// The interpolation of the deformed image.
    pub interpolation: Option<Interpolation>,
}

impl NamedMatching {
    /// A rung of the ladder alone; an accuracy, with or without a shape function; or a shape function and an interpolation of the Gauss-Newton
    /// method, each the usual one where it is left open.
    ///
    /// # Errors
    /// An accuracy that is no positive number, and names that exclude each other.
    pub fn choice(self) -> Result<MethodChoice, Error> {
        let Self { method, accuracy_px, shape, interpolation } = self;
        let excluded = |name: &str, others: &str| {
            Err(Error::Value(format!("{name}: expected no {others} beside it, found both")))
        };
        if let Some(method) = method {
            return match (accuracy_px, shape, interpolation) {
                (None, None, None) => Ok(MethodChoice::Method(method)),
                _ => excluded("method", "accuracy, shape or interpolation"),
            };
        }
        if let Some(error_px) = accuracy_px {
            if interpolation.is_some() {
                return excluded("accuracy", "interpolation");
            }
            if error_px <= 0.0 || !error_px.is_finite() {
                let wrong = format!("accuracy {error_px}: expected a positive number of pixels");
                return Err(Error::Value(wrong));
            }
            return Ok(MethodChoice::Accuracy { error_px, shape });
        }
        let usual = Settings::default();
        Ok(MethodChoice::Method(Method::IcGn {
            interpolation: interpolation.unwrap_or(usual.interpolation),
            shape: shape.unwrap_or(ShapeChoice::Named(usual.shape)),
        }))
    }
}

impl MethodChoice {
    /// The error that is aimed at, in pixels; `None` where a method is named.
    pub fn accuracy_px(&self) -> Option<f64> {
        match self {
            Self::Method(_) => None,
            Self::Accuracy { error_px, .. } => Some(*error_px),
        }
    }

    /// The method for subsets of a recording.
    ///
    /// # Errors
    /// No method that keeps the accuracy, and pixels that cannot be read.
    pub fn method(
        &self,
        recording: &dyn Recording,
        subsets: &[Subset],
        reference: &ReferenceFrames,
    ) -> Result<Method, Error> {
        match self {
            Self::Method(method) => Ok(*method),
            Self::Accuracy { error_px, shape } => {
                let usual = Settings::default();
                let offered = Method::with_shape(shape.unwrap_or(ShapeChoice::Named(usual.shape)));
                let settled = cheapest_within(*error_px, &offered, recording, subsets, reference, &usual)?;
                Ok(settled)
            }
        }
    }
}

/// Noise that a subset of no given size may leave, where no accuracy is asked for, in pixels.
pub const USUAL_ERROR_PX: f64 = 0.01;
/// Share of an accuracy that noise may have, which leaves 0.6 of it, in the square, to what the method adds.
const NOISE_SHARE: f64 = 0.8;

/// Noise that a subset of no given size may leave, in pixels, for an accuracy or none.
pub(crate) fn noise_px(accuracy_px: Option<f64>) -> f64 {
    accuracy_px.map_or(USUAL_ERROR_PX, |accuracy_px| NOISE_SHARE * accuracy_px)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPEN: NamedMatching =
        NamedMatching { method: None, accuracy_px: None, shape: None, interpolation: None };

    fn told(named: NamedMatching) -> String {
        match named.choice() {
            Ok(MethodChoice::Method(method)) => method.to_string(),
            Ok(MethodChoice::Accuracy { error_px, .. }) => format!("{error_px} px"),
            Err(wrong) => wrong.to_string(),
        }
    }

    #[test]
    fn names_choose_a_method() {
        let Settings { interpolation, shape, .. } = Settings::default();
        let method = "icgn-linear-affine".parse().ok();
        let (rigid, cubic) = ("rigid".parse().ok(), Some(Interpolation::Cubic));
        assert_eq!(told(OPEN), format!("icgn-{interpolation}-{shape}"));
        assert_eq!(told(NamedMatching { shape: rigid, interpolation: cubic, ..OPEN }), "icgn-cubic-rigid");
        assert_eq!(told(NamedMatching { method, ..OPEN }), "icgn-linear-affine");
        assert_eq!(told(NamedMatching { accuracy_px: Some(0.02), shape: rigid, ..OPEN }), "0.02 px");
    }

    #[test]
    fn names_that_exclude_each_other_are_refused() {
        let accuracy_px = Some(0.1);
        let both = NamedMatching { method: Some(Method::default()), accuracy_px, ..OPEN };
        assert!(told(both).contains("method: expected no accuracy"));
        let both = NamedMatching { accuracy_px, interpolation: Some(Interpolation::Cubic), ..OPEN };
        assert!(told(both).contains("accuracy: expected no interpolation"));
        for wrong in [-0.1, f64::NAN, f64::INFINITY] {
            let named = NamedMatching { accuracy_px: Some(wrong), ..OPEN };
            assert!(told(named).contains("a positive number of pixels"));
        }
    }
}
