//! Other people's recordings, in the folder that `CHAINWAVE_REFERENCE_DATA` names; without it these tests say so and pass.

use std::fs::File;
use std::path::{Path, PathBuf};

use chainwave_testkit::reference_data;
use serde_json::Value;
use tempfile::TempDir;
use tiff::decoder::{Decoder, DecodingResult};

use crate::support::command::{chainwave, fail, succeed};

/// The keys that interface.md promises.
const KEYS: [&str; 12] = [
    "format",
    "width_px",
    "height_px",
    "n_frames",
    "bit_depth",
    "rate_hz",
    "first_time_s",
    "last_time_s",
    "first_image",
    "camera",
    "exposure_s",
    "warnings",
];

#[test]
fn the_papers_camera_is_inspected() {
    let Some(recording) = v1211("12bpp.cine") else { return };
    let facts = inspected(&recording);
    // As the vendor's own export of the header has it.
    assert_eq!((&facts["width_px"], &facts["height_px"]), (&128.into(), &16.into()));
    assert_eq!((&facts["n_frames"], &facts["bit_depth"]), (&202.into(), &12.into()));
    assert_eq!((&facts["first_image"], &facts["camera"]), (&(-100).into(), &"Phantom v1211".into()));
    let rate_hz = facts["rate_hz"].as_f64().expect("the file has time stamps");
    assert!((rate_hz - 10_000.0).abs() < 0.1, "the clock keeps to 10 ppm: {rate_hz}");
}

/// Every readable recording of a high-speed camera, and the header beside it where it has one.
const RECORDINGS: [(&str, Option<&str>); 10] = [
    ("cine/CineFiles.jl/12bpp.cine", None),
    ("cine/CineFiles.jl/8bpp.cine", None),
    ("cine/CineFiles.jl/packed_10.cine", None),
    ("cine/DICe/packed_12bpp.cine", None),
    ("cine/DICe/phantom_v1610.cine", None),
    ("cine/DICe/phantom_v1610_16bpp.cine", None),
    ("cine/DICe/phantom_v9_raw_16bpp.cine", None),
    ("cine/pims/cine_legacy.cine", None),
    ("mraw/pyMRAW/beam.mraw", Some("mraw/pyMRAW/beam.cihx")),
    ("mraw/pyidi/data_showcase.mraw", Some("mraw/pyidi/data_showcase.cih")),
];

#[test]
fn every_recording_is_inspected_whole_and_refused_when_cut() {
    let Some(data) = reference_data("") else { return };
    let folder = TempDir::new().expect("a temporary folder can be made");
    let points = folder.path().join("points.csv");
    std::fs::write(&points, "name,x_px,y_px,half_width_px,half_height_px\na,60,8,6,4\n").expect("a table");
    for (name, header) in RECORDINGS {
        inspected(&data.join(name));
        let bytes = std::fs::read(data.join(name)).expect("the recording can be read");
        let cut = folder.path().join(Path::new(name).file_name().expect("a file"));
        if let Some(header) = header {
            let beside = cut.with_extension(Path::new(header).extension().expect("an ending"));
            std::fs::copy(data.join(header), beside).expect("the header can be copied");
        }
        // In the header, among the tables, amid the frames, and just before the end.
        for n_kept in [2, 40, 3000, bytes.len() / 2, bytes.len() - 1] {
            std::fs::write(&cut, &bytes[..n_kept]).expect("the cut recording can be written");
            let mut track = chainwave();
            track.arg("track").arg(&cut).arg("--points").arg(&points);
            track.arg("--out").arg(folder.path().join("tracks.csv"));
            for command in [chainwave().arg("inspect").arg(&cut), &mut track] {
                let said = fail(command, 2);
                let file = cut.display().to_string();
                assert!(
                    said.contains(&file) && said.contains("byte"),
                    "{name} cut to {n_kept} bytes: {said}"
                );
            }
        }
    }
}

/// What `inspect --json` says, with all the keys that it must have.
fn inspected(recording: &Path) -> Value {
    let printed = succeed(chainwave().arg("inspect").arg(recording).arg("--json"));
    let facts: Value = serde_json::from_str(&printed).expect("inspect --json prints JSON");
    for key in KEYS {
        assert!(facts.get(key).is_some(), "{key} is missing: {printed}");
    }
    facts
}

#[test]
fn a_frame_is_written_as_it_was_recorded() {
    let (Some(recording), Some(exported)) = (v1211("12bpp.cine"), v1211("12bpp.tif")) else { return };
    let folder = TempDir::new().expect("a temporary folder can be made");
    let written = folder.path().join("frame.tif");
    succeed(chainwave().arg("inspect").arg(recording).args(["--frame", "0", "--out"]).arg(&written));
    let (counts, picture) = (gray_16(&written), gray_16(&exported));
    assert_eq!(counts.0, (128, 16));
    assert_eq!(picture.0, (128, 16));
    for (index, (count, exported)) in counts.1.iter().zip(&picture.1).enumerate() {
        // The vendor's export takes black (64) to 0 and white (4064) to full scale, adds the header's offset of -0.0043 of it,
        // and fills 16 bits. Its rounding is not published and costs up to two steps; a wrong row order costs hundreds.
        let expected = ((f64::from(*count) - 64.0) * 4095.0 / 4000.0 - 0.0043 * 4095.0).max(0.0);
        let found = f64::from(*exported) / 16.0;
        assert!((expected - found).abs() <= 2.0, "pixel {index}: count {count}, exported {found}");
    }
}

/// A file of the real Phantom v1211.
fn v1211(name: &str) -> Option<PathBuf> {
    reference_data("cine/CineFiles.jl").map(|folder| folder.join(name))
}

/// Size and values of a TIFF picture.
fn gray_16(path: &Path) -> ((u32, u32), Vec<u16>) {
    let file = File::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut decoder = Decoder::new(file).expect("it is a TIFF file");
    let size = decoder.dimensions().expect("a picture has a size");
    match decoder.read_image().expect("the picture can be decoded") {
        DecodingResult::U16(values) => (size, values),
        _ => panic!("{}: expected 16-bit gray", path.display()),
    }
}
