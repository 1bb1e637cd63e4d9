//! What reading the regions of 26 bodies costs against reading whole frames: 41x41 px out of 1280x800, on one thread.
//!
//! The regions are 4.3 % of the pixels, so that against this crate's own whole frames they cannot cost less. Readers in use take
//! a frame's bytes from the file and unpack all of them (`frame_by_a_plain_reader`), or hand the file to a video library
//! (`crates/opencv/benches/frames.rs`).
//!
//! Measured in one run: the regions cost 1.2 % (12 bit), 1.4 % (16 bit) and 5.8 % (8 bit, which a plain loop converts at the
//! memory's speed) of the plain reader's frame, 0.2 % (16 bit) and 0.6 % (8 bit) of OpenCV's, and 3 to 6 % of this crate's own.
//!
//! The files are in the system's cache, so that these are the costs of finding and unpacking pixels; from a disk, the ratio of
//! the bytes decides, which a test holds.
#![expect(clippy::expect_used, reason = "a benchmark that cannot start has nothing to report")]

#[expect(
    dead_code,
    clippy::unwrap_used,
    reason = "the tests' writer of .cine files, of which few parts are needed"
)]
#[path = "../tests/camera/writer.rs"]
mod writer;

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::PathBuf;

use chainwave_camera::open;
use chainwave_measurement::{Recording, Region};
use divan::Bencher;
use tempfile::TempDir;
use writer::CineFile;

const WIDTH: usize = 1280;
const HEIGHT: usize = 800;
const N_FRAMES: usize = 12;
const SUBSET: usize = 41;
const N_BODIES: usize = 26;
const STORED_BITS: [usize; 3] = [8, 12, 16];

fn main() {
    divan::main();
}

/// A .cine of noise, which costs to read what any other content costs.
fn file(stored_bits: usize) -> (TempDir, PathBuf) {
    let (storage, highest) = match stored_bits {
        8 => (writer::GRAY_8, 255),
        12 => (writer::P12L, 4095),
        _ => (writer::GRAY_16, 4095),
    };
    let frames = (0..N_FRAMES as u32).map(|seed| writer::codes(WIDTH * HEIGHT, highest, seed)).collect();
    let shown = CineFile { storage, width_px: WIDTH, height_px: HEIGHT, ..CineFile::default() };
    // FFmpeg refuses Setup blocks that are shorter.
    let setup_length = 0x163C;
    CineFile { frames, setup_length, stamps: None, exposures: None, ..shown }.write()
}

fn recording(stored_bits: usize) -> (TempDir, Box<dyn Recording>) {
    let (folder, path) = file(stored_bits);
    let recording = open(&path).expect("the recording can be opened");
    (folder, recording)
}

fn read(recording: &dyn Recording, frame: usize, region: Region, pixels: &mut [f32]) {
    recording.read_region(frame, region, pixels).expect("the region lies in the recording");
}

/// The regions of 26 bodies, frame after frame.
#[divan::bench(args = STORED_BITS)]
fn regions_of_a_frame(bencher: Bencher, stored_bits: usize) {
    let (_folder, recording) = recording(stored_bits);
    let mut pixels = vec![0.0; SUBSET * SUBSET];
    let mut frame = 0;
    bencher.bench_local(|| {
        frame = (frame + 1) % N_FRAMES;
        for body in 0..N_BODIES {
            let region = Region { x: 47 * body + 3, y: 300 + body, width: SUBSET, height: SUBSET };
            read(&*recording, frame, region, divan::black_box(&mut pixels));
        }
    });
}

/// Whole frames by this crate, one after the other.
#[divan::bench(args = STORED_BITS)]
fn whole_frame(bencher: Bencher, stored_bits: usize) {
    let (_folder, recording) = recording(stored_bits);
    let mut pixels = vec![0.0; WIDTH * HEIGHT];
    let mut frame = 0;
    bencher.bench_local(|| {
        frame = (frame + 1) % N_FRAMES;
        read(&*recording, frame, Region::whole(WIDTH, HEIGHT), divan::black_box(&mut pixels));
    });
}

/// What a reader does that takes a frame's bytes from the file and unpacks every pixel in a plain loop.
#[divan::bench(args = STORED_BITS)]
fn frame_by_a_plain_reader(bencher: Bencher, stored_bits: usize) {
    let (_folder, path) = file(stored_bits);
    let mut file = File::open(&path).expect("the recording can be opened");
    let size = file.metadata().expect("the recording has a size").len();
    let mut bytes = vec![0; WIDTH * HEIGHT * stored_bits / 8];
    let mut pixels = vec![0.0; WIDTH * HEIGHT];
    let mut frame = 0;
    bencher.bench_local(|| {
        frame = (frame + 1) % N_FRAMES;
        // The frames stand at the end, each behind eight bytes of its own.
        let start = size - ((N_FRAMES - frame) * (bytes.len() + 8)) as u64 + 8;
        file.seek(SeekFrom::Start(start)).expect("the frame lies in the file");
        file.read_exact(&mut bytes).expect("the frame can be read");
        unpack_plainly(stored_bits, &bytes, divan::black_box(&mut pixels));
    });
}

fn unpack_plainly(stored_bits: usize, bytes: &[u8], pixels: &mut [f32]) {
    for (index, pixel) in pixels.iter_mut().enumerate() {
        *pixel = match stored_bits {
            8 => f32::from(bytes[index]),
            16 => f32::from(u16::from_le_bytes([bytes[2 * index], bytes[2 * index + 1]])),
            _ => {
                let at = 3 * index / 2;
                let pair = u16::from_be_bytes([bytes[at], bytes[at + 1]]);
                f32::from(if index % 2 == 0 { pair >> 4 } else { pair & 0xFFF })
            }
        };
    }
}
