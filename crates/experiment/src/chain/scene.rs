//! `SCENE.toml` of a chain: the chain, what drives it, and how it is integrated.

use std::f64::consts::PI;
use std::path::Path;

use chainwave_analysis::Spacing;
use chainwave_mechanics::{Bodies, Chain, Integration, Method, Schedule};
use serde::Deserialize;

use crate::configuration::{
    Contact, DriveTable, FarEndTable, FarStrikerTable, GroundTable, MOST_BODIES, Pattern, at_rest, far_end,
};
use crate::error::Error;
use crate::input::numbers::{NotNegative, Positive};
use crate::input::table::Table;
use crate::input::text_file::parse_toml;

/// A chain, what drives it, and how it is integrated.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChainScene {
    #[expect(dead_code, reason = "read to refuse scenes of another model")]
    model: ModelName,
    task: Option<TaskName>,
    n_bodies: usize,
    duration_s: Option<Positive>,
    output_interval_s: Option<Positive>,
    body: Body,
    contact: Contact,
    ground: Option<GroundTable>,
    drive: Option<DriveTable>,
    #[serde(default)]
    far_end: FarEndTable,
    far_striker: Option<FarStrikerTable>,
    #[serde(default)]
    integrator: Integrator,
    /// For `task = "bands"`.
    n_kappa: Option<usize>,
}

/// The model of this scene: one of rings is read elsewhere, and a name that is neither names both.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(try_from = "String")]
struct ModelName;

impl TryFrom<String> for ModelName {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        match name.as_str() {
            "chain" => Ok(Self),
            other => Err(format!("expected \"chain\" or \"ring\", found {other:?}")),
        }
    }
}

/// What is to be done where that is no motion.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum TaskName {
    Bands,
}

/// Points of a band between kappa a = 0 and pi where their number is not stated.
const N_KAPPA: usize = 65;
/// The most points: more would tell nothing, and fill the disk.
const MOST_N_KAPPA: usize = 100_000;

/// The number of points of a band between kappa a = 0 and pi, from what a scene states as `n_kappa`.
///
/// # Errors
/// What is wrong with it: both ends are points, and there are at most 100 000.
pub fn n_kappa(stated: Option<usize>) -> Result<usize, String> {
    let found = stated.unwrap_or(N_KAPPA);
    let makes_sense = (2..=MOST_N_KAPPA).contains(&found);
    makes_sense
        .then_some(found)
        .ok_or_else(|| format!("n_kappa: expected 2 to {MOST_N_KAPPA}, found {found}"))
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

/// A point of a band of small waves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandPoint {
    /// Turn from one cell to the next, in radians.
    pub kappa_a: f64,
    /// Number of the band, from 1 in rising order.
    pub band: u32,
    /// Frequency.
    pub frequency_hz: f64,
}

impl ChainScene {
    /// The scene of a text; an error points at the line. `path` is where the text was read.
    ///
    /// # Errors
    /// A text that is no scene of this model.
    pub fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        let scene: Self = parse_toml(path, text)?;
        if !(1..=MOST_BODIES).contains(&scene.n_bodies) {
            let found = format!("n_bodies: expected 1 to {MOST_BODIES}, found {}", scene.n_bodies);
            return Err(configuration(path, found));
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
    /// A method that is none, a step beside an accuracy, and a scene that asks for bands.
    pub fn schedule(&self, path: &Path) -> Result<Schedule, Error> {
        if self.asks_for_bands() {
            return Err(configuration(
                path,
                "task: expected none where a motion is asked for, found \"bands\"".into(),
            ));
        }
        Ok(Schedule {
            duration_s: needed(self.duration_s, "duration_s", path)?.get(),
            output_interval_s: needed(self.output_interval_s, "output_interval_s", path)?.get(),
            integration: self.integrator.integration(path)?,
            bodies: match self.integrator.bodies {
                BodiesName::Reached => Bodies::Reached,
                BodiesName::All => Bodies::All,
            },
        })
    }

    /// Whether the bands of the chain are asked for, and not its motion.
    pub fn asks_for_bands(&self) -> bool {
        matches!(self.task, Some(TaskName::Bands))
    }

    /// The bands of small waves in the cell that the chain repeats, at equal steps of the turn from cell to cell from 0 to pi, numbered from
    /// 1 in rising order.
    ///
    /// # Errors
    /// As for [`ChainScene::chain`]; a chain that repeats no cell.
    pub fn bands<E: From<Error>>(
        &self,
        path: &Path,
        read: &dyn Fn(&Path) -> Result<Table, E>,
    ) -> Result<Vec<BandPoint>, E> {
        let chain = self.resting(path, read)?;
        let unlike = "expected a chain whose bodies and gaps repeat, of which bands are told, found one that repeats none";
        let cell = chain.unit_cell().ok_or_else(|| configuration(path, unlike.into()))?;
        let n_kappa = n_kappa(self.n_kappa).map_err(|wrong| configuration(path, wrong))?;
        let at = |k: usize| {
            let kappa_a = PI * k as f64 / (n_kappa - 1) as f64;
            let frequencies_hz = cell.frequencies_hz(kappa_a / cell.n_bodies() as f64);
            (1..).zip(frequencies_hz).map(move |(band, frequency_hz)| BandPoint {
                kappa_a,
                band,
                frequency_hz,
            })
        };
        Ok((0..n_kappa).flat_map(at).collect())
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
        self.spacing(path)?;
        self.driven(self.resting(path, read)?, path, read)
    }

    fn resting<E: From<Error>>(
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
        Ok(Chain {
            mass_kg: values(self.body.mass_kg.values(n, "body.mass_kg"))?,
            damping_kg_per_s: values(self.body.damping_kg_per_s.values(n, "body.damping_kg_per_s"))?,
            ground_stiffness_n_per_m: values(ground.unwrap_or_else(|| Ok(Vec::new())))?,
            ground_law: self.ground.as_ref().map(GroundTable::law).transpose().map_err(refused)?,
            contact: contact.contacts(n).map_err(refused)?,
            drive: at_rest(n),
            far_end: far_end.map_err(refused)?,
        })
    }

    fn driven<E: From<Error>>(
        &self,
        mut chain: Chain,
        path: &Path,
        read: &dyn Fn(&Path) -> Result<Table, E>,
    ) -> Result<Chain, E> {
        let n = self.n_bodies;
        let refused = |wrong: Error| configuration(path, wrong.to_string());
        let mut drive = needed(self.drive.clone(), "drive", path)?;
        drive.read_files(path, n, read)?;
        if drive.scatter().is_some() {
            let message = "drive.scatter: expected in an experiment, whose trials scatter, found in a scene";
            return Err(configuration(path, message.into()).into());
        }
        drive.check(&chain).map_err(refused)?;
        let until_s = needed(self.duration_s, "duration_s", path)?.get();
        chain.drive = drive.drive(1.0, &chain, until_s).map_err(refused)?;
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

/// A key that a motion needs.
fn needed<T>(stated: Option<T>, key: &str, path: &Path) -> Result<T, Error> {
    stated.ok_or_else(|| configuration(path, format!("{key}: expected for a motion, found none")))
}

fn configuration(path: &Path, message: String) -> Error {
    Error::Configuration { path: path.to_owned(), message }
}
