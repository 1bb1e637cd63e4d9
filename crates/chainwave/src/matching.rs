//! The way of matching that the command line asks for.

use chainwave_correlation::{METHODS, Method, ReferenceFrames, Settings, ShapeChoice, cheapest_within};
use chainwave_measurement::{Recording, Subset};

use crate::cli;
use crate::error::Error;

/// A method, or the accuracy that one is chosen by.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Chosen {
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

impl Chosen {
    /// What `--method`, `--accuracy`, `--shape` and `--interpolation` say.
    pub(crate) fn of(arguments: &cli::Matching) -> Result<Self, Error> {
        if let Some(name) = &arguments.method {
            let unknown = || format!("--method {name}: expected one of {}", METHODS.join(", "));
            return name.parse().map(Self::Method).map_err(|_unknown| Error::Argument(unknown()));
        }
        let shape: Option<ShapeChoice> = arguments.shape.as_deref().map(str::parse).transpose()?;
        if let Some(error_px) = arguments.accuracy {
            let positive = error_px > 0.0 && error_px.is_finite();
            let wrong = || format!("--accuracy {error_px}: expected a positive number of pixels");
            return positive
                .then_some(Self::Accuracy { error_px, shape })
                .ok_or_else(|| Error::Argument(wrong()));
        }
        let usual = Settings::default();
        let interpolation =
            arguments.interpolation.as_deref().map(str::parse).transpose()?.unwrap_or(usual.interpolation);
        let shape = shape.unwrap_or(ShapeChoice::Named(usual.shape));
        Ok(Self::Method(Method::IcGn { interpolation, shape }))
    }

    /// The method for subsets of a recording.
    pub(crate) fn method(
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
