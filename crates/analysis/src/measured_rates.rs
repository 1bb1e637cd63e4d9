//! How often the tests of this crate leave a simpler model that holds. `cargo run --release -p chainwave-analysis --example false_choices_of_waves`
//! counts anew and prints these lines.

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
