//! How well a body's place is read from a picture, body by body.

use std::collections::BTreeMap;

use chainwave_correlation::{ReferenceFrames, expected_sigma};
use chainwave_measurement::median;

use super::pictures::Pictures;
use crate::error::Error;
use crate::setup::Setup;

/// The standard uncertainty of a reading, in pixels along x and y.
#[derive(Debug, Clone)]
pub(super) struct Readings {
    of_body: BTreeMap<usize, [f64; 2]>,
    /// Of a body that no picture shows: the median of the others.
    pub(super) usual_px: [f64; 2],
}

impl Readings {
    /// By the noise and the texture of pictures at rest.
    ///
    /// # Errors
    /// Pictures that cannot be read, or none with a subset that can be told.
    pub(super) fn of(setup: &Setup, pictures: &[Pictures]) -> Result<Self, Error> {
        let mut all: BTreeMap<usize, Vec<[f64; 2]>> = BTreeMap::new();
        let mut lost = None;
        for one in pictures {
            let frames = ReferenceFrames::Mean(one.rest.clone());
            for (body, subset) in &one.subsets {
                match expected_sigma(one.recording.as_ref(), subset, &frames)? {
                    Ok(sigma_px) => all.entry(*body).or_default().push(sigma_px),
                    Err(why) => lost = Some(why),
                }
            }
        }
        let middle = |of: &[[f64; 2]]| {
            let [x, y] = [0, 1].map(|axis| median(of.iter().map(|sigma| sigma[axis]).collect()));
            Some([x?, y?])
        };
        let of_body: BTreeMap<usize, [f64; 2]> =
            all.into_iter().filter_map(|(body, sigmas)| Some((body, middle(&sigmas)?))).collect();
        let each: Vec<[f64; 2]> = of_body.values().copied().collect();
        let usual_px = middle(&each).ok_or_else(|| Error::Configuration {
            path: setup.path.clone(),
            message: format!(
                "expected subsets that can be followed in some view, found none ({}; hint: camera.first_body_px, the scale, and stage_m)",
                lost.map_or("no body lies in a picture", |why| why.as_str())
            ),
        })?;
        Ok(Self { of_body, usual_px })
    }

    /// Of a body, in pixels along x and y.
    pub(super) fn of_body(&self, body: usize) -> [f64; 2] {
        self.of_body.get(&body).copied().unwrap_or(self.usual_px)
    }

    /// The same with so many times the noise.
    pub(super) fn times(&self, noise: f64) -> Self {
        let times = |sigma: [f64; 2]| sigma.map(|sigma| noise * sigma);
        let of_body = self.of_body.iter().map(|(body, sigma)| (*body, times(*sigma)));
        Self { of_body: of_body.collect(), usual_px: times(self.usual_px) }
    }
}
