//! A view whose recordings state another frame rate than they were filmed at: told, put right, and right.

mod slow {
    use crate::support::laboratory::{Laboratory, evaluation};
    use crate::support::motion::Motion;
    use crate::support::table::Table;

    #[test]
    fn a_misstated_frame_rate_is_named_and_put_right() {
        // Half a per cent, as a clock, and 20 kHz in place of 25, as one that was typed for another.
        for (stated_hz, later_percent) in [("25125.0", 0.5), ("20000.0", -20.0)] {
            let laboratory = Laboratory::with_appended(&format!(
                "\n[[synthetic.views]]\nview = 2\nstated_rate_hz = {stated_hz}\n"
            ));
            let recordings = laboratory.film();
            let truth = Motion::read(&recordings.join("truth.parquet"), 12);
            let results = laboratory.path("results");
            let run = evaluation(&recordings, &results).output().expect("chainwave starts");
            let said =
                [run.stdout, run.stderr].map(|text| String::from_utf8_lossy(&text).into_owned()).concat();
            assert_eq!(run.status.code(), Some(0), "{said}");
            let line =
                said.lines().find(|line| line.contains("view 2: frames follow each other")).unwrap_or(&said);
            let words: Vec<&str> = line.split_whitespace().collect();
            let at = words.iter().position(|word| *word == "+-").unwrap_or_else(|| panic!("{said}"));
            let [value, sigma] = [at - 1, at + 1].map(|k| words[k].parse::<f64>().expect("a number"));
            let expected = f64::abs(later_percent);
            // To four standard deviations of what is stated.
            assert!((value - expected).abs() < 4.0 * sigma && sigma < 0.1, "{stated_hz}: {line}");
            assert_eq!(line.contains("% later"), later_percent > 0.0, "{line}");
            assert!(!said.contains("views show them apart"), "{said}");
            // As well as without: the errors of one experiment are tied together by its trials, so the share scatters by a few per cent.
            let held = truth.held_by(&Table::read(&results.join("motion.parquet")), 1e-3);
            assert!(held.0 >= 0.9, "{stated_hz}: {held:?}\n{said}");
        }
    }
}
