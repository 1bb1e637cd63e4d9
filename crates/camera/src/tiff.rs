//! TIFF and BigTIFF: one image, or a stack of images of one size; 8 to 16 bit gray.
//!
//! The directories are read here, so that uncompressed images, which is what cameras write, are read by region where
//! they lie. Compressed images are decoded by the library `tiff`.

mod coded;
mod directory;
mod page;
mod stack;

use std::path::Path;

use crate::bytes::Bytes;
use crate::mapping::map_file;
use crate::picture::Picture;
use crate::{CameraError, Format};
use directory::Reader;
pub(crate) use directory::is_tiff;
use page::{Page, Storage};

pub(crate) const FORMAT: Format = Format {
    name: "TIFF image or stack",
    recognises: |candidate| is_tiff(&candidate.head),
    open: stack::open,
};

/// The first image of a file.
pub(crate) fn load(path: &Path) -> Result<Picture, CameraError> {
    let map = map_file(path)?;
    let reader = Reader::new(Bytes::new(path, &map))?;
    let directories = reader.directories()?;
    let first = directories.first().ok_or_else(|| no_image(&reader))?;
    let page = Page::read(&reader, first)?;
    match page.storage {
        Storage::Plain { raster, strips } => Ok(Picture::Mapped { map, raster, strips }),
        Storage::Coded => coded::Decoder::open(path, page.width_px * page.height_px)
            .and_then(|mut decoder| decoder.image(0, (page.width_px, page.height_px, page.bits)))
            .map(Picture::Decoded)
            .map_err(|reason| CameraError::Decoder { path: path.into(), reason }),
    }
}

fn no_image(reader: &Reader) -> CameraError {
    reader.bytes.malformed("first directory's offset", 4, "at least one image", "none")
}
