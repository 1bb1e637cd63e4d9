//! What a command says: nothing but errors with `--quiet`, one object with `--json`, and nothing to a reader that no longer listens.

use std::path::Path;
use std::process::Stdio;

use serde_json::Value;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::repository::root;

fn sample() -> std::path::PathBuf {
    root().join("data-samples/hec-view1-trial1.cine")
}

#[test]
fn who_closes_the_pipe_ends_no_command() {
    let mut command = chainwave();
    command.arg("inspect").arg(sample()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("chainwave starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("the command has ended");
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_failure_is_an_object_too_and_is_said_quietly() {
    let missing = Path::new("no such recording.cine");
    let mut command = chainwave();
    command
        .args(["--json", "--quiet", "track"])
        .arg(missing)
        .args(["--points", "none.csv", "--out", "t.csv"]);
    let output = command.output().expect("chainwave starts");
    assert_eq!(output.status.code(), Some(2));
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(told["error"].as_str().is_some_and(|error| !error.is_empty()), "{told}");
    let said = fail(chainwave().args(["--quiet", "inspect"]).arg(missing), 2);
    assert!(said.contains("no such recording.cine"), "{said}");
}

#[test]
fn an_object_is_the_same_with_and_without_quiet() {
    let told = |options: &[&str]| succeed(chainwave().args(options).arg("inspect").arg(sample()));
    assert_eq!(told(&["--json"]), told(&["--json", "--quiet"]));
    assert_eq!(told(&["--quiet"]), told(&[]));
}
