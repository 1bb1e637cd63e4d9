//! Tracks that another program wrote: a chain whose bodies step one after the other at a known speed.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use chainwave_testkit::reference_data;
use serde_json::Value;
use tempfile::TempDir;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::repository::root;
use crate::support::table::Table;

const N_BODIES: usize = 8;
const PITCH_M: f64 = 0.06;
const SPEED_M_PER_S: f64 = 3.0;
const RATE_HZ: f64 = 4000.0;
/// Half steps of the last digit, in millimetres.
const ROUNDING_MM: f64 = 0.5e-4;

/// Displacement of a body in millimetres: a smooth step of 5 mm.
fn displacement_mm(body: usize, since_start_s: f64) -> f64 {
    let arrival_s = 0.03 + (body - 1) as f64 * PITCH_M / SPEED_M_PER_S;
    2.5 * (1.0 + ((since_start_s - arrival_s) / 6e-3).tanh())
}

fn sample(body: usize, k: usize, started_s: f64) -> String {
    format!("{:.4}", displacement_mm(body, k as f64 / RATE_HZ - started_s))
}

/// A file of columns `k, x1, s1, x2, s2, ..` below two lines of heads, whose chain began to move `started_s` late.
fn columns(folder: &Path, name: &str, started_s: f64) {
    let mut text = "a chain\nindex,x,sigma\n".to_owned();
    for k in 0..1000 {
        write!(text, "{k}").expect("text grows");
        for body in 1..=N_BODIES {
            write!(text, ",{},{ROUNDING_MM:e}", sample(body, k, started_s)).expect("text grows");
        }
        text.push('\n');
    }
    fs::write(folder.join(name), text).expect("a file can be written");
}

/// A file of lines, a body each, with a line of times above.
fn lines(folder: &Path, name: &str) {
    let times_ms = (0..1000).map(|k| format!("{}", 1e3 * k as f64 / RATE_HZ));
    let mut text = times_ms.collect::<Vec<_>>().join(" ");
    for body in 1..=N_BODIES {
        let samples = (0..1000).map(|k| sample(body, k, 0.0)).collect::<Vec<_>>();
        write!(text, "\n{}", samples.join("  ")).expect("text grows");
    }
    fs::write(folder.join(name), text).expect("a file can be written");
}

fn mapping(folder: &Path, trials: &[&str], rest: &str) -> PathBuf {
    let path = folder.join("mapping.toml");
    let text = format!(
        "name = \"steps\"\ntrials = {trials:?}\n[chain]\nn_bodies = {N_BODIES}\npitch_m = {PITCH_M}\n{rest}\n[sigma]\nusual_m = 5e-8\n"
    );
    fs::write(&path, text).expect("a file can be written");
    path
}

const OF_COLUMNS: &str = "[layout]\nseparator = \"comma\"\nhead_lines = 2\nbodies = \"columns\"\n[time]\nrate_hz = 4000.0\n\
    zero = \"first_body\"\nrest_until_s = -0.025\n[displacement]\nfirst = 2\nstep = 2\nunit_m = 1e-3";
const OF_LINES: &str = "[layout]\nseparator = \"blanks\"\nbodies = \"lines\"\n[time]\nat = 1\nunit_s = 1e-3\nrest_until_s = 0.005\n\
    [displacement]\nfirst = 2\nunit_m = 1e-3";

fn imported(mapping: &Path, out: &Path) -> Value {
    succeed(chainwave().arg("import").arg(mapping).arg("--out").arg(out));
    let text = fs::read_to_string(out.join("results.json")).expect("it was written");
    serde_json::from_str(&text).expect("it is JSON")
}

fn assert_speed(results: &Value) {
    let number = |name: &str| results[name].as_f64().unwrap_or_else(|| panic!("{name}: {results}"));
    let (found, sigma) = (number("group_velocity_m_per_s"), number("group_velocity_sigma"));
    assert!((found - SPEED_M_PER_S).abs() < 4.0 * sigma.max(1e-6 * SPEED_M_PER_S), "{found} +- {sigma}");
    assert!(sigma < 1e-3 * SPEED_M_PER_S, "{sigma}");
}

