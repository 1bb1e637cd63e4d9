//! Inverse compositional Gauss-Newton: one subset matched in one frame.

mod damped;
pub(crate) mod outcome;
mod sums;
pub(crate) mod visible;

use chainwave_measurement::{Estimate, Lost, Position};

use crate::icgn::outcome::{Match, Stop, Workspace};
use crate::icgn::sums::{Evaluation, squares, sum};
use crate::icgn::visible::{noise_ratio, structure_factor};
use crate::interpolation_error::energy::Foreseen;
use crate::prepared::linearised::Linearised;
use crate::search::light::Light;
use crate::simd::LANES;
use crate::uncertainty::{Residual, angle_rad, sigma_px};
use crate::warp::{Warp, distance_px};
use crate::window::sample::sample;
use crate::{Acceptance, PreparedSubset, Window};

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
    /// [`Lost::LowCorrelation`] below what the settings' `acceptance` allows, [`Lost::NotConverged`] beyond their `max_iterations`.
    pub fn match_in(
        &self,
        window: &Window,
        start_px: [f64; 2],
        workspace: &mut Workspace,
    ) -> Result<Match, Lost> {
        self.solve_visible(window, Warp::at(start_px), workspace).map_err(|stop| match stop {
            Stop::Escaped(_) => Lost::OutOfView,
            Stop::Lost(reason) => reason,
        })
    }

    /// As [`Self::solve`], and where that fails once more from where the subset's middle is found (a smaller subset
    /// converges from farther away, since a wrong strain or rotation moves its edge less), and from where damped steps lead.
    pub(crate) fn solve_from_afar(
        &self,
        window: &Window,
        start: Warp,
        workspace: &mut Workspace,
    ) -> Result<Match, Stop> {
        let at_once = self.solve(window, start, workspace);
        let Err(Stop::Lost(_)) = at_once else { return at_once };
        let from_inside = self.approach(window, start, workspace);
        if let Some(Ok(found)) = from_inside.map(|nearer| self.solve(window, nearer, workspace)) {
            return Ok(found);
        }
        let higher = self.climb(window, start, workspace)?;
        self.solve(window, higher, workspace)
    }

    pub(crate) fn solve(
        &self,
        window: &Window,
        start: Warp,
        workspace: &mut Workspace,
    ) -> Result<Match, Stop> {
        let end = self.iterate(window, start, workspace)?;
        Ok(self.finish(&end, window.level, workspace))
    }

    fn finish(&self, end: &End, level: f32, workspace: &Workspace) -> Match {
        let End { warp, found, iterations } = end;
        let residual = self.residual(warp, found, workspace);
        let noise_ratio = noise_ratio(self, &residual);
        let structure = structure_factor(self, noise_ratio, || self.residuals(found, workspace));
        let [noise_x, noise_y] = sigma_px(self, warp, &residual).map(|sigma| structure * sigma);
        let [bias_x, bias_y] = self.bias.sigma_px();
        let [x, y] = self.without_bias(warp, &residual.of_interpolation);
        let (x_px, y_px) = (Estimate::new(x, noise_x.hypot(bias_x)), Estimate::new(y, noise_y.hypot(bias_y)));
        let theta_rad = angle_rad(self, warp, [x_px.sigma, y_px.sigma]);
        Match {
            position: Position { x_px, y_px, theta_rad, zncc: found.zncc, iterations: *iterations },
            gradient: warp.gradient,
            curvature: warp.curvature,
            noise_ratio,
            is_whole: true,
            share_seen: 1.0,
            light: Light { mean: found.mean + f64::from(level), gain: found.gain },
        }
    }

    /// The position without what interpolation adds to it.
    pub(crate) fn without_bias(&self, warp: &Warp, foreseen: &Foreseen) -> [f64; 2] {
        let [dx, dy] = self.bias.at(warp, self.lattice(), foreseen);
        let [ux, uy, vx, vy] = warp.gradient;
        let [x, y] = warp.position_px;
        [x + (1.0 + ux) * dx + uy * dy, y + vx * dx + (1.0 + vy) * dy]
    }

    /// How the window resembles the subset under a warp; `None` where it cannot be compared.
    pub(crate) fn compare(
        &self,
        window: &Window,
        warp: &Warp,
        workspace: &mut Workspace,
    ) -> Option<(Evaluation, Residual)> {
        let found = self.fits(window, warp).then(|| self.evaluate(window, warp, workspace))??;
        let residual = self.residual(warp, &found, workspace);
        Some((found, residual))
    }

    /// What the last evaluation, which was made under a warp, left.
    pub(crate) fn residual(&self, warp: &Warp, found: &Evaluation, workspace: &Workspace) -> Residual {
        let [sum_of_squares, by_light] = squares(self, &workspace.samples, found.mean, found.gain);
        let of_interpolation = self.interpolation_energy.at(warp, self.lattice());
        Residual { gain: found.gain, sum_of_squares, by_light, of_interpolation }
    }
}

