use chainwave_analysis::exact_motion;
use chainwave_figures::{GroupVelocities, Point, Series, group_velocity, group_velocity_by_particles};
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
    /// Of the bodies as the pulse's peak passes, on average over the gaps of the group velocity.
    particle: Option<Estimate>,
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
        column("particle_velocity_m_per_s", of(&|row| row.particle.map(|particle| particle.value))),
        column("particle_velocity_sigma", of(&|row| row.particle.and_then(known))),
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
    let found = evaluation.measurement.group_velocity.as_ref().ok()?;
    let (group, particle) = (found.velocity_m_per_s, found.particle_velocity_m_per_s);
    Some(Row { striker, group, particle, source: EXPERIMENT })
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
        if let Ok(found) = measure_motion(job, &motion, &law, gaps.clone())?.group_velocity {
            let striker = Estimate::new(velocity_m_per_s, 0.0);
            let (group, particle) = (found.velocity_m_per_s, found.particle_velocity_m_per_s);
            rows.push(Row { striker, group, particle, source: CHAIN_MODEL });
        }
    }
    Ok(rows)
}

fn draw(whole: &Job, rows: &[Row]) -> Result<(), Error> {
    let (chain, law) = (&whole.experiment.chain, whole.experiment.contact.power_law()?);
    let sound_m_per_s = chain.pitch_m.get() * (law.k_0_n_per_m() / chain.mass_kg.get()).sqrt();
    let folder = whole.result("figures");
    make_folder(&folder)?;
    let against = |velocity: fn(&Row) -> Option<Estimate>| {
        let point = |row: &Row| Some(Point { x: velocity(row)?, y: row.group });
        let of = |source: &'static str| rows.iter().filter(move |row| row.source == source).filter_map(point);
        let line: Vec<(f64, f64)> = of(CHAIN_MODEL).map(|point| (point.x.value, point.y.value)).collect();
        GroupVelocities {
            series: vec![
                Series::measured(EXPERIMENT, of(EXPERIMENT).collect()),
                Series::model(CHAIN_MODEL, line),
            ],
            sound_speed_m_per_s: Some(sound_m_per_s),
        }
    };
    group_velocity(&folder.join("group-velocity"), &against(|row| Some(row.striker)))?;
    let by_particles = against(|row| row.particle);
    Ok(group_velocity_by_particles(&folder.join("group-velocity-by-particles"), &by_particles)?)
}
