//! What people bring besides whole recordings of the usual kinds: pixels without header, images with a header beside them,
//! compressed and textual images, parts of recordings, and formats that are only named.

use std::path::Path;

use chainwave_camera::{CameraError, OpenOptions, RawGeometry, open, open_raw, open_with};

use crate::common::{as_counts, frame, has_warning};
use crate::images::{gray_png, gray_tiff, npy_bytes};
use crate::jpeg_writer::{jpeg_bytes, with_orientation};
use crate::mraw::MrawFile;
use crate::tiff_writer::TiffFile;
use crate::writer::{CineFile, codes, packed, written};

fn refusal(path: &Path, options: &OpenOptions) -> CameraError {
    open_with(path, options).err().expect("the recording should be refused")
}

fn partial() -> OpenOptions {
    OpenOptions { partial: true, ..OpenOptions::default() }
}

fn raw(geometry: &str) -> OpenOptions {
    OpenOptions { raw: Some(geometry.parse().unwrap()), ..OpenOptions::default() }
}

#[test]
fn pixels_without_header_are_read_by_a_stated_geometry() {
    let little = |code: &u16| code.to_le_bytes();
    let big = |code: &u16| code.to_be_bytes();
    for (geometry, bits) in [
        ("16x6x8", 8),
        ("16x6x12", 12),
        ("16x6x12be", 12),
        ("16x6x16le", 16),
        ("16x6x10p", 10),
        ("16x6x12p", 12),
    ] {
        let high = ((1_u32 << bits) - 1).min(60_000) as u16;
        let frames: Vec<Vec<u16>> = (0..3).map(|seed| codes(96, high, seed)).collect();
        let all = frames.concat();
        let bytes: Vec<u8> = match geometry {
            _ if geometry.ends_with('p') => packed(&all, bits as usize),
            _ if geometry.ends_with("be") => all.iter().flat_map(big).collect(),
            _ if bits == 8 => all.iter().map(|&code| code as u8).collect(),
            _ => all.iter().flat_map(little).collect(),
        };
        // The first bytes of another format do not matter.
        let (_folder, path) = written(&bytes);
        let recording = open_with(&path, &OpenOptions { rate_hz: Some(2000.0), ..raw(geometry) }).unwrap();
        let info = recording.info();
        assert_eq!((info.width_px, info.height_px, info.n_frames, info.bit_depth), (16, 6, 3, bits));
        assert_eq!((info.rate_hz, info.times_s[2]), (Some(2000.0), 2.0 / 2000.0));
        assert!(has_warning(&*recording, "no header"));
        for (index, codes) in frames.iter().enumerate() {
            assert_eq!(frame(&*recording, index), as_counts(codes), "{geometry}");
        }
    }
}

#[test]
fn a_geometry_that_the_file_contradicts_is_refused() {
    let frames = [codes(96, 4095, 1), codes(96, 4095, 2)].concat();
    let bytes: Vec<u8> = frames.iter().flat_map(|code| code.to_le_bytes()).collect();
    let (_folder, path) = written(&bytes);
    for (geometry, part) in [
        ("16x7x12le", "whole number of frames"),
        ("100x100x8", "whole number of frames"),
        ("16x6x12be", "counts up to 4095"),
        ("16x6x9le", "counts up to 511"),
    ] {
        let message = refusal(&path, &raw(geometry)).to_string();
        assert!(message.contains(part) && message.contains("recording.bin"), "{message}");
    }
    let short = OpenOptions { partial: true, ..raw("16x7x12le") };
    let recording = open_with(&path, &short).unwrap();
    assert_eq!(recording.info().n_frames, 1);
    assert!(has_warning(&*recording, "first 1 are whole"));
    let (_folder, empty) = written(b"");
    assert!(open_raw(&empty, "1x1x8".parse::<RawGeometry>().unwrap(), &partial()).is_err());
}

/// Frames of 16 x 4 px, of which the files below hold three.
fn three() -> Vec<Vec<u16>> {
    (0..3).map(|seed| codes(64, 255, seed)).collect()
}

