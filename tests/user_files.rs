//! What belongs to the user: recordings that were not filmed, comments, figures, links, and what a failing stream must not take along.

use std::fs::{self, File};

use crate::support::command::{chainwave, fail, succeed};
use crate::support::laboratory::Laboratory;
use crate::support::repository::root;

const SAMPLE: &str = "data-samples/hec-view1-trial1.cine";
const POINTS: &str = "name,x_px,y_px,half_width_px,half_height_px\n1,25,19.5,11,11\n";

/// A laboratory of one short recording.
fn laboratory() -> Laboratory {
    let laboratory = Laboratory::with_experiment("n_frames = 330", "n_frames = 45");
    laboratory.write("trials.csv", "recording,view,trial,stage_m\nview1_trial1.cine,1,1,0.0\n");
    laboratory
}

#[test]
fn recordings_that_were_not_filmed_are_not_replaced() {
    let laboratory = laboratory();
    let own = laboratory.path("");
    let real = laboratory.write("view1_trial1.cine", "what a camera saw");
    let said = fail(&mut laboratory.filming(&own), 2);
    assert!(said.contains("view1_trial1.cine") && said.contains("may be a real one"), "{said}");
    assert_eq!(fs::read_to_string(&real).expect("it is there"), "what a camera saw");
    // Nor what lies elsewhere.
    laboratory.write("trials.csv", "recording,view,trial,stage_m\n../view1_trial1.cine,1,1,0.0\n");
    let said = fail(&mut laboratory.filming(&laboratory.path("films")), 2);
    assert!(said.contains("../view1_trial1.cine") && said.contains("in the folder itself"), "{said}");
    assert_eq!(fs::read_to_string(&real).expect("it is there"), "what a camera saw");
}

#[test]
fn a_recording_in_a_folder_within_is_filmed_there() {
    let laboratory = laboratory();
    laboratory.write("trials.csv", "recording,view,trial,stage_m\nnear/view1_trial1.cine,1,1,0.0\n");
    succeed(&mut laboratory.filming(&laboratory.path("films")));
    assert!(laboratory.path("films/near/view1_trial1.cine").exists());
}

#[test]
fn films_of_another_plan_are_replaced_and_an_experiment_beside_them_keeps_its_comments() {
    let laboratory = laboratory();
    let own = laboratory.path("");
    let stated = fs::read_to_string(laboratory.path("experiment.toml")).expect("it was written");
    assert!(stated.contains('#'), "the plan has comments");
    let film = |seed: &str| {
        succeed(laboratory.filming(&own).args(["--seed", seed]));
        fs::read(laboratory.path("view1_trial1.cine")).expect("it was filmed")
    };
    succeed(&mut laboratory.filming(&own));
    let as_stated = fs::read(laboratory.path("view1_trial1.cine")).expect("it was filmed");
    assert_eq!(fs::read_to_string(laboratory.path("experiment.toml")).expect("it is there"), stated);
    // Cut off in the middle, a plan is known by the sign that stands there before the first film.
    fs::remove_file(laboratory.path("truth.json")).expect("it was written");
    assert_ne!(film("77"), as_stated);
}

#[cfg(target_os = "linux")]
#[test]
fn streams_that_are_full_cost_no_results() {
    let laboratory = laboratory();
    let full = || File::options().write(true).open("/dev/full").expect("Linux has it");
    let good = root().join(SAMPLE);
    let points = laboratory.write("points.csv", POINTS);
    let out = laboratory.path("tracks.csv");
    let mut track = chainwave();
    track.arg("track").arg(&good).arg("nope.cine").arg("--points").arg(&points).arg("--out").arg(&out);
    let status = track.stderr(full()).stdout(full()).status().expect("chainwave starts");
    assert_eq!(status.code(), Some(1));
    assert!(out.exists(), "the good recording was tracked");
    let inspect = chainwave().arg("inspect").arg(&good).arg("--json").stdout(full()).output();
    let inspect = inspect.expect("chainwave starts");
    assert_eq!(inspect.status.code(), Some(1), "an answer that nobody got is none");
    assert!(String::from_utf8_lossy(&inspect.stderr).contains("standard output"), "{inspect:?}");
}

#[cfg(unix)]
#[test]
fn a_link_is_written_through() {
    let laboratory = laboratory();
    let [target, link] = ["far.csv", "near.csv"].map(|name| laboratory.path(name));
    fs::write(&target, "old").expect("it can be written");
    std::os::unix::fs::symlink(&target, &link).expect("links can be made");
    let points = laboratory.write("points.csv", POINTS);
    let mut track = chainwave();
    track.arg("track").arg(root().join(SAMPLE)).arg("--points").arg(&points).arg("--out").arg(&link);
    succeed(&mut track);
    assert!(link.is_symlink() && fs::read_to_string(&target).expect("it is there").contains("x_px"));
}

mod slow {
    use std::path::Path;

    use super::*;
    use crate::support::folder::files;
    use crate::support::laboratory::evaluation;
    use crate::support::table::Table;

