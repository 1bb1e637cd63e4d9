//! How often the tests of this crate leave a simpler model that holds. `cargo run --release -p chainwave-analysis --example false_choices_of_waves`
//! counts anew; what it printed is kept beside the book, and a test holds these lines against it.

use crate::rule::FalseRate;

const TRACKS: &str = "synthetic recordings at rest";
const NOISE: &str = "synthetic tails of noise";
const PULSES: &str = "synthetic pulses of one speed";

pub(crate) const MOTION_ACROSS: [FalseRate; 1] =
    [FalseRate { what: "motion across", level: 0.01, told: 13, of: 1000, cases: TRACKS }];
pub(crate) const LINE: [FalseRate; 1] =
    [FalseRate { what: "a line", level: 0.01, told: 11, of: 1000, cases: NOISE }];
pub(crate) const ONE_SPEED: [FalseRate; 1] =
    [FalseRate { what: "a varying speed", level: 0.01, told: 12, of: 1000, cases: PULSES }];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_those_of_the_counts() {
        let counts = include_str!("../../../docs/src/measured/counts/false-choices-of-waves.csv");
        for (rate, name) in
            [(&MOTION_ACROSS[0], "motion_across"), (&LINE[0], "line"), (&ONE_SPEED[0], "one_speed")]
        {
            let counted = FalseRate::count_column(rate.what, rate.cases, rate.level, counts, name);
            assert_eq!(counted.as_ref(), Some(rate), "{name}");
        }
    }
}
