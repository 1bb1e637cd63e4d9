//! `chainwave figures`: what a run drew, drawn again in another style, and nothing else touched.

mod slow {
    use std::collections::BTreeMap;
    use std::fs;
    use std::path::Path;
    use std::process::Output;

    use crate::support::command::{chainwave, succeed};
    use crate::support::laboratory::Laboratory;

    /// Every file of a folder.
    fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
        let entries = fs::read_dir(folder).expect("there are figures");
        let file = |path: &Path| {
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            (name, fs::read(path).expect("it can be read"))
        };
        entries.map(|entry| file(&entry.expect("it can be listed").path())).collect()
    }

    fn refused(output: &Output, what: &str) {
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(what), "expected {what:?} in: {said}");
    }

    #[test]
    fn figures_are_drawn_again_as_they_were_and_in_another_style() {
        let laboratory = Laboratory::new();
        let (results, _) = laboratory.evaluate();
        let folder = results.join("figures");
        let drawn = files(&folder);
        let again = |arguments: &[&str]| {
            let mut command = chainwave();
            command.arg("figures").arg(&results).args(arguments);
            command
        };
        let said = succeed(&mut again(&["--format", "svg,png"]));
        assert!(said.contains("wrote"), "{said}");
        let same = files(&folder);
        let differing: Vec<&String> = drawn
            .iter()
            .filter(|(name, bytes)| same.get(*name) != Some(bytes))
            .map(|(name, _)| name)
            .collect();
        assert!(differing.is_empty() && same.len() == drawn.len(), "{differing:?}");

        let style = laboratory.path("style.toml");
        fs::write(
            &style,
            "page_mm = 120.0\nfont_pt = 7.0\ncolour_map = \"gray\"\ndecimal_sign = \"comma\"\n",
        )
        .expect("it can be written");
        let style = style.to_str().expect("a plain path");
        succeed(&mut again(&["--only", "strain-map", "--style", style]));
        let styled = files(&folder);
        let svg = String::from_utf8_lossy(&styled["strain-map.svg"]).into_owned();
        assert!(svg.contains("width=\"120mm\""), "{}", &svg[..200]);
        assert!(styled["strain-map.pdf"].starts_with(b"%PDF"));
        // Every cell of the map, with its line of names.
        assert!(styled["strain-map.csv"].iter().filter(|byte| **byte == b'\n').count() > 1000);
        let others = |name: &&String| !name.starts_with("strain-map.");
        for name in drawn.keys().filter(others) {
            assert_eq!(drawn[name], styled[name], "{name} was not asked for");
        }

        refused(
            &again(&["--only", "strain"]).output().expect("it starts"),
            "one of dispersion, displacements",
        );
        fs::write(style, "width = 3\n").expect("it can be written");
        refused(&again(&["--style", style]).output().expect("it starts"), "unknown field `width`");
        fs::write(style, "font_pt = 100.0\n").expect("it can be written");
        refused(&again(&["--style", style]).output().expect("it starts"), "expected a number from 5 to 16");
    }

    #[test]
    fn a_table_beside_a_figure_that_is_not_its_own_is_left_as_it_is() {
        let folder = tempfile::tempdir().expect("a folder");
        let of_sample = |name: &str| crate::support::repository::root().join("data-samples").join(name);
        let points = folder.path().join("points.csv");
        fs::write(&points, "name,x_px,y_px\n1,25,19.5\n").expect("it can be written");
        let tracks = folder.path().join("tracks.csv");
        let mut track = chainwave();
        track.arg("track").arg(of_sample("hec-view1-trial1.cine")).arg("--points").arg(&points);
        succeed(
            track
                .arg("--out")
                .arg(folder.path().join("t.csv"))
                .arg("--picture")
                .arg(folder.path().join("tracks")),
        );
        assert!(tracks.with_extension("cbor").is_file());
        fs::write(&tracks, "mine,and,not,the,figure's\n1,2,3,4,5\n").expect("it can be written");
        let said = chainwave().arg("figures").arg(folder.path()).output().expect("it starts");
        assert!(said.status.success());
        assert!(String::from_utf8_lossy(&said.stderr).contains("tracks.csv: holds something else"));
        assert!(fs::read_to_string(&tracks).expect("it is there").starts_with("mine,"));
        fs::remove_file(&tracks).expect("it is there");
        succeed(chainwave().arg("figures").arg(folder.path()));
        assert!(fs::read_to_string(&tracks).expect("it is written anew").starts_with("panel,series"));
        let said = chainwave().arg("figures").arg(folder.path()).output().expect("it starts");
        assert!(said.stderr.is_empty(), "a figure's own numbers are replaced");
    }

    #[test]
    fn a_figure_that_is_torn_is_named_and_the_others_are_drawn() {
        let laboratory = Laboratory::new();
        let (results, _) = laboratory.evaluate();
        fs::write(results.join("figures/peak-trace.cbor"), b"torn").expect("it can be written");
        let output =
            chainwave().arg("figures").arg(&results).args(["--format", "pdf"]).output().expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("peak-trace.cbor"), "{said}");
        assert!(results.join("figures/peak-energy.pdf").exists());
        assert!(!results.join("figures/peak-trace.pdf").exists());
    }

    #[test]
    #[cfg(unix)]
    fn figures_that_none_can_be_drawn_of_are_nothing_done() {
        let laboratory = Laboratory::new();
        let (results, _) = laboratory.evaluate();
        for (name, _) in files(&results.join("figures")) {
            if name.ends_with(".cbor") {
                fs::write(results.join("figures").join(name), b"torn").expect("it can be written");
            }
        }
        let output = chainwave().arg("figures").arg(&results).output().expect("it starts");
        refused(&output, "could be used");
    }

    #[test]
    fn a_folder_without_figures_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        refused(
            &chainwave().arg("figures").arg(folder.path()).output().expect("it starts"),
            "a folder without any",
        );
    }
}
