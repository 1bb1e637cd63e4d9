//! How often the tests behind the decisions are wrong: the table that the rules print against a quick recount.

use std::num::NonZero;

use chainwave_analysis::{FalseRate, Rule, false_choices, line_rule, motion_across_rule, one_speed_rule};

/// Seeds that the table was not counted from.
const FIRST_SEED: u64 = 500_000;
/// A recount off by more happens once in 15 000 tests.
const DEVIATIONS: f64 = 4.0;

/// Holds a rule's rates against p-values of cases in which the simpler model holds, and those against the level itself.
fn hold(rule: &Rule, p_values: &[f64]) {
    assert!(!rule.rates.is_empty());
    for rate in &rule.rates {
        let recount = FalseRate::count(rate.what, rate.cases, rate.level, p_values);
        assert!(recount.agrees(rate, DEVIATIONS), "the table says {rate}, a recount {recount}");
        let level = FalseRate { told: (1e6 * rate.level) as u32, of: 1_000_000, ..*rate };
        assert!(rate.agrees(&level, DEVIATIONS), "{rate} is not its level");
    }
    // The median of p-values is a half: both sides.
    let half = FalseRate::count("", "", 0.5, p_values);
    let stated = FalseRate { told: 500_000, of: 1_000_000, ..half };
    assert!(half.agrees(&stated, DEVIATIONS), "{} of {} p-values below a half", half.told, half.of);
}

#[test]
fn rest_is_taken_for_motion_as_often_as_the_table_says() {
    hold(&motion_across_rule(), &false_choices::of_bodies_at_rest(FIRST_SEED..FIRST_SEED + 400));
}

#[test]
fn noise_is_taken_for_a_line_as_often_as_the_table_says() {
    hold(&line_rule(), &false_choices::of_continua(FIRST_SEED..FIRST_SEED + 2000));
}

#[test]
fn one_speed_is_taken_for_a_varying_one_as_often_as_the_table_says() {
    let one = NonZero::<usize>::MIN;
    hold(&one_speed_rule(), &false_choices::of_one_speed(FIRST_SEED..FIRST_SEED + 100, 0.0, one).unwrap());
    let varying = false_choices::of_one_speed(FIRST_SEED..FIRST_SEED + 10, 0.02, one).unwrap();
    assert!(varying.iter().all(|p_value| one_speed_rule().rejects(*p_value)), "{varying:?}");
}