/// Where steps became short.
struct End {
    warp: Warp,
    found: Evaluation,
    iterations: u32,
}

impl Linearised {
    /// Where the middle of the subset is found, sought from the middle of the middle.
    fn approach(&self, window: &Window, start: Warp, workspace: &mut Workspace) -> Option<Warp> {
        let mut inner = self.inner()?;
        inner.settings.convergence_px = inner.settings.convergence_px.max(0.02);
        inner.settings.acceptance = Acceptance::Zncc(inner.settings.acceptance.least_zncc().min(0.5));
        let from_inside = inner.approach(window, start, workspace);
        let starts = [from_inside, Some(start)].into_iter().flatten();
        starts.filter_map(|start| inner.iterate(window, start, workspace).ok()).map(|end| end.warp).next()
    }

    /// Gauss-Newton steps from a start to where they become short.
    fn iterate(&self, window: &Window, start: Warp, workspace: &mut Workspace) -> Result<End, Stop> {
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
            if distance_px(&warp, &start) > LARGEST_DRIFT_PX || !warp.is_plausible() {
                return Err(Stop::Lost(Lost::NotConverged));
            }
            if step_px <= self.settings.convergence_px.max(FINEST_STEP_PX) {
                let resembles = found.zncc >= self.settings.acceptance.least_zncc();
                let end = End { warp, found, iterations: iteration };
                return resembles.then_some(end).ok_or(Stop::Lost(Lost::LowCorrelation));
            }
        }
        Err(Stop::Lost(Lost::NotConverged))
    }

    /// Whether the warped subset can be sampled from the window.
    pub(crate) fn fits(&self, window: &Window, warp: &Warp) -> bool {
        self.bounds(warp).into_iter().all(|corner| window.contains(corner))
    }

    /// Compares the subset with the window under a warp; the subset must fit.
    pub(crate) fn evaluate(
        &self,
        window: &Window,
        warp: &Warp,
        workspace: &mut Workspace,
    ) -> Option<Evaluation> {
        self.sample_at(window, warp, workspace);
        sum(self, &workspace.samples[..self.n_pixels().next_multiple_of(LANES)]).evaluate(self)
    }

    /// Samples the window where the subset's pixels are under a warp, 0 for those that are not used; the subset must fit.
    pub(crate) fn sample_at(&self, window: &Window, warp: &Warp, workspace: &mut Workspace) {
        let n = self.n_pixels();
        workspace.samples.resize(n + LANES, 0.0);
        sample(window, warp, self.lattice(), &mut workspace.rows, &mut workspace.samples);
        workspace.samples[n..].fill(0.0);
        if self.n_used < n {
            workspace
                .samples
                .iter_mut()
                .zip(self.weights.iter())
                .for_each(|(value, weight)| *value *= weight);
        }
    }

    /// The residual of each pixel after the last evaluation, in counts; 0 where it is not used.
    pub(crate) fn residuals(&self, found: &Evaluation, workspace: &Workspace) -> Vec<f64> {
        let pixels =
            workspace.samples.iter().zip(&self.intensity).zip(self.weights.iter()).take(self.n_pixels());
        let residual = |((g, f), weight): ((&f32, &f32), &f32)| {
            f64::from(*weight) * (f64::from(*g) - found.mean - found.gain * f64::from(*f))
        };
        pixels.map(residual).collect()
    }
}
