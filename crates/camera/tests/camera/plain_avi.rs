//! AVI of uncompressed gray, written here by the description of the format.

use chainwave_camera::{CameraError, OpenOptions, needs_opencv, open, open_with};
use chainwave_measurement::{Recording, Region};

use crate::writer::written;

const HEIGHT: u32 = 3;

/// A file of uncompressed frames at 2500 Hz.
struct Avi {
    codec: [u8; 4],
    width: u32,
    /// Negative for rows of a bitmap that begin at the top.
    height: i32,
    row_bytes: u32,
    has_palette: bool,
    /// Frames in two seconds.
    rate: u32,
    /// `None` where the recorder kept a chunk without pixels.
    frames: Vec<Option<u8>>,
}

impl Avi {
    fn named(codec: &[u8; 4], width: u32) -> Self {
        let frames = vec![Some(10), Some(20), Some(30)];
        Self {
            codec: *codec,
            width,
            height: HEIGHT as i32,
            row_bytes: width,
            has_palette: false,
            rate: 5000,
            frames,
        }
    }

    /// The count of a pixel: rows, columns and frames all differ.
    fn count(start: u8, x: u32, y: u32) -> u8 {
        start + (5 * x + 50 * y) as u8
    }

    fn bytes(&self) -> Vec<u8> {
        let is_bitmap = self.codec == [0; 4];
        let row = |start: u8, y: u32| {
            let mut row: Vec<u8> = (0..self.width).map(|x| Self::count(start, x, y)).collect();
            row.resize(self.row_bytes as usize, 0xEE);
            row
        };
        let frame = |start: &Option<u8>| {
            let rows = (0..HEIGHT).map(|y| if is_bitmap && self.height > 0 { HEIGHT - 1 - y } else { y });
            let pixels = start.map(|start| rows.flat_map(|y| row(start, y)).collect::<Vec<u8>>());
            chunk(b"01db", &[pixels.unwrap_or_default()])
        };
        let frames: Vec<Vec<u8>> = self.frames.iter().map(frame).collect();
        let n_frames = self.frames.len() as u32;
        let stream = [
            b"vids".to_vec(),
            self.codec.to_vec(),
            numbers(&[0, 0, 0, 2, self.rate, 0, n_frames, 0, 0, 0, 0, 0]),
        ]
        .concat();
        let palette: Vec<u32> = (0..256).map(|tone| tone | tone << 8 | tone << 16).collect();
        let picture = [
            numbers(&[40, self.width, self.height as u32, 1 | 8 << 16]),
            self.codec.to_vec(),
            numbers(&[0, 0, 0, 0, 0]),
            if self.has_palette { numbers(&palette) } else { Vec::new() },
        ]
        .concat();
        let sound = chunk(b"strh", &[b"auds".to_vec(), numbers(&[0; 13])]);
        let streams = [
            list(b"strl", &[sound, chunk(b"strf", &[numbers(&[0; 4])])]),
            list(b"strl", &[chunk(b"strh", &[stream]), chunk(b"strf", &[picture])]),
        ]
        .concat();
        let header = list(b"hdrl", &[chunk(b"avih", &[numbers(&[0; 14])]), streams]);
        let between = chunk(b"00wb", &[vec![7; 5]]);
        let movie =
            [chunk(b"JUNK", &[vec![0; 3]]), list(b"rec ", &frames[..1]), between, frames[1..].concat()]
                .concat();
        chunk(b"RIFF", &[b"AVI ".to_vec(), header, list(b"movi", &[movie]), chunk(b"idx1", &[vec![0; 16]])])
    }
}

fn chunk(name: &[u8; 4], parts: &[Vec<u8>]) -> Vec<u8> {
    let inside = parts.concat();
    let mut bytes = [name.as_slice(), &(inside.len() as u32).to_le_bytes(), &inside].concat();
    bytes.resize(bytes.len().next_multiple_of(2), 0);
    bytes
}

fn list(name: &[u8; 4], parts: &[Vec<u8>]) -> Vec<u8> {
    chunk(b"LIST", &[name.to_vec(), parts.concat()])
}

