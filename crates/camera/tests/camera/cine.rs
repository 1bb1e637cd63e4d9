//! Files of known content, read back.

use std::fs;

use chainwave_camera::{CameraError, OpenOptions, open, open_with};
use chainwave_measurement::{ReadError, Recording, Region};

use crate::common::{frame, has_warning};
use crate::writer::{CineFile, GRAY_8, GRAY_16, P10, P12L, codes, stamps, written};

fn opened(file: &CineFile) -> Box<dyn Recording> {
    let (_folder, path) = file.write();
    open(&path).unwrap()
}

fn refusal(file: &CineFile) -> CameraError {
    let (_folder, path) = file.write();
    open(&path).err().expect("the file should be refused")
}

#[test]
fn every_packing_gives_back_its_counts_and_names_itself() {
    let cases =
        [(GRAY_8, 255, "cine 8 bit", 8), (GRAY_16, 4095, "cine 16 bit", 12), (P12L, 4095, "cine P12L", 12)];
    for (storage, high, name, bit_depth) in cases {
        for version in [0, 1] {
            let frames = vec![codes(64, high, 1), codes(64, high, 2)];
            let file = CineFile { version, storage, frames: frames.clone(), ..CineFile::default() };
            let recording = opened(&file);
            assert_eq!((recording.info().format.as_str(), recording.info().bit_depth), (name, bit_depth));
            assert_eq!(recording.info().warnings, [""; 0]);
            for (index, codes) in frames.iter().enumerate() {
                let expected: Vec<f32> = codes.iter().map(|&code| code.into()).collect();
                assert_eq!(frame(&*recording, index), expected, "{name}, version {version}");
            }
        }
    }
}

#[test]
fn p10_is_linearised_to_twelve_bits() {
    let mut codes = vec![0; 64];
    codes[1] = 64;
    codes[17] = 1014;
    codes[63] = 1023;
    let recording =
        opened(&CineFile { storage: P10, frames: vec![codes.clone(), codes], ..CineFile::default() });
    let pixels = frame(&*recording, 1);
    assert_eq!((pixels[0], pixels[1], pixels[17], pixels[63]), (2.0, 64.0, 4064.0, 4095.0));
    assert_eq!((recording.info().format.as_str(), recording.info().bit_depth), ("cine P10", 12));
    assert!(has_warning(&*recording, "linearised"));
}

#[test]
fn any_region_is_the_same_part_of_the_whole_frame() {
    for storage in [GRAY_8, GRAY_16, P10, P12L] {
        let high = if storage == P10 { 1023 } else { 255 };
        let recording = opened(&CineFile {
            storage,
            frames: vec![codes(64, high, 5), codes(64, high, 6)],
            ..CineFile::default()
        });
        let whole = frame(&*recording, 1);
        for x in 0..16 {
            for width in 1..=16 - x {
                let region = Region { x, y: 1, width, height: 2 };
                let mut pixels = vec![f32::NAN; region.n_pixels()];
                recording.read_region(1, region, &mut pixels).unwrap();
                let expected: Vec<f32> =
                    (1..3).flat_map(|y| whole[16 * y + x..16 * y + x + width].to_vec()).collect();
                assert_eq!(pixels, expected, "{storage:?} {region:?}");
            }
        }
    }
}

#[test]
fn requests_outside_are_refused() {
    let recording = opened(&CineFile::default());
    let mut pixels = [0.0; 4];
    let mut request = |frame, x, width| {
        recording.read_region(frame, Region { x, y: 0, width, height: 1 }, &mut pixels).unwrap_err()
    };
    assert!(matches!(request(2, 0, 4), ReadError::FrameOutside { .. }));
    assert!(matches!(request(0, 13, 4), ReadError::RegionOutside { .. }));
    assert!(matches!(request(0, usize::MAX, 4), ReadError::RegionOutside { .. }));
    assert!(matches!(request(0, 0, 3), ReadError::BufferSize { .. }));
    assert!(recording.read_region(0, Region { x: 3, y: 3, width: 0, height: 0 }, &mut []).is_ok());
}

#[test]
fn annotations_shift_the_pixels_and_garbage_size_words_do_not() {
    let file =
        CineFile { annotation: b"struck hard".to_vec(), size_word: Some(0xE400_5000), ..CineFile::default() };
    let recording = opened(&file);
    let expected: Vec<f32> = file.frames[1].iter().map(|&code| code.into()).collect();
    assert_eq!(frame(&*recording, 1), expected);
    assert!(has_warning(&*recording, "size word"));
}

