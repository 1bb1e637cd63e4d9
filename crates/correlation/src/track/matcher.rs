//! A match in a frame, with the pixels that it reads.

use chainwave_measurement::{Lost, Recording, Region};

use crate::icgn::outcome::{Match, Stop};
use crate::warp::Warp;
use crate::window::can_sample;
use crate::{PreparedSubset, Window, Workspace};

/// Matches subsets in the frames of a recording.
pub(crate) struct Matcher<'a> {
    pub(crate) recording: &'a dyn Recording,
    pub(crate) window: Window,
    pub(crate) workspace: Workspace,
    /// The frame that the window shows a part of.
    frame: Option<usize>,
}

impl<'a> Matcher<'a> {
    /// Of a recording, before anything was read.
    pub(crate) fn new(recording: &'a dyn Recording, window: Window) -> Self {
        Self { recording, window, workspace: Workspace::default(), frame: None }
    }

    /// Matches from a start, moving the window after the subset while it leaves it.
    pub(crate) fn match_from(
        &mut self,
        subset: &PreparedSubset,
        frame: usize,
        start: Warp,
    ) -> Result<Match, Lost> {
        self.moving_window(subset, frame, start, PreparedSubset::solve_visible)
    }

    /// The same of all that the frame shows of the subset, of which nothing is taken for hidden.
    pub(crate) fn match_whole_from(
        &mut self,
        subset: &PreparedSubset,
        frame: usize,
        start: Warp,
    ) -> Result<Match, Lost> {
        self.moving_window(subset, frame, start, PreparedSubset::solve)
    }

    fn moving_window(
        &mut self,
        subset: &PreparedSubset,
        frame: usize,
        start: Warp,
        solve: impl Fn(&PreparedSubset, &Window, Warp, &mut Workspace) -> Result<Match, Stop>,
    ) -> Result<Match, Lost> {
        const WINDOWS: usize = 16; // half a pixel of slack each covers the largest drift that the iteration allows
        let mut start = start;
        for _ in 0..WINDOWS {
            if !self.in_frame(subset, &start) {
                return Err(Lost::OutOfView);
            }
            self.read_window(subset, frame, &start)?;
            match solve(subset, &self.window, start, &mut self.workspace) {
                Ok(found) => return Ok(found),
                Err(Stop::Lost(reason)) => return Err(reason),
                Err(Stop::Escaped(warp)) => start = warp,
            }
        }
        Err(Lost::NotConverged)
    }

    /// Whether the subset and what its interpolation needs lie in the frame.
    fn in_frame(&self, subset: &PreparedSubset, warp: &Warp) -> bool {
        let frame = Region::whole(self.recording.info().width_px, self.recording.info().height_px);
        let inside = |corner| can_sample(frame, subset.settings.interpolation, corner);
        subset.bounds(warp).into_iter().all(inside)
    }

    /// Reads what a match around a place needs, unless the last match has left it.
    pub(crate) fn have_window(
        &mut self,
        subset: &PreparedSubset,
        frame: usize,
        warp: &Warp,
    ) -> Result<(), Lost> {
        let [low, high] = subset.bounds(warp);
        let corners = [low.map(|value| value - SPARE_PX), high.map(|value| value + SPARE_PX)];
        let is_there =
            self.frame == Some(frame) && corners.into_iter().all(|corner| self.window.contains(corner));
        if is_there { Ok(()) } else { self.read_window(subset, frame, warp) }
    }

    /// Reads what a match around a place needs, of a frame.
    ///
    /// # Errors
    /// [`Lost::OutOfView`] where the frame does not hold it, [`Lost::Unreadable`].
    pub(crate) fn read_window(
        &mut self,
        subset: &PreparedSubset,
        frame: usize,
        warp: &Warp,
    ) -> Result<(), Lost> {
        let info = self.recording.info();
        let (region, margins) =
            window_around(subset, warp, info.width_px, info.height_px).ok_or(Lost::OutOfView)?;
        self.frame = None;
        let pixels = self.window.start(region, margins);
        self.recording.read_region(frame, region, pixels).map_err(|_| Lost::Unreadable)?;
        self.window.finish();
        self.frame = Some(frame);
        Ok(())
    }
}

/// Pixels that a match may move from its start before the window must be read again.
const SLACK_PX: f64 = 0.5;
/// The same for what starts from a match.
const SPARE_PX: f64 = 0.25;

/// The pixels around a warped subset that interpolation, its prefilter and the slack need, inside the frame, and how many
/// of the first and last columns only the prefilter does.
pub(crate) fn window_around(
    subset: &PreparedSubset,
    warp: &Warp,
    width: usize,
    height: usize,
) -> Option<(Region, [usize; 2])> {
    let interpolation = subset.settings.interpolation;
    let margin = interpolation.prefilter_margin_px() as i64;
    let before = SLACK_PX + interpolation.taps_before() as f64;
    let after = SLACK_PX + interpolation.taps_after() as f64 + 1.0;
    let [low, high] = subset.bounds(warp);
    let [x0, y0] = low.map(|value| (value - before).floor() as i64);
    let [x1, y1] = high.map(|value| (value + after).floor() as i64);
    let region = Region::clipped(x0 - margin, y0 - margin, x1 + margin, y1 + margin, width, height)?;
    let beyond = |distance: i64| usize::try_from(distance).unwrap_or(0);
    let margins = [beyond(x0 - region.x as i64), beyond((region.x + region.width) as i64 - x1)];
    Some((region, margins))
}
