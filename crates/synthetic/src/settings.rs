//! What is filmed and by what camera: the settings that a configuration holds, and their checks.

use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::SyntheticError;
use crate::check::{require, require_not_negative, require_positive};
use crate::effects::Effects;
use crate::lighting::Lighting;
use crate::optics::Optics;
use crate::seed::{Purpose, stream};

/// A high-speed camera that looks at right angles to the chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Columns of a frame.
    pub width_px: usize,
    /// Rows of a frame.
    pub height_px: usize,
    /// Frames per second.
    pub rate_hz: f64,
    /// Exposure of a frame, at most a frame interval. It is written into the files.
    pub exposure_s: f64,
    /// Whether bodies are blurred along the path that they move during the exposure.
    #[serde(default)]
    pub blur: bool,
    /// How pixels are stored.
    pub packing: Packing,
    /// Magnification: pixels per metre in the plane of the markers.
    pub scale_px_per_m: f64,
    /// What turns light into counts.
    pub sensor: Sensor,
    /// Lens and turn of the camera; a straight view when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub optics: Option<Optics>,
    /// What the light does; steady when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lighting: Option<Lighting>,
    /// What else a real camera does; nothing when absent.
    #[serde(default, skip_serializing_if = "Effects::is_off")]
    pub effects: Effects,
}

/// How a .cine file stores pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Packing {
    /// One byte a pixel.
    #[serde(rename = "8")]
    Bits8,
    /// Two bytes a pixel.
    #[serde(rename = "16")]
    Bits16,
    /// Four pixels in five bytes: 12-bit counts companded to 10 bits.
    #[serde(rename = "p10")]
    P10,
    /// Two pixels in three bytes: 12-bit counts.
    #[serde(rename = "p12l")]
    P12L,
}

/// Noise and levels of a sensor; a count is the unit of a pixel's linear value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Bits of a linear count. A P10 file stores 12-bit counts, companded.
    pub bit_depth: u32,
    /// Count of a pixel without light.
    pub black_level: f64,
    /// Standard deviation of the noise that does not depend on the light, in counts.
    pub read_noise_counts: f64,
    /// Gain: the shot noise has the variance gain times (counts above black).
    pub counts_per_electron: f64,
}

impl Sensor {
    /// Largest count.
    pub(crate) fn full_scale(&self) -> f64 {
        f64::from((1_u32 << self.bit_depth) - 1)
    }

    /// Count of a tone of 1: a 128th below full scale, as in Phantom files (4064 at 12 bits, 254 at 8).
    pub(crate) fn white_level(&self) -> f64 {
        let n_counts = f64::from(1_u32 << self.bit_depth);
        n_counts - n_counts / 128.0
    }
}

/// The chain as the camera sees it: equal rings in a row, a speckled marker on each, two rods in front.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Specimen {
    /// Number of bodies.
    pub n_bodies: usize,
    /// Distance between neighbouring bodies at rest, in metres.
    pub pitch_m: f64,
    /// The same of each gap where they differ, from the first one on; none where they do not.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gaps_m: Vec<f64>,
    /// The outline of a body.
    pub ring: Ring,
    /// The rigid marker at the centre of each body.
    pub marker: Marker,
    /// The rods on which the bodies slide.
    pub rods: Rods,
    /// How bright the parts are.
    #[serde(default)]
    pub tones: Tones,
}

/// A thin elliptical ring.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ring {
    /// Outer semi-axis along the chain, in metres.
    pub semi_major_m: f64,
    /// Outer semi-axis across the chain, in metres.
    pub semi_minor_m: f64,
    /// Wall thickness at the poles, in metres.
    pub wall_m: f64,
}

/// A flat, rigid rectangle with dark speckles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// Half the extent along the chain, in metres.
    pub half_width_m: f64,
    /// Half the extent across the chain, in metres.
    pub half_height_m: f64,
    /// Diameter of a speckle where it has fallen to 1/e of its depth, in pixels.
    pub speckle_diameter_px: f64,
    /// Seed of the speckle patterns; each body has its own, the same in every view and trial.
    pub seed: u64,
}

