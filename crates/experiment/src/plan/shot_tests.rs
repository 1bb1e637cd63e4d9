//! Shots of trials as a plan rehearses them, each with a striker, a trigger and noise of its own: how many of them are told to be unlike the
//! others, of sound ones and of odd ones.

use std::path::Path;

use super::*;
use crate::tracking::shot::{LookedAt, unlike};

const SMALL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/small-experiment/experiment.toml");
const N_SEEDS: u64 = 60;
const N_TRIALS: usize = 5;

fn setup() -> Setup {
    Setup::read(Path::new(SMALL), None).unwrap()
}

/// The shots of all views, in the order of their trials.
fn shots(rehearsal: &Rehearsal, seed: u64) -> Vec<LookedAt> {
    let tracked = Rehearsal { seed, ..rehearsal.clone() }.tracked(NonZero::<usize>::MIN).unwrap();
    let shot = |one: crate::tracked::TrackedRecording| LookedAt {
        recording: one.trial.recording.clone(),
        view: one.trial.view,
        tracks: one.tracks,
        findings: Vec::new(),
    };
    tracked.recordings.into_iter().map(shot).collect()
}

fn of_view(shots: &[LookedAt], view: u32) -> Vec<&LookedAt> {
    let of_view: Vec<&LookedAt> = shots.iter().filter(|one| one.view == view).collect();
    assert_eq!(of_view.len(), N_TRIALS);
    of_view
}

#[test]
fn sound_shots_are_hardly_ever_told_to_be_unlike_the_others() {
    let Prepared { rehearsal, .. } = Prepared::of(&setup()).unwrap();
    let stated = rehearsal.setup.experiment.drive_scatter();
    let (mut n, mut n_told) = (0.0_f64, [0.0_f64; 2]);
    for seed in 1..=N_SEEDS {
        let shots = shots(&rehearsal, seed);
        for view in [1, 2, 3] {
            let trials = of_view(&shots, view);
            for last in 2..N_TRIALS {
                n += 1.0;
                for (scatter, told) in [Some(stated), None].into_iter().zip(&mut n_told) {
                    let said = unlike(trials[last], &trials[..last], scatter);
                    said.iter().for_each(|said| println!("seed {seed}: {said}"));
                    *told += f64::from(u8::from(said.is_some()));
                }
            }
        }
    }
    println!("told {n_told:?} of {n}");
    // One in a hundred at most, and three standard deviations of the binomial distribution.
    let most = 0.01 * n + 3.0 * (0.01 * n).sqrt();
    assert!(n_told.iter().all(|told| *told <= most), "{n_told:?} of {n}, at most {most}");
}

#[test]
fn shots_of_another_strike_and_of_another_view_are_told() {
    let sound = Prepared::of(&setup()).unwrap().rehearsal;
    let mut slower = setup();
    slower.experiment.vary(1.0, 0.7 * sound.setup.experiment.nominal_drive().value);
    let slower = Prepared::of(&slower).unwrap().rehearsal;
    let stated = sound.setup.experiment.drive_scatter();
    for seed in 1..=N_SEEDS / 4 {
        let (shots, slow) = (shots(&sound, seed), shots(&slower, seed + N_SEEDS));
        // The stage was left where the second view is filmed: the row looks the same there.
        let mut elsewhere = of_view(&shots, 2)[0].clone();
        elsewhere.view = 1;
        let first = elsewhere.tracks.bodies[0].body - 1;
        elsewhere.tracks.bodies.iter_mut().for_each(|body| body.body -= first);
        let trials = of_view(&shots, 1);
        // Two others hardly tell how motions scatter (127 times that is nothing unusual), while strikes scatter as they are stated or usually do.
        for (odd, least) in [(of_view(&slow, 1)[0], 2), (&elsewhere, 3)] {
            for n in least..N_TRIALS {
                for scatter in [Some(stated), None] {
                    let said = unlike(odd, &trials[..n], scatter);
                    assert!(said.is_some(), "seed {seed}: {} beside {n}, {scatter:?}", odd.recording);
                }
            }
        }
    }
}
