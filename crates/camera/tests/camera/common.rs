//! What is asked of recordings in many tests.

use chainwave_measurement::{Recording, Region};

/// All pixels of a frame.
pub(crate) fn frame(recording: &dyn Recording, frame: usize) -> Vec<f32> {
    let region = Region::whole(recording.info().width_px, recording.info().height_px);
    let mut pixels = vec![f32::NAN; region.n_pixels()];
    recording.read_region(frame, region, &mut pixels).unwrap();
    pixels
}

/// Whether a recording warns of something.
pub(crate) fn has_warning(recording: &dyn Recording, part: &str) -> bool {
    recording.info().warnings.iter().any(|warning| warning.contains(part))
}

/// Codes as the counts that a recording gives.
pub(crate) fn as_counts(codes: &[u16]) -> Vec<f32> {
    codes.iter().map(|&code| code.into()).collect()
}
