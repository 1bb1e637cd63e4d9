//! Figures of ring scenes (paper, Fig. 3).

use std::path::{Path, PathBuf};

use chainwave_analysis::{
    GapFront, HalfWidth, MeasureSettings, Measurement, StrainMap, exact_motion, measure,
};
use chainwave_figures::{FrontPulse, FrontWidth, GroupVelocities, ProfilePanel, Series, StrainMapPanel};
use chainwave_measurement::Trajectory;
use ndarray::Array2;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::error::Error;
use crate::output::{make_folder, write_text};
use crate::table::{self, column};
use chainwave_experiment::Positive;

/// Gaps to either side of its peak that an aligned pulse shows.
const PULSE_REACH: f64 = 25.0;
/// First gap at which the pulse counts as formed.
const FIRST_GAP: usize = 5;

/// `[figures]` of a scene.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FiguresTable {
    /// Folder beside the motion.
    pub(super) folder: PathBuf,
    /// Times of the strain profiles.
    #[serde(default)]
    profile_times_s: Vec<f64>,
    /// Times of the aligned leading pulses.
    #[serde(default)]
    pulse_times_s: Vec<f64>,
    /// Scene of the chain model to show beside the rings.
    pub(super) chain: Option<PathBuf>,
    /// Striker velocities at which the group velocity is found.
    #[serde(default)]
    pub(super) striker_velocities_m_per_s: Vec<Positive>,
}

/// A model's motion, measured as an experiment's would be.
pub(super) struct Measured {
    name: &'static str,
    measurement: Measurement,
    strain: Array2<Option<f64>>,
    peaks: Vec<(f64, f64)>,
    edges: Vec<(f64, f64)>,
}

impl Measured {
    pub(super) fn new(name: &'static str, trajectory: &Trajectory, pitch_m: f64) -> Result<Self, Error> {
        let settings = MeasureSettings { first_gap: FIRST_GAP, ..MeasureSettings::new(pitch_m, 0) };
        let measurement = measure(&exact_motion(trajectory), &settings, None)?;
        let fronts: Vec<&GapFront> = measurement.fronts.iter().flatten().collect();
        let peaks = fronts.iter().map(|front| (front.gap as f64, front.peak_time_s.value)).collect();
        let edges =
            fronts.iter().filter_map(|front| Some((front.gap as f64, front.edge_time_s?.value))).collect();
        let strain = measurement.strain.strain.mapv(|strain| strain.map(|strain| strain.value));
        Ok(Self { name, measurement, strain, peaks, edges })
    }

    /// Group velocity of the leading pulse in metres per second, where it has one.
    pub(super) fn group_velocity_m_per_s(&self) -> Option<f64> {
        self.measurement.group_velocity.as_ref().ok().map(|velocity| velocity.velocity_m_per_s.value)
    }

    fn map(&self) -> &StrainMap {
        &self.measurement.strain
    }

    fn panel(&self) -> StrainMapPanel {
        StrainMapPanel {
            title: self.name.into(),
            times_s: self.map().times_s.clone(),
            strain: self.strain.clone(),
            peak_trace: self.peaks.clone(),
            leading_edge: self.edges.clone(),
        }
    }

    /// The strain over the gaps at the sample nearest to a time.
    fn profile(&self, time_s: f64) -> Vec<(f64, f64)> {
        let column = self.strain.column(nearest(&self.map().times_s, time_s));
        column.iter().enumerate().filter_map(|(row, strain)| Some(((row + 1) as f64, (*strain)?))).collect()
    }

    /// Gaps of the peak and of the leading edge at a time.
    fn front(&self, time_s: f64) -> Option<(f64, f64)> {
        Some((place_at(&self.peaks, time_s)?, place_at(&self.edges, time_s)?))
    }

    /// The front's half width at the sample nearest to a time, where it is known within an interval of the samples.
    fn half_width_m(&self, time_s: f64) -> Option<f64> {
        let widths = &self.measurement.half_widths;
        let apart_s = |width: &&HalfWidth| (width.t_s - time_s).abs();
        let nearest = widths.iter().min_by(|a, b| apart_s(a).total_cmp(&apart_s(b)))?;
        (apart_s(&nearest) <= self.map().interval_s()).then_some(nearest.hwhm_m.value)
    }

    fn pulse(&self, time_s: f64) -> Option<FrontPulse> {
        let peak = place_at(&self.peaks, time_s)?;
        let profile = self.profile(time_s).into_iter().map(|(gap, strain)| (gap - peak, strain));
        let profile = profile.filter(|(offset, _)| offset.abs() <= PULSE_REACH).collect();
        Some(FrontPulse { time_s, profile })
    }
}

