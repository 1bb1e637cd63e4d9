//! The contact law of the sample curve, and what `chainwave contact` refuses.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use toml::Table;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::repository::root;

/// The law behind the sample curve; f_0 and k_0 follow from it.
const LAW: [(&str, f64); 3] = [("a", 60.1), ("delta_0_m", 2.27e-3), ("p", 0.114)];

/// A wrong curve: its text, and what the message names.
const WRONG_CURVES: [(&str, &str); 4] = [
    ("overlap_m,force_n\n0,0\n1e-3,one\n", "line 3, column force_n"),
    ("overlap_m,force_n\n0,0\n1e-3,\n", "line 3, column force_n"),
    ("overlap_mm,force_n\n0,0\n1,1\n", "a column named overlap_m"),
    ("overlap_m,force_n\n0,0\n1e-3,1\n", "at least 8 readings"),
];

#[test]
fn the_sample_curves_law_is_found() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let found = contact(&folder, &root().join("data-samples/hec-compression.csv"));
    let (a, delta_0_m, p) = (LAW[0].1, LAW[1].1, LAW[2].1);
    let f_0_n = a * delta_0_m.powf(p);
    for (name, truth) in LAW.into_iter().chain([("f_0_n", f_0_n), ("k_0_n_per_m", p * f_0_n / delta_0_m)]) {
        let (value, sigma) = (number(&found, name), number(&found, &format!("{name}_sigma")));
        assert!((value - truth).abs() < 3.0 * sigma, "{name} = {value} +- {sigma}, made with {truth}");
        // The curve's 401 readings of 5 mN know k_0 to a thousandth, and the others some thirty times less well.
        let known_to = if name == "k_0_n_per_m" { 0.002 } else { 0.06 };
        assert!(sigma < known_to * value, "{name} = {value} +- {sigma}");
    }
    assert_eq!(found["law"].as_str(), Some("power"));
    let mut again = chainwave();
    again.arg("contact").arg(root().join("data-samples/hec-compression.csv"));
    let said = succeed(again.arg("--out").arg(folder.path().join("again.toml")));
    let open = found["cannot_tell_apart"][0].as_str().expect("a sentence");
    assert!(
        said.contains("k_0_n_per_m = ") && said.contains(open),
        "the law and what it leaves open: {said}"
    );
    let rms_n = found["residual"]["rms_n"].as_float().expect("a residual");
    // 401 readings with a noise of 5 mN: 3.5 %, taken four times.
    assert!((rms_n / 5e-3 - 1.0).abs() < 0.14, "{rms_n}");
    let correlation = found["correlation"]["a"]["p"].as_float().expect("a correlation");
    assert!((-1.0..-0.9).contains(&correlation), "a and p trade against each other: {correlation}");
    let sentences = found["cannot_tell_apart"].as_array().expect("sentences");
    assert!(sentences.iter().all(|sentence| sentence.is_str()) && sentences.len() >= 2, "{sentences:?}");
    assert!(found["branches"].get("lost_fraction").is_none(), "the sample does not come back");
}

#[test]
fn a_curve_that_comes_back_tells_what_it_lost() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let curve = folder.path().join("curve.csv");
    let force_n = |i: i32| 4.0 * (f64::from(i) / 100.0).sqrt();
    let line = |i: i32, part: f64| format!("{},{}\n", 1e-4 * f64::from(i), part * force_n(i));
    let text: String = (0..=100).map(|i| line(i, 1.0)).chain((0..100).rev().map(|i| line(i, 0.75))).collect();
    fs::write(&curve, format!("overlap_m,force_n\n{text}")).expect("the curve can be written");
    let branches = &contact(&folder, &curve)["branches"];
    assert_eq!(branches["n_runs"].as_integer(), Some(2));
    let lost = branches["lost_fraction"].as_float().expect("it came back");
    // The way back begins at the last reading of the way in: a trapezium of 100, half of it a quarter too high.
    assert!((lost - 0.25).abs() < 0.25 * 0.02, "{lost}");
}