#[test]
fn a_part_of_a_recording_gives_its_whole_frames_when_asked() {
    let frames = three();
    let stamps = Some(crate::writer::stamps(-1, 3, 10_000.0));
    let exposures = Some(vec![425_201; 3]);
    let cine = CineFile {
        frames: frames.clone(),
        stamps,
        exposures,
        annotation: vec![7; 40],
        ..CineFile::default()
    };
    let npy = "{'descr': '|u1', 'fortran_order': False, 'shape': (3, 4, 16), }\n";
    let pixels: Vec<u8> = frames.concat().iter().map(|&code| code as u8).collect();
    for (name, bytes) in [
        ("cine", cine.bytes()),
        ("npy", npy_bytes(npy, &pixels)),
        ("tiff", tiff_of_a_stream(&frames, None)),
        ("ImageJ", tiff_of_a_stream(&frames, Some("ImageJ=1.53t\nimages=3\nfinterval=0.1\n\0"))),
    ] {
        let (_folder, path) = written(&bytes);
        let whole = open_with(&path, &partial()).unwrap();
        assert_eq!(whole.info().n_frames, 3, "{name}");
        assert_eq!(whole.info().warnings, open(&path).unwrap().info().warnings, "{name}");
        let mut n_before = 3;
        for length in (0..bytes.len()).rev() {
            std::fs::write(&path, &bytes[..length]).unwrap();
            let Ok(recording) = open_with(&path, &partial()) else { continue };
            let n_frames = recording.info().n_frames;
            assert!((1..=n_before).contains(&n_frames), "{name} of {length} bytes: {n_frames} frames");
            n_before = n_frames;
            assert_eq!(recording.info().times_s, whole.info().times_s[..n_frames], "{name}");
            for (index, codes) in frames.iter().enumerate().take(n_frames) {
                assert_eq!(frame(&*recording, index), as_counts(codes), "{name} of {length} bytes");
            }
            if n_frames < 3 {
                assert!(has_warning(&*recording, &format!("the first {n_frames} are whole")), "{name}");
                assert!(open(&path).is_err(), "{name} of {length} bytes");
            }
        }
        assert_eq!(n_before, 1, "{name}: some length should leave one frame");
    }
}

/// A stack as programs write it that do not know how many frames will come, each frame behind its own directory; or as ImageJ does
/// with its description, all frames behind the first one's.
fn tiff_of_a_stream(frames: &[Vec<u16>], description: Option<&str>) -> Vec<u8> {
    let mut bytes: Vec<u8> = b"II\x2A\0".to_vec();
    let mut link_at = bytes.len();
    bytes.extend([0; 4]);
    let text = description.unwrap_or("none");
    let text_at = bytes.len() as u32;
    bytes.extend(text.as_bytes());
    for (number, codes) in frames.iter().enumerate() {
        let stored: Vec<u8> = codes.iter().flat_map(|code| code.to_le_bytes()).collect();
        if description.is_some() && number > 0 {
            bytes.extend(stored);
            continue;
        }
        let at = bytes.len() as u32;
        bytes[link_at..link_at + 4].copy_from_slice(&at.to_le_bytes());
        let entries: [(u16, u16, u32, u32); 9] = [
            (256, 3, 1, 16),
            (257, 3, 1, 4),
            (258, 3, 1, 16),
            (259, 3, 1, 1),
            (262, 3, 1, 1),
            (270, 2, text.len() as u32, text_at),
            (273, 4, 1, at + 2 + 9 * 12 + 4),
            (277, 3, 1, 1),
            (278, 3, 1, 4),
        ];
        bytes.extend(9_u16.to_le_bytes());
        for (tag, kind, count, value) in entries {
            bytes.extend([tag, kind].map(u16::to_le_bytes).concat());
            bytes.extend([count, value].map(u32::to_le_bytes).concat());
        }
        link_at = bytes.len();
        bytes.extend([0; 4]);
        bytes.extend(stored);
    }
    bytes
}

