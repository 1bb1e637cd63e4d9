//! TIFF, PNG, BMP and NPY of known content, alone, as stacks and as folders, read back.

use std::path::Path;

use chainwave_camera::{CameraError, OpenOptions, open, open_with};
use chainwave_measurement::{ReadError, Recording, Region};
use tiff::encoder::colortype::{ColorType, Gray8, Gray16, RGB8};
use tiff::encoder::{Compression, TiffEncoder};

use crate::common::{as_counts, frame, has_warning};
use crate::tiff_writer::TiffFile;
use crate::writer::{codes, written};

const WIDTH: usize = 16;
const HEIGHT: usize = 6;

fn as_bytes(codes: &[u16]) -> Vec<u8> {
    codes.iter().map(|&code| code as u8).collect()
}

fn frames(n_frames: u32, high: u16) -> Vec<Vec<u16>> {
    (0..n_frames).map(|seed| codes(WIDTH * HEIGHT, high, seed)).collect()
}

/// Every frame, and some regions of it, against the counts that were written.
fn assert_holds(recording: &dyn Recording, frames: &[Vec<u16>]) {
    let info = recording.info();
    assert_eq!((info.width_px, info.height_px, info.n_frames), (WIDTH, HEIGHT, frames.len()));
    for (index, codes) in frames.iter().enumerate().rev() {
        assert_eq!(frame(recording, index), as_counts(codes), "frame {index}");
        for (x, y, width, height) in [(3, 1, 5, 4), (15, 5, 1, 1), (0, 2, 16, 3), (2, 2, 0, 2)] {
            let region = Region { x, y, width, height };
            let mut pixels = vec![f32::NAN; region.n_pixels()];
            recording.read_region(index, region, &mut pixels).unwrap();
            let rows = (y..y + height).flat_map(|y| as_counts(&codes[WIDTH * y + x..WIDTH * y + x + width]));
            assert_eq!(pixels, rows.collect::<Vec<_>>(), "frame {index} {region:?}");
        }
    }
}

#[test]
fn plain_tiff_stacks_of_every_kind_give_back_their_counts() {
    for bits in [8, 10, 12, 16] {
        for high_byte_first in [false, true] {
            for (is_big, rows_per_strip, gap_bytes) in
                [(false, 6, 0), (true, 6, 3), (false, 4, 7), (true, 1, 0)]
            {
                let frames = frames(3, ((1_u32 << bits) - 1).min(60_000) as u16);
                let file = TiffFile {
                    bits,
                    high_byte_first,
                    is_big,
                    rows_per_strip,
                    gap_bytes,
                    ..TiffFile::new(WIDTH, HEIGHT, frames.clone())
                };
                let (_folder, path) = written(&file.bytes());
                let recording = open(&path).unwrap();
                assert_eq!(recording.info().format, format!("tiff {bits} bit"));
                assert_eq!((recording.info().bit_depth, recording.info().rate_hz), (bits, None));
                assert_holds(&*recording, &frames);
            }
        }
    }
}

fn encoded<C>(compression: Compression, images: &[Vec<C::Inner>]) -> Vec<u8>
where
    C: ColorType,
    [C::Inner]: tiff::encoder::TiffValue,
{
    let mut file = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).unwrap().with_compression(compression);
    for image in images {
        encoder.write_image::<C>(WIDTH as u32, HEIGHT as u32, image).unwrap();
    }
    file.into_inner()
}

/// A gray TIFF of 8 bits and 16 x 6 pixels.
pub(crate) fn gray_tiff(compression: Compression, frames: &[Vec<u16>]) -> Vec<u8> {
    let bytes: Vec<Vec<u8>> = frames.iter().map(|codes| as_bytes(codes)).collect();
    encoded::<Gray8>(compression, &bytes)
}

#[test]
fn compressed_tiff_stacks_give_back_their_counts_in_any_order() {
    let frames = frames(6, 255);
    for compression in [Compression::Lzw, Compression::Deflate(Default::default()), Compression::Packbits] {
        let (_folder, path) = written(&gray_tiff(compression, &frames));
        assert_holds(&*open(&path).unwrap(), &frames);
        let (_folder, path) = written(&encoded::<Gray16>(compression, &frames));
        assert_holds(&*open(&path).unwrap(), &frames);
    }
}

