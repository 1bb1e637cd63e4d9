//! Pictures of deformed textures against what their deformation says.

#![cfg(test)]

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use chainwave_synthetic::SyntheticError;
use chainwave_synthetic::pictures::{
    Deformation, Surface, Texture, counts, picture, picture_by_samples, picture_by_spots,
};
use ndarray::{Array2, s};

/// What a texture's spots take away under a deformation.
fn depths(size_px: [usize; 2], texture: &Texture, deformation: Deformation) -> Array2<f64> {
    let surface = Surface { tone: 1.0, contrast: 1.0, ..Surface::everywhere(texture.clone(), deformation) };
    picture(size_px, &[surface]).unwrap().mapv(|tone| 1.0 - tone)
}

/// Sum, centroid and second central moments (xx, xy, yy) of a picture.
fn moments(picture: &Array2<f64>) -> (f64, [f64; 2], [f64; 3]) {
    let sum = picture.sum();
    let mean = |of: &dyn Fn(f64, f64) -> f64| {
        picture
            .indexed_iter()
            .map(|((row, column), value)| of(column as f64, row as f64) * value)
            .sum::<f64>()
            / sum
    };
    let (x, y) = (mean(&|x, _| x), mean(&|_, y| y));
    let second = [
        mean(&|column, _| (column - x) * (column - x)),
        mean(&|column, row| (column - x) * (row - y)),
        mean(&|_, row| (row - y) * (row - y)),
    ];
    (sum, [x, y], second)
}

#[test]
fn a_spot_is_displaced_turned_and_stretched_and_its_light_goes_with_its_area() {
    let texture = Texture::spots(&[[30.3, 33.6]], 4.5);
    let variance = texture.sigma_px() * texture.sigma_px();
    for deformation in [
        Deformation::NONE,
        Deformation::stretch([32.0, 32.0], [0.30, 0.0]),
        Deformation::stretch([32.0, 32.0], [0.45, -0.2]),
        Deformation::stretch([32.0, 32.0], [-0.5, 1.0]),
        Deformation::rigid([32.0, 32.0], 170.0_f64.to_radians(), [2.25, -1.5]),
        Deformation::Affine {
            gradient: [[0.1, 0.4], [-0.2, 0.3]],
            centre_px: [32.0, 32.0],
            shift_px: [1.0, 0.5],
        },
    ] {
        let (sum, centroid_px, second) = moments(&depths([64, 64], &texture, deformation));
        let mut f = deformation.gradient([30.3, 33.6]);
        f[0][0] += 1.0;
        f[1][1] += 1.0;
        let area = TAU * variance * (f[0][0] * f[1][1] - f[0][1] * f[1][0]);
        // 1e-4: the quadrature errs by 5e-7 of a depth at most in each of some hundred pixels, of a light of 10 or more.
        assert!((sum / area - 1.0).abs() < 1.0e-4, "{deformation:?}: {}", sum / area);
        let place_px = deformation.displaced_px([30.3, 33.6]);
        let off_px = (centroid_px[0] - place_px[0]).hypot(centroid_px[1] - place_px[1]);
        // The same, weighted by distances up to 10 px.
        assert!(off_px < 1.0e-3, "{deformation:?}: {off_px}");
        // sigma^2 F F^T, and a pixel's 1/12.
        let expected = [
            variance * (f[0][0] * f[0][0] + f[0][1] * f[0][1]) + 1.0 / 12.0,
            variance * (f[0][0] * f[1][0] + f[0][1] * f[1][1]),
            variance * (f[1][0] * f[1][0] + f[1][1] * f[1][1]) + 1.0 / 12.0,
        ];
        for (found, expected) in second.iter().zip(expected) {
            // By distances squared.
            assert!((found - expected).abs() < 1.0e-2, "{deformation:?}: {second:?}");
        }
    }
}

/// The mean of a texture over a pixel by many points, with its sources known in closed form.
fn counted(texture: &Texture, pixel: [f64; 2], source_px: impl Fn([f64; 2]) -> [f64; 2]) -> f64 {
    let n = 40;
    let place = |i: usize| (i as f64 + 0.5) / n as f64 - 0.5;
    let depth = |i: usize| texture.depth(source_px([pixel[0] + place(i % n), pixel[1] + place(i / n)]));
    (0..n * n).map(depth).sum::<f64>() / (n * n) as f64
}

#[test]
fn the_reference_picture_is_the_texture_seen_by_pixels() {
    let texture = Texture::speckles(5, 4.5, [24.0, 24.0], [40.0, 40.0]);
    let seen = depths([48, 48], &texture, Deformation::NONE);
    for [column, row] in [[3, 4], [24, 24], [40, 17], [47, 0]] {
        let mean = counted(&texture, [column as f64, row as f64], |at_px| at_px);
        // 6e-5: the midpoint rule over 40 points, (1/40)^2/24 times second derivatives below 1 on both axes; the quadrature.
        assert!((seen[[row, column]] - mean).abs() < 6.0e-5, "{column} {row}");
    }
}

