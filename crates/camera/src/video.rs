//! AVI, MP4 and Matroska video (feature `opencv`), at the depth the codec has: eight bits decoded by OpenCV, and what it would cut
//! to eight by the program `ffmpeg`, with the same codecs.

#[cfg(feature = "opencv")]
mod container;
#[cfg(feature = "opencv")]
mod decoder;
#[cfg(feature = "opencv")]
mod deep;
#[cfg(feature = "opencv")]
mod frames;
#[cfg(feature = "opencv")]
mod layout;
#[cfg(feature = "opencv")]
mod player;

use std::path::Path;

#[cfg(not(feature = "opencv"))]
use crate::error::CameraError;
use crate::format::{Format, Opened};
use crate::options::OpenOptions;

pub(crate) const FORMAT: Format = Format {
    name: "AVI, MP4 or Matroska video",
    recognises: |candidate| container(&candidate.head).is_some(),
    open,
};

/// Name of the container that a file's first bytes belong to.
fn container(head: &[u8]) -> Option<&'static str> {
    let at = |offset: usize, mark: &[u8]| head.get(offset..).is_some_and(|bytes| bytes.starts_with(mark));
    if at(0, b"RIFF") && at(8, b"AVI ") {
        Some("AVI")
    } else if at(4, b"ftyp") {
        Some("MP4")
    } else if at(0, &[0x1A, 0x45, 0xDF, 0xA3]) {
        Some("MKV")
    } else {
        None
    }
}

#[cfg(feature = "opencv")]
fn open(path: &Path, options: &OpenOptions) -> Opened {
    let container = container(&crate::candidate::read_head(path)?).unwrap_or("unknown");
    player::open(path, container, options)
}

#[cfg(not(feature = "opencv"))]
fn open(path: &Path, _options: &OpenOptions) -> Opened {
    Err(CameraError::Unsupported {
        path: path.into(),
        what: "compressed video".into(),
        hint: "build with the feature `opencv`, or save the frames uncompressed".into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn containers_are_known_by_their_marks() {
        assert_eq!(container(b"RIFF\x10\0\0\0AVI LIST"), Some("AVI"));
        assert_eq!(container(b"\0\0\0\x18ftypisom"), Some("MP4"));
        assert_eq!(container(&[0x1A, 0x45, 0xDF, 0xA3, 0x01]), Some("MKV"));
        assert_eq!(container(b"RIFF\x10\0\0\0WAVEfmt "), None);
        assert_eq!(container(b""), None);
    }
}
