//! The way of matching that the command line asks for.

use chainwave_experiment::MethodChoice;

use crate::cli;
use crate::error::Error;
use crate::on_demand;

/// What `--method`, `--accuracy`, `--shape` and `--interpolation` say.
pub(crate) fn choice(arguments: &cli::Matching) -> Result<MethodChoice, Error> {
    let cli::Matching { method, accuracy, shape, interpolation } = arguments;
    let names = [method, shape, interpolation].map(Option::as_deref);
    let [method, shape, interpolation] = names;
    let choice = MethodChoice::named(method, *accuracy, shape, interpolation)?;
    on_demand::expect_method(&choice)?;
    Ok(choice)
}
