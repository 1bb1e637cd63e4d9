//! How well a body's place is read from a picture, body by body.

use std::collections::BTreeMap;

use chainwave_correlation::{ExpectedSigma, ReferenceFrames, Settings, ShapeChoice, expected_sigma};
use chainwave_measurement::median;

use super::pictures::Pictures;
use crate::configuration::Tracking;
use crate::error::Error;
use crate::setup::Setup;

/// The standard uncertainty of a reading, body by body.
#[derive(Debug, Clone)]
pub(super) struct Readings {
    of_body: BTreeMap<usize, ExpectedSigma>,
    /// Of a body that no picture shows: the median of the others.
    pub(super) usual: ExpectedSigma,
}

impl Readings {
    /// By the noise and the texture of pictures at rest, and the method that the experiment names.
    ///
    /// # Errors
    /// Pictures that cannot be read, or none with a subset that can be told.
    pub(super) fn of(setup: &Setup, pictures: &[Pictures]) -> Result<Self, Error> {
        let settings = settings(&setup.experiment.tracking);
        let mut all: BTreeMap<usize, Vec<ExpectedSigma>> = BTreeMap::new();
        let mut lost = None;
        for one in pictures {
            let frames = ReferenceFrames::Mean(one.rest.clone());
            for (body, subset) in &one.subsets {
                match expected_sigma(one.recording.as_ref(), subset, &frames, &settings)? {
                    Ok(sigma) => all.entry(*body).or_default().push(sigma),
                    Err(why) => lost = Some(why),
                }
            }
        }
        let of_body: BTreeMap<usize, ExpectedSigma> =
            all.into_iter().filter_map(|(body, sigmas)| Some((body, middle(&sigmas)?))).collect();
        let each: Vec<ExpectedSigma> = of_body.values().copied().collect();
        let usual = middle(&each).ok_or_else(|| Error::Configuration {
            path: setup.path.clone(),
            message: format!(
                "expected subsets that can be followed in some view, found none: {} (hint: camera.first_body_px, the scale, and stage_m)",
                lost.map_or("no body lies in a picture", |why| why.as_str())
            ),
        })?;
        Ok(Self { of_body, usual })
    }

    /// Of a body.
    pub(super) fn of_body(&self, body: usize) -> ExpectedSigma {
        self.of_body.get(&body).copied().unwrap_or(self.usual)
    }

    /// The same with so many times the noise.
    pub(super) fn times(&self, noise: f64) -> Self {
        self.map(|sigma| ExpectedSigma { noise_px: sigma.noise_px.map(|sigma_px| noise * sigma_px), ..sigma })
    }

    /// With as much again that no model of a chain explains: a wave over the fraction of a pixel.
    pub(super) fn unexplained(&self) -> Self {
        self.map(|sigma| ExpectedSigma { interpolation_px: sigma.noise_px, ..sigma })
    }

    fn map(&self, changed: impl Fn(ExpectedSigma) -> ExpectedSigma) -> Self {
        let of_body = self.of_body.iter().map(|(body, sigma)| (*body, changed(*sigma)));
        Self { of_body: of_body.collect(), usual: changed(self.usual) }
    }
}

/// As bodies will be matched; where the shape function waits for evidence, by the one that is taken without any.
fn settings(tracking: &Tracking) -> Settings {
    let usual = Settings::default();
    let shape = match tracking.shape {
        ShapeChoice::Named(shape) => shape,
        ShapeChoice::ByEvidence => usual.shape,
    };
    Settings { shape, interpolation: tracking.interpolation, ..usual }
}

/// The medians of each number; `None` of nothing.
fn middle(sigmas: &[ExpectedSigma]) -> Option<ExpectedSigma> {
    let middle = |of: &dyn Fn(&ExpectedSigma) -> [f64; 2]| {
        let [x, y] = [0, 1].map(|axis| median(sigmas.iter().map(|sigma| of(sigma)[axis]).collect()));
        Some([x?, y?])
    };
    Some(ExpectedSigma {
        noise_px: middle(&|sigma| sigma.noise_px)?,
        interpolation_px: middle(&|sigma| sigma.interpolation_px)?,
    })
}
