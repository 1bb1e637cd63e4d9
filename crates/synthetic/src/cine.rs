//! The headers of a Phantom .cine file, from the format's description.

use crate::packing::n_bytes;
use crate::settings::{Camera, Packing, Shot};

/// Offsets of the file's parts. The setup block has the length that cameras of Phantom software 749 write: up to
/// `fDecimation`, before `dFrameRate`.
const BITMAP_HEADER: usize = 44;
const SETUP: usize = 84;
const SETUP_LENGTH: usize = 10392;
const TIME_BLOCK: usize = SETUP + SETUP_LENGTH;

/// What precedes the data of a tagged block: size, type, whether another follows.
const BLOCK_PREFIX: usize = 8;

/// Every synthetic trigger falls on 2025-01-01 00:00:00 UTC, so that equal settings give equal bytes.
const TRIGGER_UNIX_S: u64 = 1_735_689_600;

/// What precedes each frame's pixels: the annotation's size (with nothing in it) and the pixels'.
pub(crate) const FRAME_PREFIX: usize = 8;

/// The name the camera states.
const CAMERA_MODEL: &str = "chainwave synthetic camera";

/// Frames per second as a file has them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StatedRates {
    /// In its header.
    pub(crate) header_hz: f64,
    /// By its time stamps.
    pub(crate) clock_hz: f64,
}

/// Everything before the first frame of a Phantom .cine file, version 1: file header, bitmap header, setup, block 1002
/// (time stamps), block 1003 (exposures), pointers to the frames. The file holds the given frames of the shot, with
/// these rates.
pub(crate) fn header(camera: &Camera, shot: &Shot, frames: &[usize], rates: StatedRates) -> Vec<u8> {
    let StatedRates { header_hz, clock_hz } = rates;
    let n_frames = frames.len();
    let exposure_block = TIME_BLOCK + BLOCK_PREFIX + 8 * n_frames;
    let pointers = exposure_block + BLOCK_PREFIX + 4 * n_frames;
    let first_frame = pointers + 8 * n_frames;
    let mut bytes = HeaderBytes(vec![0; TIME_BLOCK]);
    put_file_header(&mut bytes, shot, frames, pointers);
    put_bitmap_header(&mut bytes, camera);
    put_setup(&mut bytes, camera, shot, header_hz);
    let HeaderBytes(mut bytes) = bytes;
    let by_clock_s = |frame: usize| shot.stamp_s(frame, camera.rate_hz) * (camera.rate_hz / clock_hz);
    let stamps = frames.iter().flat_map(|&frame| stamp(by_clock_s(frame)).to_le_bytes());
    let exposure = (camera.exposure_s * TICKS_PER_S).round() as u32;
    push_block(&mut bytes, 1002, true, stamps.collect());
    push_block(&mut bytes, 1003, false, exposure.to_le_bytes().repeat(n_frames));
    let frame_size = FRAME_PREFIX + n_bytes(camera.packing, camera.width_px * camera.height_px);
    bytes.extend((0..n_frames).flat_map(|frame| ((first_frame + frame * frame_size) as u64).to_le_bytes()));
    bytes
}

/// A frame as it stands in the file, its pixels still zero.
pub(crate) fn empty_frame(camera: &Camera) -> Vec<u8> {
    let size = n_bytes(camera.packing, camera.width_px * camera.height_px);
    let mut bytes = HeaderBytes(vec![0; FRAME_PREFIX + size]);
    bytes.put(0, &(FRAME_PREFIX as u32).to_le_bytes());
    bytes.put(4, &(size as u32).to_le_bytes());
    bytes.0
}

impl Camera {
    /// Bytes of a recording of so many frames.
    pub fn recording_bytes(&self, n_frames: usize) -> u64 {
        let blocks = 2 * BLOCK_PREFIX + (8 + 4 + 8) * n_frames;
        let frame = FRAME_PREFIX + n_bytes(self.packing, self.width_px * self.height_px);
        (TIME_BLOCK + blocks + n_frames * frame) as u64
    }
}

/// Time is counted in 2^-32 s.
const TICKS_PER_S: f64 = 4_294_967_296.0;

/// The time of an image, in 2^-32 s since 1970, to the nearest. (Cameras use the two lowest bits as flags; here they
/// are part of the time.)
fn stamp(after_trigger_s: f64) -> u64 {
    (TRIGGER_UNIX_S << 32).wrapping_add_signed((after_trigger_s * TICKS_PER_S).round() as i64)
}

fn put_file_header(bytes: &mut HeaderBytes, shot: &Shot, frames: &[usize], pointers: usize) {
    let compression_none = 0_u16.to_le_bytes();
    // The first of the file's frames, which is not that of the shot where the file lacks some.
    let first_image =
        (shot.first_image as i32 + frames.first().map_or(0, |&first| first as i32)).to_le_bytes();
    let n_frames = (frames.len() as u32).to_le_bytes();
    bytes.put(0x00, b"CI");
    bytes.put(0x02, &44_u16.to_le_bytes());
    bytes.put(0x04, &compression_none);
    bytes.put(0x06, &1_u16.to_le_bytes());
    bytes.put(0x08, &first_image);
    bytes.put(0x0C, &n_frames);
    bytes.put(0x10, &first_image);
    bytes.put(0x14, &n_frames);
    bytes.put(0x18, &(BITMAP_HEADER as u32).to_le_bytes());
    bytes.put(0x1C, &(SETUP as u32).to_le_bytes());
    bytes.put(0x20, &(pointers as u32).to_le_bytes());
    bytes.put(0x24, &(TRIGGER_UNIX_S << 32).to_le_bytes());
}

