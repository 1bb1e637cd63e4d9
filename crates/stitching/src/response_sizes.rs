//! How large bodies' responses to the drive are where the recordings do not tell it: bounds in an alignment, and errors behind it.

/// How a body's response to the drive departs from its motion: root mean squares over time, relative to that of the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponseSizes {
    /// Of S - X: how far the response of first order differs from plain scaling.
    pub slope: f64,
    /// Of Q, that of second order.
    pub curvature: f64,
    /// Of Q - (S - X): how far that differs from what a weak non-linearity makes of the first order, in all bodies of a view alike.
    pub non_linearity: f64,
    /// Of that of third order, which is not fitted.
    pub third_order: f64,
}

impl ResponseSizes {
    /// Those of a softening chain (the paper's, of 12 and 26 bodies, at 0.83 to 2.73 m/s), rather too wide: S - X and Q are 0.01 to 0.45 there, the
    /// least where the strike is slow, the most in the last bodies; a drive's scale is found only within some tenths, which adds to the first. Q - (S - X)
    /// is 0.001 to 0.13, one sign over a whole pulse; the third order up to 0.35 in the last bodies.
    pub const USUAL: Self = Self { slope: 1.0, curvature: 0.5, non_linearity: 0.15, third_order: 0.2 };

    /// The larger of each.
    pub(crate) fn at_least(self, other: Self) -> Self {
        Self {
            slope: self.slope.max(other.slope),
            curvature: self.curvature.max(other.curvature),
            non_linearity: self.non_linearity.max(other.non_linearity),
            third_order: self.third_order.max(other.third_order),
        }
    }
}
