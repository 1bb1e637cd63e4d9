//! Precision and coverage from 0.2 to 10 % noise, as tables for the book: `cargo xtask tested ladder intervals`, and `bounds`; the variable DRAWS
//! says how many pictures of each pattern.

use chainwave_correlation::{Interpolation, Shape};

use crate::support::{Image, bound_of_unknown_texture, coverage, error_of_std};
use crate::{printed_spots, pulls, random_spots, rms_of};

fn draws() -> u64 {
    std::env::var("DRAWS").ok().and_then(|value| value.parse().ok()).unwrap_or(20)
}

#[test]
#[ignore = "a table of the book, of a minute or two"]
fn intervals() {
    let shapes = Shape::ALL.map(|shape| (Interpolation::Cubic, shape));
    let others =
        [Interpolation::Linear, Interpolation::CubicMoms, Interpolation::Quintic, Interpolation::QuinticMoms]
            .map(|interpolation| (interpolation, Shape::Affine));
    let methods: Vec<(Interpolation, Shape)> = shapes.into_iter().chain(others).collect();
    let mut rows: Vec<String> =
        methods.iter().map(|(interpolation, shape)| format!("{interpolation} {shape}")).collect();
    for noise in [0.002, 0.01, 0.02, 0.05, 0.1] {
        let found = pulls(&[31, 32].map(random_spots), noise, draws(), &methods);
        for (row, pulls) in rows.iter_mut().zip(&found) {
            let [inner, outer] = coverage(&pulls.iter().map(|pull| pull[0]).collect::<Vec<_>>());
            row.push_str(&format!(",\"{inner:.1}, {outer:.1}\""));
        }
        if noise > 0.05 {
            rows.iter_mut().zip(&found).for_each(|(row, pulls)| row.push_str(&format!(",{}", pulls.len())));
        }
    }
    println!("count: method,at_02,at_1,at_2,at_5,at_10,errors_at_10");
    rows.iter().for_each(|row| println!("count: {row}"));
}

#[test]
#[ignore = "a table of the book, of a minute or two"]
fn bounds() {
    let methods = [Shape::Translation, Shape::Affine].map(|shape| (Interpolation::Cubic, shape));
    let patterns: [(&str, f64, [Image; 2]); 2] = [
        ("light and dark spots spread evenly, as printed patterns are", 0.2, [41, 42].map(printed_spots)),
        ("random light spots, some as dark as their noise is wide", 0.145, [31, 32].map(random_spots)),
    ];
    println!("count: pattern,translation,affine,unknown,errors,error_percent");
    for (name, contrast, images) in &patterns {
        for noise in [0.01, 0.02, 0.05] {
            let found = pulls(images, noise, draws(), &methods);
            let (unknown, n) = (bound_of_unknown_texture(*contrast, noise), found[1].len());
            println!(
                "count: \"{name}, {:.0} % noise\",{:.3},{:.3},{unknown:.3},{n},{:.1}",
                100.0 * noise,
                rms_of(&found[0], 1),
                rms_of(&found[1], 2),
                100.0 * error_of_std(n),
            );
        }
    }
}
