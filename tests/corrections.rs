//! Corrections of readings: made in the page or by hand, read by `run`, named in its results, and undone when they go.

mod slow {
    use std::fs;
    use std::path::Path;

    use serde_json::Value;
    use sha2::{Digest, Sha256};

    use crate::support::command::{chainwave, fail, succeed};
    use crate::support::folder::times_of;
    use crate::support::laboratory::{Laboratory, N_RECORDINGS, evaluation};
    use crate::support::table::Table;

    /// Files that tell whether results are the same.
    const TELLING: [&str; 4] = ["tracks.parquet", "motion.parquet", "results.json", "provenance.toml"];

    fn read(results: &Path) -> Vec<Vec<u8>> {
        TELLING.map(|name| fs::read(results.join(name)).expect("run wrote it")).into()
    }

    #[test]
    fn what_is_corrected_counts_is_named_and_comes_back() {
        let laboratory = Laboratory::new();
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        succeed(&mut evaluation(&recordings, &results));
        let before = read(&results);
        let kept = times_of(&results.join(".work"), "parquet");
        assert_eq!(kept.len(), N_RECORDINGS);

        // Body 2 of the first recording rests at x = 30 + 75 px; a seed that is 2 px off finds it again.
        let rows = "recording,body,first_frame,last_frame,action,x_px,y_px,note\n\
                    view1_trial2.cine,3,100,109,exclude,,,a hand\n\
                    view2_trial1.cine,,200,,exclude,,,\n\
                    view1_trial1.cine,2,5,9,seed,107,22,\n";
        let path = recordings.join("corrections.csv");
        fs::write(&path, rows).expect("the folder takes a file");
        succeed(&mut evaluation(&recordings, &results));

        let tracks = Table::read(&results.join("tracks.parquet"));
        let (of, names) = (tracks.texts("recording"), tracks.texts("name"));
        let (frames, statuses) = (tracks.full("frame"), tracks.texts("status"));
        let mut n_excluded = 0;
        for row in 0..tracks.n_rows() {
            let is_meant = (of[row] == "view1_trial2.cine"
                && names[row] == "3"
                && (100.0..110.0).contains(&frames[row]))
                || (of[row] == "view2_trial1.cine" && frames[row] >= 200.0);
            assert_eq!(statuses[row] == "excluded", is_meant, "{} {} {}", of[row], names[row], frames[row]);
            n_excluded += usize::from(is_meant);
        }
        let sha256: String =
            Sha256::digest(rows.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect();
        let provenance = fs::read_to_string(results.join("provenance.toml")).expect("run wrote it");
        let provenance: toml::Table = provenance.parse().expect("it is TOML");
        assert_eq!(provenance["corrections"]["sha256"].as_str(), Some(sha256.as_str()));
        assert_eq!(provenance["corrections"]["file"].as_str(), Some("corrections.csv"));
        let text = provenance["corrections"]["text"].as_str().expect("the corrections in full");
        assert_eq!(text.lines().count(), rows.lines().count());
        let found = fs::read_to_string(results.join("results.json")).expect("run wrote it");
        let found: Value = serde_json::from_str(&found).expect("it is JSON");
        let warning =
            found["warnings"].as_array().and_then(|all| all.iter().find(|one| one["code"] == "corrections"));
        let text = warning.expect("corrections are named")["text"].to_string();
        assert!(text.contains(&format!("{n_excluded} readings")) && text.contains("1 places"), "{text}");

        // Only the recording with a seed was tracked again.
        let after = times_of(&results.join(".work"), "parquet");
        assert_eq!(after.len(), N_RECORDINGS + 1);
        assert!(kept.iter().all(|(path, time)| after.get(path) == Some(time)));

        fs::remove_file(&path).expect("the file can be removed");
        succeed(&mut evaluation(&recordings, &results));
        assert!(read(&results) == before, "without corrections the results are what they were");

        fs::write(
            &path,
            "recording,body,first_frame,last_frame,action,x_px,y_px\nother.cine,1,1,2,exclude,,\n",
        )
        .expect("the folder takes a file");
        let message = fail(&mut evaluation(&recordings, &results), 2);
        assert!(message.contains("line 2, column recording") && message.contains("other.cine"), "{message}");
    }

    #[test]
    fn the_queue_is_a_table_and_an_object() {
        let laboratory = Laboratory::new();
        let (results, _) = laboratory.evaluate();
        let out = laboratory.path("queue.csv");
        let said = succeed(
            chainwave().arg("review").arg(&results).args(["--most", "30", "--json", "--out"]).arg(&out),
        );
        let said: Value = serde_json::from_str(&said).expect("it is JSON");
        let queue = said["queue"].as_array().expect("a list");
        assert_eq!(queue.len(), 30);
        let table = Table::read(&out);
        assert_eq!((table.n_rows(), table.names()[4].as_str()), (30, "doubt"));
        let doubts = table.full("doubt");
        assert!(doubts.windows(2).all(|pair| pair[0] >= pair[1]), "{doubts:?}");
        assert_eq!(queue[0]["doubt"].as_f64(), Some(doubts[0]));
        let text = succeed(chainwave().arg("review").arg(&results));
        assert!(text.contains("most doubtful first"), "{text}");
        fail(chainwave().arg("review").arg(laboratory.path("recordings")), 2);
    }

    #[test]
    fn quiet_and_json_change_no_result() {
        let laboratory = Laboratory::new();
        let recordings = laboratory.film();
        let [spoken, silent] = ["spoken", "silent"].map(|name| laboratory.path(name));
        succeed(&mut evaluation(&recordings, &spoken));
        let said = succeed(evaluation(&recordings, &silent).args(["--quiet", "--json"]));
        crate::support::folder::assert_same(&spoken, &silent);
        let said: Value = serde_json::from_str(&said).expect("standard output is one object");
        assert_eq!(said["failed"], serde_json::json!([]));
        assert_eq!(said["recordings"].as_array().map(Vec::len), Some(N_RECORDINGS));
        assert!(said["results"][0]["results"]["group_velocity_m_per_s"].is_f64(), "{said}");

        let gone = laboratory.path("gone.cine");
        for command in ["inspect", "tradeoff", "check", "plan"] {
            let mut asked = chainwave();
            asked.arg(command).arg(&gone).args(["--json", "--quiet"]);
            if command == "tradeoff" {
                asked.arg("--out").arg(laboratory.path("out"));
            }
            let output = asked.output().expect("chainwave starts");
            assert_eq!(output.status.code(), Some(2), "{command}");
            let found: Value = serde_json::from_slice(&output.stdout).expect("standard output is JSON");
            let names_it = |text: &Value| text.as_str().is_some_and(|text| text.contains("gone"));
            let failed = found["failed"].as_array().into_iter().flatten();
            assert!(failed.chain([&found["error"]]).any(names_it), "{command}: {found}");
            assert!(!output.stderr.is_empty(), "{command}: errors are said all the same");
        }
    }
}
