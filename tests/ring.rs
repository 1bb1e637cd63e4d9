//! Scenes of rings: the pipeline hec300-ring made small, and what is refused.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::repository::root;
use crate::support::table::Table;

/// A wrong scene: the text to replace, what to put there, and a word of the message.
const WRONG_SCENES: [(&str, &str, &str); 8] = [
    ("wall_m = 0.4e-3", "wall_m = 6e-3", "radius of curvature"),
    ("wall_m = 0.4e-3", "wall_mm = 0.4", "wall_mm"),
    ("elements_per_ring = 32", "elements_per_ring = 15", "even number"),
    ("elements_per_ring = 32\n", "", "elements_per_ring"),
    ("poisson = 0.35", "poisson = 0.7", "poisson"),
    ("duration_s = 0.02\n", "", "duration_s"),
    ("contact_stiffness_n_per_m = 1e5\n", "", "contact_stiffness_n_per_m"),
    ("n_bodies = 26\n", "", "n_bodies"),
];

#[test]
fn one_ring_gives_the_chains_contact_law() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let (curve, summary) = simulate(&folder, "compression");
    let (overlaps_m, forces_n) = (curve.full("overlap_m"), curve.full("force_n"));
    assert_eq!(curve.names(), ["overlap_m", "force_n"]);
    assert_eq!(overlaps_m.len(), 201);
    // physics.md: 1474 N/m, 0.34 % less with stretching and shear; the first step of 50 um softens by 1 % more.
    let k_0 = forces_n[1] / overlaps_m[1];
    assert!((1440.0..1475.0).contains(&k_0), "{k_0}");
    assert!(summary["self_contact_m"].is_null(), "{summary}");
    let law = folder.path().join("contact.toml");
    succeed(chainwave().arg("contact").arg(folder.path().join("compression.csv")).arg("--out").arg(&law));
}

#[test]
fn modes_and_bands_agree_at_the_bands_edges() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let (modes, summary) = simulate(&folder, "modes");
    assert_eq!(modes.names()[..3], ["boundary", "mode", "frequency_hz"]);
    let held = modes.texts("boundary").iter().position(|name| name == "held").expect("modes of a held ring");
    let resonance_hz = modes.full("frequency_hz")[held];
    let said_hz = summary["local_resonance_hz"].as_f64().expect("a frequency");
    assert!((said_hz / resonance_hz - 1.0).abs() < 1e-12, "{said_hz} {resonance_hz}");
    let (bands, _) = simulate(&folder, "bands");
    assert_eq!(bands.names()[..3], ["kappa_a", "band", "frequency_hz"]);
    assert_eq!(bands.n_rows(), 65 * 8);
    let symmetry = bands.texts("symmetry");
    let edge_hz: Vec<f64> = (64 * 8..65 * 8)
        .filter(|&row| symmetry[row] == "symmetric")
        .map(|row| bands.full("frequency_hz")[row])
        .collect();
    assert!((edge_hz[1] / resonance_hz - 1.0).abs() < 1e-8, "{edge_hz:?} {resonance_hz}");
}

#[test]
fn a_strike_moves_joints_and_draws_figures() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let (motion, summary) = simulate(&folder, "velocities");
    assert_eq!(motion.names(), ["t_s", "body", "x_m", "v_m_per_s"]);
    // The striker, and 27 joints of 26 rings, at 1001 times.
    assert_eq!(motion.n_rows(), 28 * 1001);
    for key in ["energy_drift", "psi_max_j", "steps", "dt_s", "method", "tension_events", "wall_s"] {
        assert!(!summary[key].is_null(), "{key} of {summary}");
    }
    assert!(summary["energy_drift"].as_f64().expect("a number") < 1e-4, "{summary}");
    for name in ["strain-map", "strain-profiles", "group-velocity"] {
        assert!(folder.path().join(format!("figures-26/{name}.svg")).is_file(), "{name}");
    }
    let numbers = fs::read_to_string(folder.path().join("figures-26/numbers.json")).expect("numbers");
    let numbers: Value = serde_json::from_str(&numbers).expect("JSON");
    let speed = |model: &str| numbers[model]["group_velocity_m_per_s"].as_f64().expect("a velocity");
    // The two models' pulses run equally fast within a few per cent (README of the pipeline).
    assert!((speed("rings") / speed("chain model") - 1.0).abs() < 0.03, "{numbers}");
}

