//! Chains that nothing strikes: a shaker, an imposed motion and a release, filmed and evaluated against their truth; and springs to ground.

use std::f64::consts::PI;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::laboratory::Laboratory;
use crate::support::table::Table;

const STRIKER: &str = "[striker]\nmass_kg = 4.3e-3\nvelocity_m_per_s = 2.73\nvelocity_sigma_m_per_s = 0.05\n";
const STRIKER_DAMPING: &str = "striker_damping_kg_per_s = 0.2\n";
const MASS: &str = "mass_kg = 0.455e-3\n";
const GROUNDED: &str = "mass_kg = 0.455e-3\nground_stiffness_n_per_m = 300.0\n";
const SHAKER: &str =
    "[drive]\nkind = \"shaker\"\nfrequency_hz = 250.0\namplitude_m = 8e-4\nramp_s = 3e-3\nscatter = 0.02\n";
const RELEASE: &str =
    "[drive]\nkind = \"free\"\nprecompression_n = 0.3\nscatter = 0.02\n\n[far_end]\nkind = \"fixed\"\n";

#[test]
fn a_drive_that_does_not_add_up_is_refused_with_its_key() {
    let shaker_beside = format!("{STRIKER}\n{SHAKER}");
    let far =
        format!("{SHAKER}\n[far_striker]\nmass_kg = 1e-3\nvelocity_m_per_s = 1.0\ndamping_kg_per_s = 0.1\n");
    let places: [(&str, &str); 10] = [
        ("", "[striker], or [drive]"),
        (&shaker_beside, "[striker] or [drive]"),
        ("[drive]\nkind = \"shaker\"\nfrequency_hz = 250.0\namplitude_m = 8e-4\n", "drive.scatter"),
        ("[drive]\nkind = \"shaker\"\nfrequency_hz = -1.0\namplitude_m = 8e-4\nscatter = 0.02\n", "above 0"),
        (
            "[drive]\nkind = \"striker\"\nmass_kg = 1e-3\nvelocity_m_per_s = 1.0\ndamping_kg_per_s = 0.1\n",
            "[striker]",
        ),
        ("[drive]\nkind = \"imposed\"\nfile = \"no.csv\"\nscatter = 0.02\n", "no.csv"),
        ("[drive]\nkind = \"imposed\"\nscatter = 0.02\n", "file"),
        ("[drive]\nkind = \"free\"\nscatter = 0.02\n", "initial or precompression_n"),
        ("[drive]\nkind = \"free\"\nx_m = [1e-3, 0.0]\nscatter = 0.02\n", "12 numbers"),
        (&far, "far_striker"),
    ];
    for (drive, reason) in places {
        let laboratory = Laboratory::with_replaced(&[(STRIKER, drive), (STRIKER_DAMPING, "")]);
        let said = fail(chainwave().arg("check").arg(laboratory.path("experiment.toml")), 2);
        assert!(said.contains(reason), "{reason}: {said}");
    }
    let damped = Laboratory::with_replaced(&[(STRIKER, SHAKER)]);
    let said = fail(chainwave().arg("check").arg(damped.path("experiment.toml")), 2);
    assert!(said.contains("striker_damping_kg_per_s"), "{said}");
    let undamped = Laboratory::with_replaced(&[(STRIKER_DAMPING, "")]);
    let said = fail(chainwave().arg("check").arg(undamped.path("experiment.toml")), 2);
    assert!(said.contains("striker_damping_kg_per_s"), "{said}");
    let short =
        Laboratory::with_replaced(&[(MASS, "mass_kg = 0.455e-3\nground_stiffness_n_per_m = [1.0, 2.0]\n")]);
    let said = fail(chainwave().arg("check").arg(short.path("experiment.toml")), 2);
    assert!(said.contains("chain.ground_stiffness_n_per_m: expected a number or 12 numbers"), "{said}");
    let held = Laboratory::with_replaced(&[(STRIKER, RELEASE), (STRIKER_DAMPING, ""), (MASS, GROUNDED)]);
    let said = fail(chainwave().arg("check").arg(held.path("experiment.toml")), 2);
    assert!(said.contains("precompression_n") && said.contains("initial"), "{said}");
}

