//! How often the tests of this crate leave a simpler model that holds. `cargo run --release -p chainwave-inference --example false_choices_of_fits`
//! counts anew; what it printed is kept beside the book, and a test holds these lines against it.

use chainwave_analysis::FalseRate;

const EXPERIMENTS: &str = "synthetic experiments";

pub(crate) const SOFTENING: [FalseRate; 1] =
    [FalseRate { what: "softening", level: 0.01, told: 9, of: 1000, cases: EXPERIMENTS }];
pub(crate) const SCATTER: [FalseRate; 1] =
    [FalseRate { what: "a scatter of bodies", level: 0.01, told: 13, of: 1000, cases: EXPERIMENTS }];
pub(crate) const DAMPING: [FalseRate; 1] =
    [FalseRate { what: "c_d", level: 0.01, told: 7, of: 1000, cases: EXPERIMENTS }];
pub(crate) const STRUCTURE: [FalseRate; 1] =
    [FalseRate { what: "structure", level: 0.01, told: 9, of: 1000, cases: EXPERIMENTS }];
pub(crate) const HYPOTHESIS: [FalseRate; 1] =
    [FalseRate { what: "a hypothesis", level: 0.01, told: 3, of: 1000, cases: EXPERIMENTS }];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_those_of_the_counts() {
        let counts = include_str!("../../../docs/src/measured/counts/false-choices-of-fits.csv");
        for (rate, name) in [
            (&SOFTENING[0], "softening"),
            (&SCATTER[0], "scatter"),
            (&DAMPING[0], "damping"),
            (&STRUCTURE[0], "structure"),
            (&HYPOTHESIS[0], "hypothesis"),
        ] {
            let counted = FalseRate::count_column(rate.what, rate.cases, rate.level, counts, name);
            assert_eq!(counted.as_ref(), Some(rate), "{name}");
        }
    }
}
