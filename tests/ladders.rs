//! `tradeoff` and `prove`: what methods cost on a scene, and how often stated intervals hold the truth.

mod slow {
    use std::fs;

    use crate::support::command::{chainwave, succeed};
    use crate::support::laboratory::Laboratory;
    use crate::support::table::Table;

    /// Bodies of the small experiment.
    const N_BODIES: u32 = 12;

    /// The share of so many independent 95 % intervals that holds at least, but for one proof in a thousand: from the lower tail of the
    /// binomial distribution. A body's samples share the errors of its trials, so that bodies count, times experiments, and not samples.
    fn least_share(n_independent: u32) -> f64 {
        const HOLDS: f64 = 0.95;
        let n = f64::from(n_independent);
        let ratio = |k: f64| (n - k) / (k + 1.0) * HOLDS / (1.0 - HOLDS);
        // From none that holds on, each count's probability is the one's before times a ratio.
        let (mut held, mut probability) = (0.0, (1.0 - HOLDS).powf(n));
        let mut below = 0.0;
        while below + probability < 1e-3 {
            below += probability;
            probability *= ratio(held);
            held += 1.0;
        }
        held / n
    }

    #[test]
    fn the_least_share_is_that_of_the_binomial_distribution() {
        // Of 12, at most 7 hold in 1.8e-4 of the proofs and at most 8 in 2.2e-3; of 60, at most 50 in 7.4e-4 and 51 in 2.8e-3.
        assert!((least_share(12) - 8.0 / 12.0).abs() < 1e-12);
        assert!((least_share(60) - 51.0 / 60.0).abs() < 1e-12);
    }

    #[test]
    fn the_ladder_of_a_scene_has_a_front() {
        let laboratory = Laboratory::new();
        let (recordings, out) = (laboratory.film(), laboratory.path("tradeoff"));
        let mut command = chainwave();
        command.arg("tradeoff").arg(recordings.join("experiment.toml")).arg("--out").arg(&out);
        let said = succeed(&mut command);
        assert!(said.contains("icgn-quintic-affine"), "{said}");
        let table = Table::read(&out.join("tradeoff.parquet"));
        let columns =
            ["step", "method", "settings", "error", "error_unit", "seconds_per_item", "items", "on_front"];
        let names = table.names();
        columns.iter().for_each(|column| assert!(names.iter().any(|name| name == column), "{column}"));
        let (methods, errors) = (table.texts("method"), table.full("error"));
        let error = |method: &str| errors[methods.iter().position(|name| name == method).expect("a rung")];
        // Some millipixels are left of the bias of a paraboloid's peak on speckle, of quintic interpolation's hundredths.
        assert!(error("template-parabola") > error("icgn-quintic-translation"));
        // Verlet's error falls with the square of the step, Runge-Kutta's with the fourth power.
        let settings = table.texts("settings");
        let at = |method: &str, step: &str| {
            let row = (0..methods.len()).find(|row| methods[*row] == method && settings[*row].contains(step));
            errors[row.expect("a rung")]
        };
        assert!(at("verlet", "1e-5") > 3.0 * at("verlet", "5e-6"));
        assert!(at("rk4", "1e-5") > 10.0 * at("rk4", "5e-6"));
        assert!(out.join("tradeoff-integrator.svg").exists());
        assert!(out.join("tradeoff-tracking.png").exists() && out.join("tradeoff-tracking.svg").exists());
    }

    #[test]
    fn a_proof_counts_every_quantity_and_goes_on_where_it_stopped() {
        let laboratory = Laboratory::new();
        let out = laboratory.path("proof");
        let prove = |experiments: &str| {
            let mut command = chainwave();
            command.arg("prove").arg(laboratory.path("experiment.toml")).arg("--out").arg(&out);
            succeed(command.args(["--experiments", experiments, "--striker", "2.73,0.83"]));
            Table::read(&out.join("coverage.parquet"))
        };
        let first = prove("1");
        let of = |table: &Table, quantity: &str, column: &str| {
            let row = table.texts("quantity").iter().position(|name| name == quantity).expect("a quantity");
            table.full(column)[row]
        };
        let both = prove("2");
        assert!((of(&both, "c_s, tracks", "n") - 2.0 * of(&first, "c_s, tracks", "n")).abs() < 0.5);
        assert!(of(&both, "displacement", "within_95") >= least_share(2 * N_BODIES));
        assert!(out.join("coverage.png").exists() && out.join("proof.parquet").exists());
        let planned = Table::read(&out.join("planned.parquet"));
        let (foreseen, stated) = (planned.full("planned_sigma"), planned.full("stated_sigma"));
        let (quantities, errors) = (planned.texts("quantity"), planned.full("rms_error"));
        assert_eq!(quantities.len(), 2 * 9, "every result, with dampings by noise alone: {quantities:?}");
        assert_eq!(
            quantities.iter().filter(|name| *name == "c_d, stated").count(),
            2,
            "one for each striker"
        );
        for (row, name) in quantities.iter().enumerate() {
            let ratio = stated[row] / foreseen[row];
            println!("{name}: stated over planned {ratio:.3}");
            // What a plan promises. A stated damping also holds what tracks neither tell nor exclude.
            let promised = if name.ends_with(", stated") { 0.7..f64::INFINITY } else { 0.7..1.3 };
            assert!(promised.contains(&ratio), "{name}: {ratio}");
            // One number of one experiment: one in a thousand is off by more.
            if ["group velocity", "c_d, stated", "c_s, stated"].contains(&name.as_str()) {
                assert!(
                    errors[row] < 3.3 * foreseen[row],
                    "{name}: off by {} of what was planned",
                    errors[row] / foreseen[row]
                );
            }
        }
    }

