//! `group_velocity.parquet`, `group_velocity.json` and their figures: the wave against the strike (paper, Fig. 3 c).

use std::path::Path;

use chainwave_experiment::{Experiment, StrikerWave, WaveSource, speed_exponent};
use chainwave_figures::{DataPoint, GroupVelocities, Series, group_velocity, group_velocity_by_particles};
use chainwave_measurement::Estimate;
use serde_json::{Map, Value, json};

use super::figures::Figure;
use super::figures_folder;
use crate::error::Error;
use crate::output::write_json;
use crate::table::{self, column};

/// Writes the table and draws the figures, which it names.
pub(super) fn write(
    experiment: &Experiment,
    out: &Path,
    waves: &[StrikerWave],
) -> Result<Vec<Figure>, Error> {
    let of = |value: &dyn Fn(&StrikerWave) -> Option<f64>| waves.iter().map(value).collect::<Vec<_>>();
    let known = |estimate: Estimate| (estimate.sigma > 0.0).then_some(estimate.sigma);
    let columns = vec![
        column("striker_velocity_m_per_s", of(&|wave| Some(wave.striker_m_per_s.value))),
        column("sigma", of(&|wave| known(wave.striker_m_per_s))),
        column("group_velocity_m_per_s", of(&|wave| Some(wave.group_m_per_s.value))),
        column("group_velocity_sigma", of(&|wave| known(wave.group_m_per_s))),
        column("particle_velocity_m_per_s", of(&|wave| wave.particle_m_per_s.map(|particle| particle.value))),
        column("particle_velocity_sigma", of(&|wave| wave.particle_m_per_s.and_then(known))),
        column("source", waves.iter().map(|wave| wave.source.as_str()).collect::<Vec<_>>()),
    ];
    table::write(&out.join("group_velocity.parquet"), columns)?;
    write_json(&out.join("group_velocity.json"), &exponents(waves))?;
    draw(experiment, out, waves)
}

/// How the speed grows with the velocity of the bodies, of what was measured and of the model, or why it is not told.
fn exponents(waves: &[StrikerWave]) -> Value {
    let sources =
        [(WaveSource::Experiment, "speed_exponent"), (WaveSource::ChainModel, "speed_exponent_model")];
    let of = |(source, key): (WaveSource, &str)| match speed_exponent(waves, source) {
        Some(found) => {
            vec![(key.to_owned(), json!(found.value)), (format!("{key}_sigma"), json!(found.sigma))]
        }
        None => vec![(
            format!("{key}_refused"),
            json!(format!(
                "expected three group velocities with velocities of bodies by the {}",
                source.as_str()
            )),
        )],
    };
    Value::Object(sources.into_iter().flat_map(of).collect::<Map<String, Value>>())
}

fn draw(experiment: &Experiment, out: &Path, waves: &[StrikerWave]) -> Result<Vec<Figure>, Error> {
    let sound_m_per_s = experiment.linear_chain()?.sound_speed_m_per_s(experiment.chain.mean_pitch_m());
    let folder = figures_folder(out)?;
    let against = |velocity: fn(&StrikerWave) -> Option<Estimate>| {
        let point = |wave: &StrikerWave| Some(DataPoint { x: velocity(wave)?, y: wave.group_m_per_s });
        let of =
            |source: WaveSource| waves.iter().filter(move |wave| wave.source == source).filter_map(point);
        let (measured, modelled) = (WaveSource::Experiment, WaveSource::ChainModel);
        let line: Vec<(f64, f64)> = of(modelled).map(|point| (point.x.value, point.y.value)).collect();
        GroupVelocities {
            series: vec![
                Series::measured(measured.as_str(), of(measured).collect()),
                Series::model(modelled.as_str(), line),
            ],
            sound_speed_m_per_s: Some(sound_m_per_s),
        }
    };
    group_velocity(&folder.join("group-velocity"), &against(|wave| Some(wave.striker_m_per_s)))?;
    let by_particles = against(|wave| wave.particle_m_per_s);
    group_velocity_by_particles(&folder.join("group-velocity-by-particles"), &by_particles)?;
    Ok(vec![
        Figure {
            name: "group-velocity".into(),
            caption: "Group velocity of the leading pulse against the velocity of the striker.".into(),
        },
        Figure {
            name: "group-velocity-by-particles".into(),
            caption: "Group velocity against the velocity of the bodies as the pulse's peak passes.".into(),
        },
    ])
}
