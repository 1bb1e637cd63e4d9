//! `[synthetic]`: what `synthesize` films.

use serde::{Deserialize, Serialize};

use super::{Fault, FilmedRings, FilmedView, TrueChain};
use crate::numbers::NotNegative;

/// What `synthesize` films: the truth, and the camera that sees it.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Synthetic {
    /// Seed of everything random.
    pub seed: u64,
    /// Seed of the pictures' noise, where it is another one: the same strikes, triggers and views, filmed once more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_seed: Option<u64>,
    /// Damping c_d of each body.
    pub damping_kg_per_s: NotNegative,
    /// Damping c_s of the striker's contact, where there is a striker.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub striker_damping_kg_per_s: Option<NotNegative>,
    /// Standard deviation of the trigger's delay from trial to trial.
    pub trigger_jitter_s: NotNegative,
    /// Standard deviation of what the trigger's delay gains from trial to trial and keeps.
    #[serde(default)]
    pub trigger_walk_s: NotNegative,
    /// Standard deviation of the trigger's delay from view to view, in common for all trials of a view.
    #[serde(default)]
    pub trigger_view_s: NotNegative,
    /// Standard deviation of the striker's velocity, or of any other drive, from trial to trial, relative to it, where it is not what is stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub striker_scatter: Option<NotNegative>,
    /// Standard deviation of the stage's position, from view to view.
    #[serde(default)]
    pub stage_sigma_m: NotNegative,
    /// Standard deviation of the mass, from body to body.
    #[serde(default)]
    pub mass_sigma_kg: NotNegative,
    /// Standard deviation of the contact law's prefactor, relative to it, from gap to gap.
    #[serde(default)]
    pub stiffness_scatter: NotNegative,
    /// What is true of the chain that is filmed, where that is not what is stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chain: Option<TrueChain>,
    /// Camera number of the first image (the trigger is image 0).
    pub first_image: i64,
    /// Frames in a recording.
    pub n_frames: usize,
    /// Views that are filmed in another way.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<FilmedView>,
    /// The camera.
    pub camera: chainwave_synthetic::Camera,
    /// The chain as the camera sees it.
    pub specimen: chainwave_synthetic::Specimen,
    /// The rings that the specimen's bodies are, where they are to move and to bend as the ring model says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rings: Option<FilmedRings>,
    /// What goes wrong.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
}
