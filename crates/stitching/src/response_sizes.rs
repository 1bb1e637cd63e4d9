//! How large bodies' responses to the drive are where the recordings do not tell it: bounds in an alignment, and errors behind it.

use crate::settings::Settings;

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
    fn at_least(self, other: Self) -> Self {
        Self {
            slope: self.slope.max(other.slope),
            curvature: self.curvature.max(other.curvature),
            non_linearity: self.non_linearity.max(other.non_linearity),
            third_order: self.third_order.max(other.third_order),
        }
    }
}

impl Settings {
    /// Of the body in a row, as errors of its motion: the usual ones, and those of the stated chain where they are larger.
    pub(crate) fn sizes_of(&self, row: usize) -> ResponseSizes {
        let usual = self.response_sizes;
        self.stated_responses.get(row).map_or(usual, |response| usual.at_least(response.sizes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stated_response::{ModelResponse, StatedResponse};

    #[test]
    fn a_stated_chain_widens_what_is_usual_and_narrows_nothing() {
        let silent =
            ModelResponse { interval_s: 1e-5, furthest_m: 0.0, motion_m: Vec::new(), slope_m: Vec::new() };
        let sizes = ResponseSizes { slope: 0.2, curvature: 0.1, non_linearity: 1.2, third_order: 3.5 };
        let stated_responses = vec![StatedResponse { stated: silent, otherwise: Vec::new(), sizes }];
        let settings = Settings { stated_responses, ..Settings::new(2, 0.0) };
        let expected = ResponseSizes { non_linearity: 1.2, third_order: 3.5, ..ResponseSizes::USUAL };
        assert_eq!(settings.sizes_of(0), expected);
        // Of a body of which nothing is stated.
        assert_eq!(settings.sizes_of(1), ResponseSizes::USUAL);
    }
}