#[test]
fn gray_written_as_colours_is_gray_and_colours_are_refused() {
    let codes = codes(WIDTH * HEIGHT, 255, 3);
    let gray: Vec<u8> = as_bytes(&codes).iter().flat_map(|&level| [level; 3]).collect();
    let mut colour = gray.clone();
    colour[100] ^= 1;
    let (_folder, path) = written(&encoded::<RGB8>(Compression::Uncompressed, std::slice::from_ref(&gray)));
    assert_holds(&*open(&path).unwrap(), std::slice::from_ref(&codes));
    let (_folder, path) = written(&encoded::<RGB8>(Compression::Uncompressed, std::slice::from_ref(&colour)));
    assert!(matches!(open(&path), Err(CameraError::Colour { .. })));

    let (_folder, path) = written(&png_bytes(png::ColorType::Rgb, png::BitDepth::Eight, &gray));
    assert_holds(&*open(&path).unwrap(), std::slice::from_ref(&codes));
    let (_folder, path) = written(&png_bytes(png::ColorType::Rgb, png::BitDepth::Eight, &colour));
    assert!(matches!(open(&path), Err(CameraError::Colour { .. })));
}

#[test]
fn samples_that_are_another_picture_are_refused() {
    let levels = codes(WIDTH * HEIGHT, 4095, 3);
    let with_opacity: Vec<u16> = levels.iter().flat_map(|&level| [level, 65_535]).collect();
    let gray =
        TiffFile { n_samples: 2, extra_sample: Some(2), ..TiffFile::new(WIDTH, HEIGHT, vec![with_opacity]) };
    let (_folder, path) = written(&gray.bytes());
    assert_holds(&*open(&path).unwrap(), std::slice::from_ref(&levels));
    let pair = |planar, extra_sample| TiffFile {
        planar,
        extra_sample,
        n_samples: 2,
        ..TiffFile::new(WIDTH, HEIGHT, gray.frames.clone())
    };
    let colours: Vec<u16> = levels.iter().flat_map(|&level| [level; 3]).collect();
    let three = |photometric, planar| TiffFile {
        photometric,
        planar,
        n_samples: 3,
        ..TiffFile::new(WIDTH, HEIGHT, vec![colours.clone()])
    };
    let (_folder, path) = written(&three(2, 1).bytes());
    assert_holds(&*open(&path).unwrap(), std::slice::from_ref(&levels));
    for (file, part) in [
        (pair(1, None), "2 channels"),
        (pair(1, Some(0)), "2 channels"),
        (pair(2, Some(2)), "planar configuration 2"),
        (pair(3, Some(2)), "planar configuration at byte"),
        (three(1, 1), "3 channels"),
        (three(2, 2), "planar configuration 2"),
    ] {
        let (_folder, path) = written(&file.bytes());
        let message = open(&path).err().unwrap().to_string();
        assert!(message.contains(part), "{part}: {message}");
    }
    // Of one sample a pixel there is but one plane.
    let one = TiffFile { planar: 2, ..TiffFile::new(WIDTH, HEIGHT, vec![levels.clone()]) };
    let (_folder, path) = written(&one.bytes());
    assert_holds(&*open(&path).unwrap(), std::slice::from_ref(&levels));
}

#[test]
fn an_imagej_stack_with_one_directory_holds_all_its_frames() {
    let frames = frames(4, 60_000);
    let mut file = TiffFile::new(WIDTH, HEIGHT, frames.clone());
    file.description = Some("ImageJ=1.53t\nimages=4\nslices=4\nfinterval=1.0E-4\n".into());
    file.n_directories = 1;
    let (_folder, path) = written(&file.bytes());
    let recording = open(&path).unwrap();
    assert_holds(&*recording, &frames);
    assert!((recording.info().rate_hz.unwrap() - 1e4).abs() < 1e-8);
    assert!((recording.info().times_s[3] - 3e-4).abs() < 1e-18);
    file.description = Some("ImageJ=1.53t\nimages=5\n".into());
    let (_folder, path) = written(&file.bytes());
    assert!(matches!(open(&path), Err(CameraError::Truncated { .. })));
}

