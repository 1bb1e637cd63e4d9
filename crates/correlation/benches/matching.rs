//! Time of each part of a match: 33 x 33 px, the second of two frames moved by 0.37 and 0.61 px and strained by 0.1 %.
//! `cargo bench -p chainwave-correlation --bench matching`. On a busy machine the column `fastest` is the one to read.

#![expect(clippy::unwrap_used, reason = "a benchmark fails by panicking")]

#[path = "../tests/support/mod.rs"]
mod support;

use std::sync::LazyLock;

use chainwave_correlation::{Interpolation, PreparedSubset, Reference, Settings, Shape, Window, Workspace};
use chainwave_measurement::Region;
use divan::Bencher;
use support::{SIZE, Speckle, prepare, sense, subset};

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

#[divan::bench]
fn preparation(bencher: Bencher) {
    let reference = Reference::new(Region::whole(SIZE[0], SIZE[1]), IMAGES[0].clone(), 1).unwrap();
    let (subset, settings) = (subset(210.0, 210.0, 16), Settings::default());
    bencher.bench(|| PreparedSubset::new(&reference, &subset, &settings));
}

fn main() {
    divan::main();
}