/// Straight steel rods along the chain, in front of the rings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rods {
    /// Diameter in metres.
    pub diameter_m: f64,
    /// Height of each rod's axis below the chain's, in metres; negative is above.
    pub below_axis_m: Vec<f64>,
}

/// Brightness of the parts: 0 is black, 1 the sensor's white level.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tones {
    /// Mean of the backdrop.
    pub backdrop: f64,
    /// Largest deviation of one blot of the backdrop from its mean.
    pub blot: f64,
    /// The rings' edge that faces the camera.
    pub ring: f64,
    /// The marker between its speckles.
    pub marker: f64,
    /// How much darker the marker is in the middle of the darkest speckle.
    pub speckle_depth: f64,
    /// The brightest line of a rod.
    pub rod: f64,
}

impl Default for Tones {
    /// Matt light rings and markers before a dark backdrop. The speckles' contrast is about 0.13 rms, and no part comes
    /// near the ends of the range.
    fn default() -> Self {
        Self { backdrop: 0.10, blot: 0.03, ring: 0.50, marker: 0.78, speckle_depth: 0.52, rod: 0.80 }
    }
}

/// One recording: where the camera stands, when it records, and what differs from trial to trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shot {
    /// Position of the stage along the chain, in metres.
    pub stage_m: f64,
    /// Pixel of body 1's rest centre (column, row) when the stage is at 0.
    pub first_body_px: [f64; 2],
    /// Number of the first image; the trigger is image 0, so it is negative for frames before the trigger.
    pub first_image: i64,
    /// Number of frames.
    pub n_frames: usize,
    /// Instant of the trigger after the impact, in seconds: motion time = time stamp + delay.
    pub trigger_delay_s: f64,
    /// Time stamp of image 0, in seconds after the trigger, at least 0 and below a frame interval.
    pub frame_phase_s: f64,
    /// Seed of the sensor's noise and of the flicker's phase.
    pub noise_seed: u64,
    /// Number of the view, from 1: what the camera's effects draw for a view follows from it.
    #[serde(default)]
    pub view: u64,
    /// Bodies whose markers are hidden for a while.
    #[serde(default)]
    pub covers: Vec<Cover>,
}

/// Something dark that hides a body's marker for a while, and moves with it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cover {
    /// The body, from 1.
    pub body: usize,
    /// Time stamp of the first hidden frame, in seconds after the trigger.
    pub from_s: f64,
    /// Time stamp before which the last hidden frame lies.
    pub until_s: f64,
}

impl Shot {
    /// Time stamp of a frame, counted from the first of the recording, in seconds after the trigger: the middle of its
    /// exposure.
    pub fn stamp_s(&self, frame: usize, rate_hz: f64) -> f64 {
        self.frame_phase_s + (self.first_image as f64 + frame as f64) / rate_hz
    }

    /// Phase of the light's flicker at the trigger: uniform, from the noise's seed.
    pub fn flicker_phase_rad(&self) -> f64 {
        stream(Purpose::Flicker, self.noise_seed, 0).random_range(0.0..std::f64::consts::TAU)
    }
}

