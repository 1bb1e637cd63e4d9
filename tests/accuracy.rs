//! `run --accuracy`, `run --budget` and `tradeoff --results`: no more is looked at than is asked, and what was foreseen stands beside what came out.

use std::fs;

use serde_json::Value;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::laboratory::{Laboratory, evaluation};
use crate::support::written::json;

#[test]
fn what_is_no_accuracy_is_refused() {
    let laboratory = Laboratory::new();
    for (accuracy, said) in [("c_g", "such as"), ("c_g=1mm", "unit of m/s"), ("speed=1%", "expected one of")]
    {
        let mut command = evaluation(laboratory.path("").as_path(), &laboratory.path("results"));
        let message = fail(command.args(["--accuracy", accuracy]), 2);
        assert!(message.contains(said), "{accuracy}: {message}");
        assert!(!laboratory.path("results").exists());
    }
}

mod slow {
    use super::*;

    #[test]
    fn a_run_looks_at_no_more_than_is_asked_and_says_what_it_missed() {
        let laboratory = Laboratory::new();
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        let mut command = evaluation(&recordings, &results);
        let said =
            succeed(command.args(["--accuracy", "c_g=2%", "--accuracy", "peak_strain=5%", "--budget"]));
        for word in ["trials that are used", "pixels to look at", "foreseen", "not needed for c_g to 2 %"] {
            assert!(said.contains(word), "{word}: {said}");
        }
        let found = json(&results.join("accuracy.json"));
        let asked = found["results"].as_array().expect("a list");
        assert_eq!(asked.len(), 2);
        for one in asked {
            let number = |key: &str| one[key].as_f64().unwrap_or_else(|| panic!("{key}: {one}"));
            assert_eq!(one["is_met"], Value::Bool(true), "{one}");
            assert!(number("sigma") <= number("asked_sigma") && number("expected_sigma") > 0.0, "{one}");
        }
        assert!(found["share_of_pixels"].as_f64().is_some_and(|share| share < 0.5), "{found}");
        let states = fs::read_to_string(results.join("recordings.csv")).expect("a list of recordings");
        assert!(states.contains("not needed for") && states.lines().count() == 16, "{states}");
        let decisions = fs::read_to_string(results.join("decisions.json")).expect("decisions");
        assert!(
            decisions.contains("trials that are used")
                && decisions.contains("tracking method for what was asked")
        );
        let provenance = fs::read_to_string(results.join("provenance.toml")).expect("provenance");
        let (_, not_needed) = provenance.split_once("view1_trial5").expect("every recording that is stated");
        let (of_it, _) = not_needed.split_once("[[").expect("others behind it");
        assert!(of_it.contains("state = \"left_out\""), "{provenance}");
        let listed = json(&results.join("results.json"));
        let listed = listed["recordings"].as_array().expect("a list");
        let of_state = |state: &str| listed.iter().filter(|one| one["state"] == state).count();
        assert!(listed.len() == 15 && of_state("left_out") > 0 && of_state("used") > 0, "{listed:?}");
        let report = fs::read_to_string(results.join("report.html")).expect("a report");
        assert!(!report.contains("all recordings are used") && report.contains("not needed for"));
        for head in ["Accuracy asked for", "Prediction and outcome", "Error budget"] {
            assert!(report.contains(head), "{head}");
        }
        let foreseen = &json(&results.join("error_budget.json"))["foreseen"];
        assert!(foreseen["group_velocity_sigma"].as_f64().is_some_and(|sigma| sigma > 0.0), "{foreseen}");
        let mut beyond = evaluation(&recordings, &results);
        let output = beyond.args(["--accuracy", "c_d=0.001%"]).output().expect("the command starts");
        let missed = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && missed.contains("c_d to 0.001 % was asked for"), "{missed}");
        assert_eq!(json(&results.join("accuracy.json"))["results"][0]["is_met"], Value::Bool(false));
        assert!(!results.join("error_budget.json").exists(), "it was of another run");
        succeed(&mut evaluation(&recordings, &results));
        assert!(!results.join("accuracy.json").exists(), "it was of another run");
    }

    #[test]
    fn the_trade_of_final_results_is_measured_on_whole_runs() {
        // What is open of a camera's geometry is no less with more trials.
        let laboratory = Laboratory::with_experiment("[camera]\n", "[camera]\ngeometry_sigma = 0.0\n");
        let (recordings, out) = (laboratory.film(), laboratory.path("tradeoff"));
        let mut command = chainwave();
        command.arg("tradeoff").arg(recordings.join("experiment.toml")).arg("--out").arg(&out);
        let said = succeed(command.args(["--results", "--json"]));
        let rungs = serde_json::from_str::<Value>(&said).expect("it is JSON")["rungs"].clone();
        let error = |step: &str, settings: &str| {
            let rungs = rungs.as_array().expect("a list");
            let same = |one: &&Value| one["step"] == step && one["settings"] == settings;
            rungs.iter().find(same).and_then(|one| one["error"].as_f64())
        };
        for step in ["c_g", "HWHM", "c_d"] {
            assert!(error(step, "as stated").is_some_and(|error| error > 0.0), "{step}: {rungs}");
            assert!(out.join(format!("tradeoff-{step}.png")).exists());
        }
        // Information adds up over trials: a fifth of them leaves sigma root 5 times larger; what models leave open adds to both.
        let (all, one) = (error("c_d", "as stated"), error("c_d", "1 of 5 trials"));
        let ratio = one.zip(all).map(|(one, all)| one / all);
        assert!(ratio.is_some_and(|ratio| ratio > 1.5), "{ratio:?}");
    }
}
