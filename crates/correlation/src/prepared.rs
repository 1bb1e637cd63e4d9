//! A subset prepared once: gradients, Hessian and noise, for many matches.

pub(crate) mod linearised;
pub(crate) mod moments;
pub(crate) mod normal;
pub(crate) mod outline;
mod region;
pub(crate) mod response;
pub(crate) mod steps;

use std::cell::Cell;
use std::ops::Deref;
use std::sync::Arc;

use chainwave_measurement::{Lost, Subset};

use crate::interpolation_error::bias::InterpolationBias;
use crate::interpolation_error::energy::InterpolationEnergy;
use crate::interpolation_error::lagged::Surroundings;
use crate::prepared::linearised::{Crop, Linearised, n_ones};
use crate::prepared::normal::ReferenceNoise;
use crate::prepared::region::SubsetRegion;
use crate::prepared::steps::Steps;
use crate::reference::gradient::noise_variance;
use crate::reference::image::ReferenceImage;
use crate::simd::dot;
use crate::{Reference, Settings, Shape};

/// A subset of a reference image, prepared once to be matched often: what Gauss-Newton steps need, and what their end is stated with.
#[derive(Debug, Clone)]
pub struct PreparedSubset {
    /// What finds a place.
    pub(crate) linearised: Linearised,
    /// Sums over the pixels of the reference times the squares of what a unit of their grey value displaces the centre by:
    /// xx, xy and yy.
    pub(crate) light_moments: [f64; 3],
    /// What interpolation adds to the displacement.
    pub(crate) bias: InterpolationBias,
    /// What it adds to the residual.
    pub(crate) interpolation_energy: InterpolationEnergy,
    /// Variance that rounding leaves in the difference of two images, in counts squared: a twelfth of the square of a step for each.
    pub(crate) rounding_variance: f64,
}

/// Whatever finds a place by the linearised subset does so by the whole one.
impl Deref for PreparedSubset {
    type Target = Linearised;

    fn deref(&self) -> &Linearised {
        &self.linearised
    }
}

/// A reference whose own noise moves it by more than this cannot be located to a pixel.
const LARGEST_REFERENCE_SIGMA_PX: f64 = 0.5;
/// Largest relative standard error with which a subset may know its own Hessian, and so sigma, where that locates it: beyond it readings
/// scatter by another sigma than is stated, and a lone round spot, whose turn is open, is taken for any other.
const LARGEST_SENSITIVITY_ERROR: f64 = 0.4;

/// What is made for a subset and of no use behind its preparation.
#[derive(Default)]
struct Buffers {
    steps: Steps,
    around: Surroundings,
}

thread_local! {
    /// Those of the subset that this thread prepared last: to ask for them anew takes as long as to fill them.
    static BUFFERS: Cell<Buffers> = Cell::default();
}

impl PreparedSubset {
    /// Prepares a subset from the reference around it.
    ///
    /// # Errors
    /// [`Lost::OutOfView`] when the reference does not hold the subset, [`Lost::NoTexture`] when its contrast does
    /// not locate it in both directions.
    pub fn new(reference: &Reference, subset: &Subset, settings: &Settings) -> Result<Self, Lost> {
        let part = SubsetRegion::new(reference, subset).ok_or(Lost::OutOfView)?;
        let gradients = reference.gradients();
        let [columns, rows, ones] = reference.places(part.first_px(subset), part.width, part.height);
        let weights = part.weights(gradients.usable.as_deref(), subset);
        let (all_used, weights) = (weights.is_none(), weights.map_or(ones, Arc::from));
        let n_used = if all_used { part.n_pixels() } else { n_ones(&weights) };
        let used = |image: &[f32]| {
            let mut values = part.padded(image);
            if !all_used {
                values.iter_mut().zip(weights.iter()).for_each(|(value, weight)| *value *= weight);
            }
            values
        };
        let variance = noise_variance(&used(&gradients.fourth), n_used, reference.level());
        let filter = &gradients.filter;
        let noise = ReferenceNoise { variance, gain: filter.noise_gain, overlap: filter.plain_overlap };
        let mut grey = part.padded(reference.pixels());
        let mean = dot(&grey, &weights) / n_used.max(1) as f64;
        chainwave_vectors::dispatch_loop(
            #[inline(always)]
            || grey.iter_mut().for_each(|value| *value = (f64::from(*value) - mean) as f32),
        );
        let template = (!all_used).then(|| grey[..part.n_pixels()].to_vec());
        if all_used {
            grey[part.n_pixels()..].fill(0.0);
        } else {
            grey.iter_mut().zip(weights.iter()).for_each(|(value, weight)| *value *= weight);
        }
        let plain = [used(&gradients.plain.x), used(&gradients.plain.y)];
        let crop = Crop {
            centre_px: [subset.x_px, subset.y_px],
            outline_px: subset.outline_px.clone(),
            first_px: part.first_px(subset),
            places: [columns, rows],
            width: part.width,
            height: part.height,
            intensity: grey,
            template,
            smooth: [used(&gradients.smooth.x), used(&gradients.smooth.y)],
            n_used,
            weights,
            mean,
            n_averaged: reference.n_averaged() as f64,
        };
        let subset = Linearised::from_crop(crop, plain, noise, settings)?;
        let sigma_px = (variance * subset.covariance.largest_signal()).sqrt();
        if sigma_px.is_nan() || sigma_px > LARGEST_REFERENCE_SIGMA_PX {
            return Err(Lost::NoTexture);
        }
        let mut buffers = BUFFERS.take();
        let found = Self::with_interpolation(subset, reference.image(), part.first_in_image(), &mut buffers);
        BUFFERS.set(buffers);
        found
    }

