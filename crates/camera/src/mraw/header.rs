//! What a .cih or .cihx says of its recording, as typed values with units.

use std::path::Path;

use super::fields::{HeaderFields, Key};
use crate::error::CameraError;

const fn key(text: &'static str, xml: &'static str) -> Key {
    Key { text, xml }
}

const WIDTH: Key = key("Image Width", "imageDataInfo/resolution/width");
const HEIGHT: Key = key("Image Height", "imageDataInfo/resolution/height");
const COLOUR: Key = key("Color Type", "imageDataInfo/colorInfo/type");
const STORED_BITS: Key = key("Color Bit", "imageDataInfo/colorInfo/bit");
const DEPTH: Key = key("EffectiveBit Depth", "imageDataInfo/effectiveBit/depth");
const SIDE: Key = key("EffectiveBit Side", "imageDataInfo/effectiveBit/side");
const FILE_FORMAT: Key = key("File Format", "imageFileInfo/fileFormat");
const TOTAL: Key = key("Total Frame", "frameInfo/totalFrame");
const RECORDED: Key = key("Original Total Frame", "frameInfo/recordedFrame");
const START: Key = key("Start Frame", "frameInfo/startFrame");
const TRIGGER: Key = key("Correct Trigger Frame", "frameInfo/correctTriggerFrame");
const STEP: Key = key("Save Step", "frameInfo/skipFrame");
const RATE: Key = key("Record Rate(fps)", "recordInfo/recordRate");
const SHUTTER_NS: Key = key("Shutter Type2(nsec)", "recordInfo/shutterSpeedNsec");
const SHUTTER: Key = key("Shutter Speed(s)", "recordInfo/shutterSpeed");
const CAMERA: Key = key("Camera Type", "deviceInfo/deviceName");

/// What a .cih or .cihx says of its .mraw.
pub(super) struct MrawHeader {
    pub(super) width_px: usize,
    pub(super) height_px: usize,
    /// Bits that a pixel takes in the file.
    pub(super) stored_bits: u32,
    /// Significant bits of the camera's counts.
    pub(super) depth: u32,
    pub(super) side: Side,
    /// Frames in the file.
    pub(super) n_frames: usize,
    pub(super) shot: Shot,
    /// A remark on pixels that are called raw and are gray.
    pub(super) raw_remark: Option<String>,
}

/// What a .cih or .cihx says of a shot, in whatever files its frames are kept.
pub(crate) struct Shot {
    /// Frames that the camera had recorded, of which the files hold some.
    pub(crate) n_recorded: Option<u64>,
    /// Frames that were saved.
    pub(crate) n_saved: Option<u64>,
    /// Number of the first frame.
    pub(crate) start_frame: i64,
    /// Number of the frame of the trigger.
    pub(crate) trigger_frame: i64,
    /// Every how many-th recorded frame was saved, at least 1.
    pub(crate) step: u64,
    /// Rate at which the camera recorded.
    pub(crate) record_hz: f64,
    pub(crate) exposure_s: Option<f64>,
    /// A remark on an exposure that cannot be as it stands there.
    pub(crate) exposure_remark: Option<String>,
    pub(crate) camera: Option<String>,
}

/// Which end of a stored value the significant bits lie at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Lower,
    Higher,
}

impl MrawHeader {
    pub(super) fn read(path: &Path) -> Result<Self, CameraError> {
        let fields = HeaderFields::read(path)?;
        let raw_remark = refuse_colours(path, &fields)?;
        refuse_other_files(path, &fields)?;
        let stored_bits = stored_bits(path, &fields)?;
        Ok(Self {
            width_px: at_least_1(&fields, WIDTH)?,
            height_px: at_least_1(&fields, HEIGHT)?,
            stored_bits,
            depth: depth(&fields)?.unwrap_or(stored_bits),
            side: side(&fields)?,
            n_frames: at_least_1(&fields, TOTAL)?,
            shot: Shot::of(&fields)?,
            raw_remark,
        })
    }
}

