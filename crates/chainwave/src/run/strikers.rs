//! `group_velocity.parquet`, `group_velocity.json` and their figures: the wave against the strike (paper, Fig. 3 c).

use std::path::Path;

use chainwave_experiment::{Experiment, StrikerWave, WaveSource, speed_exponent};
use chainwave_figures::{DataPoint, GroupVelocities, Series, group_velocity, group_velocity_by_particles};
use chainwave_measurement::Estimate;
use serde_json::{Map, Value, json};

use super::figures::Figure;
use super::outputs;
use crate::error::Error;
use crate::output::figures_folder;
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
        column("source", waves.iter().map(|wave| wave.source.as_str()).collect::<Vec<_>>()),
        column("particle_velocity_m_per_s", of(&|wave| wave.particle_m_per_s.map(|particle| particle.value))),
        column("particle_velocity_sigma", of(&|wave| wave.particle_m_per_s.and_then(known))),
        column("first_gap", waves.iter().map(|wave| wave.gaps.0 as u64).collect::<Vec<_>>()),
        column("last_gap", waves.iter().map(|wave| wave.gaps.1 as u64).collect::<Vec<_>>()),
    ];
    table::write(&out.join(outputs::GROUP_VELOCITY), columns)?;
    write_json(&out.join(outputs::EXPONENTS), &exponents(waves))?;
    draw(experiment, out, waves)
}

/// How the speed grows with the velocity of the bodies, of what was measured and of the model at the same velocities and over the same gaps, or
/// why it is not told.
fn exponents(waves: &[StrikerWave]) -> Value {
    let sources =
        [(WaveSource::Experiment, "speed_exponent"), (WaveSource::ChainModelBeside, "speed_exponent_model")];
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
        let (measured, beside) = (WaveSource::Experiment, WaveSource::ChainModelBeside);
        let beside_measured = of(beside).map(|point| (point.x.value, point.y.value));
        GroupVelocities {
            series: vec![
                Series::measured(measured.as_str(), of(measured).collect()),
                Series::model(WaveSource::ChainModel.as_str(), curve(waves, velocity)),
                Series::model_points(beside.as_str(), beside_measured),
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

/// The chain model's group velocities over another velocity, in the order of the strikes. The line breaks where strikes between drive no wave, and where
/// the other velocity does not rise with the strike: there it does not tell the wave.
fn curve(waves: &[StrikerWave], velocity: fn(&StrikerWave) -> Option<Estimate>) -> Vec<(f64, f64)> {
    const BREAK: (f64, f64) = (f64::NAN, f64::NAN);
    let modelled: Vec<&StrikerWave> =
        waves.iter().filter(|wave| wave.source == WaveSource::ChainModel).collect();
    let step = |pair: &[&StrikerWave]| pair[1].striker_m_per_s.value - pair[0].striker_m_per_s.value;
    let usual = modelled.windows(2).map(step).fold(f64::INFINITY, f64::min);
    let place = |wave: &StrikerWave| Some((velocity(wave)?.value, wave.group_m_per_s.value));
    let mut points: Vec<(f64, f64)> = Vec::with_capacity(modelled.len());
    for (index, wave) in modelled.iter().enumerate() {
        let here = place(wave).unwrap_or(BREAK);
        let goes_on = index.checked_sub(1).map(|before| {
            let pair = [modelled[before], *wave];
            step(&pair) < 1.5 * usual && place(pair[0]).is_some_and(|there| there.0 < here.0)
        });
        if goes_on == Some(false) {
            points.push(BREAK);
        }
        points.push(here);
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_breaks_where_there_is_no_wave_and_where_the_bodies_are_no_faster() {
        let wave = |striker: f64, particle: f64| StrikerWave {
            striker_m_per_s: Estimate::new(striker, 0.0),
            group_m_per_s: Estimate::new(50.0 - striker, 0.0),
            particle_m_per_s: Some(Estimate::new(particle, 0.0)),
            gaps: (3, 9),
            source: WaveSource::ChainModel,
        };
        let waves = [wave(0.1, 0.05), wave(0.2, 0.1), wave(0.5, 0.4), wave(0.6, 0.5), wave(0.7, 0.45)];
        let breaks =
            |points: &[(f64, f64)]| -> Vec<bool> { points.iter().map(|point| point.0.is_nan()).collect() };
        let by_striker = curve(&waves, |wave| Some(wave.striker_m_per_s));
        assert_eq!(breaks(&by_striker), [false, false, true, false, false, false]);
        let by_particles = curve(&waves, |wave| wave.particle_m_per_s);
        assert_eq!(breaks(&by_particles), [false, false, true, false, false, true, false]);
        assert!(curve(&[], |wave| wave.particle_m_per_s).is_empty());
    }
}
