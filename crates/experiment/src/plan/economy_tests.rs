//! What is chosen for an accuracy, against runs of the same recordings.

use std::num::NonZero;
use std::path::Path;

use chainwave_correlation::{Interpolation, Shape, ShapeChoice};

use super::*;
use crate::evaluation::evaluate;
use crate::film::film_experiment;
use crate::tracking::store::MemoryStore;

const SMALL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/small-experiment/experiment.toml");
const TWO: NonZero<usize> = NonZero::<usize>::MIN.saturating_add(1);

#[test]
fn what_is_asked_is_reached_with_less_and_what_cannot_be_takes_all() {
    let folder = tempfile::tempdir().unwrap();
    let stated = Setup::read(Path::new(SMALL), None).unwrap();
    let (path, experiment) = (Path::new(SMALL), &stated.experiment);
    film_experiment(experiment, &stated.table, path, folder.path(), TWO, &Monitor::SILENT).unwrap();
    let setup = Setup::read(path, Some(folder.path())).unwrap();
    let [speed, damping] = [PlannedResult::GroupVelocity, PlannedResult::ChainDamping];
    let results = setup.run(&MemoryStore::default(), TWO, &Monitor::SILENT).unwrap();
    let at_best = [speed, damping].map(|result| outcome(&results.evaluation).of(result).clone().unwrap());
    let aim = |result, times: f64, at_best: &Estimate| Aim {
        result,
        largest: LargestSigma::Relative(times * at_best.sigma / at_best.value),
    };
    let aims = |times: f64| [aim(speed, times, &at_best[0]), aim(damping, times, &at_best[1])];
    let found = economy(&setup, &aims(3.0), TWO, &Monitor::SILENT).unwrap();
    println!("{} of the pixels, {} rehearsals, {:?}", found.work, found.n_rehearsals, found.decisions);
    // A third of what noise leaves could be known from a ninth of the readings, and sigma is to keep a margin. Of some hundred ways,
    // each rehearsal settles half of those that are left, or nearly.
    assert!(found.work < 0.5 && found.n_rehearsals < 25, "{} {}", found.work, found.n_rehearsals);
    let results = found.setup.run(&MemoryStore::default(), TWO, &Monitor::SILENT).unwrap();
    for aim in aims(3.0) {
        let reached = outcome(&results.evaluation).of(aim.result).clone().unwrap();
        assert!(aim.is_met_by(&reached), "{aim}: {reached:?}");
    }
    let coarse = economy(&setup, &aims(6.0), TWO, &Monitor::SILENT).unwrap();
    assert!(coarse.work <= found.work, "who asks for less looks at no more: {} {}", coarse.work, found.work);
    let beyond = [aim(speed, 0.1, &at_best[0])];
    let found = economy(&setup, &beyond, TWO, &Monitor::SILENT).unwrap();
    assert_eq!((found.setup.trials.len(), found.n_rehearsals), (setup.trials.len(), 1));
    assert!((found.work - 1.0).abs() < f64::EPSILON && found.setup.experiment.tracking.until_s.is_none());
    assert!(found.decisions[0].evidence.contains("out of reach"), "{:?}", found.decisions);
    assert_eq!(found.outlooks[0].expected, found.outlooks[0].at_best);
}

/// What was chosen for a question.
fn chosen<'a>(found: &'a Economy, question: &str) -> &'a str {
    let decision = found.decisions.iter().find(|one| one.question == question);
    &decision.unwrap_or_else(|| panic!("{question}: {:?}", found.decisions)).choice
}

