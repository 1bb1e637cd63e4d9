use chainwave_measurement::{Estimate, Lost, Position};

use crate::sample::{Grid, sample_grid, sample_row};
use crate::sums::{Evaluation, sum};
use crate::uncertainty::sigma_px;
use crate::warp::Warp;
use crate::{PreparedSubset, Shape, Window};

/// Where a subset was found, and how it is deformed there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// The centre, with its uncertainty.
    pub position: Position,
    /// Displacement gradient du/dx, du/dy, dv/dx, dv/dy; zero for a translation.
    pub gradient: [f64; 4],
}

/// Buffers that a match reuses, so that it allocates nothing.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    samples: Vec<f32>,
    rows: Vec<f32>,
}

/// Why an iteration stopped without a match.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Stop {
    /// The subset left the window for this place.
    Escaped(Warp),
    /// It is lost.
    Lost(Lost),
}

/// A step farther than this from the start, in pixels, is no refinement of it any more.
const LARGEST_DRIFT_PX: f64 = 8.0;

/// Where steps shrink by less than this share of what they promise, they are halved: under heavy noise the Hessian of a
/// weak direction can be half of what it should be, and full steps go to and fro.
const LEAST_GAIN: f64 = 0.3;
/// Steps below this are the rounding of f32 coordinates, and do not shrink any more.
const FINEST_STEP_PX: f64 = 5e-5;
/// The smallest share of a step that is taken.
const LEAST_DAMPING: f64 = 0.125;

impl PreparedSubset {
    /// Finds the subset in `window` by inverse-compositional Gauss-Newton, starting undeformed with its centre at
    /// `start_px` (image coordinates).
    ///
    /// # Errors
    /// [`Lost::OutOfView`] when the subset and the pixels that interpolation needs leave the window,
    /// [`Lost::LowCorrelation`] below the settings' `min_zncc`, [`Lost::NotConverged`] beyond their `max_iterations`.
    pub fn match_in(
        &self,
        window: &Window,
        start_px: [f64; 2],
        workspace: &mut Workspace,
    ) -> Result<Match, Lost> {
        self.solve(window, Warp::at(start_px), workspace).map_err(|stop| match stop {
            Stop::Escaped(_) => Lost::OutOfView,
            Stop::Lost(reason) => reason,
        })
    }

    pub(crate) fn solve(
        &self,
        window: &Window,
        start: Warp,
        workspace: &mut Workspace,
    ) -> Result<Match, Stop> {
        let mut warp = start;
        let (mut damping, mut previous_px) = (1.0, f64::INFINITY);
        for iteration in 1..=self.settings.max_iterations {
            if !self.fits(window, &warp) {
                return Err(Stop::Escaped(warp));
            }
            let found = self.evaluate(window, &warp, workspace).ok_or(Stop::Lost(Lost::LowCorrelation))?;
            let step_px = found.step.at_edge_px(self.half_px());
            if step_px > (1.0 - LEAST_GAIN * damping) * previous_px {
                damping = (0.5_f64 * damping).max(LEAST_DAMPING);
            }
            previous_px = step_px;
            warp = warp.compose_inverse(&found.step.scaled(damping)).ok_or(Stop::Lost(Lost::NotConverged))?;
            if distance_px(&warp, &start) > LARGEST_DRIFT_PX {
                return Err(Stop::Lost(Lost::NotConverged));
            }
            if step_px <= self.settings.convergence_px.max(FINEST_STEP_PX) {
                return self.finish(&warp, &found, iteration);
            }
        }
        Err(Stop::Lost(Lost::NotConverged))
    }

    fn finish(&self, warp: &Warp, found: &Evaluation, iterations: u32) -> Result<Match, Stop> {
        if found.zncc < self.settings.min_zncc {
            return Err(Stop::Lost(Lost::LowCorrelation));
        }
        let [sigma_x, sigma_y] = sigma_px(self, warp, &found.residual);
        let [x, y] = warp.position_px;
        let (x_px, y_px) = (Estimate::new(x, sigma_x), Estimate::new(y, sigma_y));
        Ok(Match { position: Position { x_px, y_px, zncc: found.zncc, iterations }, gradient: warp.gradient })
    }

    /// Whether the warped subset can be sampled from the window.
    pub(crate) fn fits(&self, window: &Window, warp: &Warp) -> bool {
        self.corners().into_iter().all(|corner| window.contains(warp.apply(corner)))
    }

    /// Compares the subset with the window under a warp; the subset must fit.
    pub(crate) fn evaluate(
        &self,
        window: &Window,
        warp: &Warp,
        workspace: &mut Workspace,
    ) -> Option<Evaluation> {
        workspace.samples.resize(self.stride * self.height, 0.0);
        if self.settings.shape == Shape::Translation {
            let start = warp.apply(self.first_px);
            let grid = Grid { width: self.width, height: self.height, stride: self.stride };
            sample_grid(window, start, grid, &mut workspace.rows, &mut workspace.samples);
        } else {
            let step = [1.0 + warp.gradient[0], warp.gradient[2]];
            for (row, samples) in workspace.samples.chunks_exact_mut(self.stride).enumerate() {
                let start = warp.apply([0.0, self.first_px[1] + row as f64]);
                sample_row(window, start, step, &self.columns[..self.width], &mut samples[..self.width]);
            }
        }
        for samples in workspace.samples.chunks_exact_mut(self.stride) {
            samples[self.width..].fill(0.0);
        }
        sum(self, &workspace.samples).evaluate(self)
    }
}

fn distance_px(a: &Warp, b: &Warp) -> f64 {
    (a.position_px[0] - b.position_px[0]).hypot(a.position_px[1] - b.position_px[1])
}
