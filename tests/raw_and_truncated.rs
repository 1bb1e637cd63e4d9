//! Recordings as a user has them: without a header, cut short, with what the sensor adds to each picture.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::Gray16;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::repository::root;
use crate::support::table::Table;

/// Side of the pictures drawn here.
const SIDE_PX: u32 = 64;
const N_FRAMES: u32 = 9;
/// Columns that the texture moves from frame to frame.
const STEP_PX: f64 = 0.37;

/// Counts of a texture that has moved, and nothing else: waves of many directions and lengths, which repeat themselves nowhere.
fn texture(frame: u32) -> Vec<f64> {
    let count = |i: u32| {
        let (x, y) = (f64::from(i % SIDE_PX) - STEP_PX * f64::from(frame), f64::from(i / SIDE_PX));
        let wave = |k: u32| {
            let (angle, per_px) = (2.4 * f64::from(k), 0.4 + 0.06 * f64::from(k));
            (per_px * (angle.cos() * x + angle.sin() * y) + f64::from(k * k)).sin()
        };
        2000.0 + 100.0 * (0..12).map(wave).sum::<f64>()
    };
    (0..SIDE_PX * SIDE_PX).map(count).collect()
}

/// What each pixel of a sensor adds: up to 100 counts, and 40 times as much in one of 500.
fn pattern() -> Vec<f64> {
    let of_pixel = |i: u32| {
        let mixed = i.wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(0x85eb_ca6b) >> 8;
        let hot = if mixed.is_multiple_of(500) { 40.0 } else { 1.0 };
        hot * f64::from(mixed % 101)
    };
    (0..SIDE_PX * SIDE_PX).map(of_pixel).collect()
}

fn rounded(counts: impl Iterator<Item = f64>) -> Vec<u16> {
    counts.map(|count| count.round() as u16).collect()
}

fn write_stack(path: &Path, frames: &[Vec<u16>]) {
    let file = fs::File::create(path).expect("the stack can be made");
    let mut encoder = TiffEncoder::new(file).expect("the stack can be written");
    for counts in frames {
        encoder.write_image::<Gray16>(SIDE_PX, SIDE_PX, counts).expect("the stack can be written");
    }
}

fn write_raw(path: &Path, frames: &[Vec<u16>]) {
    let bytes: Vec<u8> = frames.concat().into_iter().flat_map(u16::to_le_bytes).collect();
    fs::write(path, bytes).expect("the pixels can be written");
}

/// A folder whose name no ASCII table holds, with a point in the middle of the pictures, as a German program writes it.
fn laboratory() -> (TempDir, PathBuf, PathBuf) {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let inner = folder.path().join("Messung größer 波 3");
    fs::create_dir(&inner).expect("a folder can be made");
    let points = inner.join("Punkte.csv");
    fs::write(
        &points,
        "\u{feff}name; x_px; y_px; half_width_px; half_height_px\r\nMitte;31,5;31,5;15;15\r\n",
    )
    .expect("the points can be written");
    (folder, inner, points)
}

fn tracking(points: &Path, recording: &Path, out: &Path) -> Command {
    let mut command = chainwave();
    command.arg("track").arg(recording).arg("--points").arg(points).arg("--out").arg(out);
    command
}

