//! What files say against themselves, and what subsets hold that biases them.

use chainwave_measurement::RecordingInfo;

use crate::tracking::follow::EdgeNote;

/// What a file says against itself: steps of its time stamps, a header that contradicts them, and the like; and edges and ground (a share of
/// the subsets of some bodies) that bias its tracks.
pub(crate) fn remarks(info: &RecordingInfo, edges: &[EdgeNote], ground: &[(usize, f64)]) -> Vec<String> {
    info.warnings.iter().cloned().chain(sharp_edges(edges)).chain(ground_in_subsets(ground)).collect()
}

/// One sentence on all bodies whose subsets hold ground.
fn ground_in_subsets(ground: &[(usize, f64)]) -> Option<String> {
    let largest = ground.iter().map(|(_, share)| *share).max_by(f64::total_cmp)?;
    let bodies: Vec<String> = ground.iter().map(|(body, _)| body.to_string()).collect();
    Some(format!(
        "ground that stays where it is when bodies move takes up to {:.0} % of the subsets of body {}: it was left out of their reference where matches \
         told that it holds them back (hint: a smaller half_width_px or half_height_px, so that subsets lie on their markers alone)",
        100.0 * largest,
        bodies.join(", ")
    ))
}

/// One sentence on all bodies beside whose subsets an edge runs.
fn sharp_edges(edges: &[EdgeNote]) -> Option<String> {
    let near = || edges.iter().filter(|note| note.edge.rings());
    let nearest_px = near().map(|note| note.edge.distance_px).min()?;
    let bodies: Vec<&str> = near().map(|note| note.point.as_str()).collect();
    Some(format!(
        "sharp edges run beside the subsets of body {}, the nearest {nearest_px} px off, and ring into them, which biases positions by \
         thousandths of a pixel; lines that are nearer than 2 px are left out: leave 5 px of texture around subsets (a smaller half_width_px or half_height_px)",
        bodies.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use chainwave_correlation::{SharpEdge, Side};

    use super::*;

    #[test]
    fn bodies_with_ground_stand_in_one_sentence() {
        assert_eq!(ground_in_subsets(&[]), None);
        let said = ground_in_subsets(&[(2, 0.12), (3, 0.344)]).unwrap();
        assert!(said.contains("up to 34 % of the subsets of body 2, 3:"), "{said}");
    }

    #[test]
    fn bodies_beside_an_edge_stand_in_one_sentence() {
        let note = |body: &str, distance_px| EdgeNote {
            point: body.into(),
            edge: SharpEdge { side: Side::Left, distance_px },
        };
        assert_eq!(sharp_edges(&[]), None);
        assert_eq!(sharp_edges(&[note("2", 4)]), None);
        let said = sharp_edges(&[note("3", 2), note("4", 1)]).unwrap();
        assert!(said.contains("body 3, 4, the nearest 1 px off"), "{said}");
    }
}
