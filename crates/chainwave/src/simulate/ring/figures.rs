//! Figures of ring scenes (paper, Fig. 3).

use std::path::{Path, PathBuf};

use chainwave_analysis::MeasureSettings;
use chainwave_figures::{FrontPulse, FrontWidth, GroupVelocities, ProfilePanel, Series, StrainMapPanel};
use chainwave_measurement::Trajectory;
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::error::Error;
use crate::output::{make_folder, write_text};
use crate::table::{self, column};
use crate::wave::Wave;
use chainwave_experiment::Positive;

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

/// The wave of a model, measured as an experiment's would be.
pub(super) fn wave_of(name: &'static str, trajectory: &Trajectory, pitch_m: f64) -> Result<Wave, Error> {
    let settings = MeasureSettings { first_gap: FIRST_GAP, ..MeasureSettings::new(pitch_m, 0) };
    Wave::of_model(name, trajectory, &settings)
}

/// Draws maps, profiles and pulses of the rings, with the chain model beside them where it was run.
pub(super) fn draw(
    folder: &Path,
    asked: &FiguresTable,
    rings: &Wave,
    chain: Option<&Wave>,
    pitch_m: f64,
) -> Result<(), Error> {
    make_folder(folder)?;
    let models: Vec<&Wave> = std::iter::once(rings).chain(chain).collect();
    let panels: Vec<StrainMapPanel> = models.iter().map(|model| model.panel()).collect();
    chainwave_figures::strain_map(&folder.join("strain-map"), &panels)?;
    let profiles: Vec<ProfilePanel> = asked
        .profile_times_s
        .iter()
        .map(|&time_s| ProfilePanel {
            time_s,
            series: models
                .iter()
                .map(|model| Series::model(model.name, model.profile_line(time_s)))
                .collect(),
            front: rings.front(time_s),
        })
        .collect();
    if !profiles.is_empty() {
        chainwave_figures::strain_profiles(&folder.join("strain-profiles"), &profiles)?;
    }
    let pulses: Vec<FrontPulse> =
        asked.pulse_times_s.iter().filter_map(|&time_s| rings.pulse(time_s)).collect();
    if !pulses.is_empty() {
        let front = FrontWidth {
            pulses,
            hwhm: models.iter().map(|model| model.half_width_line()).collect(),
            pitch_m: Some(pitch_m),
        };
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
fn write_half_widths(path: &Path, models: &[&Wave]) -> Result<(), Error> {
    let rows = || {
        let widths = |model: &&'_ Wave| model.half_widths.clone();
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
fn write_numbers(folder: &Path, models: &[&Wave], times_s: &[f64]) -> Result<(), Error> {
    let numbers = models.iter().map(|model| {
        let widths = &model.half_widths;
        let peak_of = |gap: usize| model.fronts.iter().find(|front| front.gap == gap);
        let value = json!({
            "group_velocity_m_per_s": model.speed.map(|speed| speed.group_m_per_s.value),
            "tail_frequency_hz": model.tail_hz,
            "hwhm_first_m": widths.first().map(|width| width.hwhm_m.value),
            "hwhm_last_m": widths.last().map(|width| width.hwhm_m.value),
            "hwhm_at_profile_times_m": times_s.iter().map(|time_s| model.half_width_m(*time_s)).collect::<Vec<_>>(),
            "hwhm_rising_share": model.rising_share(),
            "peak_strains": (1..=model.strain.nrows()).map(|gap| {
                peak_of(gap).map(|front| front.peak_strain.value)
            }).collect::<Vec<_>>(),
        });
        (model.name.to_owned(), value)
    });
    let numbers: serde_json::Map<String, serde_json::Value> = numbers.collect();
    write_text(&folder.join("numbers.json"), &format!("{:#}\n", serde_json::Value::Object(numbers)))
}
