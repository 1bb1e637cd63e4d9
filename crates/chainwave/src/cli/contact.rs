//! Arguments of `contact`.

use std::path::PathBuf;

use chainwave_inference::contact_fit;
use clap::{Args, ValueEnum};

/// Arguments of `contact`.
#[derive(Debug, Args)]
pub(crate) struct Contact {
    /// Table of the curve: overlap_m,force_n in the order of the measurement, both positive in compression.
    pub(crate) curve: PathBuf,
    /// Law to write, as TOML.
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Where overlap and force are zero.
    #[arg(long, value_enum, default_value_t = Zero::Auto)]
    pub(crate) zero: Zero,
}

/// Where overlap and force of a compression curve are zero.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum Zero {
    /// Contact where there are readings before it, else load-cell where its offset is real, else stated.
    Auto,
    /// At overlap 0 and force 0, as the curve states.
    Stated,
    /// At overlap 0; the load cell's offset is fitted along.
    LoadCell,
    /// Where the force leaves its level before contact; that overlap is fitted along.
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
