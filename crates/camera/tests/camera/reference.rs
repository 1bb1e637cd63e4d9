//! Other people's recordings against the values that their owners' programs give.
//!
//! The files lie in the folder that the environment variable `CHAINWAVE_REFERENCE_DATA` names; without it these tests
//! say that they were skipped.

use std::fs::File;
use std::path::{Path, PathBuf};

use chainwave_camera::{CameraError, open};
use chainwave_measurement::{Recording, Region};
use chainwave_testkit::reference_data;
use tiff::decoder::{Decoder, DecodingResult};

fn cine_folder() -> Option<PathBuf> {
    reference_data("cine")
}

fn opened(folder: &Path, name: &str) -> Box<dyn Recording> {
    open(&folder.join(name)).unwrap_or_else(|error| panic!("{error}"))
}

fn frame(recording: &dyn Recording, frame: usize) -> Vec<f64> {
    let region = Region::whole(recording.info().width_px, recording.info().height_px);
    let mut pixels = vec![f32::NAN; region.n_pixels()];
    recording.read_region(frame, region, &mut pixels).unwrap();
    pixels.into_iter().map(f64::from).collect()
}

fn tiff_values(path: &Path) -> Vec<f64> {
    match Decoder::new(File::open(path).unwrap()).unwrap().read_image().unwrap() {
        DecodingResult::U16(values) => values.into_iter().map(f64::from).collect(),
        _ => panic!("{}: expected 16-bit gray", path.display()),
    }
}

/// How the camera's own software normalises counts on export: black to 0, white to full scale, whole steps, then an
/// offset in fractions of full scale.
struct Export {
    bits: i32,
    black: f64,
    white: f64,
    offset: f64,
}

impl Export {
    fn full(&self) -> f64 {
        2_f64.powi(self.bits) - 1.0
    }

    fn value(&self, count: f64) -> f64 {
        let scaled = (count - self.black) * self.full() / (self.white - self.black);
        (scaled.clamp(0.0, self.full()).floor() + self.offset * self.full()).clamp(0.0, self.full())
    }

    /// Largest difference between exported counts and the software's picture, in its own steps.
    fn largest_error(&self, counts: &[f64], tiff: &[f64]) -> f64 {
        assert_eq!(counts.len(), tiff.len());
        let step = 2_f64.powi(16 - self.bits);
        counts
            .iter()
            .zip(tiff)
            .map(|(&count, &tiff)| (self.value(count) - tiff / step).abs())
            .fold(0.0, f64::max)
    }
}

#[test]
fn the_vendors_exported_frames_are_reproduced() {
    let Some(folder) = cine_folder() else { return };
    let twelve = Export { bits: 12, black: 64.0, white: 4064.0, offset: -0.0043 };
    let eight = Export { bits: 8, black: 4.0, white: 254.0, offset: -0.0043 };
    let packed = Export { bits: 12, black: 64.0, white: 4064.0, offset: 0.0 };
    // The exporter's rounding is not published: of 12 bits with an offset it costs up to two steps, else up to one. A wrong
    // row order or packing costs hundreds (the pictures span 350 and 990 counts), in 8 bits about twenty.
    for (name, export, tolerance) in
        [("12bpp", twelve, 2.0), ("8bpp", eight, 0.1), ("packed_10", packed, 1.0)]
    {
        let recording = opened(&folder, &format!("CineFiles.jl/{name}.cine"));
        let tiff = tiff_values(&folder.join(format!("CineFiles.jl/{name}.tif")));
        let error = export.largest_error(&frame(&*recording, 0), &tiff);
        assert!(error <= tolerance, "{name}: {error} steps");
    }
}

