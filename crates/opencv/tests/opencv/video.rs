//! A video of known pictures, written by OpenCV and read back.

use std::path::{Path, PathBuf};

use chainwave_camera::{CameraError, OpenOptions, open_with};
use chainwave_measurement::{Recording, Region};
use opencv::core::{Mat, Scalar, Size};
use opencv::prelude::*;
use opencv::{imgproc, videoio};
use tempfile::TempDir;

/// Opens a recording in a process that has OpenCV.
fn open(path: &Path) -> Result<Box<dyn Recording>, CameraError> {
    chainwave_opencv::register();
    chainwave_camera::open(path)
}

/// A file of these bytes under a name that says nothing of its format.
fn written(bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.bin");
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

const N_FRAMES: usize = 12;
const SIZE: (i32, i32) = (64, 48);

/// Brightness of the flat left and right halves of a frame.
fn levels(frame: usize) -> (f64, f64) {
    (20.0 + 10.0 * frame as f64, 240.0 - 10.0 * frame as f64)
}

/// Each half is flat, so that the compression (blocks of 8 or 16 px) alters it by its rounding alone.
fn write_video(path: &Path) {
    let code = videoio::VideoWriter::fourcc('M', 'J', 'P', 'G').unwrap();
    let size = Size::new(SIZE.0, SIZE.1);
    let mut writer = videoio::VideoWriter::new(path, code, 25.0, size, true).unwrap();
    for frame in 0..N_FRAMES {
        let (left, right) = levels(frame);
        let mut picture =
            Mat::new_rows_cols_with_default(SIZE.1, SIZE.0, opencv::core::CV_8UC3, Scalar::all(left))
                .unwrap();
        let half = opencv::core::Rect::new(SIZE.0 / 2, 0, SIZE.0 / 2, SIZE.1);
        imgproc::rectangle(&mut picture, half, Scalar::all(right), imgproc::FILLED, imgproc::LINE_8, 0)
            .unwrap();
        writer.write(&picture).unwrap();
    }
    writer.release().unwrap();
}

fn assert_shows(recording: &dyn Recording, frame: usize) {
    let (left, right) = levels(frame);
    for (x, expected) in [(3, left), (40, right)] {
        let region = Region { x, y: 5, width: 10, height: 20 };
        let mut pixels = vec![f32::NAN; region.n_pixels()];
        recording.read_region(frame, region, &mut pixels).unwrap();
        // Two roundings to whole levels (into luminance and back) and the coder's step for flat blocks.
        let near = pixels.iter().all(|&pixel| (f64::from(pixel) - expected).abs() <= 3.0);
        assert!(near, "frame {frame} at {x}: expected {expected}, found {:?}", &pixels[..10]);
    }
}

#[test]
fn every_frame_is_found_in_any_order() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("strike.avi");
    write_video(&path);
    let recording = open(&path).unwrap();
    let info = recording.info();
    assert_eq!((info.width_px, info.height_px, info.n_frames, info.bit_depth), (64, 48, N_FRAMES, 8));
    assert_eq!((info.format.as_str(), info.rate_hz), ("AVI video", Some(25.0)));
    assert_eq!((info.times_s[0], info.times_s[N_FRAMES - 1]), (0.0, 11.0 / 25.0));
    assert!(info.warnings.iter().any(|warning| warning.contains("no trigger")));
    for frame in [0, 1, 2, 2, 7, 3, 11, 0] {
        assert_shows(&*recording, frame);
    }
}

#[test]
fn the_rate_of_the_shot_replaces_the_rate_of_showing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("strike.avi");
    write_video(&path);
    let options = OpenOptions { rate_hz: Some(40_000.0), ..OpenOptions::default() };
    chainwave_opencv::register();
    let recording = open_with(&path, &options).unwrap();
    assert_eq!(recording.info().rate_hz, Some(40_000.0));
    assert_eq!(recording.info().times_s[4..5], [4.0 / 40_000.0]);
    assert!(recording.info().warnings[0].contains("the file states 25 Hz"));
}

#[test]
fn a_video_cut_short_states_the_frames_that_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("strike.avi");
    write_video(&path);
    let bytes = std::fs::read(&path).unwrap();
    let mut n_before = N_FRAMES;
    // The index behind the frames has 16 bytes for each, and a frame has some hundred.
    for n_missing in (1..bytes.len()).step_by(61) {
        std::fs::write(&path, &bytes[..bytes.len() - n_missing]).unwrap();
        let recording = match open(&path) {
            Ok(recording) => recording,
            Err(error) => {
                assert!(error.to_string().contains("strike.avi"), "{error}");
                continue;
            }
        };
        let n_frames = recording.info().n_frames;
        assert!((1..=n_before).contains(&n_frames), "{n_frames} of {n_before} with {n_missing} bytes less");
        n_before = n_frames;
        let warning = format!("of the {N_FRAMES} frames it states, the first {n_frames} are whole");
        assert!(
            recording.info().warnings.iter().any(|text| text.contains(&warning)),
            "{:?}",
            recording.info()
        );
        for frame in 0..n_frames {
            assert_shows(&*recording, frame);
        }
    }
    assert_eq!(n_before, 1, "some length should leave one frame");
}

