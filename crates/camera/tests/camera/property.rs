//! What must hold of any bytes whatever; the fuzzer in `fuzz` asks the same.

use std::path::Path;

use chainwave_camera::{CameraError, OpenOptions, open, open_with};
use chainwave_measurement::{Recording, Region};

/// Frames that are read of a file that announces more.
const MOST_FRAMES: usize = 16;
/// Larger frames are read in part, which is all that the time of a test allows.
const MOST_PIXELS: usize = 1 << 22;

/// What a caller may state of any file.
fn statements() -> Vec<OpenOptions> {
    let raw =
        |geometry: &str| OpenOptions { raw: geometry.parse().ok(), partial: true, ..OpenOptions::default() };
    let partial = OpenOptions { partial: true, ..OpenOptions::default() };
    vec![OpenOptions::default(), partial, raw("7x3x8"), raw("5x4x12be"), raw("4x4x10p")]
}

/// Opens a recording and reads its frames: it refuses with an error that names the recording, or what it says of itself
/// is consistent and every frame can be read or is refused.
pub(crate) fn read_all(path: &Path) -> Result<(), CameraError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut plain = Ok(());
    for (index, options) in statements().iter().enumerate() {
        let opened = open_with(path, options)
            .inspect_err(|error| assert!(error.to_string().contains(&name), "{error}"));
        let outcome = opened.map(|recording| read_frames(recording.as_ref()));
        if index == 0 {
            plain = outcome;
        }
    }
    plain
}

fn read_frames(recording: &dyn Recording) {
    let info = recording.info();
    assert!(info.times_s.len() == info.n_frames && info.times_s.iter().all(|time_s| time_s.is_finite()));
    assert!(info.n_frames > 0 && info.width_px > 0 && info.height_px > 0, "{info:?}");
    assert!((1..=16).contains(&info.bit_depth), "{info:?}");
    let height = info.height_px.min(MOST_PIXELS / info.width_px.min(MOST_PIXELS));
    let region = Region { x: 0, y: info.height_px - height, width: info.width_px.min(MOST_PIXELS), height };
    let mut pixels = vec![0.0; region.n_pixels()];
    for frame in 0..info.n_frames.min(MOST_FRAMES) {
        pixels.fill(f32::NAN);
        match recording.read_region(frame, region, &mut pixels) {
            Ok(()) => assert!(pixels.iter().all(|pixel| (0.0..65_536.0).contains(pixel)), "frame {frame}"),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}

/// Gives the bytes to every reader that they could be meant for: as a file by itself, as the two headers of a .mraw, and
/// as the images of a folder.
pub(crate) fn try_everything(folder: &Path, bytes: &[u8]) {
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap_or(folder))
            .and_then(|()| std::fs::write(&path, bytes))
            .expect("the folder can be written to");
        path
    };
    let ignore = |outcome: Result<(), CameraError>| drop(outcome);
    ignore(read_all(&write("recording.bin", bytes)));
    if bytes.starts_with(b"#Cam") || bytes.starts_with(b"!!!") {
        let header = write("pair/shot.cih", bytes);
        write("pair/shot.mraw", &[0x5A; 4096]);
        // Errors of a pair name the header or the pixels, whichever is wrong.
        for path in [header, folder.join("pair/shot.mraw")] {
            ignore(open(&path).map(|recording| read_frames(recording.as_ref())));
        }
    }
    for name in ["images/a1.tif", "images/a3.tif"] {
        write(name, bytes);
    }
    ignore(read_all(&folder.join("images")));
}
