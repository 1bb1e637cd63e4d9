//! What finds the place of a subset: its grey values, gradients, and the normal equations of a step.

use std::sync::Arc;

use chainwave_measurement::{Lost, Position, Subset};

use crate::Settings;
use crate::pixel_places::pixel_places;
use crate::prepared::moments::Places;
use crate::prepared::normal::{Images, Matrix, NormalEquations, ReferenceNoise, UnitCovariance};
use crate::prepared::outline::{is_within, turned};
use crate::simd::{dot, padded};
use crate::warp::{MAX_PARAMETERS, Warp};
use crate::window::sample::Lattice;

/// Least share of signal in the energy of the grey values, and in that of the gradient along each axis. A patch of pure
/// noise of 33 x 33 px has about 0 +- 0.07 and 0 +- 0.2 (smoothing leaves few independent gradients); speckle of 14 %
/// contrast at 10 % noise has 0.65 in its grey values.
const LEAST_SIGNAL_SHARE: f64 = 0.2;
const LEAST_GRADIENT_SHARE: f64 = 0.3;
/// Least width and height of the middle of a subset that a start is sought with.
const LEAST_SIDE_PX: usize = 9;

/// A subset of the reference with everything that its match needs and that does not depend on the target: grey values, steepest descent
/// images and the inverse of their Hessian.
///
/// Let f be the reference less its mean, J_p its derivatives by the shape function's parameters p, and Z_p the same
/// from a gradient that is smoothed as the noise requires. A target g = a + b f(x + J dp), of unknown offset a and
/// gain b, is solved for dp by demanding that its residual is orthogonal to 1, to f and to each Z_p:
///
/// dp = (1/b) M^-1 sum Z'_p g, with Z'_p = Z_p less its projection on 1 and f, and M_pq = sum Z'_p J_q.
///
/// That is the Gauss-Newton step of ZNSSD (B. Pan, K. Li, W. Tong, Exp. Mech. 53 (2013) 1277-1289), the derivative of
/// its normalisation included. The noise of the reference, of variance s^2, adds `s^2 <d, d'>` to products of two
/// gradients with the filters d and d', and s^2 to f^2; both are subtracted.
#[derive(Debug, Clone)]
pub struct Linearised {
    pub(crate) settings: Settings,
    /// The centre in the reference image.
    pub(crate) centre_px: [f64; 2],
    /// Its outline, from the centre; none where it is the whole rectangle.
    pub(crate) outline_px: Vec<[f64; 2]>,
    /// Place of the first pixel, relative to the centre.
    pub(crate) first_px: [f64; 2],
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Column of each pixel relative to the centre. These arrays hold the pixels row by row, then zeros up to whole
    /// vectors.
    pub(crate) columns: Arc<[f32]>,
    /// Row of each pixel relative to the centre.
    pub(crate) rows: Arc<[f32]>,
    /// Reference less `mean` in every pixel, used or not; `None` where that is `intensity`.
    pub(crate) template: Option<Vec<f32>>,
    /// 1 for each pixel that is used; the others, and the filling, are 0 here and in the three images below.
    pub(crate) weights: Arc<[f32]>,
    /// Pixels that are used.
    pub(crate) n_used: usize,
    /// Reference less its mean.
    pub(crate) intensity: Vec<f32>,
    pub(crate) gradient_x: Vec<f32>,
    pub(crate) gradient_y: Vec<f32>,
    /// Mean of the reference, in counts.
    pub(crate) mean: f64,
    /// Sum of squares of `intensity`.
    pub(crate) energy: f64,
    /// The same without the noise's share.
    pub(crate) signal_energy: f64,
    /// Mean of each Z over the subset, and its regression on f.
    pub(crate) projections: [[f64; 2]; MAX_PARAMETERS],
    /// M^-1.
    pub(crate) inverse: Matrix,
    /// M, before the shape function reduces it.
    pub(crate) hessian: Matrix,
    pub(crate) covariance: Box<UnitCovariance>,
    /// Variance of the noise of a reference pixel, in counts squared.
    pub(crate) noise_variance: f64,
    /// Frames behind the reference.
    pub(crate) n_averaged: f64,
    /// What is needed to prepare a part of the subset: gradients without smoothing, and the reference's noise.
    pub(crate) plain: [Vec<f32>; 2],
    pub(crate) noise: ReferenceNoise,
}

