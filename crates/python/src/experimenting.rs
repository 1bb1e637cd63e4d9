//! An experiment from its recordings to its results, as `chainwave run` goes.

use std::path::Path;
use std::sync::Arc;

use chainwave_analysis::GroupVelocity;
use chainwave_experiment::{
    Evaluation, Experiment, Finding, HeldRecordings, MemoryStore, RecordingState, ResultTable, Results,
    Setup, TrackRows, check, energy_table, front_table, half_width_table, motion_by_model_table,
    motion_table, spectrum_table, strain_table,
};
use chainwave_measurement::Estimate;
use pyo3::prelude::*;
use serde_json::json;

use crate::cells::{NamedCells, table_of};
use crate::drawing::{Drawing, drawings};
use crate::estimate::{Number, of_estimate, refused};
use crate::failure::Failure;
use crate::recording::OpenedRecording;
use crate::table::ArrowTable;
use crate::tracking::threads;
use crate::work::watched;

/// An experiment that was read, and the tracks of its recordings as far as they were made.
#[pyclass(frozen, module = "chainwave._chainwave")]
pub(crate) struct PreparedExperiment {
    /// One for each striker velocity.
    setups: Vec<Setup>,
    store: Arc<MemoryStore>,
}

/// Kind, subject and text of what should be known.
type Warned = (&'static str, String, String);
/// Recording, view, trial, what became of it, and why it is not used.
type StateOfRecording = (String, u32, u32, &'static str, Option<String>);

/// What a run found.
#[pyclass(frozen, get_all, module = "chainwave._chainwave")]
pub(crate) struct ExperimentResults {
    striker_velocity_m_per_s: Option<f64>,
    numbers: Vec<(&'static str, Number)>,
    tables: Vec<(&'static str, Py<ArrowTable>)>,
    figures: Vec<(&'static str, Py<Drawing>)>,
    warnings: Vec<Warned>,
    recordings: Vec<StateOfRecording>,
    /// What else is known, as JSON.
    details: String,
    /// What was modelled, and why, as JSON.
    decisions: String,
}

#[pymethods]
impl PreparedExperiment {
    /// Of the text of an experiment, where it stands, the folder of its recordings, and its trials where they are no file.
    #[new]
    #[pyo3(signature = (path, text, *, recordings = None, trials = None, partial = false))]
    fn new(
        path: &str,
        text: &str,
        recordings: Option<&str>,
        trials: Option<NamedCells>,
        partial: bool,
    ) -> Result<Self, Failure> {
        let path = Path::new(path);
        let experiment = Experiment::parse(path, text)?;
        let table = match trials {
            Some(columns) => experiment.trials_of(&table_of("trials", columns)?)?,
            None => experiment.read_trials(path)?,
        };
        let mut setup = Setup::of(experiment, table, path, recordings.map(Path::new))?;
        setup.takes_partial = partial;
        Ok(Self { setups: setup.by_striker(), store: Arc::new(MemoryStore::default()) })
    }

    /// The same with recordings that need no file, by their names in the trials table.
    fn with_recordings(&self, held: Vec<(String, PyRef<'_, OpenedRecording>)>) -> Result<Self, Failure> {
        let held: HeldRecordings =
            held.into_iter().map(|(name, opened)| (name, Arc::clone(&opened.recording))).collect();
        let with_held = |setup: &Setup| setup.clone().with_recordings(held.clone());
        let setups = self.setups.iter().map(with_held).collect::<Result<_, _>>()?;
        Ok(Self { setups, store: Arc::clone(&self.store) })
    }

    /// Frames per second of recordings that do not say it, where the experiment does.
    #[getter]
    fn rate_hz(&self) -> Option<f64> {
        self.setups.first().and_then(|setup| setup.open_options().rate_hz)
    }

    /// Number of striker velocities.
    fn __len__(&self) -> usize {
        self.setups.len()
    }

    /// The strength of the drive of each: the striker's velocity in metres per second, 1 where something else drives the chain.
    #[getter]
    fn velocities(&self) -> Vec<f64> {
        self.setups.iter().map(|setup| setup.experiment.nominal_drive().value).collect()
    }

    /// Name of the experiment.
    #[getter]
    fn name(&self) -> &str {
        self.setups.first().map_or("", |setup| &setup.experiment.name)
    }

    /// The recordings that the trials name.
    #[getter]
    fn recordings(&self) -> Vec<String> {
        let all = self.setups.iter().flat_map(|setup| &setup.trials);
        all.map(|trial| trial.recording.clone()).collect()
    }

    /// What contradicts the experiment before work.
    #[pyo3(signature = (*, n_threads = None))]
    fn check(&self, py: Python<'_>, n_threads: Option<std::num::NonZero<usize>>) -> PyResult<Vec<Warned>> {
        let (setups, n_threads) = (self.setups.clone(), threads(n_threads));
        watched(py, None, move |_, _| {
            let mut found = Vec::new();
            for setup in &setups {
                found.extend(check(setup, n_threads)?.findings.into_iter().map(warned));
            }
            Ok(found)
        })
    }

    /// Runs one striker velocity.
    #[pyo3(signature = (striker, *, n_threads = None, progress = None))]
    fn run(
        &self,
        py: Python<'_>,
        striker: usize,
        n_threads: Option<std::num::NonZero<usize>>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<ExperimentResults> {
        let Some(setup) = self.setups.get(striker).cloned() else {
            let n = self.setups.len();
            return Err(Failure::Argument(format!("striker {striker}: expected one of {n}")).into());
        };
        let (store, n_threads) = (Arc::clone(&self.store), threads(n_threads));
        let (setup, results) = watched(py, progress, move |monitor, _| {
            let results = setup.run(store.as_ref(), n_threads, monitor)?;
            Ok((setup, results))
        })?;
        ExperimentResults::of(py, &setup, &results)
    }
}

impl ExperimentResults {
    fn of(py: Python<'_>, setup: &Setup, results: &Results) -> PyResult<Self> {
        let evaluation = &results.evaluation;
        let (measurement, damping) = (&evaluation.measurement, &evaluation.damping);
        let tables = tables_of(results).into_iter();
        let tables = tables.map(|(name, table)| Ok((name, Py::new(py, ArrowTable::of(table)?)?)));
        let model = evaluation.model.as_ref().map(|model| ("chain model", &model.measurement));
        let panels: Vec<_> = [("experiment", measurement)].into_iter().chain(model).collect();
        let figures = drawings(&evaluation.stitched.motion, &panels);
        let figures = figures.into_iter().map(|(name, drawing)| Ok((name, Py::new(py, drawing)?)));
        let state =
            |one: RecordingState| (one.recording, one.view, one.trial, one.state.as_str(), one.reason);
        let velocity = measurement.group_velocity.as_ref().ok();
        let details = json!({
            "correlation": damping.correlation,
            "damping_from": damping.source,
            "group_velocity_gaps": velocity.map(|v| [v.gaps.0, v.gaps.1]),
            "reduced_chi_squared": evaluation.track_fit.as_ref().ok().map(|fit| fit.reduced_chi_squared),
        });
        Ok(Self {
            striker_velocity_m_per_s: setup.experiment.striker.as_ref().map(|one| one.velocity_m_per_s.get()),
            numbers: numbers_of(evaluation),
            tables: tables.collect::<PyResult<_>>()?,
            figures: figures.collect::<PyResult<_>>()?,
            warnings: evaluation.warnings().into_iter().map(warned).collect(),
            recordings: results.recording_states(setup).into_iter().map(state).collect(),
            details: details.to_string(),
            decisions: json!(results.decisions).to_string(),
        })
    }
}

/// Every number that a run states, or why it states none.
fn numbers_of(evaluation: &Evaluation) -> Vec<(&'static str, Number)> {
    let (measurement, damping) = (&evaluation.measurement, &evaluation.damping);
    let of_velocity = |value: fn(&GroupVelocity) -> Option<Estimate>| match &measurement.group_velocity {
        Ok(velocity) => value(velocity).map_or_else(|| refused("it was not measured"), of_estimate),
        Err(why) => refused(why.as_str()),
    };
    let told = |found: &Result<Estimate, String>| match found {
        Ok(estimate) => of_estimate(*estimate),
        Err(reason) => refused(reason),
    };
    let resonance = measurement.local_resonance.as_ref();
    let resonance_hz = resonance.map_or_else(|why| refused(why.as_str()), |r| of_estimate(r.of_chain_hz()));
    let striker_m_per_s = match &evaluation.track_fit {
        Ok(fit) if fit.model.is_let_go() => refused("the chain is let go"),
        Ok(fit) => of_estimate(fit.striker_velocity_m_per_s),
        Err(why) => refused(&why.to_string()),
    };
    vec![
        ("group_velocity_m_per_s", of_velocity(|velocity| Some(velocity.velocity_m_per_s))),
        ("group_velocity_variation", of_velocity(|velocity| velocity.relative_variation)),
        ("particle_velocity_m_per_s", of_velocity(|velocity| velocity.particle_velocity_m_per_s)),
        ("c_d_kg_per_s", told(&damping.chain_damping_kg_per_s)),
        ("c_s_kg_per_s", told(&damping.striker_damping_kg_per_s)),
        ("local_resonance_hz", resonance_hz),
        ("striker_velocity_m_per_s", striker_m_per_s),
    ]
}

/// The tables that a run writes, by their names.
fn tables_of(results: &Results) -> Vec<(&'static str, ResultTable)> {
    let Results { tracked, evaluation, .. } = results;
    let measurement = &evaluation.measurement;
    let mut tracks = TrackRows::default();
    tracked.recordings.iter().for_each(|one| tracks.add_bodies(&one.trial.recording, &one.tracks));
    let mut tables = vec![
        ("tracks", tracks.table()),
        ("motion", motion_table(&evaluation.stitched, Some(&evaluation.side_motion))),
        ("strain", strain_table(measurement)),
        ("front", front_table(measurement)),
        ("hwhm", half_width_table(measurement)),
        ("energy", energy_table(measurement)),
        ("spectrum", spectrum_table(measurement)),
    ];
    if let Some(by_model) = &evaluation.by_model {
        let table = motion_by_model_table(by_model, &evaluation.stitched, &evaluation.side_motion);
        tables.push(("motion_by_model", table));
    }
    tables
}

fn warned(finding: Finding) -> Warned {
    (finding.code, finding.subject, finding.text)
}