    #[test]
    fn a_proof_says_what_the_camera_does() {
        let laboratory = Laboratory::new();
        let out = laboratory.path("proof");
        let mut command = chainwave();
        command.arg("prove").arg(laboratory.path("experiment.toml")).arg("--out").arg(&out);
        let effects = ["fixed_pattern", "shake_by_strike"];
        succeed(command.args(["--experiments", "3", "--camera", &effects.join(",")]));
        let table = Table::read(&out.join("camera.parquet"));
        let (kinds, quantities) = (table.texts("effect"), table.texts("quantity"));
        let (named, within) = (table.full("n_named"), table.full("within_95"));
        for effect in effects {
            let row = |quantity: &str| {
                let rows = kinds.iter().zip(&quantities);
                rows.into_iter().position(|(kind, of)| kind == effect && of == quantity).expect("a row")
            };
            assert!(named[row("displacement")] > 0.5, "{effect} is not named");
            // Of the camera that is shaken by the strike, 0.15 hold without what is known of it.
            let holds = within[row("displacement")];
            assert!(holds >= least_share(N_BODIES), "{effect}: {holds}");
        }
        // Each experiment by itself, one line: what the table has of the only experiment of each effect.
        let lines = fs::read_to_string(out.join("experiments.csv")).expect("a table of experiments");
        let cells: Vec<Vec<&str>> = lines.lines().map(|line| line.split(',').collect()).collect();
        assert_eq!(
            cells.iter().map(|line| line[0]).collect::<Vec<_>>(),
            ["kind", "none", effects[0], effects[1]]
        );
        let of = |line: &[&str], name: &str| {
            let place = cells[0].iter().position(|head| *head == name).expect("a column");
            line[place].parse::<f64>().expect("a number")
        };
        for (line, effect) in cells[2..].iter().zip(effects) {
            let share = of(line, "displacement_within_95") / of(line, "displacement_n");
            let row =
                kinds.iter().zip(&quantities).position(|(kind, of)| kind == effect && of == "displacement");
            assert!((share - within[row.expect("a row")]).abs() < 1e-9, "{effect}: {share}");
            assert!(of(line, "seed") - 1.0 < 0.5 && of(line, "displacement_rms_sigma") > 0.0, "{line:?}");
        }
    }

    #[test]
    fn a_proof_says_what_each_fault_does() {
        let laboratory = Laboratory::new();
        let out = laboratory.path("proof");
        let mut command = chainwave();
        command.arg("prove").arg(laboratory.path("experiment.toml")).arg("--out").arg(&out);
        // The fault itself is named on standard error. By chance the striker of seed 1 is 2.7 scatters too slow in one trial, and named.
        let seeds = ["--experiments", "2", "--first-seed", "2", "--faults"];
        let output = command.args(seeds).output().expect("chainwave starts");
        assert_eq!(output.status.code(), Some(0));
        assert!(String::from_utf8_lossy(&output.stdout).contains("truncated_file"));
        let table = Table::read(&out.join("faults.parquet"));
        let (faults, named, within) = (table.texts("fault"), table.full("n_named"), table.full("within_95"));
        for (row, fault) in faults.iter().enumerate() {
            assert!((named[row] - f64::from(u8::from(fault == "truncated_file"))).abs() < 0.5, "{fault}");
        }
        let displacement = table.texts("quantity").iter().position(|name| name == "displacement");
        assert!(within[displacement.expect("a quantity")] >= least_share(N_BODIES));
    }

    #[test]
    fn a_proof_says_what_other_protocols_do() {
        let laboratory = Laboratory::new();
        let out = laboratory.path("proof");
        let mut command = chainwave();
        command.arg("prove").arg(laboratory.path("experiment.toml")).arg("--out").arg(&out);
        // By chance the strikers of seeds 1 and 5 are 2.7 scatters too slow in one trial, and named; and the chain model of seed 2 tells a lens, which of
        // two shapes it does in one of forty.
        let protocols = ["magnifications", "one_body", "one_body_struck_harder"];
        let seeds = ["--experiments", "4", "--first-seed", "8", "--protocols", &protocols.join(",")];
        succeed(command.args(seeds));
        let table = Table::read(&out.join("protocols.parquet"));
        let (kinds, quantities) = (table.texts("protocol"), table.texts("quantity"));
        let (named, stated, within) =
            (table.full("n_named"), table.full("n_stated"), table.numbers("within_95"));
        let row = |protocol: &str, quantity: &str| {
            let mut rows = kinds.iter().zip(&quantities);
            rows.position(|(kind, of)| kind == protocol && of == quantity).expect("a row")
        };
        for protocol in ["none", "magnifications", "one_body", "one_body_struck_harder"] {
            let holds = within[row(protocol, "displacement")].expect("displacements are stated");
            assert!(holds >= least_share(N_BODIES), "{protocol}: {holds}");
        }
        // One experiment a protocol, and one damping of it.
        assert!((stated[row("none", "c_d, stated")] - 1.0).abs() < 0.5);
        // Views that share no body are named, and views that are magnified as the table states are not.
        assert!(named[row("one_body", "displacement")] > 0.5 && named[row("none", "displacement")] < 0.5);
        assert!(named[row("magnifications", "displacement")] < 0.5);
        // A view that was struck harder, which no body that it shares tells, is by the chain model.
        assert!(named[row("one_body_struck_harder", "displacement")] > 0.5);
    }
}