#[test]
fn no_result_replaces_another_or_what_it_is_made_from() {
    let (_folder, inner, points) = laboratory();
    let frames: Vec<Vec<u16>> = (0..N_FRAMES).map(|k| rounded(texture(k).into_iter())).collect();
    let [film, out] = ["film.tif", "Spur.csv"].map(|name| inner.join(name));
    write_stack(&film, &frames);
    let before = [&film, &points].map(|path| fs::read(path).expect("it was written"));
    let mut told = Vec::new();
    for stem in ["Spur", "Punkte"] {
        told.push(fail(tracking(&points, &film, &out).arg("--picture").arg(inner.join(stem)), 2));
    }
    // the same file by another path
    let roundabout = inner.join("..").join("Messung größer 波 3").join("Spur");
    told.push(fail(tracking(&points, &film, &out).arg("--picture").arg(roundabout), 2));
    told.push(fail(&mut tracking(&points, &film, &points), 2));
    let picture = inner.join("film.png");
    fs::write(&picture, b"nobody looks into it").expect("it can be written");
    let mut correlate = chainwave();
    correlate.arg("correlate").args([&picture, &picture]).arg("--out").arg(inner.join("film.csv"));
    told.push(fail(&mut correlate, 2));
    told.push(fail(chainwave().arg("contact").arg(&points).arg("--out").arg(&points), 2));
    told.push(fail(chainwave().arg("inspect").arg(&film).args(["--frame", "0", "--out"]).arg(&film), 2));
    for message in &told {
        assert!(message.contains("would replace") && message.contains("hint: give"), "{message}");
    }
    assert!(told[0].contains("a file of the picture would replace the table"), "{}", told[0]);
    assert!(told[1].contains("Punkte.csv, which is read"), "{}", told[1]);
    assert!(!out.exists());
    assert_eq!([&film, &points].map(|path| fs::read(path).expect("it is still there")), before);

    succeed(tracking(&points, &film, &out).arg("--picture").arg(inner.join("Bild")));
    assert!(rms_error_px(&out) < 0.002 && inner.join("Bild.csv").exists());
    // With the ending of one of its files, the figure has that name and no second one.
    succeed(tracking(&points, &film, &out).arg("--picture").arg(inner.join("Fig.1.png")));
    assert!(inner.join("Fig.1.png").exists() && inner.join("Fig.1.svg").exists());
    assert!(!inner.join("Fig.1.png.png").exists());
    let refused = fail(tracking(&points, &film, &out).arg("--picture").arg(inner.join("Bild.JPG")), 2);
    assert!(refused.contains("--picture: expected a name that ends in .svg or .png"), "{refused}");
}

#[test]
fn without_a_rate_frames_are_counted_and_no_time_is_stated() {
    let (_folder, inner, points) = laboratory();
    let frames: Vec<Vec<u16>> = (0..N_FRAMES).map(|k| rounded(texture(k).into_iter())).collect();
    let (film, out, picture) = (inner.join("film"), inner.join("Spur.csv"), inner.join("Bild"));
    fs::create_dir(&film).expect("a folder can be made");
    frames
        .iter()
        .enumerate()
        .for_each(|(k, frame)| write_stack(&film.join(format!("{k}.tif")), std::slice::from_ref(frame)));

    let said = succeed(chainwave().arg("inspect").arg(&film));
    assert!(said.contains("not known; 8 frames after the first") && !said.contains("ms after"), "{said}");
    let said = succeed(chainwave().arg("inspect").arg(&film).arg("--json"));
    let told: serde_json::Value = serde_json::from_str(&said).expect("it is JSON");
    assert!(told["first_time_s"].is_null() && told["last_time_s"].is_null(), "{told}");

    succeed(tracking(&points, &film, &out).arg("--picture").arg(&picture));
    let tracks = Table::read(&out);
    assert_eq!(tracks.numbers("t_s"), [None; N_FRAMES as usize]);
    assert_eq!(tracks.full("frame"), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
    let drawn = fs::read_to_string(picture.with_extension("csv")).expect("it was written");
    assert!(drawn.contains("frame") && !drawn.contains("(ms)"), "{drawn}");

    let timed = ["--rate-hz", "2000"];
    succeed(tracking(&points, &film, &out).args(timed).arg("--picture").arg(&picture));
    assert!((Table::read(&out).full("t_s")[8] - 0.004).abs() < 1e-12);
    let drawn = fs::read_to_string(picture.with_extension("csv")).expect("it was written");
    assert!(drawn.contains("time (ms)"), "{drawn}");
}

#[test]
fn points_are_read_as_spreadsheets_write_them() {
    let (_folder, inner, points) = laboratory();
    let frames: Vec<Vec<u16>> = (0..N_FRAMES).map(|k| rounded(texture(k).into_iter())).collect();
    let (film, out) = (inner.join("film.tif"), inner.join("Spur.csv"));
    write_stack(&film, &frames);
    let text = "name;x_px;y_px;half_width_px;half_height_px\r\nHöhe;31,5;31,5;15;15\r\n;;;;\r\n;;;;\r\n";
    let utf_16: Vec<u8> =
        [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let latin_1: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).expect("it is Latin-1")).collect();
    for bytes in [utf_16, latin_1] {
        fs::write(&points, bytes).expect("the points can be written");
        succeed(&mut tracking(&points, &film, &out));
        assert!(rms_error_px(&out) < 0.002);
        assert!(Table::read(&out).texts("name").iter().all(|name| name == "Höhe"));
    }
}

