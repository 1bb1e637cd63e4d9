//! Chains that are not alike throughout: masses, distances, contacts and dampings from body to body, and a wall at the far end.

use crate::support::command::{chainwave, fail};
use crate::support::laboratory::Laboratory;

/// What stands in the small experiment, and another chain in its place.
const MASS: &str = "mass_kg = 0.455e-3";
const PITCH: &str = "n_bodies = 12\npitch_m = 0.030\nmass";
const CONTACT: &str = "[contact]\nlaw = \"power\"\na = 60.1\ndelta_0_m = 2.27e-3\np = 0.114\n";

#[test]
fn a_chain_that_does_not_add_up_is_refused_with_its_key() {
    let places: [(&str, &str, &str); 5] = [
        (MASS, "mass_kg = [0.455e-3, 0.5e-3]", "chain.mass_kg: expected a number or 12 numbers"),
        (MASS, "mass_kg = { repeat = [] }", "repeat = [..]"),
        (CONTACT, "[[contact]]\nlaw = \"linear\"\nk_n_per_m = 1e3\n", "expected a table or 11 tables"),
        (CONTACT, "[contact]\nlaw = \"power\"\na = 60.1\np = 0.114\n", "missing field `delta_0_m`"),
        (CONTACT, "[contact]\nlaw = \"table\"\nfile = \"no.csv\"\n", "no.csv"),
    ];
    for (from, to, reason) in places {
        let laboratory = Laboratory::with_replaced(&[(from, to)]);
        let said = fail(chainwave().arg("check").arg(laboratory.path("experiment.toml")), 2);
        assert!(said.contains(reason), "{reason}: {said}");
    }
}

mod slow {
    use std::fs;

    use serde_json::Value;

    use super::*;
    use crate::support::motion::assert_motion_held;

    /// Films and evaluates; c_d, c_s and the share of 95 % intervals of the motion that hold the truth.
    fn assert_holds(places: &[(&str, &str)]) -> Value {
        let laboratory = Laboratory::with_replaced(places);
        let (results, _) = laboratory.evaluate();
        let text = fs::read_to_string(results.join("results.json")).expect("it was written");
        let found: Value = serde_json::from_str(&text).expect("it is JSON");
        let number = |name: &str| found[name].as_f64().expect("a number");
        for (value, sigma, truth) in [("c_d_kg_per_s", "c_d_sigma", 3e-3), ("c_s_kg_per_s", "c_s_sigma", 0.2)]
        {
            // Four standard uncertainties, as in the other tests of the whole way.
            assert!((number(value) - truth).abs() < 4.0 * number(sigma), "{value}: {found}");
        }
        assert_motion_held(&laboratory.path("recordings"), &results);
        found
    }

    #[test]
    fn two_masses_and_two_springs_in_turn() {
        let springs = "[contact]\nrepeat = [{ law = \"power\", a = 60.1, delta_0_m = 2.27e-3, p = 0.114 }, { law = \"linear\", k_n_per_m = \
                       1200.0 }]\n";
        let found = assert_holds(&[(MASS, "mass_kg = { repeat = [0.455e-3, 0.91e-3] }"), (CONTACT, springs)]);
        assert_eq!(found["fit_to_tracks"]["as_if"], Value::Null, "{found}");
    }

    #[test]
    fn a_chain_that_grows_lighter_and_narrower() {
        let pitch = "n_bodies = 12\npitch_m = { grade = [0.030, 0.0273] }\nmass";
        let mass = "mass_kg = { grade = [0.5e-3, 0.4e-3] }\ndamping_kg_per_s = { grade = [2.0, 1.0] }";
        assert_holds(&[(PITCH, pitch), (MASS, mass)]);
    }

    #[test]
    fn a_stiffening_law_gains_energy_on_its_way() {
        let law = "[contact]\nlaw = \"power\"\na = 3.0e5\ndelta_0_m = 1.0e-3\np = 1.5\n";
        assert_holds(&[(CONTACT, law)]);
    }
}