#[test]
fn trials_in_columns_are_merged_and_the_step_has_its_speed() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let trials = ["one.csv", "two.csv", "three.csv"];
    // Cameras that were started by hand, tens of frames apart.
    trials.iter().zip([0.0, 0.0171, 0.0093]).for_each(|(name, late_s)| columns(folder.path(), name, late_s));
    let results = imported(&mapping(folder.path(), &trials, OF_COLUMNS), &folder.path().join("out"));
    assert_speed(&results);
    let motion = Table::read(&folder.path().join("out/motion.parquet"));
    assert!(motion.full("n_trials").into_iter().fold(0.0, f64::max) > 2.5);
    for name in ["strain-map.svg", "strain-map.png", "displacements.png"] {
        assert!(folder.path().join("out/figures").join(name).exists(), "{name}");
    }
}

#[test]
fn readings_that_stand_alone_are_left_out_and_named() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let trials = ["one.csv", "two.csv", "three.csv"];
    trials.iter().zip([0.0, 0.0171, 0.0093]).for_each(|(name, late_s)| columns(folder.path(), name, late_s));
    let mapping = mapping(folder.path(), &trials, OF_COLUMNS);
    let peaks = |out: &str| {
        let results = imported(&mapping, &folder.path().join(out));
        assert_speed(&results);
        let fronts = Table::read(&folder.path().join(out).join("front.parquet"));
        (fronts.full("t_peak_s"), results["warnings"].to_string())
    };
    let (whole_s, warnings) = peaks("whole");
    assert!(!warnings.contains("left out"), "{warnings}");
    // Half a millimetre, for a frame and for three, where bodies 3 and 6 of the second trial pass.
    let path = folder.path().join("two.csv");
    let text = fs::read_to_string(&path).expect("it was written");
    let moved = |(line, text): (usize, &str)| {
        let column = match line {
            // Two lines of heads; frames from 0.
            362 => 1 + 2 * 2,
            600..603 => 1 + 2 * 5,
            _ => return text.to_owned(),
        };
        let cell = |(at, cell): (usize, &str)| match at == column {
            true => format!("{:.4}", cell.parse::<f64>().expect("a number") + 0.5),
            false => cell.to_owned(),
        };
        text.split(',').enumerate().map(cell).collect::<Vec<_>>().join(",")
    };
    let lines: Vec<String> = text.lines().enumerate().map(moved).collect();
    fs::write(&path, lines.join("\n")).expect("it can be written");
    let (found_s, warnings) = peaks("wild");
    assert!(warnings.contains("two.csv: 4 readings left out"), "{warnings}");
    // Without them two trials of three are left there, and a peak is read to a few thousandths of a frame.
    for (found_s, whole_s) in found_s.iter().zip(whole_s) {
        assert!((found_s - whole_s).abs() < 0.02 / RATE_HZ, "{found_s} {whole_s}");
    }
}

#[test]
fn a_pitch_in_other_units_is_asked_about_and_results_of_a_run_are_left_alone() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    columns(folder.path(), "one.csv", 0.0);
    let path = mapping(folder.path(), &["one.csv"], OF_COLUMNS);
    let out = folder.path().join("out");
    assert!(!imported(&path, &out)["warnings"].to_string().contains("of no wave"), "a chain as it should be");
    let text = fs::read_to_string(&path).expect("it was written");
    let pitch = text.lines().find(|line| line.starts_with("pitch_m")).expect("a pitch");
    fs::write(&path, text.replace(pitch, "pitch_m = 3e3")).expect("it can be written");
    let warnings = imported(&path, &out)["warnings"].to_string();
    assert!(warnings.contains("of no wave in a chain (hint: is chain.pitch_m in metres"), "{warnings}");
    fs::write(out.join("provenance.toml"), "").expect("it can be written");
    let refused = fail(chainwave().arg("import").arg(&path).arg("--out").arg(&out), 2);
    assert!(refused.contains("without results of `chainwave run`"), "{refused}");
}

#[test]
fn bodies_in_lines_with_times_are_read() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    lines(folder.path(), "lines.txt");
    let results = imported(&mapping(folder.path(), &["lines.txt"], OF_LINES), &folder.path().join("out"));
    assert_speed(&results);
}

