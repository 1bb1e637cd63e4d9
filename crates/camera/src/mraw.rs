//! Photron's .mraw: monochrome frames of 8, 10, 12 or 16 bit without any header, described by a .cih (text) or .cihx
//! (XML) of the same name beside it. Either file may be opened.

mod fields;
mod header;
mod levels;
mod sidecar;

use std::path::{Path, PathBuf};

use chainwave_measurement::RecordingInfo;

use crate::bytes::Bytes;
use crate::candidate::{Candidate, read_head, sibling};
use crate::error::CameraError;
use crate::file_recording::FileRecording;
use crate::flat::FlatFrames;
use crate::format::{Format, Opened, itself};
use crate::mapping::map_file;
use crate::options::OpenOptions;
use fields::is_header;
use header::MrawHeader;
use levels::StoredLevels;
pub(crate) use sidecar::{Sidecar, header_beside, sidecar};

/// Pixels alone cannot be recognised, so a .mraw is known by its name, and its header by its first bytes.
pub(crate) const FORMAT: Format = Format {
    name: "Photron .mraw with its .cih or .cihx",
    recognises: |candidate| is_header(&candidate.head) || is_mraw(candidate),
    open,
    // One of them alone is refused when it is opened, unless the geometry of its pixels is stated.
    files: |path| both_paths(path).map_or_else(|_| itself(path), |(header, pixels)| Ok(vec![header, pixels])),
};

fn is_mraw(candidate: &Candidate) -> bool {
    !candidate.is_folder && candidate.has_extension("mraw")
}

fn open(path: &Path, options: &OpenOptions) -> Opened {
    let (header_path, pixel_path) = both_paths(path)?;
    let mut header = MrawHeader::read(&header_path)?;
    let map = map_file(&pixel_path)?;
    let bytes = Bytes::new(&pixel_path, &map);
    let levels = StoredLevels::of(bytes, &header)?;
    let mut warnings = contradictions(bytes, &header, &levels, options);
    let (n_frames, cut) = FlatFrames::n_whole(bytes, &levels.raster, 0, header.n_frames, options)?;
    header.n_frames = n_frames;
    warnings.extend(cut);
    let (rate_hz, times_s) = times(&header, options);
    warnings.push(format!(
        "the file holds no time stamps: times are computed from frame numbers, {rate_hz} saved frames a second"
    ));
    warnings.extend(levels.warnings);
    warnings.extend(header.raw_remark);
    warnings.extend(header.shot.exposure_remark.clone());
    let info = RecordingInfo {
        format: format!("mraw {} bit", header.stored_bits),
        width_px: header.width_px,
        height_px: header.height_px,
        n_frames: header.n_frames,
        bit_depth: levels.bit_depth,
        rate_hz: Some(rate_hz),
        times_s,
        first_image: header.shot.start_frame - header.shot.trigger_frame,
        camera: header.shot.camera.clone(),
        exposure_s: header.shot.exposure_s,
        triggered_unix_s: None,
        warnings,
    };
    let frames = FlatFrames::new(&pixel_path, map, levels.raster, 0);
    Ok(Box::new(FileRecording::new(&pixel_path, info, frames, options)))
}

/// The paths of header and pixels, whichever of them was given.
fn both_paths(path: &Path) -> Result<(PathBuf, PathBuf), CameraError> {
    let missing = |what: &str, beside: &str| CameraError::Unsupported {
        path: path.into(),
        what: format!("{what} alone"),
        hint: format!(
            "put {beside} of the same name beside it; its pixels alone can be read where their geometry is stated"
        ),
    };
    if is_header(&read_head(path)?) {
        let pixels = sibling(path, "mraw").ok_or_else(|| missing("the header of a recording", "a .mraw"))?;
        return Ok((path.into(), pixels));
    }
    let header = sibling(path, "cihx").or_else(|| sibling(path, "cih"));
    Ok((header.ok_or_else(|| missing("a .mraw", "a .cih or .cihx"))?, path.into()))
}

/// Saved frames per second, and the time of each after the trigger: frame number / rate of recording, unless the
/// caller knows the rate better.
fn times(header: &MrawHeader, options: &OpenOptions) -> (f64, Vec<f64>) {
    let first = (header.shot.start_frame - header.shot.trigger_frame) as f64;
    let step = header.shot.step as f64;
    let frames = (0..header.n_frames).map(|frame| frame as f64);
    match options.rate_hz {
        Some(rate_hz) => {
            // One frame in `step` was saved, so many of them before the trigger.
            let first_s = first / step / rate_hz;
            (rate_hz, frames.map(|frame| first_s + frame / rate_hz).collect())
        }
        None => {
            let rate_hz = header.shot.record_hz / step;
            (rate_hz, frames.map(|frame| (first + frame * step) / header.shot.record_hz).collect())
        }
    }
}

/// What the header says that cannot all be true, or that a reader of the times should know.
fn contradictions(
    bytes: Bytes,
    header: &MrawHeader,
    levels: &StoredLevels,
    options: &OpenOptions,
) -> Vec<String> {
    [step(header, options), trigger(header), other_length(bytes, header, levels)]
        .into_iter()
        .flatten()
        .collect()
}

fn step(header: &MrawHeader, options: &OpenOptions) -> Option<String> {
    let (step, n_frames) = (header.shot.step, header.n_frames as u64);
    let last = n_frames.saturating_sub(1).saturating_mul(step);
    match header.shot.n_recorded {
        Some(n_recorded) if last >= n_recorded => Some(format!(
            "the header contradicts itself: {n_frames} frames, one in {step} saved, cannot come from {n_recorded} \
             recorded ones{}",
            match options.rate_hz {
                Some(_) => "",
                None =>
                    "; times follow the step and may be wrong by a factor (hint: --rate-hz, the frames saved in a second, overrules it)",
            }
        )),
        _ => (step > 1).then(|| format!("only one frame in {step} was saved")),
    }
}

fn trigger(header: &MrawHeader) -> Option<String> {
    let number = header.shot.trigger_frame;
    (number != 0).then(|| format!("the header moves the trigger to frame {number}; times count from there"))
}

fn other_length(bytes: Bytes, header: &MrawHeader, levels: &StoredLevels) -> Option<String> {
    let frame_bytes = levels.raster.frame_bytes();
    let n_bytes = frame_bytes.saturating_mul(header.n_frames as u64);
    let rest = bytes.len().saturating_sub(n_bytes);
    (rest > 0).then(|| {
        let n_frames = header.n_frames;
        format!(
            "{rest} bytes follow the {n_frames} frames that the header states ({} more frames)",
            rest / frame_bytes
        )
    })
}
