//! What the evaluation chooses to model, on chains whose bodies are alike and on chains whose bodies are not.

mod slow {
    use std::fs;

    use serde_json::Value;

    use crate::support::command::{chainwave, succeed};
    use crate::support::laboratory::{Laboratory, evaluation};
    use crate::support::table::Table;

    const TRIGGERS: &str = "what trigger offsets and drives are taken from";

    /// Every number that is taken to be so, of whatever chain, where the recordings do not tell it.
    const ASSUMED: [(&str, &str); 16] = [
        ("assumed: how far drives differ from trial to trial", "5 %"),
        ("assumed: how far a response departs from scaling with the drive", "100 %"),
        ("assumed: how far a response curves with the drive", "50 %"),
        ("assumed: how far a curvature differs from a weak non-linearity's", "15 %"),
        ("assumed: how large responses of third order are", "20 %"),
        ("assumed: how the delay with the square of the drive stands to that with the drive", "20 %"),
        ("assumed: how long body 1 moves in proportion to the drive", "until it has gone 10 %"),
        ("assumed: how far the onset departs from proportion, as a delay", "by the stated chain "),
        ("assumed: how far the onset departs from proportion, as a scale", "by the stated chain to "),
        (
            "assumed: lens and turn of a camera that was not calibrated",
            "0.001 of the scale at a picture's edge",
        ),
        ("assumed: damping where fits begin", "0.06 % of critical damping of a body for c_d, 6 % for c_s"),
        ("assumed: how well positions of the stage are known", "to 0.02 mm"),
        ("assumed: how far masses may scatter, where the tracks ask for it", "by 5 %"),
        ("assumed: how far contacts' stiffness may scatter, where the tracks ask for it", "by 15 %"),
        ("assumed: how likely each cause is that the experiment does not state", "odds of 0.2 "),
        (
            "assumed: how likely masses or contacts scatter by as little as the tracks do not tell",
            "odds of 1 ",
        ),
    ];

    /// The choices of a run, and its results.
    fn decided(laboratory: &Laboratory) -> (Vec<(String, String)>, Value) {
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        succeed(&mut evaluation(&recordings, &results));
        let json = |name: &str| -> Value {
            let text = fs::read_to_string(results.join(name)).expect("it was written");
            serde_json::from_str(&text).expect("it is JSON")
        };
        let text = |value: &Value| value.as_str().expect("a text").to_owned();
        let decisions = json("decisions.json");
        let decisions = decisions.as_array().expect("a list").iter();
        let choices = decisions.map(|one| (text(&one["question"]), text(&one["choice"]))).collect();
        let map = Table::read(&results.join("dispersion.parquet"));
        assert!(map.n_rows() > 1000 && map.full("amplitude").iter().all(|amplitude| *amplitude >= 0.0));
        (choices, json("results.json"))
    }

    fn choice<'a>(choices: &'a [(String, String)], question: &str) -> &'a str {
        &choices.iter().find(|(asked, _)| asked == question).expect("the question is asked").1
    }

    #[test]
    fn the_simplest_model_that_holds_is_chosen() {
        let (choices, results) = decided(&Laboratory::new());
        for (question, expected) in [
            ("contact law", "power law"),
            ("damping", "c_d and c_s"),
            ("differences between bodies", "none"),
            ("dimensions of the motion", "1-D"),
            (TRIGGERS, "the chain model's impacts"),
        ]
        .into_iter()
        .chain(ASSUMED)
        {
            assert!(choice(&choices, question).starts_with(expected), "{question}: {choices:?}");
        }
        let n_assumed = choices.iter().filter(|(question, _)| question.starts_with("assumed: ")).count();
        assert_eq!(n_assumed, ASSUMED.len(), "{choices:?}");
        let fit = &results["fit_to_tracks"];
        assert_eq!((&fit["starts"], &fit["starts_at_this_minimum"]), (&3.into(), &3.into()));
        assert_eq!(fit["c_d_interval_95"]["is_quadratic"], true);
        // Body 1 as it was measured drives the chain: c_d within four of its own uncertainties, and no c_s.
        let behind = &results["fit_behind_body_1"];
        let number = |name: &str| behind[name].as_f64().expect("a number");
        assert!((number("c_d_kg_per_s") - 0.003).abs() < 4.0 * number("c_d_sigma"), "{behind}");
        assert!(number("c_d_sigma") < 0.001, "{behind}");
        assert!(behind["c_s"].as_str().is_some_and(|reason| reason.contains("not identifiable")), "{behind}");
    }

    /// Markers are rigid and do not turn: a translation is enough for all but those few subsets whose test errs.
    #[test]
    fn the_simplest_shape_function_is_chosen_and_the_damping_holds() {
        let laboratory =
            Laboratory::with_experiment("half_height_px = 8", "half_height_px = 8\nshape = \"auto\"");
        let (choices, results) = decided(&laboratory);
        assert_eq!(choice(&choices, "shape function"), "auto");
        let methods = Table::read(&laboratory.path("results").join("tracks.parquet")).texts("method");
        let simplest = methods.iter().filter(|method| method.ends_with("-translation")).count();
        // The test errs in at most 4.5 % of some 70 subsets: 3.2 of them, and four standard deviations (1.8) more are 15 %.
        assert!(simplest as f64 > 0.85 * methods.len() as f64, "{simplest} of {}", methods.len());
        let number = |name: &str| results[name].as_f64().expect("a number");
        assert!((number("c_d_kg_per_s") - 0.003).abs() < 4.0 * number("c_d_sigma"), "{results}");
    }

    #[test]
    fn a_wall_that_is_not_stated_is_named_and_the_dampings_hold() {
        let held = "[far_end]\nkind = \"fixed\"\n";
        let laboratory = Laboratory::with_experiment("[striker]\n", &format!("{held}[striker]\n"));
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        let free = Laboratory::new();
        let mut command = chainwave();
        command.arg("run").arg(free.path("experiment.toml")).arg("--recordings").arg(&recordings);
        succeed(command.arg("--out").arg(&results));
        let text = fs::read_to_string(results.join("results.json")).expect("it was written");
        let found: Value = serde_json::from_str(&text).expect("it is JSON");
        for (name, truth) in [("c_d", 0.003), ("c_s", 0.2)] {
            let number = |key: String| found[&key].as_f64().expect("it is stated");
            let (value, sigma) = (number(format!("{name}_kg_per_s")), number(format!("{name}_sigma")));
            // Four standard uncertainties: once in 16 000.
            assert!((value - truth).abs() < 4.0 * sigma, "{name}: {value} +- {sigma}");
        }
        assert!(text.contains("far end"), "{text}");
    }

    #[test]
    fn bodies_that_differ_in_stiffness_are_told() {
        let laboratory =
            Laboratory::with_experiment("trigger_jitter_s", "stiffness_scatter = 0.01\ntrigger_jitter_s");
        let (choices, _) = decided(&laboratory);
        assert!(choice(&choices, "differences between bodies").starts_with("bodies differ"), "{choices:?}");
        // The model of equal bodies does not explain the tracks, and the decision says so.
        let model = choice(&choices, "whether the chain model explains the tracks");
        assert_ne!(model, "as the experiment states it", "{choices:?}");
    }
}
