//! AVI, MP4 and Matroska video at the depth the codec has: uncompressed gray of eight bits where it lies, other eight bits decoded by the
//! program's [`crate::VisionLibrary`], and what that would cut to eight by the program `ffmpeg`, with the same codecs.

mod container;
mod deep;
mod layout;
mod plain;
mod player;

use std::path::Path;

use crate::candidate::Candidate;
use crate::error::VIDEO;
use crate::format::{Format, Opened, itself};
use crate::library::needed;
use crate::options::OpenOptions;
use crate::timing::Timing;

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

/// Times of frames that were taken `steps` intervals after the first: at the caller's rate, else at that which the file states, where it is one.
fn timing(steps: impl Iterator<Item = u64>, options: &OpenOptions, stated_hz: f64) -> Timing {
    let stated_hz = Some(stated_hz).filter(|stated_hz| stated_hz.is_finite() && *stated_hz > 0.0);
    let Some(rate_hz) = options.rate_hz.or(stated_hz) else { return Timing::of(steps, options, None) };
    let stated = stated_hz.map_or("no frame rate".into(), |stated_hz| format!("{stated_hz} Hz"));
    Timing {
        rate_hz: Some(rate_hz),
        times_s: steps.map(|step| step as f64 / rate_hz).collect(),
        warning: format!(
            "a video holds no trigger: t = 0 is its first frame, at {rate_hz} Hz; the file states {stated}"
        ),
    }
}

fn open(path: &Path, options: &OpenOptions) -> Opened {
    if let Some(opened) = plain::open(path, options) {
        return opened;
    }
    let container = container(&crate::candidate::read_head(path)?).unwrap_or("unknown");
    player::open(path, container, needed(path, VIDEO)?, options)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_callers_rate_stands_for_one_that_the_file_does_not_state() {
        let given = OpenOptions { rate_hz: Some(2000.0), ..OpenOptions::default() };
        for stated_hz in [0.0, -25.0, f64::NAN, f64::INFINITY] {
            let timed = timing([0, 1, 4].into_iter(), &given, stated_hz);
            assert_eq!((timed.rate_hz, timed.times_s), (Some(2000.0), vec![0.0, 1.0 / 2000.0, 4.0 / 2000.0]));
            assert!(timed.warning.contains("the file states no frame rate"), "{}", timed.warning);
            let counted = timing([0, 1, 4].into_iter(), &OpenOptions::default(), stated_hz);
            assert_eq!((counted.rate_hz, counted.times_s), (None, vec![0.0, 1.0, 4.0]));
            assert!(counted.warning.contains("times count frames"), "{}", counted.warning);
        }
        assert!(timing(0..2, &given, 25.0).warning.contains("at 2000 Hz; the file states 25 Hz"));
    }

    #[test]
    fn containers_are_known_by_their_marks() {
        assert_eq!(container(b"RIFF\x10\0\0\0AVI LIST"), Some("AVI"));
        assert_eq!(container(b"\0\0\0\x18ftypisom"), Some("MP4"));
        assert_eq!(container(&[0x1A, 0x45, 0xDF, 0xA3, 0x01]), Some("MKV"));
        assert_eq!(container(b"RIFF\x10\0\0\0WAVEfmt "), None);
        assert_eq!(container(b""), None);
    }
}
