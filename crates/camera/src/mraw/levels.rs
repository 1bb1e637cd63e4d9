//! Significant bits of Photron's stored values: how many, and at which end.

use super::header::{MrawHeader, Side};
use crate::bytes::Bytes;
use crate::error::CameraError;
use crate::packing::Packing;
use crate::raster::Raster;
use crate::stated_depth::CheckedRows;

/// How stored values become counts.
pub(super) struct StoredLevels {
    pub(super) raster: Raster,
    /// Significant bits of a count.
    pub(super) bit_depth: u32,
    pub(super) warnings: Vec<String>,
}

impl StoredLevels {
    /// As the header says, unless the first frame shows that it is wrong.
    pub(super) fn of(bytes: Bytes, header: &MrawHeader) -> Result<Self, CameraError> {
        let raster = raster(bytes, header)?;
        let stored = header.stored_bits;
        let (depth, side) = (header.depth, header.side);
        if depth >= stored {
            return Ok(Self { raster, bit_depth: stored, warnings: lost_bits(header).into_iter().collect() });
        }
        let rows = CheckedRows::of(&raster, bytes.slice("first frame", 0, raster.frame_bytes())?);
        let agrees = match side {
            Side::Lower => rows.above(depth).is_none(),
            Side::Higher => {
                rows.counts.iter().all(|count| count % 2_f32.powi((stored - depth) as i32) == 0.0)
            }
        };
        if !agrees {
            let warning = format!(
                "the header says that counts are the {depth} {} bits of {stored}, but pixels of the first frame have \
                 others; all {stored} are taken",
                if side == Side::Lower { "lowest" } else { "highest" },
            );
            return Ok(Self { raster, bit_depth: stored, warnings: vec![warning] });
        }
        let scale = if side == Side::Higher { 2_f32.powi(depth as i32 - stored as i32) } else { 1.0 };
        Ok(Self { raster: Raster { scale, ..raster }, bit_depth: depth, warnings: Vec::new() })
    }
}

fn raster(bytes: Bytes, header: &MrawHeader) -> Result<Raster, CameraError> {
    let packing = match header.stored_bits {
        8 => Packing::Gray8,
        10 => Packing::Packed10,
        12 => Packing::Packed12,
        _ => Packing::Gray16Little,
    };
    Raster::plain(packing, header.width_px, header.height_px).ok_or_else(|| CameraError::Unsupported {
        path: bytes.path().into(),
        what: format!("rows of {} pixels of {} bits", header.width_px, header.stored_bits),
        hint: format!("a row is a multiple of {} pixels", packing.group_px()),
    })
}

/// What a file that keeps fewer bits than the camera gave has lost.
fn lost_bits(header: &MrawHeader) -> Option<String> {
    let (depth, stored) = (header.depth, header.stored_bits);
    (depth > stored).then(|| match header.side {
        Side::Higher => format!("only the highest {stored} of the camera's {depth} bits were saved"),
        Side::Lower => format!(
            "only the lowest {stored} of the camera's {depth} bits were saved: pixels above {} have wrapped round",
            (1_u32 << stored) - 1
        ),
    })
}