#[test]
fn a_damaged_video_is_an_error() {
    let (_folder, path) = written(b"RIFF\x40\0\0\0AVI LIST and nothing that follows");
    let message = open(&path).err().unwrap().to_string();
    assert!(message.contains("recording.bin"), "{message}");
}

/// A file with these bytes under a name with umlauts composed and decomposed, a space, and letters of three and four bytes.
fn named(folder: &Path, extension: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(format!("Prüfling o\u{308} 測試 \u{1F4F7} 1.{extension}"));
    std::fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn a_video_is_read_by_any_name() {
    let folder = tempfile::tempdir().unwrap();
    let plain = folder.path().join("strike.avi");
    write_video(&plain);
    let path = named(folder.path(), "avi", &std::fs::read(&plain).unwrap());
    let recording = open(&path).unwrap();
    assert_eq!((recording.path(), recording.info().n_frames), (path.as_path(), N_FRAMES));
    assert_shows(&*recording, 7);
    let path = named(folder.path(), "mkv", GRAY_16);
    let Some(recording) = deep(&path) else { return };
    let mut pixels = [0.0; 2];
    recording.read_region(1, Region { x: 0, y: 0, width: 2, height: 1 }, &mut pixels).unwrap();
    assert_eq!(pixels.map(|pixel| pixel as usize), [1000, 1017]);
}

/// Frames of 64 x 48 px whose pixel `at` of frame `frame` is 1000 frame + 17 at, made with FFmpeg (`-c:v ffv1`).
const GRAY_16: &[u8] = include_bytes!("videos/gray16.mkv");
/// Gray of 10 bits: the same, shifted right by 6 bits.
const GRAY_10: &[u8] = include_bytes!("videos/gray10.mkv");
/// Colours of 12 bits, whose brightness is the same, shifted right by 4 bits.
const COLOUR_12: &[u8] = include_bytes!("videos/yuv420p12.mkv");
/// Red, green and blue of 10 bits.
const RGB_10: &[u8] = include_bytes!("videos/gbrp10.mkv");

/// Opens a video of more than 8 bits; `None`, told on the standard error, where there is no `ffmpeg` to decode it.
fn deep(path: &Path) -> Option<Box<dyn Recording>> {
    let found = std::process::Command::new("ffmpeg").arg("-version").output().is_ok();
    if found {
        return Some(open(path).unwrap());
    }
    let message = open(path).err().unwrap().to_string();
    assert!(message.contains("bits") && message.contains("the program ffmpeg"), "{message}");
    chainwave_testkit::skip("no ffmpeg on this system");
    None
}

#[test]
fn deep_videos_are_read_at_the_depth_of_their_codec() {
    for (bytes, bits) in [(GRAY_16, 16), (GRAY_10, 10), (COLOUR_12, 12)] {
        let (_folder, path) = written(bytes);
        let Some(recording) = deep(&path) else { return };
        let info = recording.info();
        assert_eq!((info.bit_depth, info.n_frames, info.rate_hz), (bits, N_FRAMES, Some(25.0)));
        assert_eq!((info.width_px, info.height_px), (64, 48));
        let region = Region { x: 3, y: 5, width: 11, height: 7 };
        for frame in [0, 4, 4, 11, 2, 3] {
            let mut pixels = vec![f32::NAN; region.n_pixels()];
            recording.read_region(frame, region, &mut pixels).unwrap();
            for (index, pixel) in pixels.iter().enumerate() {
                let at = (5 + index / 11) * SIZE.0 as usize + 3 + index % 11;
                let expected = ((1000 * frame + 17 * at) % 65_536) >> (16 - bits);
                assert_eq!(*pixel as usize, expected, "{bits} bits, frame {frame}, pixel {index}");
            }
        }
    }
}

#[test]
fn a_deep_video_cut_short_keeps_the_frames_that_it_has() {
    let (_folder, path) = written(&GRAY_16[..GRAY_16.len() / 2]);
    let Some(recording) = deep(&path) else { return };
    let n_frames = recording.info().n_frames;
    assert!((1..N_FRAMES).contains(&n_frames), "{n_frames} frames in half a file");
    assert!(recording.info().warnings.iter().any(|text| text.contains("are whole and are read")));
    let region = Region { x: 0, y: 0, width: 4, height: 1 };
    let mut pixels = [0.0; 4];
    for frame in (0..n_frames).chain([0]) {
        recording.read_region(frame, region, &mut pixels).unwrap();
        let expected = [0, 17, 34, 51].map(|shift| 1000 * frame + shift);
        assert_eq!(pixels.map(|pixel| pixel as usize), expected, "frame {frame}");
    }
}

#[test]
fn deep_colours_without_a_plane_of_brightness_are_refused() {
    let (_folder, path) = written(RGB_10);
    let message = open(&path).err().unwrap().to_string();
    assert!(message.contains("colour recording: a video of more than 8 bits"), "{message}");
}