impl Shot {
    /// Of a shot whose frames were saved as images.
    pub(super) fn read(path: &Path) -> Result<Self, CameraError> {
        let fields = HeaderFields::read(path)?;
        refuse_colours(path, &fields)?;
        Self::of(&fields)
    }

    fn of(fields: &HeaderFields) -> Result<Self, CameraError> {
        let record_hz = record_hz(fields)?;
        let (exposure_s, exposure_remark) = exposure_s(fields, record_hz)?;
        Ok(Self {
            n_recorded: fields.optional(RECORDED, "a number of frames")?,
            n_saved: fields.optional(TOTAL, "a number of frames")?,
            start_frame: frame_number(fields, START)?,
            trigger_frame: frame_number(fields, TRIGGER)?,
            step: fields.optional(STEP, "a number of frames")?.unwrap_or(1).max(1),
            record_hz,
            exposure_s,
            exposure_remark,
            camera: fields.text(CAMERA).map(Into::into),
        })
    }
}

/// Refuses colours. Monochrome models also call their pixels raw where they are saved as the sensor gave them, and then a
/// remark says so.
fn refuse_colours(path: &Path, fields: &HeaderFields) -> Result<Option<String>, CameraError> {
    let kind = fields.text(COLOUR).unwrap_or("Mono");
    let camera = fields.text(CAMERA).unwrap_or("a camera that is not named");
    if kind.eq_ignore_ascii_case("mono") {
        return Ok(None);
    }
    if !kind.eq_ignore_ascii_case("raw") {
        return Err(CameraError::Colour { path: path.into(), reason: format!("colour type {kind}") });
    }
    if is_monochrome_model(camera) {
        return Ok(Some(format!(
            "the header calls the pixels raw; {camera} is a monochrome model, so that they are gray"
        )));
    }
    let reason = format!("colour type Raw, of {camera}, which no -M- in its name marks as monochrome");
    Err(CameraError::Colour { path: path.into(), reason })
}

/// Whether a model's name has the part M, for monochrome, and not C, for colour, as in `FASTCAM SA-Z type 2100K-M-64GB`; a number that follows the
/// letter tells the memory.
fn is_monochrome_model(name: &str) -> bool {
    let is = |part: &str, letter: char| {
        let mut rest = part.chars();
        rest.next().is_some_and(|first| first.eq_ignore_ascii_case(&letter))
            && rest.all(|c| c.is_ascii_digit())
    };
    let has = |letter: char| name.split(['-', ' ']).any(|part| is(part, letter));
    has('M') && !has('C')
}

fn refuse_other_files(path: &Path, fields: &HeaderFields) -> Result<(), CameraError> {
    match fields.text(FILE_FORMAT) {
        Some(format) if !format.eq_ignore_ascii_case("mraw") => Err(CameraError::Unsupported {
            path: path.into(),
            what: format!("a header of {format} files"),
            hint: "give the folder of the images instead".into(),
        }),
        _ => Ok(()),
    }
}

fn stored_bits(path: &Path, fields: &HeaderFields) -> Result<u32, CameraError> {
    let expected = "8, 10, 12 or 16";
    match fields.number(STORED_BITS, expected)? {
        bits @ (8 | 10 | 12 | 16) => Ok(bits),
        bits @ (24 | 30 | 36 | 48) => {
            Err(CameraError::Colour { path: path.into(), reason: format!("{bits} bits per pixel") })
        }
        _ => Err(fields.other(STORED_BITS, expected)),
    }
}

fn at_least_1(fields: &HeaderFields, key: Key) -> Result<usize, CameraError> {
    let expected = "at least 1";
    Some(fields.number(key, expected)?).filter(|&n| n > 0).ok_or_else(|| fields.other(key, expected))
}

fn depth(fields: &HeaderFields) -> Result<Option<u32>, CameraError> {
    let expected = "8 to 16 bits";
    let depth = fields.optional(DEPTH, expected)?;
    if depth.is_some_and(|bits| !(8..=16).contains(&bits)) {
        return Err(fields.other(DEPTH, expected));
    }
    Ok(depth)
}

