//! Whole frames of a .cine of 1280x800 px by OpenCV, to hold the camera's own reading against (`crates/camera/benches/regions.rs`).
#![expect(clippy::expect_used, reason = "a benchmark that cannot start has nothing to report")]

#[expect(
    dead_code,
    clippy::unwrap_used,
    reason = "the camera's own writer of .cine files, of which few parts are needed"
)]
#[path = "../../camera/tests/camera/writer.rs"]
mod writer;

use std::path::PathBuf;

use divan::Bencher;
use opencv::core::Mat;
use opencv::prelude::*;
use opencv::videoio::{CAP_FFMPEG, VideoCapture};
use tempfile::TempDir;
use writer::CineFile;

const WIDTH: usize = 1280;
const HEIGHT: usize = 800;
const N_FRAMES: usize = 12;

fn main() {
    divan::main();
}

/// A .cine of noise, which costs to read what any other content costs.
fn file(stored_bits: usize) -> (TempDir, PathBuf) {
    let (storage, highest) = match stored_bits {
        8 => (writer::GRAY_8, 255),
        _ => (writer::GRAY_16, 4095),
    };
    let frames = (0..N_FRAMES as u32).map(|seed| writer::codes(WIDTH * HEIGHT, highest, seed)).collect();
    let shown = CineFile { storage, width_px: WIDTH, height_px: HEIGHT, ..CineFile::default() };
    // FFmpeg refuses Setup blocks that are shorter.
    let setup_length = 0x163C;
    CineFile { frames, setup_length, stamps: None, exposures: None, ..shown }.write()
}

/// By OpenCV, which asks FFmpeg and gets eight bits in three colours; FFmpeg does not know packed 12 bits.
#[divan::bench(args = [8, 16])]
fn frame(bencher: Bencher, stored_bits: usize) {
    let (_folder, path) = file(stored_bits);
    let path = path.to_str().expect("a temporary folder has a plain name");
    let open = || VideoCapture::from_file(path, CAP_FFMPEG).expect("OpenCV has FFmpeg");
    let (mut capture, mut picture) = (open(), Mat::default());
    bencher.bench_local(|| {
        if !capture.read(&mut picture).expect("FFmpeg decodes the frame") {
            capture = open();
            assert!(capture.read(&mut picture).expect("FFmpeg decodes the frame"), "FFmpeg reads .cine");
        }
    });
}
