//! What of a subset a frame shows: not the pixels that saturate there or are no numbers, nor those behind an obstacle.
//!
//! The former are known beforehand. An obstacle shows as residuals that no noise explains: those beyond four times their
//! robust standard deviation (1.48 times the median of their sizes: P. J. Rousseeuw, A. M. Leroy, Robust Regression and
//! Outlier Detection, 1987), with their neighbours, are left out, and the rest is matched anew. Whatever is left out is
//! missing in the Hessian, so sigma says what it cost. What is no noise and cannot be left out makes sigma larger.

use chainwave_measurement::{Lost, median_and_robust_sigma};

use crate::icgn::outcome::{Match, Stop};
use crate::reference::mask::{INVALID_MARGIN_PX, dilated};
use crate::simd::dot;
use crate::uncertainty::{Residual, degrees_of_freedom};
use crate::warp::{Warp, distance_px};
use crate::{PreparedSubset, Window, Workspace};

/// Share of a subset's pixels that must be seen.
const LEAST_VISIBLE: f64 = 0.4;
/// Variance of the residuals over that of the noise from which on an obstacle is looked for. Light that is four times
/// brighter has so much shot noise; an obstacle has hundreds of times as much.
const SUSPICIOUS_RATIO: f64 = 6.0;
/// Robust standard deviations beyond which a residual is none of the noise's.
const OUTLIER_SIGMAS: f64 = 4.0;
/// Share of full scale from which on a pixel of the reference may saturate in a frame.
const NEARLY_FULL: f64 = 0.9;
/// Pixels from its start beyond which a match is made once more without what saturates where it is: the margin of what is left out covers less.
const FLAGGED_PX: f64 = 1.0;
/// Times that outliers are looked for: the first ones distort the gain by which the next are found.
const ROUNDS: usize = 4;

impl PreparedSubset {
    /// As [`Self::solve_from_afar`], by what the frame shows of the subset.
    pub(crate) fn solve_visible(
        &self,
        window: &Window,
        start: Warp,
        workspace: &mut Workspace,
    ) -> Result<Match, Stop> {
        let hidden = self.hidden_by_flags(window, &start);
        let found = self.solve_without(hidden.as_deref(), window, start, workspace)?;
        if distance_px(&found.warp(), &start) <= FLAGGED_PX {
            return Ok(found);
        }
        // What saturates was left out as if the subset lay at the start.
        let hidden_there = self.hidden_by_flags(window, &found.warp());
        if hidden_there == hidden {
            return Ok(found);
        }
        self.solve_without(hidden_there.as_deref(), window, found.warp(), workspace)
    }

    /// The match without some of the pixels.
    fn solve_without(
        &self,
        hidden: Option<&[bool]>,
        window: &Window,
        start: Warp,
        workspace: &mut Workspace,
    ) -> Result<Match, Stop> {
        let Some(hidden) = hidden else { return self.solve_around_obstacles(window, start, workspace) };
        let part = self.only(&self.without(hidden)).map_err(Stop::Lost)?;
        part.solve_around_obstacles(window, start, workspace).map(|found| self.in_part(found, &part))
    }

    /// The pixels of the subset that a frame shows at a match that left some out; `None` where too few are left.
    pub(crate) fn visible_at(
        &self,
        window: &Window,
        found: &Match,
        workspace: &mut Workspace,
    ) -> Option<Vec<bool>> {
        let warp = found.warp();
        let unflagged = match self.hidden_by_flags(window, &warp) {
            Some(hidden) => Some(self.only(&self.without(&hidden)).ok()?),
            None => None,
        };
        let part = unflagged.as_ref().unwrap_or(self);
        let clear = part.without_outliers(window, &warp, workspace);
        let seen = clear.as_ref().unwrap_or(part);
        Some(seen.weights.iter().map(|weight| *weight > 0.0).collect())
    }

