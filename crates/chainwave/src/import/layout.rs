//! How a foreign file of numbers is written.

use serde::Deserialize;

/// How a file is written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Layout {
    /// What stands between numbers.
    pub(super) separator: Separator,
    /// Lines above the numbers.
    #[serde(default)]
    pub(super) head_lines: usize,
    /// Whether a body's numbers stand below each other or in a line.
    pub(super) bodies: Direction,
}

/// What stands between numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Separator {
    Comma,
    Semicolon,
    Blanks,
}

/// How a body's numbers stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Direction {
    /// Each body has a column, each line is an instant.
    Columns,
    /// Each body has a line, each column is an instant.
    Lines,
}
