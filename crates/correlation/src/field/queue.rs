//! The order in which a field grows: the point with the best correlation first (reliability-guided).

use std::cmp::Ordering;

use crate::warp::Warp;

/// A point of a field from which its neighbours can be sought.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Candidate {
    pub(crate) zncc: f64,
    pub(crate) point: usize,
    pub(crate) warp: Warp,
}

/// The better correlation first, of equal ones the earlier point.
impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.zncc.total_cmp(&other.zncc).then(other.point.cmp(&self.point))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}
