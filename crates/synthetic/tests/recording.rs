//! What a written recording holds, read back by a parser of the tests' own that follows the format's description.

#![cfg(test)]

use std::path::Path;

use chainwave_measurement::Trajectory;
use chainwave_synthetic::{Camera, FileFaults, Packing, Scene, Shot, Specimen, SyntheticError, film};
use ndarray::Array2;

const CAMERA: &str = r#"
width_px = 320
height_px = 96
rate_hz = 30000.0
exposure_s = 12e-6
packing = "16"
scale_px_per_m = 5000.0
[sensor]
bit_depth = 12
black_level = 64.0
read_noise_counts = 6.0
counts_per_electron = 0.2
"#;

const SPECIMEN: &str = r#"
n_bodies = 3
pitch_m = 0.030
ring = { semi_major_m = 15e-3, semi_minor_m = 9e-3, wall_m = 0.4e-3 }
marker = { half_width_m = 5.5e-3, half_height_m = 5.5e-3, speckle_diameter_px = 4.5, seed = 9 }
rods = { diameter_m = 2.38e-3, below_axis_m = [-7e-3, 7e-3] }
"#;

fn camera(packing: Packing) -> Camera {
    let mut camera: Camera = toml::from_str(CAMERA).unwrap();
    camera.packing = packing;
    if packing == Packing::Bits8 {
        camera.sensor.bit_depth = 8;
        camera.sensor.black_level = 4.0;
        camera.sensor.read_noise_counts = 0.5;
    }
    camera
}

fn specimen() -> Specimen {
    toml::from_str(SPECIMEN).unwrap()
}

fn shot() -> Shot {
    Shot {
        stage_m: 0.010,
        first_body_px: [120.25, 47.5],
        first_image: -7,
        n_frames: 20,
        trigger_delay_s: 2.5e-6,
        frame_phase_s: 1.3e-5,
        noise_seed: 77,
        view: 1,
        covers: Vec::new(),
    }
}

/// Body n starts at rest and accelerates at n * 4000 m/s^2; a cubic interpolant holds that exactly.
fn accelerated() -> Trajectory {
    let times_s = vec![0.0, 3.0e-4, 1.0e-3];
    let of = |f: fn(f64) -> f64| {
        Array2::from_shape_fn((3, 3), |(body, i)| 4000.0 * (body + 1) as f64 * f(times_s[i]))
    };
    Trajectory { displacement_m: of(|t| t * t / 2.0), velocity_m_per_s: of(|t| t), times_s: times_s.clone() }
}

fn filmed(path: &Path, packing: Packing) -> Vec<u8> {
    filmed_with(path, packing, &FileFaults::default())
}

fn filmed_with(path: &Path, packing: Packing, faults: &FileFaults) -> Vec<u8> {
    let (camera, specimen, shot, motion) = (camera(packing), specimen(), shot(), accelerated());
    film(path, &Scene::new(&camera, &specimen, &shot, &motion).unwrap(), faults).unwrap();
    std::fs::read(path).unwrap()
}

/// A .cine file's bytes, by the offsets of the format's description.
struct Cine<'a>(&'a [u8]);

