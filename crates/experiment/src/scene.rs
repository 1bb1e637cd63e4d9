//! `SCENE.toml` of a chain: the chain, what drives it, and how it is integrated.

use std::path::{Path, PathBuf};

use chainwave_analysis::Spacing;
use chainwave_mechanics::{Bodies, Chain, Drive, ImposedMotion, Integration, Method, Schedule, Striker};
use serde::Deserialize;

use crate::configuration::{Contact, FarEndTable, FarStrikerTable, Pattern, far_end};
use crate::error::Error;
use crate::numbers::{NotNegative, Positive};
use crate::shaker::Shaker;
use crate::table::Table;

/// A chain, what drives it, and how it is integrated.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChainScene {
    #[expect(dead_code, reason = "read to refuse scenes of another model")]
    model: ModelName,
    n_bodies: usize,
    duration_s: Positive,
    output_interval_s: Positive,
    body: Body,
    contact: Contact,
    drive: DriveTable,
    #[serde(default)]
    far_end: FarEndTable,
    far_striker: Option<FarStrikerTable>,
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
    mass_kg: Pattern<Positive>,
    pitch_m: Pattern<Positive>,
    damping_kg_per_s: Pattern<NotNegative>,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
enum DriveTable {
    Striker { mass_kg: Positive, velocity_m_per_s: Positive, damping_kg_per_s: NotNegative },
    Imposed { file: PathBuf },
    Shaker { frequency_hz: Positive, amplitude_m: Positive, ramp_s: Option<Positive> },
    Free { initial: PathBuf },
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Integrator {
    method: Option<String>,
    dt_s: Option<Positive>,
    accuracy: Option<Positive>,
    #[serde(default)]
    bodies: BodiesName,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum BodiesName {
    #[default]
    Reached,
    All,
}

/// Name of the choice of method and step by the scene.
const AUTOMATIC: &str = "auto";

impl ChainScene {
    /// The scene of a text; an error points at the line. `path` is where the text was read.
    ///
    /// # Errors
    /// A text that is no scene of this model.
    pub fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        let scene: Self = toml::from_str(text).map_err(|wrong| configuration(path, wrong.to_string()))?;
        if scene.n_bodies == 0 {
            return Err(configuration(path, "n_bodies: expected at least 1, found 0".into()));
        }
        Ok(scene)
    }

    /// How far apart neighbours rest.
    ///
    /// # Errors
    /// A list of another length than there are gaps.
    pub fn spacing(&self, path: &Path) -> Result<Spacing, Error> {
        match self.body.pitch_m.same() {
            Some(pitch_m) => Ok(pitch_m.into()),
            None => {
                let gaps_m = self.body.pitch_m.values(self.n_bodies.max(2) - 1, "body.pitch_m");
                Ok(gaps_m.map_err(|wrong| configuration(path, wrong))?.into())
            }
        }
    }

    /// The schedule; `path` is that of the scene.
    ///
    /// # Errors
    /// A method that is none, and a step beside an accuracy.
    pub fn schedule(&self, path: &Path) -> Result<Schedule, Error> {
        Ok(Schedule {
            duration_s: self.duration_s.get(),
            output_interval_s: self.output_interval_s.get(),
            integration: self.integrator.integration(path)?,
            bodies: match self.integrator.bodies {
                BodiesName::Reached => Bodies::Reached,
                BodiesName::All => Bodies::All,
            },
        })
    }

    /// The chain; files are looked for beside the scene at `path`, and `read` reads those that are tables.
    ///
    /// # Errors
    /// Files that cannot be read, and values that are no chain's.
    pub fn chain<E: From<Error>>(
        &self,
        path: &Path,
        read: &dyn Fn(&Path) -> Result<Table, E>,
    ) -> Result<Chain, E> {
        let n = self.n_bodies;
        let values =
            |values: Result<Vec<f64>, String>| values.map_err(|wrong| E::from(configuration(path, wrong)));
        let mut contact = self.contact.clone();
        contact.read_files(path, read)?;
        let mut far_striker = self.far_striker.clone();
        far_striker.as_mut().map_or(Ok(()), |far| far.read_files(path, read))?;
        let far_end = far_end(self.far_end, far_striker.as_ref());
        Ok(Chain {
            mass_kg: values(self.body.mass_kg.values(n, "body.mass_kg"))?,
            damping_kg_per_s: values(self.body.damping_kg_per_s.values(n, "body.damping_kg_per_s"))?,
            contact: contact.contacts(n).map_err(|wrong| configuration(path, wrong.to_string()))?,
            drive: self.drive.drive(path, (n, self.duration_s.get()), read)?,
            far_end: far_end.map_err(|wrong| configuration(path, wrong.to_string()))?,
        })
    }
}

impl Integrator {
    fn integration(&self, path: &Path) -> Result<Integration, Error> {
        let accuracy = self.accuracy.map_or(Schedule::ACCURACY, Positive::get);
        let name = self.method.as_deref().unwrap_or(AUTOMATIC);
        let method = match name {
            AUTOMATIC => None,
            _ => Some(name.parse::<Method>()?),
        };
        match (method, self.dt_s, self.accuracy) {
            (_, Some(_), Some(_)) => {
                let message = "integrator: expected dt_s or accuracy, found both".into();
                Err(configuration(path, message))
            }
            (method, Some(dt_s), None) => {
                Ok(Integration::Steps { method: method.unwrap_or(Method::Rk4), dt_s: dt_s.get() })
            }
            (Some(method), None, _) => Ok(Integration::Accuracy { method, accuracy }),
            (None, None, _) => Ok(Integration::Automatic { accuracy }),
        }
    }
}

impl DriveTable {
    fn drive<E: From<Error>>(
        &self,
        path: &Path,
        (n_bodies, duration_s): (usize, f64),
        read: &dyn Fn(&Path) -> Result<Table, E>,
    ) -> Result<Drive, E> {
        Ok(match self {
            Self::Shaker { frequency_hz, amplitude_m, ramp_s } => {
                let ramp_s = ramp_s.map_or(0.0, Positive::get);
                let shaker =
                    Shaker { frequency_hz: frequency_hz.get(), amplitude_m: amplitude_m.get(), ramp_s };
                Drive::Imposed(shaker.motion(duration_s).map_err(Error::from)?)
            }
            Self::Striker { mass_kg, velocity_m_per_s, damping_kg_per_s } => Drive::Striker(Striker {
                mass_kg: mass_kg.get(),
                velocity_m_per_s: velocity_m_per_s.get(),
                damping_kg_per_s: damping_kg_per_s.get(),
            }),
            Self::Imposed { file } => Drive::Imposed(imposed_motion(&read(&path.with_file_name(file))?)?),
            Self::Free { initial } => {
                let table = read(&path.with_file_name(initial))?;
                let BodyState { displacement_m, velocity_m_per_s } = BodyState::of_table(&table, n_bodies)?;
                Drive::Free { displacement_m, velocity_m_per_s }
            }
        })
    }
}

/// The motion of body 1 by the columns `t_s, x_m`: every row of a table without a column `body`, and those of body 1 of one that
/// has it, such as the motion that a run found. SI units.
///
/// # Errors
/// A missing column, an empty cell, and samples that are no motion.
pub fn imposed_motion(table: &Table) -> Result<ImposedMotion, Error> {
    let (times_s, x_m) = (table.full_numbers("t_s")?, table.full_numbers("x_m")?);
    let is_first: Vec<bool> = match table.has("body") {
        true => table.counts("body")?.into_iter().map(|body| body == 1).collect(),
        false => vec![true; times_s.len()],
    };
    let samples = times_s.into_iter().zip(x_m).zip(is_first);
    let (times_s, x_m) = samples.filter(|(_, is_first)| *is_first).map(|(sample, _)| sample).unzip();
    Ok(ImposedMotion::from_samples(times_s, x_m)?)
}

/// Displacements and velocities of all bodies.
pub struct BodyState {
    /// Displacements, in metres.
    pub displacement_m: Vec<f64>,
    /// Velocities, in metres per second.
    pub velocity_m_per_s: Vec<f64>,
}

impl BodyState {
    /// A state by the rows' body numbers, from 1; bodies without a row are at rest.
    ///
    /// # Errors
    /// A missing column, a body that is none, or one twice.
    pub fn of_table(table: &Table, n_bodies: usize) -> Result<Self, Error> {
        let bodies = table.counts("body")?;
        let (x_m, v_m_per_s) = (table.full_numbers("x_m")?, table.full_numbers("v_m_per_s")?);
        let mut state = Self { displacement_m: vec![0.0; n_bodies], velocity_m_per_s: vec![0.0; n_bodies] };
        let mut seen = vec![false; n_bodies];
        for (row, body) in bodies.into_iter().enumerate() {
            let index = body.wrapping_sub(1);
            if index >= n_bodies || std::mem::replace(&mut seen[index], true) {
                let expected = format!("each body once, from 1 to {n_bodies}");
                return Err(table.cell(row, "body", &expected, &body.to_string()));
            }
            state.displacement_m[index] = x_m[row];
            state.velocity_m_per_s[index] = v_m_per_s[row];
        }
        Ok(state)
    }
}

fn configuration(path: &Path, message: String) -> Error {
    Error::Configuration { path: path.to_owned(), message }
}
