//! Counts of a first frame, which the depth that is stated of a recording is held against.

use chainwave_measurement::Region;

use crate::raster::Raster;

/// Rows of the first frame that are looked at.
const N_CHECKED_ROWS: usize = 16;

/// Counts of some rows.
pub(crate) struct CheckedRows {
    pub(crate) region: Region,
    pub(crate) counts: Vec<f32>,
}

impl CheckedRows {
    /// Of the rows in the middle of a frame, whose pixels `image` holds.
    pub(crate) fn of(raster: &Raster, image: &[u8]) -> Self {
        let height = raster.height_px.min(N_CHECKED_ROWS);
        let region = Region { x: 0, y: (raster.height_px - height) / 2, width: raster.width_px, height };
        let mut counts = vec![0.0; region.n_pixels()];
        raster.unpack(image, region, &mut counts);
        Self { region, counts }
    }

    /// The highest count, where it is above those of so many bits.
    pub(crate) fn above(&self, bits: u32) -> Option<f32> {
        let highest = self.counts.iter().copied().fold(0.0, f32::max);
        // Exact: depths are of 16 bits at most.
        (highest >= 2_f32.powi(bits as i32)).then_some(highest)
    }
}