impl Cine<'_> {
    fn u16(&self, at: usize) -> u16 {
        u16::from_le_bytes(self.0[at..at + 2].try_into().unwrap())
    }

    fn u32(&self, at: usize) -> u32 {
        u32::from_le_bytes(self.0[at..at + 4].try_into().unwrap())
    }

    fn u64(&self, at: usize) -> u64 {
        u64::from_le_bytes(self.0[at..at + 8].try_into().unwrap())
    }

    fn offset(&self, at: usize) -> usize {
        self.u32(at) as usize
    }

    fn text(&self, at: usize) -> &str {
        let end = self.0[at..].iter().position(|&byte| byte == 0).unwrap();
        std::str::from_utf8(&self.0[at..at + end]).unwrap()
    }

    /// (type, place of the data, bytes of data) of every tagged block; checks that the walk ends at the pointers.
    fn blocks(&self) -> Vec<(u16, usize, usize)> {
        let setup = self.offset(0x1C);
        let (mut at, end) = (setup + usize::from(self.u16(setup + 0x8E)), self.offset(0x20));
        let mut blocks = Vec::new();
        while at < end {
            let size = self.offset(at);
            blocks.push((self.u16(at + 4), at + 8, size - 8));
            at += size;
            assert_eq!(
                self.u16(at - size + 6),
                u16::from(at < end),
                "Reserved says whether another block follows"
            );
        }
        assert_eq!(at, end);
        blocks
    }

    /// The stored values of a frame, top row first.
    fn stored(&self, frame: usize) -> Vec<u32> {
        let bitmap = self.offset(0x18);
        let (width, height) = (self.offset(bitmap + 4), self.offset(bitmap + 8));
        let start = self.u64(self.offset(0x20) + 8 * frame) as usize;
        let annotation = self.offset(start);
        let size = self.offset(bitmap + 0x14);
        assert_eq!(self.offset(start + annotation - 4), size);
        let pixels = &self.0[start + annotation..start + annotation + size];
        let (bits, top_first) = match (self.u16(bitmap + 0x0E), self.u32(bitmap + 0x10)) {
            (16, 256) => (10, true),
            (16, 1024) => (12, true),
            (bits, 0) => (usize::from(bits), false),
            other => panic!("{other:?}"),
        };
        let row_of = |row: usize| if top_first { row } else { height - 1 - row };
        (0..width * height)
            .map(|pixel| row_of(pixel / width) * width + pixel % width)
            .map(|place| {
                if bits == 16 {
                    u32::from(pixels[2 * place]) + 256 * u32::from(pixels[2 * place + 1])
                } else {
                    bit_field(pixels, place * bits, bits)
                }
            })
            .collect()
    }
}

/// `n` bits from the bit `first` on, the most significant first: slow and plain.
fn bit_field(bytes: &[u8], first: usize, n: usize) -> u32 {
    (first..first + n).fold(0, |value, bit| value << 1 | u32::from(bytes[bit / 8] >> (7 - bit % 8) & 1))
}

/// The 12-bit count of a P10 code above black: the inverse of the Rec. 709 curve, within 1 of the cameras' table.
fn rec_709_count(code: u32) -> f64 {
    let signal = (f64::from(code) - 63.0) / (1014.0 - 63.0);
    let light = if signal < 0.081 { signal / 4.5 } else { ((signal + 0.099) / 1.099).powf(1.0 / 0.45) };
    (64.0 + 4000.0 * light).min(4095.0)
}

#[test]
fn the_headers_say_what_was_filmed() {
    let folder = tempfile::tempdir().unwrap();
    for (name, packing, bits, compression, depth, levels) in [
        ("8.cine", Packing::Bits8, 8, 0, 8, (4, 254)),
        ("16.cine", Packing::Bits16, 16, 0, 12, (64, 4064)),
        ("p10.cine", Packing::P10, 16, 256, 10, (64, 1014)),
        ("p12l.cine", Packing::P12L, 16, 1024, 12, (64, 4064)),
    ] {
        let bytes = filmed(&folder.path().join(name), packing);
        let cine = Cine(&bytes);
        assert_eq!(&bytes[..2], b"CI");
        assert_eq!([cine.u16(2), cine.u16(4), cine.u16(6)], [44, 0, 1]);
        assert_eq!([cine.u32(0x10), cine.u32(0x14)], [(-7_i32).cast_unsigned(), 20]);
        let (bitmap, setup) = (cine.offset(0x18), cine.offset(0x1C));
        assert_eq!([cine.u32(bitmap), cine.u32(bitmap + 4), cine.u32(bitmap + 8)], [40, 320, 96]);
        assert_eq!((cine.u16(bitmap + 0x0E), cine.u32(bitmap + 0x10)), (bits, compression));
        assert_eq!(cine.u32(bitmap + 0x24), 1 << depth);
        assert_eq!(&bytes[setup + 0x8C..setup + 0x8E], b"ST");
        assert_eq!((cine.u32(setup + 0x300), cine.u32(setup + 0x620)), (30_000, 12_000));
        assert_eq!(cine.u32(setup + 0x380), depth);
        assert_eq!((cine.u32(setup + 0x1664), cine.u32(setup + 0x1668)), levels);
        assert_eq!(cine.text(setup + 0x2790), "chainwave synthetic camera");
        assert_eq!(cine.u32(setup + 0x2894), 1.0_f32.to_bits());
        assert!(usize::from(cine.u16(setup + 0x8E)) >= 0x2898, "the setup block holds fDecimation");
    }
}

