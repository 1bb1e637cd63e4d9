//! Recordings under German and other names: every format is opened and read by a path that is not ASCII.

use std::path::{Path, PathBuf};

use chainwave_camera::{OpenOptions, open, open_with};
use chainwave_measurement::Region;
use tiff::encoder::Compression;

use crate::images::{bmp_bytes, gray_png, gray_tiff, npy_bytes};
use crate::jpeg_writer::jpeg_bytes;
use crate::mraw::MrawFile;
use crate::recordings::pgm_bytes;
use crate::tiff_writer::TiffFile;
use crate::writer::{CineFile, codes};

/// Umlauts composed and decomposed, a sharp s, a micro sign, a space, and letters of three and four bytes.
pub(crate) const NAME: &str = "Prüfling Größe 5 \u{B5}m o\u{308} 測試 \u{1F4F7}";

/// A folder of that name inside another, and a file in it with the bytes.
pub(crate) fn written(folder: &Path, extension: &str, bytes: &[u8]) -> PathBuf {
    let inner = folder.join(NAME);
    std::fs::create_dir_all(&inner).unwrap();
    let path = inner.join(format!("{NAME} 1.{extension}"));
    std::fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn every_format_is_read_by_any_name() {
    let counts = codes(96, 255, 1);
    let npy = "{'descr': '|u1', 'fortran_order': False, 'shape': (1, 6, 16), }\n";
    let bytes: Vec<u8> = counts.iter().map(|&code| code as u8).collect();
    let frames = std::slice::from_ref(&counts);
    for (extension, contents) in [
        (
            "cine",
            CineFile { width_px: 16, height_px: 6, frames: vec![counts.clone(); 2], ..CineFile::default() }
                .bytes(),
        ),
        ("tif", TiffFile::new(16, 6, vec![counts.clone()]).bytes()),
        ("tiff", gray_tiff(Compression::Lzw, frames)),
        ("png", gray_png(&counts, 8)),
        ("bmp", bmp_bytes((16, 6), &counts, 8, false, |index| index)),
        ("pgm", pgm_bytes("P5", (16, 6), 255, &counts)),
        ("npy", npy_bytes(npy, &bytes)),
        ("jpg", jpeg_bytes((2, 1), &[vec![7, 200]])),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = written(folder.path(), extension, &contents);
        let is_image = !["cine", "npy"].contains(&extension);
        for path in [Some(path.as_path()), is_image.then(|| path.parent().unwrap())].into_iter().flatten() {
            let recording = open(path).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(recording.path(), path);
            let mut pixels = vec![f32::NAN; 16];
            recording.read_region(0, Region { x: 0, y: 1, width: 16, height: 1 }, &mut pixels).unwrap();
            let expected: Vec<f32> = match extension {
                "jpg" => (0..16).map(|x| if x < 8 { 7.0 } else { 200.0 }).collect(),
                _ => counts[16..32].iter().map(|&code| code.into()).collect(),
            };
            assert_eq!(pixels, expected, "{}", path.display());
        }
    }
}

#[test]
fn pixels_and_headers_find_each_other_by_any_name() {
    let folder = tempfile::tempdir().unwrap();
    let file = MrawFile::default();
    let pixels = written(folder.path(), "mraw", &file.pixels());
    let header = written(folder.path(), "cih", file.cih().as_bytes());
    for path in [&pixels, &header] {
        assert_eq!(open(path).unwrap().info().n_frames, 2);
    }
    let raw = OpenOptions { raw: "16x4x12le".parse().ok(), ..OpenOptions::default() };
    assert_eq!(open_with(&pixels, &raw).unwrap().info().n_frames, 2);
    written(folder.path(), "tif", &TiffFile::new(16, 6, vec![codes(96, 255, 1)]).bytes());
    assert_eq!(open(pixels.parent().unwrap()).unwrap().info().rate_hz, Some(20_000.0));
}
