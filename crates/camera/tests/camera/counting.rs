//! Bytes of uncompressed recordings that reading by region looks at.

use chainwave_camera::{OpenOptions, open_with};
use chainwave_measurement::Region;

use crate::images::npy_bytes;
use crate::tiff_writer::TiffFile;
use crate::writer::{CineFile, GRAY_8, GRAY_16, P10, P12L, codes, stamps, written};

const WIDTH: usize = 1280;
const HEIGHT: usize = 800;
const SUBSET: usize = 41;

/// 26 subsets in a row, as of a chain, at columns of every remainder.
fn subsets() -> impl Iterator<Item = Region> {
    (0..26).map(|body| Region { x: 47 * body + 3, y: 300 + body, width: SUBSET, height: SUBSET })
}

fn assert_reads_little(file: &[u8], bits: usize) {
    let (_folder, path) = written(file);
    let options = OpenOptions::default();
    let recording = open_with(&path, &options).unwrap();
    let before = options.pixel_bytes.bytes();
    let mut pixels = vec![0.0; SUBSET * SUBSET];
    for frame in 0..recording.info().n_frames {
        for region in subsets() {
            recording.read_region(frame, region, &mut pixels).unwrap();
        }
    }
    let looked_at = (options.pixel_bytes.bytes() - before) as f64;
    let regions = (recording.info().n_frames * 26 * SUBSET * SUBSET * bits) as f64 / 8.0;
    // Four 10-bit pixels share five bytes: 41 of them reach into up to 12 such groups, 60 bytes for 51.25.
    let format = &recording.info().format;
    assert!(looked_at >= regions && looked_at <= 1.3 * regions, "{format}: {looked_at} {regions}");
}

#[test]
fn tracking_26_bodies_looks_at_little_more_than_their_bytes() {
    let frames = vec![codes(WIDTH * HEIGHT, 255, 1), codes(WIDTH * HEIGHT, 255, 2)];
    for (storage, bits) in [(GRAY_8, 8), (GRAY_16, 16), (P10, 10), (P12L, 12)] {
        let file = CineFile {
            storage,
            width_px: WIDTH,
            height_px: HEIGHT,
            frames: frames.clone(),
            stamps: Some(stamps(0, 2, 1e4)),
            ..CineFile::default()
        };
        assert_reads_little(&file.bytes(), bits);
    }
    let tiff = TiffFile { rows_per_strip: 6, gap_bytes: 5, ..TiffFile::new(WIDTH, HEIGHT, frames.clone()) };
    assert_reads_little(&tiff.bytes(), 16);
    let header = format!("{{'descr': '|u1', 'fortran_order': False, 'shape': (1, {HEIGHT}, {WIDTH})}}\n");
    let bytes: Vec<u8> = frames[0].iter().map(|&code| code as u8).collect();
    assert_reads_little(&npy_bytes(&header, &bytes), 8);
}
