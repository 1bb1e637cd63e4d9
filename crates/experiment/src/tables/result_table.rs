//! Tables of results: named columns as every writer of tables takes them.

/// A table of results: columns of one length, each with its name.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ResultTable {
    /// The columns, in their order.
    pub columns: Vec<(&'static str, Values)>,
}

/// The values of a column; `None` where a value was lost.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Texts.
    Texts(Vec<String>),
    /// Whole numbers from 0.
    Counts(Vec<u32>),
    /// Whole numbers from 0, or nothing.
    MaybeCounts(Vec<Option<u32>>),
    /// Numbers.
    Numbers(Vec<f64>),
    /// Numbers, or nothing.
    MaybeNumbers(Vec<Option<f64>>),
}

impl Values {
    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        match self {
            Self::Texts(values) => values.len(),
            Self::Counts(values) => values.len(),
            Self::MaybeCounts(values) => values.len(),
            Self::Numbers(values) => values.len(),
            Self::MaybeNumbers(values) => values.len(),
        }
    }
}

impl ResultTable {
    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, values)| values.n_rows())
    }
}

/// A column of a table.
pub(crate) fn column(name: &'static str, values: impl Into<Values>) -> (&'static str, Values) {
    (name, values.into())
}

impl From<Vec<String>> for Values {
    fn from(values: Vec<String>) -> Self {
        Self::Texts(values)
    }
}

impl From<Vec<&str>> for Values {
    fn from(values: Vec<&str>) -> Self {
        Self::Texts(values.into_iter().map(str::to_owned).collect())
    }
}

impl From<Vec<u32>> for Values {
    fn from(values: Vec<u32>) -> Self {
        Self::Counts(values)
    }
}

impl From<Vec<Option<u32>>> for Values {
    fn from(values: Vec<Option<u32>>) -> Self {
        Self::MaybeCounts(values)
    }
}

impl From<Vec<f64>> for Values {
    fn from(values: Vec<f64>) -> Self {
        Self::Numbers(values)
    }
}

impl From<Vec<Option<f64>>> for Values {
    fn from(values: Vec<Option<f64>>) -> Self {
        Self::MaybeNumbers(values)
    }
}
