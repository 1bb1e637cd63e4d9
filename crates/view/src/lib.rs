//! A page on this machine that shows recordings: frames at full depth with window and level, subsets drawn on them, markers proposed.
//!
//! [`Server`] listens on 127.0.0.1 alone and answers whoever knows the token in its address; a port that `ssh -L` forwards serves from
//! elsewhere. What it shows is a [`Collection`]: names, paths and subsets as plain values, whoever made them.
//!
//! - **Only what is looked at is read.** A frame's request names a region, a scale and a window of counts; the region is read in bands of
//!   rows, so that neither the recording's size nor the frame's costs memory, and goes out as a PNG of 8 bits (`picture`).
//! - **A request is foreign bytes.** Its path and numbers are checked before use (`asked`, `cut`); it names recordings by their place in
//!   the collection and never a file. What is refused says place, expected, found and hint, as JSON (`refusal`).
//! - **Nobody else on the machine, and no page of another site, gets in:** a token of 128 random bits, compared in constant time, and the
//!   host that the browser thinks it talks to (`access`).
//!   Requests are parsed by the library `httparse`; their sizes, times and number are bounded here (`http`), since servers that were looked
//!   at allocate what a request announces before anybody knows who sends it.
//! - **Nothing is overwritten in silence.** Points are written under a temporary name, and take the place of others only if asked (`points`).
//! - **Readings are reviewed** in the order that somebody else gives, and corrections are handed to whoever keeps them (`review`), from a list
//!   that nobody changed meanwhile.
//! - **The page is one file** of HTML, CSS and JavaScript without a framework, that asks nothing of any other machine (`page`).
//!
//! Files import in one direction: `server` knows all, `site` answers with the others, which know no HTTP.

mod access;
mod asked;
mod collection;
mod cut;
mod error;
mod http;
mod match_pictures;
mod page;
mod picture;
mod points;
mod refusal;
mod replies;
mod review;
mod server;
mod set_up;
mod site;
mod wave;

pub use collection::{Collection, ShownRecording, ShownTrack};
pub use error::ViewError;
pub use points::table_cell;
pub use review::{KeepCorrections, QueuedReading, Review, ShownCorrection, ShownRemedy};
pub use server::Server;
pub use set_up::{ExperimentDraft, Picked, Question, WriteExperiment};
pub use wave::ShownWave;
