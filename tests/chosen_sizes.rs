//! Sizes of subsets, steps and methods that are left open, through the command: chosen, said, and written beside the table.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::Gray16;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::table::Table;

const SIZE_PX: [u32; 2] = [180, 120];
/// How far the texture has moved in the second picture, along x.
const STEP_PX: f64 = 0.4;
/// Standard deviation of the noise, in counts; that of the texture is some 270.
const NOISE: f64 = 15.0;

/// Counts of a texture of many waves that has moved by so many steps, with noise that differs from picture to picture.
fn seen(number: u32, has_texture: bool) -> Vec<u16> {
    let mut state = 7 + 1000 * u64::from(number);
    let mut noise = || -> f64 {
        // twelve uniform numbers have the variance 1
        let sum: f64 = (0..12)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 53) as f64
            })
            .sum();
        NOISE * (sum - 6.0)
    };
    let count = |i: u32| {
        let (x, y) = (f64::from(i % SIZE_PX[0]) - STEP_PX * f64::from(number), f64::from(i / SIZE_PX[0]));
        let wave = |k: u32| {
            let (angle, per_px) = (2.4 * f64::from(k), 0.35 + 0.05 * f64::from(k));
            (per_px * (angle.cos() * x + angle.sin() * y) + f64::from(k * k)).sin()
        };
        let texture = if has_texture { 110.0 * (0..12).map(wave).sum::<f64>() } else { 0.0 };
        (2000.0 + texture + noise()).round() as u16
    };
    (0..SIZE_PX[0] * SIZE_PX[1]).map(count).collect()
}

fn write(path: &Path, frames: &[Vec<u16>]) {
    let file = fs::File::create(path).expect("the stack can be made");
    let mut encoder = TiffEncoder::new(file).expect("the stack can be written");
    for counts in frames {
        encoder.write_image::<Gray16>(SIZE_PX[0], SIZE_PX[1], counts).expect("the stack can be written");
    }
}

/// A folder with two pictures of a texture, or of bare ground, and both in one film.
fn pictures(has_texture: bool) -> (TempDir, [PathBuf; 3]) {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let paths = ["a.tif", "b.tif", "film.tif"].map(|name| folder.path().join(name));
    let frames = [seen(0, has_texture), seen(1, has_texture)];
    write(&paths[0], &frames[..1]);
    write(&paths[1], &frames[1..]);
    write(&paths[2], &frames);
    (folder, paths)
}

fn provenance(table: &Path) -> toml::Table {
    let text = fs::read_to_string(table.with_extension("provenance.toml")).expect("the choices are written");
    text.parse().expect("they are TOML")
}

#[test]
fn a_field_without_sizes_is_that_of_the_sizes_it_names() {
    let (folder, [reference, deformed, _]) = pictures(true);
    let [open, given] = ["open.csv", "given.csv"].map(|name| folder.path().join(name));
    let said = succeed(chainwave().arg("correlate").args([&reference, &deformed]).arg("--out").arg(&open));
    let chosen = &provenance(&open)["subset"][0];
    let [half, step] =
        ["half_width_px", "step_px"].map(|key| chosen[key].as_integer().expect("a whole number"));
    assert!(said.contains(&format!("chosen: half size {half} px, step {step} px")), "{said}");
    assert_eq!(step, (half + 1) / 2);
    let mut correlate = chainwave();
    correlate.arg("correlate").args([&reference, &deformed]).args(["--step", &step.to_string()]);
    let said = succeed(correlate.args(["--half-size", &half.to_string()]).arg("--out").arg(&given));
    assert!(!said.contains("chosen"), "what is given is not chosen: {said}");
    assert!(!given.with_extension("provenance.toml").exists());
    assert_eq!(fs::read(&open).expect("a table"), fs::read(&given).expect("a table"));
    let u = Table::read(&open).full("u_px");
    let rms = (u.iter().map(|u| (u - STEP_PX).powi(2)).sum::<f64>() / u.len() as f64).sqrt();
    // 0.01 px is aimed at for the noise of a point; the noise of the reference is common to points that share pixels
    assert!(rms < 0.013, "{rms}");
}

#[test]
fn an_accuracy_chooses_the_field_and_the_method() {
    let (folder, [reference, deformed, _]) = pictures(true);
    let half = |accuracy: &str| {
        let out = folder.path().join(format!("{accuracy}.csv"));
        let mut correlate = chainwave();
        correlate.arg("correlate").args([&reference, &deformed]).args(["--accuracy", accuracy]);
        let said = succeed(correlate.arg("--out").arg(&out));
        assert!(said.contains(&format!("chosen for an error of {accuracy} px: icgn-")), "{said}");
        let chosen = provenance(&out);
        assert!(
            chosen["method"][0]["method"].as_str().is_some_and(|name| name.starts_with("icgn-")),
            "{chosen}"
        );
        chosen["subset"][0]["half_width_px"].as_integer().expect("a whole number")
    };
    assert!(half("0.006") > half("0.02"), "less noise takes more pixels");
}

#[test]
fn pictures_without_texture_have_no_field() {
    let (folder, [reference, deformed, film]) = pictures(false);
    let out = folder.path().join("field.csv");
    let said = fail(chainwave().arg("correlate").args([&reference, &deformed]).arg("--out").arg(&out), 2);
    assert!(said.contains("expected texture") && said.contains("hint: "), "{said}");
    let points = folder.path().join("points.csv");
    fs::write(&points, "name,x_px,y_px\nground,90,60\n").expect("the points can be written");
    let mut track = chainwave();
    let said = fail(track.arg("track").arg(&film).arg("--points").arg(&points).arg("--out").arg(&out), 2);
    assert!(said.contains("2 no_texture"), "{said}");
}

#[test]
fn points_without_sizes_take_what_noise_and_neighbours_allow() {
    let (folder, [_, _, film]) = pictures(true);
    let (points, out) = (folder.path().join("points.csv"), folder.path().join("tracks.csv"));
    // two close to each other, one by itself
    fs::write(&points, "name,x_px,y_px\na,40,60\nb,65,60\nc,130,60\n").expect("the points can be written");
    let mut track = chainwave();
    let said = succeed(track.arg("track").arg(&film).arg("--points").arg(&points).arg("--out").arg(&out));
    assert!(said.contains("chosen: half size") && said.contains("6 of 6 readings ok"), "{said}");
    let chosen = provenance(&out);
    let half = |i: usize| chosen["subset"][i]["half_width_px"].as_integer().expect("a whole number");
    assert_eq!(["a", "b", "c"].map(Some), [0, 1, 2].map(|i: usize| chosen["subset"][i]["point"].as_str()));
    assert!(half(0) <= 12 && half(1) <= 12, "25 px apart, they do not overlap: {chosen}");
    assert_eq!(Table::read(&out).texts("status"), ["ok"; 6]);
}