/// Draws maps, profiles and pulses of the rings, with the chain model beside them where it was run.
pub(super) fn draw(
    folder: &Path,
    asked: &FiguresTable,
    rings: &Measured,
    chain: Option<&Measured>,
    pitch_m: f64,
) -> Result<(), Error> {
    make_folder(folder)?;
    let models: Vec<&Measured> = std::iter::once(rings).chain(chain).collect();
    let panels: Vec<StrainMapPanel> = models.iter().map(|model| model.panel()).collect();
    chainwave_figures::strain_map(&folder.join("strain-map"), &panels)?;
    let profiles: Vec<ProfilePanel> = asked
        .profile_times_s
        .iter()
        .map(|&time_s| ProfilePanel {
            time_s,
            series: models.iter().map(|model| Series::model(model.name, model.profile(time_s))).collect(),
            front: rings.front(time_s),
        })
        .collect();
    if !profiles.is_empty() {
        chainwave_figures::strain_profiles(&folder.join("strain-profiles"), &profiles)?;
    }
    let width = |model: &&Measured| {
        let line = model.measurement.half_widths.iter().map(|width| (width.t_s, width.hwhm_m.value));
        Series::model(model.name, line)
    };
    let pulses: Vec<FrontPulse> =
        asked.pulse_times_s.iter().filter_map(|&time_s| rings.pulse(time_s)).collect();
    if !pulses.is_empty() {
        let front = FrontWidth { pulses, hwhm: models.iter().map(width).collect(), pitch_m: Some(pitch_m) };
        chainwave_figures::front_width(&folder.join("front-width"), &front)?;
    }
    write_half_widths(&folder.join("half-width.csv"), &models)?;
    write_numbers(folder, &models, &asked.profile_times_s)
}

/// Group velocities of the two models at one velocity of the striker, in metres per second; `None` where no pulse was found
/// or no chain model was asked for.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct VelocityRow {
    pub(super) striker_velocity_m_per_s: f64,
    pub(super) rings_m_per_s: Option<f64>,
    pub(super) chain_m_per_s: Option<f64>,
}

/// Draws group velocities over the striker's velocity.
pub(super) fn draw_velocities(
    folder: &Path,
    rows: &[VelocityRow],
    sound_speed_m_per_s: f64,
) -> Result<(), Error> {
    let points = |of: fn(&VelocityRow) -> Option<f64>| {
        rows.iter().filter_map(move |row| Some((row.striker_velocity_m_per_s, of(row)?)))
    };
    let mut series = vec![Series::model_points("rings", points(|row| row.rings_m_per_s))];
    if rows.iter().any(|row| row.chain_m_per_s.is_some()) {
        series.push(Series::model_points("chain model", points(|row| row.chain_m_per_s)));
    }
    let velocities = GroupVelocities { series, sound_speed_m_per_s: Some(sound_speed_m_per_s) };
    chainwave_figures::group_velocity(&folder.join("group-velocity"), &velocities)?;
    let text = json!({ "sound_speed_m_per_s": sound_speed_m_per_s, "group_velocities": rows });
    write_text(&folder.join("group-velocity.json"), &format!("{text:#}\n"))
}

/// Writes the half width of the front over time.
fn write_half_widths(path: &Path, models: &[&Measured]) -> Result<(), Error> {
    let rows = || {
        let widths = |model: &&'_ Measured| model.measurement.half_widths.clone();
        models.iter().flat_map(move |model| widths(model).into_iter().map(|width| (model.name, width)))
    };
    let columns = vec![
        column("model", rows().map(|(name, _)| name).collect::<Vec<_>>()),
        column("t_s", rows().map(|(_, width)| width.t_s).collect::<Vec<_>>()),
        column("hwhm_m", rows().map(|(_, width)| width.hwhm_m.value).collect::<Vec<_>>()),
    ];
    table::write(path, columns)
}

/// Writes what was measured on each model.
fn write_numbers(folder: &Path, models: &[&Measured], times_s: &[f64]) -> Result<(), Error> {
    let numbers = models.iter().map(|model| {
        let widths = &model.measurement.half_widths;
        let rises = widths.windows(2).filter(|pair| pair[1].hwhm_m.value > pair[0].hwhm_m.value).count();
        let value = json!({
            "group_velocity_m_per_s": model.group_velocity_m_per_s(),
            "tail_frequency_hz": model.measurement.local_resonance.as_ref().ok().map(|tail| tail.frequency_hz.value),
            "hwhm_first_m": widths.first().map(|width| width.hwhm_m.value),
            "hwhm_last_m": widths.last().map(|width| width.hwhm_m.value),
            "hwhm_at_profile_times_m": times_s.iter().map(|time_s| model.half_width_m(*time_s)).collect::<Vec<_>>(),
            "hwhm_rising_share": rises as f64 / widths.len().saturating_sub(1).max(1) as f64,
            "peak_strains": model.measurement.fronts.iter().map(|front| {
                front.as_ref().ok().map(|front| front.peak_strain.value)
            }).collect::<Vec<_>>(),
        });
        (model.name.to_owned(), value)
    });
    let numbers: serde_json::Map<String, serde_json::Value> = numbers.collect();
    write_text(&folder.join("numbers.json"), &format!("{:#}\n", serde_json::Value::Object(numbers)))
}

/// Index of the time nearest to `time_s`.
fn nearest(times_s: &[f64], time_s: f64) -> usize {
    let right = times_s.partition_point(|time| *time < time_s).min(times_s.len().saturating_sub(1));
    let left = right.saturating_sub(1);
    if (times_s[left] - time_s).abs() <= (times_s[right] - time_s).abs() { left } else { right }
}

/// Where a trace of (gap, time) stands at a time, linearly between its points; `None` before its first and after its last.
fn place_at(trace: &[(f64, f64)], time_s: f64) -> Option<f64> {
    let pair = trace.windows(2).find(|pair| pair[0].1 <= time_s && time_s < pair[1].1)?;
    Some(pair[0].0 + (time_s - pair[0].1) / (pair[1].1 - pair[0].1) * (pair[1].0 - pair[0].0))
}
