//! .mraw files of known content with both kinds of header, read back.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use chainwave_camera::{CameraError, OpenOptions, open, open_with};
use chainwave_measurement::{Recording, Region};
use tempfile::TempDir;

use crate::common::{as_counts, frame, has_warning};
use crate::writer::{codes, packed};

/// What to write; every default is a plain pair of files with two 16x4 frames of 12 of 16 bits.
pub(crate) struct MrawFile {
    pub(crate) stored_bits: u32,
    pub(crate) colour: &'static str,
    pub(crate) depth: u32,
    pub(crate) side: &'static str,
    pub(crate) width_px: usize,
    pub(crate) height_px: usize,
    /// Stored values of each frame.
    pub(crate) frames: Vec<Vec<u16>>,
    pub(crate) n_recorded: usize,
    pub(crate) start: i64,
    pub(crate) trigger: i64,
    pub(crate) step: u64,
    pub(crate) rest: Vec<u8>,
}

impl Default for MrawFile {
    fn default() -> Self {
        Self {
            stored_bits: 16,
            colour: "Mono",
            depth: 12,
            side: "Lower",
            width_px: 16,
            height_px: 4,
            frames: vec![codes(64, 4095, 1), codes(64, 4095, 2)],
            n_recorded: 1000,
            start: 0,
            trigger: 0,
            step: 1,
            rest: Vec::new(),
        }
    }
}

impl MrawFile {
    pub(crate) fn cih(&self) -> String {
        let mut text = "#Camera Information Header\r\nCamera Type : FASTCAM SA-Z\r\n".to_owned();
        for (name, value) in [
            ("Record Rate(fps)", "20000".into()),
            ("Shutter Speed(s)", "1/40000".into()),
            ("Original Total Frame", self.n_recorded.to_string()),
            ("Total Frame", self.frames.len().to_string()),
            ("Start Frame", self.start.to_string()),
            ("Correct Trigger Frame", self.trigger.to_string()),
            ("Save Step", self.step.to_string()),
            ("Image Width", self.width_px.to_string()),
            ("Image Height", self.height_px.to_string()),
            ("Color Type", self.colour.into()),
            ("Color Bit", self.stored_bits.to_string()),
            ("File Format", "MRaw".into()),
            ("EffectiveBit Depth", self.depth.to_string()),
            ("EffectiveBit Side", self.side.into()),
        ] {
            write!(text, "{name} : {value}\r\n").unwrap();
        }
        text + "\r\nImage Width : 1\r\nEND\r\n"
    }

    pub(crate) fn cihx(&self) -> Vec<u8> {
        let mut bytes = b"!!! This file can not be edited. !!!".to_vec();
        bytes.resize(0x100, 0);
        bytes.extend(b"CIHX\x01\0\0\0");
        bytes.resize(0x13C, 0);
        let (width, height, n_frames) = (self.width_px, self.height_px, self.frames.len());
        let (bits, depth, side, colour) = (self.stored_bits, self.depth, self.side, self.colour);
        let (n_recorded, start, trigger, step) = (self.n_recorded, self.start, self.trigger, self.step);
        let xml = format!(
            "<?xml version='1.0' encoding='UTF-8'?>\n<cih>\n<imageFileInfo><fileFormat>Mraw</fileFormat>\
             <resolution><width>1</width><height>1</height></resolution></imageFileInfo>\
             <imageDataInfo><resolution><width>{width}</width><height>{height}</height></resolution>\
             <colorInfo><type>{colour}</type><bit>{bits}</bit></colorInfo>\
             <effectiveBit><depth>{depth}</depth><side>{side}</side></effectiveBit></imageDataInfo>\
             <frameInfo><recordedFrame>{n_recorded}</recordedFrame><totalFrame>{n_frames}</totalFrame>\
             <startFrame>{start}</startFrame><correctTriggerFrame>{trigger}</correctTriggerFrame>\
             <skipFrame>{step}</skipFrame></frameInfo><basicInfo><comment></comment></basicInfo>\
             <recordInfo><recordRate>20000</recordRate><shutterSpeed>40000</shutterSpeed>\
             <shutterSpeedNsec>25000</shutterSpeedNsec></recordInfo>\
             <deviceInfo><deviceName>FASTCAM SA-Z</deviceName></deviceInfo></cih>\n"
        );
        bytes.extend(xml.as_bytes());
        bytes
    }

    pub(crate) fn pixels(&self) -> Vec<u8> {
        let frame = |codes: &Vec<u16>| match self.stored_bits {
            8 => codes.iter().map(|&code| code as u8).collect(),
            16 => codes.iter().flat_map(|code| code.to_le_bytes()).collect(),
            bits => packed(codes, bits as usize),
        };
        let frames: Vec<u8> = self.frames.iter().flat_map(frame).collect();
        [frames, self.rest.clone()].concat()
    }

