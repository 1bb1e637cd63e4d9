//! What is found as tables, with the columns that others rely on: tracks, fields, motions, and what is measured of them.

pub(crate) mod field;
pub(crate) mod motion;
pub(crate) mod pulses;
pub(crate) mod result_table;
pub(crate) mod simulated;
pub(crate) mod tracks;
pub(crate) mod wave;
