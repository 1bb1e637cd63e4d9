//! The pipeline of the paper, made quick: every figure and number that it promises is there.

mod slow {
    use std::collections::BTreeMap;
    use std::fs;
    use std::os::unix::process::CommandExt;
    use std::path::{Path, PathBuf};
    use std::process::{Command, Output, Stdio};
    use std::thread::sleep;
    use std::time::{Duration, Instant, SystemTime};

    use tempfile::TempDir;

    use crate::support::command::chainwave;
    use crate::support::folder::times_of;
    use crate::support::repository::root;
    use crate::support::table::Table;

    const FIGURES: [&str; 8] = [
        "contact-curve",
        "group-velocity",
        "long-chain",
        "peak-energy",
        "right-halves",
        "strain-map",
        "strain-profiles",
        "tail-spectrum",
    ];

    fn start(out: &Path) -> Output {
        let mut script = Command::new(root().join("pipelines/paper/run.sh"));
        script.arg(out).arg("--quick").env("CHAINWAVE_COMMAND", chainwave().get_program());
        script.output().expect("the script starts")
    }

    /// Starts the script and kills it with all that it started as soon as something is tracked; returns what was filmed and tracked then.
    fn killed(out: &Path) -> [BTreeMap<PathBuf, SystemTime>; 2] {
        let mut script = Command::new(root().join("pipelines/paper/run.sh"));
        script.arg(out).arg("--quick").env("CHAINWAVE_COMMAND", chainwave().get_program());
        let mut script =
            script.process_group(0).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
        let kept = out.join("results/striker-2.73-m-per-s/.work");
        let start = Instant::now();
        while times_of(&kept, "parquet").is_empty() {
            assert!(start.elapsed() < Duration::from_secs(400), "nothing was tracked");
            sleep(Duration::from_millis(20));
        }
        // The process group has the script's own number.
        let group = format!("-{}", script.id());
        let is_killed = Command::new("kill").args(["-KILL", "--", &group]).status();
        assert!(is_killed.expect("kill starts").success());
        script.wait().expect("it has ended");
        [times_of(&out.join("recordings"), "cine"), times_of(&kept, "parquet")]
    }

    #[test]
    fn the_whole_paper_is_made_by_a_start_after_one_that_was_killed() {
        let folder = TempDir::new().expect("a temporary folder can be made");
        let out = folder.path().join("paper");
        let [filmed_before, tracked_before] = killed(&out);
        assert!(!out.join("paper").exists());
        let first = start(&out);
        let said = String::from_utf8_lossy(&first.stderr);
        assert!(first.status.success(), "{said}");
        for name in FIGURES {
            for ending in ["svg", "png", "cbor"] {
                let file = out.join("paper").join(format!("{name}.{ending}"));
                assert!(file.is_file(), "{} is missing", file.display());
            }
        }
        let comparison = Table::read(&out.join("paper/comparison.csv"));
        let quantities = comparison.texts("quantity");
        for quantity in ["group velocity", "growth of the front's half width", "drop that damping adds"] {
            assert!(quantities.iter().any(|found| found == quantity), "{quantity} in {quantities:?}");
        }
        // What all agree on: the faster the strike, the slower the wave.
        let speeds = comparison.texts("source").into_iter().zip(comparison.full("value")).zip(&quantities);
        let speed_of = |source: &str| {
            let mut found = speeds.clone().filter(|(_, quantity)| *quantity == "group velocity");
            let found = found.find(|((name, _), _)| name.starts_with(source));
            found.unwrap_or_else(|| panic!("{source} in comparison.csv")).0.1
        };
        for source in ["experiment", "rings", "chain model"] {
            let [fast, slow] =
                ["2.73", "0.83"].map(|strike| speed_of(&format!("{source}, struck at {strike}")));
            assert!(fast < slow, "{source}: {fast} m/s at 2.73 m/s, {slow} m/s at 0.83 m/s");
        }
        let page = fs::read_to_string(out.join("paper/comparison.md")).expect("there is a page");
        assert!(page.contains("76.8 %") && page.contains("19.3 %"), "{page}");

        let filmed = times_of(&out.join("recordings"), "cine");
        assert_eq!(filmed, filmed_before, "nothing is filmed again");
        assert_eq!(filmed.len(), 36);
        let tracked = times_of(&out.join("results/striker-2.73-m-per-s/.work"), "parquet");
        for (path, time) in &tracked_before {
            assert_eq!(tracked.get(path), Some(time), "{} was tracked again", path.display());
        }
        let states = fs::read_to_string(out.join("results/recordings.csv")).expect("there is a list");
        assert_eq!(states.lines().filter(|line| line.contains(",used,")).count(), 36, "{states}");
    }
}
