//! What readings say of the clocks of views and recordings.

use chainwave_measurement::Observation;
use chainwave_stitching::{ClockOf, ClockShown, Settings, merge};

use crate::{FRAME_S, N_BODIES, experiment};

/// What readings say of clocks, whose stamps are so much shorter than they should be.
fn clocks(seed: u64, excess: impl Fn(&Observation) -> f64) -> Vec<ClockShown> {
    let mut experiment = experiment(seed);
    for observation in &mut experiment.observations {
        let stated = (1.0 + excess(observation)).recip();
        observation.times_s.iter_mut().for_each(|time_s| *time_s *= stated);
    }
    let settings = Settings { asks_for_clocks: true, ..Settings::new(N_BODIES, 2.0 * FRAME_S) };
    merge(&experiment.observations, &settings).unwrap().clocks
}

#[test]
fn clocks_that_are_right_are_told_to_be_so() {
    let mut squares = [(0.0, 0), (0.0, 0)];
    for seed in 1..=20 {
        for shown in clocks(seed, |_| 0.0) {
            let (sum, n) = &mut squares[usize::from(matches!(shown.of, ClockOf::Recording(_)))];
            *sum += (shown.excess.value / shown.excess.sigma).powi(2);
            *n += 1;
        }
    }
    let [of_views, of_recordings] = squares.map(|(sum, n)| (sum / f64::from(n), n));
    assert_eq!((of_views.1, of_recordings.1), (60, 300));
    // The middle view's clock follows from those of both others: 40 independent squares, whose mean has a standard deviation of 0.22; that sigmas never
    // fall below the noise's makes it less.
    assert!((0.2..1.9).contains(&of_views.0), "{of_views:?}");
    // Trials of a view leave two independent squares of five in each stretch, and what the fit of drives leaves to be said; 120 squares have 0.13. Orders of the response
    // that are not fitted widen them.
    assert!((0.2..3.0).contains(&of_recordings.0), "{of_recordings:?}");
}

#[test]
fn the_clock_of_a_view_is_found_with_its_uncertainty() {
    let off = 1e-3;
    for seed in 1..=10 {
        let shown = clocks(seed, |one| if one.view == 2 { off } else { 0.0 });
        let best = shown.iter().max_by(|a, b| a.gain.total_cmp(&b.gain)).unwrap();
        assert_eq!(best.of, ClockOf::View(2), "seed {seed}: {shown:?}");
        // The first step of several: what the pattern bends by is left, a tenth of it at most, and four sigmas.
        let error = (best.excess.value - off).abs();
        assert!(error < 0.1 * off + 4.0 * best.excess.sigma, "seed {seed}: {best:?}");
    }
}

#[test]
fn the_clock_of_one_trial_is_found_among_the_others() {
    let off = 1e-3;
    for seed in 1..=10 {
        let shown = clocks(seed, |one| if one.recording == "view1 trial3" { off } else { 0.0 });
        let best = shown.iter().max_by(|a, b| a.gain.total_cmp(&b.gain)).unwrap();
        let told = shown.iter().find(|one| one.of == ClockOf::Recording("view1 trial3".into())).unwrap();
        // Two trials whose drives are extreme take up each other's clocks: the true one explains nine tenths of what the best does at least.
        assert!(told.gain > 0.9 * best.gain, "seed {seed}: {shown:?}");
        assert!((told.excess.value - off).abs() < 0.3 * off, "seed {seed}: {told:?}");
    }
}
