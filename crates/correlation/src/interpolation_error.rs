//! What interpolation itself does to a match, foreseen from its kernel and the reference: a bias of the place, and energy in the residual.

pub(crate) mod alias;
pub(crate) mod bias;
pub(crate) mod energy;
pub(crate) mod lagged;
