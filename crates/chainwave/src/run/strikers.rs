use chainwave_analysis::exact_motion;
use chainwave_figures::{GroupVelocities, Point, Series, group_velocity};
use chainwave_measurement::Estimate;
use chainwave_mechanics::{Chain, Drive, FarEnd, Schedule, Striker, simulate};

use super::Job;
use super::evaluation::{Evaluation, measure_motion};
use crate::error::Error;
use crate::output::make_folder;
use crate::table::{self, column};

/// Striker velocities at which the model is asked, up to a little above the fastest.
const N_MODEL_POINTS: usize = 24;
/// The slowest of them, relative to the fastest strike: nearly the linear chain.
const SLOWEST: f64 = 0.02;

/// One row of `group_velocity.parquet`.
struct Row {
    striker: Estimate,
    group: Estimate,
    source: &'static str,
}

/// Writes `group_velocity.parquet` and its figure: the group velocity against the striker's, measured and by the chain model
/// (paper, Fig. 3 c).
pub(crate) fn compare(whole: &Job, jobs: &[Job], evaluations: &[Evaluation]) -> Result<(), Error> {
    let mut rows: Vec<Row> =
        jobs.iter().zip(evaluations).filter_map(|(job, found)| measured(job, found)).collect();
    rows.extend(modelled(whole, jobs, evaluations)?);
    let of = |value: &dyn Fn(&Row) -> Option<f64>| rows.iter().map(value).collect::<Vec<_>>();
    let known = |estimate: Estimate| (estimate.sigma > 0.0).then_some(estimate.sigma);
    let columns = vec![
        column("striker_velocity_m_per_s", of(&|row| Some(row.striker.value))),
        column("sigma", of(&|row| known(row.striker))),
        column("group_velocity_m_per_s", of(&|row| Some(row.group.value))),
        column("group_velocity_sigma", of(&|row| known(row.group))),
        column("source", rows.iter().map(|row| row.source).collect::<Vec<_>>()),
    ];
    table::write(&whole.result("group_velocity.parquet"), columns)?;
    draw(whole, &rows)
}

/// The measured group velocity; the striker's is the fitted mean where there is one, else the stated one.
fn measured(job: &Job, evaluation: &Evaluation) -> Option<Row> {
    let stated = &job.experiment.striker;
    let scatter = stated.velocity_sigma_m_per_s.get() / (job.trials.len() as f64).sqrt();
    let nominal = Estimate::new(stated.velocity_m_per_s.get(), scatter);
    let striker = evaluation.track_fit.as_ref().map_or(nominal, |fit| fit.striker_velocity_m_per_s);
    let group = evaluation.measurement.group_velocity.as_ref().ok()?.velocity_m_per_s;
    Some(Row { striker, group, source: EXPERIMENT })
}

const EXPERIMENT: &str = "experiment";
const CHAIN_MODEL: &str = "chain model";

/// The chain model's group velocity over the same gaps, with the damping found at the fastest strike.
fn modelled(whole: &Job, jobs: &[Job], evaluations: &[Evaluation]) -> Result<Vec<Row>, Error> {
    let Some((job, evaluation)) = jobs.iter().zip(evaluations).next() else { return Ok(Vec::new()) };
    let Some((damping, _)) = evaluation.damping() else { return Ok(Vec::new()) };
    let gaps = evaluation.measurement.group_velocity.as_ref().ok().map(|found| found.gaps.0..=found.gaps.1);
    let (chain, law) = (&whole.experiment.chain, whole.experiment.contact.power_law()?);
    let fastest_m_per_s = 1.1 * job.experiment.striker.velocity_m_per_s.get();
    let crossing_s = chain.n_bodies as f64 / (law.k_0_n_per_m() / chain.mass_kg.get()).sqrt();
    let schedule = Schedule::automatic(1.5 * crossing_s, crossing_s / 400.0);
    let mut rows = Vec::with_capacity(N_MODEL_POINTS);
    for k in 0..N_MODEL_POINTS {
        let share = SLOWEST + (1.0 - SLOWEST) * k as f64 / (N_MODEL_POINTS - 1) as f64;
        let velocity_m_per_s = share * fastest_m_per_s;
        let striker = Striker {
            mass_kg: whole.experiment.striker.mass_kg.get(),
            velocity_m_per_s,
            damping_kg_per_s: damping.striker_damping_kg_per_s.value,
        };
        let model = Chain {
            mass_kg: vec![chain.mass_kg.get(); chain.n_bodies],
            damping_kg_per_s: vec![damping.chain_damping_kg_per_s.value; chain.n_bodies],
            contact: law.into(),
            drive: Drive::Striker(striker),
            far_end: FarEnd::Free,
        };
        let motion = exact_motion(&simulate(&model, &schedule)?.trajectory);
        if let Ok(group) = measure_motion(job, &motion, &law, gaps.clone())?.group_velocity {
            let striker = Estimate::new(velocity_m_per_s, 0.0);
            let group = Estimate::new(group.velocity_m_per_s.value, 0.0);
            rows.push(Row { striker, group, source: CHAIN_MODEL });
        }
    }
    Ok(rows)
}

fn draw(whole: &Job, rows: &[Row]) -> Result<(), Error> {
    let of = |source: &'static str| rows.iter().filter(move |row| row.source == source);
    let points = of(EXPERIMENT).map(|row| Point { x: row.striker, y: row.group }).collect();
    let line: Vec<(f64, f64)> = of(CHAIN_MODEL).map(|row| (row.striker.value, row.group.value)).collect();
    let (chain, law) = (&whole.experiment.chain, whole.experiment.contact.power_law()?);
    let sound_m_per_s = chain.pitch_m.get() * (law.k_0_n_per_m() / chain.mass_kg.get()).sqrt();
    let folder = whole.result("figures");
    make_folder(&folder)?;
    let velocities = GroupVelocities {
        series: vec![Series::measured(EXPERIMENT, points), Series::model(CHAIN_MODEL, line)],
        sound_speed_m_per_s: Some(sound_m_per_s),
    };
    Ok(group_velocity(&folder.join("group-velocity"), &velocities)?)
}
