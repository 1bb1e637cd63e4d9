//! Mistakes in an experiment's numbers are told in the user's terms, before or beside the results, and none ends what can be done.

mod slow {
    use std::fs;
    use std::path::PathBuf;

    use serde_json::Value;

    use crate::support::command::{chainwave, fail};
    use crate::support::laboratory::{Laboratory, evaluation};

    /// The small experiment as it was filmed, whose plan then is mistaken.
    struct Mistaken {
        laboratory: Laboratory,
        recordings: PathBuf,
        plan: String,
        trials: String,
    }

    /// What became of a run.
    struct Found {
        code: Option<i32>,
        printed: String,
        said: String,
        /// `results.json`, where it was written.
        results: Option<Value>,
    }

    impl Mistaken {
        fn filmed() -> Self {
            let laboratory = Laboratory::new();
            let recordings = laboratory.film();
            let read = |name: &str| fs::read_to_string(recordings.join(name)).expect("it was written");
            let (plan, trials) = (read("experiment.toml"), read("trials.csv"));
            Self { laboratory, recordings, plan, trials }
        }

        /// Runs with another text in one place of the plan.
        fn planned(&self, from: &str, to: &str) -> Found {
            assert_eq!(self.plan.matches(from).count(), 1, "expected once: {from} in {}", self.plan);
            self.run(&self.plan.replace(from, to), &self.trials)
        }

        /// Checks with another text in one place of the plan: what is said before a run, which would look long for a model of bodies that are others.
        fn checked(&self, from: &str, to: &str) -> String {
            assert_eq!(self.plan.matches(from).count(), 1, "expected once: {from} in {}", self.plan);
            let plan = self.recordings.join("experiment.toml");
            fs::write(&plan, self.plan.replace(from, to)).expect("the plan can be written");
            let output = chainwave().arg("check").arg(plan).arg("--json").output().expect("chainwave starts");
            assert_eq!(output.status.code(), Some(1), "there are warnings");
            String::from_utf8(output.stdout).expect("chainwave prints text")
        }

        /// Runs with other places of the stage.
        fn staged(&self, other_m: impl Fn(f64) -> f64) -> Found {
            let row = |line: &str| {
                let (before, stage_m) = line.rsplit_once(',').expect("a row has cells");
                stage_m
                    .parse()
                    .map_or(line.to_owned(), |stage_m: f64| format!("{before},{}", other_m(stage_m)))
            };
            let rows: Vec<String> = self.trials.lines().map(row).collect();
            self.run(&self.plan, &format!("{}\n", rows.join("\n")))
        }

        fn run(&self, plan: &str, trials: &str) -> Found {
            let results = self.laboratory.path("results");
            if results.exists() {
                fs::remove_dir_all(&results).expect("the folder can be removed");
            }
            fs::write(self.recordings.join("experiment.toml"), plan).expect("the plan can be written");
            fs::write(self.recordings.join("trials.csv"), trials).expect("the trials can be written");
            let output = evaluation(&self.recordings, &results).output().expect("chainwave starts");
            let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
            let written = fs::read_to_string(results.join("results.json")).ok();
            Found {
                code: output.status.code(),
                printed: text(&output.stdout),
                said: text(&output.stderr),
                results: written.map(|text| serde_json::from_str(&text).expect("it is JSON")),
            }
        }
    }

    impl Found {
        fn warnings(&self) -> String {
            self.results.as_ref().expect("results were written")["warnings"].to_string()
        }

        /// Asserts that the results warn in these words, and that a program can tell that some inputs failed, or that none did.
        fn assert_warns(&self, code: i32, words: &[&str]) {
            assert_eq!(self.code, Some(code), "{} {}", self.said, self.printed);
            let warnings = self.warnings();
            for word in words {
                assert!(warnings.contains(word), "expected {word}: {warnings}");
                assert!(self.printed.contains(word), "expected {word}: {}", self.printed);
            }
        }
    }

