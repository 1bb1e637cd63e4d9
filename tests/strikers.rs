//! One experiment of several striker velocities.

mod slow {
    use std::fs;

    use serde_json::Value;

    use crate::laboratory::Laboratory;
    use crate::table::Table;

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
        assert!(exponents["speed_exponent_model"].is_number(), "{exponents}");
    }
}
