//! Points on bare ground, which nothing can be told of: lost for want of texture, in every frame, whatever lies beside them; and dots on black,
//! between which is no ground.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]

use std::collections::BTreeMap;

use chainwave_correlation::{Method, ReferenceFrames, Settings};
use chainwave_measurement::{Lost, MemoryRecording, Subset};
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

const SIZE_PX: [usize; 2] = [200, 120];
const N_FRAMES: u64 = 6;

/// A textured disc that moves right over ground of a tone, under noise.
fn film(tone: f64, noise: f64) -> MemoryRecording {
    let frame = |number: u64| {
        let shift = [1.5 * number as f64, 0.0];
        let disc = Surface::turned_disc(4, 4.0, ([50.0, 60.0], 30.0), 0.0, shift);
        let bare = Texture::spots(&[], 4.0);
        let ground = Surface { tone, ..Surface::everywhere(bare, Deformation::NONE) };
        let seen = counts(&picture(SIZE_PX, &[ground, disc]).unwrap(), 12, noise, 3, number).unwrap();
        seen.into_raw_vec_and_offset().0
    };
    MemoryRecording::new(SIZE_PX[0], 12, (0..N_FRAMES).map(frame).collect())
}

fn subset(x_px: f64, half: usize) -> Subset {
    Subset::new(x_px.to_string(), x_px, 60.0, half, half)
}

#[test]
fn bare_ground_is_lost_for_want_of_texture() {
    let mut wrong = Vec::new();
    for (tone, noise) in
        [(0.0, 0.0), (0.0, 0.005), (0.0, 0.02), (0.05, 0.01), (0.3, 0.0), (0.3, 0.02), (0.8, 0.05)]
    {
        let film = film(tone, noise);
        for name in ["icgn-cubic-affine", "template-parabola"] {
            let method: Method = name.parse().unwrap();
            // far from the disc, and so near that its edge reaches into the subset, whose middle stays bare
            let subsets = [subset(150.0, 16), subset(110.0, 16), subset(94.0, 16), subset(90.0, 12)];
            let first = ReferenceFrames::Single(0);
            let tracks = method.track(&film, &subsets, &first, &Settings::default(), &|_| ()).unwrap();
            for track in &tracks {
                let mut count = BTreeMap::new();
                for found in &track.positions {
                    *count.entry(found.as_ref().map_or_else(|lost| lost.as_str(), |_| "ok")).or_insert(0) +=
                        1;
                }
                println!("{name:<20} tone {tone} noise {noise} x {:>4}: {count:?}", track.name);
                let is_near = track.name == "94" || track.name == "90";
                let bare = track.positions.iter().all(|found| matches!(found, Err(Lost::NoTexture)));
                // ground that is not dark is used like any texture, and its edge with it
                let is_edge = is_near && tone > 0.0;
                if !(bare || is_edge) {
                    wrong.push(format!("{name} tone {tone} noise {noise} x {}", track.name));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Dots that are sprayed on black, one on some 60 square pixels: between them lie dark squares without texture, which are no ground behind a body.
#[test]
fn dots_on_black_are_matched_everywhere() {
    let mut random = Pcg64Mcg::seed_from_u64(5);
    let n_dots = (SIZE_PX[0] + 40) * (SIZE_PX[1] + 40) / 60;
    let spots: Vec<[f64; 2]> =
        (0..n_dots).map(|_| SIZE_PX.map(|n| random.random_range(-20.0..n as f64 + 20.0))).collect();
    let dots = Texture::spots(&spots, 2.2);
    const SHIFT_PX: [f64; 2] = [1.37, -0.64];
    let frame = |number: u64| {
        let moved = Deformation::rigid([0.0; 2], 0.0, if number == 0 { [0.0; 2] } else { SHIFT_PX });
        let surface = Surface { tone: 0.0, contrast: -0.6, ..Surface::everywhere(dots.clone(), moved) };
        let seen = counts(&picture(SIZE_PX, &[surface]).unwrap(), 12, 0.01, 3, number).unwrap();
        seen.into_raw_vec_and_offset().0
    };
    let film = MemoryRecording::new(SIZE_PX[0], 12, (0..2).map(frame).collect());
    let places =
        (0..9).flat_map(|i| (0..5).map(move |j| [28.0 + 18.0 * f64::from(i), 28.0 + 16.0 * f64::from(j)]));
    let subsets: Vec<Subset> = places.map(|[x, y]| Subset::new(format!("{x} {y}"), x, y, 16, 16)).collect();
    let method: Method = "icgn-cubic-affine".parse().unwrap();
    let first = ReferenceFrames::Single(0);
    let tracks = method.track(&film, &subsets, &first, &Settings::default(), &|_| ()).unwrap();
    let mut n_found = 0;
    for (track, subset) in tracks.iter().zip(&subsets) {
        let Ok(found) = &track.positions[1] else { continue };
        n_found += 1;
        for (at, from, shift) in
            [(found.x_px, subset.x_px, SHIFT_PX[0]), (found.y_px, subset.y_px, SHIFT_PX[1])]
        {
            let off = (at.value - from - shift).abs();
            assert!(off < 5.0 * at.sigma, "{}: {off} of {}", track.name, at.sigma);
        }
    }
    println!("{n_found} of {}", subsets.len());
    // Two thirds had been lost; a gap may still be as wide as two of the squares, which one subset in ten has.
    assert!(n_found * 10 >= subsets.len() * 9, "{n_found} of {}", subsets.len());
}

/// A ring of texture around a bare middle, as a printed letter may be: what has been seen and is hidden is not without texture.
#[test]
fn what_was_seen_around_a_bare_middle_is_not_lost_for_want_of_texture() {
    const HIDDEN: std::ops::Range<u64> = 3..5;
    let spot = |k: u32| {
        let (angle, radius) =
            (f64::from(k) * std::f64::consts::TAU * 0.618_034, 17.5 + 0.75 * f64::from(k % 3));
        [60.0 + radius * angle.cos(), 60.0 + radius * angle.sin()]
    };
    let spots: Vec<[f64; 2]> = (0..26).map(spot).collect();
    let ring = Texture::spots(&spots, 3.0);
    let frame = |number: u64| {
        let texture = if HIDDEN.contains(&number) { Texture::spots(&[], 3.0) } else { ring.clone() };
        let moved = Deformation::rigid([0.0; 2], 0.0, [1.5 * number as f64, 0.0]);
        let seen = picture(SIZE_PX, &[Surface::everywhere(texture, moved)]).unwrap();
        counts(&seen, 12, 0.01, 3, number).unwrap().into_raw_vec_and_offset().0
    };
    let film = MemoryRecording::new(SIZE_PX[0], 12, (0..N_FRAMES).map(frame).collect());
    let method: Method = "icgn-cubic-affine".parse().unwrap();
    let first = ReferenceFrames::Single(0);
    let settings = Settings::default();
    let tracks = method.track(&film, &[subset(60.0, 22)], &first, &settings, &|_| ()).unwrap();
    for (number, found) in (0..).zip(&tracks[0].positions) {
        match HIDDEN.contains(&number) {
            true => assert_eq!(*found, Err(Lost::LowCorrelation), "frame {number}"),
            false => assert!(found.is_ok(), "frame {number}: {found:?}"),
        }
    }
}
