//! What the residuals of a match say of what its shape function leaves within the subset.
//!
//! Pixels that are displaced by w beyond the match leave residuals `w grad f`. Of N pixels with residuals of variance R the match has a
//! variance of `s^2 = R / (N f_x^2)`, so what R exceeds the noise by, `R - R_0 = f_x^2 w^2` at most, is a w of `s sqrt(N (1 - R_0 / R))`, rms
//! over the subset. A parabola of this rms has moved an affine match by 1.1 w, a wave by up to 1.25 w.

use crate::Shape;
use crate::field::pair::Settled;
use crate::field::shape_error::grid::Reading;
use crate::icgn::outcome::Match;

/// What a match may be off by over the rms that is left within its subset: half as much again as a wave's, for textures that are not
/// everywhere alike.
const OFF_OVER_RMS: f64 = 2.0;
/// Standard deviations by which the mean square of a subset's noise may be more than usual.
const UNUSUAL: f64 = 3.0;
/// How far a neighbour whose centre lies within a subset may depart from the subset's own motion, over what that may be off by: what is left
/// within has its largest values at the rim, where a parabola's are 2.2 times its rms.
const DEPARTURE_WITHIN: f64 = 3.0;
/// The same where its centre lies outside, at up to one and a half times the half width and more, to where a parabola reaches 6.4 times its rms
/// and a cubic 15 times.
const DEPARTURE_OUTSIDE: f64 = 8.0;
/// Standard deviations of both readings that are no departure.
const OF_NOISE: f64 = 5.0;
/// Of the field's subsets, those whose residuals show what the noise alone leaves: the least of twenty.
const LEAST_SHARE: usize = 20;

/// The residuals of a field.
pub(in crate::field) struct Residuals {
    /// Variance over what the reference's noise explains, where nothing else shows: 1, or less where that says too much.
    noise: f64,
    /// The same where a quarter of the subsets have less: where the target has more noise than the reference, or all subsets leave something.
    usual: f64,
    n_pixels: f64,
}

impl Residuals {
    pub(in crate::field) fn of(settled: &[Option<Settled>], side_px: f64) -> Self {
        let ratio = |settled: &Option<Settled>| match settled {
            Some((Ok(found), _)) => Some(found.noise_ratio),
            _ => None,
        };
        let mut ratios: Vec<f64> =
            settled.iter().filter_map(ratio).filter(|ratio| ratio.is_finite()).collect();
        ratios.sort_by(f64::total_cmp);
        let quantile = |n: usize| ratios.get(ratios.len() / n).copied().unwrap_or(1.0);
        Self {
            noise: quantile(LEAST_SHARE).min(1.0),
            usual: quantile(4).max(1.0),
            n_pixels: side_px * side_px,
        }
    }

    /// How much more than usual the noise of a subset may have by chance.
    fn by_chance(&self) -> f64 {
        UNUSUAL * (2.0 / self.n_pixels).sqrt()
    }

    /// What the residuals leave to a systematic error along x and y, at most.
    fn left_at_most_px(&self, found: &Match) -> [f64; 2] {
        let share = 1.0 - self.noise * (1.0 - self.by_chance()) / found.noise_ratio;
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 1.0 };
        [found.position.x_px, found.position.y_px]
            .map(|place| OFF_OVER_RMS * place.sigma * (self.n_pixels * share).sqrt())
    }

    /// Whether they need nothing but noise.
    fn are_noise_alone(&self, found: &Match) -> bool {
        found.noise_ratio < self.usual * (1.0 + self.by_chance())
    }
}

impl Reading {
    /// What a point's match says, with the residuals of the field.
    pub(in crate::field) fn of(
        found: &Match,
        place_px: [f64; 2],
        shape: Shape,
        residuals: &Residuals,
    ) -> Self {
        let [x, y] = [found.position.x_px, found.position.y_px];
        Self {
            u_px: [x.value - place_px[0], y.value - place_px[1]],
            sigma_px: [x.sigma, y.sigma],
            shape,
            gradient: found.gradient,
            curvature: found.curvature,
            left_px: residuals.left_at_most_px(found),
            leaves_noise_alone: residuals.are_noise_alone(found),
            is_whole: found.is_whole,
        }
    }

    /// Whether another at such a distance moves as no field could that leaves so little within this one's subset: something lies between.
    pub(super) fn is_parted_from(&self, other: &Self, offset_px: [f64; 2], side_px: f64) -> bool {
        let is_within = offset_px.iter().all(|offset| offset.abs() < 0.5 * side_px);
        let departure = if is_within { DEPARTURE_WITHIN } else { DEPARTURE_OUTSIDE };
        (0..2).any(|axis| {
            let [x, y] = offset_px;
            let [along_x, along_y] = [self.gradient[2 * axis], self.gradient[2 * axis + 1]];
            let [xx, xy, yy] = [0, 1, 2].map(|k| self.curvature[3 * axis + k]);
            let by_own = self.u_px[axis] + along_x * x + along_y * y + xx * x * x + xy * x * y + yy * y * y;
            let noise = self.sigma_px[axis].hypot(other.sigma_px[axis]);
            (other.u_px[axis] - by_own).abs() > departure * self.left_px[axis] + OF_NOISE * noise
        })
    }
}
