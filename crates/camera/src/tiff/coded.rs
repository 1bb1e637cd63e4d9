use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use tiff::decoder::{Decoder as TiffDecoder, DecodingResult, Limits};

use crate::picture::Gray;

/// The library's decoder of one file.
pub(super) struct Decoder(TiffDecoder<BufReader<File>>);

impl Decoder {
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

    /// The image of directory `index`, of the width, height and bits that the directory states.
    pub(super) fn image(&mut self, index: usize, shape: (usize, usize, u32)) -> Result<Gray, String> {
        let n_pixels = shape.0 * shape.1;
        let samples = self.samples(index).map_err(|error| error.to_string())?;
        let n_channels = samples.len().checked_div(n_pixels).unwrap_or(0);
        let gray = (n_channels > 0).then(|| Gray::from_channels(shape, n_channels, &samples)).flatten();
        gray.ok_or_else(|| {
            format!(
                "expected {} x {} gray pixels, found colours or {} numbers",
                shape.0,
                shape.1,
                samples.len()
            )
        })
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
