//! A video of known pictures, written by OpenCV and read back.

use std::path::Path;

use chainwave_camera::{OpenOptions, open, open_with};
use chainwave_measurement::{Recording, Region};
use opencv::core::{Mat, Scalar, Size};
use opencv::prelude::*;
use opencv::{imgproc, videoio};

use crate::writer::written;

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
    let recording = open_with(&path, &options).unwrap();
    assert_eq!(recording.info().rate_hz, Some(40_000.0));
    assert_eq!(recording.info().times_s[4..5], [4.0 / 40_000.0]);
    assert!(recording.info().warnings[0].contains("the file states 25 Hz"));
}

#[test]
fn a_video_cut_short_keeps_the_frames_that_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("strike.avi");
    write_video(&path);
    let bytes = std::fs::read(&path).unwrap();
    // The index (200 bytes) and some of the frames of 230 bytes each.
    std::fs::write(&path, &bytes[..bytes.len() - 1000]).unwrap();
    let recording = open(&path).unwrap();
    let last = recording.info().n_frames - 1;
    let region = Region::whole(64, 48);
    for _ in 0..2 {
        let outcome = recording.read_region(last, region, &mut vec![0.0; region.n_pixels()]);
        assert!(last < N_FRAMES - 1 || outcome.is_err(), "frame {last} is not in the file");
        assert_shows(&*recording, 2);
    }
}

#[test]
fn a_damaged_video_is_an_error() {
    let (_folder, path) = written(b"RIFF\x40\0\0\0AVI LIST and nothing that follows");
    let message = open(&path).err().unwrap().to_string();
    assert!(message.contains("recording.bin"), "{message}");
}

/// Frames of 64 x 48 px whose pixel `at` of frame `frame` is 1000 frame + 17 at, made with FFmpeg (`-c:v ffv1`), because OpenCV
/// before 4.7 writes 8 bits only.
const GRAY_16: &[u8] = include_bytes!("videos/gray16.mkv");
/// The same in gray of 10 bits.
const GRAY_10: &[u8] = include_bytes!("videos/gray10.mkv");

#[test]
fn sixteen_bits_are_read_as_they_were_written_or_refused() {
    let (_folder, path) = written(GRAY_16);
    let recording = match open(&path) {
        Ok(recording) => recording,
        // OpenCV before 4.7 has only 8 bits to give.
        Err(error) => {
            assert!(error.to_string().contains("16 bits") && error.to_string().contains(".tif"), "{error}");
            return;
        }
    };
    assert_eq!((recording.info().bit_depth, recording.info().n_frames), (16, N_FRAMES));
    let region = Region { x: 3, y: 5, width: 11, height: 7 };
    for frame in [0, 4, 11, 2] {
        let mut pixels = vec![f32::NAN; region.n_pixels()];
        recording.read_region(frame, region, &mut pixels).unwrap();
        for (index, pixel) in pixels.iter().enumerate() {
            let at = (5 + index / 11) * SIZE.0 as usize + 3 + index % 11;
            assert_eq!(*pixel as usize, 1000 * frame + 17 * at, "frame {frame}, pixel {index}");
        }
    }
}

#[test]
fn depths_that_would_be_cut_are_refused() {
    let (_folder, path) = written(GRAY_10);
    let message = open(&path).err().unwrap().to_string();
    assert!(message.contains("10 bits") && message.contains(".tif"), "{message}");
}
