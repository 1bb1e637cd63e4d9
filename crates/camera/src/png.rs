//! PNG images of 8 or 16 bits, decoded by the library `png`.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use png::{BitDepth, ColorType};

use crate::error::CameraError;
use crate::picture::{Gray, Picture, PictureShape, is_plausible};

pub(crate) const MAGIC: &[u8] = b"\x89PNG\r\n\x1A\n";

/// Decodes a PNG of 8 or 16 bits: gray, or with colours that are all equal; opacity is left out.
pub(crate) fn load(path: &Path) -> Result<Picture, CameraError> {
    let io_error = |source| CameraError::Io { path: path.into(), source };
    let failed =
        |error: png::DecodingError| CameraError::Decoder { path: path.into(), reason: error.to_string() };
    let file = File::open(path).map_err(io_error)?;
    let file_bytes = file.metadata().map_err(io_error)?.len();
    let mut reader = png::Decoder::new(BufReader::new(file)).read_info().map_err(failed)?;
    let info = reader.info();
    let (width_px, height_px) = (info.width as usize, info.height as usize);
    let (colour, depth) = (info.color_type, info.bit_depth);
    let n_channels = colour.samples();
    if !is_plausible(width_px as u128 * height_px as u128 * n_channels as u128, file_bytes) {
        let reason = format!("{width_px} x {height_px} px cannot come from a file of {file_bytes} bytes");
        return Err(CameraError::Decoder { path: path.into(), reason });
    }
    refuse_other_kinds(path, colour, depth)?;
    let mut samples = vec![0; reader.output_buffer_size()];
    reader.next_frame(&mut samples).map_err(failed)?;
    let (bits, samples): (u32, Vec<u16>) = if depth == BitDepth::Sixteen {
        (16, samples.as_chunks().0.iter().map(|&pair| u16::from_be_bytes(pair)).collect())
    } else {
        (8, samples.into_iter().map(u16::from).collect())
    };
    let gray = Gray::from_channels(PictureShape { width_px, height_px, bits }, n_channels, &samples);
    gray.map(Picture::Decoded).ok_or_else(|| CameraError::Colour {
        path: path.into(),
        reason: "pixels whose red, green and blue differ".into(),
    })
}

fn refuse_other_kinds(path: &Path, colour: ColorType, depth: BitDepth) -> Result<(), CameraError> {
    let is_readable = matches!(depth, BitDepth::Eight | BitDepth::Sixteen) && colour != ColorType::Indexed;
    if is_readable {
        return Ok(());
    }
    Err(CameraError::Unsupported {
        path: path.into(),
        what: format!("a PNG of {} bits ({colour:?})", depth as u8),
        hint: "save it as gray of 8 or 16 bits".into(),
    })
}
