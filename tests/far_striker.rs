//! Chains that are driven otherwise than by one striker: a second one at the far end, filmed and evaluated; a shaker in a scene.

use crate::support::command::{chainwave, fail, succeed};
use crate::support::laboratory::{Laboratory, evaluation};

const CAMERA: &str = "[camera]\nscale_px_per_m = 2500.0";
const STRUCK: &str = "[far_striker]\nmass_kg = 4.3e-3\nvelocity_m_per_s = 1.9\ndamping_kg_per_s = 0.2\n\n[camera]\nscale_px_per_m = \
                      2500.0";

#[test]
fn a_far_striker_behind_a_wall_is_refused_with_both_keys() {
    let walled = format!("[far_end]\nkind = \"fixed\"\n\n{STRUCK}");
    let laboratory = Laboratory::with_replaced(&[(CAMERA, &walled)]);
    let said = fail(chainwave().arg("check").arg(laboratory.path("experiment.toml")), 2);
    assert!(
        said.contains("far_striker") && said.contains("fixed") && said.contains("experiment.toml"),
        "{said}"
    );
}

/// A scene of twelve bodies with a drive.
fn scene(drive: &str) -> String {
    format!(
        "model = \"chain\"\nn_bodies = 12\nduration_s = 0.01\noutput_interval_s = 1e-4\n\n[body]\nmass_kg = 0.455e-3\npitch_m = 0.03\n\
         damping_kg_per_s = 0.003\n\n[contact]\nlaw = \"power\"\na = 60.1\ndelta_0_m = 2.27e-3\np = 0.114\n\n{drive}"
    )
}

mod slow {
    use std::fs;

    use super::*;
    use crate::support::motion::assert_motion_held;
    use crate::support::table::Table;
    use crate::support::written::json;

    #[test]
    fn a_scene_has_a_far_striker_or_a_shaker() {
        let laboratory = Laboratory::new();
        let struck = "[drive]\nkind = \"striker\"\nmass_kg = 4.3e-3\nvelocity_m_per_s = 2.0\ndamping_kg_per_s = 0.2\n\n[far_striker]\nmass_kg = \
                      4.3e-3\nvelocity_m_per_s = 2.0\ndamping_kg_per_s = 0.2\n";
        let shaken = "[drive]\nkind = \"shaker\"\nfrequency_hz = 300.0\namplitude_m = 1e-4\nramp_s = 2e-3\n";
        for (drive, bodies) in [(struck, 0..=13), (shaken, 1..=12)] {
            let path = laboratory.write("scene.toml", &scene(drive));
            let (motion, summary) = (laboratory.path("motion.csv"), laboratory.path("summary.json"));
            succeed(
                chainwave()
                    .arg("simulate")
                    .arg(&path)
                    .arg("--out")
                    .arg(&motion)
                    .arg("--summary")
                    .arg(&summary),
            );
            let text = fs::read_to_string(&motion).expect("it was written");
            let rows = || {
                text.lines().skip(1).map(|row| -> Vec<f64> {
                    row.split(',').map(|cell| cell.parse().expect("a number")).collect()
                })
            };
            assert_eq!(rows().map(|row| row[1] as i32).min(), Some(*bodies.start()));
            assert_eq!(rows().map(|row| row[1] as i32).max(), Some(*bodies.end()));
            assert!(json(&summary)["energy_drift"].as_f64().expect("a number") < 1e-6);
            let at_end: Vec<Vec<f64>> = rows().filter(|row| row[0] > 0.01 - 1e-9).collect();
            if drive == struck {
                // Equal strikers: mirror images, to the accuracy of 1e-6 of some 20 mm.
                let mirrored =
                    at_end.iter().zip(at_end.iter().rev()).map(|(one, other)| (one[2] + other[2]).abs());
                assert!(mirrored.fold(0.0, f64::max) < 1e-7, "{at_end:?}");
            } else {
                let sine = 1e-4 * (std::f64::consts::TAU * 300.0 * 0.01).sin();
                assert!((at_end[0][2] - sine).abs() < 1e-9, "{at_end:?}");
            }
        }
    }

    /// What is free of a model is there, with both pulses and their collision; the fit to the tracks takes the second striker as it is stated, and
    /// the one behind body 1 is refused.
    #[test]
    fn motion_pulses_and_damping_are_given() {
        let laboratory = Laboratory::with_replaced(&[(CAMERA, STRUCK)]);
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        let run = evaluation(&recordings, &results).output().expect("chainwave starts");
        assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
        // 0.94 before what is not known of two strikers' drives was an error of the motion.
        assert_motion_held(&recordings, &results);
        let found = json(&results.join("results.json"));
        assert_eq!(found["damping_from"], "tracks", "{found}");
        for (key, truth) in [("c_d", 0.003), ("c_s", 0.2)] {
            let value = found[format!("{key}_kg_per_s")].as_f64().expect("a number");
            let sigma = found[format!("{key}_sigma")].as_f64().expect("a number");
            // Four deviations.
            assert!((value - truth).abs() < 4.0 * sigma && sigma < 0.1 * truth, "{key}: {value} +- {sigma}");
        }
        let behind = &found["fit_behind_body_1"];
        assert!(behind.to_string().contains("[far_striker]"), "{behind}");
        let mut warnings = found["warnings"].as_array().expect("a list").iter();
        assert!(warnings.any(|one| one["code"] == "far_striker"), "{}", found["warnings"]);
        let pulses = found["pulses"].as_array().expect("a list");
        let with = |direction: &str| {
            pulses.iter().find(|pulse| pulse["direction"] == direction && pulse["sense"] == "compression")
        };
        for direction in ["down", "up"] {
            let pulse = with(direction).expect("a pulse each way");
            assert!(pulse["n_gaps"].as_u64().expect("a count") >= 6, "{pulse}");
        }
        let meets = found["pulse_collisions"].as_array().expect("a list").iter();
        assert!(meets.into_iter().any(|one| one["kind"] == "head on"), "{}", found["pulse_collisions"]);
        let table = Table::read(&results.join("pulses.parquet"));
        let names = table.names();
        for name in [
            "pulse",
            "gap",
            "t_s",
            "t_sigma_s",
            "strain",
            "strain_sigma",
            "hwhm_m",
            "speed_m_per_s",
            "status",
        ] {
            assert!(names.contains(&name.into()), "pulses.parquet lacks {name}");
        }
        for name in ["strain.parquet", "front.parquet", "spectrum.parquet", "energy.parquet", "report.html"] {
            assert!(results.join(name).exists(), "{name}");
        }
    }
}