impl Linearised {
    /// The polynomials that the gradients along x and y are multiplied with for a displacement of the centre along one of them.
    pub(super) fn step_polynomials(&self, component: usize) -> [[f32; 6]; 2] {
        let n_terms = self.settings.shape.n_terms();
        let row = &self.inverse[component * n_terms];
        [0, 1].map(|axis| {
            let factor = |term: usize| if term < n_terms { row[axis * n_terms + term] } else { 0.0 };
            std::array::from_fn(|term| factor(term) as f32)
        })
    }

    /// A subset from its images and their noise.
    pub(super) fn from_crop(
        crop: Crop,
        plain: [Vec<f32>; 2],
        noise: ReferenceNoise,
        settings: &Settings,
    ) -> Result<Self, Lost> {
        let [columns, rows] = crop.places;
        let images = Images {
            places: Places { width: crop.width, height: crop.height, columns: &columns, rows: &rows },
            intensity: &crop.intensity,
            ones: &crop.weights,
            smooth: crop.smooth.each_ref().map(Vec::as_slice),
            plain: plain.each_ref().map(Vec::as_slice),
        };
        let n_used = crop.n_used;
        let normal = NormalEquations::new(images, settings.shape, n_used, noise).ok_or(Lost::NoTexture)?;
        let energy = normal.signal_energy + n_used as f64 * noise.variance;
        if normal.signal_energy <= LEAST_SIGNAL_SHARE * energy || normal.signal_share < LEAST_GRADIENT_SHARE {
            return Err(Lost::NoTexture);
        }
        let [gradient_x, gradient_y] = crop.smooth;
        Ok(Self {
            settings: settings.clone(),
            centre_px: crop.centre_px,
            outline_px: crop.outline_px,
            first_px: crop.first_px,
            width: crop.width,
            height: crop.height,
            columns,
            rows,
            template: crop.template,
            weights: crop.weights,
            n_used,
            intensity: crop.intensity,
            gradient_x,
            gradient_y,
            mean: crop.mean,
            energy,
            signal_energy: normal.signal_energy,
            projections: normal.projections,
            inverse: normal.inverse,
            covariance: normal.covariance,
            hessian: normal.hessian,
            noise_variance: noise.variance,
            n_averaged: crop.n_averaged,
            plain,
            noise,
        })
    }

    /// Reference less its mean in every pixel, used or not, for whoever searches for the subset by its looks.
    pub(crate) fn template(&self) -> &[f32] {
        self.template.as_deref().unwrap_or(&self.intensity[..self.n_pixels()])
    }

    /// The middle of this subset, half as wide and high: it converges from twice the strain or rotation. `None` when
    /// nothing useful would be left.
    pub(crate) fn inner(&self) -> Option<Self> {
        let cut = |n: usize| n.saturating_sub(1) / 4;
        let (left, top) = (cut(self.width), cut(self.height));
        let (width, height) = (self.width - 2 * left, self.height - 2 * top);
        if width.min(height) < LEAST_SIDE_PX || left + top == 0 {
            return None;
        }
        let crop = |values: &[f32]| {
            let rows = values.chunks_exact(self.width).skip(top).take(height);
            padded(rows.flat_map(|row| row[left..left + width].iter().copied()))
        };
        let (mut intensity, weights) = (crop(&self.intensity), crop(&self.weights));
        let n_used = n_ones(&weights);
        let mean = dot(&intensity, &weights) / n_used.max(1) as f64;
        let centred = |(value, weight): (&mut f32, &f32)| *value = weight * (f64::from(*value) - mean) as f32;
        intensity.iter_mut().zip(&weights).for_each(centred);
        let smooth = [crop(&self.gradient_x), crop(&self.gradient_y)];
        let first_px = [self.first_px[0] + left as f64, self.first_px[1] + top as f64];
        let [columns, rows, _] = pixel_places(first_px, width, height);
        let crop = Crop {
            centre_px: self.centre_px,
            outline_px: self.outline_px.clone(),
            first_px,
            places: [columns, rows],
            width,
            height,
            intensity,
            smooth: smooth.clone(),
            template: None,
            weights: weights.into(),
            n_used,
            mean: self.mean + mean,
            n_averaged: self.n_averaged,
        };
        // A start needs no more than a rough place, so the noise is left in.
        let noise = ReferenceNoise { variance: 0.0, gain: 0.0, overlap: 0.0 };
        Self::from_crop(crop, smooth, noise, &self.settings).ok()
    }