/// The paper's long study. 16 elements a ring err by 0.9 % of the largest displacement.
#[test]
fn the_front_widens_from_each_published_time_to_the_next() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let scene = scene("front").replace("elements_per_ring = 32", "elements_per_ring = 16");
    simulate_scene(&folder, "front", &scene);
    let numbers = fs::read_to_string(folder.path().join("figures-300/numbers.json")).expect("numbers");
    let numbers: Value = serde_json::from_str(&numbers).expect("JSON");
    let widths = numbers["rings"]["hwhm_at_profile_times_m"].as_array().expect("five widths");
    let cells: Vec<f64> = widths.iter().map(|width| width.as_f64().expect("a width") / 0.0296).collect();
    assert_eq!(cells.len(), 5);
    // It grows by 2 cells or more from each to the next; a ripple of fast waves moves it by a tenth of a cell.
    assert!(cells.windows(2).all(|pair| pair[1] > pair[0] + 1.0), "{cells:?}");
    assert!((4.0..5.0).contains(&cells[0]) && (14.0..16.0).contains(&cells[4]), "{cells:?}");
}

#[test]
fn a_mesh_is_chosen_for_an_accuracy_and_shapes_are_written() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let scene = scene("velocities")
        .replace("n_bodies = 26", "shapes_file = \"shapes.csv\"\nn_bodies = 3")
        .replace("elements_per_ring = 32", "accuracy = 0.02")
        .replace("duration_s = 0.02", "duration_s = 0.003");
    let summary = simulate_scene(&folder, "shapes-scene", &without_figures(&scene)).1;
    assert!(summary["difference_to_coarser_mesh"].as_f64().expect("a number") <= 0.02, "{summary}");
    let elements = summary["elements_per_ring"].as_u64().expect("a number") as usize;
    let shapes = Table::read(&folder.path().join("shapes.csv"));
    assert_eq!(shapes.n_rows(), 151 * 3 * (elements / 2 + 1));
}

#[test]
fn the_ladder_of_meshes_falls_and_has_a_front() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let scene = without_figures(&scene("velocities"))
        .replace("n_bodies = 26", "n_bodies = 6")
        .replace("duration_s = 0.02", "duration_s = 0.004");
    let (path, out) = (folder.path().join("rings.toml"), folder.path().join("tradeoff"));
    fs::write(&path, scene).expect("a scene can be written");
    succeed(chainwave().arg("tradeoff").arg(&path).arg("--out").arg(&out));
    let table = Table::read(&out.join("tradeoff.parquet"));
    let (settings, errors) = (table.texts("settings"), table.full("error"));
    let error = |elements: &str| {
        let ending = format!("= {elements}");
        errors[settings.iter().position(|text| text.ends_with(&ending)).expect("a rung")]
    };
    // The mesh is of fourth order, but the instants at which the striker's contact switches are not.
    assert!(error("16") > 3.0 * error("32") && error("32") > 3.0 * error("64"), "{errors:?}");
    assert!(table.texts("step").iter().all(|step| step == "ring"));
    assert!(out.join("tradeoff-ring.svg").is_file());
}

#[test]
fn rings_are_let_go_from_a_state() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let state = folder.path().join("state.csv");
    fs::write(&state, "body,x_m,v_m_per_s\n2,1e-3,0.0\n").expect("a state can be written");
    let good = without_figures(&scene("velocities")).replace("n_bodies = 26", "n_bodies = 2");
    let (before, drive) = good.split_once("[drive]").expect("a drive");
    assert!(!drive.contains('['), "the drive is the last part: {drive}");
    let scene = format!("{before}[drive]\nkind = \"free\"\ninitial = \"state.csv\"\n");
    let (motion, summary) = simulate_scene(&folder, "free-scene", &scene);
    // Three joints and no striker; the middle one begins a millimetre off, and as much momentum goes left as right.
    assert_eq!(motion.n_rows(), 3 * 1001);
    assert_eq!(motion.full("x_m")[..3], [0.0, 1e-3, 0.0]);
    assert!(summary["momentum_drift"].is_number(), "{summary}");
    assert!(summary["energy_drift"].as_f64().expect("a number") < 1e-4, "{summary}");
    for (wrong, word) in [("4,1e-3,0.0", "from 1 to 3"), ("2,far,0.0", "x_m")] {
        fs::write(&state, format!("body,x_m,v_m_per_s\n{wrong}\n")).expect("a state can be written");
        let path = folder.path().join("free-scene.toml");
        let out = folder.path().join("wrong.csv");
        let reason = fail(chainwave().arg("simulate").arg(&path).arg("--out").arg(&out), 2);
        assert!(reason.contains(word), "{reason}");
    }
}