/// Root mean square of the error of the way from the first frame, in pixels.
fn rms_error_px(tracks: &Path) -> f64 {
    let x_px = Table::read(tracks).full("x_px");
    assert_eq!(x_px.len(), N_FRAMES as usize);
    let errors = x_px.iter().enumerate().map(|(k, x)| x - x_px[0] - STEP_PX * k as f64);
    (errors.map(|error| error * error).sum::<f64>() / f64::from(N_FRAMES)).sqrt()
}

#[test]
fn pixels_without_a_header_are_read_by_their_stated_geometry() {
    let (_folder, inner, points) = laboratory();
    let frames: Vec<Vec<u16>> = (0..N_FRAMES).map(|k| rounded(texture(k).into_iter())).collect();
    let (raw, out) = (inner.join("Zug ä.raw"), inner.join("Spur.csv"));
    write_raw(&raw, &frames);
    let options = ["--raw", "64x64x12le", "--rate-hz", "2000"];

    let said = succeed(chainwave().arg("inspect").arg(&raw).arg("--json").args(options));
    let told: serde_json::Value = serde_json::from_str(&said).expect("it is JSON");
    assert_eq!((&told["n_frames"], &told["rate_hz"]), (&9.into(), &2000.0.into()), "{told}");
    let said = succeed(tracking(&points, &raw, &out).args(options));
    assert!(said.contains("9 of 9 readings ok") && said.contains("worst point Mitte"), "{said}");
    // Counts are rounded: a third of a count in waves of 200.
    assert!(rms_error_px(&out) < 0.002, "{}", rms_error_px(&out));
    let t_s = Table::read(&out).full("t_s");
    assert!((t_s[8] - 8.0 / 2000.0).abs() < 1e-12);

    let (one, other, field) = (inner.join("0.raw"), inner.join("1.raw"), inner.join("Feld.parquet"));
    write_raw(&one, &frames[..1]);
    write_raw(&other, &frames[1..2]);
    let mut correlate = chainwave();
    correlate.arg("correlate").args([&one, &other]).args(["--raw", "64x64x12le"]);
    let said = succeed(correlate.args(["--step", "8", "--half-size", "10", "--out"]).arg(&field));
    assert!(said.contains("readings ok, median sigma"), "{said}");
    let u_px: Vec<f64> = Table::read(&field).numbers("u_px").into_iter().flatten().collect();
    let mean_px = u_px.iter().sum::<f64>() / u_px.len() as f64;
    assert!((mean_px - STEP_PX).abs() < 0.002, "{mean_px}");

    // The counts say that the bytes stand the other way round, and the size that the pictures are smaller.
    for (geometry, part) in [("64x64x12be", "order of bytes"), ("64x100x12", "whole number of frames")] {
        let message = fail(chainwave().arg("inspect").arg(&raw).args(["--raw", geometry]), 2);
        assert!(message.contains(part), "{geometry}: {message}");
    }
    let message = fail(chainwave().arg("inspect").arg(&raw).args(["--raw", "64x64"]), 2);
    assert!(message.contains("WIDTHxHEIGHTxBITS"), "{message}");
}

#[test]
fn the_whole_frames_of_a_recording_that_was_cut_are_read_where_that_is_asked_and_counted() {
    let (_folder, inner, points) = laboratory();
    let sample = fs::read(root().join("data-samples/hec-view1-trial1.cine")).expect("the sample can be read");
    let (cut, out) = (inner.join("gekürzt.cine"), inner.join("Spur.csv"));
    fs::write(&cut, &sample[..sample.len() * 2 / 3]).expect("it can be written");
    fs::write(&points, "name,x_px,y_px,half_width_px,half_height_px\n1,25,19.5,11,11\n")
        .expect("it can be written");

    let message = fail(chainwave().arg("inspect").arg(&cut), 2);
    assert!(message.contains("--partial"), "{message}");
    let said = succeed(chainwave().arg("inspect").arg(&cut).args(["--partial", "--json"]));
    let told: serde_json::Value = serde_json::from_str(&said).expect("it is JSON");
    let n_frames = told["n_frames"].as_u64().expect("a number");
    assert!((1..120).contains(&n_frames), "{n_frames}");
    let of_whole = format!("of the 120 frames it states, the first {n_frames} are whole");
    assert!(told["warnings"].to_string().contains(&of_whole), "{told}");

    fail(&mut tracking(&points, &cut, &out), 2);
    let said = succeed(tracking(&points, &cut, &out).arg("--partial"));
    assert!(
        said.contains(&of_whole) && said.contains(&format!("{n_frames} of {n_frames} readings ok")),
        "{said}"
    );
}