impl Camera {
    /// Refuses settings that no camera has.
    ///
    /// # Errors
    /// The first setting that makes no sense.
    pub fn check(&self) -> Result<(), SyntheticError> {
        let frame_size = 1..=usize::from(u16::MAX);
        let interval_s = 1.0 / self.rate_hz;
        require(frame_size.contains(&self.width_px), "camera.width_px", "1 to 65535", self.width_px)?;
        require(frame_size.contains(&self.height_px), "camera.height_px", "1 to 65535", self.height_px)?;
        let header_rate = self.rate_hz >= 1.0 && self.rate_hz <= f64::from(u32::MAX);
        require(header_rate, "camera.rate_hz", "1 to 4.29e9 frames per second", self.rate_hz)?;
        let exposed = self.exposure_s > 0.0 && self.exposure_s <= interval_s && self.exposure_s < 1.0;
        require(exposed, "camera.exposure_s", "above 0, below 1 s, at most 1/rate_hz", self.exposure_s)?;
        let pixel_bytes = u32::try_from(2 * self.width_px * self.height_px).is_ok();
        require(pixel_bytes, "camera.height_px", "frames below 4 GiB", self.height_px)?;
        let scale = self.scale_px_per_m > 0.0 && self.scale_px_per_m <= 1.0e7;
        require(
            scale,
            "camera.scale_px_per_m",
            "above 0, at most 1e7 (a pixel of 0.1 um)",
            self.scale_px_per_m,
        )?;
        self.sensor.check()?;
        self.optics.iter().try_for_each(Optics::check)?;
        self.lighting.iter().try_for_each(Lighting::check)?;
        self.effects.check(self.sensor.bit_depth, self.height_px, interval_s)?;
        self.check_packing()
    }

    fn check_packing(&self) -> Result<(), SyntheticError> {
        let (fits, expected) = match self.packing {
            Packing::Bits8 => (self.sensor.bit_depth == 8, "8 bits for packing \"8\""),
            Packing::Bits16 => (true, ""),
            Packing::P10 => {
                (self.sensor.bit_depth == 12, "12 bits for packing \"p10\" (companded to 10 in the file)")
            }
            Packing::P12L => (self.sensor.bit_depth == 12, "12 bits for packing \"p12l\""),
        };
        require(fits, "camera.sensor.bit_depth", expected, self.sensor.bit_depth)?;
        let (group, expected) = match self.packing {
            Packing::Bits8 | Packing::Bits16 => (1, ""),
            Packing::P10 => (4, "a multiple of 4 for packing \"p10\""),
            Packing::P12L => (2, "a multiple of 2 for packing \"p12l\""),
        };
        require(self.width_px.is_multiple_of(group), "camera.width_px", expected, self.width_px)
    }
}

impl Sensor {
    fn check(&self) -> Result<(), SyntheticError> {
        require((8..=16).contains(&self.bit_depth), "camera.sensor.bit_depth", "8 to 16", self.bit_depth)?;
        let dark = self.black_level >= 0.0 && self.black_level < self.white_level();
        require(dark, "camera.sensor.black_level", "at least 0, below the white level", self.black_level)?;
        require_not_negative("camera.sensor.read_noise_counts", self.read_noise_counts)?;
        require_not_negative("camera.sensor.counts_per_electron", self.counts_per_electron)
    }
}

impl Specimen {
    /// Distance in metres from a body, counted from 0, to the next one at rest.
    pub(crate) fn gap_m(&self, body: usize) -> f64 {
        self.gaps_m.get(body).copied().unwrap_or(self.pitch_m)
    }

    /// Distance in metres from the first body to another at rest, counted from 0.
    pub(crate) fn rest_m(&self, body: usize) -> f64 {
        match self.gaps_m.is_empty() {
            true => body as f64 * self.pitch_m,
            false => (0..body).map(|gap| self.gap_m(gap)).sum(),
        }
    }

