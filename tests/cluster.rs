//! Shares of an experiment, tracked side by side as a cluster's tasks would, and evaluated together.

mod slow {
    use std::env;
    use std::fs;
    use std::os::unix::fs::{PermissionsExt, symlink};
    use std::process::{Child, Command, Stdio};

    use crate::support::command::{chainwave, succeed};
    use crate::support::folder::{assert_same, times_of};
    use crate::support::laboratory::{Laboratory, N_RECORDINGS, evaluation};
    use crate::support::repository::root;

    #[test]
    fn shares_together_are_the_whole_run() {
        let laboratory = Laboratory::new();
        let recordings = laboratory.film();
        let (shared, alone) = (laboratory.path("shared"), laboratory.path("alone"));
        let start = |k: usize| -> Child {
            let share = format!("{k}/4");
            let mut command = evaluation(&recordings, &shared);
            command.args(["--jobs", "1", "--share", &share]).stdout(Stdio::null());
            command.spawn().expect("chainwave starts")
        };
        let tasks: Vec<Child> = (1..=4).map(start).collect();
        for mut task in tasks {
            assert!(task.wait().expect("the task ends").success());
        }
        let tracked = times_of(&shared.join(".work"), "parquet");
        assert_eq!(tracked.len(), N_RECORDINGS);
        assert!(!shared.join("results.json").exists(), "a share evaluates nothing");

        succeed(&mut evaluation(&recordings, &shared));
        assert_eq!(times_of(&shared.join(".work"), "parquet"), tracked, "nothing is tracked again");
        succeed(&mut evaluation(&recordings, &alone));
        assert_same(&shared, &alone);
    }

    /// A scheduler that runs each task at once, and checks that the evaluation waits for the tracking.
    const SBATCH: &str = r#"#!/usr/bin/env bash
set -euo pipefail
tasks=0
for argument in "$@"; do
  case $argument in
    --array=1-*) tasks=${argument#--array=1-} ;;
    --dependency=afterany:41) [ -e "$(dirname "$0")/tracked" ] ;;
  esac
done
export SLURM_CPUS_PER_TASK=2
for ((SLURM_ARRAY_TASK_ID = 1; SLURM_ARRAY_TASK_ID <= tasks; SLURM_ARRAY_TASK_ID++)); do
  export SLURM_ARRAY_TASK_ID
  bash -c "${@: -1}" >/dev/null
done
if [ "$tasks" -gt 0 ]; then touch "$(dirname "$0")/tracked"; echo '41;cluster'; else bash -c "${@: -1}" >/dev/null; echo 42; fi
"#;

    #[test]
    fn the_clusters_script_tracks_shares_and_then_evaluates() {
        let laboratory = Laboratory::new();
        let recordings = laboratory.film();
        let results = laboratory.path("results of a cluster");
        let programs = laboratory.path("programs");
        fs::create_dir(&programs).expect("a folder can be made");
        fs::write(programs.join("sbatch"), SBATCH).expect("a file can be written");
        fs::set_permissions(programs.join("sbatch"), fs::Permissions::from_mode(0o755))
            .expect("it can be run");
        let command = fs::canonicalize(chainwave().get_program()).expect("the command lies somewhere");
        symlink(command, programs.join("chainwave")).expect("the command can be linked");
        let path = env::var_os("PATH").unwrap_or_default();
        let folders = std::iter::once(programs).chain(env::split_paths(&path));

        let said = succeed(
            Command::new(root().join("pipelines/cluster.sh"))
                .arg(recordings.join("experiment.toml"))
                .arg(&results)
                .args(["3", "--time=5"])
                .env("PATH", env::join_paths(folders).expect("folders without a colon")),
        );
        assert!(said.contains("3 tasks; evaluation: job 42"), "{said}");
        assert_eq!(times_of(&results.join(".work"), "parquet").len(), N_RECORDINGS);
        assert!(results.join("report.html").exists());
    }

    #[test]
    fn the_clusters_script_says_how_it_is_used() {
        let output = Command::new(root().join("pipelines/cluster.sh")).output().expect("the script starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2));
        assert!(said.contains("EXPERIMENT.toml OUT [N_SHARES]") && !said.contains("set -"), "{said}");
    }
}
