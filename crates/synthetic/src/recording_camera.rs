//! The camera of one recording: its effects as they were drawn, from the light of the scene to the stored counts.

use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::effects::{BlockCoding, HotPixel, ReflectionMap, SensorMap, vignette};
use crate::seed::{Purpose, stream};
use crate::settings::{Camera, Shot};

/// What was drawn for the camera of one recording, and what follows from the settings: the truth behind its effects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraTruth {
    /// True scale in the ideal picture, in pixels per metre.
    pub scale_px_per_m: f64,
    /// The view's own factor in it.
    pub view_magnification: f64,
    /// Pixel of body 1's rest centre (column, row) in the ideal picture, were the stage at 0.
    pub first_body_px: [f64; 2],
    /// Root mean square of the pixels' offsets, as a fraction of the range from black to white, hot pixels included.
    pub offset_rms: f64,
    /// Root mean square of the pixels' relative gains, dead pixels (gain -1) included.
    pub gain_rms: f64,
    /// Hot pixels.
    pub hot_pixels: Vec<HotPixel>,
    /// (Column, row) of each dead pixel.
    pub dead_pixels: Vec<[usize; 2]>,
    /// Phases of the shake: along the columns' direction, along the rows', of the turn.
    pub shake_phases_rad: [f64; 3],
    /// Frames whose second lines repeat the ones above them.
    pub repeated_line_frames: Vec<usize>,
}

/// How the camera stands and is focused at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraPose {
    /// Displacement of the ideal picture by the shake (right, down).
    pub shift_px: [f64; 2],
    /// Its turn about the optical axis, from right towards down.
    pub turn_rad: f64,
    /// Standard deviation of the Gaussian that a point is shown as.
    pub defocus_px: f64,
}

/// A recording's camera, ready for use.
pub(crate) struct RecordingCamera<'a> {
    camera: &'a Camera,
    shot: &'a Shot,
    view_magnification: f64,
    /// True scale.
    pub(crate) scale_px_per_m: f64,
    /// Body 1's rest centre, were the stage at 0.
    pub(crate) first_body_px: [f64; 2],
    shake_phases_rad: [f64; 3],
    sensor: Option<SensorMap>,
    reflections: Option<ReflectionMap>,
    coding: Option<BlockCoding>,
}

impl<'a> RecordingCamera<'a> {
    pub(crate) fn new(camera: &'a Camera, shot: &'a Shot) -> Self {
        let (effects, size_px) = (&camera.effects, [camera.width_px, camera.height_px]);
        let (error, view_magnification) = effects
            .scale
            .as_ref()
            .map_or((0.0, 1.0), |scale| (scale.error, scale.view_magnification(effects.seed, shot.view)));
        let (pattern, defects) = (effects.fixed_pattern.as_ref(), effects.defective_pixels.as_ref());
        let has_map = pattern.is_some() || defects.is_some();
        let reflections = effects.reflections.as_ref();
        let phases = |shake: &crate::Shake| shake.phases_rad(shot.noise_seed);
        Self {
            camera,
            shot,
            view_magnification,
            scale_px_per_m: camera.scale_px_per_m * (1.0 + error) * view_magnification,
            first_body_px: magnified(camera, shot.first_body_px, view_magnification),
            shake_phases_rad: effects.shake.as_ref().map_or([0.0; 3], phases),
            sensor: has_map.then(|| SensorMap::new(effects.seed, pattern, defects, size_px)),
            reflections: reflections
                .map(|settings| ReflectionMap::new(effects.seed, shot.view, settings, size_px)),
            coding: effects.jpeg_quality.map(|quality| BlockCoding::new(quality, camera.sensor.full_scale())),
        }
    }

    pub(crate) fn truth(&self) -> CameraTruth {
        let [offset_rms, gain_rms] = self.sensor.as_ref().map_or([0.0; 2], SensorMap::rms);
        CameraTruth {
            scale_px_per_m: self.scale_px_per_m,
            view_magnification: self.view_magnification,
            first_body_px: self.first_body_px,
            offset_rms,
            gain_rms,
            hot_pixels: self.sensor.as_ref().map_or_else(Vec::new, |sensor| sensor.hot.clone()),
            dead_pixels: self.sensor.as_ref().map_or_else(Vec::new, |sensor| sensor.dead.clone()),
            shake_phases_rad: self.shake_phases_rad,
            repeated_line_frames: (0..self.shot.n_frames)
                .filter(|&frame| self.repeats_lines(frame))
                .collect(),
        }
    }

    /// How many times larger the picture is than the settings say.
    pub(crate) fn magnification(&self) -> f64 {
        self.scale_px_per_m / self.camera.scale_px_per_m
    }

    /// How much later than a frame's time stamp a row is exposed.
    pub(crate) fn delay_s(&self, row: f64) -> f64 {
        self.camera.effects.line_time_s.unwrap_or(0.0) * row.clamp(0.0, self.camera.height_px as f64 - 1.0)
    }