#[test]
fn the_papers_camera_is_described_as_its_header_says() {
    let Some(folder) = cine_folder() else { return };
    let recording = opened(&folder, "CineFiles.jl/12bpp.cine");
    let info = recording.info();
    assert_eq!((info.width_px, info.height_px, info.n_frames, info.bit_depth), (128, 16, 202, 12));
    assert_eq!((info.first_image, info.camera.as_deref()), (-100, Some("Phantom v1211")));
    // The vendor's export gives 14:53:32.338 196.00 for the trigger and .328 240.68 for the first frame.
    assert!((info.times_s[0] + 9_955.32e-6).abs() < 0.01e-6);
    assert!((info.rate_hz.unwrap() - 10_000.0).abs() < 0.1);
    // The export rounds the exposure to nanoseconds.
    assert!((info.exposure_s.unwrap() - 99.000e-6).abs() < 1e-9);
    assert_eq!(info.warnings, [""; 0]);
}

#[test]
fn garbage_size_words_are_ignored_and_named() {
    let Some(folder) = cine_folder() else { return };
    let recording = opened(&folder, "CineFiles.jl/packed_10.cine");
    let info = recording.info();
    assert_eq!((info.format.as_str(), info.n_frames, info.bit_depth), ("cine P10", 3, 12));
    assert!(info.warnings.iter().any(|warning| warning.contains("size word")), "{:?}", info.warnings);
}

/// Frame of DICe's own reader: u32 width, height, bytes per value, then f64 values from the top.
fn rawi_values(path: &Path) -> Vec<f64> {
    let bytes = std::fs::read(path).unwrap();
    bytes[12..].as_chunks().0.iter().map(|&raw| f64::from_le_bytes(raw)).collect()
}

#[test]
fn dices_frames_are_reproduced() {
    let Some(folder) = cine_folder() else { return };
    let to_8_bits = 255.0 / 4095.0;
    for (name, scale) in [
        ("phantom_v1610", 1.0),
        ("phantom_v1610_16bpp", to_8_bits),
        ("phantom_v9_raw_16bpp", 1.0),
        ("packed_12bpp", to_8_bits),
    ] {
        let recording = opened(&folder, &format!("DICe/{name}.cine"));
        for index in [0, 5] {
            let expected = rawi_values(&folder.join(format!("DICe/rawi/{name}_d_{index}.rawi")));
            let found = frame(&*recording, index);
            assert_eq!(found.len(), expected.len());
            // Both are whole counts times one factor, computed in a different order.
            let same = found.iter().zip(&expected).all(|(count, value)| (count * scale - value).abs() < 1e-9);
            assert!(same, "{name}, frame {index}");
        }
    }
}

#[test]
fn a_short_setup_block_of_an_old_camera_is_enough() {
    let Some(folder) = cine_folder() else { return };
    let recording = opened(&folder, "pims/cine_legacy.cine");
    let info = recording.info();
    assert_eq!((info.width_px, info.height_px, info.n_frames, info.bit_depth), (128, 128, 97, 14));
    assert_eq!((info.first_image, info.camera.as_deref()), (-7722, None));
    // The header asks for 35087; the stamps are whole microseconds over 96 intervals of 28.5 us.
    assert!((info.rate_hz.unwrap() / 35_087.0 - 1.0).abs() < 1.0 / (96.0 * 28.5));
    let pixels = frame(&*recording, 96);
    assert!(pixels.iter().all(|&count| count < 16_384.0) && pixels.iter().any(|&count| count > 0.0));
}

#[test]
fn colour_and_files_of_another_kind_are_refused() {
    let Some(folder) = cine_folder() else { return };
    let colour = open(&folder.join("DICe/invalid_color.cine")).err();
    assert!(matches!(colour, Some(CameraError::Colour { .. })), "{colour:?}");
    // Made by a program and not by a camera: a header with the fields of a .cine but zeros where its mark CI belongs, and an empty
    // Setup block. Without the mark, two bytes of zeros are no evidence of anything.
    let other = open(&folder.join("hypercine/example_8bpp.cine")).err();
    let said = other.as_ref().map(ToString::to_string).unwrap_or_default();
    assert!(matches!(other, Some(CameraError::UnknownFormat { .. })), "{other:?}");
    assert!(said.contains("byte 0") && said.contains("00 00 2C 00"), "{said}");
}