#[test]
fn a_part_of_a_compressed_stack_gives_its_whole_frames_when_asked() {
    let frames: Vec<Vec<u16>> = (0..4).map(|seed| codes(96, 255, seed)).collect();
    let bytes = gray_tiff(tiff::encoder::Compression::Lzw, &frames);
    let (_folder, path) = written(&bytes);
    let mut found = Vec::new();
    for length in (0..bytes.len()).rev() {
        std::fs::write(&path, &bytes[..length]).unwrap();
        let Ok(recording) = open_with(&path, &partial()) else { continue };
        let n_frames = recording.info().n_frames;
        for (index, codes) in frames.iter().enumerate().take(n_frames) {
            assert_eq!(frame(&*recording, index), as_counts(codes), "{length} bytes");
        }
        found.push(n_frames);
    }
    assert!(
        [1, 2, 3].iter().all(|n_frames| found.contains(n_frames)) && found.is_sorted_by(|a, b| a >= b),
        "{found:?}"
    );
}

#[test]
fn a_part_of_a_mraw_and_of_a_folder_gives_its_whole_frames_when_asked() {
    let file = MrawFile { frames: three(), ..MrawFile::default() };
    let (_folder, pixels, header) = file.write("cih");
    std::fs::write(&pixels, &file.pixels()[..2 * 128 + 77]).unwrap();
    assert!(matches!(refusal(&pixels, &OpenOptions::default()), CameraError::Truncated { .. }));
    for path in [&pixels, &header] {
        let recording = open_with(path, &partial()).unwrap();
        assert_eq!((recording.info().n_frames, recording.info().times_s.len()), (2, 2));
        assert!(has_warning(&*recording, "of the 3 frames it states, the first 2 are whole"));
        assert_eq!(frame(&*recording, 1), as_counts(&file.frames[1]));
    }
    std::fs::write(&pixels, &file.pixels()[..100]).unwrap();
    assert!(matches!(refusal(&pixels, &partial()), CameraError::Truncated { .. }));

    let folder = tempfile::tempdir().unwrap();
    let images: Vec<Vec<u8>> = (0..4).map(|seed| gray_png(&codes(96, 255, seed), 8)).collect();
    for (number, image) in images.iter().enumerate() {
        let kept = if number == 2 { image.len() / 2 } else { image.len() };
        let kept = if number == 3 { 0 } else { kept };
        std::fs::write(folder.path().join(format!("a{number}.png")), &image[..kept]).unwrap();
    }
    assert_eq!(open(folder.path()).unwrap().info().n_frames, 3);
    let recording = open_with(folder.path(), &partial()).unwrap();
    assert_eq!((recording.info().n_frames, recording.info().times_s.len()), (2, 2));
    assert!(has_warning(&*recording, "the first 2 are whole"));
    assert!(has_warning(&*recording, "named as images and hold none, such as `a3.png`"));
    assert_eq!(frame(&*recording, 1), as_counts(&codes(96, 255, 1)));
}

#[test]
fn jpegs_are_read_and_named_as_lossy() {
    let levels: Vec<u8> = codes(6, 255, 3).iter().map(|&code| code as u8).collect();
    let shown: Vec<f32> = (0..16 * 24).map(|at| f32::from(levels[at / 24 / 8 * 3 + at % 24 / 8])).collect();
    let gray = vec![128; 6];
    for channels in [vec![levels.clone()], vec![levels.clone(), gray.clone(), gray.clone()]] {
        let (_folder, path) = written(&jpeg_bytes((3, 2), &channels));
        let recording = open(&path).unwrap();
        assert_eq!((recording.info().format.as_str(), recording.info().bit_depth), ("jpeg image 8 bit", 8));
        assert!(has_warning(&*recording, "lossy"));
        assert_eq!(frame(&*recording, 0), shown);
    }
    let mut blue = gray.clone();
    blue[4] = 140;
    let (_folder, path) = written(&jpeg_bytes((3, 2), &[levels.clone(), blue, gray]));
    assert!(matches!(open(&path), Err(CameraError::Colour { .. })));
    let folder = tempfile::tempdir().unwrap();
    for name in ["a1.jpg", "a2.jpg"] {
        std::fs::write(folder.path().join(name), jpeg_bytes((3, 2), std::slice::from_ref(&levels))).unwrap();
    }
    let recording = open(folder.path()).unwrap();
    assert_eq!((recording.info().format.as_str(), recording.info().n_frames), ("jpeg series 8 bit", 2));
    assert_eq!(frame(&*recording, 1), shown);
}

