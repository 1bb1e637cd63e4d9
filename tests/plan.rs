//! `chainwave plan`: what an experiment will tell, for people and for programs, and what it refuses.

use serde_json::Value;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::laboratory::{Laboratory, N_RECORDINGS};

/// The results that a plan predicts, each with its uncertainty.
const RESULTS: [[&str; 2]; 7] = [
    ["x_m", "x_sigma_m"],
    ["group_velocity_m_per_s", "group_velocity_sigma"],
    ["hwhm_m", "hwhm_sigma_m"],
    ["c_d_kg_per_s", "c_d_sigma"],
    ["c_s_kg_per_s", "c_s_sigma"],
    ["peak_strain", "peak_strain_sigma"],
    ["psi_max_j", "psi_max_sigma_j"],
];

fn planned(laboratory: &Laboratory) -> Value {
    let mut command = chainwave();
    command.arg("plan").arg(laboratory.path("experiment.toml")).arg("--json");
    serde_json::from_str(&succeed(&mut command)).expect("it is JSON")
}

fn number(found: &Value, key: &str) -> f64 {
    found[key].as_f64().unwrap_or_else(|| panic!("expected a number {key} in {found}"))
}

#[test]
fn what_cannot_be_meant_is_refused() {
    for (from, to, named) in [
        ("pitch_m = 0.030\nmass_kg", "pitch_m = \"FILL_IN\"\nmass_kg", "FILL_IN"),
        ("p = 0.114", "p = -0.114", "above 0"),
        ("rest_until_s = -8e-5", "rest_until_s = -1.0", "rest_until_s"),
        ("first_body_px = [30.0, 23.5]", "first_body_px = [-30000.0, 23.5]", "first_body_px"),
    ] {
        let laboratory = Laboratory::with_experiment(from, to);
        let said = fail(chainwave().arg("plan").arg(laboratory.path("experiment.toml")), 2);
        assert!(said.contains(named), "{to}: {said}");
    }
}

mod slow {
    use super::*;

    #[test]
    fn a_plan_has_its_keys_and_says_the_same_twice() {
        let laboratory = Laboratory::new();
        let found = planned(&laboratory);
        for [value, sigma] in RESULTS {
            assert!(number(&found, sigma) > 0.0 && number(&found, value).is_finite(), "{sigma}: {found}");
            assert!(found["limits"][sigma].is_array(), "{sigma}: {found}");
        }
        assert_eq!(number(&found, "n_recordings") as usize, N_RECORDINGS, "{found}");
        assert!(number(&found, "n_filmed") < 0.5, "{found}");
        for key in ["bytes", "n_readings", "seconds", "seconds_with_causes", "tracking_s", "reading_sigma_px"]
        {
            assert!(number(&found, key) > 0.0, "{key}: {found}");
        }
        let changes = found["changes"].as_array().expect("a list");
        assert!(changes.len() >= 4, "{found}");
        for change in changes {
            assert!(change["change"].is_string(), "{change}");
            for key in ["n_recordings", "bytes", "n_readings", "seconds", "seconds_with_causes", "tracking_s"]
            {
                assert!(number(change, key) > 0.0, "{change}");
            }
            for [_, sigma] in RESULTS {
                assert!(change["factors"][sigma].as_f64().is_some_and(|factor| factor > 0.0), "{change}");
            }
        }
        // All but the time that was measured.
        let timeless = |mut found: Value| {
            for key in ["seconds", "seconds_with_causes", "tracking_s"] {
                found[key] = Value::Null;
                for change in found["changes"].as_array_mut().expect("a list") {
                    change[key] = Value::Null;
                }
            }
            found
        };
        assert_eq!(timeless(found), timeless(planned(&laboratory)));
        let text = succeed(chainwave().arg("plan").arg(laboratory.path("experiment.toml")));
        for word in [
            "15 recordings",
            "none filmed yet",
            "c_d (kg/s)",
            "10 trials of each view instead of 5",
            "helps most",
        ] {
            assert!(text.contains(word), "{word}: {text}");
        }
    }

    #[test]
    fn what_is_stated_within_an_uncertainty_limits_and_is_named() {
        // Speeds count in pitches, so a pitch known to 1 % leaves a speed known to 1 %: twelve times what noise does here.
        let laboratory = Laboratory::with_experiment(
            "pitch_m = 0.030\nmass_kg",
            "pitch_m = 0.030\npitch_sigma_m = 3e-4\nmass_kg",
        );
        let found = planned(&laboratory);
        let first = &found["limits"]["group_velocity_sigma"][0];
        assert!(first["source"] == "the pitch" && number(first, "share") > 0.9, "{found}");
        let relative = number(&found, "group_velocity_sigma") / number(&found, "group_velocity_m_per_s");
        assert!((0.01..0.011).contains(&relative), "{found}");
    }
}
