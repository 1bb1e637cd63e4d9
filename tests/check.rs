//! `chainwave check`: whether a run makes sense, told before it, for people and for programs.

mod slow {
    use std::fs;

    use serde_json::Value;

    use crate::command::{chainwave, succeed};
    use crate::laboratory::Laboratory;

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

        lost.iter().skip(1).for_each(|path| fs::remove_file(path).expect("it can be removed"));
        let (code, found) = checked(&laboratory);
        assert_eq!((code, &found["can_run"]), (Some(2), &Value::Bool(false)), "{found}");
        assert!(found["error"].as_str().is_some_and(|error| error.contains(".cine")), "{found}");
    }
}