    #[test]
    fn numbers_that_cannot_be_meant_are_named() {
        let mistaken = Mistaken::filmed();
        let right = mistaken.run(&mistaken.plan, &mistaken.trials);
        assert_eq!((right.code, right.said.as_str()), (Some(0), ""), "nothing is wrong: {}", right.printed);
        assert_eq!(right.warnings(), "[]", "nothing is said of what is right");

        let in_mm = mistaken.planned("[camera]\nscale_px_per_m = 2500.0", "[camera]\nscale_px_per_m = 2.5");
        assert_eq!(in_mm.code, Some(2), "{}", in_mm.printed);
        assert!(
            in_mm.said.contains("camera.scale_px_per_m") && in_mm.said.contains("2500 px/m"),
            "{}",
            in_mm.said
        );
        let speed = in_mm.results.as_ref().map(|results| &results["group_velocity_m_per_s"]);
        assert!(speed.is_none_or(Value::is_null), "nothing is stated: {speed:?}");

        mistaken
            .planned("mass_kg = 0.000455", "mass_kg = 0.455")
            .assert_warns(0, &["chain.mass_kg and contact", "grams"]);
        mistaken.planned("mass_kg = 0.0043", "mass_kg = 4.3").assert_warns(0, &["striker.mass_kg", "grams"]);
    }

    #[test]
    fn a_scale_that_is_off_by_a_per_cent_is_told_by_the_stage_and_by_the_pitch() {
        let mistaken = Mistaken::filmed();
        let off = mistaken.planned("[camera]\nscale_px_per_m = 2500.0", "[camera]\nscale_px_per_m = 2525.0");
        // 2500 px/m, to some hundred-thousandths.
        off.assert_warns(
            0,
            &["the stage moved 0.9901", "a scale of 2500.0", "texture repeats itself every 75."],
        );
    }

    #[test]
    fn a_stage_in_other_units_or_of_the_other_sign_leaves_its_views_out_and_the_rest_is_done() {
        let mistaken = Mistaken::filmed();
        for (found, hint) in [
            (mistaken.staged(|stage_m| 1e3 * stage_m), "millimetres"),
            (mistaken.staged(|stage_m| -stage_m), "the other way"),
        ] {
            assert_eq!(found.code, Some(1), "{}", found.said);
            assert!(
                found.said.contains(hint) && found.said.contains("view2_trial1.cine"),
                "{hint}: {}",
                found.said
            );
            assert!(found.results.is_some(), "the first view is evaluated: {}", found.said);
        }
        let farther = mistaken.staged(|stage_m| if stage_m > 0.2 { stage_m + 0.03 } else { stage_m });
        farther.assert_warns(1, &["view3_trial1.cine", "view 3", "a pitch too far"]);
        let nowhere = mistaken.staged(|stage_m| stage_m + 50.0);
        assert_eq!(nowhere.code, Some(2), "{}", nowhere.said);
        assert!(nowhere.said.contains("expected bodies in at least one view"), "{}", nowhere.said);
    }

    #[test]
    fn bodies_that_are_not_where_they_are_looked_for_are_named() {
        let mistaken = Mistaken::filmed();
        let from = "first_body_px = [30.0, 23.5]";
        for (off, said) in [("[105.0, 23.5]", "before body 1"), ("[-45.0, 23.5]", "behind the last body")] {
            let found = mistaken.checked(from, &format!("first_body_px = {off}"));
            assert!(found.contains(said), "{found}");
        }
        let beside = mistaken.planned(from, "first_body_px = [58.0, 23.5]");
        assert_eq!(beside.code, Some(2), "{}", beside.printed);
        assert!(beside.said.contains("of 14, the first at (58.0, 23.5)"), "{}", beside.said);
        let half = mistaken.planned("pitch_m = 0.03\nmass_kg", "pitch_m = 0.04\nmass_kg");
        assert!(half.printed.contains("should lie on the speckle of markers"), "{}", half.printed);
    }

    #[test]
    fn motion_during_the_stated_rest_is_named_with_when_it_begins() {
        let mistaken = Mistaken::filmed();
        let found = mistaken.planned("rest_until_s = -0.00008", "rest_until_s = 0.0005");
        found.assert_warns(0, &["while the chain should rest", "before the rest ends at 0.500 ms"]);
    }

    #[test]
    fn places_that_are_left_open_are_named_by_their_lines() {
        let laboratory =
            Laboratory::with_trials("view1_trial3.cine,1,3,0.00", "view1_trial3.cine,1,3,FILL_IN");
        let message = fail(&mut evaluation(&laboratory.path(""), &laboratory.path("out")), 2);
        assert!(message.contains("trials.csv") && message.contains("FILL_IN in line 4"), "{message}");
    }
}
