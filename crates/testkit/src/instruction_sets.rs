//! The same numbers by every instruction set that the machine has, in a process each.

use std::env;
use std::process::Command;

use chainwave_vectors::InstructionSet;

/// Which set a process that a test starts is to find in use.
const EXPECTED: &str = "CHAINWAVE_TEST_EXPECTED_SET";
/// Before each digest on standard output.
const MARK: &str = "bits of ";

/// Starts the present test binary once for each set, by the switch that users have, and asks that all say the same.
///
/// `test` is the full name of the test that calls this, which each process comes to again and says its `digests` there, a line each; there
/// must be at least `n_least`.
///
/// # Panics
/// A set gives other digests than the best one, a process fails, or the switch does not take.
#[expect(clippy::print_stdout, reason = "what a process computed goes to the one that started it")]
#[expect(clippy::expect_used, reason = "a test fails by panicking")]
pub fn hold_each_to_the_same_bits(test: &str, n_least: usize, digests: impl Fn() -> Vec<String>) {
    if let Ok(expected) = env::var(EXPECTED) {
        assert_eq!(InstructionSet::in_use().name(), expected);
        digests().iter().for_each(|digest| println!("{MARK}{digest}"));
        return;
    }
    let said = |asked: &str, expected: InstructionSet| {
        let run = Command::new(env::current_exe().expect("a test knows its binary"))
            .args(["--exact", test, "--nocapture"])
            .env(InstructionSet::VARIABLE, asked)
            .env(EXPECTED, expected.name())
            .output()
            .expect("the test binary starts");
        let text = String::from_utf8_lossy(&run.stdout);
        assert!(run.status.success(), "{asked}: {text}{}", String::from_utf8_lossy(&run.stderr));
        text.lines().filter_map(|line| Some(line.split_once(MARK)?.1.to_owned())).collect::<Vec<_>>()
    };
    let sets: Vec<InstructionSet> = InstructionSet::available().collect();
    let best = *sets.last().expect("the portable set is always there");
    let of_best = said("a name that is none", best);
    assert!(of_best.len() >= n_least, "expected {n_least} digests or more, found {of_best:?}");
    for set in sets {
        assert_eq!(said(set.name(), set), of_best, "{set} against {best}");
    }
}
