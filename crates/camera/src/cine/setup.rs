//! The Setup block of a .cine: the camera's settings, as far as its version has them.

use crate::bytes::Bytes;
use crate::error::CameraError;

/// Offset of the block's mark "ST" and of the length behind it.
const MARK: u64 = 0x8C;
const MARK_BYTES: &[u8] = b"ST";

/// The camera's settings, as far as they matter here.
///
/// The block grew with each version of the camera's software and states its length; a field exists only if it ends within that
/// length. What is missing is `None`.
pub(super) struct Setup {
    /// Bytes of the block.
    pub(super) length: u64,
    /// The frame rate asked for, in hertz, counting only saved images.
    pub(super) rate_hz: Option<f64>,
    /// Exposure asked for, in seconds.
    pub(super) exposure_s: Option<f64>,
    /// Camera model.
    pub(super) camera: Option<String>,
    /// Significant bits of a pixel.
    pub(super) bit_depth: Option<u32>,
    /// Colour filter in front of the sensor; 0 is none.
    pub(super) colour_filter: u32,
    /// Only every n-th image was saved.
    pub(super) decimation: f64,
    /// The recording was companded to 10 bits on its way, however it is stored now.
    pub(super) was_companded: bool,
    /// Display settings that would turn the picture if they were applied.
    pub(super) display_turns: Vec<&'static str>,
}

impl Setup {
    pub(super) fn read(bytes: Bytes, offset: u64) -> Result<Self, CameraError> {
        let mark = bytes.slice("setup mark", offset + MARK, 2)?;
        if mark != MARK_BYTES {
            return Err(bytes.malformed(
                "setup mark",
                offset + MARK,
                "the letters ST",
                format!("{mark:02X?}"),
            ));
        }
        let length = u64::from(bytes.u16("setup length", offset + MARK + 2)?);
        Ok(Self::from_fields(&SetupFields(bytes.slice("setup block", offset, length)?)))
    }

    fn from_fields(fields: &SetupFields) -> Self {
        let decimation = fields.f32(0x2894).map_or(1.0, f64::from);
        let decimation = if decimation.is_finite() { decimation.max(1.0) } else { 1.0 };
        Self {
            length: fields.0.len() as u64,
            rate_hz: rate_hz(fields).map(|rate_hz| rate_hz / decimation),
            exposure_s: exposure_s(fields),
            camera: fields.text(0x2790, 256),
            bit_depth: fields.u32(0x380),
            // The four highest bits are flags of gray heads.
            colour_filter: fields.u32(0x328).unwrap_or(0) & 0x00FF_FFFF,
            decimation,
            was_companded: fields.u16(0x2786) == Some(256),
            display_turns: display_turns(fields),
        }
    }
}

/// Rate before decimation: the newest field that exists and makes sense.
fn rate_hz(fields: &SetupFields) -> Option<f64> {
    let newest = fields.f64(0x28A0).filter(|rate_hz| rate_hz.is_finite() && (1e-3..1e9).contains(rate_hz));
    newest.or_else(|| fields.u32(0x300).map(f64::from)).filter(|&rate_hz| rate_hz > 0.0)
}

/// Exposure in nanoseconds since the field exists, before that in microseconds.
fn exposure_s(fields: &SetupFields) -> Option<f64> {
    let exposure_s = match fields.u32(0x620) {
        Some(nanoseconds) => f64::from(nanoseconds) * 1e-9,
        None => f64::from(fields.u32(0x304)?) * 1e-6,
    };
    (exposure_s > 0.0).then_some(exposure_s)
}

fn display_turns(fields: &SetupFields) -> Vec<&'static str> {
    let settings = [(0x2F4, "horizontal flip"), (0x2F8, "vertical flip"), (0x374, "rotation")];
    let is_set = |offset| fields.u32(offset).is_some_and(|value| value != 0);
    settings.iter().filter(|(offset, _)| is_set(*offset)).map(|(_, name)| *name).collect()
}

/// The bytes of the block; a field that reaches beyond them does not exist.
struct SetupFields<'a>(&'a [u8]);

impl SetupFields<'_> {
    fn array<const N: usize>(&self, offset: usize) -> Option<[u8; N]> {
        self.0.get(offset..)?.first_chunk().copied()
    }

    fn u16(&self, offset: usize) -> Option<u16> {
        self.array(offset).map(u16::from_le_bytes)
    }

    fn u32(&self, offset: usize) -> Option<u32> {
        self.array(offset).map(u32::from_le_bytes)
    }

    fn f32(&self, offset: usize) -> Option<f32> {
        self.array(offset).map(f32::from_le_bytes)
    }

    fn f64(&self, offset: usize) -> Option<f64> {
        self.array(offset).map(f64::from_le_bytes)
    }

    /// A text that ends at its first NUL; `None` when it is empty.
    fn text(&self, offset: usize, size: usize) -> Option<String> {
        let text = self.0.get(offset..offset + size)?.split(|&byte| byte == 0).next()?;
        let text = String::from_utf8_lossy(text).trim().to_owned();
        (!text.is_empty()).then_some(text)
    }
}