#[test]
fn what_is_not_asked_is_not_made_and_changes_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let stated = Setup::read(Path::new(SMALL), None).unwrap();
    let (path, experiment) = (Path::new(SMALL), &stated.experiment);
    film_experiment(experiment, &stated.table, path, folder.path(), TWO, &Monitor::SILENT).unwrap();
    let setup = Setup::read(path, Some(folder.path())).unwrap();
    let results = setup.run(&MemoryStore::default(), TWO, &Monitor::SILENT).unwrap();
    let mut spare = setup.clone();
    (spare.experiment.analysis.fits, spare.experiment.analysis.pulses) = (false, false);
    let alone = evaluate(&spare, &results.tracked, TWO, &Monitor::SILENT).unwrap();
    assert_eq!(alone.measurement, results.evaluation.measurement, "no result of the motion asks a model");
    let refusals = alone.damping.refusals();
    assert!(
        refusals.len() == 2 && refusals.iter().all(|(_, why)| why.starts_with("not asked for")),
        "{refusals:?}"
    );
    assert!(alone.model.is_none() && alone.by_model.is_none() && alone.pulses.pulses.is_empty());
    let whole = outcome(&results.evaluation).of(PlannedResult::GroupVelocity).clone().unwrap();
    let aim = |result, part: f64| Aim { result, largest: LargestSigma::Relative(part) };
    let speed = aim(PlannedResult::GroupVelocity, 6.0 * whole.sigma / whole.value);
    let found = economy(&setup, &[speed], TWO, &Monitor::SILENT).unwrap();
    let analysis = &found.setup.experiment.analysis;
    assert!(!analysis.fits && !analysis.pulses && analysis.n_replicas < setup.experiment.analysis.n_replicas);
    assert_eq!(chosen(&found, "models that are fitted"), "none");
    let reached = found.setup.run(&MemoryStore::default(), TWO, &Monitor::SILENT).unwrap();
    let speed_found = outcome(&reached.evaluation).of(speed.result).clone().unwrap();
    assert!(speed.is_met_by(&speed_found), "{speed_found:?}");
    let damping = reached.decisions.iter().find(|one| one.question == "damping").unwrap();
    assert_eq!(damping.choice, "not asked for");
    // Who asks for a damping gets the models, and replicas for the covariance of the energies.
    let both =
        economy(&setup, &[speed, aim(PlannedResult::ChainDamping, 0.5)], TWO, &Monitor::SILENT).unwrap();
    assert!(both.setup.experiment.analysis.fits);
    assert_eq!(both.setup.experiment.analysis.n_replicas, setup.experiment.analysis.n_replicas);
    // Views that share no body need the model for their triggers.
    let mut apart = setup;
    apart.trials.retain(|one| one.view != 2);
    let apart = economy(&apart, &[speed], TWO, &Monitor::SILENT).unwrap();
    assert!(apart.setup.experiment.analysis.fits, "{:?}", apart.decisions);
}

#[test]
fn a_simpler_method_is_taken_where_its_errors_drown_in_the_noise() {
    let folder = tempfile::tempdir().unwrap();
    let mut stated = Setup::read(Path::new(SMALL), None).unwrap();
    let tracking = &mut stated.experiment.tracking;
    (tracking.shape, tracking.interpolation) =
        (ShapeChoice::Named(Shape::Affine), Interpolation::QuinticMoms);
    let path = Path::new(SMALL);
    film_experiment(&stated.experiment, &stated.table, path, folder.path(), TWO, &Monitor::SILENT).unwrap();
    let mut setup = Setup::read(path, Some(folder.path())).unwrap();
    setup.experiment.tracking = stated.experiment.tracking.clone();
    let results = setup.run(&MemoryStore::default(), TWO, &Monitor::SILENT).unwrap();
    let whole = outcome(&results.evaluation).of(PlannedResult::GroupVelocity).clone().unwrap();
    let speed = Aim {
        result: PlannedResult::GroupVelocity,
        largest: LargestSigma::Relative(3.0 * whole.sigma / whole.value),
    };
    let found = economy(&setup, &[speed], TWO, &Monitor::SILENT).unwrap();
    println!("{:?}", found.decisions);
    let method = chosen(&found, "tracking method for what was asked");
    // Bodies of this film do nothing but move, and their speckles are coarse: neither turns nor the best splines are called for. Linear
    // interpolation errs by more than the noise allows.
    assert!(method.contains("translation") && method.contains("cubic"), "{method}");
    let reached = found.setup.run(&MemoryStore::default(), TWO, &Monitor::SILENT).unwrap();
    let speed_found = outcome(&reached.evaluation).of(speed.result).clone().unwrap();
    assert!(speed.is_met_by(&speed_found), "{speed_found:?}");
}
