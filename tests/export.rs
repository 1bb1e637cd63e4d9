//! Tables in MATLAB's format, read back by Octave, and Parquet that is packed as every reader knows it.

use std::fs;
use std::path::Path;
use std::process::Command;

use chainwave_testkit::skip;
use tempfile::TempDir;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::table::Table;

const SCENE: &str = "model = \"chain\"\nn_bodies = 4\nduration_s = 2e-3\noutput_interval_s = 1e-4\n\
    [body]\nmass_kg = 0.455e-3\npitch_m = 0.03\ndamping_kg_per_s = 0.003\n\
    [contact]\nlaw = \"power\"\na = 60.1\ndelta_0_m = 2.27e-3\np = 0.114\n\
    [drive]\nkind = \"striker\"\nmass_kg = 4.3e-3\nvelocity_m_per_s = 2.73\ndamping_kg_per_s = 0.2\n";

/// A table with lost numbers, lost texts and letters beyond ASCII.
const MIXED: &str = "name,x_px,2nd value\nä,1.5,\n,,2\nlast,-3e-300,4\n";

/// Results as a run leaves them: tables in the folder and in one within, and numbers.
fn results(folder: &Path) {
    let (scene, inner) = (folder.join("scene.toml"), folder.join("slow"));
    fs::write(&scene, SCENE).expect("a file can be written");
    fs::create_dir_all(&inner).expect("a folder can be made");
    for out in [folder.join("motion.parquet"), inner.join("motion.parquet")] {
        succeed(chainwave().arg("simulate").arg(&scene).arg("--out").arg(out));
    }
    let numbers = "{\"c_d_kg_per_s\": 0.25, \"c_s_kg_per_s_refused\": \"too short\", \"correlation\": null, \"gaps\": [2, 12], \"fit\": {\"n\": 3}}";
    fs::write(folder.join("results.json"), numbers).expect("a file can be written");
}

/// What Octave prints of a program; `None`, and the test is told to skip, where it is not installed.
fn octave(folder: &Path, program: &str) -> Option<String> {
    let Ok(output) =
        Command::new("octave-cli").args(["--norc", "--eval", program]).current_dir(folder).output()
    else {
        skip("octave-cli is not installed");
        return None;
    };
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    Some(String::from_utf8(output.stdout).expect("it prints text"))
}

fn numbers_in(text: &str) -> Vec<f64> {
    text.split_whitespace().map(|number| number.parse().expect("it prints numbers")).collect()
}

#[test]
fn octave_reads_results_to_the_last_bit() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    results(folder.path());
    succeed(chainwave().arg("export").arg(folder.path()).arg("--out").arg(folder.path().join("all.mat")));
    let program = "s = load('all.mat'); assert(strjoin(sort(fieldnames(s)'), ' '), 'motion results slow_motion'); \
        assert(class(s.motion.body), 'uint32'); assert(s.motion, s.slow_motion); assert(size(s.motion.x_m, 2), 1); \
        r = s.results; assert(r.c_d_kg_per_s, 0.25); assert(r.c_s_kg_per_s_refused, 'too short'); assert(isnan(r.correlation)); \
        assert(r.gaps, [2; 12]); assert(r.fit.n, 3); \
        printf('%.17g %.17g %.17g\\n', [s.motion.t_s, double(s.motion.body), s.motion.x_m]');";
    let Some(said) = octave(folder.path(), program) else { return };
    let table = Table::read(&folder.path().join("motion.parquet"));
    let columns = ["t_s", "body", "x_m"].map(|name| table.full(name));
    let expected: Vec<f64> =
        (0..table.n_rows()).flat_map(|row| columns.iter().map(move |column| column[row])).collect();
    assert_eq!(numbers_in(&said), expected);
}

#[test]
fn octave_reads_what_was_lost_and_any_letter() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    fs::write(folder.path().join("mixed.csv"), MIXED).expect("a file can be written");
    let [table, out] = ["mixed.csv", "a table.mat"].map(|name| folder.path().join(name));
    succeed(chainwave().arg("export").arg(table).arg("--out").arg(out));
    let program = "s = load('a table.mat'); t = s.a_table; assert(t.x_px, [1.5; NaN; -3e-300]); assert(t.x2nd_value, [NaN; 2; 4]); \
        assert(iscellstr(t.name)); assert(t.name(2:3), {''; 'last'}); assert(numel(t.name{1}) >= 1);";
    octave(folder.path(), program);
}

#[test]
fn tables_go_to_csv_and_back() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    results(folder.path());
    let out = folder.path().join("tables");
    succeed(chainwave().arg("export").arg(folder.path()).arg("--out").arg(&out));
    for name in ["motion", "slow/motion"] {
        let csv = Table::read(&out.join(name).with_extension("csv"));
        let parquet = Table::read(&folder.path().join(name).with_extension("parquet"));
        assert_eq!(csv.names(), parquet.names());
        for column in parquet.names() {
            assert_eq!(csv.full(&column), parquet.full(&column), "{name}, {column}");
        }
        // And back with the kinds of their columns: as texts, a body is 1 and not 1.0.
        let again = folder.path().join("again.parquet");
        succeed(chainwave().arg("export").arg(out.join(name).with_extension("csv")).arg("--out").arg(&again));
        let again = Table::read(&again);
        for column in parquet.names() {
            assert_eq!(again.texts(&column), parquet.texts(&column), "{name}, {column}");
        }
    }
}

#[test]
fn what_cannot_be_exported_is_named() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let said = |out: &str| {
        fail(chainwave().arg("export").arg(folder.path()).arg("--out").arg(folder.path().join(out)), 2)
    };
    assert!(said("all.mat").contains("a folder with tables (.parquet), found none"));
    let mut nowhere = chainwave();
    nowhere.arg("export").arg(folder.path().join("nowhere")).arg("--out").arg(folder.path().join("all.csv"));
    let missing = fail(&mut nowhere, 2);
    assert!(missing.contains("nowhere: expected a table or a folder of results, found none"), "{missing}");
    results(folder.path());
    let other = said("all.xlsx");
    assert!(other.contains("ends in .mat") && other.contains("all.xlsx"), "{other}");
}

#[test]
fn parquet_is_packed_by_snappy() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    results(folder.path());
    let bytes = fs::read(folder.path().join("motion.parquet")).expect("it was written");
    // The magic of a frame of Zstandard, which some readers do not know.
    let zstandard = [0x28, 0xb5, 0x2f, 0xfd];
    assert!(!bytes.windows(4).any(|window| window == zstandard), "it holds a frame of Zstandard");
}