#[test]
fn a_stack_of_fewer_images_than_it_states_is_refused_or_read_as_a_part() {
    let frames = frames(4, 60_000);
    let file = TiffFile {
        description: Some("ImageJ=1.53t\nimages=100\nframes=100\n".into()),
        ..TiffFile::new(WIDTH, HEIGHT, frames.clone())
    };
    let (_folder, path) = written(&file.bytes());
    let message = open(&path).err().unwrap().to_string();
    assert!(message.contains("expected 100, as the description states, found 4"), "{message}");
    let recording = open_with(&path, &OpenOptions { partial: true, ..OpenOptions::default() }).unwrap();
    assert_holds(&*recording, &frames);
    assert!(has_warning(&*recording, "of the 100 frames it states, the first 4 are whole"));
}

#[test]
fn channels_and_slices_are_no_frames() {
    let ome = |sizes: &str| {
        format!(
            "<?xml version=\"1.0\"?><OME><Image ID=\"Image:0\"><Pixels ID=\"Pixels:0\" {sizes}/></Image></OME>"
        )
    };
    for (description, part) in [
        ("ImageJ=1.53t\nimages=4\nchannels=2\nframes=2\nhyperstack=true\n".to_owned(), "2 channels"),
        (
            "ImageJ=1.53t\nimages=4\nslices=2\nframes=2\nhyperstack=true\n".to_owned(),
            "2 slices at each of 2 times",
        ),
        (ome("SizeC=\"2\" SizeT=\"2\" SizeZ=\"1\""), "2 channels"),
        (ome("SizeC=\"1\" SizeT=\"2\" SizeZ='2'"), "2 slices at each of 2 times"),
    ] {
        let file = TiffFile {
            description: Some(description.clone()),
            ..TiffFile::new(WIDTH, HEIGHT, frames(4, 60_000))
        };
        let (_folder, path) = written(&file.bytes());
        let error = open(&path).err().unwrap_or_else(|| panic!("{description}"));
        let message = error.to_string();
        assert!(matches!(error, CameraError::Unsupported { .. }) && message.contains(part), "{message}");
    }
    for description in [
        "ImageJ=1.53t\nimages=4\nchannels=1\nslices=4\nframes=1\n".to_owned(),
        ome("SizeC=\"1\" SizeT=\"4\" SizeZ=\"1\""),
        ome("SizeC=\"1\" SizeT=\"1\" SizeZ=\"4\""),
    ] {
        let frames = frames(4, 60_000);
        let file =
            TiffFile { description: Some(description), ..TiffFile::new(WIDTH, HEIGHT, frames.clone()) };
        let (_folder, path) = written(&file.bytes());
        assert_holds(&*open(&path).unwrap(), &frames);
    }
    // Red, green and blue of one picture are its samples.
    let levels = codes(WIDTH * HEIGHT, 4095, 3);
    let gray = TiffFile {
        description: Some(ome("SizeC=\"3\" SizeT=\"1\" SizeZ=\"1\"")),
        photometric: 2,
        n_samples: 3,
        ..TiffFile::new(WIDTH, HEIGHT, vec![levels.iter().flat_map(|&level| [level; 3]).collect()])
    };
    let (_folder, path) = written(&gray.bytes());
    assert_holds(&*open(&path).unwrap(), &[levels]);
}

#[test]
fn tiffs_of_other_numbers_are_refused_with_their_reason() {
    let small = || TiffFile::new(8, 2, vec![codes(16, 255, 1)]);
    for (file, part) in [
        (TiffFile { sample_format: 3, ..small() }, "floating point"),
        (TiffFile { orientation: 3, ..small() }, "turned or mirrored"),
        (TiffFile { bits: 32, ..small() }, "bits per sample"),
        (TiffFile { photometric: 6, ..small() }, "colour recording"),
        (TiffFile { compression: 7, ..small() }, "compression 7"),
        (TiffFile { bits: 12, ..TiffFile::new(5, 1, vec![vec![1; 5]]) }, "rows of 5 pixels"),
    ] {
        let (_folder, path) = written(&file.bytes());
        let message = open(&path).err().unwrap().to_string();
        assert!(message.contains(part), "{message}");
    }
}

fn png_bytes(colour: png::ColorType, depth: png::BitDepth, samples: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, WIDTH as u32, HEIGHT as u32);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(samples).unwrap();
    bytes
}

