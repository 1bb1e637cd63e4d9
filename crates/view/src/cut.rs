//! Which part of which frame is asked for, how much smaller, and which counts are black and white.

use chainwave_measurement::{RecordingInfo, Region};

use crate::asked::Asked;
use crate::refusal::Refusal;

/// Most pixels of a picture that is sent: a frame of 16 megapixels at full size.
const MOST_PIXELS: usize = 1 << 24;
/// Most pixels along each axis that become one.
const MOST_SCALE: usize = 64;

/// A picture of a part of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cut {
    pub(crate) frame: usize,
    pub(crate) region: Region,
    /// Pixels along each axis whose mean becomes one.
    pub(crate) scale: usize,
    /// The count shown as black, and the one shown as white.
    pub(crate) window: [f64; 2],
}

impl Cut {
    /// Reads it from a request; what is left out is the whole frame at full size, from count 0 to full scale.
    pub(crate) fn of(asked: &Asked, frame: usize, info: &RecordingInfo) -> Result<Self, Refusal> {
        let whole = |name: &str, default: usize| asked.value(name, "a whole number from 0", default);
        let [x, y] = [whole("x", 0)?, whole("y", 0)?];
        let width = whole("w", info.width_px.saturating_sub(x))?;
        let height = whole("h", info.height_px.saturating_sub(y))?;
        let region = Region { x, y, width, height };
        if width == 0 || height == 0 || !region.fits_in(info.width_px, info.height_px) {
            let expected = format!("a region within {} x {} px", info.width_px, info.height_px);
            return Err(asked.refuse(
                "x, y, w, h",
                &expected,
                &format!("{width} x {height} px at ({x}, {y})"),
            ));
        }
        let scale = whole("scale", 1)?;
        if !scale.is_power_of_two() || scale > MOST_SCALE {
            return Err(asked.refuse("scale", "1, 2, 4 .. 64", &scale.to_string()));
        }
        let cut = Self {
            frame,
            region,
            scale,
            window: [asked.number("low", 0.0)?, asked.number("high", info.full_scale())?],
        };
        let [columns, rows] = cut.size();
        if columns.saturating_mul(rows) > MOST_PIXELS {
            let expected = format!("a picture of at most {MOST_PIXELS} pixels");
            return Err(asked
                .refuse("w, h", &expected, &format!("{columns} x {rows}"))
                .with_hint("a larger scale"));
        }
        match cut.window[0] < cut.window[1] {
            true => Ok(cut),
            false => Err(asked.refuse("low, high", "low below high", &format!("{:?}", cut.window))),
        }
    }

    /// Columns and rows of the picture.
    pub(crate) fn size(&self) -> [usize; 2] {
        [self.region.width, self.region.height].map(|n| n.div_ceil(self.scale))
    }
}
