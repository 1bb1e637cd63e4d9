//! The paper's workflow under Snakemake, on one machine: shares of a small study side by side, then its evaluation.

mod slow {
    use std::path::Path;
    use std::process::Command;

    use crate::support::command::{chainwave, succeed};
    use crate::support::folder::times_of;
    use crate::support::laboratory::{Laboratory, N_RECORDINGS, evaluation};
    use crate::support::python::{Python, text};
    use crate::support::repository::root;

    /// Settings take what follows them, so targets and options stand before.
    fn snakemake(python: &Python, out: &Path, asked: &[&str], settings: &[String]) -> Command {
        let study = root().join("pipelines/paper");
        let mut command = python.program("snakemake");
        command.arg("--snakefile").arg(study.join("workflow/Snakefile"));
        command.arg("--workflow-profile").arg(study.join("profiles/local"));
        command.arg("--directory").arg(out).args(asked).arg("--config");
        command.arg(format!("out={}", out.display()));
        command.arg(format!("command={}", chainwave().get_program().display()));
        command.args(settings).current_dir(out);
        command
    }

    #[test]
    fn shares_under_snakemake_are_the_whole_run() {
        let Some(python) = Python::with(&["snakemake>=9,<10"]) else { return };
        let laboratory = Laboratory::new();
        let recordings = laboratory.film();
        let (out, alone) = (laboratory.path("study"), laboratory.path("alone"));
        std::fs::create_dir(&out).expect("a folder can be made");
        let experiment = format!("experiment={}", recordings.join("experiment.toml").display());
        let settings = [experiment, "shares=3".into(), "threads=1".into()];
        text(&snakemake(&python, &out, &["results"], &settings).output().expect("it starts"));
        let tracked = times_of(&out.join("results/.work"), "parquet");
        assert_eq!(tracked.len(), N_RECORDINGS);
        succeed(&mut evaluation(&recordings, &alone));
        for name in ["results.json", "motion.parquet", "tracks.parquet"] {
            let read = |folder: &Path| std::fs::read(folder.join(name)).expect("it is there");
            assert!(read(&out.join("results")) == read(&alone), "{name}");
        }
        // A second start has nothing to do.
        let again = snakemake(&python, &out, &["results", "--dry-run"], &settings).output();
        assert!(text(&again.expect("it starts")).contains("Nothing to be done"));
        // All rules of the whole paper fit together.
        let all = snakemake(&python, &out, &["--dry-run"], &["quick=true".into()]).output();
        let said = text(&all.expect("it starts"));
        for rule in ["film", "track", "evaluate", "chain", "law", "compare"] {
            assert!(said.contains(&format!("rule {rule}:")), "{rule} in {said}");
        }
    }
}