#[test]
fn times_rate_and_exposure_come_from_the_tagged_blocks() {
    let n = 200;
    let file = CineFile {
        first_image: -100,
        frames: vec![codes(64, 4095, 3); n],
        stamps: Some(stamps(-100, n, 460_000.0)),
        exposures: Some(vec![7004; n]),
        ..CineFile::default()
    }
    .field(0x300, &460_000_u32.to_le_bytes());
    let recording = opened(&file);
    let info = recording.info();
    assert_eq!((info.first_image, info.n_frames, info.times_s.len()), (-100, n, n));
    // Stamps are multiples of 2^-32 s whose two lowest bits are flags: each is late or early by less than 1 ns.
    for (index, time_s) in info.times_s.iter().enumerate() {
        let expected_s = (index as f64 - 100.0) / 460_000.0;
        assert!((time_s - expected_s).abs() < 1e-9, "frame {index}: {time_s} {expected_s}");
    }
    // 1 ns over 199 intervals of 2.17 us.
    assert!((info.rate_hz.unwrap() / 460_000.0 - 1.0).abs() < 1e-9 / (199.0 * 2.17e-6));
    assert_eq!(info.exposure_s, Some(7004.0 / 4_294_967_296.0));
    assert_eq!(info.warnings, [""; 0]);
}

#[test]
fn time_stamps_of_the_whole_memory_are_read_from_the_first_saved_image_on() {
    // The writer's camera held images from -5 on, of which the file begins with -1.
    let old = |n: usize| CineFile {
        stamps: Some(stamps(-5, n, 10_000.0)),
        stamp_block: 1001,
        ..CineFile::default()
    };
    let (_folder, path) = old(1000).write();
    let (_other, new) = CineFile::default().write();
    assert_eq!(open(&path).unwrap().info().times_s, open(&new).unwrap().info().times_s);
    let (_folder, path) = old(5).write();
    assert!(has_warning(&*open(&path).unwrap(), "no time stamps"));
}

#[test]
fn without_time_stamps_image_numbers_and_the_stated_rate_give_the_times() {
    let file = CineFile { stamps: None, exposures: None, ..CineFile::default() };
    let recording = opened(&file);
    let info = recording.info();
    assert_eq!((info.times_s.as_slice(), info.rate_hz), ([-1e-4, 0.0].as_slice(), Some(10_000.0)));
    assert!((info.exposure_s.unwrap() - 99e-6).abs() < 1e-15);
    assert!(has_warning(&*recording, "no time stamps"));

    let nothing = CineFile { setup_length: 0x100, stamps: None, ..CineFile::default() };
    assert!(refusal(&nothing).to_string().contains("expected time stamps or a frame rate"));
}

#[test]
fn blocks_of_too_few_entries_are_left_out_and_named() {
    let whole = CineFile::default();
    let short = CineFile {
        stamps: whole.stamps.as_ref().map(|all| all[1..].to_vec()),
        exposures: Some(vec![425_201]),
        ..CineFile::default()
    };
    let recording = opened(&short);
    for part in ["time stamps at byte", "exposures at byte", "no time stamps"] {
        assert!(has_warning(&*recording, part), "{part}: {:?}", recording.info().warnings);
    }
    assert_eq!(recording.info().n_frames, opened(&whole).info().n_frames);
}

#[test]
fn padding_between_tagged_blocks_is_passed_over() {
    let whole = opened(&CineFile::default());
    for padding in [4, 12] {
        let padded = opened(&CineFile { padding: vec![0; padding], ..CineFile::default() });
        let (found, right) = (padded.info(), whole.info());
        assert_eq!((&found.times_s, found.exposure_s), (&right.times_s, right.exposure_s));
        assert!(has_warning(&*padded, &format!("{padding} zero bytes at byte ")), "{:?}", found.warnings);
        assert_eq!(frame(&*padded, 1), frame(&*whole, 1));
    }
    // What is no padding ends the blocks: the stamps are before it, the exposures behind.
    let odd = opened(&CineFile { padding: vec![9, 0, 0, 0], ..CineFile::default() });
    assert_eq!(odd.info().times_s, whole.info().times_s);
    assert!(has_warning(&*odd, "are left out"), "{:?}", odd.info().warnings);
    // The exposure is the header's.
    assert!((odd.info().exposure_s.unwrap() - 99e-6).abs() < 1e-15);
}

