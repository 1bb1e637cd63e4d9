//! `chainwave check`: whether a run makes sense, told before it, for people and for programs.

mod slow {
    use std::fs;

    use serde_json::Value;

    use crate::support::command::{chainwave, succeed};
    use crate::support::laboratory::Laboratory;

    fn checked(laboratory: &Laboratory) -> (Option<i32>, Value) {
        let experiment = laboratory.path("recordings/experiment.toml");
        let output =
            chainwave().arg("check").arg(experiment).arg("--json").output().expect("chainwave starts");
        let found = serde_json::from_slice(&output.stdout).expect("it is JSON");
        (output.status.code(), found)
    }

    fn states(found: &Value, state: &str) -> usize {
        let recordings = found["recordings"].as_array().expect("a list");
        recordings.iter().filter(|one| one["state"] == state).count()
    }

    #[test]
    fn a_sound_experiment_one_with_warnings_and_one_that_cannot_run() {
        let laboratory = Laboratory::new();
        let recordings = laboratory.film();
        let said = succeed(chainwave().arg("check").arg(recordings.join("experiment.toml")));
        assert!(said.contains("15 of 15 recordings can be used; a run makes sense"), "{said}");
        let (code, found) = checked(&laboratory);
        assert_eq!(
            (code, states(&found, "used"), &found["can_run"]),
            (Some(0), 15, &Value::Bool(true)),
            "{found}"
        );

        let lost = fs::read_dir(&recordings).expect("it can be listed").filter_map(Result::ok);
        let mut lost: Vec<_> = lost
            .map(|entry| entry.path())
            .filter(|path| path.extension().is_some_and(|end| end == "cine"))
            .collect();
        lost.sort();
        fs::remove_file(&lost[0]).expect("it can be removed");
        let (code, found) = checked(&laboratory);
        assert_eq!((code, states(&found, "used"), states(&found, "failed")), (Some(1), 14, 1), "{found}");
        let warning = &found["warnings"][0];
        assert_eq!(warning["code"], "unreadable", "{found}");
        assert!(warning["subject"].as_str().is_some_and(|name| lost[0].ends_with(name)), "{found}");

        // A stage in millimetres leaves two of the views out.
        let trials = fs::read_to_string(recordings.join("trials.csv")).expect("it was written");
        let in_mm = trials.replace(",0.12\n", ",120\n").replace(",0.24\n", ",240\n");
        assert_ne!(trials, in_mm);
        fs::write(recordings.join("trials.csv"), in_mm).expect("it can be written");
        let (code, found) = checked(&laboratory);
        assert_eq!((code, states(&found, "left_out")), (Some(1), 10), "{found}");
        let said = found["warnings"].to_string();
        assert!(said.contains("left_out") && said.contains("millimetres"), "{found}");
        fs::write(recordings.join("trials.csv"), trials).expect("it can be written");

        // A striker's velocity in millimetres a second, and in kilometres.
        let plan = fs::read_to_string(recordings.join("experiment.toml")).expect("it was written");
        for other in ["velocity_m_per_s = 2730.0", "velocity_m_per_s = 0.00273"] {
            let mistaken = plan.replace("velocity_m_per_s = 2.73", other);
            assert_ne!(plan, mistaken);
            fs::write(recordings.join("experiment.toml"), mistaken).expect("it can be written");
            let (code, found) = checked(&laboratory);
            let said = found["warnings"].to_string();
            assert!(code == Some(1) && said.contains("striker.velocity_m_per_s"), "{found}");
        }
        // A rest that ends after the strike.
        let late = plan.replace("rest_until_s = -0.00008", "rest_until_s = 0.0005");
        assert_ne!(plan, late);
        fs::write(recordings.join("experiment.toml"), late).expect("it can be written");
        let (code, found) = checked(&laboratory);
        let said = found["warnings"].to_string();
        assert!(code == Some(1) && said.contains("while the chain should rest"), "{found}");
        // The same in milliseconds, which is after the end of the film.
        let in_ms = plan.replace("rest_until_s = -0.00008", "rest_until_s = 0.5");
        fs::write(recordings.join("experiment.toml"), in_ms).expect("it can be written");
        let (code, found) = checked(&laboratory);
        let said = found["error"].to_string();
        assert!(
            code == Some(2)
                && said.contains("tracking.rest_until_s")
                && said.contains("0.0005 if it is in ms"),
            "{found}"
        );
        fs::write(recordings.join("experiment.toml"), plan).expect("it can be written");

        lost.iter().skip(1).for_each(|path| fs::remove_file(path).expect("it can be removed"));
        let (code, found) = checked(&laboratory);
        assert_eq!((code, &found["can_run"]), (Some(2), &Value::Bool(false)), "{found}");
        let error = found["error"].as_str().expect("a text");
        assert_eq!(error.matches(".cine").count(), 15, "each that is missing is named: {error}");
    }
}
