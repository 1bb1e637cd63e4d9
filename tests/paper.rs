//! The pipeline of the paper, made quick: every figure and number that it promises is there.

mod slow {
    use std::fs;
    use std::path::Path;
    use std::process::{Command, Output};

    use tempfile::TempDir;

    use crate::command::chainwave;
    use crate::folder::times_of;
    use crate::repository::root;
    use crate::table::Table;

    const FIGURES: [&str; 7] = [
        "contact-curve",
        "group-velocity",
        "long-chain",
        "peak-energy",
        "right-halves",
        "strain-map",
        "strain-profiles",
    ];

    fn start(out: &Path) -> Output {
        let mut script = Command::new(root().join("pipelines/paper/run.sh"));
        script.arg(out).arg("--quick").env("CHAINWAVE_COMMAND", chainwave().get_program());
        script.output().expect("the script starts")
    }

    #[test]
    fn the_whole_paper_is_made() {
        let folder = TempDir::new().expect("a temporary folder can be made");
        let out = folder.path().join("paper");
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
        assert_eq!(filmed.len(), 36);
    }
}
