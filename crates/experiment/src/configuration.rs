//! `experiment.toml` and `trials.csv`: what was done in the laboratory, and how to evaluate it.

mod analysis;
mod body_state;
mod camera;
mod chain;
mod contact;
mod drive;
mod far_end;
mod far_striker;
mod fault;
mod fill_in;
mod filmed_view;
mod ground;
mod law_file;
mod named;
pub(crate) mod outline;
mod pair;
mod pattern;
mod precompression;
mod rings;
pub(crate) mod shaker;
mod tracking;
mod trial;
mod trials;
mod true_chain;

use std::path::{Path, PathBuf};

use chainwave_measurement::Estimate;
use chainwave_mechanics::{Contacts, FarEnd, LinearChain, TableLaw};
use serde::{Deserialize, Serialize};

pub use self::analysis::Analysis;
pub use self::body_state::BodyState;
pub(crate) use self::camera::middle_px;
pub use self::camera::{Camera, Marks, Ruler};
pub use self::chain::Chain;
pub(crate) use self::chain::MOST_BODIES;
pub use self::contact::{Contact, ContactTable, Gaps, Law};
pub(crate) use self::drive::at_rest;
pub use self::drive::{DriveTable, imposed_motion};
pub use self::far_end::FarEndTable;
pub use self::far_striker::FarStrikerTable;
pub(crate) use self::far_striker::far_end;
pub use self::fault::{FAULT_KINDS, Fault};
use self::fill_in::expect_filled_in;
pub use self::filmed_view::FilmedView;
pub use self::ground::GroundTable;
pub use self::pattern::Pattern;
pub use self::rings::FilmedRings;
pub use self::tracking::Tracking;
pub use self::trial::Trial;
pub use self::true_chain::TrueChain;
use crate::error::Error;
use crate::input::numbers::{NotNegative, Positive};
use crate::input::table::Table;
use crate::input::text_file::{a_folder_of_recordings, parse_toml, read_text};

/// An experiment: one chain, filmed in several views and trials.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Name, for the report.
    pub name: String,
    /// The table of recordings, beside this file.
    pub trials: PathBuf,
    /// What a reader of the pictures corrected, beside this file; `corrections.csv` there, where it exists, unless it is named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub corrections: Option<PathBuf>,
    /// The chain.
    pub chain: Chain,
    /// What struck it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub striker: Option<Striker>,
    /// What set it in motion, where no striker did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive: Option<DriveTable>,
    /// What lies in the gaps: a contact law as fitted to a compression curve, one for each gap, or some that take turns.
    pub contact: Contact,
    /// What holds each body to ground besides springs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground: Option<GroundTable>,
    /// What stands behind the last body.
    #[serde(default, skip_serializing_if = "FarEndTable::is_free")]
    pub far_end: FarEndTable,
    /// What struck its far end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub far_striker: Option<FarStrikerTable>,
    /// How pictures map to the chain.
    pub camera: Camera,
    /// How bodies are followed.
    pub tracking: Tracking,
    /// How well triggers repeat.
    #[serde(default, skip_serializing_if = "Trigger::is_unknown")]
    pub trigger: Trigger,
    /// What is evaluated.
    #[serde(default)]
    pub analysis: Analysis,
    /// What `synthesize` films.
    pub synthetic: Option<Synthetic>,
}

/// What struck the chain.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Striker {
    /// Mass.
    pub mass_kg: Positive,
    /// Its standard uncertainty.
    pub mass_sigma_kg: Option<NotNegative>,
    /// Mean velocity at the impact.
    pub velocity_m_per_s: Positive,
    /// Standard deviation of the velocity from trial to trial.
    pub velocity_sigma_m_per_s: Positive,
}

/// How well triggers repeat, where it is known.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trigger {
    /// Standard deviation of the trigger's delay from trial to trial of a view.
    pub sigma_s: Option<Positive>,
    /// The same from view to view, in common for all trials of a view.
    pub view_sigma_s: Option<NotNegative>,
}

impl Trigger {
    fn is_unknown(&self) -> bool {
        *self == Self::default()
    }
}

/// What `synthesize` films: the truth, and the camera that sees it.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Synthetic {
    /// Seed of everything random.
    pub seed: u64,
    /// Seed of the pictures' noise, where it is another one: the same strikes, triggers and views, filmed once more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_seed: Option<u64>,
    /// Damping c_d of each body.
    pub damping_kg_per_s: NotNegative,
    /// Damping c_s of the striker's contact, where there is a striker.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub striker_damping_kg_per_s: Option<NotNegative>,
    /// Standard deviation of the trigger's delay from trial to trial.
    pub trigger_jitter_s: NotNegative,
    /// Standard deviation of what the trigger's delay gains from trial to trial and keeps.
    #[serde(default)]
    pub trigger_walk_s: NotNegative,
    /// Standard deviation of the trigger's delay from view to view, in common for all trials of a view.
    #[serde(default)]
    pub trigger_view_s: NotNegative,
    /// Standard deviation of the striker's velocity, or of any other drive, from trial to trial, relative to it, where it is not what is stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub striker_scatter: Option<NotNegative>,
    /// Standard deviation of the stage's position, from view to view.
    #[serde(default)]
    pub stage_sigma_m: NotNegative,
    /// Standard deviation of the mass, from body to body.
    #[serde(default)]
    pub mass_sigma_kg: NotNegative,
    /// Standard deviation of the contact law's prefactor, relative to it, from gap to gap.
    #[serde(default)]
    pub stiffness_scatter: NotNegative,
    /// What is true of the chain that is filmed, where that is not what is stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chain: Option<TrueChain>,
    /// Camera number of the first image (the trigger is image 0).
    pub first_image: i64,
    /// Frames in a recording.
    pub n_frames: usize,
    /// Views that are filmed in another way.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<FilmedView>,
    /// The camera.
    pub camera: chainwave_synthetic::Camera,
    /// The chain as the camera sees it.
    pub specimen: chainwave_synthetic::Specimen,
    /// The rings that the specimen's bodies are, where they are to move and to bend as the ring model says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rings: Option<FilmedRings>,
    /// What goes wrong.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
}

