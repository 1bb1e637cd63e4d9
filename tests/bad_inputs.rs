//! What the command refuses, and how: exit code 2, and a message that names the place.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::Gray16;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::laboratory::{Laboratory, N_RECORDINGS, evaluation};
use crate::support::repository::root;
use crate::support::table::Table;

/// A wrong experiment: the text to replace, what to put there, and a word of the message beside the line.
const WRONG_SETTINGS: [(&str, &str, &str); 10] = [
    ("velocity_m_per_s = 2.73", "speed_m_per_s = 2.73", "speed_m_per_s"),
    ("mass_kg = 0.455e-3", "mass_kg = \"light\"", "light"),
    ("mass_kg = 4.3e-3", "mass_kg = -4.3e-3", "above 0"),
    ("delta_0_m = 2.27e-3", "delta_0_m = nan", "above 0"),
    ("p = 0.114", "p = inf", "above 0"),
    ("law = \"power\"", "law = \"hooke\"", "hooke"),
    ("[chain]\nn_bodies = 12", "[chain]\nn_bodies = 1", "at least 2"),
    ("half_height_px = 8", "half_height_px = 8\nshape = \"cubist\"", "affine"),
    ("half_width_px = 8 ", "half_width_px = 8.5 ", "half_width_px"),
    ("[contact]", "[contact", "]"),
];

/// A wrong table of trials: the text to replace, what to put there, and the place that the message names.
const WRONG_CELLS: [(&str, &str, &str); 7] = [
    ("trial2.cine,1,2,0.00", "trial2.cine,1,2,far", "line 3, column stage_m"),
    ("trial3.cine,1,3,0.00", "trial3.cine,1,3,", "line 4, column stage_m"),
    ("view2_trial1.cine,2,", "view2_trial1.cine,2.5,", "line 7, column view"),
    ("view2_trial1.cine,2,1", "view2_trial1.cine,2,99999999999", "line 7, column trial"),
    ("view3_trial1.cine", "view1_trial1.cine", "line 12, column recording"),
    ("view3_trial5.cine", "", "line 16, column recording"),
    ("stage_m", "stage_mm", "line 1"),
];

/// Two markers of the sample recording.
const POINTS: &str = "name,x_px,y_px,half_width_px,half_height_px\n1,25,19.5,11,11\n2,100,19.5,11,11\n";

/// A wrong table of points, and what the message names.
const WRONG_POINTS: [(&str, &str); 7] = [
    ("name,x_px,y_px,half_width_px,half_height_px\n1,30,mid,11,11\n", "line 2, column y_px"),
    ("name,x_px,y_px,half_width_px,half_height_px\n1,30,23.5,11,11.5\n", "line 2, column half_height_px"),
    ("name,x_px,y_px,half_width_px,half_hight_px\n1,30,23.5,11,11\n", "half_height_px"),
    ("name,x_px,y_px\n,30,23.5\n", "line 2, column name: expected a name, found nothing"),
    (
        "name,x_px,y_px,half_width_px,half_height_px\n1,30,23.5,1e300,11\n",
        "a whole number from 0 to 999999, or nothing, found 1e300",
    ),
    ("name,x_px,y_px,half_width_px,half_height_px\n", "at least one point"),
    (
        "name,x_px,y_px,half_width_px,half_height_px\n1,25,19.5,11,11\n1,100,19.5,11,11\n",
        "line 3, column name: expected each name once",
    ),
];

#[test]
fn bad_arguments_end_with_exit_code_2_and_a_reason() {
    let output = chainwave().arg("no-such-command").output().expect("chainwave starts");
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("no-such-command"), "{message}");
    assert!(output.stdout.is_empty(), "standard output is for results");
}

#[test]
fn a_wrong_experiment_is_refused_at_its_line() {
    for (from, to, word) in WRONG_SETTINGS {
        let laboratory = Laboratory::with_experiment(from, to);
        let path = laboratory.path("experiment.toml");
        let text = fs::read_to_string(&path).expect("the experiment was written");
        let wrong = to.lines().last().expect("the last line is the wrong one");
        let line = 1 + text.lines().position(|line| line.starts_with(wrong)).expect("it was replaced");
        for command in ["run", "synthesize"] {
            let out = laboratory.path("out");
            let message = fail(chainwave().arg(command).arg(&path).arg("--out").arg(&out), 2);
            assert!(message.contains(&path.display().to_string()), "{to}: {message}");
            assert!(message.contains(&format!("line {line},")), "{to}: expected line {line}: {message}");
            assert!(message.contains(word), "{to}: {message}");
            assert!(!out.exists(), "{to}: nothing could be done, so nothing is left behind");
        }
    }
}