#[test]
fn dark_frames_and_a_flat_field_take_off_what_the_sensor_adds() {
    let (_folder, inner, points) = laboratory();
    let [film, dark, flat, out] =
        ["film.tif", "dunkel.tif", "weiß.tif", "spur.csv"].map(|name| inner.join(name));
    let gains: Vec<f64> = pattern().iter().rev().map(|added| 1.0 + 1e-3 * (added % 101.0)).collect();
    let seen =
        |light: &[f64]| rounded(light.iter().zip(&gains).zip(pattern()).map(|((l, g), p)| l * g + p + 50.0));
    let frames: Vec<Vec<u16>> = (0..N_FRAMES).map(|k| seen(&texture(k))).collect();
    write_stack(&film, &frames);
    let nothing = vec![0.0; (SIDE_PX * SIDE_PX) as usize];
    write_stack(&dark, &[seen(&nothing), seen(&nothing)]);
    let even = vec![3000.0; nothing.len()];
    write_stack(&flat, &[seen(&even), seen(&even)]);

    succeed(&mut tracking(&points, &film, &out));
    let as_seen_px = rms_error_px(&out);
    let said = succeed(tracking(&points, &film, &out).arg("--dark").arg(&dark).arg("--flat").arg(&flat));
    assert!(said.contains("the dark level of 2 frames is taken off"), "{said}");
    assert!(said.contains("gains follow 2 frames"), "{said}");
    let corrected_px = rms_error_px(&out);
    // Of a pattern as strong as a seventh of the texture a hundredth is left by rounding.
    assert!(as_seen_px > 0.01 && corrected_px < 0.003, "{as_seen_px} as seen, {corrected_px} corrected");

    let mut correlate = chainwave();
    correlate.arg("correlate").args([&film, &film]).args(["--step", "8", "--half-size", "10"]);
    let said = succeed(correlate.arg("--dark").arg(&dark).arg("--out").arg(inner.join("feld.csv")));
    assert!(said.contains("the dark level of 2 frames"), "{said}");

    let small = inner.join("klein.pgm");
    fs::write(&small, b"P5 2 2 255 \x01\x02\x03\x04").expect("it can be written");
    let message = fail(tracking(&points, &film, &out).arg("--dark").arg(&small), 2);
    assert!(message.contains("2 x 2 px"), "{message}");
    let message = fail(tracking(&points, &film, &out).arg("--dark").arg(inner.join("fehlt.tif")), 2);
    assert!(message.contains("fehlt.tif"), "{message}");
}

mod slow {
    use super::*;
    use crate::support::laboratory::{Laboratory, evaluation};

    /// A picture of the small experiment's camera in the dark.
    fn dark_picture(level: u16) -> Vec<u8> {
        let mut bytes = b"P5 400 48 4095 ".to_vec();
        bytes.extend((0..400 * 48).flat_map(|i: u16| (level + i % 3).to_be_bytes()));
        bytes
    }

    #[test]
    fn a_run_knows_its_dark_frames_and_tracks_anew_when_they_change() {
        let laboratory = Laboratory::new();
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        let plan = fs::read_to_string(recordings.join("experiment.toml")).expect("it was written");
        let with_dark = plan
            .replacen("first_body_px", "dark = \"dunkel größe.pgm\"\nfirst_body_px", 1)
            .replacen("[tracking]", "[trigger]\nsigma_s = 1e-5\nview_sigma_s = 0.0\n\n[tracking]", 1);
        fs::write(recordings.join("experiment.toml"), &with_dark).expect("it can be written");
        let message = fail(&mut evaluation(&recordings, &results), 2);
        assert!(message.contains("dunkel größe.pgm"), "{message}");

        let dark = recordings.join("dunkel größe.pgm");
        fs::write(&dark, dark_picture(60)).expect("it can be written");
        let said = succeed(&mut evaluation(&recordings, &results));
        assert!(said.contains("the dark level of 1 frames is taken off"), "{said}");
        let explained = succeed(evaluation(&recordings, &results).arg("--explain"));
        assert!(explained.contains("15 of 15 recordings kept"), "{explained}");
        fs::write(&dark, dark_picture(61)).expect("it can be written");
        let explained = succeed(evaluation(&recordings, &results).arg("--explain"));
        assert_eq!(explained.matches("differs in sensor correction").count(), 15, "{explained}");
    }

