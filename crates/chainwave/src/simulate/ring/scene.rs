//! Scenes of rings, as TOML has them.

use std::path::{Path, PathBuf};

use chainwave_mechanics::{Ring, RingChain, RingDrive, RingSchedule, RingStriker};
use serde::Deserialize;

use crate::error::Error;
use crate::parallel::threads;
use crate::table;
use chainwave_experiment::{
    BodyState, FarEndTable, NotNegative, Positive, imposed_motion, n_kappa, parse_toml,
};

use super::figures::FiguresTable;

/// `SCENE.toml` of rings, as interface.md gives it. What a task does not need may be left out.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RingScene {
    #[expect(dead_code, reason = "was looked at to find that this is a scene of rings")]
    model: String,
    task: Option<TaskName>,
    n_bodies: Option<usize>,
    duration_s: Option<Positive>,
    output_interval_s: Option<Positive>,
    body: Option<Body>,
    pub(super) ring: RingTable,
    drive: Option<DriveTable>,
    #[serde(default)]
    far_end: FarEndTable,
    #[serde(default)]
    integrator: Integrator,
    /// File beside the motion for the rings' shapes.
    pub(super) shapes_file: Option<PathBuf>,
    pub(super) figures: Option<FiguresTable>,
    /// For `task = "modes"`: modes of each boundary and symmetry.
    n_modes: Option<usize>,
    /// For `task = "bands"`.
    n_bands: Option<usize>,
    n_kappa: Option<usize>,
    #[serde(default)]
    symmetry: Bands,
}

/// What is to be done.
#[derive(Debug)]
pub(super) enum Task {
    Motion,
    Compression { max_overlap_m: f64, n_steps: usize },
    Modes { n_modes: usize },
    Bands(BandsAsked),
}

/// Which bands are wanted, and at how many points between 0 and pi.
#[derive(Debug, Clone, Copy)]
pub(super) struct BandsAsked {
    pub(super) symmetry: Bands,
    pub(super) n_bands: usize,
    pub(super) n_kappa: usize,
}

