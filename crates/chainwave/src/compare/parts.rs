//! What the files of a study hold.

use std::path::Path;

use chainwave_analysis::MeasureSettings;
use chainwave_experiment::{read_text, ring_centres};
use chainwave_measurement::Estimate;
use serde::Deserialize;

use super::study::{Law, Strike, Study};
use crate::error::Error;
use crate::table;
use crate::wave::{Wave, read_trajectory};

/// First gap of the long chain at which the pulse counts as formed.
const FIRST_GAP_OF_LONG_CHAIN: usize = 5;

/// Names by which figures colour them.
pub(super) const EXPERIMENT: &str = "experiment";
pub(super) const RINGS: &str = "rings";
pub(super) const CHAIN: &str = "chain model";

/// What a study's files hold.
pub(super) struct Compared {
    pub(super) strikes: Vec<Struck>,
    pub(super) long: Wave,
    pub(super) laws: Vec<LawResults>,
    /// Striker and group velocity as the runs found them.
    pub(super) measured: Vec<(Estimate, Estimate)>,
}

/// The three waves after one strike.
pub(super) struct Struck {
    pub(super) velocity_m_per_s: f64,
    pub(super) experiment: Wave,
    pub(super) rings: Wave,
    pub(super) chain: Wave,
    /// Measured peak energies: gap and joules.
    pub(super) energies_j: Vec<(f64, Estimate)>,
}

/// What the chain model makes of a law.
pub(super) struct LawResults {
    pub(super) name: String,
    /// Striker and group velocity in metres per second, and its variation.
    pub(super) scan: Vec<ScanRow>,
    pub(super) undamped_j: Vec<f64>,
    pub(super) damped_j: Vec<f64>,
}

/// One strike of a scan.
#[derive(Debug, Clone, Copy)]
pub(super) struct ScanRow {
    pub(super) striker_m_per_s: f64,
    pub(super) group_m_per_s: f64,
    pub(super) variation: Option<f64>,
}

impl Compared {
    /// Reads every file that a study names.
    ///
    /// # Errors
    /// A file that is missing or holds something else.
    pub(super) fn read(study: &Study, from: &Path) -> Result<Self, Error> {
        let settings = || MeasureSettings::new(study.pitch_m.get(), 0);
        let strikes = study.strikes.iter().map(|strike| Struck::read(strike, from, settings()));
        let joints = read_trajectory(&from.join(&study.long_chain.rings))?;
        let of_long = MeasureSettings { first_gap: FIRST_GAP_OF_LONG_CHAIN, ..settings() };
        Ok(Self {
            strikes: strikes.collect::<Result<_, _>>()?,
            long: Wave::of_model(RINGS, &ring_centres(joints), &of_long)?,
            laws: study.laws.iter().map(|law| LawResults::read(law, from)).collect::<Result<_, _>>()?,
            measured: read_measured(&from.join(&study.group_velocities))?,
        })
    }

    /// The law that figures show.
    pub(super) fn law(&self) -> Option<&LawResults> {
        self.laws.first()
    }
}

impl Struck {
    fn read(strike: &Strike, from: &Path, settings: MeasureSettings) -> Result<Self, Error> {
        let folder = from.join(&strike.experiment);
        let experiment = Wave::of_results(EXPERIMENT, &folder)?;
        let velocity_gaps = experiment.speed.map(|speed| speed.gaps.0..=speed.gaps.1);
        let settings = MeasureSettings { velocity_gaps, ..settings };
        let rings = ring_centres(read_trajectory(&from.join(&strike.rings))?);
        let chain = read_trajectory(&from.join(&strike.chain))?;
        let energies = table::read(&folder.join("energy.parquet"))?;
        let gaps = energies.full_numbers("gap")?;
        let values = energies.full_numbers("psi_max_j")?.into_iter().zip(energies.full_numbers("sigma_j")?);
        let values = values.map(|(value, sigma)| Estimate::new(value, sigma));
        Ok(Self {
            velocity_m_per_s: strike.velocity_m_per_s.get(),
            experiment,
            rings: Wave::of_model(RINGS, &rings, &settings)?,
            chain: Wave::of_model(CHAIN, &chain, &settings)?,
            energies_j: gaps.into_iter().zip(values).collect(),
        })
    }

    /// Experiment, rings, chain model.
    pub(super) fn waves(&self) -> [&Wave; 3] {
        [&self.experiment, &self.rings, &self.chain]
    }
}

impl LawResults {
    fn read(law: &Law, from: &Path) -> Result<Self, Error> {
        let folder = from.join(&law.folder);
        let table = table::read(&folder.join("scan.parquet"))?;
        let (strikers, gaps) = (table.full_numbers("striker_velocity_m_per_s")?, table.counts("gap")?);
        let groups = table.numbers("group_velocity_m_per_s")?;
        let variations = table.numbers("group_velocity_variation")?;
        // A scan has a row for each gap of each strike.
        let row = |row: usize| {
            let group_m_per_s = groups[row].filter(|_| gaps[row] == 1)?;
            Some(ScanRow { striker_m_per_s: strikers[row], group_m_per_s, variation: variations[row] })
        };
        Ok(Self {
            name: law.name.clone(),
            scan: (0..gaps.len()).filter_map(row).collect(),
            undamped_j: read_peak_energies(&folder.join("undamped.json"))?,
            damped_j: read_peak_energies(&folder.join("damped.json"))?,
        })
    }
}

/// The peak energies of a simulation's summary, gap by gap, in joules.
fn read_peak_energies(path: &Path) -> Result<Vec<f64>, Error> {
    #[derive(Deserialize)]
    struct Summary {
        psi_max_j: Vec<f64>,
    }
    let summary: Result<Summary, _> = serde_json::from_str(&read_text(path)?);
    summary.map(|summary| summary.psi_max_j).map_err(|wrong| Error::configuration(path, wrong.to_string()))
}

/// Striker and group velocities that were measured.
fn read_measured(path: &Path) -> Result<Vec<(Estimate, Estimate)>, Error> {
    let table = table::read(path)?;
    let column = |name: &str| table.numbers(name);
    let (strikers, striker_sigmas) = (column("striker_velocity_m_per_s")?, column("sigma")?);
    let (groups, group_sigmas) = (column("group_velocity_m_per_s")?, column("group_velocity_sigma")?);
    let rows = table.texts("source")?.into_iter().enumerate();
    let measured = |(row, source): (usize, String)| {
        let of = |values: &[Option<f64>], sigmas: &[Option<f64>]| {
            Some(Estimate::new(values[row]?, sigmas[row].unwrap_or(0.0)))
        };
        let pair = of(&strikers, &striker_sigmas).zip(of(&groups, &group_sigmas));
        pair.filter(|_| source == EXPERIMENT)
    };
    Ok(rows.filter_map(measured).collect())
}
