//! What a camera does of its own is found in a run, named, and taken out where that can be.

mod slow {
    use std::fs;
    use std::path::Path;

    use serde_json::Value;

    use crate::support::command::succeed;
    use crate::support::laboratory::{Laboratory, evaluation};
    use crate::support::motion::assert_motion_held;
    use crate::support::table::Table;

    /// Films the small experiment with a camera that has some effects.
    fn filmed_with(effects: &str) -> Laboratory {
        let laboratory = Laboratory::with_appended(&format!("\n[synthetic.camera.effects]\n{effects}\n"));
        laboratory.film();
        laboratory
    }

    /// Evaluates what was filmed, with another text in one place of the plan; the results and their warnings.
    fn run(laboratory: &Laboratory, from: &str, to: &str) -> (Value, String) {
        let plan = laboratory.path("recordings/experiment.toml");
        let text = fs::read_to_string(&plan).expect("it was written");
        fs::write(&plan, text.replacen(from, to, 1)).expect("it can be written");
        let results = laboratory.path("results");
        succeed(&mut evaluation(&laboratory.path("recordings"), &results));
        let text = fs::read_to_string(results.join("results.json")).expect("results were written");
        let results: Value = serde_json::from_str(&text).expect("it is JSON");
        let warnings = results["warnings"].to_string();
        (results, warnings)
    }

    #[test]
    fn a_rolling_shutter_is_named_and_a_stated_one_is_not() {
        // A sensor that reads its lines all the time; at a noise of 3 counts subsets of 17 x 17 px tell the time between lines to a tenth.
        let noise = "read_noise_counts = 12.0\ncounts_per_electron = 0.2\n";
        let effects = "\n[synthetic.camera.effects]\nline_time_s = 8e-7\n";
        let laboratory =
            Laboratory::with_experiment(noise, &format!("{}{effects}", noise.replace("12.0", "3.0")));
        laboratory.film();
        let (_, warnings) = run(&laboratory, "", "");
        assert!(warnings.contains("rolling shutter"), "{warnings}");
        // The line of the bodies is exposed 20 us late, in which they go 20 um: uncorrected, next to no interval holds.
        assert_motion_held(&laboratory.path("recordings"), &laboratory.path("results"));
        let (_, warnings) = run(&laboratory, "[camera]\n", "[camera]\nline_time_s = 8e-7\n");
        assert!(!warnings.contains("rolling shutter"), "{warnings}");
    }

    #[test]
    fn a_view_of_another_scale_is_told_unless_its_scale_is_stated() {
        let laboratory = filmed_with("scale = { error = 0.0, view_sigma = 0.0, views = [0.0, 0.02, 0.0] }");
        let (_, warnings) = run(&laboratory, "", "");
        assert!(warnings.contains("views are magnified differently"), "{warnings}");
        let trials = laboratory.path("recordings/trials.csv");
        let text = fs::read_to_string(&trials).expect("it was written");
        let row = |line: &str| match line {
            line if line.starts_with("recording,") => format!("{line},scale_px_per_m\n"),
            line if line.starts_with("view2_") => format!("{line},2550\n"),
            line => format!("{line},\n"),
        };
        fs::write(&trials, text.lines().map(row).collect::<String>()).expect("it can be written");
        let (_, warnings) = run(&laboratory, "", "");
        assert!(!warnings.contains("magnified") && !warnings.contains("contradicts"), "{warnings}");
    }

    #[test]
    fn a_camera_that_shakes_is_named_and_drawn() {
        let laboratory = filmed_with(
            "shake = { amplitude_px = [0.2, 0.2], turn_amplitude_rad = 0.0, frequency_hz = 200.0, onset = \"always\", decay_per_s = 0.0 }",
        );
        let (_, warnings) = run(&laboratory, "", "");
        assert!(warnings.contains("the camera moves"), "{warnings}");
        let figures = laboratory.path("results/figures");
        let drawn = |ending: &str| Path::new(&figures).join(format!("camera-motion.{ending}")).exists();
        assert!(drawn("svg") && drawn("png"), "the camera's motion is drawn");
        let report = fs::read_to_string(laboratory.path("results/report.html")).expect("it was written");
        assert!(report.contains("camera-motion"), "the report shows it");
    }

