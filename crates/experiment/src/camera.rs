//! What is known of a camera before it films a chain: how its pictures map places, and what its sensor adds.

pub(crate) mod calibration;
pub(crate) mod sensor;
