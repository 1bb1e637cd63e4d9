//! Results are never torn: runs that are killed at any moment, whose disk is full at any write, or that go into one folder side by side.

mod slow {
    use std::fs;
    use std::path::{Path, PathBuf};
    use std::process::{Command, Stdio};
    use std::thread::sleep;
    use std::time::{Duration, Instant};

    use crate::support::command::{fail, succeed};
    use crate::support::folder::{assert_same, files};
    use crate::support::laboratory::{Laboratory, evaluation};

    /// Moments at which a run is killed here; `CHAINWAVE_KILLS` asks for more.
    const KILLS: u64 = 10;
    /// Writes that fail here; `CHAINWAVE_WRITES` asks for more.
    const WRITES: u64 = 12;

    /// A number that the environment asks for, else the usual one.
    fn asked(variable: &str, usual: u64) -> u64 {
        std::env::var(variable).ok().and_then(|n| n.parse().ok()).unwrap_or(usual)
    }

    #[test]
    fn a_run_that_is_killed_at_any_moment_leaves_nothing_torn() {
        let laboratory = Laboratory::new();
        let recordings = laboratory.film();
        let undisturbed = laboratory.path("undisturbed");
        let start = Instant::now();
        succeed(&mut evaluation(&recordings, &undisturbed));
        let whole = start.elapsed();
        let kills = asked("CHAINWAVE_KILLS", KILLS);
        let results = laboratory.path("results");
        for k in 0..kills {
            // Moments spread evenly over a run by the golden ratio, every second one over a run that begins from nothing.
            let share = (0.5 + 0.618_033_988_749_895 * k as f64).fract();
            if k % 2 == 0 && results.exists() {
                fs::remove_dir_all(&results).expect("the folder can be removed");
            }
            let mut child = evaluation(&recordings, &results)
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .expect("chainwave starts");
            sleep(whole.mul_f64(share));
            child.kill().expect("the command can be killed");
            child.wait().expect("the command has ended");
        }
        succeed(&mut evaluation(&recordings, &results));
        assert_same(&results, &undisturbed);
    }

    #[test]
    fn runs_side_by_side_into_one_folder_end_as_one_alone() {
        let laboratory = Laboratory::new();
        let recordings = laboratory.film();
        let [results, alone] = ["results", "alone"].map(|name| laboratory.path(name));
        succeed(&mut evaluation(&recordings, &alone));
        let start = || {
            let mut command = evaluation(&recordings, &results);
            command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("chainwave starts")
        };
        for child in [start(), start()] {
            let output = child.wait_with_output().expect("the command has ended");
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        }
        assert_same(&results, &alone);
    }

    #[test]
    fn kept_tracks_that_are_torn_are_made_anew_with_a_note() {
        let laboratory = Laboratory::new();
        let (results, _) = laboratory.evaluate();
        let untouched = laboratory.path("untouched");
        copy(&results, &untouched);
        let kept = kept_tables(&results);
        let bytes = fs::read(&kept[0]).expect("a kept table can be read");
        fs::write(&kept[0], &bytes[..bytes.len() / 2]).expect("a kept table can be cut");
        fs::write(&kept[1], vec![0; bytes.len()]).expect("a kept table can be zeroed");
        fs::remove_file(kept[2].with_extension("toml")).expect("a sidecar can be removed");
        let swapped =
            [fs::read(&kept[3]), fs::read(&kept[4])].map(|bytes| bytes.expect("a kept table can be read"));
        fs::write(&kept[3], &swapped[1]).expect("tables can be swapped");
        fs::write(&kept[4], &swapped[0]).expect("tables can be swapped");
        let said = succeed(&mut evaluation(&laboratory.path("recordings"), &results));
        assert_eq!(said.matches("tracked anew, as what was kept is torn").count(), 5, "{said}");
        assert_same(&results, &untouched);
    }

