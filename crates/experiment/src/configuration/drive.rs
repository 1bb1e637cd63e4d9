//! `[drive]`: what sets a chain in motion. One table for scenes and, where no striker does it, for experiments.

use std::path::{Path, PathBuf};

use chainwave_mechanics::{Chain, Drive, ImposedMotion, Striker};
use serde::{Deserialize, Serialize};

use super::body_state::BodyState;
use super::precompression::precompressed_m;
use crate::configuration::shaker::Shaker;
use crate::error::Error;
use crate::input::numbers::{NotNegative, Positive};
use crate::input::table::Table;

/// What sets a chain in motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum DriveTable {
    /// A body that strikes body 1. An experiment states it as `[striker]`.
    Striker {
        /// Mass.
        mass_kg: Positive,
        /// Velocity at the impact.
        velocity_m_per_s: Positive,
        /// Damping of its contact.
        damping_kg_per_s: NotNegative,
    },
    /// A sine imposed on body 1.
    Shaker {
        /// Frequency.
        frequency_hz: Positive,
        /// Displacement from the middle.
        amplitude_m: Positive,
        /// Time in which the amplitude grows from 0, as half a cosine.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        ramp_s: Option<Positive>,
        /// Standard deviation of the amplitude from trial to trial, relative to it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        scatter: Option<Positive>,
    },
    /// A motion imposed on body 1, by samples.
    Imposed {
        /// Where the samples stand (`t_s, x_m`), while they were not read.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        file: Option<PathBuf>,
        /// Times of the samples.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        t_s: Vec<f64>,
        /// Displacements.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        x_m: Vec<f64>,
        /// Standard deviation of the displacement from trial to trial, relative to it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        scatter: Option<Positive>,
    },
    /// No drive: at t = 0 the chain is let go.
    Free {
        /// Where the state stands that it is let go from (`body, x_m, v_m_per_s`), while it was not read.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        initial: Option<PathBuf>,
        /// Displacements of all bodies in that state.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        x_m: Vec<f64>,
        /// Their velocities.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        v_m_per_s: Vec<f64>,
        /// In place of a state the force that pressed the chain together.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        precompression_n: Option<Positive>,
        /// Standard deviation of the state (or the force) from trial to trial, relative to it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        scatter: Option<Positive>,
    },
}

impl DriveTable {
    /// Reads what stands in a file, beside `path`; what was read takes the file's place.
    pub(crate) fn read_files<E: From<Error>>(
        &mut self,
        path: &Path,
        n_bodies: usize,
        read: &dyn Fn(&Path) -> Result<Table, E>,
    ) -> Result<(), E> {
        match self {
            Self::Imposed { file, t_s, x_m, .. } => {
                let Some(name) = file.take() else { return Ok(()) };
                let read = samples_of_body_1(&read(&path.with_file_name(name))?)?;
                for (stated, key) in [(&*t_s, "t_s"), (&*x_m, "x_m")] {
                    expect_none(stated, key, "file")?;
                }
                (*t_s, *x_m) = read;
            }
            Self::Free { initial, x_m, v_m_per_s, .. } => {
                let Some(name) = initial.take() else { return Ok(()) };
                let state = BodyState::of_table(&read(&path.with_file_name(name))?, n_bodies)?;
                for (stated, key) in [(&*x_m, "x_m"), (&*v_m_per_s, "v_m_per_s")] {
                    expect_none(stated, key, "initial")?;
                }
                (*x_m, *v_m_per_s) = (state.displacement_m, state.velocity_m_per_s);
            }
            Self::Striker { .. } | Self::Shaker { .. } => {}
        }
        Ok(())
    }

    /// The drive of a chain, so many times as strong as it is stated, for a time. The chain's own drive stands back.
    ///
    /// # Errors
    /// Samples that are no motion, a state of another chain, and a force that its contacts do not hold.
    pub(crate) fn drive(&self, strength: f64, chain: &Chain, until_s: f64) -> Result<Drive, Error> {
        Ok(match self {
            Self::Striker { mass_kg, velocity_m_per_s, damping_kg_per_s } => Drive::Striker(Striker {
                mass_kg: mass_kg.get(),
                velocity_m_per_s: strength * velocity_m_per_s.get(),
                damping_kg_per_s: damping_kg_per_s.get(),
                ground_damping_kg_per_s: 0.0,
            }),
            Self::Shaker { frequency_hz, amplitude_m, ramp_s, .. } => {
                let shaker = Shaker {
                    frequency_hz: frequency_hz.get(),
                    amplitude_m: strength * amplitude_m.get(),
                    ramp_s: ramp_s.map_or(0.0, Positive::get),
                };
                Drive::Imposed(shaker.motion(until_s)?)
            }
            Self::Imposed { t_s, x_m, .. } => {
                let moved_m = x_m.iter().map(|x_m| strength * x_m).collect();
                Drive::Imposed(ImposedMotion::from_samples(t_s.clone(), moved_m)?)
            }
            Self::Free { .. } => {
                let BodyState { displacement_m, velocity_m_per_s } = self.initial(strength, chain)?;
                Drive::Free { displacement_m, velocity_m_per_s }
            }
        })
    }

