//! The motion of a chain from a scene, as `chainwave simulate` computes it.

use std::path::{Path, PathBuf};
use std::time::Instant;

use chainwave_experiment::{ChainScene, SimulationSummary, Table, simulated_table};
use pyo3::prelude::*;
use serde_json::json;

use crate::table::ArrowTable;
use crate::work::watched;

/// The motion and the summary (JSON) of a scene: the text of a TOML file, and where it was read.
#[pyfunction]
pub(crate) fn simulate(py: Python<'_>, path: PathBuf, text: String) -> PyResult<(ArrowTable, String)> {
    let (table, summary) = watched(py, None, move |_, _| {
        let scene = ChainScene::parse(&path, &text)?;
        let read = |path: &Path| Table::read_csv(path);
        let chain = scene.chain::<chainwave_experiment::Error>(&path, &read)?;
        let schedule = scene.schedule(&path)?;
        let start = Instant::now();
        let simulation = chainwave_mechanics::simulate(&chain, &schedule)?;
        let wall_s = start.elapsed().as_secs_f64();
        let (striker, far_striker) = (simulation.striker.as_ref(), simulation.far_striker.as_ref());
        let table = simulated_table(&simulation.trajectory, striker, far_striker);
        let summary = json!(SimulationSummary::of(&simulation, wall_s));
        Ok((table, summary.to_string()))
    })?;
    Ok((ArrowTable::of(table)?, summary))
}
