//! The measured wave as a map whose cursor is linked to its profile and histories, in the page itself.

use chainwave_experiment::Evaluation;
use chainwave_measurement::Estimate;
use chainwave_view::ShownWave;
use ndarray::Array2;

/// The map of strain with what it is linked to.
pub(super) fn section(evaluation: &Evaluation) -> String {
    let (strain, motion) = (&evaluation.measurement.strain, &evaluation.stitched.motion);
    let shown = ShownWave {
        times_s: strain.times_s.clone(),
        strain: rows(&strain.strain),
        displacement_m: rows(&motion.displacement_m),
    };
    format!(
        "<h2>The wave</h2><p>Click into the map, or move its cursor by the arrow keys: the curves below show the strain along the chain at that \
         time, and the histories of that gap and of the body before it.</p>{}",
        shown.as_section()
    )
}

fn rows(values: &Array2<Option<Estimate>>) -> Vec<Vec<Option<f64>>> {
    let of_row = |row: ndarray::ArrayView1<'_, Option<Estimate>>| {
        row.iter().map(|value| value.map(|found| found.value)).collect()
    };
    values.rows().into_iter().map(of_row).collect()
}
