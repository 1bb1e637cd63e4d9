//! Recordings that contradict the others, and those that only look as if they did.

use chainwave_measurement::{Estimate, Observation};
use chainwave_stitching::{Settings, at_rest, outliers};

use crate::{FRAME_S, N_BODIES, NOISE_M, errors, experiment, filmed, stitch, struck_harder};

/// Recordings in which nothing moves, and those that contradict the others of their view.
fn found_outliers(observations: &[Observation]) -> Vec<String> {
    let settings = Settings::new(N_BODIES, 2.0 * FRAME_S);
    let resting = at_rest(observations, &settings);
    let mut observations = observations.to_vec();
    observations.retain(|one| resting.iter().all(|resting| resting.recording != one.recording));
    let found = outliers(&observations, &settings).unwrap();
    resting.into_iter().chain(found).map(|outlier| outlier.recording).collect()
}

#[test]
fn sound_trials_are_kept() {
    for seed in 20..40 {
        assert!(found_outliers(&experiment(seed).observations).is_empty(), "seed {seed}");
        let noisy = filmed(seed, 0.0, 10.0 * NOISE_M);
        assert!(found_outliers(&noisy.observations).is_empty(), "seed {seed}, ten times the noise");
    }
}

#[test]
fn a_trial_struck_harder_is_no_outlier_but_corrected() {
    for seed in 0..10 {
        let experiment = struck_harder(seed);
        assert!(found_outliers(&experiment.observations).is_empty(), "seed {seed}");
        let errors = errors(&experiment, &stitch(&experiment.observations));
        let inside = errors.iter().filter(|(error, sigma)| error.abs() <= 1.96 * sigma).count();
        // Shared errors: the share of one experiment scatters.
        assert!(inside as f64 > 0.8 * errors.len() as f64, "seed {seed}: {inside} of {}", errors.len());
    }
}

#[test]
fn bodies_under_wrong_names_and_a_wrong_frame_rate_are_named() {
    for seed in 0..10 {
        let mut observations = experiment(seed).observations;
        // View 1 trial 2 holds a file of view 2: bodies 3 to 5 are in truth 5 to 7.
        let other = observations[12].bodies.clone();
        for (track, wrong) in observations[7].bodies.iter_mut().zip(other) {
            track.position_m = wrong.position_m;
        }
        // View 0 trial 3 was filmed 2 % slower than its header says.
        observations[3].times_s.iter_mut().for_each(|time_s| *time_s *= 1.02);
        assert_eq!(found_outliers(&observations), ["view0 trial3", "view1 trial2"], "seed {seed}");
    }
}

/// With five trials that are struck alike, a response to the drive follows one in which nothing moves, or no more from some frame on, alone.
#[test]
fn a_trial_in_which_nothing_moves_is_told_apart() {
    let stands = |observation: &mut Observation, from: usize| {
        for track in &mut observation.bodies {
            let stands_m = track.position_m[from].unwrap().value;
            for position in track.position_m.iter_mut().skip(from) {
                // Noise of its own: the last digits of what was filmed.
                let was = position.unwrap();
                *position = Some(Estimate::new(stands_m + was.value % NOISE_M, was.sigma));
            }
        }
    };
    for seed in 0..5 {
        for (view, n_trials, from) in
            [(0, 5, 0), (1, 5, 0), (1, 3, 0), (1, 2, 0), (1, 1, 0), (0, 5, 60), (1, 5, 60), (1, 3, 60)]
        {
            let mut observations = experiment(seed).observations;
            observations.retain(|one| one.view != view || one.trial < n_trials);
            let odd = observations.iter_mut().rfind(|one| one.view == view).unwrap();
            stands(odd, from);
            let name = odd.recording.clone();
            assert_eq!(
                found_outliers(&observations),
                [name],
                "seed {seed}, {n_trials} trials, from frame {from} on"
            );
        }
        // A whole view, whose outer bodies other views show.
        let mut observations = experiment(seed).observations;
        observations.iter_mut().filter(|one| one.view == 1).for_each(|one| stands(one, 0));
        assert_eq!(found_outliers(&observations).len(), 5, "seed {seed}");
    }
}

#[test]
fn a_trigger_out_of_proportion_is_an_outlier_unless_it_is_stated_to_scatter_so() {
    for seed in 0..5 {
        let mut observations = experiment(seed).observations;
        let late_s = 30.0 * FRAME_S;
        observations[7].times_s.iter_mut().for_each(|time_s| *time_s += late_s);
        assert_eq!(found_outliers(&observations), ["view1 trial2"], "seed {seed}");
        // Five standard deviations are usual, and it is late by four.
        let stated =
            Settings { trigger_sigma_s: Some(0.25 * late_s), ..Settings::new(N_BODIES, 2.0 * FRAME_S) };
        assert!(outliers(&observations, &stated).unwrap().is_empty(), "seed {seed}");
    }
}
