//! Compressed TIFF images, decoded by the library `tiff`.

use std::fmt::{Display, Formatter};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use tiff::decoder::{Decoder as TiffDecoder, DecodingResult, Limits};

use crate::error::CameraError;
use crate::picture::{Gray, PictureShape};

/// Why an image is not gray.
#[derive(Debug)]
pub(super) enum NotGray {
    /// Its red, green and blue differ.
    Colours,
    /// It could not be decoded, for this reason.
    Undecoded(String),
}

impl NotGray {
    /// The error for a recording at `path`.
    pub(super) fn of(self, path: &Path) -> CameraError {
        let reason = self.to_string();
        match self {
            Self::Colours => CameraError::Colour { path: path.into(), reason },
            Self::Undecoded(_) => CameraError::Decoder { path: path.into(), reason },
        }
    }
}

impl Display for NotGray {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Colours => formatter.write_str("pixels whose red, green and blue differ"),
            Self::Undecoded(reason) => formatter.write_str(reason),
        }
    }
}

/// The library's decoder of one file.
pub(super) struct CodedImages(TiffDecoder<BufReader<File>>);

impl CodedImages {
    /// A decoder of images of `n_pixels` pixels.
    pub(super) fn open(path: &Path, n_pixels: usize) -> Result<Self, String> {
        let file = File::open(path).map_err(|error| error.to_string())?;
        let file_bytes = file.metadata().map_err(|error| error.to_string())?.len();
        let decoder = TiffDecoder::new(BufReader::new(file)).map_err(|error| error.to_string())?;
        let mut limits = Limits::default();
        // Four samples of two bytes at most.
        limits.decoding_buffer_size = n_pixels.saturating_mul(8);
        limits.ifd_value_size = limits.ifd_value_size.min(file_bytes as usize);
        Ok(Self(decoder.with_limits(limits)))
    }

    /// The image of directory `index`, of the shape that the directory states.
    pub(super) fn image(&mut self, index: usize, shape: PictureShape) -> Result<Gray, NotGray> {
        let n_pixels = shape.n_pixels();
        let samples = self.samples(index).map_err(|error| NotGray::Undecoded(error.to_string()))?;
        match samples.len().checked_div(n_pixels) {
            Some(n_channels @ 1..) if samples.len() == n_channels * n_pixels => {
                Gray::from_channels(shape, n_channels, &samples).ok_or(NotGray::Colours)
            }
            _ => Err(NotGray::Undecoded(format!(
                "expected {} x {} gray pixels, found {} numbers",
                shape.width_px,
                shape.height_px,
                samples.len()
            ))),
        }
    }

    fn samples(&mut self, index: usize) -> tiff::TiffResult<Vec<u16>> {
        self.0.seek_to_image(index)?;
        let mut result = DecodingResult::U8(Vec::new());
        self.0.read_image_to_buffer(&mut result)?;
        Ok(match result {
            DecodingResult::U8(samples) => samples.into_iter().map(u16::from).collect(),
            DecodingResult::U16(samples) => samples,
            _ => Vec::new(),
        })
    }
}
