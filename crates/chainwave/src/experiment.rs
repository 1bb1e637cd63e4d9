//! `experiment.toml` and `trials.csv`: what was done in the laboratory, and how to evaluate it.

mod numbers;
mod trials;

use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use chainwave_correlation::{Interpolation, ShapeChoice};
use chainwave_measurement::Estimate;
use chainwave_mechanics::PowerLaw;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

pub(crate) use self::numbers::{NotNegative, Positive};
pub(crate) use self::trials::Trial;
use crate::error::Error;
use crate::output::read_text;
use crate::synthesize::{Fault, FilmedRings};

/// An experiment: one chain, filmed in several views and trials.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Experiment {
    /// Name, for the report.
    pub(crate) name: String,
    /// The table of recordings, beside this file.
    pub(crate) trials: PathBuf,
    /// The chain.
    pub(crate) chain: Chain,
    /// What struck it.
    pub(crate) striker: Striker,
    /// The contact law between neighbours, as fitted to a compression curve.
    pub(crate) contact: Contact,
    /// How pictures map to the chain.
    pub(crate) camera: Camera,
    /// How bodies are followed.
    pub(crate) tracking: Tracking,
    /// What is evaluated.
    #[serde(default)]
    pub(crate) analysis: Analysis,
    /// What `synthesize` films.
    pub(crate) synthetic: Option<Synthetic>,
}

/// The chain.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Chain {
    /// Number of bodies, at least two.
    #[serde(deserialize_with = "several")]
    pub(crate) n_bodies: usize,
    /// Distance between neighbouring bodies at rest.
    pub(crate) pitch_m: Positive,
    /// Its standard uncertainty, common to all gaps.
    pub(crate) pitch_sigma_m: Option<NotNegative>,
    /// Mass of a body.
    pub(crate) mass_kg: Positive,
    /// Its standard uncertainty, common to all bodies.
    pub(crate) mass_sigma_kg: Option<NotNegative>,
}

/// What struck the chain.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Striker {
    /// Mass.
    pub(crate) mass_kg: Positive,
    /// Its standard uncertainty.
    pub(crate) mass_sigma_kg: Option<NotNegative>,
    /// Mean velocity at the impact.
    pub(crate) velocity_m_per_s: Positive,
    /// Standard deviation of the velocity from trial to trial.
    pub(crate) velocity_sigma_m_per_s: Positive,
}

/// The contact law F(overlap) = a ((overlap + delta_0)^p - delta_0^p).
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Contact {
    /// Name of the law.
    pub(crate) law: Law,
    /// Prefactor in N/m^p.
    pub(crate) a: Positive,
    /// Effective precompression.
    pub(crate) delta_0_m: Positive,
    /// Exponent.
    pub(crate) p: Positive,
    /// Standard uncertainty of the prefactor.
    pub(crate) a_sigma: Option<NotNegative>,
    /// Standard uncertainty of the effective precompression.
    pub(crate) delta_0_sigma_m: Option<NotNegative>,
    /// Standard uncertainty of the exponent.
    pub(crate) p_sigma: Option<NotNegative>,
}

/// The contact laws known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Law {
    /// The power law.
    Power,
}

/// How pictures map to the chain: by exactly one of a magnification, a ruler, marks or a calibration.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Camera {
    /// Magnification.
    pub(crate) scale_px_per_m: Option<Positive>,
    /// Its standard uncertainty.
    pub(crate) scale_sigma_px_per_m: Option<NotNegative>,
    /// A known length in the picture.
    pub(crate) ruler: Option<Ruler>,
    /// Bodies at rest in the picture, whose distance is the chain's pitch.
    pub(crate) marks: Option<Marks>,
    /// What `chainwave calibrate` wrote, beside this file.
    pub(crate) calibration: Option<PathBuf>,
    /// Column and row of body 1's marker at rest, with the stage at 0.
    pub(crate) first_body_px: [f64; 2],
    /// Standard uncertainty of the stage's stated positions. With it, subsets are placed by the positions that bodies in two views
    /// give; without it, those are reported alone.
    pub(crate) stage_sigma_m: Option<NotNegative>,
    /// Frames per second of recordings that do not state them, such as folders of images.
    pub(crate) rate_hz: Option<Positive>,
}

/// A known length in the picture.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Ruler {
    /// Column and row of both ends.
    pub(crate) ends_px: [[f64; 2]; 2],
    /// Standard uncertainty of an end's place, in each direction.
    pub(crate) sigma_px: NotNegative,
    /// The length.
    pub(crate) length_m: Positive,
    /// Its standard uncertainty.
    pub(crate) length_sigma_m: NotNegative,
}

/// Bodies at rest in the picture.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Marks {
    /// Numbers of the bodies.
    pub(crate) bodies: Vec<i32>,
    /// Column and row of the same point of each.
    pub(crate) at_px: Vec<[f64; 2]>,
    /// Standard uncertainty of a point's place, in each direction.
    pub(crate) sigma_px: NotNegative,
}

/// How bodies are followed.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Tracking {
    /// Columns of a subset on each side of its centre.
    pub(crate) half_width_px: usize,
    /// Rows of a subset above and below its centre.
    pub(crate) half_height_px: usize,
    /// Shape function by name.
    #[serde(default = "Tracking::usual_shape", deserialize_with = "name_of::<_, ShapeChoice>")]
    pub(crate) shape: String,
    /// Interpolation by name.
    #[serde(default = "Tracking::usual_interpolation", deserialize_with = "name_of::<_, Interpolation>")]
    pub(crate) interpolation: String,
    /// Frames stamped before this time show the chain at rest, in seconds after the trigger.
    pub(crate) rest_until_s: f64,
}

