//! What is known of an experiment before its recordings are merged.

use std::num::NonZero;

use chainwave_measurement::SharedReadingError;

use crate::response_sizes::ResponseSizes;
use crate::stated_response::StatedResponse;

/// What decides how the first body moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FirstBody {
    /// Forces, as where it is struck or let go: it begins in proportion to the drive.
    Free,
    /// The drive itself, as where a shaker holds it: it moves in proportion to the drive at all times.
    Imposed,
}

/// How to stitch.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Number of bodies in the chain.
    pub n_bodies: usize,
    /// Frames before this time show the chain at rest, in seconds after the trigger.
    pub rest_until_s: f64,
    /// How far drives may differ between trials, as a relative standard deviation.
    pub drive_prior: f64,
    /// Relative standard deviation of the drives about their mean, where it is known: it helps the first body's onset to tell their
    /// scale.
    pub drive_scatter: Option<f64>,
    /// What decides how body 1 moves.
    pub first_body: FirstBody,
    /// Standard deviation of the triggers' offsets from trial to trial of one view, where it is known, in seconds. It matters where views
    /// share no body; it is found from the trials otherwise.
    pub trigger_sigma_s: Option<f64>,
    /// The same from view to view, in common for all trials of a view. It is found otherwise from how evenly the wave arrives at one body
    /// after the other, where at least ten views of one body each tell.
    pub view_trigger_sigma_s: Option<f64>,
    /// How large responses to the drive are in any chain.
    pub response_sizes: ResponseSizes,
    /// How the stated chain's bodies answer to the drive, body by body, which tells how far their onsets depart from proportion to it;
    /// empty where no chain is stated.
    pub stated_responses: Vec<StatedResponse>,
    /// Errors that readings have in common, beside the noise in their sigmas.
    pub reading_errors: Vec<SharedReadingError>,
    /// Errors of a known shape that readings may have to any extent: how much of each they show is told, and nothing else is done.
    pub asked_errors: Vec<SharedReadingError>,
    /// Whether to tell how far clocks are off: nothing else is done with it.
    pub asks_for_clocks: bool,
    /// Threads that bodies are shared among; what is found does not depend on it.
    pub n_threads: NonZero<usize>,
}

impl Settings {
    /// Usual settings for a chain of `n_bodies` that rests until the trigger, less `trigger_margin_s`.
    ///
    /// The drives of repeated trials differ by less than 5 %.
    pub fn new(n_bodies: usize, trigger_margin_s: f64) -> Self {
        Self {
            n_bodies,
            rest_until_s: -trigger_margin_s,
            drive_prior: 0.05,
            drive_scatter: None,
            first_body: FirstBody::Free,
            trigger_sigma_s: None,
            view_trigger_sigma_s: None,
            response_sizes: ResponseSizes::USUAL,
            stated_responses: Vec::new(),
            reading_errors: Vec::new(),
            asked_errors: Vec::new(),
            asks_for_clocks: false,
            n_threads: NonZero::<usize>::MIN,
        }
    }

    /// How large the responses of the body in a row are, as errors of its motion: the usual ones, and those of the stated chain where they are larger.
    pub(crate) fn sizes_of(&self, row: usize) -> ResponseSizes {
        let usual = self.response_sizes;
        self.stated_responses.get(row).map_or(usual, |response| usual.at_least(response.sizes))
    }

    /// How far a recording's trigger may be off before it was looked at, as a standard deviation: a frame where nothing is stated.
    pub(crate) fn trigger_prior_s(&self, frame_interval_s: f64) -> f64 {
        let of_trial_s = self.trigger_sigma_s.unwrap_or(frame_interval_s);
        of_trial_s.hypot(self.view_trigger_sigma_s.unwrap_or(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stated_response::{HigherOrders, ModelResponse};

    #[test]
    fn a_stated_chain_widens_what_is_usual_and_narrows_nothing() {
        let silent =
            ModelResponse { interval_s: 1e-5, furthest_m: 0.0, motion_m: Vec::new(), slope_m: Vec::new() };
        let sizes = ResponseSizes { slope: 0.2, curvature: 0.1, non_linearity: 1.2, third_order: 3.5 };
        let stated_responses = vec![StatedResponse {
            stated: silent,
            otherwise: Vec::new(),
            sizes,
            orders: HigherOrders::default(),
        }];
        let settings = Settings { stated_responses, ..Settings::new(2, 0.0) };
        let expected = ResponseSizes { non_linearity: 1.2, third_order: 3.5, ..ResponseSizes::USUAL };
        assert_eq!(settings.sizes_of(0), expected);
        // Of a body of which nothing is stated.
        assert_eq!(settings.sizes_of(1), ResponseSizes::USUAL);
    }
}