/// How fine the rings are divided.
#[derive(Debug, Clone, Copy)]
pub(super) enum Mesh {
    Elements(usize),
    Accuracy(f64),
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum TaskName {
    Modes,
    Bands,
}

/// Waves along the chain that a strike excites, or those across it as well.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Bands {
    #[default]
    Symmetric,
    All,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Body {
    pitch_m: Option<Positive>,
    damping_kg_per_s: Option<NotNegative>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RingTable {
    semi_major_m: Positive,
    semi_minor_m: Positive,
    wall_m: Positive,
    width_m: Positive,
    young_pa: Positive,
    poisson: f64,
    density_kg_per_m3: Positive,
    elements_per_ring: Option<usize>,
    accuracy: Option<Positive>,
    /// Height of the bond with a neighbour; without it the bond is a line.
    bond_width_m: Option<NotNegative>,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
enum DriveTable {
    Striker {
        mass_kg: Positive,
        velocity_m_per_s: NotNegative,
        #[serde(default)]
        damping_kg_per_s: Option<NotNegative>,
        contact_stiffness_n_per_m: Positive,
    },
    Imposed {
        file: PathBuf,
    },
    Free {
        /// State of the joints, body 1 to N + 1.
        initial: PathBuf,
    },
    Compression {
        max_overlap_m: Positive,
        n_steps: usize,
    },
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Integrator {
    method: Method,
    dt_s: Option<Positive>,
    accuracy: Option<Positive>,
    threads: Option<u16>,
}

/// The automatic choice is the only rung there is; it may be named.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Method {
    #[default]
    Auto,
    Verlet,
}

impl RingScene {
    /// The scene of a text that was read at `path`.
    pub(super) fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        Ok(parse_toml(path, text)?)
    }

    /// Whether an accuracy of the integrator is stated that the stated elements leave nothing to choose for.
    pub(super) fn states_accuracy_beside_elements(&self) -> bool {
        self.ring.elements_per_ring.is_some() && self.integrator.accuracy.is_some()
    }

    pub(super) fn task(&self, path: &Path) -> Result<Task, Error> {
        let Integrator { method: Method::Auto | Method::Verlet, .. } = self.integrator;
        Ok(match (self.task, &self.drive) {
            (Some(TaskName::Modes), _) => Task::Modes { n_modes: self.n_modes.unwrap_or(8) },
            (Some(TaskName::Bands), _) => Task::Bands(BandsAsked {
                symmetry: self.symmetry,
                n_bands: self.n_bands.unwrap_or(4),
                n_kappa: n_kappa(self.n_kappa).map_err(|wrong| wrong_in(path, wrong))?,
            }),
            (None, Some(DriveTable::Compression { max_overlap_m, n_steps })) => {
                Task::Compression { max_overlap_m: max_overlap_m.get(), n_steps: *n_steps }
            }
            (None, Some(_)) => Task::Motion,
            (None, None) => return Err(missing(path, "[drive]", "or task = \"modes\" or \"bands\"")),
        })
    }

    pub(super) fn mesh(&self, path: &Path) -> Result<Mesh, Error> {
        match (self.ring.elements_per_ring, self.ring.accuracy.or(self.integrator.accuracy)) {
            (Some(elements), _) => Ok(Mesh::Elements(elements)),
            (None, Some(accuracy)) => Ok(Mesh::Accuracy(accuracy.get())),
            (None, None) => Err(missing(path, "ring.elements_per_ring", "or ring.accuracy")),
        }
    }

    pub(super) fn chain(&self, path: &Path) -> Result<RingChain, Error> {
        let n_rings = self.n_bodies.ok_or_else(|| missing(path, "n_bodies", "the number of rings"))?;
        let drive = self.drive.as_ref().map(|drive| drive.of_motion(path, n_rings)).transpose()?.flatten();
        let kinds = "kind = \"striker\", \"imposed\" or \"free\"";
        let drive = drive.ok_or_else(|| missing(path, "[drive]", kinds))?;
        let damping = self.body.as_ref().and_then(|body| body.damping_kg_per_s);
        Ok(RingChain {
            ring: self.ring.ring(),
            n_rings,
            elements_per_ring: self.ring.elements_per_ring.unwrap_or(0),
            damping_kg_per_s: damping.map_or(0.0, NotNegative::get),
            drive,
            far_end: self.far_end.into(),
        })
    }

    /// Length of a cell, which strains are relative to.
    pub(super) fn pitch_m(&self, path: &Path) -> Result<f64, Error> {
        let pitch_m = self.body.as_ref().and_then(|body| body.pitch_m);
        pitch_m.map(Positive::get).ok_or_else(|| missing(path, "body.pitch_m", "for the figures"))
    }

    pub(super) fn schedule(&self, path: &Path, jobs: Option<u16>) -> Result<RingSchedule, Error> {
        let time = |value: Option<Positive>, name: &str| {
            value.map(Positive::get).ok_or_else(|| missing(path, name, "a time in seconds"))
        };
        Ok(RingSchedule {
            duration_s: time(self.duration_s, "duration_s")?,
            output_interval_s: time(self.output_interval_s, "output_interval_s")?,
            dt_s: self.integrator.dt_s.map(Positive::get),
            shapes: self.shapes_file.is_some(),
            n_threads: threads(jobs.or(self.integrator.threads)).get(),
        })
    }
}

impl DriveTable {
    /// What moves a chain of so many rings; none where the rings are pressed together as a test machine does.
    fn of_motion(&self, path: &Path, n_rings: usize) -> Result<Option<RingDrive>, Error> {
        Ok(Some(match self {
            Self::Striker { mass_kg, velocity_m_per_s, damping_kg_per_s, contact_stiffness_n_per_m } => {
                RingDrive::Striker(RingStriker {
                    mass_kg: mass_kg.get(),
                    velocity_m_per_s: velocity_m_per_s.get(),
                    contact_stiffness_n_per_m: contact_stiffness_n_per_m.get(),
                    damping_kg_per_s: damping_kg_per_s.map_or(0.0, NotNegative::get),
                })
            }
            Self::Imposed { file } => {
                RingDrive::Imposed(imposed_motion(&table::read(&path.with_file_name(file))?)?)
            }
            Self::Free { initial } => {
                let table = table::read(&path.with_file_name(initial))?;
                let BodyState { displacement_m, velocity_m_per_s } =
                    BodyState::of_table(&table, n_rings.saturating_add(1))?;
                RingDrive::Free { displacement_m, velocity_m_per_s }
            }
            Self::Compression { .. } => return Ok(None),
        }))
    }
}

impl RingTable {
    pub(super) fn ring(&self) -> Ring {
        Ring {
            semi_major_m: self.semi_major_m.get(),
            semi_minor_m: self.semi_minor_m.get(),
            wall_m: self.wall_m.get(),
            width_m: self.width_m.get(),
            young_pa: self.young_pa.get(),
            poisson: self.poisson,
            density_kg_per_m3: self.density_kg_per_m3.get(),
            bond_width_m: self.bond_width_m.map_or(0.0, NotNegative::get),
        }
    }

    /// The elements stated, or as many where no accuracy is asked for either.
    pub(super) fn elements_or(&self, elements: usize, path: &Path) -> Result<usize, Error> {
        match (self.elements_per_ring, self.accuracy) {
            (Some(stated), _) => Ok(stated),
            (None, None) => Ok(elements),
            (None, Some(_)) => Err(wrong_in(
                path,
                "ring.accuracy: expected elements_per_ring for this task, found an accuracy (which is measured on motions)".into(),
            )),
        }
    }
}

fn wrong_in(path: &Path, message: String) -> Error {
    Error::configuration(path, message)
}

fn missing(path: &Path, what: &str, hint: &str) -> Error {
    wrong_in(path, format!("{what}: expected a value, found none ({hint})"))
}
