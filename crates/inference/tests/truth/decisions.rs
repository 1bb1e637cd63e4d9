//! How often the tests behind the decisions are wrong: the table that the rules print against a quick recount, and what is there is told.

use std::num::NonZero;

use chainwave_analysis::{FalseRate, Rule};
use chainwave_inference::false_choices::{NullChain, PValues, p_values};
use chainwave_inference::{
    damping_rule, hypothesis_rule, scatter_of_bodies_rule, softening_rule, structure_rule,
};

/// Seeds that the table was not counted from.
const FIRST_SEED: u64 = 500_000;
const N_EXPERIMENTS: u64 = 40;
/// A recount off by more happens once in 15 000 tests.
const DEVIATIONS: f64 = 4.0;

const LINEAR: NullChain = NullChain { softens: false, chain_damping_kg_per_s: 0.003, mass_scatter: 0.0 };
const ALIKE_AND_UNDAMPED: NullChain =
    NullChain { softens: true, chain_damping_kg_per_s: 0.0, mass_scatter: 0.0 };

fn of(truth: &NullChain, n: u64, p_value: impl Fn(&PValues) -> f64) -> Vec<f64> {
    let found = p_values(truth, FIRST_SEED..FIRST_SEED + n, NonZero::<usize>::MIN).unwrap();
    found.iter().map(p_value).collect()
}

/// Holds a rule's rates against p-values of cases in which the simpler model holds, and those against the level itself.
fn hold(rule: &Rule, p_values: &[f64]) {
    assert!(!rule.rates.is_empty());
    for rate in &rule.rates {
        let recount = FalseRate::count(rate.what, rate.cases, rate.level, p_values);
        assert!(recount.agrees(rate, DEVIATIONS), "the table says {rate}, a recount {recount}");
        let level = FalseRate { told: (1e6 * rate.level) as u32, of: 1_000_000, ..*rate };
        assert!(rate.agrees(&level, DEVIATIONS), "{rate} is not its level");
    }
    // A one-sided p-value of what cannot be negative ends at a half; below that they are even. Both sides.
    let some = FalseRate::count("", "", 0.3, p_values);
    let stated = FalseRate { told: 300_000, of: 1_000_000, ..some };
    assert!(some.agrees(&stated, DEVIATIONS), "{} of {} p-values below 0.3", some.told, some.of);
}

#[test]
fn a_spring_is_taken_for_a_softening_law_as_often_as_the_table_says() {
    hold(&softening_rule(), &of(&LINEAR, N_EXPERIMENTS, |found| found.softening));
}

#[test]
fn like_bodies_and_no_damping_are_taken_for_others_as_often_as_the_table_says() {
    let found =
        p_values(&ALIKE_AND_UNDAMPED, FIRST_SEED..FIRST_SEED + N_EXPERIMENTS, NonZero::<usize>::MIN).unwrap();
    let of = |p_value: fn(&PValues) -> f64| found.iter().map(p_value).collect::<Vec<_>>();
    hold(&scatter_of_bodies_rule(), &of(|found| found.scatter));
    hold(&damping_rule(), &of(|found| found.chain_damping));
    hold(&structure_rule(), &of(|found| found.structure));
    // Tests that share a level err less often than it, as what they look for is alike.
    let rule = hypothesis_rule();
    for rate in &rule.rates {
        let recount = FalseRate::count(rate.what, rate.cases, rate.level, &of(|found| found.hypothesis));
        assert!(recount.agrees(rate, DEVIATIONS), "the table says {rate}, a recount {recount}");
        let level = FalseRate { told: (1e6 * rate.level) as u32, of: 1_000_000, ..*rate };
        assert!(rate.told * level.of <= level.told * rate.of || rate.agrees(&level, DEVIATIONS), "{rate}");
    }
}

#[test]
fn what_is_there_is_not_missed() {
    const N: u64 = 20;
    let truth = NullChain { softens: true, chain_damping_kg_per_s: 0.003, mass_scatter: 0.013 };
    let found = p_values(&truth, FIRST_SEED..FIRST_SEED + N, NonZero::<usize>::MIN).unwrap();
    for (rule, p_value) in [
        (softening_rule(), (|found| found.softening) as fn(&PValues) -> f64),
        (scatter_of_bodies_rule(), |found| found.scatter),
        (damping_rule(), |found| found.chain_damping),
    ] {
        let told = found.iter().filter(|found| rule.rejects(p_value(found))).count();
        // Effects are of eight standard errors and more, in bodies that are alike: scattering masses may hide one in ten.
        assert!(told * 10 > N as usize * 9, "{}: {told} of {N}", rule.question);
    }
}
