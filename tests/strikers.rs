//! One experiment of several striker velocities.

mod slow {
    use std::fs;

    use serde_json::Value;

    use crate::support::command::fail;
    use crate::support::laboratory::{Laboratory, evaluation};
    use crate::support::table::Table;

    #[test]
    fn each_velocity_is_evaluated_and_the_waves_are_compared() {
        let laboratory = Laboratory::with_strikers(&["2.73", "0.83"]);
        let (results, _) = laboratory.evaluate();
        for velocity in ["2.73", "0.83"] {
            let folder = results.join(format!("striker-{velocity}-m-per-s"));
            assert!(
                folder.join("results.json").exists() && folder.join("motion.parquet").exists(),
                "{velocity}"
            );
        }
        let table = Table::read(&results.join("group_velocity.parquet"));
        let columns =
            ["striker_velocity_m_per_s", "sigma", "group_velocity_m_per_s", "group_velocity_sigma", "source"];
        let names = table.names();
        columns.iter().for_each(|column| assert!(names.iter().any(|name| name == column), "{column}"));
        let measured = table.texts("source").iter().filter(|source| *source == "experiment").count();
        assert_eq!(measured, 2);
        let speeds = table.full("group_velocity_m_per_s");
        // The chain softens: the faster the strike, the slower the wave (by 5 m/s here, known to 0.2 m/s).
        assert!(speeds[1] > speeds[0] + 2.0, "{speeds:?}");
        assert!(results.join("figures/group-velocity.svg").exists());
        // Two points lie on any power law.
        let text = fs::read_to_string(results.join("group_velocity.json")).expect("it was written");
        let exponents: Value = serde_json::from_str(&text).expect("JSON");
        assert!(exponents["speed_exponent"].is_null() && exponents["speed_exponent_refused"].is_string());
        // So does the model at the velocities that were measured, to which it is compared.
        assert!(exponents["speed_exponent_model_refused"].is_string(), "{exponents}");
        let (sources, first, last) = (table.texts("source"), table.full("first_gap"), table.full("last_gap"));
        let gaps = |source: &str| -> Vec<(f64, f64)> {
            let rows = (0..table.n_rows()).filter(|row| sources[*row] == source);
            rows.map(|row| (first[row], last[row])).collect()
        };
        assert_eq!(gaps("chain model, same gaps"), gaps("experiment"));
        assert!(gaps("chain model").len() > 10);
    }

    #[test]
    fn a_velocity_that_makes_no_sense_does_not_end_the_others() {
        let laboratory = Laboratory::with_strikers(&["2.73", "0.83"]);
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        let path = recordings.join("trials.csv");
        let trials = fs::read_to_string(&path).expect("it was filmed");
        let stage = trials.lines().next().expect("a header").split(',').position(|name| name == "stage_m");
        let stage = stage.expect("a column of stages");
        let elsewhere = |line: &str| match line.starts_with("0.83_") {
            true => {
                let mut cells: Vec<&str> = line.split(',').collect();
                cells[stage] = "55.0";
                cells.join(",")
            }
            false => line.to_owned(),
        };
        let text: Vec<String> = trials.lines().map(elsewhere).collect();
        fs::write(&path, text.join("\n")).expect("it can be written");
        let said = fail(&mut evaluation(&recordings, &results), 1);
        assert!(said.contains("striker 0.83 m/s: "), "{said}");
        assert!(results.join("striker-2.73-m-per-s/report.html").exists());
        let unsolved = fs::read_to_string(results.join("striker-0.83-m-per-s/results.json"));
        assert!(unsolved.expect("the reason is written").contains("unsolved"));
        let report = fs::read_to_string(results.join("report.html")).expect("it was written");
        let (failed, other) =
            (report.find("Striker at 0.83 m/s could not be evaluated"), report.find("Striker at 2.73 m/s"));
        assert!(failed.is_some() && failed < other, "what failed comes first");
        assert_eq!(Table::read(&results.join("recordings.csv")).n_rows(), 30);
    }
}
