//! Any text as the Photron header beside a folder of images, whose rate and trigger are taken from it.
#![no_main]

use std::sync::LazyLock;

use chainwave_camera::open;
use libfuzzer_sys::fuzz_target;
use tempfile::TempDir;

/// Three graymaps of one pixel.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a folder for the images");
    for number in [1, 2, 3] {
        let path = folder.path().join(format!("shot{number}.pgm"));
        std::fs::write(path, b"P5 1 1 255 x").expect("the folder can be written to");
    }
    folder
});

fuzz_target!(|bytes: &[u8]| {
    let header = [b"#Camera Information Header\n".as_slice(), bytes].concat();
    std::fs::write(FOLDER.path().join("shot.cih"), header).expect("the folder can be written to");
    if let Ok(recording) = open(FOLDER.path()) {
        let info = recording.info();
        assert!(info.n_frames == 3 && info.times_s.iter().all(|time_s| time_s.is_finite()), "{info:?}");
        assert!(info.rate_hz.is_none_or(|rate_hz| rate_hz.is_finite() && rate_hz > 0.0), "{info:?}");
    }
});