#[test]
fn a_setup_field_exists_only_within_the_length() {
    let rate = 12_345.5_f64;
    for (setup_length, camera, rate_hz) in [
        (0x2890_u16, Some("Phantom v1211"), 10_000.0),
        (0x288F, None, 10_000.0),
        (0x28A7, Some("Phantom v1211"), 1_000.0),
        (0x28A8, Some("Phantom v1211"), 1_234.55),
    ] {
        let file = CineFile { setup_length, stamps: None, ..CineFile::default() }
            .field(0x2790, &[b"Phantom v1211".as_slice(), &[0; 243]].concat())
            .field(0x2894, &10_f32.to_le_bytes())
            .field(0x28A0, &rate.to_le_bytes());
        let recording = opened(&file);
        assert_eq!(recording.info().camera.as_deref(), camera, "length {setup_length:#X}");
        assert_eq!(recording.info().rate_hz, Some(rate_hz), "length {setup_length:#X}");
    }
}

#[test]
fn a_decimated_recording_warns_that_its_header_states_another_rate() {
    let n = 20;
    let file = CineFile {
        setup_length: 0x28A8,
        frames: vec![codes(64, 4095, 1); n],
        stamps: Some(stamps(-1, n, 5_000.0)),
        exposures: None,
        ..CineFile::default()
    }
    .field(0x2894, &10_f32.to_le_bytes())
    .field(0x2786, &256_u16.to_le_bytes());
    let recording = opened(&file);
    assert!((recording.info().rate_hz.unwrap() - 5_000.0).abs() < 1e-3);
    for part in ["states 1000 Hz", "one image in 10", "companded to 10 bits"] {
        assert!(has_warning(&*recording, part), "{part}: {:?}", recording.info().warnings);
    }
}

#[test]
fn a_given_rate_that_the_files_clock_contradicts_is_not_used_and_that_is_said() {
    let n = 20;
    let frames = vec![codes(64, 4095, 1); n];
    let file = CineFile { frames, stamps: Some(stamps(-1, n, 5_000.0)), ..CineFile::default() };
    let (_folder, path) = file.write();
    let at = |rate_hz| {
        open_with(&path, &OpenOptions { rate_hz: Some(rate_hz), ..OpenOptions::default() }).unwrap()
    };
    let told = "the given rate of 1000 Hz is not used";
    assert!(has_warning(&*at(1_000.0), told) && !has_warning(&*at(5_000.0), "is not used"));
    assert!((at(1_000.0).info().rate_hz.unwrap() - 5_000.0).abs() < 1e-3);
}

#[test]
fn a_dummy_last_frame_is_named_and_leaves_rate_and_exposure_alone() {
    let n = 20;
    let mut stamps = stamps(-1, n, 10_000.0);
    stamps[n - 1] += 25_280_568 << 32;
    let mut exposures = vec![425_201; n];
    exposures[n - 1] = 281_320_000;
    let frames = vec![codes(64, 4095, 1); n];
    let file = CineFile { frames, stamps: Some(stamps), exposures: Some(exposures), ..CineFile::default() };
    let recording = opened(&file);
    // 1 ns over 18 intervals of 100 us.
    assert!((recording.info().rate_hz.unwrap() / 10_000.0 - 1.0).abs() < 1e-6);
    assert!((recording.info().exposure_s.unwrap() - 99e-6).abs() < 1e-9);
    assert!(has_warning(&*recording, "frame 19, the last, looks like a dummy"));
    assert!(has_warning(&*recording, "frame 19 lies 25280568"));
}

#[test]
fn one_bad_time_stamp_leaves_the_others_their_times() {
    let n = 20;
    let right = stamps(-1, n, 10_000.0);
    let with = |bad: u64| {
        let mut stamps = right.clone();
        stamps[7] = bad;
        opened(&CineFile {
            frames: vec![codes(64, 4095, 1); n],
            stamps: Some(stamps),
            exposures: None,
            ..CineFile::default()
        })
    };
    let usual = with(right[7]);
    for bad in [0, right[7] + (3600 << 32)] {
        let recording = with(bad);
        let info = recording.info();
        assert!(has_warning(&*recording, "frame 7 ("), "{:?}", info.warnings);
        for (time_s, right_s) in info.times_s.iter().zip(&usual.info().times_s) {
            // Stamps are multiples of 2^-32 s whose two lowest bits are flags.
            assert!((time_s - right_s).abs() < 1e-9, "{time_s} {right_s}");
        }
        assert!((info.rate_hz.unwrap() / 10_000.0 - 1.0).abs() < 1e-6);
        assert_eq!(info.warnings.len(), 1, "{:?}", info.warnings);
    }
}

#[test]
fn counts_above_the_stated_depth_are_named_and_all_bits_taken() {
    let plain = opened(&CineFile::default());
    assert_eq!((plain.info().bit_depth, plain.info().warnings.len()), (12, 0));
    for annotation in [Vec::new(), b"struck hard".to_vec()] {
        let mut frames = CineFile::default().frames;
        frames[0][37] = 4096;
        let deep = opened(&CineFile { frames, annotation, ..CineFile::default() });
        assert_eq!((deep.info().bit_depth, frame(&*deep, 0)[37]), (16, 4096.0));
        assert!(has_warning(
            &*deep,
            "12 bits are stated, but pixels of the first frame have counts up to 4096"
        ));
        assert_eq!(deep.info().warnings.len(), 1, "{:?}", deep.info().warnings);
    }
}

