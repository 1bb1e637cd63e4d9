//! Whether bodies are where the experiment has them: texture under every subset, none beyond the chain's ends.

use chainwave_measurement::median;

use super::view_at_rest::{Facts, Place};
use crate::error::Error;
use crate::finding::Finding;
use crate::setup::Setup;

/// Steepness, relative to that of the usual body, below which a subset does not lie on a marker.
const BESIDE: f64 = 0.1;
/// Steepness, relative to that of the usual body, from which on a place looks like a body.
const LIKE_A_BODY: f64 = 0.4;
/// Share of the bodies that must lie on texture: what less do, noise makes.
const LEAST_TEXTURED: f64 = 0.25;
/// Share of the pixels under subsets that saturate, from which on that may be why they show no texture.
const SATURATED: f64 = 0.1;
/// Share of a subset that must be of use.
const LEAST_USED: f64 = 0.5;

/// Bodies whose subsets lie off texture.
///
/// # Errors
/// [`Error::Configuration`] where nearly all do.
pub(super) fn off_texture(setup: &Setup, facts: &[Facts]) -> Result<Vec<Finding>, Error> {
    let places: Vec<&Place> = facts.iter().flat_map(|facts| &facts.bodies).collect();
    let n_textured = places.iter().filter(|place| place.texture.is_some()).count();
    if let (Some(first), true) = (places.first(), (n_textured as f64) < LEAST_TEXTURED * places.len() as f64)
    {
        let saturated = places.iter().map(|place| place.saturated).sum::<f64>() / places.len() as f64;
        let of_light = match saturated > SATURATED {
            true => format!(
                "; {:.0} % of the pixels under them saturate (less light, a shorter exposure)",
                100.0 * saturated
            ),
            false => String::new(),
        };
        return Err(Error::Configuration {
            path: setup.path.clone(),
            message: format!(
                "camera.first_body_px, the scale and stage_m: expected texture under the subsets of bodies, found it under {n_textured} of \
                 {}, the first at ({:.1}, {:.1}){of_light} (hint: `chainwave inspect --sheet` shows where markers lie)",
                places.len(),
                first.at_px[0],
                first.at_px[1]
            ),
        });
    }
    let Some(usual) = usual_steepness(facts) else { return Ok(Vec::new()) };
    let tracking = &setup.experiment.tracking;
    let (width, height) = (2 * tracking.half_width_px + 1, 2 * tracking.half_height_px + 1);
    let of_place = |place: &Place| {
        let what = match place.texture {
            None => "no texture that a place could be told by".to_owned(),
            Some(texture) if texture.steepness < BESIDE * usual => {
                let share = 100.0 * texture.steepness / usual;
                format!("texture with {share:.1} % of the usual body's contrast")
            }
            Some(texture) if texture.used < LEAST_USED => {
                format!("only {:.0} % of the pixels are of use", 100.0 * texture.used)
            }
            Some(_) => return None,
        };
        let [x_px, y_px] = place.at_px;
        Some(format!("body {} at ({x_px:.1}, {y_px:.1}): {what}", place.body))
    };
    let of_view = |facts: &Facts| {
        let told: Vec<String> = facts.bodies.iter().filter_map(of_place).collect();
        (!told.is_empty()).then(|| Finding {
            code: "off_texture",
            subject: facts.view.clone(),
            text: format!(
                "subsets of {width} x {height} px should lie on the speckle of markers; found for {} (hint: camera.first_body_px, \
                 the scale, the stage, or the size of the subsets)",
                told.join("; ")
            ),
        })
    };
    Ok(facts.iter().filter_map(of_view).collect())
}

/// What looks like a body where the chain has none: then the first body is not where the experiment has it.
pub(super) fn beyond_the_ends(setup: &Setup, facts: &[Facts]) -> Vec<Finding> {
    let Some(usual) = usual_steepness(facts) else { return Vec::new() };
    let n_bodies = setup.experiment.chain.n_bodies;
    let of_place = |view: &str, place: &Place| {
        let like = place.texture?.steepness / usual;
        let [x_px, y_px] = place.at_px;
        let (end, what) = match place.body {
            0 => ("before body 1", "is body 1 there, or the striker, or is the stage a pitch off?"),
            _ => (
                "behind the last body",
                "does body 1 lie a pitch farther on, is n_bodies one too few, or the stage a pitch off?",
            ),
        };
        (like > LIKE_A_BODY).then(|| Finding {
            code: "body_beyond_the_chain",
            subject: "camera.first_body_px".into(),
            text: format!(
                "a pitch {end}, at ({x_px:.1}, {y_px:.1}) of {view}, the picture has texture as a body has ({:.0} % of the usual \
                 contrast), where a chain of {n_bodies} bodies has none (hint: {what})",
                100.0 * like
            ),
        })
    };
    facts
        .iter()
        .flat_map(|facts| facts.beyond.iter().filter_map(|place| of_place(&facts.view, place)))
        .collect()
}

/// Median over all bodies that have texture.
fn usual_steepness(facts: &[Facts]) -> Option<f64> {
    let textures = facts.iter().flat_map(|facts| &facts.bodies).filter_map(|place| place.texture);
    median(textures.map(|texture| texture.steepness).collect()).filter(|usual| *usual > 0.0)
}
