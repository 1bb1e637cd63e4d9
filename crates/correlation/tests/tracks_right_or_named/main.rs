//! Right, or lost for a named reason: tracks in films of surfaces that jump, turn, stretch, repeat, hide or are replaced, drawn in closed form
//! by a renderer that knows no matcher.
//! The tests of `chainwave-opencv` count OpenCV's methods on the same films.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]
#![expect(clippy::print_stdout, reason = "what each case gave is a table to be read")]

#[path = "../support/films.rs"]
mod films;
#[cfg(test)]
mod tables;

use chainwave_correlation::{Acceptance, Method, ReferenceFrames, Settings};
use chainwave_measurement::Subset;
use chainwave_synthetic::pictures::{Deformation, Surface, Texture};
use films::{Draw, Shown, count, few_speckles, large_subsets, repeats_slowly, small_subsets};

#[test]
fn no_reading_is_false() {
    let methods = [("icgn-cubic-affine", 3), ("icgn-cubic-translation", 6), ("template-parabola", 60)];
    let counted = count(&methods, 1..2, Acceptance::ByEvidence);
    let wrong: usize = counted.values().map(|outcome| outcome.n_wrong).sum();
    assert_eq!(wrong, 0);
}

#[test]
fn a_slow_lattice_is_found() {
    for seed in 1..4 {
        let scene = Shown { noise: 0.02, subsets: large_subsets(), ..repeats_slowly(&mut Draw::of(seed)) };
        let film = scene.film(seed);
        for method in ["icgn-cubic-affine", "icgn-cubic-translation"] {
            let by: Method = method.parse().unwrap();
            let first = ReferenceFrames::Single(0);
            let tracks = by.track(&film, &scene.subsets, &first, &Settings::default(), &|_| ()).unwrap();
            let outcome = scene.outcome(&scene.subsets, &tracks);
            println!("seed {seed}, {method:<24} {outcome}");
            assert_eq!(outcome.n_wrong, 0);
            // all but what a film's noise may hide
            assert!(outcome.n_found as f64 >= 0.95 * outcome.n_visible as f64, "{outcome:?}");
        }
    }
}

/// A dozen speckles resemble others by chance as much as noise leaves of them, once six parameters deform them at will; that they lie as the frames
/// before let expect tells them.
#[test]
fn subsets_of_a_dozen_speckles_are_followed_until_others_come() {
    (1..4).for_each(|seed| followed_until_others_come(seed, &few_speckles(&mut Draw::of(seed))));
}

/// Five speckles resemble others by chance once in some hundred cases, but for mean and contrast.
#[test]
fn subsets_of_five_speckles_are_followed_until_others_come() {
    // films of 1 % noise
    for seed in 4..6 {
        let scene = few_speckles(&mut Draw::of(seed));
        followed_until_others_come(seed, &Shown { subsets: small_subsets(), ..scene });
    }
}

fn followed_until_others_come(seed: u64, scene: &Shown) {
    let film = scene.film(seed);
    for method in ["icgn-cubic-affine", "icgn-cubic-translation"] {
        let by: Method = method.parse().unwrap();
        let first = ReferenceFrames::Single(0);
        let tracks = by.track(&film, &scene.subsets, &first, &Settings::default(), &|_| ()).unwrap();
        let outcome = scene.outcome(&scene.subsets, &tracks);
        println!("seed {seed}, noise {}, {method:<24} {outcome}", scene.noise);
        assert_eq!(outcome.n_wrong, 0);
        // All but those that happen to hold fewer speckles than parameters, a few in a hundred.
        assert!(outcome.n_found as f64 >= 0.9 * outcome.n_visible as f64, "{outcome:?}");
    }
}

/// A body of dots on a dark ground that goes out of the picture: where it is can only be beyond the rim, and the frames show dots alike a
/// period inside of it.
#[test]
fn a_lattice_that_leaves_is_not_found_a_period_back() {
    const N_FRAMES: usize = 40;
    let (size_px, half) = (120, 12);
    for (seed, step_px) in [(1, 0.4), (2, 0.9), (3, 1.7)] {
        let centre = [86.0, 60.0];
        let dots = Texture::dots(7.0, 3.5, centre, [21.0; 2]);
        let shown = |frame: usize| {
            // From rest, a tenth of the period or less from frame to frame.
            let way_px = step_px * (frame as f64 - 8.0).max(0.0);
            let moved = Deformation::rigid(centre, 0.0, [way_px, 0.0]);
            vec![Surface { disc: Some((centre, 24.0)), ..Surface::everywhere(dots.clone(), moved) }]
        };
        let subsets = vec![Subset::new("body", centre[0], centre[1], half, half)];
        let frames = (0..N_FRAMES).map(shown).collect();
        let scene = Shown { size_px, frames, noise: 0.01, subsets };
        let film = scene.film(seed);
        for method in ["icgn-cubic-affine", "icgn-cubic-translation", "template-parabola"] {
            let by: Method = method.parse().unwrap();
            let first = ReferenceFrames::Single(0);
            let tracks = by.track(&film, &scene.subsets, &first, &Settings::default(), &|_| ()).unwrap();
            let outcome = scene.outcome(&scene.subsets, &tracks);
            println!("{step_px} px a frame, {method:<24} {outcome}");
            assert_eq!(outcome.n_wrong, 0, "{method}");
        }
    }
}
