//! One bad recording does not stop a batch: it is named, the rest is done, and the exit code is 1.

use std::fs;

use tempfile::TempDir;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::laboratory::{Laboratory, N_RECORDINGS, evaluation};
use crate::support::repository::root;
use crate::support::table::Table;

#[test]
fn good_recordings_are_tracked_beside_a_truncated_one() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let good = root().join("data-samples/hec-view1-trial1.cine");
    let [points, out, cut] = ["points.csv", "tracks.csv", "cut.cine"].map(|name| folder.path().join(name));
    fs::write(&cut, &fs::read(&good).expect("the sample can be read")[..10_000]).expect("it can be written");
    let text = "name,x_px,y_px,half_width_px,half_height_px\n1,25,19.5,11,11\n2,100,19.5,11,11\n";
    fs::write(&points, text).expect("the points can be written");
    let track = || {
        let mut command = chainwave();
        command.arg("track").arg("--points").arg(&points).arg("--out").arg(&out);
        command
    };

    let message = fail(track().arg(&cut), 2);
    assert!(message.contains("cut.cine"), "{message}");
    assert!(!out.exists(), "nothing could be done");

    let message = fail(track().args([&cut, &good]), 1);
    assert!(message.contains("cut.cine") && !message.contains("hec-view1-trial1"), "{message}");
    let tracks = Table::read(&out);
    assert_eq!(tracks.n_rows(), 2 * 120, "two points in every frame of the good recording");
    assert!(tracks.texts("recording").iter().all(|name| name.ends_with("hec-view1-trial1.cine")));
}

mod slow {
    use super::*;

    #[test]
    fn a_batch_goes_on_without_its_bad_recordings() {
        let laboratory = Laboratory::new();
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        let (truncated, missing) = ("view2_trial3.cine", "view3_trial1.cine");
        let path = recordings.join(truncated);
        let bytes = fs::read(&path).expect("it was filmed");
        fs::write(&path, &bytes[..bytes.len() / 2]).expect("it can be written");
        fs::remove_file(recordings.join(missing)).expect("it was filmed");

        let message = fail(&mut evaluation(&recordings, &results), 1);
        assert!(message.contains(truncated) && message.contains(missing), "{message}");
        assert_eq!(message.matches(".cine").count(), 2, "the others are well: {message}");
        assert_eq!(message.matches("--partial").count(), 1, "it helps the one that was cut short: {message}");
        let mut tracked = Table::read(&results.join("tracks.parquet")).texts("recording");
        tracked.dedup();
        assert_eq!(tracked.len(), N_RECORDINGS - 2);
        assert!(!tracked.iter().any(|name| name == truncated || name == missing), "{tracked:?}");
        assert!(results.join("report.html").exists(), "the rest is done");
    }

    #[test]
    fn tracks_that_cannot_be_evaluated_are_written_with_the_reason() {
        // Seven frames: enough to track, too few for a local polynomial.
        let laboratory = Laboratory::with_experiment(
            "first_image = -40\nn_frames = 330",
            "first_image = -5\nn_frames = 7",
        );
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        fs::create_dir(&results).expect("a folder can be made");
        fs::write(results.join("strain.parquet"), "of an earlier run").expect("a file can be written");
        let message = fail(&mut evaluation(&recordings, &results), 1);
        assert!(message.contains("at least 8 sample times"), "{message}");
        assert_eq!(
            Table::read(&results.join("tracks.parquet")).n_rows(),
            7 * 5 * 14,
            "5 trials, 14 bodies in views"
        );
        let text = fs::read_to_string(results.join("results.json")).expect("it was written");
        assert!(
            text.contains("could not be evaluated") && text.contains("at least 8 sample times"),
            "{text}"
        );
        assert!(
            !results.join("strain.parquet").exists(),
            "nothing of an earlier run is taken for this one's"
        );
    }

    #[test]
    fn a_body_that_is_not_found_at_rest_is_left_out_of_its_recording() {
        let laboratory = Laboratory::with_appended(
            r#"
[[synthetic.faults]]
kind = "covered_body"
recording = "view2_trial3.cine"
body = 6
from_s = -0.01
until_s = 0.0
"#,
        );
        let results = laboratory.path("results");
        let printed = succeed(&mut evaluation(&laboratory.film(), &results));
        assert!(printed.contains("view2_trial3.cine: body 6 is left out"), "{printed}");
        let motion = Table::read(&results.join("motion.parquet"));
        let (bodies, n_trials) = (motion.full("body"), motion.full("n_trials"));
        let most = |body: f64| {
            let of_body = bodies.iter().zip(&n_trials).filter(|(other, _)| (**other - body).abs() < 0.5);
            of_body.map(|(_, n)| *n).fold(0.0, f64::max)
        };
        assert!(
            (most(6.0) - 4.0).abs() < 0.5 && (most(7.0) - 5.0).abs() < 0.5,
            "{} {}",
            most(6.0),
            most(7.0)
        );
    }
}