#[test]
fn walls_that_touch_end_the_motion() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let scene = without_figures(&scene("velocities"))
        .replace("n_bodies = 26", "n_bodies = 3")
        .replace("velocity_m_per_s = 2.73", "velocity_m_per_s = 60.0");
    let path = folder.path().join("scene.toml");
    fs::write(&path, scene).expect("a scene can be written");
    let (out, summary) = (folder.path().join("motion.csv"), folder.path().join("summary.json"));
    let mut command = chainwave();
    command.arg("simulate").arg(&path).arg("--out").arg(&out).arg("--summary").arg(&summary);
    let reason = fail(&mut command, 1);
    assert!(reason.contains("ring 1"), "{reason}");
    let summary: Value =
        serde_json::from_str(&fs::read_to_string(summary).expect("a summary")).expect("JSON");
    let contact_s = summary["self_contact"]["t_s"].as_f64().expect("a time");
    let times_s = Table::read(&out).full("t_s");
    assert!(times_s.iter().all(|time_s| *time_s < contact_s), "{contact_s}");
}

#[test]
fn wrong_scenes_are_refused_with_a_reason() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let good = without_figures(&scene("velocities"));
    for (from, to, word) in WRONG_SCENES {
        assert!(good.contains(from), "{from}");
        let path = folder.path().join("scene.toml");
        fs::write(&path, good.replace(from, to)).expect("a scene can be written");
        let out = folder.path().join("motion.csv");
        let reason = fail(chainwave().arg("simulate").arg(&path).arg("--out").arg(&out), 2);
        assert!(reason.contains(word), "{to}: {reason}");
        assert!(!out.exists(), "{to}");
    }
    // What the figures need is missed before the motion is integrated, which an hour of it would show.
    let path = folder.path().join("scene.toml");
    let long = scene("velocities")
        .replace("pitch_m = 0.0296\n", "")
        .replace("duration_s = 0.02", "duration_s = 20.0");
    fs::write(&path, long.replace("output_interval_s = 2e-5", "output_interval_s = 2e-2")).expect("a scene");
    let out = folder.path().join("motion.csv");
    let reason = fail(chainwave().arg("simulate").arg(&path).arg("--out").arg(&out), 2);
    assert!(reason.contains("body.pitch_m") && reason.contains("for the figures"), "{reason}");
    assert!(!out.exists());
}

fn scene(name: &str) -> String {
    let path = pipeline().join(format!("{name}.toml"));
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn without_figures(scene: &str) -> String {
    scene.split("[figures]").next().expect("a part before").to_owned()
}

fn pipeline() -> PathBuf {
    root().join("pipelines/hec300-ring")
}

/// Runs a scene of the pipeline; the table and the summary.
fn simulate(folder: &TempDir, name: &str) -> (Table, Value) {
    run(folder, name, &pipeline().join(format!("{name}.toml")))
}

fn simulate_scene(folder: &TempDir, name: &str, text: &str) -> (Table, Value) {
    let path = folder.path().join(format!("{name}.toml"));
    fs::write(&path, text).expect("a scene can be written");
    run(folder, name, &path)
}

fn run(folder: &TempDir, name: &str, scene: &Path) -> (Table, Value) {
    let out = folder.path().join(format!("{name}.csv"));
    let summary = folder.path().join(format!("{name}.json"));
    succeed(chainwave().arg("simulate").arg(scene).arg("--out").arg(&out).arg("--summary").arg(&summary));
    let summary = fs::read_to_string(&summary).expect("a summary");
    (Table::read(&out), serde_json::from_str(&summary).expect("JSON"))
}
