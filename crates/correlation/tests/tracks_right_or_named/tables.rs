//! The table of the book: what each method finds in each kind of film, and the long count.
//!
//! The long count: `FILMS=40 cargo test --release -p chainwave-correlation --test tracks_right_or_named -- --ignored --nocapture less_than`;
//! with `MIN_ZNCC=0.6` as well, what acceptance by that bound alone does to the same films.

use std::collections::BTreeMap;

use chainwave_correlation::Acceptance;

use crate::films::outcome::Outcome;
use crate::films::{count, count_a_million};

/// The crate's own methods, each with the n of every n-th subset that it takes.
fn each(icgn: usize, template: usize) -> Vec<(&'static str, usize)> {
    let own = ["icgn-cubic-affine", "icgn-cubic-translation", "icgn-cubic-rigid", "icgn-cubic-quadratic"];
    own.map(|name| (name, icgn)).into_iter().chain([("template-parabola", template)]).collect()
}

#[test]
#[ignore = "a table of the book, of some minutes"]
fn table() {
    let methods = each(4, 32);
    println!("count: film,methods,ok,seen,found,wrong");
    let mut rows: BTreeMap<String, Vec<Outcome>> = BTreeMap::new();
    for ((_, film), outcome) in count(&methods, 1..3, Acceptance::ByEvidence) {
        rows.entry(film).or_default().push(outcome);
    }
    for (film, outcomes) in rows {
        let (n, sum) = (outcomes.len(), outcomes.into_iter().sum::<Outcome>());
        println!("count: \"{film}\",{n},{},{},{},{}", sum.n_ok, sum.n_visible, sum.n_found, sum.n_wrong);
    }
}

#[test]
#[ignore = "a count of a million readings, which takes the better part of an hour"]
fn less_than_one_in_a_million_is_false() {
    count_a_million(&each(1, 16));
}