    /// Writes the pair into a folder that lives as long as the first returned value; the paths of pixels and header.
    pub(crate) fn write(&self, extension: &str) -> (TempDir, PathBuf, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let pixels = folder.path().join("shot.mraw");
        let header = pixels.with_extension(extension);
        std::fs::write(&pixels, self.pixels()).unwrap();
        let text = if extension == "cihx" { self.cihx() } else { self.cih().into_bytes() };
        std::fs::write(&header, text).unwrap();
        (folder, pixels, header)
    }

    fn open(&self) -> Box<dyn Recording> {
        open(&self.write("cih").1).unwrap()
    }

    fn refusal(&self) -> CameraError {
        open(&self.write("cih").1).err().expect("the file should be refused")
    }
}

#[test]
fn every_storage_gives_back_its_counts_from_either_file_of_either_kind() {
    for (stored_bits, depth, high) in [(8, 8, 255), (10, 10, 1023), (12, 12, 4095), (16, 12, 4095)] {
        let frames = vec![codes(64, high, 1), codes(64, high, 2)];
        let file = MrawFile { stored_bits, depth, frames: frames.clone(), ..MrawFile::default() };
        for extension in ["cih", "CIH", "cihx"] {
            let (_folder, pixels, header) = file.write(extension);
            for path in [pixels.clone(), header.clone()] {
                assert_eq!(chainwave_camera::files_of(&path).unwrap(), [header.clone(), pixels.clone()]);
                let recording = open(&path).unwrap();
                let info = recording.info();
                assert_eq!((info.format.clone(), info.bit_depth), (format!("mraw {stored_bits} bit"), depth));
                assert_eq!((info.width_px, info.height_px, info.n_frames), (16, 4, 2));
                assert_eq!((info.rate_hz, info.camera.as_deref()), (Some(20_000.0), Some("FASTCAM SA-Z")));
                assert!((info.exposure_s.unwrap() - 25e-6).abs() < 1e-18);
                assert_eq!(info.warnings.len(), 1, "{:?}", info.warnings);
                for (index, codes) in frames.iter().enumerate() {
                    assert_eq!(frame(&*recording, index), as_counts(codes), "{stored_bits} {extension}");
                }
            }
        }
    }
}

#[test]
fn counts_stored_on_the_higher_side_are_moved_down() {
    let counts = [codes(64, 4095, 1), codes(64, 4095, 2)];
    let frames = counts.iter().map(|codes| codes.iter().map(|code| code << 4).collect()).collect();
    let file = MrawFile { side: "Higher", frames, ..MrawFile::default() };
    let recording = file.open();
    assert_eq!((recording.info().bit_depth, frame(&*recording, 1)), (12, as_counts(&counts[1])));
    assert_eq!(recording.info().warnings.len(), 1);
}

#[test]
fn bits_that_contradict_the_header_or_were_lost_are_named() {
    let wide = MrawFile { frames: vec![codes(64, 60_000, 1)], ..MrawFile::default() };
    for side in ["Lower", "Higher"] {
        let recording = MrawFile { side, frames: wide.frames.clone(), ..MrawFile::default() }.open();
        assert_eq!((recording.info().bit_depth, frame(&*recording, 0)), (16, as_counts(&wide.frames[0])));
        assert!(has_warning(&*recording, "all 16 are taken"));
    }
    for (side, part) in [("Higher", "only the highest 8 of the camera's 12"), ("Lower", "wrapped round")] {
        let frames = vec![codes(64, 255, 1)];
        let recording = MrawFile { stored_bits: 8, side, frames, ..MrawFile::default() }.open();
        assert!(has_warning(&*recording, part) && recording.info().bit_depth == 8);
    }
}

#[test]
fn times_follow_start_trigger_and_step() {
    let file = MrawFile { start: -50, trigger: -30, step: 10, ..MrawFile::default() };
    let recording = file.open();
    let info = recording.info();
    assert_eq!((info.first_image, info.rate_hz), (-20, Some(2_000.0)));
    assert_eq!(info.times_s, [-20.0 / 20_000.0, -10.0 / 20_000.0]);
    assert!(has_warning(&*recording, "one frame in 10") && has_warning(&*recording, "trigger to frame -30"));

    let options = OpenOptions { rate_hz: Some(500.0), ..OpenOptions::default() };
    let recording = open_with(&file.write("cihx").1, &options).unwrap();
    // Two of the saved frames lie from the first one to the trigger.
    assert_eq!(recording.info().times_s, [-4e-3, -2e-3]);
    assert_eq!(recording.info().rate_hz, Some(500.0));
}

