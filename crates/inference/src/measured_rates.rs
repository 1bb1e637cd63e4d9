//! How often the tests of this crate leave a simpler model that holds. `cargo run --release -p chainwave-inference --example false_choices_of_fits`
//! counts anew and prints these lines.

use chainwave_analysis::FalseRate;

const EXPERIMENTS: &str = "synthetic experiments";

pub(crate) const SOFTENING: [FalseRate; 1] =
    [FalseRate { what: "softening", level: 0.01, told: 9, of: 1000, cases: EXPERIMENTS }];
pub(crate) const SCATTER: [FalseRate; 1] =
    [FalseRate { what: "a scatter of bodies", level: 0.01, told: 13, of: 1000, cases: EXPERIMENTS }];
pub(crate) const DAMPING: [FalseRate; 1] =
    [FalseRate { what: "c_d", level: 0.01, told: 7, of: 1000, cases: EXPERIMENTS }];
pub(crate) const STRUCTURE: [FalseRate; 1] =
    [FalseRate { what: "structure", level: 0.01, told: 2, of: 200, cases: EXPERIMENTS }];
pub(crate) const HYPOTHESIS: [FalseRate; 1] =
    [FalseRate { what: "a hypothesis", level: 0.01, told: 1, of: 300, cases: EXPERIMENTS }];
