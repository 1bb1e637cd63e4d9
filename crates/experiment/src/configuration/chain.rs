//! `[chain]`: bodies, what holds them to ground, and how far apart they rest.

use chainwave_analysis::Spacing;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use super::Pattern;
use crate::error::Error;
use crate::input::numbers::{NotNegative, Positive};

/// The chain.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chain {
    /// Number of bodies, at least two.
    #[serde(deserialize_with = "several")]
    pub n_bodies: usize,
    /// Distances between neighbouring bodies at rest, gap by gap.
    pub pitch_m: Pattern<Positive>,
    /// Its standard uncertainty, common to all gaps.
    pub pitch_sigma_m: Option<NotNegative>,
    /// Masses of the bodies.
    pub mass_kg: Pattern<Positive>,
    /// Standard uncertainty of their mean, common to all bodies.
    pub mass_sigma_kg: Option<NotNegative>,
    /// Standard deviation of the mass from body to body, relative to what is stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_scatter: Option<NotNegative>,
    /// How the bodies' dampings to ground stand to each other, where they differ; the fit finds their mean.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping_kg_per_s: Option<Pattern<NotNegative>>,
    /// Springs that hold the bodies to ground, where there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_stiffness_n_per_m: Option<Pattern<NotNegative>>,
    /// Standard uncertainty of their mean, common to all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_stiffness_sigma_n_per_m: Option<NotNegative>,
}

impl Chain {
    /// Mean distance between neighbours, in metres.
    pub fn mean_pitch_m(&self) -> f64 {
        self.pitch_m.mean(self.n_bodies - 1)
    }

    /// Mean mass of the bodies, in kilograms.
    pub fn mean_mass_kg(&self) -> f64 {
        self.mass_kg.mean(self.n_bodies)
    }

    /// How far apart neighbours rest.
    ///
    /// # Errors
    /// A list of another length than there are gaps.
    pub fn spacing(&self) -> Result<Spacing, Error> {
        match self.pitch_m.same() {
            Some(pitch_m) => Ok(pitch_m.into()),
            None => Ok(self.pitch_m.values(self.n_bodies - 1, "chain.pitch_m").map_err(Error::Value)?.into()),
        }
    }

    /// The distances gap by gap, in metres, where they differ; none where they are all the same.
    ///
    /// # Errors
    /// As [`Chain::spacing`].
    pub(crate) fn unequal_pitches_m(&self) -> Result<Vec<f64>, Error> {
        match self.pitch_m.same() {
            Some(_) => Ok(Vec::new()),
            None => self.pitch_m.values(self.n_bodies - 1, "chain.pitch_m").map_err(Error::Value),
        }
    }

    /// Masses of the bodies, in kilograms.
    ///
    /// # Errors
    /// A list of another length than there are bodies.
    pub fn masses_kg(&self) -> Result<Vec<f64>, Error> {
        self.mass_kg.values(self.n_bodies, "chain.mass_kg").map_err(Error::Value)
    }

    /// Springs of the bodies to ground, in newtons per metre; none at all where none are stated.
    ///
    /// # Errors
    /// A list of another length than there are bodies.
    pub fn ground_n_per_m(&self) -> Result<Vec<f64>, Error> {
        let stated = self.ground_stiffness_n_per_m.as_ref();
        let values = stated.map(|stated| stated.values(self.n_bodies, "chain.ground_stiffness_n_per_m"));
        values.transpose().map(Option::unwrap_or_default).map_err(Error::Value)
    }

    /// Their mean, in newtons per metre.
    pub fn mean_ground_n_per_m(&self) -> f64 {
        self.ground_stiffness_n_per_m.as_ref().map_or(0.0, |stated| stated.mean(self.n_bodies))
    }

    /// Dampings of the bodies in the proportions that are stated, with a mean; all alike where none are.
    ///
    /// # Errors
    /// A list of another length than there are bodies, or no damping at all.
    pub fn dampings_kg_per_s(&self, mean_kg_per_s: f64) -> Result<Vec<f64>, Error> {
        let Some(stated) = self.damping_kg_per_s.as_ref().filter(|stated| stated.same().is_none()) else {
            return Ok(vec![mean_kg_per_s; self.n_bodies]);
        };
        let own = stated.values(self.n_bodies, "chain.damping_kg_per_s").map_err(Error::Value)?;
        let mean = own.iter().sum::<f64>() / self.n_bodies as f64;
        if mean <= 0.0 {
            return Err(Error::Value(
                "chain.damping_kg_per_s: expected a damping above 0 somewhere, found none".into(),
            ));
        }
        Ok(own.into_iter().map(|own| mean_kg_per_s * (own / mean)).collect())
    }
}

/// No machine holds the motion of more bodies.
pub(crate) const MOST_BODIES: usize = 10_000_000;

/// Reads a number of bodies that make a chain; refused here, a wrong one is shown with its line.
fn several<'de, D: Deserializer<'de>>(number: D) -> Result<usize, D::Error> {
    match usize::deserialize(number)? {
        n_bodies @ 2..=MOST_BODIES => Ok(n_bodies),
        found @ (0 | 1) => Err(D::Error::custom(format!("expected at least 2 bodies, found {found}"))),
        found => Err(D::Error::custom(format!("expected at most {MOST_BODIES} bodies, found {found}"))),
    }
}