#[test]
fn a_curve_that_holds_no_body_is_refused_with_its_key() {
    for (points, reason) in [
        (
            "displacement_m = [-1e-3, 0.0, 1e-3]\nforce_n = [0.3, 0.0, -0.3]\n",
            "stiffness of the ground table",
        ),
        ("displacement_m = [0.0, 1e-3, 1e-3]\nforce_n = [0.0, 0.3, 0.4]\n", "displacement of point 3"),
        ("displacement_m = [-1e-3, 0.0, 1e-3]\nforce_n = [-0.3, 0.0]\n", "forces of the ground table"),
    ] {
        let laboratory =
            Laboratory::with_replaced(&[("[camera]\n", &format!("[ground]\n{points}\n[camera]\n"))]);
        let said = fail(chainwave().arg("check").arg(laboratory.path("experiment.toml")), 2);
        assert!(said.contains("ground: ") && said.contains(reason), "{reason}: {said}");
    }
}

const BODIES: &str = "model = \"chain\"\nn_bodies = 8\ntask = \"bands\"\nn_kappa = 9\n\n[body]\nmass_kg = 0.455e-3\npitch_m = 0.03\n\
                      damping_kg_per_s = 0.0\n";

/// m omega^2 = g + 4 k sin^2(kappa / 2) (M. Remoissenet, Waves Called Solitons, chapter 2), whether springs or a curve hold the bodies.
#[test]
fn bands_of_a_scene_are_those_of_the_closed_form() {
    let (k, m, g) = (1474.0_f64, 0.455e-3_f64, 300.0_f64);
    let contact = "\n[contact]\nlaw = \"linear\"\nk_n_per_m = 1474.0\n";
    let springs = "ground_stiffness_n_per_m = 300.0\n";
    let curve = "\n[ground]\ndisplacement_m = [-1e-3, 0.0, 1e-3, 2e-3]\nforce_n = [-0.3, 0.0, 0.3, 0.0]\n";
    for scene in [format!("{BODIES}{springs}{contact}"), format!("{BODIES}{curve}{contact}")] {
        let laboratory = Laboratory::new();
        let (scene, out) = (laboratory.write("scene.toml", &scene), laboratory.path("bands.csv"));
        succeed(chainwave().arg("simulate").arg(scene).arg("--out").arg(&out));
        let bands = Table::read(&out);
        assert_eq!(bands.names(), ["kappa_a", "band", "frequency_hz"]);
        assert_eq!(bands.n_rows(), 9);
        for (kappa_a, found_hz) in bands.full("kappa_a").into_iter().zip(bands.full("frequency_hz")) {
            let expected_hz = ((g + 4.0 * k * (0.5 * kappa_a).sin().powi(2)) / m).sqrt() / (2.0 * PI);
            // Rounding of an eigenvalue.
            assert!((found_hz / expected_hz - 1.0).abs() < 1e-12, "{kappa_a}: {found_hz} {expected_hz}");
        }
    }
    let laboratory = Laboratory::new();
    let graded = BODIES.replace("mass_kg = 0.455e-3", "mass_kg = { grade = [1e-3, 2e-3] }");
    let scene = laboratory.write("scene.toml", &format!("{graded}{contact}"));
    let said = fail(chainwave().arg("simulate").arg(scene).arg("--out").arg(laboratory.path("bands.csv")), 2);
    assert!(said.contains("repeats none"), "{said}");
}

mod slow {
    use std::path::PathBuf;

    use serde_json::Value;

    use super::*;
    use crate::support::laboratory::evaluation;
    use crate::support::motion::assert_motion_held;
    use crate::support::written::json;

    const TABLES: [&str; 8] = [
        "tracks.parquet",
        "motion.parquet",
        "strain.parquet",
        "front.parquet",
        "hwhm.parquet",
        "energy.parquet",
        "spectrum.parquet",
        "report.html",
    ];

    /// Films and evaluates a chain, and holds what was found against the truth: the motion, and c_d if it is not to be refused.
    fn found_of(laboratory: &Laboratory) -> (Value, PathBuf) {
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        let run = evaluation(&recordings, &results).output().expect("chainwave starts");
        assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
        assert_motion_held(&recordings, &results);
        for name in TABLES {
            assert!(results.join(name).exists(), "{name}");
        }
        let found = json(&results.join("results.json"));
        let number = |name: &str| found[name].as_f64().unwrap_or_else(|| panic!("{name}: {found}"));
        // Four standard uncertainties, as in the other tests of the whole way; and told, not merely held.
        let sigma = number("c_d_sigma");
        assert!((number("c_d_kg_per_s") - 3e-3).abs() < 4.0 * sigma && sigma < 1e-3, "{found}");
        (found, results)
    }

