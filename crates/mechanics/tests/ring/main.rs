//! The ring model against closed forms, conservation laws and its order of convergence.

#[cfg(test)]
mod statics;