impl Striker {
    /// Relative standard deviation of the velocity from trial to trial.
    pub fn scatter(&self) -> f64 {
        self.velocity_sigma_m_per_s.get() / self.velocity_m_per_s.get()
    }

    /// The mean velocity of so many strikes, as stated.
    pub fn mean_velocity_m_per_s(&self, n_strikes: usize) -> Estimate {
        let sigma = self.velocity_sigma_m_per_s.get() / (n_strikes.max(1) as f64).sqrt();
        Estimate::new(self.velocity_m_per_s.get(), sigma)
    }

    /// Takes another velocity and its scatter; both are above zero.
    pub fn set_velocity(&mut self, velocity_m_per_s: Estimate) {
        self.velocity_m_per_s = Positive(velocity_m_per_s.value);
        self.velocity_sigma_m_per_s = Positive(velocity_m_per_s.sigma);
    }
}

impl Experiment {
    /// The chain as long, small waves feel it: the mean mass, and springs in series at zero overlap (J. Billingham and A. C. King, Wave
    /// Motion (2000), for a chain that repeats). Where bodies or gaps differ its band is that of the chain that is alike throughout; [`Experiment::bands`] has the chain's own.
    ///
    /// # Errors
    /// A contact law that makes no sense.
    pub fn linear_chain(&self) -> Result<LinearChain, Error> {
        let n_bodies = self.chain.n_bodies;
        let contacts = self.contact.contacts(n_bodies)?;
        let soft = |gap: usize| contacts.of_gap(gap).stiffness_n_per_m(0.0).recip();
        let stiffness_n_per_m = match &contacts {
            Contacts::Same(_) => contacts.k_0_n_per_m(),
            _ => (n_bodies - 1) as f64 / (0..n_bodies - 1).map(soft).sum::<f64>(),
        };
        let by_curve = self.ground_law()?.map_or(0.0, |law| law.stiffness_n_per_m(0.0));
        let ground_n_per_m = self.chain.mean_ground_n_per_m() + by_curve;
        Ok(LinearChain { stiffness_n_per_m, mass_kg: self.chain.mean_mass_kg(), ground_n_per_m })
    }

    /// Films with `noise` times the read noise, and another strength of the drive ([`Experiment::nominal_drive`]) of the same relative
    /// scatter: another striker velocity, or so many times a shaker's amplitude or the state of a release.
    pub fn vary(&mut self, noise: f64, strength: f64) {
        let scatter = self.drive_scatter();
        if let Some(striker) = &mut self.striker {
            striker.set_velocity(Estimate::new(strength, scatter * strength));
        }
        if let Some(drive) = &mut self.drive {
            drive.strengthen(strength);
        }
        if let Some(synthetic) = &mut self.synthetic {
            synthetic.camera.sensor.read_noise_counts *= noise;
        }
    }

    /// Reads `experiment.toml`; an error points at the line.
    pub fn read(path: &Path) -> Result<Self, Error> {
        if path.is_dir() {
            return Err(a_folder_of_recordings(path));
        }
        Self::parse(path, &read_text(path)?)
    }

    /// The experiment of a text; an error points at the line. Files that it names are looked for beside `path`, where the text stands.
    ///
    /// # Errors
    /// A text that is no experiment, and files of contact laws that cannot be read.
    pub fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        expect_filled_in(path, text)?;
        let mut experiment: Self = parse_toml(path, text)?;
        experiment.contact.read_files(path, Table::read_csv)?;
        experiment.far_striker.as_mut().map_or(Ok(()), |far| far.read_files(path, Table::read_csv))?;
        let n_bodies = experiment.chain.n_bodies;
        let drive = experiment.drive.as_mut();
        drive.map_or(Ok(()), |drive| drive.read_files(path, n_bodies, &Table::read_csv))?;
        experiment
            .check_chain()
            .map_err(|wrong| Error::Configuration { path: path.to_owned(), message: wrong.to_string() })?;
        Ok(experiment)
    }

    /// The curve by which ground holds the bodies; none where none is stated.
    ///
    /// # Errors
    /// Points that make no curve.
    pub fn ground_law(&self) -> Result<Option<TableLaw>, Error> {
        self.ground.as_ref().map(GroundTable::law).transpose()
    }

    /// What stands behind the last body.
    ///
    /// # Errors
    /// A striker behind a wall, and a contact law that makes no sense.
    pub fn far_end(&self) -> Result<FarEnd, Error> {
        far_end(self.far_end, self.far_striker.as_ref())
    }

    /// Refuses what is no chain's, and what cannot be asked of it.
    fn check_chain(&self) -> Result<(), Error> {
        let chain = &self.chain;
        chain.masses_kg()?;
        chain.spacing()?;
        chain.dampings_kg_per_s(1.0)?;
        chain.ground_n_per_m()?;
        self.ground_law()?;
        self.contact.contacts(chain.n_bodies)?;
        self.far_end()?;
        self.analysis.check(chain.n_bodies - 1)?;
        self.check_drive()
    }
}
