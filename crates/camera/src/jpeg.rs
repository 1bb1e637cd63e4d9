//! JPEG images of 8 bits, decoded by the library `zune-jpeg`: gray, or colours without any colour in them.

use std::io::Cursor;
use std::path::Path;

use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::bytes::Bytes;
use crate::error::CameraError;
use crate::picture::{Gray, Picture};
use crate::tiff;

pub(crate) const MAGIC: &[u8] = b"\xFF\xD8\xFF";

/// What a careful reader should know of such images.
pub(crate) const LOSSY: &str = "JPEG compression is lossy: it alters texture by an amount that differs from block to block and \
                                from frame to frame, which no noise estimate tells";

/// Pixels that a byte can hold: a block of 64 takes one bit at least, in the scan of its mean.
const MOST_PIXELS_A_BYTE: usize = 512;
/// Blue and red of what has no colour.
const NO_COLOUR: u8 = 128;

/// Decodes a JPEG; one that ends early or is damaged is an error.
pub(crate) fn load(path: &Path) -> Result<Picture, CameraError> {
    let data = std::fs::read(path).map_err(|source| CameraError::Io { path: path.into(), source })?;
    let refused = |reason: String| CameraError::Decoder { path: path.into(), reason };
    let failed = |error: DecodeErrors| refused(error.to_string());
    // What was cut off would be filled with gray.
    if !is_ended(&data) {
        return Err(refused("the JPEG ends before its end marker (FF D9)".into()));
    }
    let options = DecoderOptions::default().set_strict_mode(true);
    let mut decoder = JpegDecoder::new_with_options(Cursor::new(&data), options);
    decoder.decode_headers().map_err(failed)?;
    let (Some((width_px, height_px)), Some(colours)) = (decoder.dimensions(), decoder.input_colorspace())
    else {
        return Err(refused("expected a size, found none".into()));
    };
    if width_px * height_px > data.len().saturating_mul(MOST_PIXELS_A_BYTE) {
        let n_bytes = data.len();
        return Err(refused(format!(
            "{width_px} x {height_px} px cannot come from a file of {n_bytes} bytes"
        )));
    }
    let orientation = decoder.exif().map_or(1, |exif| tiff::orientation(Bytes::new(path, exif)));
    if orientation != 1 {
        return Err(CameraError::Unsupported {
            path: path.into(),
            what: format!("a turned or mirrored picture (EXIF orientation {orientation})"),
            hint: "save with the top row first, orientation 1".into(),
        });
    }
    let n_channels = match colours {
        ColorSpace::Luma => 1,
        ColorSpace::YCbCr | ColorSpace::RGB => 3,
        other => {
            let what = format!("a JPEG in {other:?}");
            return Err(CameraError::Unsupported { path: path.into(), what, hint: "save it as gray".into() });
        }
    };
    // Taken as they are stored: no arithmetic stands between the file's brightness and the counts.
    decoder.set_options(options.jpeg_set_out_colorspace(colours));
    let samples = decoder.decode().map_err(failed)?;
    if samples.len() != width_px * height_px * n_channels {
        return Err(refused(format!(
            "expected {width_px} x {height_px} px, found {} samples",
            samples.len()
        )));
    }
    let gray = |pixel: &[u8]| match (colours, pixel) {
        (ColorSpace::Luma, &[level]) | (ColorSpace::YCbCr, &[level, NO_COLOUR, NO_COLOUR]) => {
            Some(level.into())
        }
        (ColorSpace::RGB, &[red, green, blue]) if red == green && green == blue => Some(red.into()),
        _ => None,
    };
    let counts: Option<Vec<u16>> = samples.chunks_exact(n_channels).map(gray).collect();
    let reason = "a JPEG with colours in it";
    let counts = counts.ok_or_else(|| CameraError::Colour { path: path.into(), reason: reason.into() })?;
    Ok(Picture::Decoded(Gray { width_px, height_px, bits: 8, counts }))
}

/// Whether an end marker follows the start of the last scan; neither can occur among compressed pixels.
fn is_ended(data: &[u8]) -> bool {
    let last = |marker: u8| data.windows(2).rposition(|pair| pair == [0xFF, marker]);
    last(0xD9) > last(0xDA)
}
