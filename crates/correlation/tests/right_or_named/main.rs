//! Right, or lost for a named reason: fields between pictures of surfaces that stretch, turn, repeat or have nothing to do with each
//! other, drawn in closed form by a renderer that knows no matcher.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]
#![expect(clippy::print_stdout, reason = "what each case gave is a table to be read")]

#[path = "../support/outcome.rs"]
mod outcome;
#[path = "../support/pairs.rs"]
mod pairs;
#[cfg(test)]
mod tables;

use std::f64::consts::PI;

use chainwave_correlation::Acceptance;
use chainwave_synthetic::pictures::{Deformation, Surface, Texture};
use outcome::Outcome;
use pairs::{Case, Pair, covered, moved, random_case, stretched};

const MIDDLE_PX: [f64; 2] = [159.5, 159.5];

fn of(name: &str, surface: Surface, deformation: Deformation) -> Case {
    let after = vec![surface.clone().deformed(deformation)];
    Case::between(name, vec![surface], after)
}

fn speckles(seed: u64) -> Surface {
    Surface::everywhere(Texture::speckles(seed, 4.5, MIDDLE_PX, [220.0; 2]), Deformation::NONE)
}

fn degrees(angle: f64) -> Deformation {
    Deformation::rigid(MIDDLE_PX, angle * PI / 180.0, [0.0; 2])
}

fn print(case: &Case, outcome: &Outcome) {
    println!("{:<32} {outcome}", case.name);
}

/// Every case has no wrong point, and finds at least a share of what is seen.
fn hold(cases: impl IntoIterator<Item = Case>, least_share: f64) {
    let mut failed = Vec::new();
    for case in cases {
        let outcome = case.outcome(Acceptance::ByEvidence);
        print(&case, &outcome);
        let enough = outcome.n_found as f64 >= least_share * outcome.n_visible as f64;
        if outcome.n_wrong > 0 || !enough {
            failed.push(case.name);
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

fn stretches() -> Vec<Case> {
    let stretch = |relative: f64| {
        let deformation = Deformation::stretch(MIDDLE_PX, [relative, 0.0]);
        of(&format!("stretched by {relative} along x"), speckles(1), deformation)
    };
    [-0.5, -0.25, 0.3, 0.45, 1.0].map(stretch).into()
}

#[test]
fn stretched_speckle_is_found() {
    hold(stretches(), 0.99);
}

fn scales() -> Vec<Case> {
    let scale = |factor: f64| {
        let deformation = Deformation::stretch(MIDDLE_PX, [factor - 1.0; 2]);
        of(&format!("scaled by {factor}"), speckles(2), deformation)
    };
    [0.5, 0.75, 1.4, 2.0].map(scale).into()
}

#[test]
fn scaled_speckle_is_found() {
    hold(scales(), 0.99);
}

fn turns() -> Vec<Case> {
    let turn = |angle: f64| of(&format!("turned by {angle} degrees"), speckles(3), degrees(angle));
    [30.0, 50.0, 90.0, 130.0, 170.0].map(turn).into()
}

#[test]
fn turned_speckle_is_found() {
    hold(turns(), 0.99);
}

fn bodies_on_black() -> Vec<Case> {
    let disc = |k: u64, turn: f64, shift: [f64; 2]| {
        let centre = [80.0 + 160.0 * (k % 2) as f64, 80.0 + 160.0 * (k / 2) as f64];
        Surface::turned_disc(10 + k, 4.5, (centre, 60.0), turn * PI / 180.0, shift)
    };
    let before = (0..4).map(|k| disc(k, 0.0, [0.0; 2])).collect();
    let turns = [0.0, 25.0, -70.0, 160.0];
    let after = (0..4_u64).zip(turns).map(|(k, turn)| disc(k, turn, [3.3, -2.6])).collect();
    vec![Case::between("four bodies turned on black", before, after)]
}

#[test]
fn bodies_on_black_are_all_found() {
    hold(bodies_on_black(), 0.99);
}

fn other_textures() -> Vec<Case> {
    let unrelated = |noise: f64| Case {
        noise,
        ..Case::between(&format!("unrelated textures, {noise} noise"), vec![speckles(20)], vec![speckles(21)])
    };
    let coarse = |seed: u64| {
        Surface::everywhere(Texture::speckles(seed, 12.0, MIDDLE_PX, [220.0; 2]), Deformation::NONE)
    };
    let blobs = Case::between("unrelated coarse textures", vec![coarse(22)], vec![coarse(23)]);
    vec![unrelated(0.0), unrelated(0.05), unrelated(0.1), blobs]
}

#[test]
fn what_is_not_there_is_not_found() {
    hold(other_textures(), 0.0);
}

fn noises() -> Vec<Case> {
    let noisy = |noise: f64| Case {
        noise,
        ..of(&format!("{noise} noise"), speckles(30), Deformation::rigid(MIDDLE_PX, 0.03, [5.3, -2.7]))
    };
    [0.0, 0.02, 0.05, 0.1].map(noisy).into()
}

#[test]
fn heavy_noise_loses_nothing() {
    hold(noises(), 0.97);
}

fn lattices() -> Vec<Case> {
    let dots = Surface::everywhere(Texture::dots(12.0, 5.0, MIDDLE_PX, [220.0; 2]), Deformation::NONE);
    let still = of("dots against themselves", dots.clone(), Deformation::NONE);
    let moved = of("dots moved by 20 px", dots, Deformation::rigid(MIDDLE_PX, 0.0, [20.0, 0.0]));
    vec![still, moved]
}

#[test]
fn a_pattern_that_repeats_is_right_or_ambiguous() {
    hold(lattices(), 0.0);
}

/// Random pairs at 10 % noise whose subsets do not tell their places from chance by themselves: larger ones around them do.
#[test]
fn where_noise_leaves_too_little_larger_subsets_decide() {
    for (kind, pair, seed) in [
        ("moved by 49 px, subsets of 21 x 21 px", moved as Pair, 1088),
        ("scaled by 0.73", stretched, 1006),
        ("covered by discs, subsets of 23 x 23 px", covered, 1013),
    ] {
        let case = random_case(kind, pair, seed, 320);
        assert!((case.noise - 0.1).abs() < 1e-9, "{kind}");
        let outcome = case.outcome(Acceptance::ByEvidence);
        println!("{kind:<40} {outcome}");
        assert_eq!(outcome.n_wrong, 0, "{kind}: {outcome}");
        // Larger subsets reach over the edges of pictures and of discs, where only neighbours say where a point is.
        assert!(4 * outcome.n_found >= 3 * outcome.n_visible, "{kind}: {outcome}");
    }
}