#[test]
fn a_jpeg_whose_exif_turns_it_is_refused() {
    let jpeg = jpeg_bytes((3, 2), &[vec![10, 20, 30, 40, 50, 60]]);
    let (_folder, path) = written(&jpeg);
    let plain = frame(&*open(&path).unwrap(), 0);
    let (_folder, path) = written(&with_orientation(&jpeg, 1));
    assert_eq!(frame(&*open(&path).unwrap(), 0), plain);
    for orientation in [2, 3, 6, 8] {
        let (_folder, path) = written(&with_orientation(&jpeg, orientation));
        let message = refusal(&path, &OpenOptions::default()).to_string();
        assert!(message.contains(&format!("EXIF orientation {orientation}")), "{message}");
    }
    // A segment that is damaged says nothing.
    let mut damaged = with_orientation(&jpeg, 6);
    damaged[12] = b'X';
    let (_folder, path) = written(&damaged);
    assert_eq!(frame(&*open(&path).unwrap(), 0), plain);
}

/// A graymap of bytes or words, or of numbers.
pub(crate) fn pgm_bytes(mark: &str, (width, height): (usize, usize), most: u16, codes: &[u16]) -> Vec<u8> {
    let mut bytes = format!("{mark}\n# a comment\n{width} {height}\n{most}\n").into_bytes();
    match mark {
        "P2" => bytes.extend(codes.iter().flat_map(|code| format!("{code}\n").into_bytes())),
        _ if most < 256 => bytes.extend(codes.iter().map(|&code| code as u8)),
        _ => bytes.extend(codes.iter().flat_map(|code| code.to_be_bytes())),
    }
    bytes
}

#[test]
fn graymaps_of_every_kind_give_back_their_counts() {
    for mark in ["P2", "P5"] {
        for (most, bits) in [(255, 8), (100, 7), (1023, 10), (4095, 12), (65_535, 16)] {
            let codes = codes(96, most.min(60_000), 5);
            let (_folder, path) = written(&pgm_bytes(mark, (16, 6), most, &codes));
            let recording = open(&path).unwrap();
            assert_eq!(recording.info().bit_depth, bits, "{mark} {most}");
            assert_eq!(frame(&*recording, 0), as_counts(&codes), "{mark} {most}");
        }
    }
}

