//! Damaged images, stacks, arrays and .mraw headers: an error, or the undamaged pixels; never a panic or a large
//! allocation.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;

use chainwave_camera::open;
use chainwave_measurement::Region;
use tiff::encoder::Compression;

use crate::allocation::largest_during;
use crate::images::{bmp_bytes, gray_png, gray_tiff, npy_bytes};
use crate::jpeg_writer::jpeg_bytes;
use crate::mraw::MrawFile;
use crate::property::{read_all, try_everything};
use crate::recordings::pgm_bytes;
use crate::tiff_writer::TiffFile;
use crate::writer::{CineFile, codes, written};

const WIDTH: usize = 16;
const HEIGHT: usize = 6;

/// No sample exceeds 6 kB; compressed ones may say that they expand by some hundred times.
const MOST_ALLOCATED: usize = 32 << 20;

fn frames() -> Vec<Vec<u16>> {
    (0..2).map(|seed| codes(WIDTH * HEIGHT, 255, seed)).collect()
}

/// A small file of each kind that is whole by itself.
fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let plain = || TiffFile::new(WIDTH, HEIGHT, frames());
    let npy = "{'descr': '<u2', 'fortran_order': False, 'shape': (2, 6, 16), }\n";
    let pixels: Vec<u8> = frames().concat().iter().flat_map(|code| code.to_le_bytes()).collect();
    let imagej = Some("ImageJ=1.53t\nimages=2\nfinterval=0.1\n".into());
    vec![
        ("tiff", plain().bytes()),
        ("big tiff", TiffFile { is_big: true, high_byte_first: true, bits: 12, ..plain() }.bytes()),
        ("tiff in strips", TiffFile { rows_per_strip: 4, gap_bytes: 3, bits: 8, ..plain() }.bytes()),
        ("ImageJ tiff", TiffFile { n_directories: 1, description: imagej, ..plain() }.bytes()),
        ("tiff LZW", gray_tiff(Compression::Lzw, &frames())),
        ("tiff deflate", gray_tiff(Compression::Deflate(Default::default()), &frames())),
        ("tiff PackBits", gray_tiff(Compression::Packbits, &frames())),
        ("png", gray_png(&frames()[0], 16)),
        ("bmp", bmp_bytes((WIDTH, HEIGHT), &frames()[0], 8, false, |index| index)),
        ("bmp 24", bmp_bytes((WIDTH, HEIGHT), &frames()[0], 24, true, |index| index)),
        ("npy", npy_bytes(npy, &pixels)),
        ("jpeg", jpeg_bytes((3, 2), &[frames()[0][..6].iter().map(|&code| code as u8).collect()])),
        ("jpeg in colours", jpeg_bytes((2, 1), &[vec![7, 200], vec![128; 2], vec![128; 2]])),
        ("pgm", pgm_bytes("P5", (WIDTH, HEIGHT), 4095, &frames()[0])),
        ("pgm of bytes", pgm_bytes("P5", (WIDTH, HEIGHT), 255, &frames()[0])),
        ("pgm of numbers", pgm_bytes("P2", (WIDTH, HEIGHT), 255, &frames()[0])),
    ]
}

fn all_pixels(path: &Path) -> Result<Vec<f32>, String> {
    let recording = open(path).map_err(|error| error.to_string())?;
    let region = Region::whole(recording.info().width_px, recording.info().height_px);
    let mut all = Vec::new();
    for frame in 0..recording.info().n_frames {
        let mut pixels = vec![f32::NAN; region.n_pixels()];
        recording.read_region(frame, region, &mut pixels).map_err(|error| error.to_string())?;
        all.extend(pixels);
    }
    Ok(all)
}

#[test]
fn a_file_cut_anywhere_is_refused_or_whole() {
    for (name, bytes) in samples() {
        let (_folder, path) = written(&bytes);
        let whole = all_pixels(&path).unwrap();
        let on_disk = File::options().write(true).open(&path).unwrap();
        for length in (0..bytes.len()).rev() {
            on_disk.set_len(length as u64).unwrap();
            match all_pixels(&path) {
                // What ends a compressed file holds no pixels.
                Ok(pixels) => assert_eq!(pixels, whole, "{name} cut to {length} of {} bytes", bytes.len()),
                Err(message) => assert!(message.contains("recording.bin"), "{name}: {message}"),
            }
        }
    }
}

#[test]
fn any_damaged_byte_gives_an_error_or_a_readable_recording() {
    for (name, bytes) in samples() {
        let (_folder, path) = written(&bytes);
        let on_disk = File::options().write(true).open(&path).unwrap();
        for at in 0..bytes.len() {
            for damage in [0x01, 0x10, 0x80, 0xFF] {
                on_disk.write_all_at(&[bytes[at] ^ damage], at as u64).unwrap();
                let largest = largest_during(|| drop(read_all(&path)));
                assert!(largest < MOST_ALLOCATED, "{name}: {largest} bytes for byte {at} ^ {damage:#X}");
            }
            on_disk.write_all_at(&bytes[at..=at], at as u64).unwrap();
        }
        read_all(&path).unwrap();
    }
}