    fn driven(drive: &str, more: &[(&str, &str)]) -> Laboratory {
        let own = [(STRIKER, drive), (STRIKER_DAMPING, "")];
        Laboratory::with_replaced(&own.iter().chain(more).copied().collect::<Vec<_>>())
    }

    #[test]
    fn a_shaken_chain_gives_its_damping_and_no_strikers() {
        let laboratory = driven(SHAKER, &[]);
        let (found, _) = found_of(&laboratory);
        let reason = found["c_s_kg_per_s_refused"].as_str().expect("a reason");
        assert!(reason.contains("a shaker drives the chain"), "{reason}");
        assert!(
            found["fit_to_tracks"]["failed"].as_str().is_some_and(|why| why.contains("a shaker")),
            "{found}"
        );
        let truth = json(&laboratory.path("recordings/truth.json"));
        assert!((truth["drive"].as_f64().expect("a number") - 1.0).abs() < 0.03, "{truth}");
        assert_eq!(truth["c_s_kg_per_s"], Value::Null);
        // The train grows while the shaker does: the first crest that stands out is another one farther down, which is no wave's speed.
        for (key, why) in [("group_velocity_m_per_s", "crest"), ("local_resonance_hz", "driven")] {
            let refused = found[format!("{key}_refused")].as_str().expect("a reason");
            assert!(found[key] == Value::Null && refused.contains(why), "{refused}");
        }
    }

    /// The same motion as a file, of a chain that springs hold to ground.
    #[test]
    fn an_imposed_motion_of_a_chain_held_to_ground() {
        let laboratory = driven(
            "[drive]\nkind = \"imposed\"\nfile = \"shaken.csv\"\nscatter = 0.02\n",
            &[(MASS, GROUNDED)],
        );
        let moved_m = |t_s: f64| {
            let grown = if t_s < 3e-3 { 0.5 * (1.0 - (PI * t_s / 3e-3).cos()) } else { 1.0 };
            8e-4 * grown * (std::f64::consts::TAU * 250.0 * t_s).sin()
        };
        let rows: String =
            (0..=700).map(|k| 2e-5 * f64::from(k)).map(|t_s| format!("{t_s},{}\n", moved_m(t_s))).collect();
        laboratory.write("shaken.csv", &format!("t_s,x_m\n{rows}"));
        let (found, _) = found_of(&laboratory);
        let reason = found["c_s_kg_per_s_refused"].as_str().expect("a reason");
        assert!(reason.contains("an imposed motion"), "{reason}");
    }

    #[test]
    fn a_chain_that_is_let_go_relaxes_as_it_should() {
        let laboratory = driven(RELEASE, &[]);
        let (found, results) = found_of(&laboratory);
        let truth = json(&laboratory.path("recordings/truth.json"));
        assert_eq!(found["damping_from"], "tracks", "{found}");
        assert_eq!(found["fit_to_tracks"]["as_if"], Value::Null, "{found}");
        for (fit, (value, sigma, expected)) in [
            ("release_time_s", "release_time_sigma", truth["impact_time_s"].as_f64().expect("a number")),
            ("state", "state_sigma", truth["drive"].as_f64().expect("a number")),
        ]
        .into_iter()
        .flat_map(|told| [(&found["fit_to_release"], told), (&found["fit_to_tracks"], told)])
        {
            let number = |name: &str| fit[name].as_f64().expect("a number");
            assert!((number(value) - expected).abs() < 4.0 * number(sigma), "{value} of {expected}: {fit}");
        }
        // The wave takes the load off: each gap's first extreme is one of rarefaction, and it runs down the chain.
        let peaks = Table::read(&results.join("front.parquet")).numbers("peak_strain");
        let peaks: Vec<f64> = peaks.into_iter().flatten().collect();
        assert!(peaks.len() > 5 && peaks.iter().all(|strain| *strain > 0.0), "{peaks:?}");
        let velocity = found["group_velocity_m_per_s"].as_f64().expect("a number");
        // Sound runs at 54 m/s, and a load of 0.3 N softens the law by a tenth.
        assert!((40.0..60.0).contains(&velocity), "{velocity}");
        // Every contact held the load: F = 0.3 N at Delta, Psi(Delta) by the law, and holds no less at its most; a wave of the same height that comes back from the wall makes at most twice the force of it, and so four times the energy.
        let (a, delta_0_m, p) = (60.1, 2.27e-3_f64, 0.114);
        let f_0_n = a * delta_0_m.powf(p);
        let overlap_m = ((0.3 + f_0_n) / a).powf(1.0 / p) - delta_0_m;
        let power = |overlap_m: f64| (overlap_m + delta_0_m).powf(p + 1.0);
        let held_j = a / (p + 1.0) * (power(overlap_m) - power(0.0)) - f_0_n * overlap_m;
        let energies = Table::read(&results.join("energy.parquet"));
        for (energy_j, sigma_j) in energies.full("psi_max_j").into_iter().zip(energies.full("sigma_j")) {
            assert!(energy_j > held_j - 4.0 * sigma_j && energy_j < 4.0 * held_j, "{energy_j} of {held_j}");
        }
    }

