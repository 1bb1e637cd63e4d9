//! Whether a strike pushes the bodies the way that the chain is said to go.

use chainwave_measurement::{ChainMotion, Estimate};

use crate::configuration::Experiment;
use crate::finding::Finding;

/// Share of a body's greatest displacement at which it has set out.
const SET_OUT: f64 = 0.5;
/// Standard uncertainties beyond which it did.
const SIGMAS: f64 = 5.0;

/// What a motion says of the chain's direction in the picture: a striker sets every body out along the chain, never against it.
pub(crate) fn against_the_chain(experiment: &Experiment, motion: &ChainMotion) -> Option<Finding> {
    let pushes_along = experiment.striker.is_some() && experiment.far_striker.is_none();
    let (body, x_m) = pushes_along.then(|| first_way_m(motion)).flatten()?;
    (x_m < 0.0).then(|| Finding {
        code: "direction",
        subject: "camera".into(),
        text: format!(
            "body {body} sets out by {:.3} mm against the chain, which no strike on body 1 does (hint: where the chain goes to the left in the \
             pictures, [camera.marks] says so by the places of bodies; a scale or a ruler takes it to go to the right)",
            -1e3 * x_m
        ),
    })
}

/// The first body that was seen to set out, and how far it is when it has.
fn first_way_m(motion: &ChainMotion) -> Option<(usize, f64)> {
    let way_m = |row: usize| {
        let places = || motion.displacement_m.row(row).into_iter().flatten();
        let greatest_m = places().map(|x| x.value.abs()).fold(0.0, f64::max);
        let has_set_out = |x: &&Estimate| x.value.abs() >= SET_OUT * greatest_m;
        places().find(has_set_out).filter(|x| x.value.abs() > SIGMAS * x.sigma).map(|x| x.value)
    };
    (0..motion.n_bodies()).find_map(|row| Some((row + 1, way_m(row)?)))
}

#[cfg(test)]
mod tests {
    use chainwave_analysis::exact_motion;
    use chainwave_measurement::Trajectory;
    use ndarray::Array2;

    use super::*;

    const SMALL: &str = include_str!("../../../../tests/small-experiment/experiment.toml");

    /// A body that is pushed by 1 mm and swings back by nine tenths of that, with a sign, behind one that was not seen.
    fn pushed(sign: f64) -> ChainMotion {
        let x_m = [0.0, 2e-4, 6e-4, 1e-3, 4e-4, -3e-4, -9e-4];
        let displacement_m = Array2::from_shape_fn((2, x_m.len()), |(_, at)| sign * x_m[at]);
        let mut motion = exact_motion(&Trajectory {
            times_s: (0..x_m.len()).map(|at| 4e-5 * at as f64).collect(),
            velocity_m_per_s: Array2::zeros(displacement_m.raw_dim()),
            displacement_m,
        });
        motion.displacement_m.row_mut(0).fill(None);
        motion.displacement_m.row_mut(1).iter_mut().flatten().for_each(|x| x.sigma = 1e-5);
        motion
    }

    #[test]
    fn a_body_that_sets_out_against_the_chain_is_told() {
        let struck: Experiment = toml::from_str(SMALL).unwrap();
        assert_eq!(against_the_chain(&struck, &pushed(1.0)), None);
        let told = against_the_chain(&struck, &pushed(-1.0)).unwrap();
        assert!(told.text.contains("body 2 sets out by 0.600 mm against"), "{told}");
        // What is noise sets out nowhere.
        let mut noise = pushed(-1.0);
        noise.displacement_m.iter_mut().flatten().for_each(|x| x.sigma = 1e-3);
        assert_eq!(against_the_chain(&struck, &noise), None);
        // What is let go or shaken may go either way.
        let shaken = Experiment { striker: None, ..struck };
        assert_eq!(against_the_chain(&shaken, &pushed(-1.0)), None);
    }
}