#[test]
fn a_wrong_trials_table_is_refused_at_its_cell() {
    for (from, to, place) in WRONG_CELLS {
        let laboratory = Laboratory::with_trials(from, to);
        let message = fail(&mut evaluation(laboratory.path("").as_path(), &laboratory.path("out")), 2);
        assert!(message.contains("trials.csv"), "{to}: {message}");
        assert!(message.contains(place), "{to}: expected {place}: {message}");
    }
}

#[test]
fn an_experiment_without_trials_or_recordings_cannot_be_run() {
    let laboratory = Laboratory::with_experiment("trials.csv", "nowhere.csv");
    let message = fail(&mut evaluation(laboratory.path("").as_path(), &laboratory.path("out")), 2);
    assert!(message.contains("nowhere.csv"), "{message}");

    let laboratory = Laboratory::new();
    let message = fail(&mut evaluation(laboratory.path("").as_path(), &laboratory.path("out")), 2);
    assert_eq!(message.matches(".cine").count(), N_RECORDINGS, "each is named once: {message}");
    // Nothing that an earlier run left may be taken for this one's.
    let said = fs::read_to_string(laboratory.path("out/results.json")).expect("the reason is written");
    assert!(said.contains("unsolved") && said.contains("none of 15 could be used"), "{said}");
    let states = fs::read_to_string(laboratory.path("out/recordings.csv")).expect("each has its state");
    assert_eq!(states.matches(",failed,").count(), N_RECORDINGS, "{states}");
}

#[test]
fn an_experiment_without_a_synthetic_part_cannot_be_filmed() {
    let laboratory = Laboratory::new();
    let text = fs::read_to_string(laboratory.path("experiment.toml")).expect("the experiment was written");
    let (real, _) = text.split_once("[synthetic]").expect("the small experiment is synthetic");
    laboratory.write("experiment.toml", real);
    let message = fail(&mut laboratory.filming(&laboratory.path("out")), 2);
    assert!(message.contains("[synthetic]"), "{message}");
}

#[test]
fn what_is_no_recording_is_named() {
    let laboratory = Laboratory::new();
    let path = laboratory.path("trials.csv");
    let message = fail(chainwave().arg("inspect").arg(&path), 2);
    assert!(message.contains("trials.csv") && message.contains(".cine"), "{message}");
    assert!(message.contains("--raw WxHxBITS"), "pixels without a header are read too: {message}");
    let message = fail(chainwave().arg("check").arg(laboratory.path("..").join("nowhere.toml")), 2);
    assert!(message.contains("nowhere.toml"), "{message}");
    let recordings = laboratory.path("shots");
    fs::create_dir(&recordings).expect("a folder can be made");
    let message = fail(chainwave().arg("check").arg(&recordings), 2);
    assert!(message.contains("found a folder (hint: `chainwave init "), "{message}");
    let message = fail(chainwave().arg("init").arg(&recordings), 2);
    assert!(
        message.contains("found none that can be read (readable formats: ") && message.contains(".cine"),
        "{message}"
    );
}

#[test]
fn wrong_options_of_track_are_refused() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let out = folder.path().join("tracks.csv");
    let track =
        |options: &[&str]| fail(tracking(&points(&folder, POINTS), &out).arg(sample()).args(options), 2);
    let message = track(&["--method", "magic"]);
    assert!(message.contains("magic") && message.contains("icgn-cubic-affine"), "{message}");
    let message = track(&["--shape", "cubist"]);
    assert!(message.contains("cubist") && message.contains("affine"), "{message}");
    let message = track(&["--reference", "120"]);
    let expected = "--reference: expected a frame below 120, found 120";
    assert!(message.contains(expected), "frames count from 0: {message}");
    let message = fail(tracking(&points(&folder, POINTS), &out).args([sample(), sample()]), 2);
    assert!(message.contains("expected each recording once"), "{message}");
    let message = track(&["--jobs", "0"]);
    assert!(message.contains("--jobs"), "{message}");
    let nowhere = folder.path().join("nowhere").join("tracks.csv");
    let message = fail(tracking(&points(&folder, POINTS), &nowhere).arg(sample()), 2);
    assert!(message.contains("nowhere"), "{message}");
    assert!(!out.exists(), "nothing could be done");
}

