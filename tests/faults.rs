//! What goes wrong in a laboratory: it is named, left out or corrected, and the result stays within its interval.

mod slow {
    use serde_json::Value;

    use crate::command::fail;
    use crate::laboratory::{Laboratory, evaluation};

    const FAULTS: &str = r#"
[[synthetic.faults]]
kind = "truncated_file"
recording = "view1_trial1.cine"
kept_fraction = 0.6

[[synthetic.faults]]
kind = "struck_too_fast"
recording = "view1_trial3.cine"
factor = 1.05

[[synthetic.faults]]
kind = "swapped_files"
recordings = ["view2_trial2.cine", "view3_trial2.cine"]

[[synthetic.faults]]
kind = "covered_body"
recording = "view2_trial3.cine"
body = 6
from_s = 0.002
until_s = 0.004

[[synthetic.faults]]
kind = "dropped_frames"
recording = "view3_trial3.cine"
first_frame = 100
n_frames = 12

[[synthetic.faults]]
kind = "wrong_rate"
recording = "view3_trial4.cine"
header_rate_hz = 24000.0
"#;

    #[test]
    fn faults_are_named_and_the_damping_stays_within_its_interval() {
        let laboratory = Laboratory::with_appended(FAULTS);
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        let said = fail(&mut evaluation(&recordings, &results), 1);
        assert!(said.contains("view1_trial1.cine") && said.contains("byte"), "{said}");
        let text = std::fs::read_to_string(results.join("results.json")).expect("it was written");
        let found: Value = serde_json::from_str(&text).expect("it is JSON");
        let warnings = found["warnings"].to_string();
        for swapped in ["view2_trial2.cine", "view3_trial2.cine"] {
            assert!(warnings.contains(swapped), "{warnings}");
        }
        // Another strike, lost frames and a header's wrong rate (the time stamps are right) are no reason to leave a trial out.
        assert_eq!(warnings.matches("was left out").count(), 2, "{warnings}");
        assert_eq!(found["damping_from"], "tracks");
        for (value, sigma, truth) in
            [("c_d_kg_per_s", "c_d_sigma", 0.003), ("c_s_kg_per_s", "c_s_sigma", 0.2)]
        {
            let number = |name: &str| found[name].as_f64().expect("a number");
            // Four standard uncertainties, as in the other tests of the whole way.
            assert!((number(value) - truth).abs() < 4.0 * number(sigma), "{value}: {}", found[value]);
            assert!(number(sigma) < 0.01 * truth, "{value}: a sigma of {}", found[sigma]);
        }
    }

    const SWAPPED: &str = r#"
[[synthetic.faults]]
kind = "swapped_files"
recordings = ["view1_trial1.cine", "view2_trial1.cine"]
"#;

    /// The first recordings of two views, which stand for them where views are compared at rest; of three trials a view, of which no motion tells
    /// the wrong one.
    #[test]
    fn files_under_the_names_of_others_are_told_by_their_markers() {
        let laboratory = Laboratory::with_appended(SWAPPED);
        let trials = laboratory.path("trials.csv");
        let first_three: String = std::fs::read_to_string(&trials)
            .expect("it was written")
            .lines()
            .filter(|row| !["trial4", "trial5"].iter().any(|trial| row.contains(trial)))
            .map(|row| format!("{row}\n"))
            .collect();
        laboratory.write("trials.csv", &first_three);
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        fail(&mut evaluation(&recordings, &results), 1);
        let text = std::fs::read_to_string(results.join("results.json")).expect("it was written");
        let found: Value = serde_json::from_str(&text).expect("it is JSON");
        let warned = |file: &str, shows: &str| {
            let is_told = |warning: &Value| {
                warning["code"] == "left_out"
                    && warning["subject"] == file
                    && warning["text"].to_string().contains(shows)
            };
            found["warnings"].as_array().expect("a list").iter().any(is_told)
        };
        assert!(warned("view1_trial1.cine", "it shows the bodies of view 2"), "{}", found["warnings"]);
        assert!(warned("view2_trial1.cine", "it shows the bodies of view 1"), "{}", found["warnings"]);
        let states = found["recordings"].as_array().expect("a list").iter();
        assert_eq!(states.filter(|one| one["state"] == "used").count(), 7, "{}", found["recordings"]);
        let number = |name: &str| found[name].as_f64().expect("a number");
        // Four standard uncertainties, as in the other tests of the whole way.
        assert!((number("c_d_kg_per_s") - 0.003).abs() < 4.0 * number("c_d_sigma"), "{found}");
    }
}