#[test]
fn star_and_wave_show_the_texture_at_its_sources() {
    let texture = Texture::speckles(5, 4.5, [48.0, 40.0], [70.0, 60.0]);
    let star =
        Deformation::Star { amplitude_px: 0.5, row_px: 40.0, periods_px: [50.0, 400.0], width_px: 96.0 };
    let wave = Deformation::Wave { amplitude_px: [0.8, 0.0], along: [0.0, 1.0], period_px: 60.0 };
    for deformation in [star, wave] {
        let seen = depths([96, 80], &texture, deformation);
        // A star moves points along y alone, in a column of known period; such a wave along x alone, in a row of known shift:
        // both are undone without Newton's method.
        let source_px = |[x, y]: [f64; 2]| match deformation {
            Deformation::Star { .. } => {
                let shift = |source: f64| deformation.displacement_px([x, source])[1];
                // Fixed-point steps contract by 2 pi A/p = 0.063 each.
                let source = (0..30).fold(y, |source, _| y - shift(source));
                [x, source]
            }
            _ => [x - deformation.displacement_px([0.0, y])[0], y],
        };
        for [column, row] in [[3, 4], [40, 33], [90, 70], [12, 60]] {
            let mean = counted(&texture, [column as f64, row as f64], source_px);
            // 6e-5: as above.
            assert!((seen[[row, column]] - mean).abs() < 6.0e-5, "{deformation:?} {column} {row}");
        }
    }
}

#[test]
fn a_quarter_turn_is_the_reference_read_otherwise() {
    let texture = Texture::speckles(2, 4.5, [31.5, 31.5], [50.0, 50.0]);
    let reference = depths([64, 64], &texture, Deformation::NONE);
    let turned = depths([64, 64], &texture, Deformation::rigid([31.5, 31.5], FRAC_PI_2, [0.0; 2]));
    for ((row, column), value) in turned.indexed_iter() {
        // From right towards down: what was at (x, y) from the centre is at (-y, x). 1e-6: spots near 6 sigma, rounding.
        assert!((value - reference[[63 - column, row]]).abs() < 1.0e-6);
    }
    let half = depths([64, 64], &texture, Deformation::rigid([31.5, 31.5], PI, [0.0; 2]));
    for ((row, column), value) in half.indexed_iter() {
        assert!((value - reference[[63 - row, 63 - column]]).abs() < 1.0e-6);
    }
}

#[test]
fn discs_turn_on_black_and_keep_their_area() {
    let turns = [0.3, 2.0, -1.1];
    let bodies: Vec<Surface> = (0..3_u32)
        .zip(turns)
        .map(|(body, turn_rad)| {
            let disc = ([40.0 + 70.0 * f64::from(body), 40.3], 25.0);
            Surface::turned_disc(u64::from(body), 4.5, disc, turn_rad, [0.4, 1.2])
        })
        .collect();
    let blank: Vec<Surface> =
        bodies.iter().map(|body| Surface { tone: 1.0, contrast: 0.0, ..body.clone() }).collect();
    let cover = picture([220, 84], &blank).unwrap();
    // 3e-4: a tangent for the edge errs by 1/(24 r) of a pixel along the rim, 2 pi r/(24 r) = 0.26 px of 1963 px.
    assert!((cover.sum() / (3.0 * PI * 625.0) - 1.0).abs() < 3.0e-4, "{}", cover.sum());
    let seen = picture([220, 84], &bodies).unwrap();
    for ((row, column), value) in seen.indexed_iter() {
        if cover[[row, column]] <= 0.0 {
            assert!(value.abs() < 1.0e-300, "black between the bodies");
        }
    }
    // Each body's own texture, turned with it: the middle of the second one at the displaced place.
    let (deformation, texture) = (bodies[1].deformation, &bodies[1].texture);
    let mean = counted(texture, [112.0, 45.0], |at_px| deformation.source_px(at_px).unwrap());
    // 6e-5: as above.
    assert!((seen[[45, 112]] - (bodies[1].tone - bodies[1].contrast * mean)).abs() < 6.0e-5);
}

#[test]
fn periodic_dots_look_the_same_one_pitch_on() {
    let texture = Texture::dots(9.0, 5.0, [40.0, 40.0], [120.0, 120.0]);
    let here = depths([80, 60], &texture, Deformation::NONE);
    let there = depths([80, 60], &texture, Deformation::rigid([0.0; 2], 0.0, [9.0, -9.0]));
    let largest = here.iter().zip(&there).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max);
    // 1e-6: dots near 6 sigma, exp(-18) each.
    assert!(largest < 1.0e-6, "{largest:e}");
    let off_pitch = depths([80, 60], &texture, Deformation::rigid([0.0; 2], 0.0, [4.5, 0.0]));
    assert!((&here - &off_pitch).iter().any(|difference| difference.abs() > 0.3));
}

