//! The displacement field between two pictures, as `chainwave correlate` finds it.

use std::sync::Arc;

use chainwave_correlation::strains;
use chainwave_experiment::{FieldRequest, Monitor, field_table};
use pyo3::prelude::*;

use crate::failure::Failure;
use crate::recording::OpenedRecording;
use crate::table::ArrowTable;
use crate::tracking::Matching;
use crate::work::{Link, Stoppable, watched};

/// The field, the half size and step of its grid, its method, and why the size was taken where it was left open.
#[pyfunction]
#[pyo3(signature = (reference, deformed, matching, *, step_px, half_px, strain_window, progress = None))]
#[expect(clippy::too_many_arguments, reason = "each is named where it is called, from Python")]
pub(crate) fn correlate(
    py: Python<'_>,
    reference: &Bound<'_, OpenedRecording>,
    deformed: &Bound<'_, OpenedRecording>,
    matching: Matching,
    step_px: Option<usize>,
    half_px: Option<usize>,
    strain_window: usize,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<(ArrowTable, usize, usize, usize, String, Option<String>)> {
    if strain_window.is_multiple_of(2) || !(3..=99).contains(&strain_window) {
        let message = format!("strain_window {strain_window}: expected an odd number of points from 3 to 99");
        return Err(Failure::Argument(message).into());
    }
    let (choice, n_threads) = matching.choice()?;
    let request = FieldRequest { choice, half_px, step_px, n_threads };
    let pictures = [reference, deformed].map(|opened| Arc::clone(&opened.get().recording));
    let work = move |_: &Monitor<'_>, link: &Arc<Link>| {
        let [reference, deformed] = pictures.map(|recording| Stoppable { recording, link: Arc::clone(link) });
        let found = request.carry_out(&reference, &deformed, &|n| link.advance(n))?;
        let strains = strains(&found.field, strain_window / 2, n_threads);
        Ok((field_table(&found.field, &strains), found))
    };
    let (table, found) = watched(py, progress, work)?;
    let (field, reason) = (&found.field, found.settled.map(|settled| settled.reason.to_string()));
    let (n_columns, half_px, step_px) = (field.n_columns, field.half_px, field.step_px);
    Ok((ArrowTable::of(table)?, n_columns, half_px, step_px, found.method.to_string(), reason))
}
