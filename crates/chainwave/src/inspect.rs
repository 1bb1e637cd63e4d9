//! `chainwave inspect`: what a recording holds.

use std::io::Write;
use std::path::Path;

use chainwave_camera::{CameraError, Histogram, NoiseEstimate, gray_frames, histogram, noise};
use chainwave_experiment::RecordingSummary;
use chainwave_figures::{Draw, Format, FrameSheet, NamedFrame, Style};
use chainwave_measurement::{Recording, RecordingInfo, Region};
use serde_json::{Value, json};
use tiff::encoder::{TiffEncoder, colortype::Gray16};

use crate::cli::Inspect;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::{expect_apart, expect_ending, expect_folder_of, write_whole};
use crate::terminal::{answer, is_json, say};

/// Prints a recording's facts, and writes one of its frames where that is asked.
pub(crate) fn inspect(arguments: &Inspect) -> Result<Outcome, Error> {
    if let Some(out) = &arguments.out {
        expect_tiff(out)?;
    }
    arguments.sheet.iter().try_for_each(|sheet| expect_ending(sheet, "png"))?;
    for written in arguments.out.iter().chain(&arguments.sheet) {
        expect_folder_of(written)?;
    }
    let frame = arguments.out.iter().map(|path| ("the frame", path.clone()));
    let sheet = arguments.sheet.iter().map(|path| ("the sheet", path.clone()));
    expect_apart(&[&arguments.recording], &frame.chain(sheet).collect::<Vec<_>>())?;
    let options = arguments.reading.options(arguments.rate_hz);
    let recording = chainwave_camera::open_with(&arguments.recording, &options)?;
    if let (Some(frame), Some(out)) = (arguments.frame, &arguments.out) {
        write_frame(recording.as_ref(), frame, out)?;
    }
    if let Some(sheet) = &arguments.sheet {
        write_sheet(recording.as_ref(), sheet)?;
    }
    let survey = Survey::of(recording.as_ref());
    match is_json() {
        true => answer(&as_json(recording.info(), &survey)),
        false => {
            let text = format!("{}{}", as_text(&arguments.recording, recording.info()), survey.as_text());
            say!("{}", text.strip_suffix('\n').unwrap_or(&text));
        }
    }
    Ok(Outcome::default())
}

/// Frames evenly spread over a recording, each with its number and, where the recording knows it, its time after the trigger.
fn write_sheet(recording: &dyn Recording, path: &Path) -> Result<(), Error> {
    const N_FRAMES: usize = 20;
    const N_COLUMNS: usize = 4;
    const WIDTH_PX: usize = 480;
    let info = recording.info();
    let name = |frame: usize| match info.rate_hz {
        Some(_) => format!("frame {frame}, {:.3} ms", 1e3 * info.times_s[frame]).replace('-', "\u{2212}"),
        None => format!("frame {frame}"),
    };
    let frames = gray_frames(recording, N_FRAMES, WIDTH_PX)?;
    let picture_px = frames.first().map_or([1, 1], |(_, shown)| [shown.width_px, shown.height_px]);
    let frames =
        frames.into_iter().map(|(frame, shown)| NamedFrame { name: name(frame), grays: shown.pixels });
    let sheet = FrameSheet { picture_px, n_columns: N_COLUMNS, frames: frames.collect() };
    let bytes = sheet.draw(&Style::default())?.bytes(Format::Png)?;
    write_whole(path, |file| file.write_all(&bytes).map_err(Error::file(path, "write")))
}

/// Refuses a frame under a name of another format.
fn expect_tiff(path: &Path) -> Result<(), Error> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match ["tif", "tiff"].contains(&ending.as_str()) {
        true => Ok(()),
        false => Err(Error::Argument(format!(
            "{}: expected a file that ends in .tif or .tiff, found {:?}",
            path.display(),
            path.file_name().unwrap_or_default().to_string_lossy()
        ))),
    }
}

/// What the pixels of a few frames tell, each with the reason where it cannot be told.
struct Survey {
    noise: Result<NoiseEstimate, CameraError>,
    histogram: Result<Histogram, CameraError>,
}

impl Survey {
    /// Frames whose counts are binned, and pairs of frames whose differences give the noise.
    const N_FRAMES: usize = 8;