#[test]
fn a_photron_recording_with_a_contradictory_header_is_read_and_named() {
    let Some(folder) = reference_data("mraw") else { return };
    for name in ["pyMRAW/beam.mraw", "pyMRAW/beam.cihx"] {
        let recording = opened(&folder, name);
        let info = recording.info();
        assert_eq!((info.format.as_str(), info.width_px, info.height_px), ("mraw 16 bit", 1024, 80));
        assert_eq!((info.n_frames, info.bit_depth, info.first_image), (4, 12, 0));
        assert_eq!(info.camera.as_deref(), Some("FASTCAM SA-Z type 2100K-M-64GB"));
        assert!((info.exposure_s.unwrap() - 5e-6).abs() < 1e-18);
        assert!(
            info.warnings.iter().any(|warning| warning.contains("one in 2500 saved, cannot come from 400"))
        );
        // Sums of the file's little-endian words, frame by frame.
        let sums: Vec<f64> = (0..4).map(|index| frame(&*recording, index).iter().sum()).collect();
        assert_eq!(sums, [62_998_095.0, 62_707_115.0, 63_193_821.0, 63_477_990.0]);
    }
}

#[test]
fn a_photron_recording_of_eight_bits_is_read() {
    let Some(folder) = reference_data("mraw") else { return };
    let recording = opened(&folder, "pyidi/data_showcase.mraw");
    let info = recording.info();
    assert_eq!((info.format.as_str(), info.width_px, info.height_px), ("mraw 8 bit", 640, 40));
    assert_eq!((info.n_frames, info.bit_depth, info.rate_hz), (75, 8, Some(150.0)));
    assert_eq!(info.times_s[74..], [7400.0 / 15_000.0]);
    assert!((info.exposure_s.unwrap() - 65.06e-6).abs() < 1e-17);
    for part in ["one frame in 100", "highest 8 of the camera's 12"] {
        assert!(info.warnings.iter().any(|warning| warning.contains(part)), "{:?}", info.warnings);
    }
    let sums: Vec<f64> = [0, 30, 74].map(|index| frame(&*recording, index).iter().sum()).into();
    assert_eq!(sums, [2_598_732.0, 2_630_101.0, 2_637_225.0]);
}

#[test]
fn a_numpy_stack_is_read() {
    let Some(folder) = reference_data("highspeed") else { return };
    let recording = opened(&folder, "speckle.npy");
    let info = recording.info();
    assert_eq!((info.width_px, info.height_px, info.n_frames, info.bit_depth), (40, 40, 200, 16));
    assert_eq!((info.rate_hz, &info.times_s[..3]), (None, [0.0, 1.0, 2.0].as_slice()));
    let sums: Vec<f64> = [0, 100, 199].map(|index| frame(&*recording, index).iter().sum()).into();
    assert_eq!(sums, [1_819_243.0, 1_808_679.0, 1_807_117.0]);
}

#[test]
fn published_test_images_are_read_one_by_one_and_as_folders() {
    let Some(folder) = reference_data("dic") else { return };
    for (name, size) in [
        ("pixel_shift/ref.tif", (512, 512)),
        ("sample12/oht_cfrp_00.tiff", (400, 1040)),
        ("sample14/Sample14 L1 Amp0.1b.tif", (2048, 589)),
        ("sample5/Sample5 Reference.tif", (512, 512)),
        ("OpenCorr/Pattern_1.bmp", (501, 501)),
    ] {
        let recording = opened(&folder, name);
        assert_eq!((recording.info().width_px, recording.info().height_px), size, "{name}");
        let pixels = frame(&*recording, 0);
        assert!(pixels.iter().any(|&count| count > 100.0) && pixels.iter().all(|&count| count < 256.0));
    }
    let series = opened(&folder, "sample12");
    assert_eq!((series.info().n_frames, series.info().first_image), (4, 0));
    assert_eq!(series.info().times_s, [0.0, 1.0, 5.0, 11.0]);
    assert!(series.info().warnings.iter().any(|warning| warning.contains("2 to 4, 6 to 10")));
    assert_eq!(frame(&*series, 3), frame(&*opened(&folder, "sample12/oht_cfrp_11.tiff"), 0));
}
