//! Recordings by the views and trials of the experiment: where they come from, and which can be read.

pub(crate) mod failed_recording;
pub(crate) mod recording_state;
pub(crate) mod source;
pub(crate) mod unreadable_frames;
pub(crate) mod view;
