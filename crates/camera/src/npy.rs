//! NumPy's .npy: an array of unsigned integers of 8 or 16 bit, frame by frame, `[frame, row, column]`.

mod header;

use std::path::Path;

use crate::bytes::Bytes;
use crate::file_recording::{FileRecording, without_camera};
use crate::flat::FlatFrames;
use crate::format::{Format, Opened, itself};
use crate::mapping::map_file;
use crate::options::OpenOptions;
use crate::picture::PictureShape;
use crate::raster::Raster;
use crate::timing::{Timing, unstated_depth};
use header::NpyHeader;

pub(crate) const FORMAT: Format = Format {
    name: "NumPy .npy (starts with 93 NUMPY)",
    recognises: |candidate| candidate.head.starts_with(header::MAGIC),
    open,
    files: itself,
};

fn open(path: &Path, options: &OpenOptions) -> Opened {
    let map = map_file(path)?;
    let bytes = Bytes::new(path, &map);
    let header = NpyHeader::read(bytes)?;
    let raster = Raster::plain(header.packing, header.width_px, header.height_px).ok_or_else(|| {
        bytes.malformed("array shape", header.text_offset, "rows that fit into a file", header.width_px)
    })?;
    let (n_frames, cut) = FlatFrames::n_whole(bytes, &raster, header.data_offset, header.n_frames, options)?;
    let bit_depth = header.packing.stored_bits();
    let timing = Timing::of(0..n_frames as u64, options, None);
    let remarks = unstated_depth(bit_depth).into_iter().chain(cut).collect();
    let shape = PictureShape { width_px: header.width_px, height_px: header.height_px, bits: bit_depth };
    let info = without_camera(format!("npy {bit_depth} bit"), shape, timing, remarks);
    let frames = FlatFrames::new(path, map, raster, header.data_offset);
    Ok(Box::new(FileRecording::new(path, info, frames, options)))
}
