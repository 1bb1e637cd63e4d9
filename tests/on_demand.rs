//! OpenCV on demand: `chainwave` becomes `chainwave-opencv` where something takes OpenCV, and says what is missing where there is none.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

use crate::support::command::{chainwave, fail};
use crate::support::repository::root;

const SIDE_PX: u32 = 64;
const N_FRAMES: u32 = 6;

/// Grey of a pixel: stripes that move along by a pixel a frame.
fn grey(frame: u32, x: u32) -> u8 {
    (40 + (x + frame) % 16 * 10) as u8
}

/// A chunk of a RIFF file.
fn chunk(name: &[u8; 4], parts: &[Vec<u8>]) -> Vec<u8> {
    let inside = parts.concat();
    let mut bytes = name.to_vec();
    bytes.extend((inside.len() as u32).to_le_bytes());
    bytes.extend(&inside);
    bytes.resize(bytes.len().next_multiple_of(2), 0);
    bytes
}

fn numbers(numbers: &[u32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// An AVI of uncompressed frames at 25 Hz, by the description of the format: gray, but written in colours, which takes a decoder.
fn video() -> Vec<u8> {
    let n_bytes = 3 * SIDE_PX * SIDE_PX;
    let frame = |k: u32| (0..n_bytes).map(|at| grey(k, at / 3 % SIDE_PX)).collect::<Vec<u8>>();
    let frames: Vec<Vec<u8>> = (0..N_FRAMES).map(|k| chunk(b"00dc", &[frame(k)])).collect();
    let index: Vec<Vec<u8>> = (0..N_FRAMES)
        .map(|k| [b"00dc".to_vec(), numbers(&[0x10, 4 + k * (n_bytes + 8), n_bytes])].concat())
        .collect();
    let main = numbers(&[40_000, 0, 0, 0x10, N_FRAMES, 0, 1, n_bytes, SIDE_PX, SIDE_PX, 0, 0, 0, 0]);
    let stream = [b"vids".to_vec(), numbers(&[0, 0, 0, 0, 1, 25, 0, N_FRAMES, n_bytes, 0, 0, 0, 0])].concat();
    let planes_and_bits = numbers(&[1 | 24 << 16]);
    let picture =
        [numbers(&[40, SIDE_PX, SIDE_PX]), planes_and_bits, numbers(&[0, n_bytes, 0, 0, 0, 0])].concat();
    let list = |name: &[u8; 4], parts: &[Vec<u8>]| chunk(b"LIST", &[name.to_vec(), parts.concat()]);
    let streams = list(b"strl", &[chunk(b"strh", &[stream]), chunk(b"strf", &[picture])]);
    let header = list(b"hdrl", &[chunk(b"avih", &[main]), streams]);
    chunk(b"RIFF", &[b"AVI ".to_vec(), header, list(b"movi", &frames), chunk(b"idx1", &index)])
}

/// A folder with a video, points for it and for the project's sample.
struct Inputs {
    folder: TempDir,
}

impl Inputs {
    fn new() -> Self {
        let inputs = Self { folder: TempDir::new().expect("a temporary folder can be made") };
        fs::write(inputs.path("strike.avi"), video()).expect("the video can be written");
        let points = "name,x_px,y_px,half_width_px,half_height_px\na,25,19.5,11,11\n";
        fs::write(inputs.path("points.csv"), points).expect("the points can be written");
        inputs
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The arguments that track recordings into a table.
    fn track(&self, recordings: &[&Path]) -> Vec<PathBuf> {
        let mut words: Vec<PathBuf> = vec!["track".into()];
        words.extend(recordings.iter().map(|recording| recording.to_path_buf()));
        words.extend(["--points".into(), self.path("points.csv"), "--out".into(), self.path("tracks.csv")]);
        words
    }
}

fn sample() -> PathBuf {
    root().join("data-samples/hec-view1-trial1.cine")
}

/// The command in a folder by itself, where no path leads to another program.
struct Alone {
    folder: TempDir,
}

impl Alone {
    /// Under these names.
    fn named(names: &[&str]) -> Self {
        let alone = Self { folder: TempDir::new().expect("a temporary folder can be made") };
        let program = chainwave().get_program().to_owned();
        for name in names {
            let copy = alone.folder.path().join(name);
            let linked = fs::hard_link(&program, &copy);
            linked.or_else(|_| fs::copy(&program, &copy).map(drop)).expect("the command can be copied");
        }
        alone
    }

    fn chainwave(&self) -> Command {
        let mut command = Command::new(self.folder.path().join("chainwave"));
        command.env("PATH", self.folder.path());
        command
    }
}

#[test]
fn without_opencv_a_command_says_what_takes_it() {
    let (inputs, alone) = (Inputs::new(), Alone::named(&["chainwave"]));
    let video = inputs.path("strike.avi");
    let said = fail(alone.chainwave().arg("inspect").arg(&video), 2);
    assert!(said.contains("strike.avi: video takes OpenCV"), "{said}");
    assert!(said.contains("cargo build --release -p chainwave-opencv"), "{said}");
    assert!(said.contains("no chainwave-opencv beside this program"), "{said}");

    let by_opencv = inputs.track(&[&sample()]);
    let said = fail(alone.chainwave().args(by_opencv).args(["--method", "opencv-lk"]), 2);
    assert!(said.contains("method opencv-lk takes OpenCV"), "{said}");
    assert!(!inputs.path("tracks.csv").exists());

    let mut calibrate = alone.chainwave();
    calibrate.arg("calibrate").arg(sample()).args(["--board", "checkerboard", "--columns", "10"]);
    let said =
        fail(calibrate.args(["--rows", "7", "--square-m", "0.003", "--out"]).arg(inputs.path("c.toml")), 2);
    assert!(said.contains("a calibration board takes OpenCV"), "{said}");
}

#[test]
fn without_opencv_the_other_recordings_are_done() {
    let (inputs, alone) = (Inputs::new(), Alone::named(&["chainwave"]));
    let said = fail(alone.chainwave().args(inputs.track(&[&inputs.path("strike.avi"), &sample()])), 1);
    assert!(said.contains("strike.avi: video takes OpenCV"), "{said}");
    let tracks = fs::read_to_string(inputs.path("tracks.csv")).expect("the table was written");
    assert!(tracks.contains("hec-view1-trial1.cine") && !tracks.contains("strike.avi"));
}

#[test]
fn a_choice_without_opencv_says_what_is_left_out() {
    let (inputs, alone) = (Inputs::new(), Alone::named(&["chainwave"]));
    let mut track = alone.chainwave();
    let output =
        track.args(inputs.track(&[&sample()])).args(["--accuracy", "0.2"]).output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("OpenCV's methods are left out"), "{said}");
}

#[test]
fn a_command_is_handed_over_once() {
    let (inputs, alone) = (Inputs::new(), Alone::named(&["chainwave", "chainwave-opencv"]));
    let said = fail(alone.chainwave().arg("inspect").arg(inputs.path("strike.avi")), 2);
    assert!(said.contains("video takes OpenCV"), "{said}");
}

#[cfg(feature = "opencv")]
mod with_opencv {
    use super::*;
    use crate::support::command::succeed;

    #[test]
    fn a_video_is_read_as_it_was_written() {
        let inputs = Inputs::new();
        let (video, frame) = (inputs.path("strike.avi"), inputs.path("frame.tif"));
        let said = succeed(chainwave().arg("inspect").arg(&video).arg("--json"));
        let told: serde_json::Value = serde_json::from_str(&said).expect("it is JSON");
        assert_eq!((&told["format"], &told["n_frames"]), (&"AVI video".into(), &N_FRAMES.into()), "{told}");
        let options = ["--frame", "3", "--out"];
        succeed(chainwave().arg("inspect").arg(&video).args(options).arg(&frame));
        let file = fs::File::open(&frame).expect("the frame was written");
        let mut decoder = tiff::decoder::Decoder::new(file).expect("it is a TIFF");
        let Ok(tiff::decoder::DecodingResult::U16(counts)) = decoder.read_image() else {
            panic!("expected 16 bits a pixel");
        };
        // Three colours go into grey, rounded to a whole count.
        let is_near = |(at, count): (usize, &u16)| {
            i32::from(*count).abs_diff(i32::from(grey(3, at as u32 % SIDE_PX))) <= 1
        };
        assert!(counts.iter().enumerate().all(is_near), "{:?}", &counts[..32]);
    }

    #[test]
    fn a_method_of_opencv_tracks_and_nothing_else_is_written() {
        let inputs = Inputs::new();
        succeed(chainwave().args(inputs.track(&[&sample()])).args(["--method", "opencv-lk"]));
        let tracks = fs::read_to_string(inputs.path("tracks.csv")).expect("the table was written");
        assert!(tracks.contains("opencv-lk"), "{tracks}");
        let n_files = fs::read_dir(inputs.folder.path()).expect("the folder can be listed").count();
        assert_eq!(n_files, 3, "the video, the points and the tracks");
    }

    #[test]
    fn one_recording_that_takes_opencv_takes_the_whole_command_with_it() {
        let inputs = Inputs::new();
        let words = inputs.track(&[&sample(), &inputs.path("strike.avi")]);
        let output = chainwave().args(words).output().expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!said.contains("takes OpenCV"), "{said}");
        let tracks = fs::read_to_string(inputs.path("tracks.csv")).expect("the table was written");
        assert!(tracks.contains("hec-view1-trial1.cine") && tracks.contains("strike.avi"), "{said}");
    }
}
