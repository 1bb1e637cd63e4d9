//! A calibration from pictures of a board, which OpenCV finds.

use std::fs;

use tempfile::TempDir;

use crate::support::command::{chainwave, fail, succeed};

/// An 8-bit bitmap of a board of 10 x 7 squares of 30 px with a white margin, parallel to the picture.
fn board_picture() -> Vec<u8> {
    let (width, height) = (400_usize, 300_usize);
    let is_black = |x: usize, y: usize| {
        let inside = (50..350).contains(&x) && (45..255).contains(&y);
        inside && ((x - 50) / 30 + (y - 45) / 30).is_multiple_of(2)
    };
    let number = |value: usize| (value as u32).to_le_bytes();
    let first_pixel = 14 + 40 + 1024;
    let mut bytes = b"BM".to_vec();
    for value in [first_pixel + width * height, 0, first_pixel, 40, width, height] {
        bytes.extend(number(value));
    }
    bytes.extend([1, 0, 8, 0]);
    bytes.extend([0; 24]);
    bytes.extend((0..=255_u8).flat_map(|level| [level, level, level, 0]));
    for y in (0..height).rev() {
        bytes.extend((0..width).map(|x| if is_black(x, y) { 20_u8 } else { 220 }));
    }
    bytes
}

#[test]
fn a_picture_of_a_board_gives_the_scale() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let path = |name: &str| folder.path().join(name);
    fs::write(path("board.bmp"), board_picture()).expect("the picture can be written");
    fs::write(path("empty.bmp"), &board_picture()[..1078]).expect("the picture can be written");
    let calibrate = |pictures: &[&str]| {
        let mut command = chainwave();
        command.arg("calibrate").args(pictures.iter().map(|name| path(name)));
        command.args(["--board", "checkerboard", "--columns", "10", "--rows", "7", "--square-m", "0.003"]);
        command.args(["--square-sigma-m", "3e-6", "--out"]).arg(path("calibration.toml"));
        command
    };
    let summary = succeed(&mut calibrate(&["board.bmp"]));
    assert!(summary.contains("54 corners in 1 pictures"), "{summary}");
    let text = fs::read_to_string(path("calibration.toml")).expect("it was written");
    let table: toml::Table = text.parse().expect("it is TOML");
    let number = |name: &str| table[name].as_float().unwrap_or_else(|| panic!("{name} is a number"));
    // 3 mm over 30 px, to 0.1 % by the squares; corners of a few hundredths of a pixel over 200 px tell it better.
    assert!((number("m_per_px") / 1e-4 - 1.0).abs() < 1e-3, "{text}");
    assert!((0.9e-7..2e-7).contains(&number("m_per_px_sigma")), "{text}");
    let k1 = table["map"]["k1"].as_float().expect("k1 is a number");
    assert!(k1.abs() < 4.0 * number("k1_sigma"), "{text}");

    let message = fail(&mut calibrate(&["board.bmp", "empty.bmp"]), 1);
    assert!(message.contains("empty.bmp") && !message.contains("board.bmp"), "{message}");
    let message = fail(&mut calibrate(&["empty.bmp", "board.bmp"]), 2);
    assert!(message.contains("empty.bmp"), "{message}");
}
