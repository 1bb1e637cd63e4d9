//! The pieces, for tracks of any origin: trials merged to one motion, a motion measured, a chain fitted.

use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use chainwave_analysis::{FrontSettings, MeasureSettings, Measurement, Spacing, measure};
use chainwave_experiment::{
    ChainScene, Contact, Table, energy_table, front_table, half_width_table, motion_table, spectrum_table,
    strain_table,
};
use chainwave_inference::{Reached, TrackModel, critical_kg_per_s, fit_tracks, reached};
use chainwave_measurement::{BodyTrack, ChainMotion, Estimate, Observation};
use chainwave_mechanics::Drive;
use chainwave_stitching::{Settings, Stitched, merge as merge_observations, outliers};
use pyo3::prelude::*;
use serde::Deserialize;
use serde_json::json;

use crate::cells::TableArgument;
use crate::drawing::{Drawings, drawings};
use crate::estimate::{Number, of_estimate, refused};
use crate::failure::Failure;
use crate::table::ArrowTable;
use crate::tracking::threads;
use crate::work::watched;

/// A motion put together from trials, with the trials.
#[pyclass(frozen, module = "chainwave._chainwave")]
pub(crate) struct MergedMotion {
    stitched: Arc<Stitched>,
    observations: Arc<Vec<Observation>>,
}

