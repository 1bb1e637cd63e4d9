//! One correction: which readings it is about, and what is done about them.

use std::ops::Range;

/// What is to be done about some readings of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Correction {
    /// Name of the recording in the trials table.
    pub recording: String,
    /// Number of the body, from 1; none for all that the recording shows, which only an exclusion may mean.
    pub body: Option<usize>,
    /// The first frame that it is about, from 0.
    pub first_frame: usize,
    /// The last frame that it is about; none for the recording's last.
    pub last_frame: Option<usize>,
    /// What is done.
    pub remedy: Remedy,
    /// Why, in the reader's words; may be empty.
    pub note: String,
}

/// What is done about readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Remedy {
    /// They are lost, for `excluded`.
    Exclude,
    /// The body is followed anew from this column and row, in pixels, of its centre in the first of the frames.
    Seed([f64; 2]),
    /// The body's subset is placed at this column and row, in pixels, of the frames at rest; about all frames.
    Place([f64; 2]),
}

impl Remedy {
    /// Its name in the column `action`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Exclude => "exclude",
            Self::Seed(_) => "seed",
            Self::Place(_) => "place",
        }
    }

    /// The column and row that it tells, in pixels.
    pub fn place_px(self) -> Option<[f64; 2]> {
        match self {
            Self::Exclude => None,
            Self::Seed(place_px) | Self::Place(place_px) => Some(place_px),
        }
    }
}

impl Correction {
    /// Its frames in a recording of `n_frames`.
    pub(super) fn frames(&self, n_frames: usize) -> Range<usize> {
        let end = self.last_frame.map_or(n_frames, |last| last.saturating_add(1).min(n_frames));
        self.first_frame.min(end)..end
    }

    pub(super) fn is_about(&self, recording: &str, body: usize) -> bool {
        self.recording == recording && self.body.is_none_or(|of| of == body)
    }
}
