//! Damaged files: an error that names file and place, or the undamaged pixels; never a panic.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;

use chainwave_camera::{CameraError, open};
use chainwave_measurement::Region;

use crate::writer::{CineFile, GRAY_8, GRAY_16, P10, P12L, codes, written};

const HEADER_IMAGE_COUNT: usize = 0x14;
const HEADER_BITMAP: usize = 0x18;
const HEADER_SETUP: usize = 0x1C;
const HEADER_POINTERS: usize = 0x20;
const WIDTH: usize = 44 + 4;
const HEIGHT: usize = 44 + 8;
const SETUP: usize = 84;
const FIRST_BLOCK: usize = SETUP + 0x640;

fn files() -> Vec<CineFile> {
    [(GRAY_8, 0), (GRAY_16, 1), (P10, 0), (P12L, 1)]
        .map(|(storage, version)| CineFile {
            storage,
            version,
            frames: vec![codes(64, 255, 1), codes(64, 255, 2)],
            ..CineFile::default()
        })
        .into()
}

/// Opens the file and reads all its frames, whatever they say.
fn read_all(path: &Path) -> Result<(), CameraError> {
    let recording = open(path)?;
    let info = recording.info();
    assert!(info.times_s.len() == info.n_frames && info.times_s.iter().all(|time_s| time_s.is_finite()));
    let region = Region::whole(info.width_px, info.height_px);
    let mut pixels = vec![0.0; region.n_pixels()];
    for frame in 0..info.n_frames {
        if let Err(error) = recording.read_region(frame, region, &mut pixels) {
            assert!(error.to_string().contains("at byte"), "{error}");
        }
    }
    Ok(())
}

fn assert_names_the_place(error: &CameraError) {
    let message = error.to_string();
    let has_place = message.contains("byte") || !matches!(error, CameraError::Malformed { .. });
    assert!(message.contains("recording.bin") && has_place, "{message}");
}

/// Whether a byte is one of the many zeros of the Setup block, of which a sample will do.
fn is_filling(bytes: &[u8], at: usize) -> bool {
    (SETUP..FIRST_BLOCK).contains(&at) && bytes[at] == 0 && !at.is_multiple_of(37)
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    for file in files() {
        let bytes = file.bytes();
        let (_folder, path) = written(&bytes);
        read_all(&path).unwrap();
        let on_disk = File::options().write(true).open(&path).unwrap();
        for length in (0..bytes.len()).rev().filter(|&length| !is_filling(&bytes, length)) {
            on_disk.set_len(length as u64).unwrap();
            let error = read_all(&path).expect_err("a file cut short should be refused");
            assert_names_the_place(&error);
        }
    }
}

#[test]
fn any_damaged_byte_gives_an_error_or_a_readable_recording() {
    for file in files() {
        let bytes = file.bytes();
        let (_folder, path) = written(&bytes);
        let on_disk = File::options().write(true).open(&path).unwrap();
        for at in (0..bytes.len()).filter(|&at| !is_filling(&bytes, at)) {
            for damage in [0x01, 0x80, 0xFF] {
                on_disk.write_all_at(&[bytes[at] ^ damage], at as u64).unwrap();
                read_all(&path).unwrap_or_else(|error| assert_names_the_place(&error));
            }
            on_disk.write_all_at(&bytes[at..=at], at as u64).unwrap();
        }
        read_all(&path).unwrap();
    }
}

#[test]
fn absurd_sizes_and_offsets_are_refused_at_once() {
    let bytes = CineFile::default().bytes();
    let fields =
        [HEADER_IMAGE_COUNT, HEADER_BITMAP, HEADER_SETUP, HEADER_POINTERS, WIDTH, HEIGHT, WIDTH + 0x10];
    for at in fields {
        for value in [0, 0x7FFF_FFFF, 0x8000_0000, u32::MAX] {
            let mut damaged = bytes.clone();
            damaged[at..at + 4].copy_from_slice(&value.to_le_bytes());
            let (_folder, path) = written(&damaged);
            // A size of up to 4 GB per image would take minutes or memory here if it were believed.
            let error =
                open(&path).err().unwrap_or_else(|| panic!("{value:#X} at {at:#X} should be refused"));
            assert_names_the_place(&error);
        }
    }
}

#[test]
fn a_block_list_that_does_not_advance_is_left_and_the_pixels_are_read() {
    for size in [0_u32, 7, 1 << 20, 0x7FFF_FFFF, 0x8000_0000, u32::MAX] {
        let mut bytes = CineFile::default().bytes();
        bytes[FIRST_BLOCK..FIRST_BLOCK + 4].copy_from_slice(&size.to_le_bytes());
        let (_folder, path) = written(&bytes);
        let recording = open(&path).unwrap();
        let warnings = recording.info().warnings.join("\n");
        assert!(
            warnings.contains(&format!("at byte {FIRST_BLOCK}")) && warnings.contains("no time stamps"),
            "{warnings}"
        );
        read_all(&path).unwrap();
    }
    // Nothing but zeros.
    let mut bytes = CineFile { stamps: Some(vec![0; 20_000]), ..CineFile::default() }.bytes();
    bytes[FIRST_BLOCK..FIRST_BLOCK + 8].fill(0);
    let (_folder, path) = written(&bytes);
    let warnings = open(&path).unwrap().info().warnings.join("\n");
    assert!(warnings.contains(&format!("at byte {FIRST_BLOCK}: expected a size of 8")), "{warnings}");
}