    /// The results of films of a laboratory whose experiment states something else than what was filmed.
    fn found_with(laboratory: &Laboratory, from: &str, to: &str) -> Value {
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        let path = recordings.join("experiment.toml");
        let stated = std::fs::read_to_string(&path).expect("a text");
        assert!(stated.contains(from), "{stated}");
        laboratory.write("recordings/experiment.toml", &stated.replace(from, to));
        let run = evaluation(&recordings, &results).output().expect("chainwave starts");
        assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
        json(&results.join("results.json"))
    }

    fn c_d_is_held(found: &Value) -> bool {
        let number = |name: &str| found[name].as_f64().unwrap_or_else(|| panic!("{name}: {found}"));
        (number("c_d_kg_per_s") - 3e-3).abs() < 4.0 * number("c_d_sigma")
    }

    #[test]
    fn a_chain_that_is_let_go_and_is_heavier_than_stated_is_told_so() {
        let found = found_with(&driven(RELEASE, &[]), "mass_kg = 0.000455\n", "mass_kg = 0.000453\n");
        assert!(
            found["fit_to_tracks"]["as_if"].as_array().is_some_and(|causes| !causes.is_empty()),
            "{found}"
        );
        assert!(c_d_is_held(&found), "{found}");
        let refused = found["fit_to_release"]["refused"].as_str().expect("a reason");
        assert!(refused.contains("assumes the chain model as stated"), "{refused}");
    }

    /// Every recording tells the same: the stated velocity is eight of its scatters off.
    #[test]
    fn a_striker_that_is_faster_than_stated_is_told_and_harms_nothing() {
        let (from, to) = ("velocity_m_per_s = 2.73\n", "velocity_m_per_s = 2.33\n");
        let found = found_with(&Laboratory::new(), from, to);
        let warnings = found["warnings"].as_array().expect("a list");
        assert!(warnings.iter().any(|one| one["code"] == "drive_strength"), "{found}");
        assert_eq!(found["fit_to_tracks"]["as_if"], Value::Null, "{found}");
        assert!(c_d_is_held(&found), "{found}");
        let refused = found["fit_to_peak_energies"]["refused"].as_str().expect("a reason");
        assert!(refused.contains("assumes the drive as stated"), "{refused}");
    }

    /// A struck chain that is held to ground: all of the fits know its springs.
    #[test]
    fn springs_to_ground_are_part_of_the_model() {
        let laboratory = Laboratory::with_replaced(&[(MASS, GROUNDED)]);
        let (found, _) = found_of(&laboratory);
        assert_eq!(found["fit_to_tracks"]["as_if"], Value::Null, "{found}");
        let number = |name: &str| found[name].as_f64().expect("a number");
        assert!((number("c_s_kg_per_s") - 0.2).abs() < 4.0 * number("c_s_sigma"), "{found}");
    }

    #[test]
    fn chains_that_nothing_strikes_are_planned_and_checked() {
        for drive in [SHAKER, RELEASE] {
            let laboratory = driven(drive, &[]);
            let path = laboratory.path("experiment.toml");
            let said = succeed(chainwave().arg("plan").arg(&path));
            assert!(said.contains("driven by a "), "{said}");
            let recordings = laboratory.film();
            succeed(chainwave().arg("check").arg(recordings.join("experiment.toml")));
        }
    }
}