    pub(super) fn masked(&self, visible: &[bool]) -> Result<Self, Lost> {
        let seen = padded(visible.iter().map(|&visible| if visible { 1.0 } else { 0.0 }));
        let of_seen = |image: &[f32]| -> Vec<f32> {
            image.iter().zip(&seen).map(|(value, seen)| value * seen).collect()
        };
        let weights = of_seen(&self.weights);
        let n_used = n_ones(&weights);
        let mut intensity = of_seen(&self.intensity);
        let mean = dot(&intensity, &weights) / n_used.max(1) as f64;
        let centred = |(value, weight): (&mut f32, &f32)| *value = weight * (f64::from(*value) - mean) as f32;
        intensity.iter_mut().zip(&weights).for_each(centred);
        let crop = Crop {
            centre_px: self.centre_px,
            outline_px: self.outline_px.clone(),
            first_px: self.first_px,
            places: [self.columns.clone(), self.rows.clone()],
            width: self.width,
            height: self.height,
            intensity,
            smooth: [of_seen(&self.gradient_x), of_seen(&self.gradient_y)],
            template: Some(self.template().to_vec()),
            weights: weights.into(),
            n_used,
            mean: self.mean + mean,
            n_averaged: self.n_averaged,
        };
        let plain = self.plain.each_ref().map(|image| of_seen(image));
        Self::from_crop(crop, plain, self.noise, &self.settings)
    }

    /// A subset of the same size around a position, its outline turned with it.
    pub(crate) fn at(&self, position: &Position) -> Subset {
        let theta_rad = position.theta_rad.map_or(0.0, |theta| theta.value);
        Subset::new("", position.x_px.value, position.y_px.value, self.width / 2, self.height / 2)
            .within(turned(&self.outline_px, theta_rad))
    }

    /// Pixels of the rectangle.
    pub(crate) fn n_pixels(&self) -> usize {
        self.width * self.height
    }

    /// Whether a pixel of the rectangle, by its place row by row, lies within the outline.
    pub(super) fn is_outlined(&self, at: usize) -> bool {
        let place = || [f64::from(self.columns[at]), f64::from(self.rows[at])];
        self.outline_px.is_empty() || is_within(&self.outline_px, place())
    }

    pub(crate) fn lattice(&self) -> Lattice {
        Lattice { first_px: self.first_px, width: self.width, height: self.height }
    }

    /// Half of the width and height between the outer pixels' centres, from the centre to the farther side.
    pub(crate) fn half_px(&self) -> [f64; 2] {
        let [x, y] = self.first_px;
        let (right, bottom) = (x + (self.width - 1) as f64, y + (self.height - 1) as f64);
        [right.max(-x), bottom.max(-y)]
    }

    /// The bounds in the image of the subset under a warp: its first column and row, and its last.
    pub(crate) fn bounds(&self, warp: &Warp) -> [[f64; 2]; 2] {
        let [x, y] = self.first_px;
        warp.bounds(self.first_px, [x + (self.width - 1) as f64, y + (self.height - 1) as f64])
    }
}

/// Pixels whose weight is 1.
pub(super) fn n_ones(weights: &[f32]) -> usize {
    weights.iter().filter(|&&weight| weight > 0.0).count()
}

/// A polynomial of second order, of the coefficients of 1, x, y, x^2, xy, y^2.
#[inline(always)]
pub(super) fn second_order(q: &[f32; 6], x: f32, y: f32) -> f32 {
    q[0] + (q[1] + q[3] * x + q[4] * y) * x + (q[2] + q[5] * y) * y
}

/// What a subset is made of, besides its noise.
pub(super) struct Crop {
    pub(super) centre_px: [f64; 2],
    pub(super) outline_px: Vec<[f64; 2]>,
    pub(super) first_px: [f64; 2],
    /// Column and row of each pixel.
    pub(super) places: [Arc<[f32]>; 2],
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) intensity: Vec<f32>,
    pub(super) smooth: [Vec<f32>; 2],
    pub(super) template: Option<Vec<f32>>,
    pub(super) weights: Arc<[f32]>,
    pub(super) n_used: usize,
    pub(super) mean: f64,
    pub(super) n_averaged: f64,
}
