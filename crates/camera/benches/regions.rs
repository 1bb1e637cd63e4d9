//! What reading the regions of 26 bodies costs against reading whole frames: 41x41 px out of 1280x800, on one thread.
//!
//! The files are in the system's cache, so that these are the costs of finding and unpacking pixels; from a disk, the ratio of
//! the bytes decides, which a test holds.
#![expect(clippy::expect_used, reason = "a benchmark that cannot start has nothing to report")]

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::PathBuf;

use chainwave_camera::open;
use chainwave_measurement::{Recording, Region};
use divan::Bencher;
use tempfile::TempDir;

const WIDTH: usize = 1280;
const HEIGHT: usize = 800;
const N_FRAMES: usize = 24;
const SUBSET: usize = 41;
const N_BODIES: usize = 26;
const STORED_BITS: [usize; 3] = [8, 12, 16];

fn main() {
    divan::main();
}

/// A .mraw of noise, which costs to read what any other content costs.
fn recording(stored_bits: usize) -> (TempDir, Box<dyn Recording>) {
    let folder = tempfile::tempdir().expect("a folder for the recording");
    let path: PathBuf = folder.path().join("noise.mraw");
    let n_bytes = N_FRAMES * WIDTH * HEIGHT * stored_bits / 8;
    let bytes: Vec<u8> =
        (0..n_bytes as u32).map(|index| (index.wrapping_mul(2_654_435_761) >> 20) as u8).collect();
    std::fs::write(&path, bytes).expect("the recording can be written");
    let header = format!(
        "#Camera Information Header\nRecord Rate(fps) : 25000\nTotal Frame : {N_FRAMES}\nImage Width : {WIDTH}\n\
         Image Height : {HEIGHT}\nColor Bit : {stored_bits}\nEffectiveBit Depth : {stored_bits}\n\n"
    );
    std::fs::write(path.with_extension("cih"), header).expect("the header can be written");
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

/// Whole frames, one after the other.
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

/// What a reader does that takes a frame's bytes from the file before it unpacks them.
#[divan::bench(args = STORED_BITS)]
fn whole_frame_from_the_file(bencher: Bencher, stored_bits: usize) {
    let (_folder, recording) = recording(stored_bits);
    let mut file = File::open(recording.path()).expect("the recording can be opened");
    let mut bytes = vec![0; WIDTH * HEIGHT * stored_bits / 8];
    let mut pixels = vec![0.0; WIDTH * HEIGHT];
    let mut frame = 0;
    bencher.bench_local(|| {
        frame = (frame + 1) % N_FRAMES;
        file.seek(SeekFrom::Start((frame * bytes.len()) as u64)).expect("the frame lies in the file");
        file.read_exact(divan::black_box(&mut bytes)).expect("the frame can be read");
        read(&*recording, frame, Region::whole(WIDTH, HEIGHT), divan::black_box(&mut pixels));
    });
}
