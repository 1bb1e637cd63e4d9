//! The inside of the Python module `chainwave`: the library crates, callable.
//!
//! The crate converts and computes nothing: a Python value becomes a value of the library, work goes on in a thread of its own without the
//! interpreter's lock (`work`), and what is found goes back as a table that every Arrow reader takes (`table`), or as numbers with
//! their sigmas. What a user sees, with types and documentation, is Python in `python/chainwave`; it calls nothing here that a user should.
//!
//! Only the stable ABI is used, so one build serves every Python from 3.9 on and needs none to be made. NumPy is met in Python alone:
//! pixels go over as bytes.

mod cells;
mod configuration;
mod contact;
mod correlating;
mod drawing;
mod estimate;
mod experimenting;
mod failure;
mod merging;
mod recording;
mod simulating;
mod table;
mod tracking;
mod work;

use pyo3::prelude::*;

/// The functions and types that `chainwave` is made of.
#[pymodule]
fn _chainwave(module: &Bound<'_, PyModule>) -> PyResult<()> {
    #[cfg(feature = "opencv")]
    chainwave_opencv::register();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<recording::OpenedRecording>()?;
    module.add_class::<recording::FrameView>()?;
    module.add_class::<table::ArrowTable>()?;
    module.add_class::<drawing::Drawing>()?;
    module.add_function(wrap_pyfunction!(recording::open, module)?)?;
    module.add_function(wrap_pyfunction!(recording::recording_of_counts, module)?)?;
    module.add_function(wrap_pyfunction!(tracking::track, module)?)?;
    module.add_function(wrap_pyfunction!(correlating::correlate, module)?)?;
    module.add_function(wrap_pyfunction!(simulating::simulate, module)?)?;
    module.add_function(wrap_pyfunction!(contact::fit_contact, module)?)?;
    module.add_class::<experimenting::PreparedExperiment>()?;
    module.add_class::<experimenting::ExperimentResults>()?;
    module.add_class::<merging::MergedMotion>()?;
    module.add_function(wrap_pyfunction!(cells::columns_of_csv, module)?)?;
    module.add_function(wrap_pyfunction!(merging::merge, module)?)?;
    module.add_function(wrap_pyfunction!(merging::measure_motion, module)?)?;
    module.add_function(wrap_pyfunction!(merging::fit, module)?)?;
    module.add_function(wrap_pyfunction!(configuration::toml_of_dict, module)?)?;
    module.add_function(wrap_pyfunction!(configuration::read_text, module)?)
}
