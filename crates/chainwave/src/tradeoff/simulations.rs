//! A ladder of simulations, each held against a finer one.

use std::time::Instant;

use chainwave_measurement::Trajectory;

use super::Rung;
use crate::progress;

/// Repetitions of which the shortest counts.
const REPETITIONS: usize = 3;

/// A simulation with one of the settings: the method's name and the motion; none where the settings do not suit the scene.
type Simulated = Option<(String, Trajectory)>;

/// Simulations of one scene against a far better one: the largest error of a displacement over the largest displacement, and the
/// shortest time of one simulation. Settings that the scene refuses are no rungs.
pub(super) fn ladder<S>(
    step: &'static str,
    truth: &Trajectory,
    settings: Vec<(String, S)>,
    simulate: impl Fn(&S) -> Simulated,
) -> Vec<Rung> {
    let bar = progress::bar(step, settings.len() as u64);
    let rung = |(name, settings): (String, S)| {
        bar.inc(1);
        let ((method, motion), seconds_per_item) = timed(|| simulate(&settings))?;
        Some(Rung {
            step,
            method,
            settings: name,
            error: Some(distance(&motion, truth)).filter(|error| error.is_finite()),
            error_unit: "of largest displacement",
            seconds_per_item,
            items: REPETITIONS as u64,
        })
    };
    let rungs = settings.into_iter().filter_map(rung).collect();
    bar.finish_and_clear();
    rungs
}

/// What is found, and the shortest time that it takes, in seconds.
fn timed<T>(find: impl Fn() -> Option<T>) -> Option<(T, f64)> {
    let mut shortest = f64::INFINITY;
    let mut found = None;
    for _ in 0..REPETITIONS {
        let start = Instant::now();
        found = Some(find()?);
        shortest = shortest.min(start.elapsed().as_secs_f64());
    }
    found.map(|found| (found, shortest))
}

/// Largest difference of displacements, over the outputs that both have, over the largest displacement.
fn distance(found: &Trajectory, truth: &Trajectory) -> f64 {
    let (found, truth) = (&found.displacement_m, &truth.displacement_m);
    let n_common = found.ncols().min(truth.ncols());
    let largest = truth.iter().fold(0.0_f64, |most, x_m| most.max(x_m.abs()));
    let apart = (0..n_common)
        .flat_map(|k| found.column(k).into_iter().zip(truth.column(k)))
        .fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
    apart / largest
}
