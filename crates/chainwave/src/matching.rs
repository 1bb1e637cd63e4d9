//! The way of matching that the command line asks for.

use chainwave_experiment::{MethodChoice, NamedMatching};

use crate::cli;
use crate::error::Error;
use crate::on_demand;

/// What `--method`, `--accuracy`, `--shape` and `--interpolation` say.
pub(crate) fn choice(arguments: &cli::Matching) -> Result<MethodChoice, Error> {
    let &cli::Matching { method, accuracy: accuracy_px, shape, interpolation } = arguments;
    let choice = NamedMatching { method, accuracy_px, shape, interpolation }.choice()?;
    on_demand::expect_method(&choice)?;
    Ok(choice)
}
