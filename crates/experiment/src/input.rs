//! What users write, as it is read: texts, tables and the numbers in them, and what a file holds.

pub(crate) mod content;
pub(crate) mod numbers;
pub(crate) mod table;
pub(crate) mod text_file;
