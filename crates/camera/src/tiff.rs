//! TIFF and BigTIFF: one image, or a stack of images of one size; 8 to 16 bit gray.
//!
//! The directories are read here, so that uncompressed images, which is what cameras write, are read by region where
//! they lie. Compressed images are decoded by the library `tiff`.

mod coded;
mod description;
mod directory;
mod page;
mod stack;

use std::path::Path;

use crate::bytes::Bytes;
use crate::error::CameraError;
use crate::format::{Format, itself};
use crate::mapping::map_file;
use crate::picture::Picture;
use directory::Reader;
pub(crate) use directory::is_tiff;
use page::{Page, PageStorage};

pub(crate) const FORMAT: Format = Format {
    name: "TIFF image or stack",
    recognises: |candidate| is_tiff(&candidate.head),
    open: stack::open,
    files: itself,
};

/// The orientation that a TIFF directory states, such as cameras put into a JPEG: 1 where the top row comes first, and where nothing is said.
/// Directories behind a damaged one are not asked.
pub(crate) fn orientation(bytes: Bytes) -> u64 {
    let stated = Reader::new(bytes).and_then(|reader| {
        let mut directories = Vec::new();
        let walked = reader.walk(&mut directories);
        let Some(first) = directories.first() else { return walked.map(|()| None) };
        reader.value(first, page::ORIENTATION)
    });
    stated.ok().flatten().unwrap_or(1)
}

/// The first image of a file.
pub(crate) fn load(path: &Path) -> Result<Picture, CameraError> {
    let map = map_file(path)?;
    let reader = Reader::new(Bytes::new(path, &map))?;
    let directories = reader.directories()?;
    let first = directories.first().ok_or_else(|| reader.no_image())?;
    let page = Page::read(&reader, first)?;
    match page.storage {
        PageStorage::Plain { raster, strips } => {
            Ok(Picture::Mapped { map, raster, strips, bits: page.shape.bits })
        }
        PageStorage::Coded => {
            let mut decoder = coded::CodedImages::open(path, page.shape.n_pixels())
                .map_err(|reason| CameraError::Decoder { path: path.into(), reason })?;
            let gray = decoder.image(0, page.shape);
            gray.map(Picture::Decoded).map_err(|refusal| refusal.of(path))
        }
    }
}
