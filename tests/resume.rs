//! A run that was killed goes on where it was, and ends with the bytes of one that was not.

mod slow {
    use std::collections::BTreeMap;
    use std::fs;
    use std::path::{Path, PathBuf};
    use std::process::{Command, Stdio};
    use std::thread::sleep;
    use std::time::{Duration, Instant, SystemTime};

    use crate::support::command::succeed;
    use crate::support::folder::{assert_same, times_of};
    use crate::support::laboratory::{Laboratory, N_RECORDINGS, evaluation};

    #[test]
    fn an_interrupted_run_goes_on_where_it_stopped() {
        let laboratory = Laboratory::new();
        let recordings = laboratory.film();
        let (results, uninterrupted) = (laboratory.path("results"), laboratory.path("uninterrupted"));
        let kept = results.join(".work");
        let done =
            killed(evaluation(&recordings, &results).args(["--jobs", "1"]), &results, &kept, "parquet");

        succeed(&mut evaluation(&recordings, &results));
        let after = times_of(&kept, "parquet");
        assert_eq!(after.len(), N_RECORDINGS);
        for (path, time) in &done {
            assert_eq!(after.get(path), Some(time), "{} was tracked again", path.display());
        }
        succeed(&mut evaluation(&recordings, &uninterrupted));
        assert_same(&results, &uninterrupted);
    }

    #[test]
    fn a_finished_run_tracks_nothing_again() {
        let laboratory = Laboratory::new();
        let (results, _) = laboratory.evaluate();
        let tracked = times_of(&results.join(".work"), "parquet");
        succeed(&mut evaluation(&laboratory.path("recordings"), &results));
        assert_eq!(times_of(&results.join(".work"), "parquet"), tracked);
    }

    #[test]
    fn an_interrupted_filming_leaves_no_torn_recording() {
        let laboratory = Laboratory::new();
        let (recordings, uninterrupted) = (laboratory.path("recordings"), laboratory.path("uninterrupted"));
        let done =
            killed(laboratory.filming(&recordings).args(["--jobs", "1"]), &recordings, &recordings, "cine");

        succeed(&mut laboratory.filming(&uninterrupted));
        for path in done.keys() {
            let whole = uninterrupted.join(path.file_name().expect("a recording has a name"));
            let read = |path: &Path| fs::read(path).expect("the recording can be read");
            assert!(read(path) == read(&whole), "{} is torn", path.display());
        }
        succeed(&mut laboratory.filming(&recordings));
        assert_same(&recordings, &uninterrupted);
        let after = times_of(&recordings, "cine");
        for (path, time) in &done {
            assert_eq!(after.get(path), Some(time), "{} was filmed again", path.display());
        }
    }

    /// Starts a command and kills it (SIGKILL) as soon as `folder`, which is `out` or lies in it, holds a file of this ending;
    /// returns those it left behind, at least one and not all.
    fn killed(
        command: &mut Command,
        out: &Path,
        folder: &Path,
        ending: &str,
    ) -> BTreeMap<PathBuf, SystemTime> {
        // On a busy machine this process may sleep while the other finishes: then it is started over.
        for _attempt in 0..5 {
            let mut child =
                command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("chainwave starts");
            let start = Instant::now();
            while times_of(folder, ending).is_empty() {
                assert!(start.elapsed() < Duration::from_secs(60), "nothing was done in a minute");
                // One recording takes tens of milliseconds, all of them half a second.
                sleep(Duration::from_millis(1));
            }
            child.kill().expect("the command can be killed");
            child.wait().expect("the command has ended");
            let done = times_of(folder, ending);
            if done.len() < N_RECORDINGS {
                return done;
            }
            fs::remove_dir_all(out).expect("the folder can be removed");
        }
        panic!("it was killed too late to tell anything, five times");
    }
}
