//! Precision of matches from 0.2 to 10 % noise. Every method on one scene, OpenCV's among them, is measured by the tests of `chainwave-opencv`.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

#[path = "../support/mod.rs"]
mod support;
#[cfg(test)]
mod tables;

use chainwave_correlation::{Interpolation, PreparedSubset, Reference, Settings, Shape, Window, Workspace};
use chainwave_measurement::{Position, Region};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use support::{
    FULL_RANGE, Image, SIZE, Speckle, affine_bounds_px, bound_of_unknown_texture, error_of_std, floors_px,
    grid, moments, rms, sense, slopes,
};

/// Pull, error over the floor, and error over the bound of the affine shape function, of every axis of every subset.
type Pulls = Vec<[f64; 3]>;

/// Random spots in so much of the light that none saturates: 14 % contrast.
fn random_spots(seed: u64) -> Image {
    const LIGHT: f64 = 0.85;
    let speckle = Speckle::new(seed, Speckle::RADIUS_PX);
    Box::new(move |[u, v]| speckle.render(|[x, y]| [x + u, y + v]).iter().map(|g| LIGHT * g).collect())
}

/// Light and dark spots, spread about a grid as printed patterns are, with 20 % contrast.
fn printed_spots(seed: u64) -> Image {
    const SPACE_PX: f64 = 2.6 * Speckle::RADIUS_PX;
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut spots = [Vec::new(), Vec::new()];
    let n = SIZE.map(|n| ((n as f64 + 40.0) / SPACE_PX) as usize);
    for (column, row) in (0..n[0]).flat_map(|column| (0..n[1]).map(move |row| (column, row))) {
        let place =
            [column, row].map(|i| SPACE_PX * (i as f64 + 0.5 + random.random_range(-0.35..0.35)) - 20.0);
        spots[usize::from(random.random_bool(0.5))].push(place);
    }
    let [light, dark] = spots.map(|spots| Speckle::at(spots, 1.0, 0.0));
    let plain = move |[u, v]: [f64; 2]| -> Vec<f64> {
        let [light, dark] = [&light, &dark].map(|spots| spots.render(|[x, y]| [x + u, y + v]));
        light.iter().zip(dark).map(|(light, dark)| light - dark).collect()
    };
    let peak = 0.2 * FULL_RANGE / moments(&plain([0.0, 0.0]))[1];
    Box::new(move |moved| plain(moved).iter().map(|g| 0.5 * FULL_RANGE + peak * g).collect())
}

/// Matches of images with random displacements.
fn pulls(images: &[Image], noise: f64, n_draws: u64, methods: &[(Interpolation, Shape)]) -> Vec<Pulls> {
    let mut all = vec![Pulls::new(); methods.len()];
    let mut random = Pcg64Mcg::seed_from_u64(5);
    for (pattern, image) in (0..).zip(images) {
        let still = image([0.0, 0.0]);
        let slopes = slopes(image);
        let limits: Vec<_> = floors_px(&slopes, noise, &grid(24))
            .into_iter()
            .zip(affine_bounds_px(&still, &slopes, noise, &grid(24)))
            .collect();
        for draw in 0..n_draws {
            let shift = [random.random_range(-0.5..0.5), random.random_range(-0.5..0.5)];
            let seed = 1000 * pattern + 2 * draw;
            let whole = Region::whole(SIZE[0], SIZE[1]);
            let reference = Reference::new(whole, sense(&still, noise, seed), 1).unwrap();
            let target = sense(&image(shift), noise, seed + 1);
            for ((interpolation, shape), pulls) in methods.iter().zip(&mut all) {
                let settings =
                    Settings { interpolation: *interpolation, shape: *shape, ..Settings::default() };
                let window = Window::new(whole, &target, *interpolation).unwrap();
                let mut workspace = Workspace::default();
                for (subset, (floor, bound)) in grid(24).iter().zip(&limits) {
                    // at 10 % noise some are refused
                    let Ok(prepared) = PreparedSubset::new(&reference, subset, &settings) else { continue };
                    let start = [subset.x_px, subset.y_px];
                    let Ok(found) = prepared.match_in(&window, start, &mut workspace) else { continue };
                    let Position { x_px, y_px, .. } = found.position;
                    for (axis, found) in [x_px, y_px].into_iter().enumerate() {
                        let error = found.value - start[axis] - shift[axis];
                        pulls.push([error / found.sigma, error / floor[axis], error / bound[axis]]);
                    }
                }
            }
        }
    }
    all
}

/// Root mean square of one column of pulls.
fn rms_of(pulls: &Pulls, column: usize) -> f64 {
    rms(&pulls.iter().map(|pull| pull[column]).collect::<Vec<_>>())
}

#[test]
fn a_printed_pattern_is_matched_at_the_noise_floor() {
    let methods = [Shape::Translation, Shape::Affine].map(|shape| (Interpolation::Cubic, shape));
    for noise in [0.01, 0.02, 0.05] {
        let found = pulls(&[printed_spots(41)], noise, 10, &methods);
        for (pulls, over) in found.iter().zip([1, 2]) {
            assert_eq!(pulls.len(), 2 * 10 * 121, "no point is lost");
            let ratio = rms_of(pulls, over);
            // a translation over the floor of a rigid shift, the affine shape over its own bound: between what a known texture
            // allows and one that is known from a noisy picture alone, but for three standard errors
            let most = bound_of_unknown_texture(0.2, noise) + 3.0 * error_of_std(pulls.len());
            assert!((1.0 - 3.0 * error_of_std(pulls.len())..most).contains(&ratio), "{noise}: {ratio}");
        }
    }
}
