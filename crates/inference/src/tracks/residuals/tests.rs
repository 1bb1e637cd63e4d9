//! What tracks are compared with: derivatives against simulations, and how much is integrated.

use chainwave_measurement::{SharedReadingError, TrackDeviation};
use chainwave_mechanics::simulate;

use super::super::response::MotionOfTrack;
use super::super::windows::Window;
use super::*;
use crate::least_squares::Own;
use crate::quantity::Prior;

/// One trial that sees eight bodies, without noise.
fn observed(chain: &Chain) -> Observation {
    let moved = simulate(chain, &Schedule::automatic(0.008, 1e-5)).unwrap().trajectory;
    let times_s: Vec<f64> = (0..150).map(|k| 4e-5 * f64::from(k)).collect();
    let track = |body: usize| {
        let place = |t_s: &f64| Some(Estimate::new(moved.at(*t_s)?.displacement_m(body - 1), 0.4e-6));
        BodyTrack { body, position_m: times_s.iter().map(place).collect() }
    };
    let bodies = (1..=8).map(track).collect();
    Observation { recording: "one".into(), view: 0, trial: 0, times_s, bodies }
}

/// A model on one thread, of readings that share no error.
fn unshared(chain: Chain, striker_velocity_m_per_s: Estimate, priors: Vec<Prior>) -> TrackModel {
    let n_threads = std::num::NonZero::<usize>::MIN;
    TrackModel {
        chain,
        striker_velocity_m_per_s,
        priors,
        reading_errors: Vec::new(),
        usual_errors: Vec::new(),
        n_threads,
    }
}

#[test]
fn what_is_solved_is_solved_once_and_without_derivatives_that_nobody_asks_for() {
    let chain = Chain::of_rings(8);
    let observations = [observed(&chain)];
    let velocity = Estimate::new(2.73, 0.05);
    let model = unshared(chain, velocity, Vec::new());
    let problem = TrackResiduals::new(&observations, &model, &[]).unwrap();
    let at = problem.start(&[1e-6], [1.1, 0.9]).unwrap();
    let n_nodes = Family::new(range_of(&[2.73], &model)).n_nodes() as u64;
    let with_derivatives = problem.equations(&at).unwrap().chi_squared();
    assert_eq!(problem.n_simulations(), n_nodes);
    problem.solve(&at).unwrap();
    assert_eq!(problem.n_simulations(), n_nodes, "the model behind the equations is there");
    let (_, [without]) = problem.equations_of(&at, false, [&|_, _, _| true]).unwrap();
    assert_eq!(without.chi_squared().to_bits(), with_derivatives.to_bits());
    assert_eq!(problem.n_simulations(), 2 * n_nodes);
    let there = problem.start(&[2e-6], [1.1, 0.9]).unwrap();
    problem.equations(&at).unwrap();
    problem.solve(&there).unwrap();
    assert_eq!(problem.n_simulations(), 4 * n_nodes, "another place is another model");
}

#[test]
fn sensitivities_are_those_of_simulations() {
    let chain = Chain::of_rings(8);
    let quantities =
        [Quantity::BodyMass, Quantity::Prefactor, Quantity::Offset, Quantity::Exponent, Quantity::Softening];
    let priors = quantities.map(|quantity| Prior { quantity, relative_sigma: 0.01 }).into();
    let observations = [observed(&chain)];
    let velocity = Estimate::new(2.73, 0.05);
    let model = unshared(chain, velocity, priors);
    let problem = TrackResiduals::new(&observations, &model, &[]).unwrap();
    let shared = DVector::from_vec([vec![0.003, 0.2], vec![1.0; 5]].concat());
    let state = Unknowns { shared, own: vec![Own::new(2.73, 0.0)] };
    let of_tracks = |response: &Response, window: &Window| {
        let driven = response.driven([2.73, 0.0], &observations[0].times_s);
        let tracks = observations[0].bodies.iter().map(|track| driven.of_track(track, window));
        tracks.collect::<Vec<MotionOfTrack>>()
    };
    let motion_at = |state: &Unknowns| {
        let response = problem.solve(state).unwrap().response;
        of_tracks(&response, &Window::whole(response.n_outputs()))
    };
    let chains = problem.chains(&state).unwrap();
    let motions = solve(&chains, &problem.schedule, |_| Kept::Steps, model.n_threads).unwrap();
    let (sides, places) = problem.sides(&state).unwrap();
    assert!(places.into_iter().eq((0..problem.n_shared()).map(Some)));
    let changes = changes_of(&sides, &problem.family(&state));
    let response = problem.model_of(&state, &motions).unwrap().response;
    // Windows so short that frames lie in many.
    let windows = Windows::new(&motions, &changes, 7, model.n_threads).unwrap();
    let here: Vec<MotionOfTrack> =
        windows.flat_map(|window| of_tracks(&response, &window.unwrap())).collect();
    for unknown in 0..problem.n_shared() {
        let value = state.shared[unknown];
        let displacement_m = |part: f64| {
            let mut beside = state.clone();
            beside.shared[unknown] += part * value;
            DVector::from_vec(motion_at(&beside).into_iter().flat_map(|track| track.displacement_m).collect())
        };
        let slope = |part: f64| (displacement_m(part) - displacement_m(-part)) / (2.0 * part * value);
        let expected = (slope(1e-3) * 4.0 - slope(2e-3)) / 3.0;
        let of_body = |body: usize| here.iter().skip(body).step_by(8);
        let found = (0..8).flat_map(of_body).flat_map(|track| track.derivatives_m[unknown].clone());
        let found = DVector::from_vec(found.collect());
        let error = (&found - &expected).amax() / expected.amax();
        // The simulations in the differences step differently, to 1e-6 of the motion by their own account.
        assert!(error < 5e-6, "unknown {unknown}: {error}");
    }
}