    fn of(recording: &dyn Recording) -> Self {
        Self { noise: noise(recording, Self::N_FRAMES), histogram: histogram(recording, Self::N_FRAMES) }
    }

    fn as_json(&self) -> Value {
        let noise = self.noise.as_ref().ok();
        let counts = self.histogram.as_ref().ok();
        let saturated = counts.map(|counts| counts.saturation().map_or(0, |saturation| saturation.n_pixels));
        json!({
            "noise_sigma_counts": noise.map(|noise| noise.sigma(noise.median_count)),
            "noise_at_counts": noise.map(|noise| noise.median_count),
            "noise_variance_at_zero": noise.map(|noise| noise.variance_at_zero.value),
            "noise_variance_per_count": noise.map(|noise| noise.variance_per_count.value),
            "median_count": counts.map(|counts| counts.quantile(0.5)),
            "n_pixels_surveyed": counts.map(Histogram::total),
            "n_dark": counts.map(Histogram::n_dark),
            "n_saturated": saturated,
        })
    }

    fn as_text(&self) -> String {
        let noise = match &self.noise {
            Ok(noise) => {
                let sigma = noise.sigma(noise.median_count);
                format!("{sigma:.2} counts (1 sigma) at {:.0} counts", noise.median_count)
            }
            Err(reason) => format!("not told: {reason}"),
        };
        let counts = match &self.histogram {
            Ok(counts) => {
                let (low, middle, high) =
                    (counts.quantile(0.01), counts.quantile(0.5), counts.quantile(0.99));
                let saturated = counts.saturation().map_or(0, |saturation| saturation.n_pixels);
                let dark = counts.n_dark();
                format!(
                    "1 % below {low}, median {middle}, 1 % above {high}; {dark} dark, {saturated} saturated"
                )
            }
            Err(reason) => format!("not told: {reason}"),
        };
        format!("  noise      {noise}\n  counts     {counts}\n")
    }
}

fn as_json(info: &RecordingInfo, survey: &Survey) -> Value {
    let mut told = json!(RecordingSummary::from(info));
    told["survey"] = survey.as_json();
    told
}

fn as_text(path: &Path, info: &RecordingInfo) -> String {
    let optional = |value: Option<f64>, factor: f64, unit: &str| match value {
        Some(value) => format!("{:.6} {unit}", value * factor),
        None => "not stated".into(),
    };
    // Without a rate the recording knows the order of its frames, and no time.
    let time = |time: Option<&f64>| match (time, info.rate_hz) {
        (Some(count), None) => format!("not known; {count} frames after the first"),
        (time, _) => optional(time.copied(), 1e3, "ms after the trigger"),
    };
    let mut text = format!("{}\n", path.display());
    for (name, value) in [
        ("format", info.format.clone()),
        ("camera", info.camera.clone().unwrap_or_else(|| "not stated".into())),
        ("frame", format!("{} x {} px, {} bit", info.width_px, info.height_px, info.bit_depth)),
        ("frames", format!("{}, first image {}", info.n_frames, info.first_image)),
        ("rate", optional(info.rate_hz, 1.0, "Hz")),
        ("exposure", optional(info.exposure_s, 1e6, "us")),
        ("first time", time(info.times_s.first())),
        ("last time", time(info.times_s.last())),
    ] {
        text.push_str(&format!("  {name:<11}{value}\n"));
    }
    for warning in &info.warnings {
        text.push_str(&format!("  warning: {warning}\n"));
    }
    text
}

/// Writes a frame as it was recorded: linear counts, 16-bit gray, top row first.
fn write_frame(recording: &dyn Recording, frame: usize, out: &Path) -> Result<(), Error> {
    let info = recording.info();
    let region = Region::whole(info.width_px, info.height_px);
    let mut pixels = vec![0.0_f32; region.n_pixels()];
    recording.read_region(frame, region, &mut pixels)?;
    let counts: Vec<u16> = pixels.iter().map(|count| count.round() as u16).collect();
    let (width, height) = (info.width_px as u32, info.height_px as u32);
    write_whole(out, |writer| {
        let written = TiffEncoder::new(writer)
            .and_then(|mut encoder| encoder.write_image::<Gray16>(width, height, &counts));
        written.map_err(|wrong| Error::file(out, "write")(std::io::Error::other(wrong)))
    })
}
