//! Every instruction set that the machine has gives the same bits: tracks by every kernel and shape, in a process each.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod support;

use chainwave_correlation::{Interpolation, ReferenceFrames, Settings, Shape, track};
use chainwave_testkit::{digest, hold_each_to_the_same_bits};
use support::{SIZE, Speckle, recorded, sense, subset};

#[test]
fn every_instruction_set_gives_the_same_bits() {
    hold_each_to_the_same_bits(
        "every_instruction_set_gives_the_same_bits",
        SHAPES.len() * KERNELS.len(),
        digests,
    );
}

const SHAPES: [Shape; 4] = [Shape::Translation, Shape::Rigid, Shape::Affine, Shape::Quadratic];
const KERNELS: [Interpolation; 3] = [Interpolation::Linear, Interpolation::Cubic, Interpolation::QuinticMoms];

/// What each shape function and kernel found in three frames of a speckle that moves and turns, in a word each.
fn digests() -> Vec<String> {
    let speckle = Speckle::new(7, Speckle::RADIUS_PX);
    let frame = |k: u64| {
        let (sin, cos) = (0.02 * k as f64).sin_cos();
        let [x_0, y_0] = SIZE.map(|n| 0.5 * n as f64);
        let image = speckle.render(|[x, y]| {
            let [x, y] = [x - x_0, y - y_0];
            [x_0 + cos * x - sin * y + 0.37 * k as f64, y_0 + sin * x + cos * y]
        });
        sense(&image, 0.01, 30 + k)
    };
    let film = recorded((0..3).map(frame).collect());
    // Widths that are no multiples of a vector, and places between pixels.
    let subsets = [subset(150.0, 190.0, 16), subset(233.3, 240.6, 11), subset(300.0, 130.0, 20)];
    let mut digests = Vec::new();
    for shape in SHAPES {
        for interpolation in KERNELS {
            let settings = Settings { shape, interpolation, ..Settings::default() };
            let tracks = track(&film, &subsets, &ReferenceFrames::Single(0), &settings, &|_| ()).unwrap();
            let found = tracks.iter().flat_map(|track| &track.positions).flat_map(|position| {
                let position = position.as_ref().unwrap();
                [
                    position.x_px.value,
                    position.x_px.sigma,
                    position.y_px.value,
                    position.y_px.sigma,
                    position.zncc,
                ]
            });
            digests.push(format!("{shape} {interpolation} {:016x}", digest(found.map(f64::to_bits))));
        }
    }
    digests
}
