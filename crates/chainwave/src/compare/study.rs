//! `STUDY.toml`: what is set beside each other, and what was published.

use std::path::{Path, PathBuf};

use chainwave_experiment::{Positive, read_toml};
use serde::Deserialize;

use crate::error::Error;

/// A study: one experiment at several strikes, its models, and what was published. Paths are relative to the folder of `--from`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Study {
    /// Distance of neighbours at rest.
    pub(super) pitch_m: Positive,
    /// Speed of long, small waves, drawn as a level.
    pub(super) sound_speed_m_per_s: Positive,
    /// Times of the strain profiles.
    pub(super) profile_times_s: Vec<f64>,
    /// What the run of several strikes wrote: `striker_velocity_m_per_s, sigma, group_velocity_m_per_s, group_velocity_sigma, source`.
    pub(super) group_velocities: PathBuf,
    /// A compression curve and the law fitted to it.
    pub(super) contact: ContactFiles,
    /// The strikes; maps and profiles show the first.
    pub(super) strikes: Vec<Strike>,
    /// Rings without damping, long enough for the pulse to unfold.
    pub(super) long_chain: LongRings,
    /// Contact laws that the chain model has; figures show the first.
    pub(super) laws: Vec<Law>,
    /// The tail behind the front, after the first strike.
    pub(super) tail: Option<Tail>,
    /// Last gap of the peak energies.
    pub(super) energy_gap: usize,
    /// What was published.
    #[serde(default)]
    pub(super) published: Vec<Published>,
}

/// A compression curve and the law fitted to it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ContactFiles {
    /// `overlap_m, force_n`.
    pub(super) curve: PathBuf,
    /// What `chainwave contact` wrote.
    pub(super) law: PathBuf,
}

/// One velocity of the striker.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Strike {
    /// The velocity.
    pub(super) velocity_m_per_s: Positive,
    /// Results of its run.
    pub(super) experiment: PathBuf,
    /// Motion of the rings' joints.
    pub(super) rings: PathBuf,
    /// Motion of the chain model.
    pub(super) chain: PathBuf,
}

/// The long chain of rings.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LongRings {
    /// Motion of its joints.
    pub(super) rings: PathBuf,
    /// Times of the strain profiles.
    pub(super) profile_times_s: Vec<f64>,
    /// Times of the pulses aligned at their peaks.
    pub(super) pulse_times_s: Vec<f64>,
}

/// A contact law of the chain model, and the folder of what it gives: `scan.parquet` of strikes on the short chain, `undamped.json` and
/// `damped.json` of the long one.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Law {
    /// Its name in the table.
    pub(super) name: String,
    /// The folder.
    pub(super) folder: PathBuf,
}

/// What the tail's spectra are shown with.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Tail {
    /// Natural modes of one ring, as `simulate` writes them.
    pub(super) modes: PathBuf,
    /// Upper end of the frequency axis.
    pub(super) max_frequency_hz: Positive,
}

/// A published number.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Published {
    /// What it is of.
    pub(super) quantity: Quantity,
    /// As it was published.
    pub(super) said: String,
    /// As a number, where it is one.
    pub(super) value: Option<f64>,
    /// Where and why what is found here differs.
    pub(super) why: String,
}

/// What is compared, in the order of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Quantity {
    /// Group velocity after the weakest strike.
    WeakGroupVelocity,
    /// Group velocity after each strike.
    GroupVelocity,
    /// Its variation along the short chain: last third of its gaps less the first, relative to the whole.
    GroupVelocityVariation,
    /// Half width of the front at the last time at which it is shown, over that at the first.
    HalfWidthGrowth,
    /// Share of the peak energy that is gone at the last gap without damping.
    UndampedDrop,
    /// Share of it that damping takes besides.
    DampingShare,
}

impl Quantity {
    /// Its name in the table.
    pub(super) fn as_str(self) -> &'static str {
        match self {
            Self::WeakGroupVelocity => "group velocity after the weakest strike",
            Self::GroupVelocity => "group velocity",
            Self::GroupVelocityVariation => "variation of the group velocity along the chain",
            Self::HalfWidthGrowth => "growth of the front's half width",
            Self::UndampedDrop => "drop of the peak energy without damping",
            Self::DampingShare => "drop that damping adds",
        }
    }

    /// Its unit; empty of a ratio.
    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::WeakGroupVelocity | Self::GroupVelocity => "m/s",
            _ => "",
        }
    }
}

impl Study {
    /// Reads a study; an error points at the line.
    pub(super) fn read(path: &Path) -> Result<Self, Error> {
        let study: Self = read_toml(path)?;
        for (name, is_empty) in [("strikes", study.strikes.is_empty()), ("laws", study.laws.is_empty())] {
            if is_empty {
                return Err(Error::configuration(
                    path,
                    format!("[[{name}]]: expected at least one, found none"),
                ));
            }
        }
        Ok(study)
    }
}