#[test]
fn a_search_begins_at_a_damping_that_was_found_elsewhere_though_the_model_states_none() {
    let mut chain = Chain::of_rings(8);
    let observations = [observed(&chain)];
    chain.damping_kg_per_s.fill(0.0);
    let model = unshared(chain, Estimate::new(2.73, 0.05), Vec::new());
    let problem = TrackResiduals::new(&observations, &model, &[]).unwrap();
    let at = problem.start_at_c_d(&[1e-6], 0.003).unwrap();
    assert_eq!(at.shared.as_slice(), [0.003, 0.2]);
    assert!(problem.equations(&at).unwrap().chi_squared().is_finite());
}

#[test]
fn unknowns_keep_their_places_in_a_richer_problem() {
    let chain = Chain::of_rings(8);
    let observations = [observed(&chain)];
    let priors = |quantities: &[Quantity]| {
        quantities.iter().map(|quantity| Prior { quantity: *quantity, relative_sigma: 0.01 }).collect()
    };
    let (before, behind) = ([Quantity::Scale], [Quantity::Scale, Quantity::StrikerMass]);
    let model = unshared(chain, Estimate::new(2.73, 0.05), priors(&behind));
    let asked = [Quantity::Prefactor, Quantity::Friction, Quantity::Softening];
    let problem = TrackResiduals::new(&observations, &model, &asked).unwrap();
    let own = vec![Own::new(2.7, 1e-6)];
    let at = Unknowns { shared: DVector::from_vec(vec![0.004, 0.3, 1.01, 0.98]), own };
    let there = problem.extended(&at, (before.len(), 1));
    assert_eq!(there.shared.as_slice(), [0.004, 0.3, 1.01, 1.0, 0.98, 0.0, 1.0]);
    assert_eq!(there.own, at.own);
}

#[test]
fn a_shared_error_moves_residuals_by_what_is_stated_of_them() {
    let chain = Chain::of_rings(8);
    let observation = observed(&chain);
    // Pictures that err where a body has moved, as a pattern on the sensor does: body 2 by up to 3 um.
    let errors_m: Vec<f64> =
        (0..150).map(|k| if k < 40 { 0.0 } else { 2e-6 + 1e-6 * f64::from(k % 2) }).collect();
    let error_m = errors_m.clone();
    let of_track = TrackDeviation { recording: "one".into(), body: 2, error_m };
    let reading_errors = vec![SharedReadingError { source: "a pattern".into(), of_tracks: vec![of_track] }];
    let model = TrackModel { reading_errors, ..unshared(chain, Estimate::new(2.73, 0.05), Vec::new()) };
    let mut erring = observation.clone();
    for (position, error_m) in erring.bodies[1].position_m.iter_mut().zip(&errors_m) {
        position.as_mut().unwrap().value += error_m;
    }
    let residuals_m = |observation: Observation| -> Vec<f64> {
        let observations = [observation];
        let problem = TrackResiduals::new(&observations, &model, &[]).unwrap();
        let at = problem.start(&[1e-6], [1.1, 0.9]).unwrap();
        let solved = problem.solve(&at).unwrap();
        problem.residuals(&solved, &at, &[]).iter().map(|one| one.value * 0.4e-6).collect()
    };
    let (right_m, erring_m) = (residuals_m(observation.clone()), residuals_m(erring));
    let observations = [observation];
    let of_tracks = TrackResiduals::new(&observations, &model, &[]).unwrap().errors_of_tracks();
    let of_body_2 = observations[0].bodies.iter().position(|track| track.body == 2).unwrap();
    assert_eq!(of_tracks.iter().map(Vec::len).sum::<usize>(), 1);
    let before: usize = observations[0].bodies[..of_body_2]
        .iter()
        .map(|track| track.position_m.iter().flatten().count())
        .sum();
    let mut stated_m = vec![0.0; right_m.len()];
    for (stated_m, error_m) in stated_m[before..].iter_mut().zip(&of_tracks[of_body_2][0].of_residuals_m) {
        *stated_m = *error_m;
    }
    for ((right_m, erring_m), stated_m) in right_m.iter().zip(&erring_m).zip(&stated_m) {
        // Rounding of positions of a few centimetres.
        assert!((right_m - erring_m - stated_m).abs() < 1e-15, "{right_m} {erring_m} {stated_m}");
    }
    assert!(
        stated_m[150].abs() > 1e-6,
        "a body at rest is off by what its place has of the error: {}",
        stated_m[150]
    );
}