fn side(fields: &HeaderFields) -> Result<Side, CameraError> {
    match fields.text(SIDE) {
        None | Some("Lower") => Ok(Side::Lower),
        Some("Higher") => Ok(Side::Higher),
        Some(_) => Err(fields.other(SIDE, "Lower or Higher")),
    }
}

/// A frame's number, which times are computed from without loss when it keeps below 2^53.
fn frame_number(fields: &HeaderFields, key: Key) -> Result<i64, CameraError> {
    let expected = "a frame number";
    let number: i64 = fields.optional(key, expected)?.unwrap_or(0);
    Some(number).filter(|number| number.unsigned_abs() < 1 << 53).ok_or_else(|| fields.other(key, expected))
}

fn record_hz(fields: &HeaderFields) -> Result<f64, CameraError> {
    let expected = "a rate above 0";
    let rate_hz: f64 = fields.number(RATE, expected)?;
    let is_rate = (1e-6..1e12).contains(&rate_hz);
    is_rate.then_some(rate_hz).ok_or_else(|| fields.other(RATE, expected))
}

/// From the exposure in nanoseconds, else from the shutter speed: `1/15371`, or a number, which is its reciprocal. No frame is exposed longer than
/// frames are apart: a number whose reciprocal is, is taken for the seconds that the field's name promises if these are not, and a remark says so.
fn exposure_s(fields: &HeaderFields, record_hz: f64) -> Result<(Option<f64>, Option<String>), CameraError> {
    // Rates and shutter speeds are rounded to whole numbers.
    let is_possible = |exposure_s: &f64| *exposure_s > 0.0 && exposure_s * record_hz < 1.01;
    let nanoseconds: Option<f64> = fields.optional(SHUTTER_NS, "nanoseconds")?;
    if let Some(nanoseconds) = nanoseconds {
        let exposure_s = nanoseconds * 1e-9;
        return Ok(((exposure_s.is_finite() && exposure_s > 0.0).then_some(exposure_s), None));
    }
    let Some(text) = fields.text(SHUTTER) else { return Ok((None, None)) };
    let fraction = text.strip_prefix("1/");
    let Ok(number) = fraction.unwrap_or(text).trim().parse::<f64>() else { return Ok((None, None)) };
    if !(number.is_finite() && number > 0.0) {
        return Ok((None, None));
    }
    let exposure_s = [Some(number.recip()), fraction.is_none().then_some(number)];
    let (exposure_s, taken) = match exposure_s.map(|exposure_s| exposure_s.filter(is_possible)) {
        [Some(exposure_s), _] => return Ok((Some(exposure_s), None)),
        [None, Some(exposure_s)] => (Some(exposure_s), format!("{exposure_s} s are taken")),
        [None, None] => (None, "no exposure is taken from it".into()),
    };
    let name = SHUTTER.text;
    Ok((
        exposure_s,
        Some(format!(
            "{name} {text}: expected an exposure of at most the {:e} s from frame to frame, found {:e} s; {taken}",
            record_hz.recip(),
            number.recip()
        )),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn monochrome_models_are_known_by_their_names() {
        for name in [
            "FASTCAM SA-Z type 2100K-M-64GB",
            "FASTCAM Mini AX200 type 900K-M-32GB",
            "FASTCAM SA5 model 1300K-M",
            "FASTCAM SA5 model 775K-M3",
            "FASTCAM SA-X2 type 480K-M4",
        ] {
            assert!(is_monochrome_model(name), "{name}");
        }
        for name in [
            "FASTCAM SA-Z type 2100K-C-64GB",
            "FASTCAM SA5 model 775K-C3",
            "FASTCAM SA-Z",
            "FASTCAM Multi",
            "FASTCAM Mini",
            "",
            "FASTCAM 1000K-M-C",
        ] {
            assert!(!is_monochrome_model(name), "{name}");
        }
    }
}