    pub(crate) fn check(&self) -> Result<(), SyntheticError> {
        require(self.n_bodies > 0, "specimen.n_bodies", "at least 1", self.n_bodies)?;
        require_positive("specimen.pitch_m", self.pitch_m)?;
        let is_whole = self.gaps_m.is_empty() || self.gaps_m.len() + 1 == self.n_bodies;
        require(is_whole, "specimen.gaps_m", "one for each gap, or none", self.gaps_m.len())?;
        self.gaps_m.iter().try_for_each(|gap_m| require_positive("specimen.gaps_m", *gap_m))?;
        require_positive("specimen.ring.semi_major_m", self.ring.semi_major_m)?;
        require_positive("specimen.ring.semi_minor_m", self.ring.semi_minor_m)?;
        let thin =
            self.ring.wall_m > 0.0 && self.ring.wall_m < self.ring.semi_major_m.min(self.ring.semi_minor_m);
        require(thin, "specimen.ring.wall_m", "above 0, below both semi-axes", self.ring.wall_m)?;
        self.marker.check(self.gaps_m.iter().copied().fold(self.pitch_m, f64::min))?;
        require_positive("specimen.rods.diameter_m", self.rods.diameter_m)?;
        for &below_m in &self.rods.below_axis_m {
            require(below_m.is_finite(), "specimen.rods.below_axis_m", "finite numbers", below_m)?;
        }
        self.tones.check()
    }
}

impl Marker {
    fn check(&self, pitch_m: f64) -> Result<(), SyntheticError> {
        let fits = |half_m: f64| half_m > 0.0 && half_m <= pitch_m / 2.0;
        let expected = "above 0, at most half the pitch";
        require(fits(self.half_width_m), "specimen.marker.half_width_m", expected, self.half_width_m)?;
        require(fits(self.half_height_m), "specimen.marker.half_height_m", expected, self.half_height_m)?;
        let speckle = self.speckle_diameter_px >= 1.0 && self.speckle_diameter_px.is_finite();
        let expected = "at least 1 pixel (a finer pattern cannot be sampled)";
        require(speckle, "specimen.marker.speckle_diameter_px", expected, self.speckle_diameter_px)
    }
}

impl Tones {
    fn check(&self) -> Result<(), SyntheticError> {
        for (name, tone) in [
            ("specimen.tones.backdrop", self.backdrop),
            ("specimen.tones.blot", self.blot),
            ("specimen.tones.ring", self.ring),
            ("specimen.tones.marker", self.marker),
            ("specimen.tones.speckle_depth", self.speckle_depth),
            ("specimen.tones.rod", self.rod),
        ] {
            require((0.0..=1.0).contains(&tone), name, "0 to 1", tone)?;
        }
        Ok(())
    }
}

impl Shot {
    pub(crate) fn check(&self, rate_hz: f64) -> Result<(), SyntheticError> {
        require(
            self.stage_m.abs() <= 1.0e3,
            "shot.stage_m",
            "within 1 km of the chain's origin",
            self.stage_m,
        )?;
        for at_px in self.first_body_px {
            require(at_px.abs() <= 1.0e6, "shot.first_body_px", "within a million pixels", at_px)?;
        }
        require((1..=1 << 27).contains(&self.n_frames), "shot.n_frames", "1 to 2^27", self.n_frames)?;
        let numbered = i32::try_from(self.first_image).is_ok()
            && i32::try_from(self.n_frames).is_ok_and(|n_frames| {
                self.first_image
                    .checked_add(i64::from(n_frames))
                    .is_some_and(|end| i32::try_from(end).is_ok())
            });
        require(numbered, "shot.first_image", "image numbers of 32 bits for every frame", self.first_image)?;
        require(
            self.trigger_delay_s.is_finite(),
            "shot.trigger_delay_s",
            "a finite number",
            self.trigger_delay_s,
        )?;
        let phase = self.frame_phase_s >= 0.0 && self.frame_phase_s < 1.0 / rate_hz;
        require(phase, "shot.frame_phase_s", "at least 0, below 1/rate_hz", self.frame_phase_s)?;
        self.covers.iter().try_for_each(Cover::check)
    }
}

impl Cover {
    fn check(&self) -> Result<(), SyntheticError> {
        require(self.body >= 1, "shot.covers.body", "at least 1", self.body)?;
        require(self.from_s.is_finite(), "shot.covers.from_s", "a finite number", self.from_s)?;
        require(self.until_s.is_finite(), "shot.covers.until_s", "a finite number", self.until_s)
    }
}