#[test]
fn stamps_and_exposures_are_exact_to_a_tick() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = filmed(&folder.path().join("a.cine"), Packing::Bits16);
    let cine = Cine(&bytes);
    let blocks = cine.blocks();
    assert_eq!(
        blocks.iter().map(|&(kind, _, size)| (kind, size)).collect::<Vec<_>>(),
        [(1002, 160), (1003, 80)]
    );
    let trigger = cine.u64(0x24);
    for frame in 0..20 {
        let ticks = cine.u64(blocks[0].1 + 8 * frame).wrapping_sub(trigger).cast_signed();
        let expected_s = 1.3e-5 + (frame as f64 - 7.0) / 30_000.0;
        // Half a tick of 2^-32 s, and rounding.
        assert!((ticks as f64 - expected_s * 2.0_f64.powi(32)).abs() < 0.5001);
        assert_eq!(cine.u32(blocks[1].1 + 4 * frame), (12.0e-6 * 2.0_f64.powi(32)).round() as u32);
    }
}

#[test]
fn every_packing_holds_the_recorded_counts() {
    let folder = tempfile::tempdir().unwrap();
    for (name, packing) in
        [("8", Packing::Bits8), ("16", Packing::Bits16), ("p10", Packing::P10), ("p12l", Packing::P12L)]
    {
        let bytes = filmed(&folder.path().join(name), packing);
        let cine = Cine(&bytes);
        let (camera, specimen, shot, motion) = (camera(packing), specimen(), shot(), accelerated());
        let scene = Scene::new(&camera, &specimen, &shot, &motion).unwrap();
        for frame in [0, 13, 19] {
            let counts = scene.recorded_counts(frame).unwrap();
            for (&stored, &count) in cine.stored(frame).iter().zip(&counts) {
                if packing == Packing::P10 {
                    // Half the largest distance between neighbouring codes above (5), and 1 for the formula.
                    let count = f64::from(count).clamp(64.0, 4064.0);
                    assert!((rec_709_count(stored) - count).abs() <= 5.5, "{stored} {count}");
                } else {
                    assert_eq!(stored, count as u32);
                }
            }
        }
        let last = cine.u64(cine.offset(0x20) + 8 * 19) as usize;
        assert_eq!(bytes.len(), last + 8 + cine.offset(cine.offset(0x18) + 0x14));
    }
}

