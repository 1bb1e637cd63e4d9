//! Calibrations, from pictures of a board to the uncertainties of the results.

use std::fs;

use crate::support::command::{fail, succeed};
use crate::support::laboratory::{Laboratory, evaluation};
use crate::support::table::Table;

#[test]
fn an_experiment_names_one_calibration() {
    let scale = "scale_px_per_m = 2500.0\nfirst_body_px";
    for (found, lines) in [
        ("found 0", "first_body_px"),
        ("found 2", "scale_px_per_m = 2500.0\ncalibration = \"calibration.toml\"\nfirst_body_px"),
    ] {
        let laboratory = Laboratory::with_experiment(scale, lines);
        let mut command = evaluation(&laboratory.path(""), &laboratory.path("results"));
        let message = fail(&mut command, 2);
        assert!(message.contains("exactly one") && message.contains(found), "{message}");
    }
}

mod slow {
    use super::*;

    /// An ideal lens over a plane of 2500 px/m, or one whose map is another by one of its errors.
    fn map(name: &str, k1: f64, px_per_m: f64) -> String {
        let m_per_px = px_per_m.recip();
        format!(
            "[{name}]\ncentre_px = [199.5, 23.5]\nfocal_px = 201.0\nk1 = {k1:?}\nk2 = 0.0\n\
             plane_from_image = [[{m_per_px:?}, 0.0, 0.0], [0.0, {m_per_px:?}, 0.0], [0.0, 0.0, 1.0]]\n"
        )
    }

    fn calibration(error: &str) -> String {
        let facts = "width_px = 400\nheight_px = 48\nn_pictures = 1\nn_corners = 54\nresidual_px = 0.02\n\
                     m_per_px = 4e-4\nm_per_px_sigma = 4e-6\nk1_sigma = 1e-3\nk2_sigma = 0.0\n";
        format!("{facts}{}[[errors]]\nsource = \"points\"\n{error}", map("map", 0.0, 2500.0))
    }

    /// Peak strains with their uncertainties, and largest uncertainty of a displacement.
    fn peaks(laboratory: &Laboratory, experiment: &str, name: &str) -> (Vec<(f64, f64)>, f64) {
        let recordings = laboratory.path("recordings");
        fs::write(recordings.join("experiment.toml"), experiment).expect("the plan can be written");
        let results = laboratory.path(name);
        succeed(&mut evaluation(&recordings, &results));
        let fronts = Table::read(&results.join("front.parquet"));
        let pairs = fronts.numbers("peak_strain").into_iter().zip(fronts.numbers("peak_strain_sigma"));
        let sigma_m = Table::read(&results.join("motion.parquet")).full("sigma_m");
        (pairs.filter_map(|(u, sigma)| u.zip(sigma)).collect(), sigma_m.into_iter().fold(0.0, f64::max))
    }

    #[test]
    fn an_error_of_the_calibration_is_one_of_the_results() {
        let laboratory = Laboratory::new();
        let recordings = laboratory.film();
        let plan = fs::read_to_string(recordings.join("experiment.toml")).expect("it was written");
        let with = |camera: &str| plan.replacen("scale_px_per_m = 2500.0", camera, 1);
        let (right, right_sigma_m) = peaks(&laboratory, &plan, "right");
        assert!(right.len() > 8, "all gaps but those at the end have their pulse");

        // A scale that is wrong by one standard deviation: the strains are, too, and say so.
        let wrong = with("scale_px_per_m = 2525.0\nscale_sigma_px_per_m = 25.0");
        let (wrong, _) = peaks(&laboratory, &wrong, "wrong");
        for ((u, _), (found, sigma)) in right.iter().zip(&wrong) {
            // Subsets placed by a wrong scale lie up to 3 px off, where their edge comes near the marker's border and costs up to 0.2 %; 200
            // replicas tell sigma to 5 %.
            assert!((found / u - 2500.0 / 2525.0).abs() < 3e-3, "{found} for {u}");
            assert!((sigma / found.abs() - 0.01).abs() < 2e-3, "{sigma} of {found}");
        }

        // A lens without distortion is no lens; an uncertain distortion is felt more than a tracker's noise.
        fs::write(recordings.join("lens.toml"), calibration(&map("errors.map", 1e-3, 2500.0)))
            .expect("the calibration can be written");
        let (ideal, sigma_m) = peaks(&laboratory, &with("calibration = \"lens.toml\""), "lens");
        for ((u, _), (found, _)) in right.iter().zip(&ideal) {
            // The same but for noise: rows that lie between two pixels, as 23.5 does, round to either.
            assert!((found / u - 1.0).abs() < 2e-3, "{found} for {u}");
        }
        // k1 of 1e-3 moves a point at the picture's edge by 0.2 px, or 80 um, against one in the middle.
        assert!(
            sigma_m > 3.0 * right_sigma_m && (1e-5..8e-5).contains(&sigma_m),
            "{sigma_m}, {right_sigma_m}"
        );

        // An error of the pitch that the scale rests on is not one of the strain.
        let marks = "marks = { bodies = [1, 5], at_px = [[30.0, 23.5], [330.0, 23.5]], sigma_px = 0.0 }";
        let uncertain = with(marks).replacen("pitch_m = 0.03", "pitch_sigma_m = 3e-4\npitch_m = 0.03", 1);
        let (of_marks, sigma_m) = peaks(&laboratory, &uncertain, "marks");
        for ((u, sigma), (found, of_marks)) in right.iter().zip(&of_marks) {
            // The markers' row, 23.5, may round to either side, and the other row of pixels has its own noise, 3e-4 of the strain.
            assert!((found / u - 1.0).abs() < 2e-3 && *of_marks < 1.5 * sigma, "{found} {of_marks}");
        }
        assert!(sigma_m > 1e-4, "1 % of displacements of 15 mm and more: {sigma_m}");
    }
}
