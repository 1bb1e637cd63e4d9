//! What no width of vectors may change.

#[cfg(test)]
mod instruction_sets;
