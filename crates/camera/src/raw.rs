//! Files of pixels without a header, whose geometry the caller states.

use std::path::Path;

use crate::bytes::Bytes;
use crate::error::CameraError;
use crate::file_recording::{FileRecording, without_camera};
use crate::flat::FlatFrames;
use crate::format::Opened;
use crate::mapping::map_file;
use crate::options::OpenOptions;
use crate::partial;
use crate::picture::PictureShape;
use crate::raster::Raster;
use crate::raw_geometry::RawGeometry;
use crate::stated_depth::CheckedRows;
use crate::timing::{Timing, unstated_depth};

/// Opens a file of pixels without header.
///
/// The number of frames follows from the size of the file. What shows that the geometry is wrong is an error: a size that is no
/// whole number of frames (unless [`OpenOptions::partial`] asks for the whole ones), and counts of the first frame above the stated
/// bits.
///
/// # Errors
/// [`CameraError`] as above, when the file cannot be read, and when the frame rate in `options` is none.
pub fn open_raw(path: &Path, geometry: RawGeometry, options: &OpenOptions) -> Opened {
    options.check(path)?;
    let map = map_file(path)?;
    let bytes = Bytes::new(path, &map);
    let raster = geometry.raster().ok_or_else(|| CameraError::RawGeometry {
        expected: "rows that fit into a file".into(),
        found: geometry.to_string(),
    })?;
    let (n_frames, cut) = n_frames(bytes, geometry, &raster, options)?;
    check_counts(bytes, geometry, &raster)?;
    let timing = Timing::of(0..n_frames as u64, options, None);
    let mut remarks = vec![format!(
        "the file has no header: its pixels are taken for {geometry}, which nothing in it confirms"
    )];
    remarks.extend(unstated_depth(geometry.bits()));
    remarks.extend(cut);
    let shape = PictureShape {
        width_px: geometry.width_px(),
        height_px: geometry.height_px(),
        bits: geometry.bits(),
    };
    let info = without_camera(format!("raw {geometry}"), shape, timing, remarks);
    let frames = FlatFrames::new(path, map, raster, 0);
    Ok(Box::new(FileRecording::new(path, info, frames, options)))
}

/// The whole frames of the file, and a warning where a part of one follows them.
fn n_frames(
    bytes: Bytes,
    geometry: RawGeometry,
    raster: &Raster,
    options: &OpenOptions,
) -> Result<(usize, Option<String>), CameraError> {
    let frame_bytes = raster.frame_bytes();
    let (n_whole, rest) = (bytes.len() / frame_bytes, bytes.len() % frame_bytes);
    match (n_whole, rest) {
        (1.., 0) => Ok((n_whole as usize, None)),
        (1.., _) if options.partial => {
            Ok((n_whole as usize, Some(partial::warning(n_whole as usize, Some(n_whole as usize + 1)))))
        }
        _ => Err(bytes.malformed(
            format_args!("frames of {geometry}"),
            n_whole * frame_bytes,
            format_args!("a whole number of frames of {frame_bytes} bytes"),
            format_args!("{n_whole} and {rest} bytes (is the geometry right? the whole frames of a file that was cut are read on request)"),
        )),
    }
}

/// Refuses a geometry of fewer bits than the pixels in the middle rows of the first frame have.
fn check_counts(bytes: Bytes, geometry: RawGeometry, raster: &Raster) -> Result<(), CameraError> {
    let rows = CheckedRows::of(raster, bytes.slice("first frame", 0, raster.frame_bytes())?);
    let Some(highest) = rows.above(geometry.bits()) else { return Ok(()) };
    let full_scale = (1_u32 << geometry.bits()) - 1;
    let at = (rows.region.y * raster.row_bytes) as u64;
    let expected = format_args!("counts up to {full_scale}");
    let found = format_args!("{highest} (are the bits and the order of bytes, le or be, right?)");
    Err(bytes.malformed(format_args!("pixels of {geometry}"), at, expected, found))
}
