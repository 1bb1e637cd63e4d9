//! The chain as its experiment states it: what moves it, what of it is measured, and how it moves by its own model.

pub(crate) mod bands;
pub(crate) mod chain_model;
pub(crate) mod measuring;
pub(crate) mod released;
pub(crate) mod scene;
pub(crate) mod stated_motion;
