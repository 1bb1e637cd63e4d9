//! Time of each part of a match: 33 x 33 px, the second of two frames moved by 0.37 and 0.61 px and strained by 0.1 %.
//! `cargo bench -p chainwave-correlation --bench matching`. On a busy machine the column `fastest` is the one to read.

#![expect(clippy::unwrap_used, reason = "a benchmark fails by panicking")]

#[path = "../tests/support/plain.rs"]
mod plain;
#[path = "../tests/support/mod.rs"]
mod support;

use std::sync::LazyLock;

use chainwave_correlation::{
    Interpolation, Method, PreparedSubset, Reference, ReferenceFrames, Settings, Shape, Window, Workspace,
};
use chainwave_measurement::{Excerpt, MemoryRecording, Region, Subset};
use divan::Bencher;
use support::{SIZE, Speckle, grid, prepare, recorded, sense, subset};

const INTERPOLATIONS: [Interpolation; 5] = Interpolation::ALL;

static IMAGES: LazyLock<[Vec<f32>; 2]> = LazyLock::new(|| {
    let speckle = Speckle::new(1, Speckle::RADIUS_PX);
    let place = |[x, y]: [f64; 2]| [x + 0.37 + 1e-3 * (x - 210.0), y + 0.61];
    [sense(&speckle.render(|spot| spot), 0.01, 1), sense(&speckle.render(place), 0.01, 2)]
});

fn prepared(shape: Shape, interpolation: Interpolation) -> PreparedSubset {
    let settings = Settings { shape, interpolation, ..Settings::default() };
    prepare(&IMAGES[0], &[subset(210.0, 210.0, 16)], &settings).remove(0)
}

fn window_of(interpolation: Interpolation) -> (Region, Vec<f32>) {
    // What a tracker reads: the subset, 1 px of slack, the taps and the prefilter's margin.
    let margin = match interpolation {
        Interpolation::Linear => 2,
        Interpolation::Cubic => 8,
        Interpolation::CubicMoms => 12,
        Interpolation::Quintic => 14,
        Interpolation::QuinticMoms => 17,
    };
    let side = 33 + 2 * margin;
    let region = Region { x: 194 - margin, y: 194 - margin, width: side, height: side };
    let pixel = |i: usize| IMAGES[1][(region.y + i / side) * SIZE[0] + region.x + i % side];
    (region, (0..side * side).map(pixel).collect())
}

#[divan::bench(args = INTERPOLATIONS)]
fn window(bencher: Bencher, interpolation: Interpolation) {
    let (region, pixels) = window_of(interpolation);
    bencher.bench(|| Window::new(region, &pixels, interpolation).unwrap());
}

#[divan::bench(args = INTERPOLATIONS)]
fn solve_translation(bencher: Bencher, interpolation: Interpolation) {
    solve(bencher, Shape::Translation, interpolation);
}

#[divan::bench(args = INTERPOLATIONS)]
fn solve_affine(bencher: Bencher, interpolation: Interpolation) {
    solve(bencher, Shape::Affine, interpolation);
}

fn solve(bencher: Bencher, shape: Shape, interpolation: Interpolation) {
    let subset = prepared(shape, interpolation);
    let (region, pixels) = window_of(interpolation);
    let window = Window::new(region, &pixels, interpolation).unwrap();
    let mut workspace = Workspace::default();
    let start = [210.45, 210.55];
    let n = subset.match_in(&window, start, &mut workspace).unwrap().position.iterations;
    assert!((2..=3).contains(&n), "{n} iterations");
    bencher.bench_local(|| subset.match_in(&window, start, &mut workspace));
}

/// The same affine match as `solve_affine`, cubic, by the textbook's loops of one pixel after the other.
#[divan::bench]
fn solve_plain(bencher: Bencher) {
    let [reference, target] = IMAGES.each_ref().map(|image| plain::Spline::through(SIZE[0], image));
    let subset = plain::Plain::new(&reference, [210.0, 210.0], 16);
    let (_, n) = subset.find(&target, [210.45, 210.55]).unwrap();
    assert!((2..=3).contains(&n), "{n} iterations");
    bencher.bench_local(|| subset.find(&target, [210.45, 210.55]));
}

/// The textbook's preparation of that subset.
#[divan::bench]
fn preparation_plain(bencher: Bencher) {
    let reference = plain::Spline::through(SIZE[0], &IMAGES[0]);
    bencher.bench(|| plain::Plain::new(&reference, [210.0, 210.0], 16));
}

/// Periods of the motion that bodies are followed over, of so many frames: preparation is a small part of it.
const N_PERIODS: usize = 30;
const PERIOD: usize = 63;

/// 26 bodies that go to and fro, in the way of a tracker: windows are read and filtered, and matched in 3 iterations or so.
#[divan::bench(args = ["icgn-linear-translation", "icgn-cubic-translation", "icgn-linear-affine", "icgn-cubic-affine", "icgn-quintic-affine"], sample_count = 6)]
fn follow(bencher: Bencher, name: &str) {
    follow_on(bencher, name, 1);
}

#[divan::bench(args = [1, 2], sample_count = 6)]
fn follow_on_threads(bencher: Bencher, n_threads: usize) {
    follow_on(bencher, "icgn-cubic-affine", n_threads);
}

fn follow_on(bencher: Bencher, name: &str, n_threads: usize) {
    let method: Method = name.parse().unwrap();
    let subsets: Vec<Subset> = grid(45).into_iter().take(26).collect();
    let settings = Settings { n_threads: n_threads.try_into().unwrap(), ..Settings::default() };
    let first = ReferenceFrames::Single(0);
    // the film again and again
    let film = Excerpt::new(&*FILM, (0..PERIOD * N_PERIODS).map(|frame| frame % PERIOD).collect());
    let positions = divan::counter::ItemsCount::new(26 * PERIOD * N_PERIODS);
    bencher.counter(positions).bench(|| method.track(&film, &subsets, &first, &settings, &|_| ()).unwrap());
}

static FILM: LazyLock<MemoryRecording> = LazyLock::new(|| {
    let speckle = Speckle::new(1, Speckle::RADIUS_PX);
    let frame = |k: usize| {
        let way = 3.0 - 3.0 * (std::f64::consts::TAU * k as f64 / PERIOD as f64).cos();
        let place = |[x, y]: [f64; 2]| [x + way + 2e-4 * way * (x - 210.0), y - 0.3 * way];
        // with a little less light, so that no speckle saturates
        let image: Vec<f64> = speckle.render(place).into_iter().map(|value| 0.7 * value).collect();
        sense(&image, 0.01, k as u64)
    };
    recorded((0..PERIOD).map(frame).collect())
});

#[divan::bench]
fn preparation(bencher: Bencher) {
    let reference = Reference::new(Region::whole(SIZE[0], SIZE[1]), IMAGES[0].clone(), 1).unwrap();
    let (subset, settings) = (subset(210.0, 210.0, 16), Settings::default());
    bencher.bench(|| PreparedSubset::new(&reference, &subset, &settings));
}

fn main() {
    divan::main();
}
