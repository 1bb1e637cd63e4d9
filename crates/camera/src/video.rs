//! AVI, MP4 and Matroska video at the depth the codec has: uncompressed gray of eight bits where it lies, other eight bits decoded by the
//! program's [`crate::VisionLibrary`], and what that would cut to eight by the program `ffmpeg`, with the same codecs.

mod container;
mod deep;
mod layout;
mod plain;
mod player;

use std::path::Path;

use crate::candidate::Candidate;
use crate::format::{Format, Opened, itself};
use crate::library::needed;
use crate::options::OpenOptions;

pub(crate) const FORMAT: Format = Format {
    name: "AVI, MP4 or Matroska video",
    recognises: |candidate| container(&candidate.head).is_some(),
    open,
    files: itself,
};

/// Name of the container that a file's first bytes belong to.
pub(crate) fn container(head: &[u8]) -> Option<&'static str> {
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

/// Whether a file is a video that a library has to decode.
pub(crate) fn takes_library(candidate: &Candidate) -> bool {
    match container(&candidate.head) {
        Some("AVI") => !plain::is_plain(candidate.path),
        found => found.is_some(),
    }
}

/// What is said of a video's times.
fn timing_warning(rate_hz: f64, stated_hz: f64) -> String {
    format!(
        "a video holds no trigger: t = 0 is its first frame, at {rate_hz} Hz; the file states {stated_hz} Hz"
    )
}

fn open(path: &Path, options: &OpenOptions) -> Opened {
    if let Some(opened) = plain::open(path, options) {
        return opened;
    }
    let container = container(&crate::candidate::read_head(path)?).unwrap_or("unknown");
    player::open(path, container, needed(path, "video")?, options)
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