    /// Whether rows are exposed one after the other.
    pub(crate) fn is_rolling(&self) -> bool {
        self.camera.effects.line_time_s.is_some_and(|line_time_s| line_time_s > 0.0)
    }

    /// Whether the still parts of the picture stay as they are.
    pub(crate) fn is_still(&self) -> bool {
        self.camera.effects.shake.is_none() && self.camera.effects.defocus.is_none()
    }

    /// How the camera stands and is focused at a time after the trigger.
    pub(crate) fn pose(&self, stamp_s: f64) -> CameraPose {
        let (effects, shot, rate_hz) = (&self.camera.effects, self.shot, self.camera.rate_hz);
        let (shift_px, turn_rad) = effects.shake.as_ref().map_or(([0.0; 2], 0.0), |shake| {
            shake.at(self.shake_phases_rad, stamp_s, stamp_s + shot.trigger_delay_s)
        });
        let first_s = shot.stamp_s(0, rate_hz);
        let lasts_s = shot.stamp_s(shot.n_frames - 1, rate_hz) - first_s;
        let progress = if lasts_s > 0.0 { (stamp_s - first_s) / lasts_s } else { 0.0 };
        let defocus_px = effects.defocus.map_or(0.0, |defocus| defocus.sigma_px(progress));
        CameraPose { shift_px, turn_rad, defocus_px }
    }

    /// Turns the tones of whole rows, from `first_row` on, into expected counts before the sensor's own pattern.
    pub(crate) fn collect(&self, tones: &mut [f32], first_row: usize, stamp_s: f64, flicker_phase_rad: f64) {
        let Camera { sensor, effects, lighting, exposure_s, width_px, height_px, .. } = self.camera;
        if let Some(shadow) = &effects.shadow {
            shadow.apply(tones, *width_px, stamp_s);
        }
        if let Some(reflections) = &self.reflections {
            reflections.apply(tones, first_row * width_px);
        }
        if let Some(at_corner) = effects.vignetting {
            vignette(tones, [*width_px, *height_px], first_row, at_corner);
        }
        let black = sensor.black_level as f32;
        let light = lighting
            .as_ref()
            .map_or(1.0, |lighting| lighting.factor(stamp_s, *exposure_s, flicker_phase_rad));
        let range = (self.range() * light) as f32;
        for value in tones {
            *value = black + range * *value;
        }
    }

    /// Lays the sensor's own pattern over a frame's expected counts.
    pub(crate) fn lay_pattern(&self, counts: &mut [f32]) {
        let Some(map) = &self.sensor else { return };
        map.apply(counts, self.camera.sensor.black_level as f32, self.range() as f32);
    }

    /// Adds to a frame's expected counts the noise that its rows and columns have in common.
    pub(crate) fn add_line_noise(&self, frame: usize, counts: &mut [f32]) {
        if let Some(noise) = &self.camera.effects.line_noise {
            noise.apply(counts, self.camera.width_px, self.range(), self.shot.noise_seed, frame);
        }
    }

    /// Counts from black to white.
    fn range(&self) -> f64 {
        self.camera.sensor.white_level() - self.camera.sensor.black_level
    }

    /// Replaces a frame's counts by what is kept of them.
    pub(crate) fn store(&self, frame: usize, counts: &mut [u16]) {
        let effects = &self.camera.effects;
        if let Some(coding) = &self.coding {
            coding.apply(counts, self.camera.width_px);
        }
        if let Some(bits) = effects.stored_bits {
            keep_bits(counts, self.camera.sensor.bit_depth, bits);
        }
        if self.repeats_lines(frame) {
            for pair in counts.chunks_mut(2 * self.camera.width_px) {
                let (above, below) = pair.split_at_mut(self.camera.width_px);
                below.copy_from_slice(&above[..below.len()]);
            }
        }
    }

    fn repeats_lines(&self, frame: usize) -> bool {
        let share = self.camera.effects.repeated_lines.unwrap_or(0.0);
        let draw = || stream(Purpose::RepeatedLines, self.shot.noise_seed, frame as u64).random::<f64>();
        share > 0.0 && draw() < share
    }
}

/// Rounds counts to the nearest whose bits below the highest `kept` are zero.
fn keep_bits(counts: &mut [u16], bit_depth: u32, kept: u32) {
    let step = 1_u32 << bit_depth.saturating_sub(kept);
    let highest = (1_u32 << bit_depth) - step;
    for count in counts {
        *count = ((u32::from(*count) + step / 2) / step * step).min(highest) as u16;
    }
}

/// Where a view's magnification about the optical axis puts a point of the ideal picture.
fn magnified(camera: &Camera, at_px: [f64; 2], factor: f64) -> [f64; 2] {
    let middle_px = [camera.width_px, camera.height_px].map(|size| (size as f64 - 1.0) / 2.0);
    let axis_px = camera.optics.and_then(|optics| optics.principal_point_px).unwrap_or(middle_px);
    [0, 1].map(|axis| at_px[axis] + (factor - 1.0) * (at_px[axis] - axis_px[axis]))
}
