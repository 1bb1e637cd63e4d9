//! What files say against themselves, and edges beside subsets.

use chainwave_measurement::RecordingInfo;

use crate::tracking::follow::EdgeNote;

/// What a file says against itself: steps of its time stamps, a header that contradicts them, and the like; and edges that bias its
/// tracks.
pub(crate) fn remarks(info: &RecordingInfo, edges: &[EdgeNote]) -> Vec<String> {
    info.warnings.iter().cloned().chain(sharp_edges(edges)).collect()
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
