//! The correction of a sensor: dark level, gain map and defects, from dark frames and a flat field.

use std::collections::BTreeSet;

use chainwave_measurement::{Recording, RecordingInfo, Region, median};

use super::defects::{DefectMap, response};
use super::statistics::PixelStatistics;
use crate::error::CameraError;
use crate::picture::PictureShape;
use crate::timing::states_depth;

/// Share of a flat field's pixels that may be saturated, such as hot ones.
const MOST_SATURATED: f64 = 0.01;
/// Relative difference of exposures that changes no dark level to speak of.
const SAME_EXPOSURE: f64 = 0.01;
/// Share of a sensor's pixels that are defective at most: of a sound one it is a thousandth or less, of frames that show a scene a third.
const MOST_DEFECTS: f64 = 0.02;
/// So many more say nothing of a small part of a sensor.
const FEW_DEFECTS: f64 = 10.0;
/// Dark frames whose mean leaves a tenth of a frame's noise, alike in all frames that it is taken off.
const ENOUGH_DARK_FRAMES: usize = 100;
/// Different counts that tell in what steps a file counts.
const FEWEST_COUNTS: usize = 3;

/// What a sensor's pixels add and multiply, and which of them are defects: count of light = (count - dark) gain.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorCorrection {
    width_px: usize,
    height_px: usize,
    bit_depth: Option<u32>,
    /// Whether the frames that it was found from say how many of their bits are significant.
    states_depth: bool,
    dark: Option<Vec<f32>>,
    gain: Option<Vec<f32>>,
    defects: DefectMap,
    n_dark_frames: usize,
    n_flat_frames: usize,
    /// Exposure of the dark frames.
    dark_exposure_s: Option<f64>,
    dark_sigma_counts: Option<f64>,
    /// The power of two in whose steps the dark frames count; 1 where they are too even to tell.
    dark_step_counts: f64,
    gain_sigma: Option<f64>,
}

impl SensorCorrection {
    /// No correction but for defects.
    pub fn of_defects(defects: DefectMap) -> Self {
        Self {
            width_px: defects.width_px(),
            height_px: defects.height_px(),
            bit_depth: None,
            states_depth: false,
            dark: None,
            gain: None,
            defects,
            n_dark_frames: 0,
            n_flat_frames: 0,
            dark_exposure_s: None,
            dark_sigma_counts: None,
            dark_step_counts: 1.0,
            gain_sigma: None,
        }
    }

    /// From the means of dark frames and of a flat field, one of which may be missing; their defects are found too. The gain is that
    /// of the usual pixel over that of each, so that counts keep their size.
    ///
    /// `None` where both are missing, of no frame or of different sizes, or where the usual pixel is no brighter in the flat field
    /// than in the dark.
    pub fn of_statistics(dark: Option<&PixelStatistics>, flat: Option<&PixelStatistics>) -> Option<Self> {
        let given = [dark, flat].into_iter().flatten();
        let first = given.clone().next()?;
        let (width_px, height_px) = (first.width_px(), first.height_px());
        let fits = |one: &PixelStatistics| {
            one.n_frames() > 0 && (one.width_px(), one.height_px()) == (width_px, height_px)
        };
        if !given.clone().all(fits) {
            return None;
        }
        let mut correction = Self::of_defects(DefectMap::none(width_px, height_px));
        if let Some(dark) = dark {
            correction.defects = DefectMap::of_dark(dark);
            correction.dark = Some(dark.mean().iter().map(|&mean| mean as f32).collect());
            correction.n_dark_frames = dark.n_frames();
            correction.dark_sigma_counts = sigma_of_mean(dark);
        }
        if let Some(flat) = flat {
            let response = response(flat, dark);
            let usual = median(response.clone()).filter(|&usual| usual > 0.0)?;
            correction.defects = correction.defects.and(&DefectMap::of_flat(flat, dark));
            // What does not respond is a defect, whose gain is never asked for.
            let gain = |&response: &f64| if response > 0.0 { (usual / response) as f32 } else { 1.0 };
            correction.gain = Some(response.iter().map(gain).collect());
            correction.n_flat_frames = flat.n_frames();
            correction.gain_sigma = match (sigma_of_mean(flat), dark.map(sigma_of_mean)) {
                (Some(of_flat), None) => Some(of_flat / usual),
                (Some(of_flat), Some(Some(of_dark))) => Some(of_flat.hypot(of_dark) / usual),
                _ => None,
            };
        }
        Some(correction)
    }

    /// From all frames of a recording taken in the dark, with the recordings' exposure and part of the sensor.
    ///
    /// # Errors
    /// [`CameraError::Read`] when a frame cannot be read.
    pub fn from_dark(dark: &dyn Recording) -> Result<Self, CameraError> {
        Self::from_parts(dark, Some(dark), None)
    }