#[test]
fn absurd_numbers_anywhere_are_not_believed() {
    for (name, bytes) in samples() {
        let (_folder, path) = written(&bytes);
        let on_disk = File::options().write(true).open(&path).unwrap();
        for at in 0..bytes.len().saturating_sub(4) {
            for value in [0_u32, 0x7FFF_FFFF, 0x8000_0000, u32::MAX, bytes.len() as u32] {
                on_disk.write_all_at(&value.to_ne_bytes(), at as u64).unwrap();
                let largest = largest_during(|| drop(read_all(&path)));
                assert!(largest < MOST_ALLOCATED, "{name}: {largest} bytes for {value:#X} at {at}");
            }
            on_disk.write_all_at(&bytes[at..at + 4], at as u64).unwrap();
        }
    }
}

#[test]
fn a_list_of_images_that_returns_to_its_start_ends_in_an_error() {
    let mut bytes = TiffFile::new(WIDTH, HEIGHT, frames()).bytes();
    let first: [u8; 4] = *bytes[4..].first_chunk().unwrap();
    let end = bytes.len() - 4;
    bytes[end..].copy_from_slice(&first);
    let (_folder, path) = written(&bytes);
    let message = open(&path).err().unwrap().to_string();
    assert!(message.contains("each directory once"), "{message}");
}

#[test]
fn a_damaged_mraw_header_gives_an_error_or_a_readable_recording() {
    let file = MrawFile::default();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("shot.mraw"), file.pixels()).unwrap();
    for (extension, bytes) in [("cih", file.cih().into_bytes()), ("cihx", file.cihx())] {
        let path = folder.path().join("shot").with_extension(extension);
        std::fs::write(&path, &bytes).unwrap();
        let on_disk = File::options().write(true).open(&path).unwrap();
        for at in 0..bytes.len() {
            for damage in [0x01, 0x10, 0x80, 0xFF] {
                on_disk.write_all_at(&[bytes[at] ^ damage], at as u64).unwrap();
                let largest = largest_during(|| drop(all_pixels(&path)));
                assert!(largest < MOST_ALLOCATED, "{extension}: {largest} bytes for byte {at}");
            }
            on_disk.write_all_at(&bytes[at..=at], at as u64).unwrap();
        }
        assert!(all_pixels(&path).is_ok());
        for length in (0..bytes.len()).rev() {
            on_disk.set_len(length as u64).unwrap();
            drop(all_pixels(&path));
        }
        std::fs::remove_file(&path).unwrap();
    }
}

#[test]
fn a_mraw_cut_anywhere_is_refused() {
    let file = MrawFile::default();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shot.mraw");
    std::fs::write(folder.path().join("shot.cih"), file.cih()).unwrap();
    for length in 0..file.pixels().len() {
        std::fs::write(&path, &file.pixels()[..length]).unwrap();
        assert!(all_pixels(&path).err().unwrap().contains("shot.mraw"), "{length}");
    }
}

/// The fuzzer's property on stable: several random changes at once. `CHAINWAVE_HOSTILE_ROUNDS` asks for more of them.
#[test]
fn random_damage_gives_errors_or_readable_recordings() {
    let n_rounds = std::env::var("CHAINWAVE_HOSTILE_ROUNDS").ok().and_then(|text| text.parse().ok());
    let mut seeds = samples();
    seeds.push(("cine", CineFile::default().bytes()));
    seeds.push(("cih", MrawFile::default().cih().into_bytes()));
    seeds.push(("cihx", MrawFile::default().cihx()));
    let folder = tempfile::tempdir().unwrap();
    let mut state = 12_345_u64;
    let mut random = |n: usize| {
        // Knuth's MMIX generator; its high bits are the random ones.
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    for _ in 0..n_rounds.unwrap_or(300) {
        let mut bytes = seeds[random(seeds.len())].1.clone();
        for _ in 0..=random(6) {
            let at = random(bytes.len());
            match random(5) {
                0 => bytes[at] ^= 1 << random(8),
                1 => bytes[at] = [0, 1, 0x7F, 0x80, 0xFF][random(5)],
                2 => bytes.truncate(at.max(1)),
                3 => drop(bytes.splice(at..(at + random(8)).min(bytes.len()), [])),
                _ => bytes.insert(at, random(256) as u8),
            }
            if bytes.is_empty() {
                bytes.push(0);
            }
        }
        let largest = largest_during(|| try_everything(folder.path(), &bytes));
        assert!(largest < MOST_ALLOCATED, "{largest} bytes for {bytes:02X?}");
    }
}

#[test]
fn a_text_of_more_pixels_than_can_be_counted_is_refused() {
    // Twice the number of its pixels is 2^16 beyond 2^64.
    let text = format!("P2 4294901761 2147516416 255\n{}", "1 ".repeat(40_000));
    let (_folder, path) = written(text.as_bytes());
    assert!(open(&path).is_err());
}