    /// The pixels that are used and not hidden.
    fn without(&self, hidden: &[bool]) -> Vec<bool> {
        hidden.iter().zip(self.weights.iter()).map(|(hidden, weight)| !hidden && *weight > 0.0).collect()
    }

    /// Whether each pixel lies near one that saturates or is no number in the window; `None` where none does but those that
    /// the reference leaves out already, or nearly.
    fn hidden_by_flags(&self, window: &Window, warp: &Warp) -> Option<Vec<bool>> {
        let (first, width, height) = (self.first_px, self.width as i64, self.height as i64);
        let margin = INVALID_MARGIN_PX as i64;
        // A pixel more than the margin: what is rounded to it lies up to half a pixel beyond.
        let reach = (margin + 1) as f64;
        let corner = [first[0] + (width - 1) as f64 + reach, first[1] + (height - 1) as f64 + reach];
        let near = warp.bounds([first[0] - reach, first[1] - reach], corner);
        let mut flags = window.flags_within(near).peekable();
        let mut marked = vec![false; if flags.peek().is_some() { self.n_pixels() } else { 0 }];
        let mut any = false;
        for point in flags {
            let Some([x, y]) = warp.source(point) else { continue };
            let (column, row) = ((x - first[0]).round() as i64, (y - first[1]).round() as i64);
            let near =
                (-margin..width + margin).contains(&column) && (-margin..height + margin).contains(&row);
            // what saturates just beyond the edge reaches the pixels at the edge
            let place = (row.clamp(0, height - 1) * width + column.clamp(0, width - 1)) as usize;
            // what is as bright in the reference is clipped by its noise, no more
            let bright = f64::from(self.template()[place]) + self.mean >= NEARLY_FULL * window.full_scale();
            if near && self.weights[place] > 0.0 && !bright {
                marked[place] = true;
                any = true;
            }
        }
        any.then(|| dilated(self.width, &marked, INVALID_MARGIN_PX + 1))
    }

    fn solve_around_obstacles(
        &self,
        window: &Window,
        start: Warp,
        workspace: &mut Workspace,
    ) -> Result<Match, Stop> {
        let found = self.solve_from_afar(window, start, workspace);
        let place = match &found {
            Err(Stop::Escaped(_)) => return found,
            Err(Stop::Lost(_)) => start,
            Ok(found) if found.noise_ratio < SUSPICIOUS_RATIO => return Ok(*found),
            Ok(found) => found.warp(),
        };
        let Some(visible) = self.without_outliers(window, &place, workspace) else { return found };
        match visible.solve(window, place, workspace) {
            Ok(around) if around.noise_ratio < SUSPICIOUS_RATIO => Ok(self.in_part(around, &visible)),
            _ => found,
        }
    }

    /// The part of the subset that resembles the frame under a warp; `None` where all does, or too little.
    fn without_outliers(&self, window: &Window, warp: &Warp, workspace: &mut Workspace) -> Option<Self> {
        let mut part: Option<Self> = None;
        for _ in 0..ROUNDS {
            let subset = part.as_ref().unwrap_or(self);
            if !subset.fits(window, warp) {
                return None;
            }
            let found = subset.evaluate(window, warp, workspace)?;
            let residuals = subset.residuals(&found, workspace);
            let [middle, sigma] = robust_moments(subset, &residuals);
            let far = |(residual, weight): (&f64, &f32)| {
                *weight > 0.0 && (residual - middle).abs() > OUTLIER_SIGMAS * sigma
            };
            let outlier: Vec<bool> = residuals.iter().zip(subset.weights.iter()).map(far).collect();
            if !outlier.contains(&true) {
                break;
            }
            let hidden = dilated(self.width, &outlier, INVALID_MARGIN_PX);
            part = Some(self.only(&subset.without(&hidden)).ok()?);
        }
        part
    }

    /// A match of a part of the subset.
    pub(crate) fn in_part(&self, found: Match, part: &Self) -> Match {
        let share_seen = found.share_seen * part.n_used as f64 / self.n_used as f64;
        Match { is_whole: false, share_seen, ..found }
    }

