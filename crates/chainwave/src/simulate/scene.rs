//! `SCENE.toml` of a chain, as interface.md gives it.

use std::fmt;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use chainwave_mechanics::{
    Bodies, Chain, Contact, Contacts, Drive, FarEnd, ImposedMotion, Integration, Law, LinearLaw, Method,
    PowerLaw, Schedule, Striker, TableLaw, Tension,
};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{DeserializeOwned, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::error::Error;
use crate::output::read_text;
use crate::table;
use chainwave_experiment::{NotNegative, Positive};

/// A chain, what drives it, and how it is integrated.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ChainScene {
    #[expect(dead_code, reason = "read to refuse scenes of another model")]
    model: ModelName,
    n_bodies: usize,
    duration_s: Positive,
    output_interval_s: Positive,
    body: Body,
    contact: OneOrMany<ContactTable>,
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
    pitch_m: Positive,
    damping_kg_per_s: PerBody<NotNegative>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum PerBody<T> {
    All(T),
    Each(Vec<T>),
}

/// A table, or a list of tables. Unlike an untagged enum it passes on what is wrong inside.
#[derive(Debug)]
enum OneOrMany<T> {
    One(T),
    Many(Vec<T>),
}

#[derive(Debug, Deserialize)]
#[serde(tag = "law", rename_all = "lowercase", deny_unknown_fields)]
enum ContactTable {
    Power {
        a: Positive,
        delta_0_m: Positive,
        p: Positive,
        #[serde(default)]
        tension: TensionName,
        tension_limit: Option<f64>,
        damping_kg_per_s: Option<NotNegative>,
    },
    Linear {
        k_n_per_m: Positive,
        #[serde(default)]
        tension: TensionName,
        damping_kg_per_s: Option<NotNegative>,
    },
    Table {
        file: PathBuf,
        #[serde(default)]
        tension: TensionName,
        damping_kg_per_s: Option<NotNegative>,
    },
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum TensionName {
    #[default]
    Tangent,
    Detach,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
enum DriveTable {
    Striker { mass_kg: Positive, velocity_m_per_s: Positive, damping_kg_per_s: NotNegative },
    Imposed { file: PathBuf },
    Free { initial: PathBuf },
}

/// `[far_end]` of a scene of either model.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum FarEndTable {
    #[default]
    Free,
    Fixed,
}

impl From<FarEndTable> for FarEnd {
    fn from(table: FarEndTable) -> Self {
        match table {
            FarEndTable::Free => Self::Free,
            FarEndTable::Fixed => Self::Fixed,
        }
    }
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
    /// Reads a scene; an error points at the line.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let scene: Self =
            toml::from_str(&read_text(path)?).map_err(|wrong| configuration(path, wrong.to_string()))?;
        if scene.n_bodies == 0 {
            return Err(configuration(path, "n_bodies: expected at least 1, found 0".into()));
        }
        Ok(scene)
    }

    /// Distance between neighbouring bodies at rest, in metres.
    pub(crate) fn pitch_m(&self) -> f64 {
        self.body.pitch_m.get()
    }

    /// The schedule; `path` is that of the scene.
    pub(crate) fn schedule(&self, path: &Path) -> Result<Schedule, Error> {
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

    /// The chain; files are looked for beside the scene at `path`.
    pub(crate) fn chain(&self, path: &Path) -> Result<Chain, Error> {
        let contact = match &self.contact {
            OneOrMany::One(table) => Contacts::Same(table.contact(path)?),
            OneOrMany::Many(tables) => {
                Contacts::Each(tables.iter().map(|table| table.contact(path)).collect::<Result<_, Error>>()?)
            }
        };
        Ok(Chain {
            mass_kg: self.per_body(path, "mass_kg", &self.body.mass_kg, Positive::get)?,
            damping_kg_per_s: self.per_body(
                path,
                "damping_kg_per_s",
                &self.body.damping_kg_per_s,
                NotNegative::get,
            )?,
            contact,
            drive: self.drive.drive(path, self.n_bodies)?,
            far_end: self.far_end.into(),
        })
    }

    fn per_body<T: Copy>(
        &self,
        path: &Path,
        key: &str,
        values: &PerBody<T>,
        get: impl Fn(T) -> f64,
    ) -> Result<Vec<f64>, Error> {
        match values {
            PerBody::All(value) => Ok(vec![get(*value); self.n_bodies]),
            PerBody::Each(values) if values.len() == self.n_bodies => {
                Ok(values.iter().map(|value| get(*value)).collect())
            }
            PerBody::Each(values) => {
                let (expected, found) = (self.n_bodies, values.len());
                let message =
                    format!("body.{key}: expected a number or {expected} numbers (n_bodies), found {found}");
                Err(configuration(path, message))
            }
        }
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

impl ContactTable {
    fn contact(&self, path: &Path) -> Result<Contact, Error> {
        let damping = |damping: &Option<NotNegative>| damping.map_or(0.0, NotNegative::get);
        Ok(match self {
            Self::Power { a, delta_0_m, p, tension, tension_limit, damping_kg_per_s } => Contact {
                law: Law::Power(PowerLaw::new(a.get(), delta_0_m.get(), p.get())?),
                tension: tension.rule_from(*tension_limit, path)?,
                damping_kg_per_s: damping(damping_kg_per_s),
            },
            Self::Linear { k_n_per_m, tension, damping_kg_per_s } => Contact {
                law: Law::Linear(LinearLaw::new(k_n_per_m.get())?),
                tension: tension.rule(),
                damping_kg_per_s: damping(damping_kg_per_s),
            },
            Self::Table { file, tension, damping_kg_per_s } => {
                let table = table::read(&path.with_file_name(file))?;
                let points = (table.full_numbers("overlap_m")?, table.full_numbers("force_n")?);
                Contact {
                    law: Law::Table(TableLaw::new(&points.0, &points.1)?),
                    tension: tension.rule(),
                    damping_kg_per_s: damping(damping_kg_per_s),
                }
            }
        })
    }
}

impl TensionName {
    fn rule(self) -> Tension {
        match self {
            Self::Detach => Tension::Detach,
            Self::Tangent => Tension::default(),
        }
    }

    /// The rule with the overlap over delta_0 where the tangent takes over.
    fn rule_from(self, limit: Option<f64>, path: &Path) -> Result<Tension, Error> {
        match (self, limit) {
            (_, None) => Ok(self.rule()),
            (Self::Tangent, Some(limit)) => Ok(Tension::Tangent { limit }),
            (Self::Detach, Some(_)) => {
                let message = "contact: expected tension_limit with tension = \"tangent\" only, found it with \"detach\"";
                Err(configuration(path, message.into()))
            }
        }
    }
}

impl DriveTable {
    fn drive(&self, path: &Path, n_bodies: usize) -> Result<Drive, Error> {
        Ok(match self {
            Self::Striker { mass_kg, velocity_m_per_s, damping_kg_per_s } => Drive::Striker(Striker {
                mass_kg: mass_kg.get(),
                velocity_m_per_s: velocity_m_per_s.get(),
                damping_kg_per_s: damping_kg_per_s.get(),
            }),
            Self::Imposed { file } => {
                let table = table::read(&path.with_file_name(file))?;
                let (times_s, x_m) = (table.full_numbers("t_s")?, table.full_numbers("x_m")?);
                Drive::Imposed(ImposedMotion::from_samples(times_s, x_m)?)
            }
            Self::Free { initial } => {
                let State { displacement_m, velocity_m_per_s } =
                    State::read(&path.with_file_name(initial), n_bodies)?;
                Drive::Free { displacement_m, velocity_m_per_s }
            }
        })
    }
}

/// Displacements and velocities of all bodies.
pub(super) struct State {
    pub(super) displacement_m: Vec<f64>,
    pub(super) velocity_m_per_s: Vec<f64>,
}

impl State {
    /// Reads a state by the rows' body numbers, from 1; bodies without a row are at rest.
    pub(super) fn read(path: &Path, n_bodies: usize) -> Result<Self, Error> {
        let table = table::read(path)?;
        let bodies = table.counts("body")?;
        let (x_m, v_m_per_s) = (table.full_numbers("x_m")?, table.full_numbers("v_m_per_s")?);
        let mut state = Self { displacement_m: vec![0.0; n_bodies], velocity_m_per_s: vec![0.0; n_bodies] };
        let mut seen = vec![false; n_bodies];
        for (row, body) in bodies.into_iter().enumerate() {
            let index = body.wrapping_sub(1);
            if index >= n_bodies || std::mem::replace(&mut seen[index], true) {
                let expected = format!("each body once, from 1 to {n_bodies}");
                return Err(table.cell(row, "body", &expected, &body.to_string()).into());
            }
            state.displacement_m[index] = x_m[row];
            state.velocity_m_per_s[index] = v_m_per_s[row];
        }
        Ok(state)
    }
}

fn configuration(path: &Path, message: String) -> Error {
    Error::configuration(path, message)
}

impl<'de, T: DeserializeOwned> Deserialize<'de> for OneOrMany<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OneOrManyVisitor(PhantomData))
    }
}

struct OneOrManyVisitor<T>(PhantomData<T>);

impl<'de, T: DeserializeOwned> Visitor<'de> for OneOrManyVisitor<T> {
    type Value = OneOrMany<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table or a list of tables")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        T::deserialize(MapAccessDeserializer::new(map)).map(OneOrMany::One)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, sequence: A) -> Result<Self::Value, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(sequence)).map(OneOrMany::Many)
    }
}
