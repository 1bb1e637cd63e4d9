//! What the views of a body say each for itself, about the motion that all of them say together.

use std::collections::BTreeMap;

use chainwave_measurement::Estimate;

use crate::body_response::Contribution;
use crate::fitted::Fitted;
use crate::fitted_body::FittedTime;
use crate::state::AlignmentState;

/// What a body's readings in one view leave of the merged motion, all trials of the view together.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftByView {
    /// The body's number, from 1.
    pub body: usize,
    /// The view's.
    pub view: u32,
    /// Motion time in seconds, and the mean of the view's readings less the motion at their drives, in metres, where trials of the view saw the
    /// body. Its sigma is that of the readings' noise, as large as the body's readings scatter.
    pub left_m: Vec<(f64, Estimate)>,
}

impl AlignmentState<'_> {
    /// What each view leaves of the bodies that more than one view saw; `ratios` are the residuals' rms over what the trackers' sigma lets expect, by
    /// body.
    pub(crate) fn left_by_views(&self, field: &Fitted, ratios: &[f64]) -> Vec<LeftByView> {
        let mut of_views = Vec::new();
        for (row, of_body) in field.iter().enumerate() {
            let mut own: BTreeMap<u32, Vec<(f64, Estimate)>> = BTreeMap::new();
            for (i, FittedTime { contributions, response }) in of_body.times().enumerate() {
                let mut sums: BTreeMap<u32, [f64; 2]> = BTreeMap::new();
                for one in contributions {
                    let left_m = one.read.value - response.at(self.drive[one.recording]);
                    let [weight, sum] = sums.entry(self.view_of(one)).or_default();
                    *weight += one.weight();
                    *sum += one.weight() * left_m;
                }
                for (view, [weight, sum]) in sums {
                    let left_m = Estimate::new(sum / weight, ratios[row] / weight.sqrt());
                    own.entry(view).or_default().push((self.times_s[i], left_m));
                }
            }
            if own.len() > 1 {
                of_views.extend(own.into_iter().map(|(view, left_m)| LeftByView {
                    body: row + 1,
                    view,
                    left_m,
                }));
            }
        }
        of_views
    }

    fn view_of(&self, one: &Contribution) -> u32 {
        self.observations[one.recording].view
    }
}