#[test]
fn equal_settings_give_equal_bytes_in_any_thread() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["a", "b", "c"].map(|name| folder.path().join(name));
    let all: Vec<Vec<u8>> = std::thread::scope(|scope| {
        let threads: Vec<_> = names.iter().map(|path| scope.spawn(|| filmed(path, Packing::P12L))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(all[0] == all[1] && all[0] == all[2]);
    let files = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(files, 3, "no part is left behind");
}

fn digest_of(bytes: &[u8]) -> u64 {
    chainwave_testkit::digest(bytes.iter().copied().map(u64::from))
}

#[test]
fn with_every_effect_off_the_bytes_are_those_of_the_plain_camera() {
    let folder = tempfile::tempdir().unwrap();
    // Digests of the files as they were before the camera had any effect to switch off.
    for (name, packing, golden) in [
        ("8", Packing::Bits8, 0xF43F_D6D3_1AE4_FDB5),
        ("16", Packing::Bits16, 0xB68D_FCB5_2980_5EFE),
        ("p10", Packing::P10, 0xC235_A2BF_234F_8557),
        ("p12l", Packing::P12L, 0x7E7B_C507_CD15_C6DF_u64),
    ] {
        let found = digest_of(&filmed(&folder.path().join(name), packing));
        assert_eq!(found, golden, "{name}: {found:#X}");
    }
}

#[test]
fn optics_light_and_motion_blur_are_what_they_were_without_effects() {
    let folder = tempfile::tempdir().unwrap();
    let optics = r#"
        optics = { focal_length_px = 3000.0, k1 = 0.4, roll_rad = 2e-3, yaw_rad = 0.03 }
        lighting = { drift_per_s = 2.0, flicker_amplitude = 0.03, flicker_hz = 900.0 }
        blur = true
    "#;
    let light = r#"
        lighting = { drift_per_s = 2.0, flicker_amplitude = 0.03, flicker_hz = 900.0 }
        blur = true
    "#;
    // Digests of the files as they were before fixed patterns, shaking and the like could be switched on.
    for (name, keys, golden) in
        [("warped", optics, 0xBBD9_331C_E049_5963_u64), ("blurred", light, 0xB0DF_9275_60B9_66E8)]
    {
        let camera: Camera = toml::from_str(&format!("{keys}{CAMERA}")).unwrap();
        let (specimen, shot, motion) = (specimen(), shot(), accelerated());
        let path = folder.path().join(name);
        film(&path, &Scene::new(&camera, &specimen, &shot, &motion).unwrap(), &FileFaults::default())
            .unwrap();
        let found = digest_of(&std::fs::read(&path).unwrap());
        assert_eq!(found, golden, "{name}: {found:#X}");
    }
}

#[test]
fn a_recording_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing").join("a.cine");
    let (camera, specimen, shot, motion) = (camera(Packing::Bits16), specimen(), shot(), accelerated());
    let scene = Scene::new(&camera, &specimen, &shot, &motion).unwrap();
    let error = film(&path, &scene, &FileFaults::default()).unwrap_err();
    assert!(
        matches!(&error, SyntheticError::Write { .. }) && error.to_string().contains("a.cine"),
        "{error}"
    );
    let taken = folder.path().join("taken");
    std::fs::create_dir(&taken).unwrap();
    assert!(film(&taken, &scene, &FileFaults::default()).is_err());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "the part is removed");
}

#[test]
fn dropped_frames_are_missing_and_the_stamps_tell() {
    let folder = tempfile::tempdir().unwrap();
    let whole_bytes = filmed(&folder.path().join("whole"), Packing::Bits16);
    let faults = FileFaults { dropped_frames: Some(5..8), ..FileFaults::default() };
    let bytes = filmed_with(&folder.path().join("dropped"), Packing::Bits16, &faults);
    let (whole, cine) = (Cine(&whole_bytes), Cine(&bytes));
    assert_eq!((cine.u32(0x10), cine.u32(0x14)), (whole.u32(0x10), 17));
    let stamp = |cine: &Cine<'_>, frame: usize| cine.u64(cine.blocks()[0].1 + 8 * frame);
    for (frame, shown) in [(4, 4), (5, 8), (16, 19)] {
        assert_eq!(stamp(&cine, frame), stamp(&whole, shown));
        assert_eq!(cine.stored(frame), whole.stored(shown));
    }
}

#[test]
fn a_file_that_lacks_its_first_frames_begins_with_the_number_of_the_next() {
    let folder = tempfile::tempdir().unwrap();
    let whole_bytes = filmed(&folder.path().join("whole"), Packing::Bits16);
    let faults = FileFaults { dropped_frames: Some(0..3), ..FileFaults::default() };
    let bytes = filmed_with(&folder.path().join("dropped"), Packing::Bits16, &faults);
    let (whole, cine) = (Cine(&whole_bytes), Cine(&bytes));
    assert_eq!(cine.u32(0x10) as i32, whole.u32(0x10) as i32 + 3);
    // The number by its own time stamp.
    let stamp = |cine: &Cine<'_>, frame: usize| cine.u64(cine.blocks()[0].1 + 8 * frame);
    assert_eq!(stamp(&cine, 0), stamp(&whole, 3));
}