#[test]
fn a_header_that_contradicts_itself_or_the_file_is_surfaced() {
    let recording = MrawFile { step: 2500, n_recorded: 400, ..MrawFile::default() }.open();
    assert!(has_warning(&*recording, "one in 2500 saved, cannot come from 400"));
    let recording = MrawFile { rest: vec![0; 130], ..MrawFile::default() }.open();
    assert!(has_warning(&*recording, "130 bytes follow the 2 frames") && recording.info().n_frames == 2);
}

#[test]
fn what_is_not_plain_gray_or_not_there_is_refused_with_its_reason() {
    for file in [
        MrawFile { colour: "Color", ..MrawFile::default() },
        MrawFile { colour: "Raw", ..MrawFile::default() },
        MrawFile { stored_bits: 24, ..MrawFile::default() },
    ] {
        assert!(matches!(file.refusal(), CameraError::Colour { .. }));
    }
    let odd = MrawFile { stored_bits: 12, width_px: 15, ..MrawFile::default() };
    assert!(odd.refusal().to_string().contains("a multiple of 2 pixels"));
    let short = MrawFile { height_px: 5, ..MrawFile::default() };
    assert!(matches!(short.refusal(), CameraError::Truncated { .. }));

    let (_folder, pixels, header) = MrawFile::default().write("cih");
    std::fs::remove_file(&header).unwrap();
    assert!(open(&pixels).err().unwrap().to_string().contains("put a .cih or .cihx"));
    let (_folder, pixels, header) = MrawFile::default().write("cih");
    std::fs::remove_file(&pixels).unwrap();
    assert!(open(&header).err().unwrap().to_string().contains("put a .mraw"));
}

#[test]
fn an_exposure_longer_than_a_frame_is_no_reciprocal() {
    // 20000 frames a second are recorded.
    for (written, expected_s, remark) in [
        ("1/40000", Some(25e-6), None),
        ("40000", Some(25e-6), None),
        ("1/20000", Some(50e-6), None),
        ("0.00002", Some(20e-6), Some("0.00002 s are taken")),
        ("1/1000", None, Some("no exposure is taken")),
        ("1000", None, Some("no exposure is taken")),
        ("0", None, None),
    ] {
        let (_folder, pixels, header) = MrawFile::default().write("cih");
        let text = MrawFile::default().cih().replace("1/40000", written);
        std::fs::write(&header, text).unwrap();
        let recording = open(&pixels).unwrap();
        let info = recording.info();
        match (info.exposure_s, expected_s) {
            (Some(found), Some(expected)) => assert!((found - expected).abs() < 1e-18, "{written}: {found}"),
            (found, expected) => assert_eq!(found, expected, "{written}"),
        }
        let found: Vec<&String> =
            info.warnings.iter().filter(|warning| warning.contains("Shutter Speed")).collect();
        assert_eq!(found.len(), usize::from(remark.is_some()), "{written}: {found:?}");
        assert!(remark.is_none_or(|part| found[0].contains(part)), "{written}: {found:?}");
    }
}

#[test]
fn a_header_that_an_editor_marked_as_utf_8_is_read() {
    let (_folder, pixels, header) = MrawFile::default().write("cih");
    std::fs::write(&header, [&b"\xEF\xBB\xBF"[..], MrawFile::default().cih().as_bytes()].concat()).unwrap();
    for path in [&pixels, &header] {
        assert_eq!(open(path).unwrap().info().rate_hz, Some(20_000.0));
    }
}

#[test]
fn a_rate_that_is_none_is_refused() {
    for rate_hz in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = OpenOptions { rate_hz: Some(rate_hz), ..OpenOptions::default() };
        assert!(matches!(open_with(Path::new("any"), &options), Err(CameraError::FrameRate { .. })));
    }
}

#[test]
fn frames_beyond_four_gigabytes_are_read() {
    use std::io::{Seek, SeekFrom, Write};
    let n_frames = 700;
    let file = MrawFile {
        width_px: 4096,
        height_px: 1024,
        frames: vec![codes(4096 * 1024, 4095, 7)],
        ..MrawFile::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.mraw");
    let header = file.cih().replace("\nTotal Frame : 1\r", &format!("\nTotal Frame : {n_frames}\r"));
    std::fs::write(path.with_extension("cih"), header).unwrap();
    // All but the last frame is a hole in the file.
    let pixels = file.pixels();
    let mut on_disk = std::fs::File::create(&path).unwrap();
    on_disk.seek(SeekFrom::Start((n_frames - 1) * pixels.len() as u64)).unwrap();
    on_disk.write_all(&pixels).unwrap();
    let recording = open(&path).unwrap();
    let region = Region { x: 4000, y: 1000, width: 41, height: 20 };
    let mut counts = vec![f32::NAN; region.n_pixels()];
    recording.read_region(699, region, &mut counts).unwrap();
    let row = |y: usize| as_counts(&file.frames[0][4096 * y + 4000..4096 * y + 4041]);
    assert_eq!(counts, (1000..1020).flat_map(row).collect::<Vec<_>>());
}