#[test]
fn what_the_reflection_has_reached_is_left_out_unless_the_chain_goes_on() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    columns(folder.path(), "one.csv", 0.0);
    let last_gap = |end: &str| {
        let rest = format!("{end}\n{OF_COLUMNS}");
        let results = imported(&mapping(folder.path(), &["one.csv"], &rest), &folder.path().join("out"));
        results["group_velocity_gaps"][1].as_u64().expect("a gap")
    };
    // The steps come one after the other whatever is behind the last one; where the chain ends there, the foot of its reflection is back before the
    // peak.
    assert!(last_gap("end = \"free\"") < last_gap("end = \"unseen\""));
    assert_eq!(last_gap(""), last_gap("end = \"fixed\""));
}

#[test]
fn what_does_not_fit_is_named_by_its_place() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    columns(folder.path(), "one.csv", 0.0);
    let said = |rest: &str, code: i32| {
        let path = mapping(folder.path(), &["one.csv"], rest);
        fail(chainwave().arg("import").arg(path).arg("--out").arg(folder.path().join("out")), code)
    };
    let beyond = said(&OF_COLUMNS.replace("step = 2", "step = 3"), 2);
    assert!(beyond.contains("one.csv") && beyond.contains("column 20"), "{beyond}");
    let heads = said(&OF_COLUMNS.replace("head_lines = 2", "head_lines = 1"), 2);
    assert!(heads.contains("line 2, column 1") && heads.contains("head_lines"), "{heads}");
    let timeless = said(&OF_COLUMNS.replace("rate_hz = 4000.0\n", ""), 2);
    assert!(timeless.contains("rate_hz"), "{timeless}");
}

/// Other people's chain, where its data are at hand.
#[test]
fn the_reference_chain_is_measured() {
    let Some(data) = reference_data("") else { return };
    let folder = TempDir::new().expect("a temporary folder can be made");
    for (name, beside) in [("measured", "chain/Neel-PRL"), ("simulated", "chain/Neel-PRL/sim")] {
        let out = folder.path().join(name);
        let mapping = root().join("pipelines/neel-chain").join(format!("{name}.toml"));
        let data = data.join(beside);
        succeed(chainwave().arg("import").arg(mapping).arg("--data").arg(data).arg("--out").arg(&out));
        let text = fs::read_to_string(out.join("results.json")).expect("it was written");
        let results: Value = serde_json::from_str(&text).expect("it is JSON");
        let speed = results["group_velocity_m_per_s"].as_f64().expect("a number");
        // The step passes an element of 58.5 mm every 21 to 23 ms.
        assert!((2.5..2.9).contains(&speed), "{name}: {speed}");
        assert!(out.join("figures/strain-map.png").exists());
    }
}

#[test]
fn a_rest_that_ends_in_the_motion_is_told_and_one_that_never_ends_is_refused() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    columns(folder.path(), "one.csv", 0.0);
    let out = folder.path().join("out");
    let resting_until = |rest_until_s: &str| {
        let rest = OF_COLUMNS.replace("rest_until_s = -0.025", &format!("rest_until_s = {rest_until_s}"));
        mapping(folder.path(), &["one.csv"], &rest)
    };
    let warnings = |results: &Value| results["warnings"].to_string();
    // Body 1 has gone half of its way at 0; at -0.03 s it is 0.1 um off, two of its sigmas.
    let quiet = warnings(&imported(&resting_until("-0.03"), &out));
    assert!(!quiet.contains("should rest"), "{quiet}");
    let moving = warnings(&imported(&resting_until("0.002"), &out));
    assert!(
        moving.contains("one.csv: body 1 moves by") && moving.contains("before the rest ends at 2.000 ms"),
        "{moving}"
    );
    let endless = fail(chainwave().arg("import").arg(resting_until("1.0")).arg("--out").arg(&out), 2);
    assert!(endless.contains("time.rest_until_s") && endless.contains("the last sample"), "{endless}");
    let twice = mapping(folder.path(), &["one.csv", "one.csv"], OF_COLUMNS);
    let twice = fail(chainwave().arg("import").arg(twice).arg("--out").arg(&out), 2);
    assert!(twice.contains("one.csv twice"), "{twice}");
}
