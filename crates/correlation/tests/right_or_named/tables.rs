//! The tables of the book: what fields find of each kind of pair, and the long count.
//!
//! The long count: `cargo test --release -p chainwave-correlation --test right_or_named -- --ignored --nocapture less_than`; `CASE` names a part of
//! a kind of pair, `PAIRS` how many of each, `FIRST` the seed of the first, `SIZE` the side of the pictures; with `MIN_ZNCC=0.6` as well, what
//! acceptance by that bound alone does to the same pairs.

use std::time::Instant;

use chainwave_correlation::Acceptance;

use crate::outcome::Outcome;
use crate::pairs::{Case, PAIRS, random_case};
use crate::{bodies_on_black, lattices, noises, other_textures, scales, stretches, turns};

#[test]
#[ignore = "a table of the book, which the tests above hold case by case"]
fn table() {
    println!("count: second_picture,seen,found,wrong");
    for (row, cases) in [
        ("stretched along x by -0.5, -0.25, 0.3, 0.45, 1", stretches()),
        ("scaled by 0.5, 0.75, 1.4, 2", scales()),
        ("turned by 30, 50, 90, 130, 170 degrees", turns()),
        ("four bodies on black, turned by 0, 25, -70, 160 degrees", bodies_on_black()),
        ("moved and turned, at 0, 2, 5 and 10 % noise", noises()),
        ("another texture, at 0, 5 and 10 % noise, and a coarse one", other_textures()),
        ("dots on a lattice, still and moved by 20 px", lattices()),
    ] {
        let sum: Outcome = cases.iter().map(|case| case.outcome(Acceptance::ByEvidence)).sum();
        println!("count: \"{row}\",{},{},{}", sum.n_visible, sum.n_found, sum.n_wrong);
    }
}

/// Pairs of each kind of the table below.
const N_PAIRS: u64 = 3;

#[test]
#[ignore = "a table of the book, of some minutes"]
fn random_pairs() {
    println!("count: second_picture,pairs,ok,seen,found,wrong");
    for (kind, pair, _) in PAIRS {
        let cases = (1000..1000 + N_PAIRS).map(|seed| random_case(kind, pair, seed, 320));
        let sum: Outcome = cases.map(|case| case.outcome(Acceptance::ByEvidence)).sum();
        println!("count: {kind},{N_PAIRS},{},{},{},{}", sum.n_ok, sum.n_visible, sum.n_found, sum.n_wrong);
    }
}

/// Side of the pictures, in pixels.
const SIZE_PX: u64 = 1000;
/// Of how many readings called ok none has to be wrong, so that fewer than one in a million is, with 95 % confidence: -ln 0.05 = 3.0.
const ENOUGH: usize = 3_000_000;

/// What a kind of pair gives.
#[derive(Debug, Default, Clone, Copy)]
struct Count {
    outcome: Outcome,
    n_pairs: usize,
    /// Subsets called ok that share no pixels: as many as would lie side by side.
    n_apart: f64,
}

impl Count {
    fn add(&mut self, case: &Case, outcome: Outcome) {
        self.n_pairs += 1;
        self.n_apart += case.own_share() * outcome.n_ok as f64;
        self.outcome = [self.outcome, outcome].into_iter().sum();
    }

    fn print(&self, kind: &str) {
        let Self { outcome: Outcome { n_ok, n_visible, n_found, n_wrong, .. }, n_pairs, n_apart } = self;
        println!("count: {kind},{n_pairs},{n_ok},{n_apart:.0},{n_visible},{n_found},{n_wrong}");
    }
}

#[test]
#[ignore = "a count of millions of points, which takes some twenty minutes"]
fn less_than_one_in_a_million_is_false() {
    let number = |name: &str| std::env::var(name).ok().and_then(|number| number.parse::<u64>().ok());
    let (first, size_px) = (number("FIRST").unwrap_or(10_000), number("SIZE").unwrap_or(SIZE_PX) as usize);
    let least: Option<f64> = std::env::var("MIN_ZNCC").ok().and_then(|least| least.parse().ok());
    let acceptance = least.map_or(Acceptance::ByEvidence, Acceptance::Zncc);
    let only = std::env::var("CASE").unwrap_or_default();
    let mut all = Count::default();
    println!("count: second_picture,pairs,ok,apart,seen,found,wrong");
    for (kind, pair, share) in PAIRS.iter().filter(|(kind, ..)| kind.contains(&only)) {
        let begun = Instant::now();
        let mut count = Count::default();
        for seed in first..first + number("PAIRS").unwrap_or(share.most_pairs) {
            if number("PAIRS").is_none() && count.outcome.n_ok >= share.n_ok {
                break;
            }
            let case = random_case(kind, *pair, seed, size_px);
            let outcome = case.outcome(acceptance);
            if outcome.n_wrong > 0 {
                let (noise, grid, deformation) = (case.noise, case.grid, case.after[0].deformation);
                println!("{kind}, seed {seed}, noise {noise}, {grid:?}: {outcome}, {deformation:?}");
            }
            count.add(&case, outcome);
            all.add(&case, outcome);
        }
        count.print(kind);
        println!("{kind}: {:.1} s", begun.elapsed().as_secs_f64());
    }
    all.print("all");
    assert!(all.outcome.n_wrong == 0 || least.is_some(), "{}", all.outcome);
    let is_whole = only.is_empty() && number("PAIRS").is_none() && number("SIZE").is_none();
    assert!(!is_whole || all.outcome.n_ok >= ENOUGH, "{}", all.outcome);
}