fn put_bitmap_header(bytes: &mut HeaderBytes, camera: &Camera) {
    let (bits, compression) = match camera.packing {
        Packing::Bits8 => (8_u16, 0_u32),
        Packing::Bits16 => (16, 0),
        Packing::P10 => (16, 256),
        Packing::P12L => (16, 1024),
    };
    let size = n_bytes(camera.packing, camera.width_px * camera.height_px) as u32;
    let sensor_pixels_per_m = 35_714_u32; // 28 um, a v1211's
    let at = |offset: usize| BITMAP_HEADER + offset;
    bytes.put(at(0x00), &40_u32.to_le_bytes());
    bytes.put(at(0x04), &(camera.width_px as u32).to_le_bytes());
    bytes.put(at(0x08), &(camera.height_px as u32).to_le_bytes());
    bytes.put(at(0x0C), &1_u16.to_le_bytes());
    bytes.put(at(0x0E), &bits.to_le_bytes());
    bytes.put(at(0x10), &compression.to_le_bytes());
    bytes.put(at(0x14), &size.to_le_bytes());
    bytes.put(at(0x18), &sensor_pixels_per_m.to_le_bytes());
    bytes.put(at(0x1C), &sensor_pixels_per_m.to_le_bytes());
    bytes.put(at(0x24), &(1_u32 << stored_depth(camera)).to_le_bytes());
}

/// Bits of a stored value: P10 stores 10 of the sensor's 12.
fn stored_depth(camera: &Camera) -> u32 {
    if camera.packing == Packing::P10 { 10 } else { camera.sensor.bit_depth }
}

fn put_setup(bytes: &mut HeaderBytes, camera: &Camera, shot: &Shot, stated_hz: f64) {
    let depth = stored_depth(camera);
    let rate = stated_hz.round() as u32;
    let exposure_us = (camera.exposure_s * 1.0e6).round() as u32;
    let exposure_ns = (camera.exposure_s * 1.0e9).round() as u32;
    let after_trigger = (shot.first_image + shot.n_frames as i64).max(0) as u32;
    let [width, height] = [camera.width_px, camera.height_px];
    let (black, white) = levels(camera);
    let at = |offset: usize| SETUP + offset;
    bytes.put(at(0x000), &saturated(rate));
    bytes.put(at(0x002), &saturated(exposure_us));
    bytes.put(at(0x004), &saturated(after_trigger));
    bytes.put(at(0x08C), b"ST");
    bytes.put(at(0x08E), &(SETUP_LENGTH as u16).to_le_bytes());
    bytes.put(at(0x2E1), &(width as u16).to_le_bytes());
    bytes.put(at(0x2E3), &(height as u16).to_le_bytes());
    bytes.put(at(0x300), &rate.to_le_bytes());
    bytes.put(at(0x304), &exposure_us.to_le_bytes());
    bytes.put(at(0x30C), &after_trigger.to_le_bytes());
    bytes.put(at(0x320), &749_u32.to_le_bytes()); // the software version whose layout this is
    bytes.put(at(0x380), &depth.to_le_bytes());
    bytes.put(at(0x388), &((1_u32 << depth) - 1).to_le_bytes());
    bytes.put(at(0x620), &exposure_ns.to_le_bytes());
    bytes.put(at(0x634), &(width as u32).to_le_bytes());
    bytes.put(at(0x638), &(height as u32).to_le_bytes());
    bytes.put(at(0x63C), b"synthetic recording of known motion, made by chainwave");
    bytes.put(at(0x1664), &black.to_le_bytes());
    bytes.put(at(0x1668), &white.to_le_bytes());
    put_display(bytes);
    bytes.put(at(0x2680), b"chainwave");
    bytes.put(at(0x2780), &camera.sensor.bit_depth.to_le_bytes());
    bytes.put(at(0x2784), &(depth as u16).to_le_bytes());
    bytes.put(at(0x2786), &(if camera.packing == Packing::P10 { 256_u16 } else { 0 }).to_le_bytes());
    bytes.put(at(0x2790), CAMERA_MODEL.as_bytes());
    bytes.put(at(0x2894), &1.0_f32.to_le_bytes());
}

/// Neutral display settings: gain, gamma and 16-to-8-bit gain of 1.
fn put_display(bytes: &mut HeaderBytes) {
    for offset in [0x177C, 0x1788, 0x1AF4] {
        bytes.put(SETUP + offset, &1.0_f32.to_le_bytes());
    }
}

/// Black and white level as stored: of the codes in a P10 file.
fn levels(camera: &Camera) -> (i32, i32) {
    if camera.packing == Packing::P10 {
        (64, 1014)
    } else {
        (camera.sensor.black_level.round() as i32, camera.sensor.white_level().round() as i32)
    }
}

fn saturated(value: u32) -> [u8; 2] {
    u16::try_from(value).unwrap_or(u16::MAX).to_le_bytes()
}

/// Appends a tagged block; `more` says whether another follows.
fn push_block(bytes: &mut Vec<u8>, kind: u16, more: bool, data: Vec<u8>) {
    bytes.extend(((BLOCK_PREFIX + data.len()) as u32).to_le_bytes());
    bytes.extend(kind.to_le_bytes());
    bytes.extend(u16::from(more).to_le_bytes());
    bytes.extend(data);
}

/// A block of bytes whose fields have fixed places.
struct HeaderBytes(Vec<u8>);

impl HeaderBytes {
    fn put(&mut self, offset: usize, field: &[u8]) {
        self.0[offset..offset + field.len()].copy_from_slice(field);
    }
}