#[test]
fn counts_have_the_stated_noise_and_range() {
    let even = Array2::from_elem((300, 300), 0.5);
    let noisy = counts(&even, 8, 0.02, 7, 0).unwrap();
    let mean = noisy.mapv(f64::from).mean().unwrap();
    let variance = noisy.mapv(|count| (f64::from(count) - mean).powi(2)).mean().unwrap();
    let law = (0.02_f64 * 255.0).powi(2) + 1.0 / 12.0;
    // 90 000 samples: standard errors sqrt(law/n) and law sqrt(2/n); 4.5 of them.
    assert!((mean - 127.5).abs() < 4.5 * (law / 9.0e4).sqrt(), "{mean}");
    assert!((variance / law - 1.0).abs() < 4.5 * (2.0_f64 / 9.0e4).sqrt(), "{variance}");
    assert_eq!(noisy, counts(&even, 8, 0.02, 7, 0).unwrap());
    assert_ne!(noisy, counts(&even, 8, 0.02, 7, 1).unwrap());
    let ends = counts(&Array2::from_shape_vec((1, 2), vec![-0.5, 1.5]).unwrap(), 10, 0.0, 1, 0).unwrap();
    assert_eq!(ends.slice(s![0, ..]).to_vec(), [0.0, 1023.0]);
}

#[test]
fn a_folded_surface_is_refused_by_name() {
    let texture = Texture::speckles(1, 4.5, [32.0, 32.0], [40.0, 40.0]);
    let folded = Deformation::Wave { amplitude_px: [30.0, 0.0], along: [1.0, 0.0], period_px: 60.0 };
    let error = picture([64, 64], &[Surface::everywhere(texture, folded)]).unwrap_err();
    assert!(matches!(error, SyntheticError::Setting { name: "deformation", .. }), "{error}");
    assert!(counts(&Array2::zeros((2, 2)), 17, 0.0, 1, 0).is_err());
}

#[test]
fn pictures_by_spots_are_those_by_pixels() {
    let size_px = [90, 70];
    let ground = Surface::everywhere(
        Texture::speckles(5, 3.0, [45.0, 35.0], [120.0, 120.0]),
        Deformation::rigid([45.0, 35.0], 0.7, [3.2, -1.1]),
    );
    let stretched = Deformation::stretch([45.0, 35.0], [-0.4, 0.3]);
    let sheared = Deformation::Affine {
        gradient: [[0.1, 0.4], [-0.2, 0.3]],
        centre_px: [45.0, 35.0],
        shift_px: [1.0, 0.5],
    };
    let disc = Surface::turned_disc(9, 4.0, ([40.0, 30.0], 22.0), 2.0, [5.5, 3.25]);
    for surfaces in [
        vec![ground.clone()],
        vec![ground.clone().deformed(stretched)],
        vec![ground.clone().deformed(sheared)],
        vec![ground, disc.clone()],
        vec![disc],
    ] {
        let by_pixels = picture(size_px, &surfaces).unwrap();
        let by_spots = picture_by_spots(size_px, &surfaces).unwrap();
        let off = by_pixels.iter().zip(&by_spots).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // Gauss-Legendre with three points errs by f^(6)/2016000 along each axis: 2e-5 for a spot of 1 px, pressed to 0.6 px 4e-4
        // where pixels are not divided. They are: by the pixels of the reference.
        assert!(off < 1.0e-4, "{off}");
        let by_samples = picture_by_samples(size_px, &surfaces).unwrap();
        let off = by_pixels.iter().zip(&by_samples).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // A pixel's mean is that of the wider Gaussian less f^(4)/2880 along each axis, 3/sigma^4 in the middle: 0.006 of a spot of 1.06 px
        // that is pressed to 0.64 px, which has a contrast of 0.55; along the other axis less.
        assert!(off < 5.0e-3, "{off}");
    }
}

#[test]
fn a_wave_by_spots_is_that_by_pixels_to_its_bend() {
    let wave = Deformation::Wave { amplitude_px: [0.5, 0.3], along: [0.6, 0.8], period_px: 200.0 };
    let texture = Texture::speckles(5, 4.0, [45.0, 35.0], [80.0, 80.0]);
    let surfaces = [Surface::everywhere(texture, wave)];
    let by_pixels = picture([90, 70], &surfaces).unwrap();
    let by_spots = picture_by_spots([90, 70], &surfaces).unwrap();
    let off = by_pixels.iter().zip(&by_spots).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // The bend is (2 pi/200)^2 0.58 = 6e-4 per pixel: 3 px off the middle 3 mpx, with slopes of 0.3 per pixel.
    assert!(off < 2.0e-3, "{off}");
}