/// A gray PNG of 16 x 6 pixels.
pub(crate) fn gray_png(codes: &[u16], bits: u32) -> Vec<u8> {
    if bits == 8 {
        return png_bytes(png::ColorType::Grayscale, png::BitDepth::Eight, &as_bytes(codes));
    }
    let samples: Vec<u8> = codes.iter().flat_map(|code| code.to_be_bytes()).collect();
    png_bytes(png::ColorType::Grayscale, png::BitDepth::Sixteen, &samples)
}

/// A bitmap of 8 bits whose palette holds `level(index)`, or of 24 or 32 bits; `from_top` for rows from the top.
pub(crate) fn bmp_bytes(
    (width, height): (usize, usize),
    codes: &[u16],
    bits: u16,
    from_top: bool,
    level: impl Fn(u8) -> u8,
) -> Vec<u8> {
    let palette: Vec<u8> = if bits == 8 {
        (0..=255).flat_map(|index| [[level(index); 3].as_slice(), &[0]].concat()).collect()
    } else {
        Vec::new()
    };
    let mut bytes = b"BM\0\0\0\0\0\0\0\0".to_vec();
    bytes.extend((54 + palette.len() as u32).to_le_bytes());
    bytes.extend(40_u32.to_le_bytes());
    bytes.extend((width as i32).to_le_bytes());
    bytes.extend((height as i32 * if from_top { -1 } else { 1 }).to_le_bytes());
    bytes.extend([1, bits].iter().flat_map(|value| value.to_le_bytes()));
    bytes.extend([0; 24]);
    bytes.extend(palette);
    let mut rows: Vec<Vec<u8>> = codes
        .chunks(width)
        .map(|row| {
            let mut stored: Vec<u8> =
                row.iter().flat_map(|&code| vec![code as u8; usize::from(bits / 8)]).collect();
            stored.resize(stored.len().next_multiple_of(4), 0xEE);
            stored
        })
        .collect();
    if !from_top {
        rows.reverse();
    }
    bytes.extend(rows.concat());
    bytes
}

#[test]
fn bitmaps_of_every_kind_give_back_their_counts() {
    let codes = codes(WIDTH * HEIGHT, 255, 4);
    for bits in [8, 24, 32] {
        for from_top in [false, true] {
            let bytes = bmp_bytes((WIDTH, HEIGHT), &codes, bits, from_top, |index| index);
            let (_folder, path) = written(&bytes);
            assert_holds(&*open(&path).unwrap(), std::slice::from_ref(&codes));
        }
    }
    let (_folder, path) = written(&bmp_bytes((WIDTH, HEIGHT), &codes, 8, false, |index| 255 - index));
    let inverted: Vec<u16> = codes.iter().map(|code| 255 - code).collect();
    assert_holds(&*open(&path).unwrap(), &[inverted]);
    let mut odd = bmp_bytes((5, 3), &codes[..15], 8, false, |index| index);
    let (_folder, path) = written(&odd);
    assert_eq!(frame(&*open(&path).unwrap(), 0), as_counts(&codes[..15]));
    odd[54 + 4 * usize::from(codes[7])] ^= 1;
    let (_folder, path) = written(&odd);
    assert!(matches!(open(&path), Err(CameraError::Colour { .. })));
}

fn write(folder: &Path, name: &str, bytes: &[u8]) {
    std::fs::write(folder.join(name), bytes).unwrap();
}

#[test]
fn folders_are_read_in_the_order_of_their_numbers() {
    let frames = frames(12, 255);
    for bits in [8, 16] {
        let folder = tempfile::tempdir().unwrap();
        for (index, codes) in frames.iter().enumerate() {
            write(folder.path(), &format!("shot{index}.png"), &gray_png(codes, bits));
        }
        write(folder.path(), "notes.txt", b"not an image");
        write(folder.path(), ".hidden.png", b"\x89PNG\r\n\x1A\nnor this");
        let options = OpenOptions { rate_hz: Some(1000.0), ..OpenOptions::default() };
        let recording = open_with(folder.path(), &options).unwrap();
        assert_eq!(recording.info().format, format!("png series {bits} bit"));
        assert_eq!((recording.info().rate_hz, recording.info().times_s[11]), (Some(1000.0), 11.0 * 1e-3));
        assert_holds(&*recording, &frames);
    }
}