#[test]
fn a_clock_that_is_off_states_all_times_so() {
    let folder = tempfile::tempdir().unwrap();
    let whole_bytes = filmed(&folder.path().join("whole"), Packing::P10);
    let faults = FileFaults { clock_rate_hz: Some(24_000.0), ..FileFaults::default() };
    let bytes = filmed_with(&folder.path().join("slow"), Packing::P10, &faults);
    let (whole, cine) = (Cine(&whole_bytes), Cine(&bytes));
    assert_eq!(cine.u32(cine.offset(0x1C) + 0x300), 24_000);
    let rate_hz = f64::from(whole.u32(whole.offset(0x1C) + 0x300));
    let after_first = |cine: &Cine<'_>, frame: usize| {
        (cine.u64(cine.blocks()[0].1 + 8 * frame) - cine.u64(cine.blocks()[0].1)) as f64
    };
    let ratio = after_first(&cine, 12) / after_first(&whole, 12);
    // Stamps are rounded to 2^-32 s, four of which are 1e-9 s of some hundred microseconds.
    assert!((ratio * 24_000.0 / rate_hz - 1.0).abs() < 1e-5, "{ratio}");
    assert_eq!(cine.stored(7), whole.stored(7));
}

#[test]
fn a_wrong_rate_stands_in_the_header_alone() {
    let folder = tempfile::tempdir().unwrap();
    let whole = filmed(&folder.path().join("whole"), Packing::P10);
    let faults = FileFaults { header_rate_hz: Some(24_000.0), ..FileFaults::default() };
    let bytes = filmed_with(&folder.path().join("wrong"), Packing::P10, &faults);
    let setup = Cine(&bytes).offset(0x1C);
    assert_eq!(Cine(&bytes).u32(setup + 0x300), 24_000);
    let differing = whole.iter().zip(&bytes).enumerate().filter(|(_, (right, wrong))| right != wrong);
    let elsewhere = differing.map(|(at, _)| at).filter(|at| !(setup..setup + 2).contains(at));
    assert!(
        elsewhere.clone().all(|at| (setup + 0x300..setup + 0x304).contains(&at)),
        "{:?}",
        elsewhere.count()
    );
}

#[test]
fn a_truncated_file_is_the_start_of_the_whole_one() {
    let folder = tempfile::tempdir().unwrap();
    let whole = filmed(&folder.path().join("whole"), Packing::Bits8);
    for kept in [0.0, 0.01, 0.6] {
        let faults = FileFaults { kept_fraction: Some(kept), ..FileFaults::default() };
        let bytes = filmed_with(&folder.path().join("short"), Packing::Bits8, &faults);
        assert_eq!(bytes.len(), (kept * whole.len() as f64) as usize);
        assert!(whole.starts_with(&bytes));
    }
}

#[test]
fn an_impossible_fault_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let (camera, specimen, shot, motion) = (camera(Packing::Bits16), specimen(), shot(), accelerated());
    let scene = Scene::new(&camera, &specimen, &shot, &motion).unwrap();
    let none = FileFaults::default();
    for (name, faults) in [
        ("faults.dropped_frames", FileFaults { dropped_frames: Some(0..20), ..none.clone() }),
        ("faults.header_rate_hz", FileFaults { header_rate_hz: Some(f64::NAN), ..none.clone() }),
        ("faults.clock_rate_hz", FileFaults { clock_rate_hz: Some(0.5), ..none.clone() }),
        ("faults.kept_fraction", FileFaults { kept_fraction: Some(1.5), ..none }),
    ] {
        let message = film(&folder.path().join("a"), &scene, &faults).unwrap_err().to_string();
        assert!(message.contains(name), "{message}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
