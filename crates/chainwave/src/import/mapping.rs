//! The mapping of an import: which numbers of a text file mean what.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::layout::Layout;
use super::numbers::{Numbers, Place};
use super::program::Program;
use super::tracks::Axis;
use crate::error::Error;
use chainwave_experiment::{Positive, read_toml};
use chainwave_measurement::Estimate;

/// Which numbers of the trials' files mean what.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Mapping {
    /// Name, for figures.
    pub(super) name: String,
    /// The files, one a trial, beside the mapping.
    pub(super) trials: Vec<PathBuf>,
    /// The chain.
    pub(super) chain: Chain,
    /// How the files are written, where no program is named.
    pub(super) layout: Option<Layout>,
    /// The program that wrote them, whose files are known.
    pub(super) program: Option<Program>,
    /// The program's tracks of the bodies, body 1 first; all of them, in their order along the wave, when left out.
    pub(super) tracks: Option<Vec<String>>,
    /// When the samples were taken.
    pub(super) time: Time,
    /// Where the displacements stand.
    pub(super) displacement: Displacement,
    /// How well they are known.
    pub(super) sigma: Sigma,
}

/// The chain, and what is evaluated of it.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Chain {
    /// Number of bodies in the files.
    pub(super) n_bodies: usize,
    /// Distance between neighbouring bodies at rest.
    pub(super) pitch_m: Positive,
    /// First gap of the group velocity.
    #[serde(default = "Chain::usual_first_gap")]
    pub(super) first_gap: usize,
    /// Last gap of the group velocity; as far as the pulse is one when left out.
    pub(super) last_gap: Option<usize>,
    /// The leading edge is where a gap first exceeds this fraction of its peak.
    #[serde(default = "Chain::usual_edge_fraction")]
    pub(super) edge_fraction: f64,
    /// What the last body is to the chain.
    pub(super) end: Option<EndName>,
}

/// What the last body of the files is to the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum EndName {
    /// The chain ends there, and nothing holds it.
    Free,
    /// The chain ends there at something that holds it.
    Fixed,
    /// The chain goes on: what comes back from its end comes from farther away.
    Unseen,
}

impl Chain {
    fn usual_first_gap() -> usize {
        1
    }

    fn usual_edge_fraction() -> f64 {
        0.1
    }
}

/// When the samples were taken: at a rate, or at times that the file holds.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Time {
    /// Samples per second.
    pub(super) rate_hz: Option<Positive>,
    /// Column (or line) of the times, from 1.
    pub(super) at: Option<usize>,
    /// What 1 stands for there.
    pub(super) unit_s: Option<Positive>,
    /// When time is 0.
    #[serde(default)]
    pub(super) zero: Zero,
    /// Samples before this time show the chain at rest.
    pub(super) rest_until_s: f64,
}

/// When time is 0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Zero {
    /// As the file says, or at its first sample.
    #[default]
    Stated,
    /// When body 1 has gone half of its way: trials whose cameras were started by hand then differ little.
    FirstBody,
}

/// Places of a series for each body: that of body 1, and the distance to the next body's.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Series {
    /// Column (or line) of body 1, from 1.
    pub(super) first: usize,
    /// Columns (or lines) from one body to the next.
    #[serde(default = "Series::usual_step")]
    pub(super) step: usize,
}

impl Series {
    fn usual_step() -> usize {
        1
    }

    /// Where a body's numbers stand.
    pub(super) fn place(&self, body: usize) -> Place {
        Place(self.first + (body - 1) * self.step)
    }
}

/// Where the displacements stand.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Displacement {
    /// Column (or line) of body 1, from 1; not of a program's files.
    first: Option<usize>,
    /// Columns (or lines) from one body to the next.
    #[serde(default = "Series::usual_step")]
    step: usize,
    /// The axis of a program's tracks along which the wave runs.
    #[serde(default)]
    pub(super) axis: Axis,
    /// What 1 stands for along the wave: negative where the file counts against it.
    pub(super) unit_m: f64,
}

impl Displacement {
    pub(super) fn place(&self, body: usize) -> Place {
        Series { first: self.first.unwrap_or(1), step: self.step }.place(body)
    }
}

/// How well displacements are known.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sigma {
    /// Standard uncertainty of every displacement, and the least where the file states them.
    pub(super) usual_m: Positive,
    /// Where the file states them.
    pub(super) series: Option<Series>,
    /// What 1 stands for there.
    #[serde(default = "Sigma::usual_unit")]
    pub(super) unit_m: Positive,
}

impl Sigma {
    fn usual_unit() -> Positive {
        Positive::ONE
    }
}

impl Mapping {
    /// Reads a mapping; an error points at the line.
    pub(super) fn read(path: &Path) -> Result<Self, Error> {
        let wrong = |message: String| Error::configuration(path, message);
        let mapping: Self = read_toml(path)?;
        if mapping.chain.n_bodies < 2 || mapping.trials.is_empty() {
            return Err(wrong("expected at least 2 bodies and 1 trial".into()));
        }
        let twice = mapping.trials.iter().enumerate().find(|(k, name)| mapping.trials[..*k].contains(name));
        if let Some((_, name)) = twice {
            return Err(wrong(format!("trials: expected each file once, found {} twice", name.display())));
        }
        let is_usable = mapping.displacement.unit_m.is_finite() && mapping.displacement.unit_m.abs() > 0.0;
        if !is_usable {
            let found = mapping.displacement.unit_m;
            return Err(wrong(format!("displacement.unit_m: expected a number other than 0, found {found}")));
        }
        mapping.expect_one_way().map_err(wrong)?;
        mapping.expect_gaps().map_err(wrong)?;
        Ok(mapping)
    }