    /// The subset with some of its pixels alone.
    pub(crate) fn only(&self, visible: &[bool]) -> Result<Self, Lost> {
        let subset = self.masked(visible)?;
        let enough = subset.n_used as f64 >= LEAST_VISIBLE * self.n_used as f64;
        enough.then_some(subset).ok_or(Lost::LowCorrelation)
    }
}

/// Median and standard deviation of the bulk of the residuals of the pixels that are used.
fn robust_moments(subset: &PreparedSubset, residuals: &[f64]) -> [f64; 2] {
    let used = residuals.iter().zip(subset.weights.iter()).filter(|(_, weight)| **weight > 0.0);
    let values: Vec<f64> = used.map(|(residual, _)| *residual).collect();
    if values.len() < 2 {
        return [0.0, f64::INFINITY];
    }
    median_and_robust_sigma(values).unwrap_or([0.0, f64::INFINITY])
}

/// Variance of a match's residuals over what the reference's noise and interpolation explain.
pub(crate) fn noise_ratio(subset: &PreparedSubset, residual: &Residual) -> f64 {
    let degrees_of_freedom = degrees_of_freedom(subset) as f64;
    let noise = subset.noise_variance * (subset.n_averaged + 1.0);
    let of_interpolation = residual.of_interpolation.energy / degrees_of_freedom;
    let explained = residual.gain.powi(2) * noise + residual.gain_of_scene().powi(2) * of_interpolation;
    residual.sum_of_squares / degrees_of_freedom / (explained + subset.rounding_variance)
}

/// Variance over that of the noise up to which residuals may be noise: of light that is dimmer than the reference's, shot
/// noise is a larger share.
const NOISE_AT_MOST: f64 = 2.0;

/// What the standard uncertainty of a match grows by where its residuals are no noise: the texture has changed, or the
/// shape function does not describe how the subset is deformed.
///
/// Such residuals are as smooth as the texture. Of speckles of the spectrum `exp(-w^2 r^2)` in both, a product with the
/// gradient has `pi r^2` times the variance that white residuals of the same size would give, and `1/(2 r^2)` is
/// the mean of f_x^2 over that of f^2. A frame may as well have more noise than the reference: how much of the residual is
/// smooth is told by its correlation at two pixels, where interpolated noise has none.
pub(crate) fn structure_factor(
    subset: &PreparedSubset,
    noise_ratio: f64,
    residuals: impl FnOnce() -> Vec<f64>,
) -> f64 {
    if noise_ratio <= NOISE_AT_MOST {
        return 1.0;
    }
    let [k_x, k_y] = [&subset.gradient_x, &subset.gradient_y].map(|g| dot(g, g) / subset.energy);
    let pixels = 0.5 * std::f64::consts::PI / (k_x * k_y).sqrt();
    let share = smooth_share(subset, residuals()).min(1.0 - NOISE_AT_MOST / noise_ratio);
    (1.0 + share * (pixels - 1.0).max(0.0)).sqrt()
}

/// Share of the residuals' variance that is as smooth as the texture: noise has none, interpolated or not.
pub(crate) fn smooth_share(subset: &PreparedSubset, residuals: Vec<f64>) -> f64 {
    let residuals: Vec<f32> = residuals.into_iter().map(|residual| residual as f32).collect();
    let of_texture =
        at_two_pixels(&subset.intensity[..subset.n_pixels()], subset.width) / subset.signal_energy;
    let of_residuals = at_two_pixels(&residuals, subset.width) / dot(&residuals, &residuals);
    (of_residuals / of_texture).clamp(0.0, 1.0)
}

/// The sum of products of pixels that are two columns apart or two rows, the mean of both.
fn at_two_pixels(image: &[f32], width: usize) -> f64 {
    let along_rows: f64 = image.chunks_exact(width).map(|row| dot(&row[2.min(width)..], row)).sum();
    0.5 * (along_rows + dot(image.get(2 * width..).unwrap_or_default(), image))
}
