//! A match that its subset does not tell from chance, held against a larger subset around it.

use std::sync::OnceLock;

use chainwave_measurement::{Recording, Subset};

use crate::search::chance::{chance_zncc_over, ways_to_leave_out};
use crate::search::larger::{LARGER, is_same_place};
use crate::search::region_around;
use crate::search::rivals::PlaceMatch;
use crate::{PreparedSubset, Reference, ReferenceFrames, Window, Workspace};

/// Pixels around the larger subset that its match may need besides: as many as its corners reach beyond it when it is turned, over its half
/// width.
const SPARE: f64 = 0.5;

/// The larger subset around one, prepared when it is asked for first; none where the reference does not hold it.
#[derive(Debug, Default)]
pub(crate) struct Around {
    larger: OnceLock<Option<PreparedSubset>>,
}

impl Around {
    /// Whether the larger subset is found at the place of a match in a frame, better than something else would be by chance in a share `p` of cases, at
    /// the best of so many places and deformations, with so many parameters fitted.
    pub(crate) fn tells(
        &self,
        (recording, frames): (&dyn Recording, &ReferenceFrames),
        frame: usize,
        subset: &PreparedSubset,
        found: &PlaceMatch,
        (n_parameters, n_trials, p): (usize, f64, f64),
    ) -> bool {
        let larger = self.larger.get_or_init(|| prepared_around(recording, frames, subset));
        let Some(larger) = larger else { return false };
        let [half_x, half_y] = larger.half_px();
        let spare_px = (SPARE * half_x.max(half_y)).ceil() as usize;
        let Some(region) = region_around(recording, larger, found.warp.position_px, spare_px) else {
            return false;
        };
        let mut pixels = vec![0.0; region.n_pixels()];
        if recording.read_region(frame, region, &mut pixels).is_err() {
            return false;
        }
        let Ok(window) = Window::new(region, &pixels, larger.settings.interpolation) else { return false };
        let seen = larger.solve_visible(&window, found.warp, &mut Workspace::default());
        seen.is_ok_and(|seen| {
            let is_there = is_same_place(found.warp.position_px, seen.warp().position_px);
            let compared = seen.place().share_compared();
            let n_trials = n_trials * ways_to_leave_out(larger, seen.share_seen);
            let by_chance = chance_zncc_over(compared, n_parameters, larger, n_trials, p);
            is_there && seen.position.zncc >= by_chance
        })
    }
}

fn prepared_around(
    recording: &dyn Recording,
    frames: &ReferenceFrames,
    subset: &PreparedSubset,
) -> Option<PreparedSubset> {
    let [x_px, y_px] = subset.centre_px;
    let [half_width_px, half_height_px] = subset.half_px().map(|half| (LARGER * half).round() as usize);
    let around = Subset::new("", x_px, y_px, half_width_px, half_height_px);
    let reference = Reference::read(recording, &around, frames).ok()?;
    PreparedSubset::new(&reference, &around, &subset.settings).ok()
}