/// Named numbers.
type Numbers = Vec<(&'static str, Number)>;
/// Named tables.
type Tables = Vec<(&'static str, ArrowTable)>;

/// Merges trials: a table `recording, body, t_s, x_m, sigma_m`, with `view` and `trial` where there are several views. Gives the motion, its
/// table, each trial's alignment (JSON), and what should be known.
#[pyfunction]
#[pyo3(signature = (tracks, *, n_bodies, rest_until_s, drive_scatter, trigger_sigma_s, view_trigger_sigma_s))]
pub(crate) fn merge(
    py: Python<'_>,
    tracks: TableArgument,
    n_bodies: Option<usize>,
    rest_until_s: f64,
    drive_scatter: Option<f64>,
    trigger_sigma_s: Option<f64>,
    view_trigger_sigma_s: Option<f64>,
) -> PyResult<(MergedMotion, ArrowTable, String, Vec<String>)> {
    let mut observations = observations(&tracks.table("tracks")?)?;
    let bodies = observations.iter().flat_map(|one| &one.bodies).map(|one| one.body);
    let n_bodies = n_bodies.or_else(|| bodies.max()).unwrap_or(0);
    let settings = Settings {
        rest_until_s,
        drive_scatter,
        trigger_sigma_s,
        view_trigger_sigma_s,
        ..Settings::new(n_bodies, 0.0)
    };
    let (stitched, observations, notes) = watched(py, None, move |_, _| {
        let mut notes = Vec::new();
        for outlier in outliers(&observations, &settings)?.iter().rev() {
            observations.remove(outlier.index);
            notes.push(format!("{} was left out: {}", outlier.recording, outlier.evidence));
        }
        let stitched = merge_observations(&observations, &settings)?;
        notes.extend(stitched.warnings.iter().cloned());
        Ok((stitched, observations, notes))
    })?;
    let alignment = |one: &chainwave_stitching::Alignment| {
        json!({
            "recording": one.recording,
            "view": one.view,
            "trial": one.trial,
            "trigger_offset_s": one.trigger_offset_s.value,
            "trigger_offset_sigma_s": one.trigger_offset_s.sigma,
            "drive_deviation": one.drive_deviation.value,
            "drive_deviation_sigma": one.drive_deviation.sigma,
            "scatter_ratio": one.scatter_ratio,
        })
    };
    let alignments = json!(stitched.alignments.iter().map(alignment).collect::<Vec<_>>()).to_string();
    let table = ArrowTable::of(motion_table(&stitched, None))?;
    let merged = MergedMotion { stitched: Arc::new(stitched), observations: Arc::new(observations) };
    Ok((merged, table, alignments, notes))
}

/// The trials of a table, in the order of their first rows; a body without a row at an instant of its trial was lost then.
fn observations(table: &Table) -> Result<Vec<Observation>, Failure> {
    // Views count their trials from one each.
    let names: Vec<String> = match (table.has("recording"), table.has("view")) {
        (true, _) => table.texts("recording")?,
        (false, true) => {
            let of_views = table.texts("view")?.into_iter().zip(table.texts("trial")?);
            of_views.map(|(view, trial)| format!("view {view}, trial {trial}")).collect()
        }
        (false, false) => table.texts("trial")?,
    };
    let (bodies, times_s) = (table.counts("body")?, table.full_numbers("t_s")?);
    let (x_m, sigma_m) = (table.numbers("x_m")?, table.numbers("sigma_m")?);
    let counts = |name: &str| table.has(name).then(|| table.counts(name)).transpose();
    let (views, trials) = (counts("view")?, if table.has("recording") { counts("trial")? } else { None });
    let mut rows: Vec<(&str, Vec<usize>)> = Vec::new();
    let mut places: BTreeMap<&str, usize> = BTreeMap::new();
    for (row, name) in names.iter().enumerate() {
        let place = *places.entry(name).or_insert(rows.len());
        match rows.get_mut(place) {
            Some((_, own)) => own.push(row),
            None => rows.push((name, vec![row])),
        }
    }
    let number = |of: &Option<Vec<usize>>, row: usize, usual: usize| {
        let number = of.as_ref().map_or(usual, |of| of[row]);
        u32::try_from(number).map_err(|_too_large| {
            Failure::Argument(format!("tracks: a view or trial {number}: expected less than 2^32"))
        })
    };
    let observation = |(index, (name, rows)): (usize, (&str, Vec<usize>))| -> Result<Observation, Failure> {
        let mut own_s: Vec<f64> = rows.iter().map(|row| times_s[*row]).collect();
        own_s.sort_by(f64::total_cmp);
        own_s.dedup_by(|a, b| a.total_cmp(b).is_eq());
        let mut tracks: BTreeMap<usize, Vec<Option<Estimate>>> = BTreeMap::new();
        let mut seen = BTreeSet::new();
        let first = rows.first().copied().unwrap_or(0);
        for &row in &rows {
            for (column, of) in [("view", &views), ("trial", &trials)] {
                if let Some(of) = of.as_ref().filter(|of| of[row] != of[first]) {
                    let (expected, found) =
                        (format!("{}, as in the other rows of {name}", of[first]), of[row]);
                    return Err(table.cell(row, column, &expected, &found.to_string()).into());
                }
            }
            if !seen.insert((bodies[row], times_s[row].to_bits())) {
                let expected = format!("one row of {name} for body {} and an instant", bodies[row]);
                return Err(table
                    .cell(row, "t_s", &expected, &format!("a second one of {} s", times_s[row]))
                    .into());
            }
            if bodies[row] == 0 {
                return Err(table.cell(row, "body", "a number from 1", "0").into());
            }
            let track = tracks.entry(bodies[row]).or_insert_with(|| vec![None; own_s.len()]);
            let instant = own_s.partition_point(|time_s| *time_s < times_s[row]);
            let found = x_m[row].zip(sigma_m[row]);
            if let Some(place) = track.get_mut(instant) {
                *place = found.map(|(x_m, sigma_m)| Estimate::new(x_m, sigma_m));
            }
        }
        Ok(Observation {
            recording: name.to_owned(),
            view: number(&views, first, 1)?,
            trial: number(&trials, first, index + 1)?,
            times_s: own_s,
            bodies: tracks.into_iter().map(|(body, position_m)| BodyTrack { body, position_m }).collect(),
        })
    };
    rows.into_iter().enumerate().map(observation).collect()
}

/// What is measured: a merged motion with all errors that its samples share, or a table of one whose errors are independent.
#[derive(FromPyObject)]
pub(crate) enum MotionArgument<'py> {
    /// A merged motion.
    #[pyo3(transparent)]
    Merged(Bound<'py, MergedMotion>),
    /// A table.
    #[pyo3(transparent)]
    Table(TableArgument),
}

impl MotionArgument<'_> {
    fn motion(self) -> Result<ChainMotion, Failure> {
        match self {
            Self::Merged(merged) => Ok(merged.get().stitched.motion.clone()),
            Self::Table(table) => motion_of(&table.table("motion")?),
        }
    }
}

/// The motion of a table `t_s, body, x_m` and, unless it is exact, `sigma_m`. Rows of body 0, the striker, are no body's.
fn motion_of(table: &Table) -> Result<ChainMotion, Failure> {
    let (bodies, times_s) = (table.counts("body")?, table.full_numbers("t_s")?);
    let x_m = table.numbers("x_m")?;
    let sigma_m = match table.has("sigma_m") {
        true => table.numbers("sigma_m")?,
        false => vec![Some(0.0); x_m.len()],
    };
    let mut all_s = times_s.clone();
    all_s.sort_by(f64::total_cmp);
    all_s.dedup_by(|a, b| a.total_cmp(b).is_eq());
    let n_bodies = bodies.iter().copied().max().unwrap_or(0);
    if n_bodies == 0 || n_bodies > x_m.len() {
        let found = n_bodies.to_string();
        return Err(table.cell(0, "body", "numbers of bodies from 1, each with a row", &found).into());
    }
    let mut motion = ChainMotion::unseen(n_bodies, all_s);
    for (row, &body) in bodies.iter().enumerate().filter(|(_, body)| **body > 0) {
        let at = (body - 1, motion.times_s.partition_point(|time_s| *time_s < times_s[row]));
        if let Some((x_m, sigma_m)) = x_m[row].zip(sigma_m[row]) {
            motion.displacement_m[at] = Some(Estimate::new(x_m, sigma_m));
            motion.independent_sigma_m[at] = sigma_m;
            motion.n_trials[at] = 1;
        }
    }
    Ok(motion)
}

/// What a measurement is made by.
#[derive(FromPyObject)]
pub(crate) struct Measuring {
    #[pyo3(item)]
    pitch_m: PitchArgument,
    #[pyo3(item)]
    first_gap: usize,
    #[pyo3(item)]
    last_gap: Option<usize>,
    #[pyo3(item)]
    edge_fraction: f64,
    #[pyo3(item)]
    end_reflects: bool,
    #[pyo3(item)]
    n_replicas: usize,
    #[pyo3(item)]
    seed: u64,
    /// The table `[contact]` of an experiment, as TOML.
    #[pyo3(item)]
    contact: Option<String>,
    #[pyo3(item)]
    threads: Option<NonZero<usize>>,
}

/// How far apart neighbours rest: all alike, or gap by gap.
#[derive(FromPyObject)]
enum PitchArgument {
    #[pyo3(transparent)]
    Same(f64),
    #[pyo3(transparent)]
    ByGap(Vec<f64>),
}

/// Measures a motion: numbers, tables and figures.
#[pyfunction]
pub(crate) fn measure_motion(
    py: Python<'_>,
    motion: MotionArgument<'_>,
    measuring: Measuring,
) -> PyResult<(Numbers, Tables, Drawings)> {
    let motion = motion.motion()?;
    let (found, drawings) = watched(py, None, move |_, _| {
        let found = measured(&motion, &measuring)?;
        let drawings = drawings(&motion, &[("", &found)]);
        Ok((found, drawings))
    })?;
    let velocity = found.group_velocity.as_ref();
    let resonance = found.local_resonance.as_ref();
    let numbers = vec![
        (
            "group_velocity_m_per_s",
            velocity.map_or_else(|why| refused(why.as_str()), |v| of_estimate(v.velocity_m_per_s)),
        ),
        (
            "local_resonance_hz",
            resonance.map_or_else(|why| refused(why.as_str()), |r| of_estimate(r.of_chain_hz())),
        ),
    ];
    let tables = [
        ("strain", strain_table(&found)),
        ("front", front_table(&found)),
        ("hwhm", half_width_table(&found)),
        ("energy", energy_table(&found)),
        ("spectrum", spectrum_table(&found)),
    ];
    let tables = tables.into_iter().map(|(name, table)| Ok((name, ArrowTable::of(table)?)));
    Ok((numbers, tables.collect::<PyResult<_>>()?, drawings))
}

fn measured(motion: &ChainMotion, asked: &Measuring) -> Result<Measurement, Failure> {
    #[derive(Deserialize)]
    struct OfContact {
        contact: Contact,
    }
    let spacing: Spacing = match &asked.pitch_m {
        PitchArgument::Same(pitch_m) => (*pitch_m).into(),
        PitchArgument::ByGap(pitch_m) => pitch_m.clone().into(),
    };
    let settings = MeasureSettings {
        front: FrontSettings { edge_fraction: asked.edge_fraction, ..FrontSettings::default() },
        first_gap: asked.first_gap,
        end_reflects: asked.end_reflects,
        velocity_gaps: asked.last_gap.map(|last| asked.first_gap..=last),
        n_replicas: asked.n_replicas,
        n_threads: threads(asked.threads),
        ..MeasureSettings::new(spacing, asked.seed)
    };
    let Some(contact) = &asked.contact else { return Ok(measure(motion, &settings, None)?) };
    let read: Result<OfContact, _> = toml::from_str(contact);
    let mut contact = read.map_err(|wrong| Failure::Argument(format!("contact: {wrong}")))?.contact;
    contact.read_files(Path::new(""), |file| Ok::<_, Failure>(Table::read_csv(file)?))?;
    let n_bodies = motion.n_bodies();
    let contacts = contact.contacts(n_bodies)?;
    let of_gaps: Vec<_> = (0..n_bodies.saturating_sub(1)).map(|gap| contacts.of_gap(gap).energy()).collect();
    let energy_of = |gap: usize, overlap_m: f64| of_gaps.get(gap - 1).map_or(0.0, |energy| energy(overlap_m));
    Ok(measure(motion, &settings, Some(&energy_of))?)
}

/// Fits the dampings of a chain to the trials of a merged motion. The text is that of a scene with a striker, read at `path`; the sigma is the
/// scatter of its velocity from trial to trial. Gives numbers, details (JSON), and what should be known.
#[pyfunction]
#[pyo3(signature = (merged, path, text, *, striker_velocity_sigma_m_per_s, n_threads))]
pub(crate) fn fit(
    py: Python<'_>,
    merged: &Bound<'_, MergedMotion>,
    path: PathBuf,
    text: String,
    striker_velocity_sigma_m_per_s: f64,
    n_threads: Option<NonZero<usize>>,
) -> PyResult<(Numbers, String, Vec<String>)> {
    let merged = merged.get();
    let (stitched, observations) = (Arc::clone(&merged.stitched), Arc::clone(&merged.observations));
    let (fit, critical) = watched(py, None, move |_, _| {
        let scene = ChainScene::parse(&path, &text)?;
        let chain =
            scene.chain::<chainwave_experiment::Error>(&path, &|path: &Path| Table::read_csv(path))?;
        let Drive::Striker(striker) = &chain.drive else {
            let message = format!("{}: drive: expected a striker, whose damping is fitted", path.display());
            return Err(Failure::Argument(message));
        };
        let velocity = Estimate::new(striker.velocity_m_per_s, striker_velocity_sigma_m_per_s);
        let critical = critical_kg_per_s(&chain);
        let model = TrackModel {
            chain,
            striker_velocity_m_per_s: velocity,
            priors: Vec::new(),
            reading_errors: Vec::new(),
            usual_errors: Vec::new(),
            n_threads: threads(n_threads),
        };
        let offsets_s: Vec<f64> = stitched.alignments.iter().map(|one| one.trigger_offset_s.value).collect();
        let Reached { observations: reached, impact_times_s: offsets_s } =
            reached(&observations, &offsets_s, &model)?;
        Ok((fit_tracks(&reached, &offsets_s, &model, None)?, critical))
    })?;
    let [of_chain, of_striker] = fit.damping.refusals(critical);
    let told =
        |found: Estimate, why: Option<String>| why.map_or_else(|| of_estimate(found), |why| refused(&why));
    let numbers = vec![
        ("c_d_kg_per_s", told(fit.damping.chain_damping_kg_per_s, of_chain)),
        ("c_s_kg_per_s", told(fit.damping.striker_damping_kg_per_s, of_striker)),
        ("striker_velocity_m_per_s", of_estimate(fit.striker_velocity_m_per_s)),
        ("impact_time_s", of_estimate(fit.impact_time_s)),
    ];
    let details = json!({
        "correlation": fit.damping.correlation,
        "reduced_chi_squared": fit.reduced_chi_squared,
        "n_residuals": fit.n_residuals,
        "n_simulations": fit.n_simulations,
        "is_believed": fit.is_believed(),
    });
    Ok((numbers, details.to_string(), fit.warnings()))
}
