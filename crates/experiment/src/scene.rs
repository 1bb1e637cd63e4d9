//! `SCENE.toml` of a chain: the chain, what drives it, and how it is integrated.

use std::path::Path;

use chainwave_analysis::Spacing;
use chainwave_mechanics::{Bodies, Chain, Integration, Method, Schedule};
use serde::Deserialize;

use crate::configuration::{Contact, DriveTable, FarEndTable, FarStrikerTable, Pattern, at_rest, far_end};
use crate::error::Error;
use crate::numbers::{NotNegative, Positive};
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
    ground_stiffness_n_per_m: Option<Pattern<NotNegative>>,
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
        let ground = self.body.ground_stiffness_n_per_m.as_ref();
        let ground = ground.map(|pattern| pattern.values(n, "body.ground_stiffness_n_per_m"));
        let refused = |wrong: Error| configuration(path, wrong.to_string());
        let mut chain = Chain {
            mass_kg: values(self.body.mass_kg.values(n, "body.mass_kg"))?,
            damping_kg_per_s: values(self.body.damping_kg_per_s.values(n, "body.damping_kg_per_s"))?,
            ground_stiffness_n_per_m: values(ground.unwrap_or_else(|| Ok(Vec::new())))?,
            contact: contact.contacts(n).map_err(refused)?,
            drive: at_rest(n),
            far_end: far_end.map_err(refused)?,
        };
        let mut drive = self.drive.clone();
        drive.read_files(path, n, read)?;
        if drive.scatter().is_some() {
            let message = "drive.scatter: expected in an experiment, whose trials scatter, found in a scene";
            return Err(configuration(path, message.into()).into());
        }
        drive.check(&chain).map_err(refused)?;
        chain.drive = drive.drive(1.0, &chain, self.duration_s.get()).map_err(refused)?;
        Ok(chain)
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

fn configuration(path: &Path, message: String) -> Error {
    Error::Configuration { path: path.to_owned(), message }
}
