//! `[[synthetic.views]]`: views that are filmed faster, longer or larger than the others.

use std::path::Path;

use chainwave_synthetic::{Camera, Marker, Specimen};
use serde::{Deserialize, Serialize};

use super::{Experiment, Synthetic, Trial, middle_px};
use crate::error::Error;
use crate::input::numbers::Positive;

/// Longest interval of simulated motions and of the truth.
const LONGEST_TRUTH_INTERVAL_S: f64 = 1e-5;

/// A view that is filmed in another way than `[synthetic]` has it: an entry of `[[synthetic.views]]`. What is left out is as there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilmedView {
    /// Number of the view.
    pub view: u32,
    /// Frames per second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<Positive>,
    /// Frames per second that the recordings state, in header and time stamps; without it those that they were filmed with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stated_rate_hz: Option<Positive>,
    /// Camera number of the first image.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_image: Option<i64>,
    /// Frames in a recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n_frames: Option<usize>,
    /// Magnification about the middle of the picture; the trials table that stands beside the recordings states it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale_px_per_m: Option<Positive>,
    /// How strongly its trials are driven, over how strongly those of other views are; nothing states it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive_factor: Option<Positive>,
}

/// How fast, how long and how large a view is filmed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Footage {
    pub(crate) rate_hz: f64,
    pub(crate) first_image: i64,
    pub(crate) n_frames: usize,
    /// On what `[synthetic.camera]` has.
    pub(crate) magnification: f64,
}

impl Footage {
    /// Time of the first image after the trigger, at the earliest.
    pub(crate) fn first_time_s(&self) -> f64 {
        self.first_image as f64 / self.rate_hz
    }

    /// Time that no image reaches.
    pub(crate) fn last_time_s(&self) -> f64 {
        self.first_time_s() + self.n_frames as f64 / self.rate_hz
    }

    /// The camera that films so.
    pub(crate) fn camera(&self, camera: &Camera) -> Camera {
        let scale_px_per_m = self.magnification * camera.scale_px_per_m;
        Camera { rate_hz: self.rate_hz, scale_px_per_m, ..camera.clone() }
    }

    /// The bodies with the speckles that they have in every view: what a camera sees larger has more pixels.
    pub(crate) fn specimen(&self, specimen: &Specimen) -> Specimen {
        let speckle_diameter_px = self.magnification * specimen.marker.speckle_diameter_px;
        let marker = Marker { speckle_diameter_px, ..specimen.marker.clone() };
        Specimen { marker, ..specimen.clone() }
    }

    /// Where the picture shows a point that the camera of `[synthetic]` shows at `at_px`.
    pub(crate) fn moved_px(&self, at_px: [f64; 2], camera: &Camera) -> [f64; 2] {
        let about_px = middle_px(camera.width_px, camera.height_px);
        // Of a view that is not magnified this is `at_px` to the last bit.
        [0, 1].map(|axis| at_px[axis] + (self.magnification - 1.0) * (at_px[axis] - about_px[axis]))
    }
}

impl Synthetic {
    /// The rate that the recordings of a view state where that is not the true one.
    pub(crate) fn stated_rate_hz(&self, view: u32) -> Option<f64> {
        self.entry(view)?.stated_rate_hz.map(Positive::get)
    }

    /// How strongly the trials of a view are driven, over how strongly all are.
    pub(crate) fn drive_factor(&self, view: u32) -> f64 {
        self.entry(view).and_then(|entry| entry.drive_factor).map_or(1.0, Positive::get)
    }

    /// How a view is filmed.
    pub(crate) fn footage(&self, view: u32) -> Footage {
        self.footage_of(self.entry(view))
    }

    fn entry(&self, view: u32) -> Option<&FilmedView> {
        self.views.iter().find(|entry| entry.view == view)
    }

    /// The time from the first image of any view to beyond the last one.
    pub(crate) fn span_s(&self) -> [f64; 2] {
        let first_s = self.footages().map(|footage| footage.first_time_s()).fold(f64::INFINITY, f64::min);
        let last_s = self.footages().map(|footage| footage.last_time_s()).fold(f64::NEG_INFINITY, f64::max);
        [first_s, last_s]
    }

    /// Interval of the simulated motion and of the truth. A camera that follows a motion takes eight frames or more of its shortest period, of which cubic
    /// interpolation over quarters of a frame leaves 4e-6 of the amplitude.
    pub(crate) fn truth_interval_s(&self) -> f64 {
        self.footages().map(|footage| 0.25 / footage.rate_hz).fold(LONGEST_TRUTH_INTERVAL_S, f64::min)
    }

    /// What is filmed of views with an entry of their own, and of all others.
    fn footages(&self) -> impl Iterator<Item = Footage> {
        std::iter::once(None).chain(self.views.iter().map(Some)).map(|view| self.footage_of(view))
    }

    fn footage_of(&self, view: Option<&FilmedView>) -> Footage {
        let scale_px_per_m = view.and_then(|view| view.scale_px_per_m);
        Footage {
            rate_hz: view.and_then(|view| view.rate_hz).map_or(self.camera.rate_hz, Positive::get),
            first_image: view.and_then(|view| view.first_image).unwrap_or(self.first_image),
            n_frames: view.and_then(|view| view.n_frames).unwrap_or(self.n_frames),
            magnification: scale_px_per_m.map_or(1.0, |scale| scale.get() / self.camera.scale_px_per_m),
        }
    }