    #[test]
    fn a_shadow_that_moves_is_named() {
        // A soft edge of 20 px that crosses the picture of 400 px within the 13.2 ms of the recording.
        let laboratory = filmed_with(
            "shadow = { depth = 0.4, start_px = 0.0, speed_px_per_s = 30300.0, edge_sigma_px = 20.0 }",
        );
        let (_, warnings) = run(&laboratory, "", "");
        assert!(warnings.contains("a shadow, or a lamp's light, moves across the pictures"), "{warnings}");
        assert!(!warnings.contains("the camera moves:"), "{warnings}");
    }

    #[test]
    fn a_pattern_of_the_sensor_moves_triggers_by_no_more_than_they_say() {
        let laboratory = filmed_with("fixed_pattern = { offset_sigma = 3e-3, gain_sigma = 9e-3 }");
        let (_, warnings) = run(&laboratory, "", "");
        assert!(warnings.contains("fixed pattern"), "{warnings}");
        let alignment = Table::read(&laboratory.path("results/alignment.parquet"));
        let truth = Table::read(&laboratory.path("recordings/truth_trials.csv"));
        assert_eq!(alignment.texts("recording"), truth.texts("recording"));
        let delays_s = truth.full("trigger_delay_s");
        let n = delays_s.len() as f64;
        let mean_s = delays_s.iter().sum::<f64>() / n;
        let found =
            alignment.full("trigger_offset_s").into_iter().zip(alignment.full("trigger_offset_sigma_s"));
        let squares = found
            .zip(&delays_s)
            .map(|((offset_s, sigma_s), delay_s)| ((offset_s + delay_s - mean_s) / sigma_s).powi(2));
        let rms_sigma = (squares.sum::<f64>() / n).sqrt();
        // The pattern moves all triggers of a view together, so that three views have two independent errors: chi squared is below 9.2 in 99 %.
        // Without that in the sigmas it is 2.4.
        assert!(rms_sigma < (9.2_f64 / 2.0).sqrt(), "{rms_sigma}");
    }

    #[test]
    fn bodies_that_move_towards_the_camera_are_told_by_the_views_that_contradict_each_other() {
        let laboratory = filmed_with(
            "seed = 2\nout_of_plane = { amplitude_m = 3e-5, distance_m = 0.5, frequency_hz = 150.0 }",
        );
        let (_, warnings) = run(&laboratory, "", "");
        assert!(warnings.contains("views_disagree") && warnings.contains("towards the camera"), "{warnings}");
        // 6e-5 of up to 80 mm from the middle are 5 um, of which single sigmas of 1 um know nothing.
        assert_motion_held(&laboratory.path("recordings"), &laboratory.path("results"));
    }

    #[test]
    fn a_camera_that_is_rolled_is_told_by_the_direction_of_motion() {
        let laboratory = Laboratory::with_appended(
            "\n[synthetic.camera.optics]\nfocal_length_px = 1e6\nroll_rad = 0.0122\n",
        );
        laboratory.film();
        let (_, warnings) = run(&laboratory, "", "");
        // 0.0122 rad are 0.699 degrees.
        assert!(
            warnings.contains("inclined_motion") && warnings.contains("bodies move at 0.69"),
            "{warnings}"
        );
    }

    #[test]
    fn a_sound_camera_is_not_accused() {
        let laboratory = Laboratory::new();
        laboratory.film();
        let (_, warnings) = run(&laboratory, "", "");
        for word in ["rolling shutter", "the camera moves", "scale contradicts", "magnified", "shadow"] {
            assert!(!warnings.contains(word), "{word}: {warnings}");
        }
        assert!(!laboratory.path("results/figures/camera-motion.svg").exists(), "nothing to draw");
    }
}
