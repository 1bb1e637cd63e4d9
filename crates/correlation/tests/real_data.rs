//! Images of others with known motion: `CHAINWAVE_REFERENCE_DATA` names their folder.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and shows what it measured"
)]

mod support;

use std::fs::{self, File};
use std::path::Path;

use chainwave_correlation::{PreparedSubset, Reference, Settings, Window, Workspace};
use chainwave_measurement::Region;
use support::{moments, reference_data, subset};

/// Width, height and gray values.
struct Image {
    region: Region,
    pixels: Vec<f32>,
}

fn tiff(path: &Path) -> Image {
    let mut decoder = tiff::decoder::Decoder::new(File::open(path).unwrap()).unwrap();
    let (width, height) = decoder.dimensions().unwrap();
    let pixels = match decoder.read_image().unwrap() {
        tiff::decoder::DecodingResult::U8(values) => values.into_iter().map(f32::from).collect(),
        tiff::decoder::DecodingResult::U16(values) => values.into_iter().map(f32::from).collect(),
        _ => panic!("8 or 16 bit expected"),
    };
    Image { region: Region::whole(width as usize, height as usize), pixels }
}

/// An uncompressed BMP; of colours, the first.
fn bmp(path: &Path) -> Image {
    let bytes = fs::read(path).unwrap();
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let (data, width, height) = (number(10), number(18), number(22));
    let bytes_per_pixel = usize::from(bytes[28]) / 8;
    let stride = (width * bytes_per_pixel).next_multiple_of(4);
    let pixel =
        |i: usize| f32::from(bytes[data + (height - 1 - i / width) * stride + i % width * bytes_per_pixel]);
    Image { region: Region::whole(width, height), pixels: (0..width * height).map(pixel).collect() }
}

/// Displacements of a grid of 33 x 33 px subsets that are found, and how many there are in all.
fn displacements(reference: &Image, target: &Image, start: [f64; 2]) -> (Vec<[f64; 2]>, usize) {
    let settings = Settings::default();
    let window = Window::new(target.region, &target.pixels, settings.interpolation).unwrap();
    let reference = Reference::new(reference.region, reference.pixels.clone(), 1).unwrap();
    let line = |n: usize| (60..n - 60).step_by(40).map(|i| i as f64);
    let mut workspace = Workspace::default();
    let mut find = |[x, y]: [f64; 2]| {
        let prepared = PreparedSubset::new(&reference, &subset(x, y, 16), &settings).ok()?;
        let found = prepared.match_in(&window, [x + start[0], y + start[1]], &mut workspace).ok()?;
        Some([found.position.x_px.value - x, found.position.y_px.value - y])
    };
    let places: Vec<[f64; 2]> =
        line(target.region.height).flat_map(|y| line(target.region.width).map(move |x| [x, y])).collect();
    (places.iter().filter_map(|&place| find(place)).collect(), places.len())
}

fn assert_shift(found: &(Vec<[f64; 2]>, usize), truth: f64, bias_px: f64, std_px: f64) {
    assert_eq!(found.0.len(), found.1, "no point is lost");
    for axis in 0..2 {
        let [mean, std] = moments(&found.0.iter().map(|u| u[axis]).collect::<Vec<_>>());
        println!("axis {axis}: {:+.3} mpx, standard deviation {:.3} mpx", 1e3 * (mean - truth), 1e3 * std);
        assert!(
            (mean - truth).abs() < bias_px && std < std_px,
            "axis {axis}: {mean} +- {std}, expected {truth}"
        );
    }
}

#[test]
fn whole_pixels_are_exact() {
    let Some(folder) = reference_data("dic/pixel_shift") else { return };
    let reference = tiff(&folder.join("ref.tif"));
    for shift in [1.0, 5.0] {
        let target = tiff(&folder.join(format!("def_{shift}.tif")));
        let found = displacements(&reference, &target, [shift - 0.7, shift + 0.6]);
        // the same pixels moved: nothing is left but the convergence limit of 1 mpx
        assert_shift(&found, shift, 1e-3, 1e-3);
    }
}

#[test]
fn the_translation_set_of_opencorr_is_reproduced() {
    let Some(folder) = reference_data("dic/OpenCorr") else { return };
    let (reference, target) =
        (bmp(&folder.join("Pattern_1.bmp")), bmp(&folder.join("Pattern_1_Translation.bmp")));
    let found = displacements(&reference, &target, [7.0, 7.0]);
    // 8 bit, shifted by interpolation: its makers' own solver is off by several mpx
    assert_shift(&found, 7.0 + 1.0 / 12.0, 5e-3, 1e-2);
}