    /// The subset whose first pixel is at a place of the image, with what interpolation will do to it.
    fn with_interpolation(
        subset: Linearised,
        image: &ReferenceImage,
        first_in_image: [i64; 2],
        Buffers { steps, around }: &mut Buffers,
    ) -> Result<Self, Lost> {
        steps.make(&subset);
        let is_unclear = |axis: usize| {
            let error = subset.covariance.sensitivity_error(axis, steps.n_independent()[axis]);
            error.is_nan() || error > LARGEST_SENSITIVITY_ERROR
        };
        if is_unclear(0) || is_unclear(1) {
            return Err(Lost::NoTexture);
        }
        around.surround(image, first_in_image, [subset.width, subset.height]);
        let correlations = around.correlations(steps);
        let noise_energy = subset.n_used as f64 * subset.noise_variance;
        let interpolation = subset.settings.interpolation;
        Ok(Self {
            light_moments: steps.by_light(),
            bias: InterpolationBias::new(&correlations, interpolation),
            interpolation_energy: InterpolationEnergy::new(&correlations, noise_energy, interpolation),
            linearised: subset,
            rounding_variance: 1.0 / 6.0 * image.quantum.powi(2),
        })
    }

    /// Prepares a subset with the first of some shape functions that its texture is enough for.
    pub(crate) fn of_first(
        shapes: &[Shape],
        reference: &Reference,
        subset: &Subset,
        settings: &Settings,
    ) -> Option<Self> {
        let of_shape = |&shape: &Shape| Self::new(reference, subset, &Settings { shape, ..settings.clone() });
        shapes.iter().find_map(|shape| of_shape(shape).ok())
    }

    /// Variance that rounding leaves in one image, in counts squared.
    pub(crate) fn rounding_of_one(&self) -> f64 {
        0.5 * self.rounding_variance
    }

    /// The subset with those of its pixels alone that are used here and `visible`.
    pub(crate) fn masked(&self, visible: &[bool]) -> Result<Self, Lost> {
        let linearised = self.linearised.masked(visible)?;
        // What interpolation and the light do is that of the whole subset, nearly: preparing a part must be quick.
        let interpolation_energy =
            self.interpolation_energy.scaled(linearised.n_used as f64 / self.n_used as f64);
        let Self { bias, light_moments, rounding_variance, .. } = *self;
        Ok(Self { linearised, bias, interpolation_energy, light_moments, rounding_variance })
    }

    /// Share of the pixels in its middle, half as wide and high, that the match uses, of those within the outline; all where none is.
    pub(crate) fn share_used_in_middle(&self) -> f64 {
        if self.n_used() == self.n_pixels() {
            return 1.0;
        }
        let middle = |n: usize| n / 4..n - n / 4;
        let (mut n_used, mut n) = (0.0, 0.0);
        for row in middle(self.height) {
            for at in middle(self.width).map(|column| row * self.width + column) {
                if self.is_outlined(at) {
                    n_used += f64::from(self.weights[at]);
                    n += 1.0;
                }
            }
        }
        if n > 0.0 { n_used / n } else { 1.0 }
    }

    /// Pixels of the subset's rectangle.
    pub fn n_pixels(&self) -> usize {
        self.width * self.height
    }

    /// Pixels within the subset's outline; all where it has none.
    pub fn n_outlined(&self) -> usize {
        (0..self.n_pixels()).filter(|&at| self.is_outlined(at)).count()
    }

    /// Pixels that the match uses: not those that saturate, that are no numbers or that show the dark ground.
    pub fn n_used(&self) -> usize {
        self.linearised.n_used
    }
}