fn numbers(numbers: &[u32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn counts(recording: &dyn Recording, frame: usize) -> Vec<f32> {
    let (width, height) = (recording.info().width_px, recording.info().height_px);
    let mut counts = vec![0.0; width * height];
    recording.read_region(frame, Region::whole(width, height), &mut counts).unwrap();
    counts
}

fn expected(start: u8, width: u32) -> Vec<f32> {
    let place = (0..HEIGHT).flat_map(|y| (0..width).map(move |x| (x, y)));
    place.map(|(x, y)| f32::from(Avi::count(start, x, y))).collect()
}

#[test]
fn uncompressed_gray_is_read_where_it_lies() {
    let padded = Avi { row_bytes: 8, ..Avi::named(b"GREY", 7) };
    let bitmap = Avi { row_bytes: 8, has_palette: true, ..Avi::named(&[0; 4], 7) };
    let from_the_top =
        Avi { height: -(HEIGHT as i32), row_bytes: 8, has_palette: true, ..Avi::named(&[0; 4], 7) };
    for avi in [Avi::named(b"Y800", 8), Avi::named(b"Y8  ", 7), padded, bitmap, from_the_top] {
        let (_folder, path) = written(&avi.bytes());
        assert!(!needs_opencv(&path, &OpenOptions::default()));
        let recording = open(&path).unwrap();
        let info = recording.info();
        assert_eq!((info.n_frames, info.bit_depth, info.rate_hz), (3, 8, Some(2500.0)));
        assert!(!recording.is_sequential() && info.warnings.len() == 1, "{:?}", info.warnings);
        for (frame, start) in [10, 20, 30].into_iter().enumerate() {
            assert_eq!(counts(recording.as_ref(), frame), expected(start, avi.width), "{:?}", avi.codec);
        }
        assert!(info.times_s.iter().zip([0.0, 4e-4, 8e-4]).all(|(time, truth)| (time - truth).abs() < 1e-15));
    }
}

#[test]
fn a_file_that_states_no_rate_takes_the_callers() {
    let (_folder, path) = written(&Avi { rate: 0, ..Avi::named(b"Y800", 8) }.bytes());
    let recording = open(&path).unwrap();
    assert_eq!(
        (recording.info().rate_hz, recording.info().times_s.as_slice()),
        (None, [0.0, 1.0, 2.0].as_slice())
    );
    let given = OpenOptions { rate_hz: Some(1000.0), ..OpenOptions::default() };
    let recording = open_with(&path, &given).unwrap();
    assert_eq!(
        (recording.info().rate_hz, recording.info().times_s[2].to_bits()),
        (Some(1000.0), 2e-3_f64.to_bits())
    );
    assert_eq!(counts(recording.as_ref(), 2), expected(30, 8));
}

#[test]
fn what_a_decoder_has_to_look_at_is_left_to_it() {
    let colours = Avi { row_bytes: 8, ..Avi::named(&[0; 4], 7) };
    for avi in [Avi::named(b"MJPG", 8), colours] {
        let (_folder, path) = written(&avi.bytes());
        assert!(needs_opencv(&path, &OpenOptions::default()), "{:?}", avi.codec);
        assert!(matches!(open(&path), Err(CameraError::NeedsOpenCv { .. })));
    }
}

#[test]
fn frames_that_were_left_out_are_named_and_leave_their_time() {
    let avi = Avi { frames: vec![Some(10), None, Some(30)], ..Avi::named(b"Y800", 8) };
    let (_folder, path) = written(&avi.bytes());
    let recording = open(&path).unwrap();
    let info = recording.info();
    assert_eq!((info.n_frames, info.times_s[1].to_bits()), (2, 8e-4_f64.to_bits()));
    assert!(
        info.warnings.iter().any(|warning| warning.contains("left out by the recorder")),
        "{:?}",
        info.warnings
    );
    assert_eq!(counts(recording.as_ref(), 1), expected(30, 8));
}

#[test]
fn a_file_cut_anywhere_gives_whole_frames_or_an_error() {
    let avi = Avi::named(b"Y800", 8);
    let bytes = avi.bytes();
    let mut n_read = 0;
    for end in 12..bytes.len() {
        let (_folder, path) = written(&bytes[..end]);
        let Ok(recording) = open(&path) else { continue };
        n_read += 1;
        let info = recording.info();
        let is_whole = info.n_frames == 3;
        let says_so = info.warnings.iter().any(|warning| warning.contains("cut short"));
        assert!(is_whole != says_so, "{end}: {:?}", info.warnings);
        for (frame, start) in [10, 20, 30].into_iter().enumerate().take(info.n_frames) {
            assert_eq!(counts(recording.as_ref(), frame), expected(start, 8), "{end}");
        }
    }
    assert!(n_read > 2 * 24, "cuts within two frames leave one whole: {n_read}");
}

#[test]
fn a_frame_of_another_size_is_refused_with_its_place() {
    let mut bytes = Avi::named(b"Y800", 8).bytes();
    let second = bytes.windows(4).enumerate().filter(|(_, name)| name == b"01db").nth(1).unwrap().0;
    bytes[second + 4] -= 2;
    let (_folder, path) = written(&bytes);
    let error = open(&path).err().unwrap().to_string();
    assert!(error.contains("size of frame 1 at byte") && error.contains("24 bytes"), "{error}");
    let given = OpenOptions { rate_hz: Some(1000.0), ..OpenOptions::default() };
    let (_folder, path) = written(&Avi::named(b"Y800", 8).bytes());
    let recording = open_with(&path, &given).unwrap();
    assert_eq!(recording.info().rate_hz, Some(1000.0));
}