    #[test]
    fn what_is_kept_and_why_not_is_explained() {
        let laboratory = Laboratory::new();
        let (results, _) = laboratory.evaluate();
        let recordings = laboratory.path("recordings");
        let explained = || succeed(evaluation(&recordings, &results).arg("--explain"));
        assert!(explained().contains("tracks: 15 of 15 recordings kept"));
        let plan = recordings.join("experiment.toml");
        let text = fs::read_to_string(&plan).expect("the plan can be read");
        let changed = |from: &str, to: &str| {
            assert_eq!(text.matches(from).count(), 1, "expected once: {from}");
            fs::write(&plan, text.replace(from, to)).expect("the plan can be written");
        };
        // Another mass changes what follows from the tracks, and not the tracks.
        changed("mass_kg = 0.000455", "mass_kg = 0.000456");
        assert!(explained().contains("tracks: 15 of 15 recordings kept"));
        changed("half_width_px = 8", "half_width_px = 7");
        let told = explained();
        assert!(
            told.contains("tracks: 0 of 15 recordings kept") && told.contains("differs in subsets"),
            "{told}"
        );
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_disk_that_fails_at_any_write_loses_nothing() {
        let laboratory = Laboratory::new();
        let (results, _) = laboratory.evaluate();
        let Some(shim) = failing_disk(&laboratory) else { return };
        let untouched = laboratory.path("untouched");
        copy(&results, &untouched);
        let recordings = laboratory.path("recordings");
        let with = |n: u64, error: &str, out: &Path| {
            let mut command = evaluation(&recordings, out);
            command
                .arg("--jobs")
                .arg("1")
                .env("LD_PRELOAD", &shim)
                .env("FAIL_AT", n.to_string())
                .env("FAIL_WITH", error);
            command
        };
        // One table is tracked anew each time, so that kept tables are among what is written.
        let lose_one = || fs::remove_file(&kept_tables(&results)[0]).expect("a kept table can be removed");
        lose_one();
        let counted = with(0, "28", &results).output().expect("chainwave starts");
        let n_writes: u64 = String::from_utf8_lossy(&counted.stderr)
            .lines()
            .find_map(|line| line.strip_prefix("writes: ")?.trim().parse().ok())
            .expect("the shim counts");
        // A table and its sidecar, fifteen tables and pages of the results, nine figures: each is at least one.
        assert!(n_writes >= 20, "{n_writes} writes");
        // Write calls spread evenly over the run.
        let step = (n_writes / asked("CHAINWAVE_WRITES", WRITES)).max(1);
        for (k, n) in (1..=n_writes).step_by(usize::try_from(step).expect("a step")).enumerate() {
            lose_one();
            let error = if k % 2 == 0 { "28" } else { "5" };
            let said = fail(&mut with(n, error, &results), 2);
            assert!(said.contains("cannot") || said.contains("os error"), "write {n}: {said}");
            // Whatever is there is whole: of this run, or of the one before, which had the same inputs.
            for file in files(&results).iter().filter(|file| !is_unfinished(file)) {
                let [found, expected] = [&results, &untouched].map(|folder| fs::read(folder.join(file)));
                assert!(
                    found.expect("a file can be read") == expected.expect("it was there"),
                    "write {n}: {}",
                    file.display()
                );
            }
        }
        succeed(&mut evaluation(&recordings, &results));
        assert_same(&results, &untouched);
    }

    fn is_unfinished(file: &Path) -> bool {
        file.to_string_lossy().ends_with(".unfinished")
    }

    /// A library that stands before the system's: the n-th write to a regular file fails. `None`, said, where it cannot be built.
    #[cfg(target_os = "linux")]
    fn failing_disk(laboratory: &Laboratory) -> Option<PathBuf> {
        const SOURCE: &str = include_str!("failing_disk.c");
        let (source, shim) = (laboratory.write("failing_disk.c", SOURCE), laboratory.path("failing_disk.so"));
        let built = Command::new("cc")
            .args(["-shared", "-fPIC", "-O1", "-o"])
            .arg(&shim)
            .arg(&source)
            .arg("-ldl")
            .status();
        if built.is_ok_and(|status| status.success()) {
            return Some(shim);
        }
        chainwave_testkit::skip("no C compiler builds the disk that fails");
        None
    }

    fn kept_tables(results: &Path) -> Vec<PathBuf> {
        let kept = results.join(".work");
        let of_parquet = |file: PathBuf| {
            file.extension().is_some_and(|ending| ending == "parquet").then(|| kept.join(file))
        };
        files(&kept).into_iter().filter_map(of_parquet).collect()
    }

    fn copy(from: &Path, to: &Path) {
        for file in files(from) {
            let there = to.join(&file);
            fs::create_dir_all(there.parent().expect("a file lies in a folder"))
                .expect("a folder can be made");
            fs::copy(from.join(&file), there).expect("a file can be copied");
        }
    }

    #[test]
    #[cfg(unix)]
    fn control_c_ends_the_recording_in_hand_and_says_how_to_go_on() {
        let laboratory = Laboratory::new();
        let recordings = laboratory.film();
        let results = laboratory.path("results");
        let mut command = evaluation(&recordings, &results);
        command.args(["--jobs", "1"]).stdout(Stdio::null()).stderr(Stdio::piped());
        // On a busy machine this process may sleep while the other finishes: then it is started over.
        for _attempt in 0..5 {
            let child = command.spawn().expect("chainwave starts");
            let start = Instant::now();
            while !results.join(".work").exists() || kept_tables(&results).is_empty() {
                assert!(start.elapsed() < Duration::from_secs(60), "nothing was done in a minute");
                sleep(Duration::from_millis(1));
            }
            let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
            assert!(sent.is_ok_and(|status| status.success()), "a signal can be sent");
            let output = child.wait_with_output().expect("the command has ended");
            if output.status.success() {
                fs::remove_dir_all(&results).expect("the folder can be removed");
                continue;
            }
            let said = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(130), "{said}");
            assert!(said.contains("the same command goes on"), "{said}");
            let undisturbed = laboratory.path("undisturbed");
            succeed(&mut evaluation(&recordings, &results));
            succeed(&mut evaluation(&recordings, &undisturbed));
            assert_same(&results, &undisturbed);
            return;
        }
        panic!("it was stopped too late to tell anything, five times");
    }
}