    /// Refuses views that stand there twice or that no trial has; `path` is the experiment.
    pub(crate) fn check_views(&self, trials: &[Trial], path: &Path) -> Result<(), Error> {
        let wrong = |message: String| Error::Configuration { path: path.to_owned(), message };
        for (index, FilmedView { view, .. }) in self.views.iter().enumerate() {
            if self.views[..index].iter().any(|earlier| earlier.view == *view) {
                return Err(wrong(format!(
                    "[[synthetic.views]]: expected each view once, found view {view} again"
                )));
            }
            if trials.iter().all(|trial| trial.view != *view) {
                return Err(wrong(format!(
                    "[[synthetic.views]]: expected views of the trials table, found view {view}"
                )));
            }
        }
        Ok(())
    }
}

impl Experiment {
    /// The trials with the magnifications that views are filmed at, where the table states none for them.
    #[must_use]
    pub fn with_scales_of_views(&self, trials: &[Trial]) -> Vec<Trial> {
        let views = self.synthetic.as_ref().map_or(&[][..], |synthetic| &synthetic.views);
        let stated = |trial: &Trial| {
            let filmed = views.iter().find(|entry| entry.view == trial.view);
            let filmed = filmed.and_then(|entry| entry.scale_px_per_m).map(Positive::get);
            Trial { scale_px_per_m: trial.scale_px_per_m.or(filmed), ..trial.clone() }
        };
        trials.iter().map(stated).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small(more: &str) -> Experiment {
        let text = include_str!("../../../../tests/small-experiment/experiment.toml");
        toml::from_str(&format!("{text}{more}")).unwrap()
    }

    fn trial(view: u32, scale_px_per_m: Option<f64>) -> Trial {
        Trial {
            recording: format!("view{view}.cine"),
            view,
            trial: 1,
            stage_m: 0.0,
            scale_px_per_m,
            striker_velocity_m_per_s: None,
        }
    }

    #[test]
    fn a_view_has_what_its_entry_says_and_else_what_all_have() {
        let experiment = small("[[synthetic.views]]\nview = 2\nrate_hz = 50000.0\nscale_px_per_m = 5000.0\n");
        let synthetic = experiment.synthetic.as_ref().unwrap();
        let usual = Footage { rate_hz: 25e3, first_image: -40, n_frames: 330, magnification: 1.0 };
        assert_eq!(synthetic.footage(1), usual);
        assert_eq!(synthetic.footage(2), Footage { rate_hz: 50e3, magnification: 2.0, ..usual });
        // Of the slower views, from 40 frames before the trigger to 290 after it.
        let [first_s, last_s] = synthetic.span_s();
        assert_eq!((first_s, last_s), (-40.0 / 25e3, -40.0 / 25e3 + 330.0 / 25e3));
        let footage = synthetic.footage(2);
        // About the middle of 400 x 48 pixels, (199.5, 23.5).
        let [column_px, row_px] = footage.moved_px([30.0, 23.5], &synthetic.camera);
        assert_eq!((column_px, row_px), (-139.5, 23.5));
        let (camera, specimen) = (footage.camera(&synthetic.camera), footage.specimen(&synthetic.specimen));
        assert_eq!((camera.scale_px_per_m, specimen.marker.speckle_diameter_px), (5000.0, 9.0));
    }

    #[test]
    fn the_truth_is_known_four_times_a_frame_of_the_fastest_view() {
        let interval_s = |rate_hz: f64| {
            let view = format!("[[synthetic.views]]\nview = 2\nrate_hz = {rate_hz:?}\n");
            small(&view).synthetic.unwrap().truth_interval_s()
        };
        // Beside views at 25 kHz.
        assert_eq!((interval_s(2e3), interval_s(25e3), interval_s(250e3)), (1e-5, 1e-5, 1e-6));
    }

    #[test]
    fn what_is_filmed_larger_is_stated_where_nothing_else_is() {
        let experiment = small("[[synthetic.views]]\nview = 2\nscale_px_per_m = 2750.0\n");
        let trials = [trial(1, None), trial(2, None), trial(2, Some(2700.0))];
        let scales: Vec<Option<f64>> =
            experiment.with_scales_of_views(&trials).iter().map(|trial| trial.scale_px_per_m).collect();
        assert_eq!(scales, [None, Some(2750.0), Some(2700.0)]);
    }

    #[test]
    fn views_that_are_not_there_or_there_twice_are_refused() {
        let refused = |more: &str| {
            let experiment = small(more);
            let checked = experiment.synthetic.unwrap().check_views(&[trial(1, None)], Path::new("a.toml"));
            checked.unwrap_err().to_string()
        };
        assert!(refused("[[synthetic.views]]\nview = 2\n").contains("found view 2"));
        let twice = "[[synthetic.views]]\nview = 1\n";
        assert!(refused(&format!("{twice}{twice}")).contains("view 1 again"));
    }
}
