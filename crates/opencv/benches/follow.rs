//! Following 26 bodies through a .cine of 512 x 512 px: from the file's bytes to positions with their uncertainties, on one
//! thread and on two, next to OpenCV's Lucas-Kanade. `cargo bench -p chainwave-opencv --bench follow`; a frame is an item.
//!
//! The file (63 frames of 12 bits in 16, 33 MB, in the system's cache) is followed to and fro 30 times, so that preparing the
//! subsets is a small part, but for `opencv-lk`, whose errors are found on pictures of each subset first.

#![expect(clippy::unwrap_used, reason = "a benchmark fails by panicking")]

#[path = "../../correlation/tests/support/mod.rs"]
mod support;
#[expect(dead_code, reason = "the camera's own writer of .cine files, of which few parts are needed")]
#[path = "../../camera/tests/camera/writer.rs"]
mod writer;

use std::sync::LazyLock;

use chainwave_correlation::{Method, ReferenceFrames, Settings};
use chainwave_measurement::{Excerpt, Subset};
use divan::Bencher;
use divan::counter::ItemsCount;
use support::{SIZE, Speckle, grid, sense};
use tempfile::TempDir;
use writer::CineFile;

const SIDE: usize = 512;
/// Columns and rows around the speckle.
const MARGIN: usize = (SIDE - SIZE[0]) / 2;
const PERIOD: usize = 63;
const N_PERIODS: usize = 30;
const N_BODIES: usize = 26;

fn main() {
    chainwave_opencv::register();
    divan::main();
}

#[divan::bench(
    args = ["opencv-lk", "icgn-linear-translation", "icgn-cubic-translation", "icgn-cubic-affine", "icgn-quintic-affine"],
    sample_count = 5
)]
fn on_one_thread(bencher: Bencher, name: &str) {
    follow(bencher, name, 1);
}

#[divan::bench(args = [1, 2], sample_count = 5)]
fn on_threads(bencher: Bencher, n_threads: usize) {
    follow(bencher, "icgn-cubic-affine", n_threads);
}

fn follow(bencher: Bencher, name: &str, n_threads: usize) {
    let method: Method = name.parse().unwrap();
    let settings = Settings { n_threads: n_threads.try_into().unwrap(), ..Settings::default() };
    let file = chainwave_camera::open(&FILE.1).unwrap();
    // the file again and again
    let recording = Excerpt::new(&*file, (0..PERIOD * N_PERIODS).map(|frame| frame % PERIOD).collect());
    let places = grid(45).into_iter().take(N_BODIES);
    let place = |subset: Subset| {
        let [x_px, y_px] = [subset.x_px, subset.y_px].map(|place| place + MARGIN as f64);
        Subset { x_px, y_px, ..subset }
    };
    let subsets: Vec<Subset> = places.map(place).collect();
    let reference = ReferenceFrames::Single(0);
    bencher
        .counter(ItemsCount::new(PERIOD * N_PERIODS))
        .bench(|| method.track(&recording, &subsets, &reference, &settings, &|_| ()).unwrap());
}

/// The bodies go to and fro by 6 px along x, and are strained a little.
static FILE: LazyLock<(TempDir, std::path::PathBuf)> = LazyLock::new(|| {
    let speckle = Speckle::new(1, Speckle::RADIUS_PX);
    let frame = |k: usize| {
        let way = 3.0 - 3.0 * (std::f64::consts::TAU * k as f64 / PERIOD as f64).cos();
        let place = |[x, y]: [f64; 2]| [x + way + 2e-4 * way * (x - 210.0), y - 0.3 * way];
        let image: Vec<f64> = speckle.render(place).into_iter().map(|value| 0.7 * value).collect();
        let mut codes = vec![600; SIDE * SIDE];
        let rows = codes.chunks_exact_mut(SIDE).skip(MARGIN);
        for (row, pixels) in rows.zip(sense(&image, 0.01, k as u64).chunks_exact(SIZE[0])) {
            row[MARGIN..][..SIZE[0]].iter_mut().zip(pixels).for_each(|(code, &pixel)| *code = pixel as u16);
        }
        codes
    };
    let frames = (0..PERIOD).map(frame).collect();
    CineFile { frames, width_px: SIDE, height_px: SIDE, stamps: None, exposures: None, ..CineFile::default() }
        .write()
});