    #[test]
    fn a_velocity_without_recordings_does_not_end_the_others() {
        let laboratory = Laboratory::with_strikers(&["2.73", "0.83"]);
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        for file in fs::read_dir(&recordings).expect("it was filmed").map(|file| file.expect("a file").path())
        {
            if file.file_name().is_some_and(|name| name.to_string_lossy().starts_with("2.73_")) {
                fs::write(&file, "torn").expect("it can be written");
            }
        }
        // What an earlier run of one velocity left is none of theirs.
        fs::create_dir_all(results.join("figures")).expect("folders can be made");
        fs::write(results.join("results.json"), "{}").expect("it can be written");
        fs::write(results.join("figures/my-drawing.svg"), "mine").expect("it can be written");
        fs::write(results.join("figures/peak-trace.svg"), "of an earlier run").expect("it can be written");
        fail(&mut evaluation(&recordings, &results), 1);
        assert!(results.join("striker-0.83-m-per-s/results.json").exists());
        assert!(results.join("report.html").exists() && results.join("figures/my-drawing.svg").exists());
        assert!(!results.join("results.json").exists() && !results.join("figures/peak-trace.svg").exists());
        let report = fs::read_to_string(results.join("report.html")).expect("it was written");
        assert!(report.contains("Striker at 2.73 m/s could not be evaluated"), "a failure comes first");
        let table = Table::read(&results.join("group_velocity.parquet"));
        assert_eq!(table.texts("source").iter().filter(|source| *source == "experiment").count(), 1);
        let states = Table::read(&results.join("recordings.csv"));
        assert_eq!(states.n_rows(), 30);
    }

    fn lose_recordings(folder: &Path) {
        for file in fs::read_dir(folder).expect("it was filmed").map(|file| file.expect("a file").path()) {
            if file.extension().is_some_and(|ending| ending == "cine") {
                fs::remove_file(&file).expect("it can be removed");
            }
        }
    }

    /// What a run and its user left, but for kept tracks.
    fn left(results: &Path) -> Vec<String> {
        let shown = files(results).into_iter().map(|file| file.to_string_lossy().into_owned());
        shown.filter(|file| !file.contains(".work")).collect()
    }

    #[test]
    fn a_run_without_recordings_leaves_nothing_of_an_earlier_one_and_all_that_is_the_users() {
        let laboratory = Laboratory::new();
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        succeed(evaluation(&recordings, &results).arg("--budget"));
        succeed(chainwave().arg("figures").arg(&results));
        fs::write(results.join("figures/my-drawing.svg"), "mine").expect("it can be written");
        fs::write(results.join("notes.txt"), "mine").expect("it can be written");
        lose_recordings(&recordings);
        fail(&mut evaluation(&recordings, &results), 2);
        let mut left = left(&results);
        left.sort();
        assert_eq!(left, ["figures/my-drawing.svg", "notes.txt", "recordings.csv", "results.json"]);
        let said = fs::read_to_string(results.join("results.json")).expect("it was written");
        assert!(said.contains("unsolved"), "{said}");
    }

    #[test]
    fn a_run_of_one_velocity_leaves_nothing_of_one_of_several_and_the_other_way_round() {
        let laboratory = Laboratory::with_strikers(&["2.73", "0.83"]);
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        succeed(&mut evaluation(&recordings, &results));
        assert!(results.join("group_velocity.parquet").exists());
        let trials = fs::read_to_string(recordings.join("trials.csv")).expect("it was written");
        let of_one: Vec<&str> = trials.lines().filter(|line| !line.starts_with("0.83_")).collect();
        fs::write(recordings.join("trials.csv"), of_one.join("\n")).expect("it can be written");
        succeed(&mut evaluation(&recordings, &results));
        let of_several = |file: &String| file.contains("group") || file.contains("striker-");
        let stale: Vec<String> = left(&results).into_iter().filter(of_several).collect();
        assert!(stale.is_empty() && results.join("results.json").exists(), "{stale:?}");
        // Kept tracks are no results: the velocity that comes back takes them again.
        assert!(results.join("striker-0.83-m-per-s/.work").exists());
        fs::write(recordings.join("trials.csv"), &trials).expect("it can be written");
        succeed(&mut evaluation(&recordings, &results));
        assert!(!results.join("results.json").exists() && !results.join("tracks.parquet").exists());
        lose_recordings(&recordings);
        fail(&mut evaluation(&recordings, &results), 2);
        let mut left = left(&results);
        left.sort();
        let expected =
            ["recordings.csv", "striker-0.83-m-per-s/results.json", "striker-2.73-m-per-s/results.json"];
        assert_eq!(left, expected);
    }

    #[test]
    fn films_of_a_longer_chain_than_is_stated_are_evaluated() {
        let laboratory = Laboratory::new();
        let recordings = laboratory.film();
        let path = recordings.join("experiment.toml");
        let plan = fs::read_to_string(&path).expect("it was filmed");
        let (from, to) = ("n_bodies = 12", "n_bodies = 11");
        assert!(plan.contains(from), "{plan}");
        let stated = laboratory.write("recordings/shorter.toml", &plan.replacen(from, to, 1));
        let results = laboratory.path("results");
        let mut run = chainwave();
        run.arg("run").arg(&stated).arg("--out").arg(&results);
        // A chain that ends where it does not is refused its dampings.
        let status = run.output().expect("chainwave starts").status;
        assert_eq!(status.code(), Some(0));
        let text = fs::read_to_string(results.join("results.json")).expect("it was written");
        assert!(text.contains("film_truth") && text.contains("expected a chain of 12 bodies"), "{text}");
    }
}
