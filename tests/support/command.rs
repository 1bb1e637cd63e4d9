//! How tests start the command `chainwave`, and assert that it succeeds or fails.

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use crate::support::repository::root;

/// The command `chainwave`, ready for arguments; the program that has OpenCV lies beside it unless this test run does without.
///
/// `cargo xtask test` builds it and names it in `CHAINWAVE_COMMAND`. Without that variable cargo is asked to build it
/// once a process, which takes no time when it is up to date: a binary that happens to lie about may be an old one.
pub(crate) fn chainwave() -> Command {
    static BINARY: OnceLock<PathBuf> = OnceLock::new();
    Command::new(BINARY.get_or_init(|| env::var_os("CHAINWAVE_COMMAND").map_or_else(build, PathBuf::from)))
}

/// Runs a command that must do everything, without a word on standard error: that is a pipe here, where neither progress
/// nor warnings belong. Returns what it printed.
pub(crate) fn succeed(command: &mut Command) -> String {
    let output = command.output().expect("chainwave starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{command:?}: {said}");
    assert!(said.is_empty(), "{command:?} on standard error: {said}");
    String::from_utf8(output.stdout).expect("chainwave prints text")
}

/// Runs a command that must end with this exit code and a reason. Returns the reason.
pub(crate) fn fail(command: &mut Command, code: i32) -> String {
    let output = command.output().expect("chainwave starts");
    let said = String::from_utf8(output.stderr).expect("chainwave writes text");
    assert_eq!(output.status.code(), Some(code), "{command:?}: {said}");
    assert!(!said.trim().is_empty(), "{command:?} gives no reason");
    said
}

/// Builds the command and returns where cargo put it.
fn build() -> PathBuf {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--release", "-p", "chainwave", "--message-format", "json-render-diagnostics"]);
    if cfg!(feature = "opencv") {
        // What takes OpenCV is done by the program beside it.
        cargo.args(["-p", "chainwave-opencv"]);
    }
    if let Some(target) = target_folder() {
        cargo.arg("--target-dir").arg(target);
    }
    let output = cargo.current_dir(root()).stderr(Stdio::inherit()).output().expect("cargo starts");
    assert!(output.status.success(), "building chainwave: {}", output.status);
    executable(&String::from_utf8_lossy(&output.stdout)).expect("cargo names the binary it built")
}

/// The target folder in which this test lies, `target/release/deps/all-0123456789abcdef`.
fn target_folder() -> Option<PathBuf> {
    let test = env::current_exe().ok()?;
    let deps = test.parent().filter(|folder| folder.ends_with("deps"))?;
    deps.ancestors().nth(2).map(Path::to_owned)
}

/// The binary `chainwave` among cargo's messages, one JSON object a line.
fn executable(messages: &str) -> Option<PathBuf> {
    messages
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter(|message| message["target"]["name"] == "chainwave")
        .find_map(|message| message["executable"].as_str().map(PathBuf::from))
}
