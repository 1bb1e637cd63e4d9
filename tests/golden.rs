//! Golden numbers: whoever changes what tracking or evaluation finds raises its version, or kept tracks and findings would be taken for
//! those of the present program.
//!
//! The numbers stand in `golden/NAME-VERSION.csv` and are never overwritten: with `CHAINWAVE_WRITE_GOLDEN` set, a version that has no file yet
//! gets one.

use std::fs;
use std::path::PathBuf;

use crate::support::repository::root;

/// Holds named numbers against those of a version; each may be off by its tolerance.
fn assert_golden(name: &str, version: u32, found: &[(String, f64)], tolerance: impl Fn(&str, f64) -> f64) {
    let path = root().join("tests/golden").join(format!("{name}-{version}.csv"));
    if !path.exists() && std::env::var_os("CHAINWAVE_WRITE_GOLDEN").is_some() {
        let rows: Vec<String> = found.iter().map(|(what, value)| format!("{what},{value:?}\n")).collect();
        fs::create_dir_all(path.parent().expect("a file lies in a folder")).expect("the folder can be made");
        fs::write(&path, format!("what,value\n{}", rows.concat()))
            .expect("the golden numbers can be written");
    }
    let hint = "a version without golden numbers gets them with CHAINWAVE_WRITE_GOLDEN=1";
    let text =
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error} ({hint})", path.display()));
    let golden: Vec<(&str, f64)> = text
        .lines()
        .skip(1)
        .map(|line| line.rsplit_once(',').expect("two cells"))
        .map(|(what, value)| (what, value.parse().expect("a number")))
        .collect();
    assert_eq!(
        found.len(),
        golden.len(),
        "{name}: other numbers than version {version} has: raise the version"
    );
    for ((what, value), (expected_what, expected)) in found.iter().zip(golden) {
        assert_eq!(what, expected_what, "{name}");
        let off = (value - expected).abs();
        assert!(
            off <= tolerance(what, expected),
            "{name}, {what}: {value:?}, expected {expected:?} of version {version}: where the change is meant, raise the version"
        );
    }
}

mod slow {
    use polars_core::prelude::*;
    use polars_io::prelude::*;

    use super::*;
    use crate::support::command::{chainwave, succeed};
    use crate::support::laboratory::Laboratory;

    #[test]
    fn tracks_of_the_sample_are_those_of_the_algorithms_version() {
        // Rigid subsets are followed as bodies are, affine ones as surfaces that may bend.
        for (name, shape) in [("tracks", "rigid"), ("surfaces", "affine")] {
            assert_golden_tracks(name, shape);
        }
    }

    fn assert_golden_tracks(name: &str, shape: &str) {
        let laboratory = Laboratory::new();
        let mut points = String::from("name,x_px,y_px,half_width_px,half_height_px\n");
        (0..3).for_each(|k| points.push_str(&format!("{k},{},19.5,10,10\n", 25 + 75 * k)));
        let (points, out) = (laboratory.write("points.csv", &points), laboratory.path("tracks.parquet"));
        let mut command = chainwave();
        command.arg("track").arg(root().join("data-samples/hec-view1-trial1.cine"));
        command
            .args(["--shape", shape, "--interpolation", "quintic", "--points"])
            .arg(points)
            .arg("--out")
            .arg(&out);
        succeed(&mut command);
        let table = read(&out);
        let [names, frames] = ["name", "frame"].map(|column| texts(&table, column));
        let mut found = Vec::new();
        for column in ["x_px", "y_px", "sigma_x_px"] {
            for (row, value) in numbers(&table, column).into_iter().enumerate() {
                found.push((format!("{column} of {} in frame {}", names[row], frames[row]), value));
            }
        }
        // Instruction sets sum in other orders, by some 1e-12 px; what changes an algorithm changes more than a millionth of a pixel.
        assert_golden(
            name,
            version_in("crates/correlation/src/lib.rs", "ALGORITHM_VERSION"),
            &found,
            |_, _| 1e-6,
        );
    }

    #[test]
    fn results_of_the_small_experiment_are_those_of_the_evaluations_version() {
        let laboratory = Laboratory::new();
        let (results, _) = laboratory.evaluate();
        let text = fs::read_to_string(results.join("results.json")).expect("results can be read");
        let json: serde_json::Value = serde_json::from_str(&text).expect("results are JSON");
        let value = |key: &str| json[key].as_f64().unwrap_or_else(|| panic!("{key} is no number"));
        let pairs = [
            ("group_velocity_m_per_s", "group_velocity_sigma"),
            ("c_d_kg_per_s", "c_d_sigma"),
            ("c_s_kg_per_s", "c_s_sigma"),
        ];
        let mut found: Vec<(String, f64)> = Vec::new();
        for (key, sigma) in pairs {
            found.extend([(key.to_owned(), value(key)), (sigma.to_owned(), value(sigma))]);
        }
        let front = read(&results.join("front.parquet"));
        for (row, time_s) in numbers(&front, "t_peak_s").into_iter().enumerate() {
            found.push((format!("t_peak_s of gap {}", row + 1), time_s));
        }
        let sigma_of = |what: &str| match pairs.iter().find(|(key, _)| *key == what) {
            Some((_, sigma)) => value(sigma),
            None if what.starts_with("t_peak_s") => 1e-7,
            // Of a sigma, itself.
            None => value(what),
        };
        // A solver stops within a thousandth of sigma of its minimum; two instruction sets may stop at other places there.
        let tolerance = |what: &str, _: f64| 5e-3 * sigma_of(what);
        assert_golden(
            "results",
            version_in("crates/experiment/src/evaluation.rs", "EVALUATION_VERSION"),
            &found,
            tolerance,
        );
    }

    /// The version that a source file states.
    fn version_in(file: &str, name: &str) -> u32 {
        let text = fs::read_to_string(root().join(file)).expect("the source can be read");
        let after = text.split(&format!("pub const {name}: u32 = ")).nth(1).expect("the version is stated");
        after.split(';').next().and_then(|number| number.parse().ok()).expect("the version is a number")
    }

    fn read(path: &PathBuf) -> DataFrame {
        let file = fs::File::open(path).expect("the table can be opened");
        ParquetReader::new(file).finish().expect("the table can be read")
    }

    /// The numbers that a column has.
    fn numbers(table: &DataFrame, name: &str) -> Vec<f64> {
        let column =
            table.column(name).expect("the column is there").cast(&DataType::Float64).expect("numbers");
        column.f64().expect("numbers").iter().flatten().collect()
    }

    fn texts(table: &DataFrame, name: &str) -> Vec<String> {
        let column = table.column(name).expect("the column is there").cast(&DataType::String).expect("texts");
        column.str().expect("texts").iter().map(|text| text.unwrap_or_default().to_owned()).collect()
    }
}
