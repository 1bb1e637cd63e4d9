//! What stands behind the last body, as `experiment.toml` has it.

use chainwave_mechanics::FarEnd;
use serde::{Deserialize, Serialize};

/// What stands behind the last body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum FarEndTable {
    /// Nothing.
    #[default]
    Free,
    /// A wall, behind one more gap like the last.
    Fixed,
}

impl FarEndTable {
    pub(super) fn is_free(&self) -> bool {
        *self == Self::Free
    }
}

impl From<FarEndTable> for FarEnd {
    fn from(table: FarEndTable) -> Self {
        match table {
            FarEndTable::Free => Self::Free,
            FarEndTable::Fixed => Self::Fixed,
        }
    }
}