#[test]
fn a_law_is_written_as_toml_and_under_no_other_name() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let curve = root().join("data-samples/hec-compression.csv");
    for name in ["contact.csv", "contact.json", "contact"] {
        let out = folder.path().join(name);
        let message = fail(chainwave().arg("contact").arg(&curve).arg("--out").arg(&out), 2);
        assert!(
            message.contains("expected a name that ends in .toml") && message.contains(name),
            "{message}"
        );
        assert!(!out.exists());
    }
}

#[test]
fn what_is_no_compression_curve_is_refused() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let (curve, out) = (folder.path().join("curve.csv"), folder.path().join("contact.toml"));
    let millimetres: String = (0..20).map(|i| format!("{i},{}\n", f64::from(i).sqrt())).collect();
    let millimetres = format!("overlap_m,force_n\n{millimetres}");
    for (text, place) in WRONG_CURVES.into_iter().chain([(millimetres.as_str(), "line 4: ")]) {
        fs::write(&curve, text).expect("the curve can be written");
        let message = fail(chainwave().arg("contact").arg(&curve).arg("--out").arg(&out), 2);
        assert!(message.contains("curve.csv") && message.contains(place), "expected {place}: {message}");
        assert!(message.contains("expected") && message.contains("found"), "{message}");
        assert!(!out.exists(), "nothing could be done, so nothing is left behind");
    }
}

#[test]
fn a_scene_names_the_file_of_its_law() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let found = contact(&folder, &root().join("data-samples/hec-compression.csv"));
    let value = |name: &str| found[name].as_float().expect("a number");
    let copied = [("a", value("a")), ("delta_0_m", value("delta_0_m")), ("p", value("p"))];
    let copied: String = copied.iter().map(|(name, value)| format!("{name} = {value:?}\n")).collect();
    let motion = |law: &str| {
        let (scene, out) = (scene_of(&folder, law), folder.path().join("motion.csv"));
        succeed(chainwave().arg("simulate").arg(scene).arg("--out").arg(&out));
        fs::read_to_string(out).expect("a motion was written")
    };
    let named = motion("law = \"fitted\"\nfile = \"contact.toml\"");
    assert_eq!(named, motion(&format!("law = \"power\"\n{copied}")));
    let (scene, out) =
        (scene_of(&folder, "law = \"fitted\"\nfile = \"lost.toml\""), folder.path().join("none.csv"));
    let refused = fail(chainwave().arg("simulate").arg(scene).arg("--out").arg(out), 2);
    assert!(refused.contains("lost.toml"), "{refused}");
}

/// Three bodies that are struck, with such a law between them.
fn scene_of(folder: &TempDir, law: &str) -> PathBuf {
    let scene = folder.path().join("scene.toml");
    let text = format!(
        "model = \"chain\"\nn_bodies = 3\nduration_s = 2e-3\noutput_interval_s = 1e-4\n\
         [body]\npitch_m = 0.03\nmass_kg = 0.01\ndamping_kg_per_s = 0.1\n[contact]\n{law}\n\
         [drive]\nkind = \"striker\"\nmass_kg = 0.05\nvelocity_m_per_s = 1.0\ndamping_kg_per_s = 0.1\n"
    );
    fs::write(&scene, text).expect("the scene can be written");
    scene
}

fn contact(folder: &TempDir, curve: &Path) -> Table {
    let out = folder.path().join("contact.toml");
    succeed(chainwave().arg("contact").arg(curve).arg("--out").arg(&out));
    let text = fs::read_to_string(&out).expect("the law was written");
    text.parse().expect("it is TOML")
}

fn number(table: &Table, name: &str) -> f64 {
    table[name].as_float().unwrap_or_else(|| panic!("{name}: {:?}", table[name]))
}
