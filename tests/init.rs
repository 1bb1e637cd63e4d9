//! From a folder of recordings to a first experiment: `chainwave init`.

use std::fs;

use tempfile::TempDir;

use crate::command::{chainwave, fail, succeed};
use crate::repository::root;

#[test]
fn a_folder_of_recordings_becomes_an_experiment_to_fill_in() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let sample = root().join("data-samples/hec-view1-trial1.cine");
    for name in ["view2_trial10.cine", "view2_trial9.cine"] {
        fs::copy(&sample, folder.path().join(name)).expect("the sample can be copied");
    }
    fs::write(folder.path().join("notes.txt"), "no recording\n").expect("a file can be written");
    succeed(chainwave().arg("init").arg(folder.path()));

    let read = |name: &str| fs::read_to_string(folder.path().join(name)).expect("init wrote it");
    assert_eq!(
        read("trials.csv"),
        "recording,view,trial,stage_m\nview2_trial9.cine,2,9,FILL_IN\nview2_trial10.cine,2,10,FILL_IN\n"
    );
    assert!(read("experiment.toml").contains("240 x 40 px, 12 bit, 120 frames"), "it says what was found");

    // What the pictures tell is filled in: two markers stand in the sample, 105 px apart by its own description.
    let text = read("experiment.toml");
    assert!(text.contains("first_body_px = [") && !text.contains("first_body_px = [FILL_IN"), "{text}");
    assert!(folder.path().join("markers.png").exists());

    // What is not filled in yet is named with its line.
    let experiment = folder.path().join("experiment.toml");
    let message =
        fail(chainwave().arg("run").arg(&experiment).arg("--out").arg(folder.path().join("out")), 2);
    assert!(message.contains("FILL_IN") && message.contains("line "), "{message}");

    let message = fail(chainwave().arg("init").arg(folder.path()), 2);
    assert!(message.contains("overwrites nothing"), "{message}");
}
