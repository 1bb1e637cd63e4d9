//! The way of matching that a user asks for: a method by name, or an accuracy that one is chosen by.

use chainwave_correlation::{METHODS, Method, ReferenceFrames, Settings, ShapeChoice, cheapest_within};
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

impl MethodChoice {
    /// By what is named: a rung of the ladder alone; an accuracy in pixels, with or without a shape function; or a shape function and an
    /// interpolation of the Gauss-Newton method, each the usual one where it is left out.
    ///
    /// # Errors
    /// A name that is none, an accuracy that is no positive number, and names that exclude each other.
    pub fn named(
        method: Option<&str>,
        accuracy_px: Option<f64>,
        shape: Option<&str>,
        interpolation: Option<&str>,
    ) -> Result<Self, Error> {
        let excluded = [
            (method.is_some() && (accuracy_px.is_some() || shape.is_some() || interpolation.is_some()))
                .then_some("method"),
            (accuracy_px.is_some() && interpolation.is_some()).then_some("accuracy"),
        ];
        if let Some(name) = excluded.into_iter().flatten().next() {
            let others = if name == "method" { "accuracy, shape or interpolation" } else { "interpolation" };
            return Err(Error::Value(format!("{name}: expected no {others} beside it, found both")));
        }
        if let Some(name) = method {
            let unknown = || format!("method {name}: expected one of {}", METHODS.join(", "));
            return name.parse().map(Self::Method).map_err(|_unknown| Error::Value(unknown()));
        }
        let shape: Option<ShapeChoice> = shape.map(str::parse).transpose()?;
        if let Some(error_px) = accuracy_px {
            let positive = error_px > 0.0 && error_px.is_finite();
            let wrong = || format!("accuracy {error_px}: expected a positive number of pixels");
            return positive
                .then_some(Self::Accuracy { error_px, shape })
                .ok_or_else(|| Error::Value(wrong()));
        }
        let usual = Settings::default();
        let interpolation = interpolation.map(str::parse).transpose()?.unwrap_or(usual.interpolation);
        let shape = shape.unwrap_or(ShapeChoice::Named(usual.shape));
        Ok(Self::Method(Method::IcGn { interpolation, shape }))
    }

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

    fn told(
        method: Option<&str>,
        accuracy_px: Option<f64>,
        shape: Option<&str>,
        kernel: Option<&str>,
    ) -> String {
        match MethodChoice::named(method, accuracy_px, shape, kernel) {
            Ok(MethodChoice::Method(method)) => method.to_string(),
            Ok(MethodChoice::Accuracy { error_px, .. }) => format!("{error_px} px"),
            Err(wrong) => wrong.to_string(),
        }
    }

    #[test]
    fn names_choose_a_method() {
        let Settings { interpolation, shape, .. } = Settings::default();
        assert_eq!(told(None, None, None, None), format!("icgn-{interpolation}-{shape}"));
        assert_eq!(told(None, None, Some("rigid"), Some("cubic")), "icgn-cubic-rigid");
        assert_eq!(told(Some("icgn-linear-affine"), None, None, None), "icgn-linear-affine");
        assert_eq!(told(None, Some(0.02), Some("rigid"), None), "0.02 px");
    }

    #[test]
    fn names_that_exclude_each_other_are_refused() {
        assert!(
            told(Some("icgn-linear-affine"), Some(0.1), None, None).contains("method: expected no accuracy")
        );
        assert!(told(None, Some(0.1), None, Some("cubic")).contains("accuracy: expected no interpolation"));
        assert!(told(None, Some(-0.1), None, None).contains("a positive number of pixels"));
        assert!(told(Some("magic"), None, None, None).contains("icgn-cubic-affine"));
    }
}
