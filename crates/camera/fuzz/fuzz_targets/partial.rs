//! Any bytes, opened as the part of a recording that somebody asks for, or as pixels of a geometry that the bytes state themselves.
#![no_main]

use std::sync::LazyLock;

use chainwave_camera::{OpenOptions, RawGeometry, open_with};
use chainwave_measurement::Region;
use libfuzzer_sys::fuzz_target;
use tempfile::TempDir;

static FOLDER: LazyLock<TempDir> =
    LazyLock::new(|| tempfile::tempdir().expect("a folder for the recordings"));

/// Columns and rows at most of a frame that is read as a whole.
const MOST_SIDE_PX: usize = 2048;

fuzz_target!(|bytes: &[u8]| {
    // The first line states the geometry.
    let line = bytes.split(|&byte| byte == b'\n').next().unwrap_or_default();
    let geometry: Option<RawGeometry> = String::from_utf8_lossy(line).parse().ok();
    let path = FOLDER.path().join("recording.bin");
    std::fs::write(&path, bytes).expect("the folder can be written to");
    for raw in [None, geometry] {
        let options = OpenOptions { partial: true, raw, ..OpenOptions::default() };
        let Ok(recording) = open_with(&path, &options) else { continue };
        let info = recording.info();
        assert_eq!(info.times_s.len(), info.n_frames);
        let region = Region::whole(info.width_px.min(MOST_SIDE_PX), info.height_px.min(MOST_SIDE_PX));
        let mut pixels = vec![0.0; region.n_pixels()];
        // The last frame of a part is the one that may not be whole.
        let _ = recording.read_region(info.n_frames - 1, region, &mut pixels);
    }
});
