use crate::command::chainwave;

#[test]
fn bad_arguments_end_with_exit_code_2_and_a_reason() {
    let output = chainwave().arg("no-such-command").output().expect("chainwave starts");
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("no-such-command"), "{message}");
    assert!(output.stdout.is_empty(), "standard output is for results");
}