#[test]
fn missing_numbers_and_other_images_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let frames = frames(3, 255);
    for (number, codes) in [7, 8, 11].into_iter().zip(&frames) {
        let bytes = TiffFile { bits: 8, ..TiffFile::new(WIDTH, HEIGHT, vec![codes.clone()]) }.bytes();
        write(folder.path(), &format!("a_{number:04}.tif"), &bytes);
    }
    write(folder.path(), "sheet.png", &gray_png(&frames[0], 8));
    let recording = open(folder.path()).unwrap();
    assert_holds(&*recording, &frames);
    assert_eq!(
        (recording.info().first_image, recording.info().times_s.as_slice()),
        (7, [0.0, 1.0, 4.0].as_slice())
    );
    for part in ["9 to 10", "`sheet.png`", "no frame rate"] {
        assert!(has_warning(&*recording, part), "{part}: {:?}", recording.info().warnings);
    }
}

#[test]
fn a_damaged_or_different_image_spoils_its_own_frame_alone() {
    let folder = tempfile::tempdir().unwrap();
    let frames = frames(4, 255);
    for (index, codes) in frames.iter().enumerate() {
        write(folder.path(), &format!("{index}.png"), &gray_png(codes, 8));
    }
    let whole = gray_png(&frames[1], 8);
    write(folder.path(), "1.png", &whole[..whole.len() / 2]);
    write(folder.path(), "2.png", &gray_png(&frames[2], 16));
    let recording = open(folder.path()).unwrap();
    let region = Region::whole(WIDTH, HEIGHT);
    for (index, part) in [(1, "1.png"), (2, "expected 16 x 6 px of 8 bits, found 16 x 6 px of 16 bits")] {
        let error = recording.read_region(index, region, &mut vec![0.0; 96]).unwrap_err();
        assert!(matches!(error, ReadError::Unreadable { .. }) && error.to_string().contains(part), "{error}");
    }
    assert_eq!(frame(&*recording, 3), as_counts(&frames[3]));
}

#[test]
fn a_folder_without_a_series_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    assert!(open(folder.path()).err().unwrap().to_string().contains("a folder without images"));
    let image = gray_png(&codes(WIDTH * HEIGHT, 255, 1), 8);
    for name in ["left1.png", "left2.png", "right1.png", "right2.png"] {
        write(folder.path(), name, &image);
    }
    assert!(open(folder.path()).err().unwrap().to_string().contains("a folder of its own"));
}

/// An array of `<u2` in format version 1 with the given header.
pub(crate) fn npy_bytes(header: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\0".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

#[test]
fn arrays_of_eight_and_sixteen_bits_give_back_their_counts() {
    let frames = frames(3, 255);
    let all = frames.concat();
    let little: Vec<u8> = all.iter().flat_map(|code| code.to_le_bytes()).collect();
    let big: Vec<u8> = all.iter().flat_map(|code| code.to_be_bytes()).collect();
    for (descr, data) in [("|u1", as_bytes(&all)), ("<u2", little), (">u2", big)] {
        let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (3, 6, 16), }}\n");
        let (_folder, path) = written(&npy_bytes(&header, &data));
        assert_holds(&*open(&path).unwrap(), &frames);
        let (_folder, path) = written(&npy_bytes(&header.replace("(3, 6", "(18"), &data));
        assert_eq!(frame(&*open(&path).unwrap(), 0), as_counts(&all));
    }
}

#[test]
fn arrays_of_other_kinds_are_refused_with_a_hint() {
    let header = "{'descr': '<u2', 'fortran_order': False, 'shape': (3, 6, 16), }\n";
    for (from, to, part) in [
        ("<u2", "<f8", "numpy.uint16"),
        ("False", "True", "ascontiguousarray"),
        ("False", "Maybe", "expected True or False"),
        ("(3, 6, 16)", "(3, 0, 16)", "each at least 1"),
        ("(3, 6, 16)", "(3, 6, 16, 3)", "each at least 1"),
        ("(3, 6, 16)", "(99999999999999, 6, 16)", "expected 1919"),
        ("(3, 6, 16)", "(1, 2, 18446744073709551615)", "rows that fit"),
        ("'shape'", "'size'", "array's shape"),
    ] {
        let (_folder, path) = written(&npy_bytes(&header.replace(from, to), &[0; 576]));
        let message = open(&path).err().unwrap().to_string();
        assert!(message.contains(part), "{message}");
    }
}