    /// From all frames of an evenly lit field, taken with the recordings' lens and aperture, and of dark frames of the same kind, where
    /// there are any. Without them the dark level counts as light.
    ///
    /// # Errors
    /// [`CameraError::Correction`] when the two differ in size or depth, or the flat field is saturated or no brighter than the dark
    /// frames; [`CameraError::Read`] when a frame cannot be read.
    pub fn from_flat(flat: &dyn Recording, dark: Option<&dyn Recording>) -> Result<Self, CameraError> {
        if let Some(dark) = dark {
            check_same(
                flat,
                (PictureShape::of_recording(dark.info()), states_depth(dark.info())),
                "the dark frames",
            )?;
        }
        Self::from_parts(flat, dark, Some(flat))
    }

    fn from_parts(
        named: &dyn Recording,
        dark: Option<&dyn Recording>,
        flat: Option<&dyn Recording>,
    ) -> Result<Self, CameraError> {
        let statistics =
            |recording: &dyn Recording| PixelStatistics::of(recording, 0..recording.info().n_frames);
        let of_dark = dark.map(statistics).transpose()?;
        let of_flat =
            flat.map(|flat| statistics(flat).and_then(|of_flat| unsaturated(flat, of_flat))).transpose()?;
        let correction = Self::of_statistics(of_dark.as_ref(), of_flat.as_ref());
        let mut correction = correction.ok_or_else(|| CameraError::Correction {
            path: named.path().into(),
            what: "flat field".into(),
            expected: "frames that are brighter than the dark ones".into(),
            found: "none".into(),
        })?;
        let n_pixels = correction.width_px * correction.height_px;
        let n_defects = correction.defects.defects().len();
        if n_defects as f64 > MOST_DEFECTS * n_pixels as f64 + FEW_DEFECTS {
            return Err(CameraError::Correction {
                path: named.path().into(),
                what: "defective pixels".into(),
                expected: format!(
                    "at most {} % of all, with frames that show nothing but the dark, or an evenly lit field",
                    100.0 * MOST_DEFECTS
                ),
                found: format!("{:.1} %", 100.0 * n_defects as f64 / n_pixels as f64),
            });
        }
        correction.bit_depth = Some(named.info().bit_depth);
        correction.states_depth = states_depth(named.info());
        correction.dark_exposure_s = dark.and_then(|dark| dark.info().exposure_s);
        correction.dark_step_counts = dark.map_or(Ok(1.0), step_counts)?;
        Ok(correction)
    }

    /// With further defects, such as those found from scenes at rest.
    pub fn with_defects(mut self, more: &DefectMap) -> Self {
        self.defects = self.defects.and(more);
        self
    }

    /// The defects that are known.
    pub fn defects(&self) -> &DefectMap {
        &self.defects
    }

    /// Standard uncertainty of a pixel's dark level, in counts: what its noise leaves in the mean. It stays the same in all frames.
    /// `None` without dark frames, and of one, which does not tell its noise.
    pub fn dark_sigma_counts(&self) -> Option<f64> {
        self.dark_sigma_counts
    }

    /// Relative standard uncertainty of a usual pixel's gain: what noise leaves in the means of flat field and dark frames. It stays the
    /// same in all frames. `None` without a flat field, and where either is of one frame, which does not tell its noise.
    pub fn gain_sigma(&self) -> Option<f64> {
        self.gain_sigma
    }

    /// The largest gain of a pixel that is no defect; 1 without a flat field.
    pub(super) fn most_gain(&self) -> f64 {
        let is_defect: Vec<usize> =
            self.defects.defects().iter().map(|defect| defect.y * self.width_px + defect.x).collect();
        let gains = self.gain.iter().flatten().enumerate();
        let good = gains.filter(|(at, _)| is_defect.binary_search(at).is_err());
        good.fold(1.0, |most, (_, &gain)| most.max(gain.into()))
    }

    /// The light of a pixel that shows `count`.
    pub(super) fn light(&self, at: usize, count: f32) -> f32 {
        let dark = self.dark.as_ref().map_or(0.0, |dark| dark[at]);
        let gain = self.gain.as_ref().map_or(1.0, |gain| gain[at]);
        (count - dark) * gain
    }

    /// Refuses a recording of another part of the sensor or of another depth, as far as files state that: frames of a 12 bit sensor may lie
    /// in a file of 16, but are then no brighter than 12 bits are, and do not count in the steps that 12 bits at the top of 16 have.
    pub(super) fn check(&self, recording: &dyn Recording) -> Result<(), CameraError> {
        let bits = self.bit_depth.unwrap_or(recording.info().bit_depth);
        let expected = PictureShape { width_px: self.width_px, height_px: self.height_px, bits };
        check_same(recording, (expected, self.states_depth), "the sensor's correction")?;
        let full_scale = recording.info().full_scale();
        let most = self.dark.iter().flatten().fold(0.0, |most: f64, &dark| most.max(dark.into()));
        let of_dark = match (bits.checked_sub(recording.info().bit_depth), self.dark_step_counts) {
            _ if most > full_scale => format!("which go up to {most:.0}"),
            (Some(shift @ 1..), step) if step >= f64::from(shift).exp2() => {
                format!(
                    "which are multiples of {step} (hint: divide them by {step}, if bits lie at the top of each number)"
                )
            }
            _ => return Ok(()),
        };
        Err(CameraError::Correction {
            path: recording.path().into(),
            what: "frames".into(),
            expected: format!("counts on the scale of the dark frames, {of_dark}"),
            found: format!("a full scale of {full_scale}"),
        })
    }

