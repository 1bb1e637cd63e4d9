//! Recordings for Python: what they say of themselves, and pixels as bytes.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use chainwave_camera::{OpenOptions, RawGeometry, SheetLayout, contact_sheet, open_with};
use chainwave_experiment::{RecordingSummary, SensorFiles};
use chainwave_measurement::{MemoryRecording, PlainFrame, Recording, Region};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes, PyDict};
use serde_json::json;

use crate::failure::Failure;

/// Counts of a pixel as NumPy names them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Pixel {
    /// Whole counts of at most 8 bits.
    U1,
    /// Whole counts of at most 16 bits.
    U2,
    /// Counts that are not whole: those of arrays, and what remains when a sensor's dark level and gains are taken out.
    F4,
}

/// An opened recording; pixels are read when they are asked for.
#[pyclass(frozen, module = "chainwave._chainwave")]
pub(crate) struct OpenedRecording {
    pub(crate) recording: Arc<dyn Recording>,
    pixel: Pixel,
}

impl OpenedRecording {
    /// Opened recordings hold whole counts unless something was taken out of them.
    fn of_counts(recording: Arc<dyn Recording>) -> Self {
        let pixel = if recording.info().bit_depth <= 8 { Pixel::U1 } else { Pixel::U2 };
        Self { recording, pixel }
    }
}

/// Opens a recording; `raw` is the geometry of pixels without a header, and `dark` and `flat` are frames that tell of the sensor.
#[pyfunction]
#[pyo3(signature = (path, *, rate_hz = None, raw = None, partial = false, dark = None, flat = None))]
pub(crate) fn open(
    py: Python<'_>,
    path: &str,
    rate_hz: Option<f64>,
    raw: Option<&str>,
    partial: bool,
    dark: Option<&str>,
    flat: Option<&str>,
) -> PyResult<OpenedRecording> {
    let raw: Option<RawGeometry> = raw.map(str::parse).transpose().map_err(Failure::from)?;
    let options = OpenOptions { rate_hz, partial, raw, ..OpenOptions::default() };
    let opened = py.detach(|| -> Result<OpenedRecording, Failure> {
        let sensor = SensorFiles::read(dark.map(Path::new), flat.map(Path::new), &options)?;
        let recording = open_with(Path::new(path), &options)?;
        Ok(match sensor {
            None => OpenedRecording::of_counts(recording.into()),
            Some(sensor) => {
                OpenedRecording { recording: sensor.correct(recording)?.into(), pixel: Pixel::F4 }
            }
        })
    });
    Ok(opened?)
}

/// The mean rate of time stamps in seconds; none of fewer than two, or of stamps that do not go on.
fn rate_of(times_s: &[f64]) -> Option<f64> {
    let span_s = times_s.last()? - times_s.first()?;
    (span_s > 0.0).then(|| (times_s.len() - 1) as f64 / span_s)
}

/// Frames in memory: counts as 4-byte floats in the machine's byte order, frame by frame, row by row.
#[pyfunction]
#[pyo3(signature = (counts, *, width_px, height_px, bit_depth, name, pixel, times_s = None, rate_hz = None))]
#[expect(clippy::too_many_arguments, reason = "each is named where it is called, from Python")]
pub(crate) fn recording_of_counts(
    counts: &[u8],
    width_px: usize,
    height_px: usize,
    bit_depth: u32,
    name: PathBuf,
    pixel: &str,
    times_s: Option<Vec<f64>>,
    rate_hz: Option<f64>,
) -> Result<OpenedRecording, Failure> {
    let n_pixels = width_px * height_px;
    if n_pixels == 0 || !counts.len().is_multiple_of(4 * n_pixels) {
        let found = counts.len();
        return Err(Failure::Argument(format!(
            "{}: expected whole frames of {width_px} x {height_px} px, found {found} bytes",
            name.display()
        )));
    }
    let count = |bytes: &[u8]| f32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let frame = |bytes: &[u8]| bytes.chunks_exact(4).map(count).collect();
    let frames: Vec<Vec<f32>> = counts.chunks_exact(4 * n_pixels).map(frame).collect();
    let mut recording = MemoryRecording::new(width_px, bit_depth, frames);
    if let Some(found) = rate_hz.filter(|rate_hz| !(rate_hz.is_finite() && *rate_hz > 0.0)) {
        return Err(Failure::Argument(format!("rate_hz: expected a number above 0, found {found}")));
    }
    let mut stamped_hz = None;
    if let Some(times_s) = times_s {
        if times_s.len() != recording.info.n_frames {
            return Err(Failure::Argument(format!(
                "times_s: expected {} numbers, one for each frame, found {}",
                recording.info.n_frames,
                times_s.len()
            )));
        }
        if let Some(frame) = times_s.iter().position(|time_s| !time_s.is_finite()) {
            let found = times_s[frame];
            return Err(Failure::Argument(format!("times_s, frame {frame}: expected a time, found {found}")));
        }
        if let Some(frame) = times_s.windows(2).position(|pair| pair[1] <= pair[0]) {
            let (before, found) = (times_s[frame], times_s[frame + 1]);
            return Err(Failure::Argument(format!(
                "times_s, frame {}: expected a time after {before}, found {found}",
                frame + 1
            )));
        }
        stamped_hz = rate_of(&times_s);
        recording.info.times_s = times_s;
    } else if let Some(rate_hz) = rate_hz {
        recording.info.times_s.iter_mut().for_each(|time_s| *time_s /= rate_hz);
    }
    recording.info.rate_hz = rate_hz.or(stamped_hz);
    recording.path = name;
    let pixel = match pixel {
        "u1" => Pixel::U1,
        "u2" => Pixel::U2,
        _ => Pixel::F4,
    };
    Ok(OpenedRecording { recording: Arc::new(recording), pixel })
}

