//! Arguments of `contact`.

use std::path::PathBuf;

use chainwave_inference::contact_fit;
use clap::{Args, ValueEnum};

/// Arguments of `contact`.
#[derive(Debug, Args)]
pub(crate) struct Contact {
    /// Table of the compression curve: overlap_m,force_n in the order of the measurement, both positive in compression.
    pub(crate) curve: PathBuf,
    /// Contact law to write (TOML).
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// How the origin of overlap and force is found.
    #[arg(long, value_enum, default_value_t = Zero::Auto)]
    pub(crate) zero: Zero,
}

/// Where overlap and force of a compression curve are zero.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum Zero {
    /// `contact` if there are readings before contact, else `load-cell` if its offset is significant, else `stated`.
    Auto,
    /// At overlap 0 and force 0, as the curve states.
    Stated,
    /// At overlap 0; the offset of the load cell is fitted too.
    LoadCell,
    /// Where the force departs from its level before contact; that overlap is fitted too.
    Contact,
}

impl Zero {
    /// The rule of the fit.
    pub(crate) fn rule(self) -> contact_fit::Zero {
        match self {
            Self::Auto => contact_fit::Zero::Auto,
            Self::Stated => contact_fit::Zero::Stated,
            Self::LoadCell => contact_fit::Zero::LoadCell,
            Self::Contact => contact_fit::Zero::Contact,
        }
    }
}