    /// What was corrected, and what may be wrong with that for a recording of some exposure.
    pub(super) fn remarks(&self, exposure_s: Option<f64>) -> Vec<String> {
        let known = |known: Option<String>| {
            known.unwrap_or("an unknown amount, as one frame does not tell its noise".into())
        };
        let dark = self.dark.as_ref().map(|_| {
            let sigma = known(self.dark_sigma_counts.map(|sigma| format!("{sigma:.2} counts")));
            let hint = match self.n_dark_frames {
                ENOUGH_DARK_FRAMES.. => String::new(),
                _ => format!(
                    "; hint: the mean of n dark frames leaves 1 / sqrt(n) of a frame's noise on every picture alike, that of {ENOUGH_DARK_FRAMES} a tenth"
                ),
            };
            format!("the dark level of {} frames is taken off (known to {sigma}{hint})", self.n_dark_frames)
        });
        let flat = self.gain.as_ref().map(|_| {
            let sigma = known(self.gain_sigma.map(|sigma| format!("{:.3} %", 100.0 * sigma)));
            format!("gains follow {} frames of a flat field (known to {sigma})", self.n_flat_frames)
        });
        let n_defects = self.defects.defects().len();
        let defects =
            (n_defects > 0).then(|| format!("{n_defects} defective pixels are filled from their neighbours"));
        let parts: Vec<String> = [dark, flat, defects].into_iter().flatten().collect();
        let mut remarks = vec![if parts.is_empty() {
            "nothing of the sensor is corrected".into()
        } else {
            parts.join("; ")
        }];
        if let (Some(dark_s), Some(exposure_s)) = (self.dark_exposure_s, exposure_s)
            && (dark_s / exposure_s - 1.0).abs() > SAME_EXPOSURE
        {
            remarks.push(format!(
                "the dark frames were exposed {dark_s:.3e} s and the recording {exposure_s:.3e} s: their dark levels differ by \
                 what the sensor collects in the dark"
            ));
        }
        remarks
    }
}

/// Standard uncertainty of the usual pixel's mean, in counts, rounding included; `None` of one frame, which does not tell its noise.
fn sigma_of_mean(statistics: &PixelStatistics) -> Option<f64> {
    let rounding: f64 = (1.0_f64 / 12.0).sqrt();
    let n_frames = statistics.n_frames() as f64;
    statistics.noise_counts().map(|noise| noise.max(rounding) / n_frames.sqrt())
}

/// The largest power of two that divides every count of the first frame, as bits at the top of a longer number leave it; 1 of a frame that is
/// too even to tell.
fn step_counts(dark: &dyn Recording) -> Result<f64, CameraError> {
    let RecordingInfo { width_px, height_px, .. } = *dark.info();
    let mut counts = vec![0.0; width_px * height_px];
    dark.read_region(0, Region::whole(width_px, height_px), &mut counts)?;
    let counts: BTreeSet<u32> = counts.into_iter().map(|count: f32| count as u32).collect();
    Ok(match counts.len() {
        ..FEWEST_COUNTS => 1.0,
        _ => f64::from(counts.iter().fold(0, |bits, count| bits | count).trailing_zeros()).exp2(),
    })
}

/// Refuses a recording of another size, or of another depth where that is stated there and in the recording.
fn check_same(
    recording: &dyn Recording,
    (expected, states_depth_too): (PictureShape, bool),
    of_what: &str,
) -> Result<(), CameraError> {
    let found = PictureShape::of_recording(recording.info());
    let is_compared = states_depth_too && states_depth(recording.info());
    if found == expected || (!is_compared && PictureShape { bits: expected.bits, ..found } == expected) {
        return Ok(());
    }
    Err(CameraError::Correction {
        path: recording.path().into(),
        what: "frames".into(),
        expected: format!("{expected}, as {of_what}"),
        found: found.to_string(),
    })
}

/// Refuses a flat field in which pixels are saturated.
fn unsaturated(flat: &dyn Recording, of_flat: PixelStatistics) -> Result<PixelStatistics, CameraError> {
    let full_scale = flat.info().full_scale();
    let n_saturated = of_flat.mean().iter().filter(|&&mean| mean >= full_scale).count();
    let share = n_saturated as f64 / of_flat.mean().len().max(1) as f64;
    if share <= MOST_SATURATED {
        return Ok(of_flat);
    }
    Err(CameraError::Correction {
        path: flat.path().into(),
        what: "flat field".into(),
        expected: format!("pixels below full scale, {full_scale}"),
        found: format!("{:.1} % of them saturated", 100.0 * share),
    })
}