#[test]
fn contradictions_between_numbers_and_times_are_named() {
    let far = CineFile { first_image: 238_292, ..CineFile::default() };
    assert!(has_warning(&*opened(&far), "first image is number 238292"));

    let years = stamps(-1, 2, 10_000.0).iter().map(|stamp| stamp - (441_000_000_u64 << 32)).collect();
    let early = CineFile { stamps: Some(years), ..CineFile::default() };
    assert!(has_warning(&*opened(&early), "more than a day"));

    let still = CineFile { stamps: Some(vec![stamps(-1, 1, 1.0)[0]; 2]), ..CineFile::default() };
    assert!(has_warning(&*opened(&still), "do not increase"));
    assert_eq!(opened(&still).info().times_s, [-1e-4, 0.0]);

    let turned = CineFile::default().field(0x2F8, &1_u32.to_le_bytes());
    assert!(has_warning(&*opened(&turned), "not applied to pixels: vertical flip"));

    let short = CineFile { setup_length: 0x380, ..CineFile::default() };
    assert!(has_warning(&*opened(&short), "no number of significant bits; 12 are assumed"));
}

#[test]
fn what_is_not_plain_gray_is_refused_with_its_reason() {
    let mosaic = CineFile { compression: 2, ..CineFile::default() }.field(0x328, &3_u32.to_le_bytes());
    assert!(
        matches!(refusal(&mosaic), CameraError::Colour { reason, .. } if reason.contains("colour filter 3"))
    );
    for bits in [24, 48] {
        let colour = CineFile { storage: (bits, 0), ..CineFile::default() };
        assert!(matches!(refusal(&colour), CameraError::Colour { .. }));
    }
    for file in [
        CineFile { compression: 1, ..CineFile::default() },
        CineFile { storage: (16, 512), ..CineFile::default() },
        CineFile { storage: (8, 256), ..CineFile::default() },
    ] {
        assert!(matches!(refusal(&file), CameraError::Unsupported { .. }));
    }
}

#[test]
fn a_file_of_another_kind_is_refused_whatever_its_name() {
    for bytes in [b"".as_slice(), b"C", b"\0\0ordinary", b"II+*"] {
        let (folder, _) = written(b"");
        let path = folder.path().join("looks_like.cine");
        fs::write(&path, bytes).unwrap();
        let error = open(&path).err().unwrap();
        assert!(matches!(error, CameraError::UnknownFormat { .. }), "{error}");
        assert!(error.to_string().contains("looks_like.cine") && error.to_string().contains("Phantom"));
    }
    assert!(matches!(open("no/such/file".as_ref()), Err(CameraError::Io { .. })));
}

#[test]
fn frames_beyond_four_gigabytes_are_read() {
    let file = CineFile { gap_bytes: 5 << 30, ..CineFile::default() };
    let (_folder, path) = file.write_sparse();
    let recording = open(&path).unwrap();
    let expected: Vec<f32> = file.frames[1].iter().map(|&code| code.into()).collect();
    assert_eq!(frame(&*recording, 1), expected);
}

/// Two equal pointers in the table: which of two frames lies there is not known, and the others are read.
#[test]
fn frames_in_the_same_place_are_named_and_not_read() {
    let frames: Vec<Vec<u16>> = (1..=4).map(|seed| codes(64, 4095, seed)).collect();
    let file = CineFile {
        stamps: Some(stamps(-1, 4, 10_000.0)),
        exposures: Some(vec![425_201; 4]),
        frames,
        ..CineFile::default()
    };
    let (_folder, path) = file.write();
    let mut bytes = fs::read(&path).unwrap();
    let pointers = u32::from_le_bytes(bytes[0x20..0x24].try_into().unwrap()) as usize;
    let third = pointers + 16..pointers + 24;
    bytes.copy_within(third, pointers + 8);
    fs::write(&path, bytes).unwrap();
    let recording = open(&path).unwrap();
    assert!(has_warning(&*recording, "2 frames lie where others do, the first of them frame 1"));
    let whole = Region::whole(16, 4);
    let mut pixels = vec![0.0; 64];
    let is_read: Vec<bool> =
        (0..4).map(|index| recording.read_region(index, whole, &mut pixels).is_ok()).collect();
    assert_eq!(is_read, [true, false, false, true]);
}