    /// Whether the wave is reflected at the last body: at either end of a chain. Where the mapping does not say what it is, it is the chain's last one,
    /// unless the mapping chose some tracks of a file.
    pub(super) fn end_reflects(&self) -> bool {
        match self.chain.end {
            Some(end) => end != EndName::Unseen,
            None => self.tracks.is_none(),
        }
    }

    /// Gaps that the chain has, and a place of its own for each body.
    fn expect_gaps(&self) -> Result<(), String> {
        let Chain { n_bodies, first_gap, last_gap, .. } = self.chain;
        let n_gaps = n_bodies - 1;
        if !(1..=n_gaps).contains(&first_gap) {
            return Err(format!("chain.first_gap: expected a gap from 1 to {n_gaps}, found {first_gap}"));
        }
        if let Some(last) = last_gap.filter(|last| !(first_gap + 1..=n_gaps).contains(last)) {
            return Err(format!(
                "chain.last_gap: expected a gap behind first_gap = {first_gap}, to {n_gaps} at most, found {last}"
            ));
        }
        let places = [
            ("displacement.first", self.displacement.first),
            ("sigma.series.first", self.sigma.series.as_ref().map(|series| series.first)),
            ("time.at", self.time.at),
        ];
        if let Some((key, _)) = places.into_iter().find(|(_, place)| *place == Some(0)) {
            return Err(format!("{key}: expected a column (or line) from 1, found 0"));
        }
        let of_sigma = self.sigma.series.as_ref().map(|series| ("sigma.step", series.step));
        for (key, step) in [("displacement.step", self.displacement.step)].into_iter().chain(of_sigma) {
            if step == 0 {
                return Err(format!("{key}: expected at least 1, found 0"));
            }
        }
        Ok(())
    }

    /// A place along the wave of what a file states, whose standard uncertainty is at least the usual one.
    pub(super) fn position_m(&self, stated: f64, sigma_m: f64) -> Estimate {
        Estimate::new(stated * self.displacement.unit_m, sigma_m.max(self.sigma.usual_m.get()))
    }

    /// Either a layout, with places and a time for every sample, or a program, which knows where what stands.
    fn expect_one_way(&self) -> Result<(), String> {
        let Time { rate_hz, at, .. } = self.time;
        match (&self.layout, self.program) {
            (Some(_), None) if rate_hz.is_some() == at.is_some() => {
                Err("[time]: expected either rate_hz or at with unit_s".into())
            }
            (Some(_), None) if self.displacement.first.is_none() => {
                Err("[displacement]: expected first, the column (or line) of body 1".into())
            }
            (None, Some(_)) if at.is_some() || self.displacement.first.is_some() || self.sigma.series.is_some() => {
                Err("program: expected neither time.at, displacement.first nor sigma.series, which the program's files settle".into())
            }
            (Some(_), None) | (None, Some(_)) => Ok(()),
            _ => Err("expected either program, the name of the one that wrote the files, or [layout], how they are written".into()),
        }
    }
}

impl Time {
    /// Times of the samples as the file says, in seconds.
    pub(super) fn times_s(&self, numbers: &Numbers) -> Result<Vec<f64>, Error> {
        let unit_s = self.unit_s.map_or(1.0, Positive::get);
        match (self.rate_hz, self.at) {
            (Some(rate_hz), _) => Ok((0..numbers.n_samples()).map(|k| k as f64 / rate_hz.get()).collect()),
            (None, Some(at)) => Ok(numbers.full_series(Place(at))?.into_iter().map(|t| t * unit_s).collect()),
            (None, None) => Ok(Vec::new()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_comes_back_from_the_last_body_unless_the_chain_goes_on_there() {
        let folder = tempfile::tempdir().unwrap();
        let reflects = |of_chain: &str, of_tracks: &str| {
            let path = folder.path().join("mapping.toml");
            let text = format!(
                "name = \"a\"\ntrials = [\"a.csv\"]\nprogram = \"trackpy\"\n{of_tracks}\n[chain]\nn_bodies = 3\npitch_m = 0.03\n{of_chain}\n\
                 [time]\nrate_hz = 1e4\nrest_until_s = 0.0\n[displacement]\nunit_m = 1e-3\n[sigma]\nusual_m = 1e-6\n"
            );
            std::fs::write(&path, text).unwrap();
            Mapping::read(&path).map(|mapping| mapping.end_reflects())
        };
        assert!(reflects("", "").unwrap());
        assert!(!reflects("", "tracks = [\"1\", \"2\", \"3\"]").unwrap());
        assert!(reflects("end = \"fixed\"", "tracks = [\"1\", \"2\", \"3\"]").unwrap());
        assert!(reflects("end = \"free\"", "").unwrap() && !reflects("end = \"unseen\"", "").unwrap());
        assert!(reflects("end = \"open\"", "").unwrap_err().to_string().contains("unseen"));
    }
}