    #[test]
    fn a_run_takes_what_is_whole_of_a_recording_that_was_cut() {
        let laboratory = Laboratory::new();
        let (recordings, results) = (laboratory.film(), laboratory.path("results"));
        let path = recordings.join("view2_trial3.cine");
        let bytes = fs::read(&path).expect("it was filmed");
        fs::write(&path, &bytes[..bytes.len() * 4 / 5]).expect("it can be written");
        let said = succeed(evaluation(&recordings, &results).arg("--partial"));
        assert!(said.contains("view2_trial3.cine: the recording is cut short"), "{said}");
        let mut tracked = Table::read(&results.join("tracks.parquet")).texts("recording");
        tracked.dedup();
        assert_eq!(tracked.len(), 15);
    }

    /// An ordinary sensor's pattern, three times as strong as usual, in every film.
    const SENSOR: &str = "[synthetic.camera.effects]\nfixed_pattern = { offset_sigma = 0.003, gain_sigma = 0.01 }\n\
                          defective_pixels = { hot_fraction = 0.001, hot_offset_mean = 0.3 }\n";

    /// The bytes of a film by that sensor of nothing, or of an even field, without rods.
    fn even_field(tone: f64) -> Vec<u8> {
        let tones = format!(
            "below_axis_m = []\n\n[synthetic.specimen.tones]\nbackdrop = {tone}\nblot = 0.0\nring = {tone}\nmarker = {tone}\n\
             speckle_depth = 0.0\nrod = {tone}\n\n{SENSOR}"
        );
        let laboratory = Laboratory::with_experiment("below_axis_m = [-7e-3, 7e-3]", &tones);
        fs::read(laboratory.film().join("view1_trial1.cine")).expect("it was filmed")
    }

    /// How far the damping of the bodies is off its truth, in kilograms per second and in its standard uncertainties.
    fn damping_off_by(results: &Path) -> [f64; 2] {
        let text = fs::read_to_string(results.join("results.json")).expect("it was written");
        let found: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
        let number = |name: &str| found[name].as_f64().expect("a number");
        let off_kg_per_s = number("c_d_kg_per_s") - 0.003;
        [off_kg_per_s, off_kg_per_s / number("c_d_sigma")]
    }

    #[test]
    fn dark_frames_and_a_flat_field_bring_the_damping_back_into_its_interval() {
        let laboratory = Laboratory::with_appended(SENSOR);
        let recordings = laboratory.film();
        let [plain, corrected] = ["plain", "corrected"].map(|name| laboratory.path(name));
        succeed(&mut evaluation(&recordings, &plain));
        for (tone, name) in [(0.0, "dunkel.cine"), (0.5, "weiß.cine")] {
            fs::write(recordings.join(name), even_field(tone)).expect("it can be written");
        }
        let plan = fs::read_to_string(recordings.join("experiment.toml")).expect("it was written");
        let keys = "dark = \"dunkel.cine\"\nflat = \"weiß.cine\"\nfirst_body_px";
        fs::write(recordings.join("experiment.toml"), plan.replacen("first_body_px", keys, 1))
            .expect("it can be written");
        let said = succeed(&mut evaluation(&recordings, &corrected));
        assert!(said.contains("gains follow 330 frames of a flat field"), "{said}");
        // A pattern that is taken for motion is off by far more than chance, of which four standard uncertainties are the end.
        let (off, corrected) = (damping_off_by(&plain), damping_off_by(&corrected));
        assert!(
            corrected[1].abs() < 4.0 && corrected[0].abs() < 0.2 * off[0].abs(),
            "off by {off:?}, corrected by {corrected:?}"
        );
    }
}
