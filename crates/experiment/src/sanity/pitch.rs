//! The stated pitch and scale against the step at which the pictures repeat themselves.

use chainwave_measurement::{Estimate, median_and_robust_sigma};

use super::stated::scale_key;
use super::view_at_rest::Facts;
use crate::finding::Finding;
use crate::setup::Setup;

/// Views that agree better than this do so by chance, or as their markers lie alike on the pixels.
const LEAST_SIGMA: f64 = 0.001;
/// How well markers are placed on their bodies by hand, in metres: few views agree better by chance.
const PLACEMENT_M: f64 = 2e-4;

/// The stated scale or pitch, where the pictures contradict it by more than they scatter from view to view.
pub(super) fn contradicted(setup: &Setup, facts: &[Facts]) -> Option<Finding> {
    // Where gaps differ nothing repeats itself by the pitch.
    setup.experiment.chain.pitch_m.same()?;
    // Nor where a chain is held.
    if setup.experiment.is_released() {
        return None;
    }
    let pitch_m = setup.experiment.chain.mean_pitch_m();
    let told = || facts.iter().filter_map(|facts| Some((facts.bodies.len(), facts.pitch_px?)));
    let ratios: Vec<f64> = told().map(|(_, [stated, found])| found / stated).collect();
    // A step over all gaps of a view ends at two markers.
    let placement =
        |(n_bodies, _): (usize, _)| 2.0_f64.sqrt() * PLACEMENT_M / (pitch_m * (n_bodies as f64 - 1.0));
    let ratio = of_views(&ratios, told().map(placement).fold(0.0, f64::max))?;
    let scale = setup.map.m_per_px();
    let known = scale.sigma / scale.value;
    if (ratio.value - 1.0).abs() <= 3.0 * ratio.sigma.hypot(known) {
        return None;
    }
    let stated_px = pitch_m / scale.value;
    let px_per_m = scale.value.recip();
    Some(Finding {
        code: "pitch_in_picture",
        subject: format!("{} and chain.pitch_m", scale_key(setup)),
        text: format!(
            "neighbours should lie {stated_px:.2} px apart ({px_per_m:.1} px/m); in the pictures texture repeats itself every {:.2} +- {:.2} px, \
             {:+.1} % off: a scale of {:.1} px/m would fit the stated pitch",
            ratio.value * stated_px,
            ratio.sigma * stated_px,
            100.0 * (ratio.value - 1.0),
            ratio.value * px_per_m,
        ),
    })
}

/// The median over views with its standard uncertainty, for an error of each view at least; a view alone is believed to two per cent.
fn of_views(ratios: &[f64], of_each: f64) -> Option<Estimate> {
    const ONE_VIEW: f64 = 0.02;
    let [middle, scatter] = median_and_robust_sigma(ratios.to_vec())?;
    let n = ratios.len() as f64;
    let sigma = if ratios.len() < 3 { ONE_VIEW / n.sqrt() } else { of_each.max(1.5 * scatter) / n.sqrt() };
    Some(Estimate::new(middle, sigma.max(LEAST_SIGMA)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_views_tell_how_well_they_agree() {
        assert!(of_views(&[], 0.001).is_none());
        let told = of_views(&[1.01, 1.012, 1.011], 0.001).unwrap();
        assert!((told.value - 1.011).abs() < 1e-12 && told.sigma < 0.002, "{told:?}");
        // Three that agree by chance are no better known than their markers are placed.
        let alike = of_views(&[1.01, 1.01, 1.01], 0.003).unwrap();
        assert!((alike.sigma - 0.003 / 3.0_f64.sqrt()).abs() < 1e-12, "{alike:?}");
        assert!(of_views(&[1.01], 0.001).unwrap().sigma >= 0.02);
    }
}
