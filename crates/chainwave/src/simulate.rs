//! `chainwave simulate`: the motion of a chain from a scene.

mod ring;

use std::path::Path;
use std::time::Instant;

use chainwave_measurement::Trajectory;
use chainwave_mechanics::{
    Chain, Drive, FarEnd, ImposedMotion, Schedule, Simulation, Striker, StrikerMotion,
};
use serde::Deserialize;
use serde_json::json;

use crate::cli;
use crate::error::Error;
use crate::experiment::{Contact, NotNegative, Positive};
use crate::outcome::Outcome;
use crate::output::{read_text, write_text};
use crate::table::{self, Table, column};

/// `SCENE.toml`, as interface.md gives it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Scene {
    model: ModelName,
    n_bodies: usize,
    duration_s: Positive,
    output_interval_s: Positive,
    body: Body,
    contact: Contact,
    drive: DriveTable,
    #[serde(default)]
    far_end: FarEndTable,
    #[serde(default)]
    integrator: Integrator,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum ModelName {
    Chain,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Body {
    mass_kg: PerBody<Positive>,
    #[expect(dead_code, reason = "part of the fixed interface; strains are the reader's to compute")]
    pitch_m: Positive,
    damping_kg_per_s: PerBody<NotNegative>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum PerBody<T> {
    All(T),
    Each(Vec<T>),
}

#[derive(Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
enum DriveTable {
    Striker { mass_kg: Positive, velocity_m_per_s: Positive, damping_kg_per_s: NotNegative },
    Imposed { file: std::path::PathBuf },
    Free { initial: std::path::PathBuf },
}

#[derive(Debug, Default, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
enum FarEndTable {
    #[default]
    Free,
    Fixed,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Integrator {
    method: Method,
    dt_s: Option<Positive>,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Method {
    Auto,
    Rk4,
}

impl Default for Integrator {
    fn default() -> Self {
        Self { method: Method::Auto, dt_s: None }
    }
}

/// Simulates a scene and writes the motion, and a summary where that is asked.
pub(crate) fn simulate(arguments: &cli::Simulate) -> Result<Outcome, Error> {
    if ring::is_ring(&arguments.scene)? {
        return ring::simulate(arguments);
    }
    let scene = Scene::read(&arguments.scene)?;
    let chain = scene.chain(&arguments.scene)?;
    let schedule = scene.schedule();
    let start = Instant::now();
    let simulation = chainwave_mechanics::simulate(&chain, &schedule)?;
    let wall_s = start.elapsed().as_secs_f64();
    write_motion(&arguments.out, &simulation.trajectory, simulation.striker.as_ref())?;
    if let Some(path) = &arguments.summary {
        write_summary(path, &simulation, wall_s)?;
    }
    Ok(Outcome::default())
}

impl Scene {
    fn read(path: &Path) -> Result<Self, Error> {
        let configuration = |message: String| Error::Configuration { path: path.to_owned(), message };
        let scene: Self =
            toml::from_str(&read_text(path)?).map_err(|wrong| configuration(wrong.to_string()))?;
        let ModelName::Chain = scene.model;
        if scene.n_bodies == 0 {
            return Err(configuration("n_bodies: expected at least 1, found 0".into()));
        }
        if scene.integrator.method == Method::Rk4 && scene.integrator.dt_s.is_none() {
            return Err(configuration("integrator: method rk4: expected dt_s, found none".into()));
        }
        Ok(scene)
    }

    fn schedule(&self) -> Schedule {
        Schedule {
            duration_s: self.duration_s.get(),
            output_interval_s: self.output_interval_s.get(),
            dt_s: self.integrator.dt_s.map(Positive::get),
        }
    }

    fn chain(&self, path: &Path) -> Result<Chain, Error> {
        let drive = match &self.drive {
            DriveTable::Striker { mass_kg, velocity_m_per_s, damping_kg_per_s } => Drive::Striker(Striker {
                mass_kg: mass_kg.get(),
                velocity_m_per_s: velocity_m_per_s.get(),
                damping_kg_per_s: damping_kg_per_s.get(),
            }),
            DriveTable::Imposed { file } => {
                let table = Table::read(&path.with_file_name(file))?;
                let (times_s, x_m) = (table.full_numbers("t_s")?, table.full_numbers("x_m")?);
                Drive::Imposed(ImposedMotion::from_samples(times_s, x_m)?)
            }
            DriveTable::Free { initial } => {
                let table = Table::read(&path.with_file_name(initial))?;
                Drive::Free {
                    displacement_m: table.full_numbers("x_m")?,
                    velocity_m_per_s: table.full_numbers("v_m_per_s")?,
                }
            }
        };
        Ok(Chain {
            mass_kg: self.per_body(&self.body.mass_kg, Positive::get),
            damping_kg_per_s: self.per_body(&self.body.damping_kg_per_s, NotNegative::get),
            contact: self.contact.power_law()?,
            drive,
            far_end: match self.far_end {
                FarEndTable::Free => FarEnd::Free,
                FarEndTable::Fixed => FarEnd::Fixed,
            },
        })
    }

    fn per_body<T: Copy>(&self, values: &PerBody<T>, get: impl Fn(T) -> f64) -> Vec<f64> {
        match values {
            PerBody::All(value) => vec![get(*value); self.n_bodies],
            PerBody::Each(values) => values.iter().map(|value| get(*value)).collect(),
        }
    }
}

/// Motion of a scene of the chain model, with another velocity of its striker where one is given.
fn chain_trajectory(path: &Path, striker_velocity_m_per_s: Option<f64>) -> Result<Trajectory, Error> {
    let scene = Scene::read(path)?;
    let mut chain = scene.chain(path)?;
    if let (Drive::Striker(striker), Some(velocity_m_per_s)) = (&mut chain.drive, striker_velocity_m_per_s) {
        striker.velocity_m_per_s = velocity_m_per_s;
    }
    Ok(chainwave_mechanics::simulate(&chain, &scene.schedule())?.trajectory)
}

/// Writes the motion, time by time; body 0 is the striker.
fn write_motion(path: &Path, trajectory: &Trajectory, striker: Option<&StrikerMotion>) -> Result<(), Error> {
    let (mut times, mut bodies, mut x, mut v) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (i, time_s) in trajectory.times_s.iter().enumerate() {
        let mut add = |body: u32, x_m: f64, v_m_per_s: f64| {
            times.push(*time_s);
            bodies.push(body);
            x.push(x_m);
            v.push(v_m_per_s);
        };
        if let Some(striker) = striker {
            add(0, striker.displacement_m[i], striker.velocity_m_per_s[i]);
        }
        for row in 0..trajectory.displacement_m.nrows() {
            let at = (row, i);
            add(row as u32 + 1, trajectory.displacement_m[at], trajectory.velocity_m_per_s[at]);
        }
    }
    table::write(
        path,
        vec![column("t_s", times), column("body", bodies), column("x_m", x), column("v_m_per_s", v)],
    )
}

fn write_summary(path: &Path, simulation: &Simulation, wall_s: f64) -> Result<(), Error> {
    let summary = json!({
        "energy_drift": simulation.energy_drift,
        "psi_max_j": simulation.psi_max_j,
        "steps": simulation.steps,
        "dt_s": simulation.dt_s,
        "method": simulation.method,
        "tension_events": simulation.tension_events,
        "wall_s": wall_s,
    });
    write_text(path, &format!("{summary:#}\n"))
}