#[test]
fn graymaps_that_are_none_say_why() {
    let codes = codes(96, 255, 5);
    let plain = pgm_bytes("P5", (16, 6), 255, &codes);
    for (bytes, part) in [
        (pgm_bytes("P6", (16, 6), 255, &codes), "colour recording: a portable pixmap"),
        (pgm_bytes("P4", (16, 6), 255, &codes), "kind P4"),
        (pgm_bytes("P5", (16, 0), 255, &[]), "image height"),
        (pgm_bytes("P5", (16, 6), 0, &codes), "largest value"),
        (pgm_bytes("P5", (16, 6), 100, &codes), "at most 100"),
        (pgm_bytes("P2", (16, 6), 100, &codes), "at most 100"),
        (pgm_bytes("P2", (99_999, 99_999), 255, &codes), "pixels"),
        (pgm_bytes("P5", (4_294_967_295, 4_294_967_295), 65_535, &codes), "expected"),
        ([plain.clone(), plain].concat(), "several graymaps"),
        (b"P2 2 1 255 7 x".to_vec(), "a number"),
    ] {
        let (_folder, path) = written(&bytes);
        let message = open(&path).err().unwrap().to_string();
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn known_formats_that_are_not_read_say_how_to_convert() {
    let at = |at: usize, mark: &[u8]| [vec![0; at], mark.to_vec(), vec![0; 600]].concat();
    let mut spe = vec![0; 5000];
    spe[2996..3000].copy_from_slice(&[0x67, 0x45, 0x23, 0x01]);
    spe[4098..4100].copy_from_slice(&[0x55, 0x55]);
    for (bytes, what, hint) in [
        (at(0, b"\x89HDF\r\n\x1A\n"), "HDF5", "numpy.save"),
        (at(512, b"\x89HDF\r\n\x1A\n"), "HDF5", "numpy.save"),
        (at(0, b"MATLAB 5.0 MAT-file, Platform: GLNXA64"), "MATLAB", "scipy.io.loadmat"),
        (at(0, b"MATLAB 7.3 MAT-file, Platform: GLNXA64"), "7.3 (HDF5)", "h5py"),
        (at(0, b"\xED\xFE\0\0N\0o\0r\0p\0i\0x\0 \0s\0e\0q\0"), "StreamPix", "TIFF"),
        (at(0, b"FFF\0"), "FLIR", "TIFF"),
        (at(0, b"GIF89a"), "GIF", "TIFF"),
        (spe, ".spe", "TIFF"),
    ] {
        let (_folder, path) = written(&bytes);
        let error = open(&path).err().unwrap();
        let message = error.to_string();
        assert!(matches!(error, CameraError::Unsupported { .. }), "{message}");
        assert!(
            message.contains(what) && message.contains(hint) && message.contains("recording.bin"),
            "{message}"
        );
    }
}

#[test]
fn raw_pixels_of_monochrome_photron_models_are_gray() {
    for (camera, is_gray) in [
        ("FASTCAM SA-Z type 2100K-M-64GB", true),
        ("FASTCAM SA-Z type 2100K-C-64GB", false),
        ("FASTCAM SA-Z", false),
    ] {
        let file = MrawFile { colour: "Raw", ..MrawFile::default() };
        for extension in ["cih", "cihx"] {
            let (_folder, pixels, header) = file.write(extension);
            let named = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap().replace("FASTCAM SA-Z", camera);
            std::fs::write(&header, named(std::fs::read(&header).unwrap())).unwrap();
            match open(&pixels) {
                Ok(recording) => {
                    assert!(is_gray && has_warning(&*recording, "monochrome model"), "{camera}");
                    assert_eq!(frame(&*recording, 1), as_counts(&file.frames[1]));
                }
                Err(error) => {
                    assert!(!is_gray && matches!(error, CameraError::Colour { .. }), "{camera}: {error}");
                    assert!(error.to_string().contains(camera), "{error}");
                }
            }
        }
    }
}

#[test]
fn imagejs_interval_is_read_in_its_unit() {
    let stack = |lines: &str| {
        let description = Some(format!("ImageJ=1.53t\nimages=2\n{lines}\n"));
        let file =
            TiffFile { description, ..TiffFile::new(16, 4, vec![codes(64, 255, 1), codes(64, 255, 2)]) };
        let (folder, path) = written(&file.bytes());
        (folder, open(&path).unwrap())
    };
    for (lines, expected_hz) in
        [("finterval=0.5\ntunit=ms", 2000.0), ("finterval=0.5\ntunit=\u{B5}s", 2e6), ("finterval=0.5", 2.0)]
    {
        let (_folder, recording) = stack(lines);
        let rate_hz = recording.info().rate_hz.unwrap();
        assert!((rate_hz / expected_hz - 1.0).abs() < 4.0 * f64::EPSILON, "{lines}: {rate_hz}");
    }
    let (_folder, recording) = stack("finterval=0.5\ntunit=weeks");
    assert_eq!((recording.info().rate_hz, recording.info().times_s[1]), (None, 1.0));
    assert!(
        has_warning(&*recording, "unknown unit `weeks`") && has_warning(&*recording, "times count frames")
    );
}
