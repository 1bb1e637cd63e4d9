//! From a folder of recordings to a first experiment: `chainwave init`.

use std::fs;

use tempfile::TempDir;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::laboratory::Laboratory;
use crate::support::repository::root;

/// The number behind a key in a text.
fn number_behind(text: &str, key: &str) -> f64 {
    let (_, rest) = text.split_once(key).unwrap_or_else(|| panic!("{key} is missing in:\n{text}"));
    let number: String =
        rest.trim_start().chars().take_while(|c| c.is_ascii_digit() || "+-.e".contains(*c)).collect();
    number.parse().unwrap_or_else(|_| panic!("{key} {number:?} in:\n{text}"))
}

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

    // What the pictures tell is filled in: by the sample's own description three markers stand in it, at (25, 19.5) and 75 px apart, and the
    // striker comes at t = 0. Places of proposed markers are good to 2 px.
    let text = read("experiment.toml");
    let number_behind = |key| number_behind(&text, key);
    assert!((number_behind("first_body_px = [") - 25.0).abs() < 2.0, "{text}");
    assert!((number_behind("over the pitch:") - 75.0).abs() < 0.5, "{text}");
    let rest_s = number_behind("rest_until_s =");
    // Frames lie 80 us apart; a body that is struck is seen to move within a few of them.
    assert!((-4e-3..4e-4).contains(&rest_s), "{rest_s}");
    assert!(folder.path().join("markers.png").exists());

    // What is not filled in yet is named with its line.
    let experiment = folder.path().join("experiment.toml");
    let message =
        fail(chainwave().arg("run").arg(&experiment).arg("--out").arg(folder.path().join("out")), 2);
    assert!(message.contains("FILL_IN") && message.contains("in lines "), "{message}");

    let message = fail(chainwave().arg("init").arg(folder.path()), 2);
    assert!(message.contains("overwrites nothing"), "{message}");
}

mod slow {
    use super::*;

    #[test]
    fn a_run_has_nothing_against_the_subsets_that_init_chose() {
        let laboratory = Laboratory::new();
        let recordings = laboratory.film();
        let shots = laboratory.path("shots");
        fs::create_dir(&shots).expect("a folder can be made");
        for trial in 1..=5 {
            for view in 1..=3 {
                let name = format!("view{view}_trial{trial}.cine");
                fs::copy(recordings.join(&name), shots.join(&name)).expect("the recording can be copied");
            }
        }
        succeed(chainwave().arg("init").arg(&shots));
        let text = fs::read_to_string(shots.join("experiment.toml")).expect("init wrote it");
        // As the user would: what init chose, with the rest as the experiment knows it.
        let lines = |file: &str| fs::read_to_string(recordings.join(file)).expect("it was filmed");
        let changed: Vec<String> = lines("experiment.toml")
            .lines()
            .map(|line| {
                let key = ["half_width_px", "half_height_px"].into_iter().find(|key| line.starts_with(key));
                match key {
                    Some(key) => format!("{key} = {}", number_behind(&text, &format!("{key} ="))),
                    None if line.starts_with("first_body_px") => text
                        .lines()
                        .find(|line| line.starts_with("first_body_px"))
                        .expect("init found a marker")
                        .to_owned(),
                    None => line.to_owned(),
                }
            })
            .collect();
        fs::write(shots.join("experiment.toml"), changed.join("\n")).expect("the folder takes a file");
        fs::write(shots.join("trials.csv"), lines("trials.csv")).expect("the folder takes a file");
        let out = laboratory.path("results");
        let said = succeed(chainwave().arg("run").arg(shots.join("experiment.toml")).arg("--out").arg(&out));
        let results = fs::read_to_string(out.join("results.json")).expect("it was run");
        assert!(!results.contains("sharp edges"), "{said}");
        // Not for want of a subset: markers of 27 x 27 px leave 8 px within 5 px of their edges.
        let half_px = number_behind(&text, "half_width_px =");
        assert!((6.0..=9.0).contains(&half_px), "{half_px}");
    }
}
