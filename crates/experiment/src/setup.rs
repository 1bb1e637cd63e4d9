//! An experiment that can be run: its configuration, calibration and trials, and where its recordings lie.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use chainwave_camera::OpenOptions;
use chainwave_correlation::Method;
use chainwave_measurement::{Estimate, Recording, RecordingInfo};

use crate::camera::calibration::ChainMap;
use crate::camera::sensor::SensorFiles;
use crate::configuration::{Experiment, Trial};
use crate::corrections::Corrections;
use crate::error::Error;
use crate::input::numbers::{NotNegative, Positive};

/// Recordings that the caller has opened or holds in memory, by their names in the trials table.
pub type HeldRecordings = BTreeMap<String, Arc<dyn Recording>>;

/// An experiment with everything that was read for it.
#[derive(Clone)]
pub struct Setup {
    /// The experiment.
    pub experiment: Experiment,
    /// Where it was read.
    pub path: PathBuf,
    /// From its pictures to the chain.
    pub map: ChainMap,
    /// The whole trials table.
    pub table: Vec<Trial>,
    /// The trials that are evaluated together: those of one striker velocity.
    pub trials: Vec<Trial>,
    /// What a reader of the pictures corrected in the tracks.
    pub corrections: Corrections,
    /// The folder of the recordings.
    pub recordings: PathBuf,
    /// Recordings that the caller holds, which need no file.
    pub(crate) held: HeldRecordings,
    /// Dark frames and flat field, where the experiment names them.
    pub sensor: Option<SensorFiles>,
    /// Whether the whole frames of a recording that was cut short are taken; otherwise it is refused.
    pub takes_partial: bool,
}

impl Setup {
    /// Reads an experiment, its trials table, its calibration, its corrections and its dark frames and flat field. Its recordings lie beside it unless a folder is named.
    ///
    /// # Errors
    /// A file that cannot be read or makes no sense.
    pub fn read(path: &Path, recordings: Option<&Path>) -> Result<Self, Error> {
        if let Some(folder) = recordings.filter(|folder| !folder.is_dir()) {
            let found = if folder.exists() { "a file" } else { "no such folder" };
            return Err(Error::Value(format!(
                "--recordings {}: expected the folder of the recordings, found {found}",
                folder.display()
            )));
        }
        let experiment = Experiment::read(path)?;
        let table = experiment.read_trials(path)?;
        Self::of(experiment, table, path, recordings)
    }

    /// An experiment and its trials; reads its calibration, its corrections and its dark frames and flat field. `path` is where the experiment stands.
    ///
    /// # Errors
    /// A file that cannot be read or makes no sense.
    pub fn of(
        experiment: Experiment,
        table: Vec<Trial>,
        path: &Path,
        recordings: Option<&Path>,
    ) -> Result<Self, Error> {
        let map = ChainMap::read(&experiment, path)?;
        let beside = path.parent().unwrap_or(Path::new(""));
        let recordings = recordings.unwrap_or(beside).to_owned();
        let [dark, flat] = [&experiment.camera.dark, &experiment.camera.flat]
            .map(|name| name.as_ref().map(|name| path.with_file_name(name)));
        let options = OpenOptions { raw: experiment.camera.raw, ..OpenOptions::default() };
        let sensor = SensorFiles::read(dark.as_deref(), flat.as_deref(), &options)?;
        let corrections = Corrections::of(&experiment, &table, path)?;
        let (path, trials, held) = (path.to_owned(), table.clone(), HeldRecordings::new());
        Ok(Self {
            experiment,
            path,
            map,
            table,
            trials,
            corrections,
            recordings,
            held,
            sensor,
            takes_partial: false,
        })
    }

    /// How recordings are opened.
    pub fn open_options(&self) -> OpenOptions {
        let camera = &self.experiment.camera;
        OpenOptions {
            rate_hz: camera.rate_hz.map(Positive::get),
            partial: self.takes_partial,
            raw: camera.raw,
            ..OpenOptions::default()
        }
    }

    /// From the pictures of a recording to the chain: by the scale that the trials table states for its view, where it does.
    pub(crate) fn map_of(&self, trial: &Trial, info: &RecordingInfo) -> ChainMap {
        match trial.scale_px_per_m {
            Some(scale_px_per_m) => self.map.magnified(scale_px_per_m * self.map.m_per_px().value, info),
            None => self.map.clone(),
        }
    }

    /// Time from the exposure of one line of a picture to that of the next, in seconds: 0 but for a rolling shutter.
    pub(crate) fn line_time_s(&self) -> f64 {
        self.experiment.camera.line_time_s.map_or(0.0, NotNegative::get)
    }

    /// One for each striker velocity of the trials table, fastest first.
    #[must_use]
    pub fn by_striker(&self) -> Vec<Self> {
        let mut velocities: Vec<Estimate> =
            self.trials.iter().filter_map(|trial| trial.striker_velocity_m_per_s).collect();
        velocities.sort_by(|a, b| b.value.total_cmp(&a.value));
        velocities.dedup_by(|a, b| a.value.total_cmp(&b.value).is_eq());
        let of_velocity = |velocity: &Estimate| {
            let mut setup = self.clone();
            let nominal = |trial: &Trial| trial.striker_velocity_m_per_s.map(|found| found.value);
            setup
                .trials
                .retain(|trial| nominal(trial).is_some_and(|value| value.total_cmp(&velocity.value).is_eq()));
            setup.experiment.striker.iter_mut().for_each(|striker| striker.set_velocity(*velocity));
            setup
        };
        match velocities.is_empty() {
            true => vec![self.clone()],
            false => velocities.iter().map(of_velocity).collect(),
        }
    }

    /// The largest number of trials of a view.
    pub fn trials_a_view(&self) -> usize {
        Trial::most_of_a_view(self.trials.iter())
    }

    /// Leaves the first so many trials of each view, by their numbers.
    pub fn keep_first_trials(&mut self, n: usize) {
        let all = self.trials.clone();
        self.trials.retain(|one| one.is_among_first(n, all.iter()));
    }

    /// The tracking method that the experiment names.
    pub fn method(&self) -> Method {
        let tracking = &self.experiment.tracking;
        Method::IcGn { shape: tracking.shape, interpolation: tracking.interpolation }
    }
}