    /// The state that a chain is let go from, so many times as strong as it is stated; rest where something drives it.
    ///
    /// # Errors
    /// As for [`DriveTable::drive`].
    pub(crate) fn initial(&self, strength: f64, chain: &Chain) -> Result<BodyState, Error> {
        let n = chain.n_bodies();
        let Self::Free { x_m, v_m_per_s, precompression_n, .. } = self else {
            return Ok(BodyState::at_rest(n));
        };
        if let Some(force_n) = precompression_n {
            let displacement_m = precompressed_m(chain, strength * force_n.get())?;
            return Ok(BodyState { displacement_m, velocity_m_per_s: vec![0.0; n] });
        }
        let of_bodies = |values: &[f64], key: &str| match values.len() {
            0 => Ok(vec![0.0; n]),
            found if found != n => {
                Err(Error::Value(format!("drive.{key}: expected {n} numbers (n_bodies), found {found}")))
            }
            _ => Ok(values.iter().map(|value| strength * value).collect()),
        };
        Ok(BodyState {
            displacement_m: of_bodies(x_m, "x_m")?,
            velocity_m_per_s: of_bodies(v_m_per_s, "v_m_per_s")?,
        })
    }

    /// Relative standard deviation from trial to trial, where it is stated.
    pub(crate) fn scatter(&self) -> Option<Positive> {
        match self {
            Self::Striker { .. } => None,
            Self::Shaker { scatter, .. } | Self::Imposed { scatter, .. } | Self::Free { scatter, .. } => {
                *scatter
            }
        }
    }

    /// States another such deviation.
    pub(crate) fn set_scatter(&mut self, stated: Option<Positive>) {
        match self {
            Self::Striker { .. } => {}
            Self::Shaker { scatter, .. } | Self::Imposed { scatter, .. } | Self::Free { scatter, .. } => {
                *scatter = stated;
            }
        }
    }

    /// Makes it so many times as strong.
    pub(crate) fn strengthen(&mut self, factor: f64) {
        let stronger = |value: &mut Positive| *value = Positive(factor * value.get());
        match self {
            Self::Striker { velocity_m_per_s, .. } => stronger(velocity_m_per_s),
            Self::Shaker { amplitude_m, .. } => stronger(amplitude_m),
            Self::Imposed { x_m, .. } => x_m.iter_mut().for_each(|x_m| *x_m *= factor),
            Self::Free { x_m, v_m_per_s, precompression_n, .. } => {
                x_m.iter_mut().chain(v_m_per_s).for_each(|value| *value *= factor);
                precompression_n.iter_mut().for_each(stronger);
            }
        }
    }

    /// What it is, in words.
    pub(crate) fn in_words(&self) -> &'static str {
        match self {
            Self::Striker { .. } => "a striker",
            Self::Shaker { .. } => "a shaker",
            Self::Imposed { .. } => "an imposed motion of body 1",
            Self::Free { .. } => "a free release",
        }
    }

    /// Whether it says how body 1 moves.
    pub(crate) fn is_imposed(&self) -> bool {
        matches!(self, Self::Shaker { .. } | Self::Imposed { .. })
    }

    /// Whether the chain is let go from a state.
    pub(crate) fn is_free(&self) -> bool {
        matches!(self, Self::Free { .. })
    }

    /// When it ends to be known, in seconds; none for one that is known for ever.
    pub(crate) fn known_until_s(&self) -> Option<f64> {
        match self {
            Self::Imposed { t_s, .. } => t_s.last().copied(),
            _ => None,
        }
    }

    /// Refuses what says nothing, or two things at once, of a chain.
    ///
    /// # Errors
    /// A drive without samples, a release without a state or with two, and what [`DriveTable::drive`] refuses.
    pub(crate) fn check(&self, chain: &Chain) -> Result<(), Error> {
        let refuse = |expected: &str, found: &str| {
            Err(Error::Value(format!("drive: expected {expected}, found {found}")))
        };
        match self {
            Self::Imposed { t_s, .. } if t_s.is_empty() => {
                return refuse("file, or t_s and x_m, of an imposed motion", "neither");
            }
            Self::Free { x_m, v_m_per_s, precompression_n, .. } => {
                let has_state = !x_m.is_empty() || !v_m_per_s.is_empty();
                match (has_state, precompression_n.is_some()) {
                    (true, true) => return refuse("initial or precompression_n of a release", "both"),
                    (false, false) => return refuse("initial or precompression_n of a release", "neither"),
                    _ => {}
                }
            }
            _ => {}
        }
        // A shaker's motion is known for any time.
        const SOME_TIME_S: f64 = 1e-3;
        self.drive(1.0, chain, SOME_TIME_S).map(|_| ())
    }
}

fn expect_none(stated: &[f64], key: &str, other: &str) -> Result<(), Error> {
    match stated.is_empty() {
        true => Ok(()),
        false => Err(Error::Value(format!("drive: expected {other} or {key}, found both"))),
    }
}

/// Samples of body 1's motion, by the columns `t_s, x_m`: every row of a table without a column `body`, and those of body 1 of one that
/// has it, such as the motion that a run found.
fn samples_of_body_1(table: &Table) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let (times_s, x_m) = (table.full_numbers("t_s")?, table.full_numbers("x_m")?);
    let is_first: Vec<bool> = match table.has("body") {
        true => table.counts("body")?.into_iter().map(|body| body == 1).collect(),
        false => vec![true; times_s.len()],
    };
    let samples = times_s.into_iter().zip(x_m).zip(is_first);
    Ok(samples.filter(|(_, is_first)| *is_first).map(|(sample, _)| sample).unzip())
}

/// The motion of body 1 by a table's columns `t_s, x_m`, of all rows or, where there is a column `body`, of body 1's. SI units.
///
/// # Errors
/// A missing column, an empty cell, and samples that are no motion.
pub fn imposed_motion(table: &Table) -> Result<ImposedMotion, Error> {
    let (times_s, x_m) = samples_of_body_1(table)?;
    Ok(ImposedMotion::from_samples(times_s, x_m)?)
}

/// No drive, of bodies at rest: what a chain has while its own is worked out.
pub(crate) fn at_rest(n_bodies: usize) -> Drive {
    Drive::Free { displacement_m: vec![0.0; n_bodies], velocity_m_per_s: vec![0.0; n_bodies] }
}