#[test]
fn a_wrong_table_of_points_is_refused_at_its_cell() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let out = folder.path().join("tracks.csv");
    for (text, place) in WRONG_POINTS {
        let message = fail(tracking(&points(&folder, text), &out).arg(sample()), 2);
        assert!(message.contains("points.csv") && message.contains(place), "expected {place}: {message}");
    }
    assert!(!out.exists(), "nothing could be done");
    let square = points(&folder, "name,x_px,y_px,half_width_px\n1,25,19.5,11\n");
    assert!(succeed(tracking(&square, &out).arg(sample())).contains("120 of 120 readings ok"));
}

#[test]
fn a_table_under_an_unknown_ending_is_refused_before_any_work() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    for name in ["tracks.xlsx", "tracks", "tracks.parquet.tmp"] {
        let out = folder.path().join(name);
        let message = fail(tracking(&points(&folder, POINTS), &out).arg(sample()), 2);
        assert!(message.contains(".csv, .parquet or .mat") && message.contains(name), "{message}");
        assert!(!out.exists());
    }
    let mut inspect = chainwave();
    inspect.arg("inspect").arg(sample()).args(["--frame", "0", "--out"]).arg(folder.path().join("0.png"));
    let message = fail(&mut inspect, 2);
    assert!(message.contains(".tif"), "{message}");
}

#[test]
fn a_point_off_the_image_loses_itself_only_and_all_points_lost_are_nothing() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let out = folder.path().join("tracks.parquet");
    let off = "far,1000,19.5,11,11\n\"am Rand, links\",3,19.5,11,11\nopen,500,500,,\n";
    let said = succeed(tracking(&points(&folder, &format!("{POINTS}{off}")), &out).arg(sample()));
    assert!(said.contains("point far at (1000, 19.5): its subset reaches outside the image"), "{said}");
    assert!(said.contains("240 of 600 readings ok, median sigma"), "{said}");
    let tracks = Table::read(&out);
    let (names, statuses) = (tracks.texts("name"), tracks.texts("status"));
    for (name, status) in names.iter().zip(&statuses) {
        let is_inside = name == "1" || name == "2";
        assert_eq!(status, if is_inside { "ok" } else { "out_of_view" }, "{name}");
    }

    fs::remove_file(&out).expect("it was written");
    let (head, _) = POINTS.split_once('\n').expect("a head line");
    let message = fail(tracking(&points(&folder, &format!("{head}\n{off}")), &out).arg(sample()), 2);
    assert!(message.contains("all 360 lost: 360 out_of_view"), "{message}");
    assert!(!out.exists(), "nothing could be done");
}

#[test]
fn an_edge_beside_a_subset_is_named_and_the_point_tracked() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let (picture, out) = (folder.path().join("marker.tif"), folder.path().join("tracks.csv"));
    // texture from column 20 to 60 on grey ground
    let count = |i: u32| {
        let (x, y) = (f64::from(i % 90), f64::from(i / 90));
        let texture = (0.9 * x + 0.2 * y).sin() + (0.3 * x - 1.1 * y).cos() + (0.7 * x + 0.8 * y).cos();
        if (20.0..=60.0).contains(&x) { (1000.0 + 200.0 * texture) as u16 } else { 1100 }
    };
    let counts: Vec<u16> = (0..90 * 90).map(count).collect();
    let file = fs::File::create(&picture).expect("the picture can be made");
    let mut encoder = TiffEncoder::new(file).expect("the picture can be written");
    encoder.write_image::<Gray16>(90, 90, &counts).expect("the picture can be written");
    let text = "name,x_px,y_px,half_width_px,half_height_px\nnear,33,40,12,12\nfar,40,40,12,12\n";
    let said = succeed(tracking(&points(&folder, text), &out).arg(&picture));
    assert!(said.contains("point near: a sharp edge runs 1 px beyond its subset (left)"), "{said}");
    assert!(!said.contains("point far"), "{said}");
    assert!(out.exists(), "it is a warning");
}

/// The command that tracks points; recordings are still to be named.
fn tracking(points: &Path, out: &Path) -> Command {
    let mut command = chainwave();
    command.arg("track").arg("--points").arg(points).arg("--out").arg(out);
    command
}

fn points(folder: &TempDir, text: &str) -> PathBuf {
    let path = folder.path().join("points.csv");
    fs::write(&path, text).expect("the points can be written");
    path
}

fn sample() -> PathBuf {
    root().join("data-samples/hec-view1-trial1.cine")
}