#[pymethods]
impl OpenedRecording {
    /// Where the recording lies.
    #[getter]
    fn path(&self) -> String {
        self.recording.path().display().to_string()
    }

    /// What the recording says of itself, as JSON with the keys of `chainwave inspect --json`.
    fn info(&self) -> String {
        json!(RecordingSummary::from(self.recording.info())).to_string()
    }

    /// Time of each frame after the trigger, in seconds: 8-byte floats in the machine's byte order.
    fn times<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        let times = &self.recording.info().times_s;
        PyBytes::new(py, &times.iter().flat_map(|time_s| time_s.to_ne_bytes()).collect::<Vec<u8>>())
    }

    /// What a pixel is, as NumPy names it.
    #[getter]
    fn pixel(&self) -> &'static str {
        match self.pixel {
            Pixel::U1 => "u1",
            Pixel::U2 => "u2",
            Pixel::F4 => "f4",
        }
    }

    /// The counts of a region, row by row, in the machine's byte order.
    fn read<'py>(
        &self,
        py: Python<'py>,
        frame: usize,
        x: usize,
        y: usize,
        width: usize,
        height: usize,
    ) -> PyResult<Bound<'py, PyByteArray>> {
        let region = Region { x, y, width, height };
        let read = py.detach(|| -> Result<Vec<u8>, Failure> {
            let info = self.recording.info();
            // A region that reaches outside is refused before room is made for it.
            let n_pixels = if region.fits_in(info.width_px, info.height_px) { region.n_pixels() } else { 0 };
            let mut pixels = vec![0.0_f32; n_pixels];
            self.recording.read_region(frame, region, &mut pixels)?;
            Ok(match self.pixel {
                Pixel::U1 => pixels.iter().map(|count| count.round() as u8).collect(),
                Pixel::U2 => pixels.iter().flat_map(|count| (count.round() as u16).to_ne_bytes()).collect(),
                Pixel::F4 => pixels.iter().flat_map(|count| count.to_ne_bytes()).collect(),
            })
        });
        Ok(PyByteArray::new(py, &read?))
    }

    /// A frame where it lies in memory, as NumPy's array interface; `None` where it must be read.
    fn view(&self, frame: usize) -> Option<FrameView> {
        let whole = FrameView { recording: Arc::clone(&self.recording), frame };
        let fits = whole.plain().is_some_and(|plain| {
            let pixel = if plain.pixel_bytes == 1 { Pixel::U1 } else { Pixel::U2 };
            // Arrays have the machine's byte order, whatever the file's.
            pixel == self.pixel
                && (plain.pixel_bytes == 1 || plain.is_big_endian == cfg!(target_endian = "big"))
        });
        fits.then_some(whole)
    }

    /// Some frames side by side, reduced: columns, rows and gray levels of the sheet.
    fn sheet<'py>(
        &self,
        py: Python<'py>,
        n_frames: usize,
        tile_width_px: usize,
    ) -> PyResult<(usize, usize, Bound<'py, PyBytes>)> {
        let layout = SheetLayout { n_frames, n_columns: n_frames, tile_width_px };
        let sheet = py.detach(|| contact_sheet(self.recording.as_ref(), layout).map_err(Failure::from))?;
        Ok((sheet.width_px, sheet.height_px, PyBytes::new(py, &sheet.pixels)))
    }
}

/// A frame where it lies in memory. NumPy keeps this as long as an array shows it, and with it the recording.
#[pyclass(frozen, module = "chainwave._chainwave")]
pub(crate) struct FrameView {
    recording: Arc<dyn Recording>,
    frame: usize,
}

impl FrameView {
    fn plain(&self) -> Option<PlainFrame<'_>> {
        let info = self.recording.info();
        let plain = self.recording.plain_frame(self.frame)?;
        // The last row need not be filled up.
        let n_bytes = info.height_px.checked_sub(1)? * plain.row_bytes + info.width_px * plain.pixel_bytes;
        (plain.bytes.len() >= n_bytes).then_some(plain)
    }
}

#[pymethods]
impl FrameView {
    /// NumPy's array interface, version 3: bytes that may not be written.
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let gone = || Failure::Argument(format!("frame {} no longer lies in memory", self.frame));
        let plain = self.plain().ok_or_else(gone)?;
        let info = self.recording.info();
        let (first_byte, row_step) = match plain.bottom_row_first {
            true => ((info.height_px - 1) * plain.row_bytes, -(plain.row_bytes as isize)),
            false => (0, plain.row_bytes as isize),
        };
        let interface = PyDict::new(py);
        let order = if plain.is_big_endian { '>' } else { '<' };
        let kind = if plain.pixel_bytes == 1 { "|u1".to_owned() } else { format!("{order}u2") };
        interface.set_item("version", 3)?;
        interface.set_item("typestr", kind)?;
        interface.set_item("shape", (info.height_px, info.width_px))?;
        interface.set_item("strides", (row_step, plain.pixel_bytes))?;
        interface.set_item("data", (plain.bytes.as_ptr() as usize + first_byte, true))?;
        Ok(interface)
    }
}
