//! Where views and bodies are at rest: scales, magnifications, and the places of the stage.

mod even_light;
pub(crate) mod geometry_at_rest;
pub(crate) mod magnification;
pub(crate) mod marker_pair;
pub(crate) mod scale;
pub(crate) mod stages;