impl Tracking {
    fn usual_shape() -> String {
        "affine".into()
    }

    fn usual_interpolation() -> String {
        "quintic".into()
    }
}

/// Reads a number of bodies that make a chain; refused here, a wrong one is shown with its line.
fn several<'de, D: Deserializer<'de>>(number: D) -> Result<usize, D::Error> {
    match usize::deserialize(number)? {
        found @ (0 | 1) => Err(D::Error::custom(format!("expected at least 2 bodies, found {found}"))),
        n_bodies => Ok(n_bodies),
    }
}

/// Reads the name of a `Choice`; refused here, an unknown one is shown with its line.
fn name_of<'de, D, Choice>(name: D) -> Result<String, D::Error>
where
    D: Deserializer<'de>,
    Choice: FromStr<Err: Display>,
{
    let name = String::deserialize(name)?;
    name.parse::<Choice>().map_err(D::Error::custom)?;
    Ok(name)
}

/// What is evaluated.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Analysis {
    /// The leading edge is where a gap first exceeds this fraction of its peak.
    pub(crate) edge_fraction: f64,
    /// First gap of the fit of the group velocity.
    pub(crate) first_gap: Option<usize>,
    /// Last gap of the fit of the group velocity.
    pub(crate) last_gap: Option<usize>,
    /// Times of the strain profiles.
    pub(crate) profile_times_s: Vec<f64>,
    /// Replicas of the measured motion behind each uncertainty.
    pub(crate) n_replicas: usize,
    /// Seed of the replicas' noise.
    pub(crate) seed: u64,
}

impl Default for Analysis {
    /// The profiles are those of the paper's Fig. 2 d-f.
    fn default() -> Self {
        Self {
            edge_fraction: 0.1,
            first_gap: None,
            last_gap: None,
            profile_times_s: vec![2.73e-3, 6.78e-3, 10.88e-3],
            n_replicas: 200,
            seed: 1,
        }
    }
}

/// What `synthesize` films: the truth, and the camera that sees it.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Synthetic {
    /// Seed of everything random.
    pub(crate) seed: u64,
    /// Damping c_d of each body.
    pub(crate) damping_kg_per_s: NotNegative,
    /// Damping c_s of the striker's contact.
    pub(crate) striker_damping_kg_per_s: NotNegative,
    /// Standard deviation of the trigger's delay from trial to trial.
    pub(crate) trigger_jitter_s: NotNegative,
    /// Standard deviation of what the trigger's delay gains from trial to trial and keeps.
    #[serde(default)]
    pub(crate) trigger_walk_s: NotNegative,
    /// Standard deviation of the stage's position, from view to view.
    #[serde(default)]
    pub(crate) stage_sigma_m: NotNegative,
    /// Standard deviation of the mass, from body to body.
    #[serde(default)]
    pub(crate) mass_sigma_kg: NotNegative,
    /// Standard deviation of the contact law's prefactor, relative to it, from gap to gap.
    #[serde(default)]
    pub(crate) stiffness_scatter: NotNegative,
    /// Camera number of the first image (the trigger is image 0).
    pub(crate) first_image: i64,
    /// Frames in a recording.
    pub(crate) n_frames: usize,
    /// The camera.
    pub(crate) camera: chainwave_synthetic::Camera,
    /// The chain as the camera sees it.
    pub(crate) specimen: chainwave_synthetic::Specimen,
    /// The rings that the specimen's bodies are, where they are to move and to bend as the ring model says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) rings: Option<FilmedRings>,
    /// What goes wrong.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) faults: Vec<Fault>,
}

impl Striker {
    /// Relative standard deviation of the velocity from trial to trial.
    pub(crate) fn scatter(&self) -> f64 {
        self.velocity_sigma_m_per_s.get() / self.velocity_m_per_s.get()
    }

    /// Takes another velocity and its scatter; both are above zero.
    pub(crate) fn set_velocity(&mut self, velocity_m_per_s: Estimate) {
        self.velocity_m_per_s = Positive(velocity_m_per_s.value);
        self.velocity_sigma_m_per_s = Positive(velocity_m_per_s.sigma);
    }
}

impl Contact {
    /// The law as the chain model uses it.
    pub(crate) fn power_law(&self) -> Result<PowerLaw, Error> {
        let Law::Power = self.law;
        Ok(PowerLaw::new(self.a.get(), self.delta_0_m.get(), self.p.get())?)
    }
}

impl Experiment {
    /// Films with `noise` times the read noise, and another striker velocity of the same relative scatter.
    pub(crate) fn vary(&mut self, noise: f64, striker_m_per_s: f64) {
        let sigma_m_per_s = self.striker.scatter() * striker_m_per_s;
        self.striker.set_velocity(Estimate::new(striker_m_per_s, sigma_m_per_s));
        if let Some(synthetic) = &mut self.synthetic {
            synthetic.camera.sensor.read_noise_counts *= noise;
        }
    }

    /// Reads `experiment.toml`; an error points at the line.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let text = read_text(path)?;
        let configuration = |wrong: toml::de::Error| Error::Configuration {
            path: path.to_owned(),
            message: wrong.to_string(),
        };
        toml::from_str(&text).map_err(configuration)
    }
}
