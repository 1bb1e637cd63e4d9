//! Dark level, gain and defects of sensors that are known, found and taken out.

use std::path::PathBuf;
use std::sync::Arc;

use chainwave_camera::{
    CameraError, Corrected, DefectKind, DefectMap, OpenOptions, PixelStatistics, SensorCorrection, open,
    open_with,
};
use chainwave_measurement::{Recording, Region};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use tempfile::TempDir;

use crate::common::frame;
use crate::images::npy_bytes;
use crate::writer::{codes, written};

const WIDTH: usize = 48;
const HEIGHT: usize = 20;

/// A file of frames of 16 bits.
fn file(frames: &[Vec<u16>]) -> (TempDir, PathBuf) {
    let shape = (frames.len(), HEIGHT, WIDTH);
    let header = format!("{{'descr': '<u2', 'fortran_order': False, 'shape': {shape:?}, }}\n");
    written(&npy_bytes(
        &header,
        &frames.concat().iter().flat_map(|code| code.to_le_bytes()).collect::<Vec<u8>>(),
    ))
}

fn opened(frames: &[Vec<u16>]) -> (TempDir, Box<dyn Recording>) {
    let (folder, path) = file(frames);
    let recording = open(&path).unwrap();
    (folder, recording)
}

/// Response of a pixel to light, in binary fractions, so that counts are whole numbers.
fn response(at: usize) -> f64 {
    [1.0, 0.875, 1.125, 1.0, 1.0][at % 5]
}

fn dark_level(at: usize) -> f64 {
    64.0 + (at * 7 % 3) as f64
}

/// What the sensor makes of light.
fn seen(light: impl Fn(usize) -> f64) -> Vec<u16> {
    (0..WIDTH * HEIGHT).map(|at| (dark_level(at) + response(at) * light(at)) as u16).collect()
}

/// Light that is a multiple of eight: flat, a ramp and a texture.
fn scene(at: usize) -> f64 {
    800.0 + 8.0 * (at % WIDTH) as f64 + 8.0 * f64::from(codes(1, 31, at as u32)[0])
}

#[test]
fn what_was_seen_is_turned_back_into_light() {
    let (_dark_folder, dark) = opened(&[seen(|_| 0.0), seen(|_| 0.0)]);
    let (_flat_folder, flat) = opened(&[seen(|_| 8000.0), seen(|_| 16_000.0)]);
    let correction = SensorCorrection::from_flat(&*flat, Some(&*dark)).unwrap();
    assert_eq!(correction.defects().defects(), []);
    let (_folder, recording) = opened(&[seen(scene), seen(|at| 2.0 * scene(at))]);
    let corrected = Corrected::new(recording, Arc::new(correction)).unwrap();
    assert!(corrected.info().warnings.iter().any(|text| text.contains("2 frames of a flat field")));
    for (index, share) in [(0, 1.0), (1, 2.0)] {
        for (at, light) in frame(&corrected, index).into_iter().enumerate() {
            // Two roundings of single precision.
            let expected = (share * scene(at)) as f32;
            assert!((light / expected - 1.0).abs() < 4.0 * f32::EPSILON, "{at}: {light} for {expected}");
        }
    }
}

#[test]
fn a_dark_level_alone_is_taken_off_and_may_leave_less_than_nothing() {
    let (_dark_folder, dark) = opened(&[seen(|_| 0.0)]);
    let correction = SensorCorrection::from_dark(&*dark).unwrap();
    assert_eq!((correction.dark_sigma_counts(), correction.gain_sigma()), (None, None));
    let raw = vec![60; WIDTH * HEIGHT];
    let (_folder, recording) = opened(std::slice::from_ref(&raw));
    let corrected = Corrected::new(recording, Arc::new(correction)).unwrap();
    let expected: Vec<f32> = (0..raw.len()).map(|at| 60.0 - dark_level(at) as f32).collect();
    assert_eq!(frame(&corrected, 0), expected);
    assert!(corrected.info().warnings.iter().any(|text| text.contains("one frame does not tell its noise")));
}

/// Defects of the tests: hot, dead, two side by side, and one in a corner.
const DEFECTS: [(usize, usize, DefectKind); 5] = [
    (10, 8, DefectKind::Hot),
    (30, 5, DefectKind::Dead),
    (20, 12, DefectKind::Hot),
    (21, 12, DefectKind::Hot),
    (0, 0, DefectKind::Hot),
];

/// Frames with the defects in them.
fn with_defects(mut frame: Vec<u16>, hot: u16) -> Vec<u16> {
    for (x, y, kind) in DEFECTS {
        frame[y * WIDTH + x] = if kind == DefectKind::Hot { hot } else { 60 };
    }
    frame
}

fn defective() -> SensorCorrection {
    let (_dark_folder, dark) = opened(&[with_defects(seen(|_| 0.0), 900)]);
    let (_flat_folder, flat) = opened(&[with_defects(seen(|_| 8000.0), 9000)]);
    SensorCorrection::from_flat(&*flat, Some(&*dark)).unwrap()
}

#[test]
fn defects_are_found_in_dark_frames_and_in_a_flat_field_and_filled() {
    let correction = defective();
    let found: Vec<(usize, usize, DefectKind)> =
        correction.defects().defects().iter().map(|defect| (defect.x, defect.y, defect.kind)).collect();
    let mut expected = DEFECTS.to_vec();
    expected.sort_by_key(|&(x, y, _)| (y, x));
    assert_eq!(found, expected);
    let ramp = |at: usize| 800.0 + 8.0 * (at % WIDTH + at / WIDTH) as f64;
    let (_folder, recording) = opened(&[with_defects(seen(ramp), 30_000)]);
    let corrected = Corrected::new(recording, Arc::new(correction)).unwrap();
    for (at, light) in frame(&corrected, 0).into_iter().enumerate() {
        // The corner has only the mean of its three neighbours, 8 counts above it twice and 16 once.
        let expected = ramp(at) as f32 + if at == 0 { 32.0 / 3.0 } else { 0.0 };
        assert!((light / expected - 1.0).abs() < 8.0 * f32::EPSILON, "{at}: {light} for {expected}");
    }
}

#[test]
fn a_region_is_the_same_part_of_the_frame_and_costs_little_more_than_itself() {
    let correction = Arc::new(defective());
    let (_folder, path) = file(&[with_defects(seen(scene), 30_000)]);
    let options = OpenOptions::default();
    let corrected = Corrected::new(open_with(&path, &options).unwrap(), correction).unwrap();
    let whole = frame(&corrected, 0);
    for y in (0..HEIGHT - 5).step_by(3) {
        for x in (0..WIDTH - 9).step_by(2) {
            let region = Region { x, y, width: 9, height: 5 };
            let mut pixels = vec![f32::NAN; 45];
            let before = options.pixel_bytes.bytes();
            corrected.read_region(0, region, &mut pixels).unwrap();
            let n_bytes = options.pixel_bytes.bytes() - before;
            let rows = (y..y + 5).flat_map(|y| whole[y * WIDTH + x..][..9].to_vec());
            assert_eq!(pixels, rows.collect::<Vec<f32>>(), "{region:?}");
            let has_defect = DEFECTS
                .iter()
                .any(|&(at_x, at_y, _)| (x..x + 9).contains(&at_x) && (y..y + 5).contains(&at_y));
            // Four pixels more on each side at most.
            let most = if has_defect { 2 * 17 * 13 } else { 2 * 9 * 5 };
            assert!((90..=most).contains(&n_bytes), "{region:?}: {n_bytes} bytes");
        }
    }
    let mut nothing = [];
    corrected.read_region(0, Region { x: 3, y: 3, width: 0, height: 4 }, &mut nothing).unwrap();
    assert!(corrected.read_region(1, Region::whole(1, 1), &mut [0.0]).is_err());
}

#[test]
fn saturated_pixels_stay_saturated_and_no_other_becomes_so() {
    let (_flat_folder, flat) = opened(&[seen(|_| 8000.0)]);
    let correction = SensorCorrection::from_flat(&*flat, None).unwrap();
    let mut raw = vec![65_534; WIDTH * HEIGHT];
    raw[7] = 65_535;
    let (_folder, recording) = opened(&[raw]);
    let corrected = Corrected::new(recording, Arc::new(correction)).unwrap();
    let full_scale = corrected.info().full_scale();
    // The weakest pixels respond 0.875 times as the others do, which takes one more bit.
    assert_eq!(corrected.info().bit_depth, 17);
    for (at, light) in frame(&corrected, 0).into_iter().enumerate() {
        assert_eq!(f64::from(light) >= full_scale, at == 7, "{at}: {light}");
    }
}

#[test]
fn frames_that_do_not_fit_or_tell_nothing_are_refused() {
    let (_folder, flat) = opened(&[seen(|_| 8000.0)]);
    let (_small_folder, path) =
        written(&npy_bytes("{'descr': '|u1', 'fortran_order': False, 'shape': (1, 4, 4), }\n", &[7; 16]));
    let small = open(&path).unwrap();
    let (_even_folder, even) = opened(&[vec![8000; WIDTH * HEIGHT]]);
    let (_bright_folder, bright) = opened(&[vec![65_535; WIDTH * HEIGHT]]);
    for (outcome, part) in [
        (SensorCorrection::from_flat(&*flat, Some(&*small)), "as the dark frames"),
        (SensorCorrection::from_flat(&*bright, None), "100.0 % of them saturated"),
        (SensorCorrection::from_flat(&*even, Some(&*even)), "brighter than the dark ones"),
        // Two pixels of five stand out where the sensor's gains show.
        (SensorCorrection::from_dark(&*flat), "40.0 %"),
    ] {
        let error = outcome.unwrap_err();
        assert!(
            matches!(error, CameraError::Correction { .. }) && error.to_string().contains(part),
            "{error}"
        );
    }
    let correction = Arc::new(SensorCorrection::from_dark(&*even).unwrap());
    let error = Corrected::new(small, correction).err().unwrap().to_string();
    assert!(error.contains("48 x 20 px of 16 bits") && error.contains("4 x 4 px of 8 bits"), "{error}");
    // A file of 16 bits does not say how many of them count: it may be dark frames of 8 bits, if no brighter than these.
    let eight_bit = |count: u8| {
        let head = format!("{{'descr': '|u1', 'fortran_order': False, 'shape': (1, {HEIGHT}, {WIDTH}), }}\n");
        written(&npy_bytes(&head, &vec![count; WIDTH * HEIGHT]))
    };
    let (_dim_folder, dim) = opened(&[seen(|_| 12.0)]);
    let (_eight_folder, path) = eight_bit(99);
    let corrected = |dark: &dyn Recording| {
        Corrected::new(open(&path).unwrap(), Arc::new(SensorCorrection::from_dark(dark).unwrap()))
    };
    assert!(corrected(&*dim).is_ok());
    let brighter = corrected(&*even).err().unwrap().to_string();
    assert!(
        brighter.contains("dark frames, which go up to") && brighter.contains("full scale of 255"),
        "{brighter}"
    );
    let empty = PixelStatistics::new(4, 4);
    assert!(SensorCorrection::of_statistics(Some(&empty), None).is_none());
    assert!(SensorCorrection::of_statistics(None, None).is_none());
}

#[test]
fn dark_frames_whose_bits_lie_at_the_top_of_16_are_refused_for_a_recording_of_12() {
    let head = format!("P5 {WIDTH} {HEIGHT} 4095 ").into_bytes();
    let (_folder, path) = written(&[head, [8, 0].repeat(WIDTH * HEIGHT)].concat());
    let corrected = |step: u16| {
        let (_dark_folder, dark) =
            opened(&[(0..WIDTH * HEIGHT).map(|at| step * (64 + (at % 3) as u16)).collect()]);
        let correction = SensorCorrection::from_dark(&*dark).unwrap();
        Corrected::new(open(&path).unwrap(), Arc::new(correction))
            .map(|corrected| corrected.info().warnings.clone())
    };
    let refused = corrected(16).err().unwrap().to_string();
    assert!(refused.contains("multiples of 16 (hint: divide them by 16"), "{refused}");
    let remarks = corrected(1).unwrap();
    assert!(
        remarks
            .iter()
            .any(|text| text.contains("hint: the mean of n dark frames") && text.contains("that of 100"))
    );
}

fn normal(random: &mut Pcg64) -> f64 {
    StandardNormal.sample(random)
}

/// Statistics of frames that `pixel` draws.
fn statistics(
    (width, height): (usize, usize),
    n_frames: usize,
    mut pixel: impl FnMut(usize) -> f64,
) -> PixelStatistics {
    let mut statistics = PixelStatistics::new(width, height);
    for _ in 0..n_frames {
        statistics.add(&(0..width * height).map(|at| pixel(at) as f32).collect::<Vec<f32>>());
    }
    statistics
}

#[test]
fn mean_and_noise_of_every_pixel_are_found() {
    let mut random = Pcg64::seed_from_u64(1);
    let side = 128;
    // The median of n values of chi-squared with f degrees of freedom has the standard deviation 1 / (2 p sqrt(n)) with the density p
    // there; the noise has half its relative one: 1.17, 0.47 and 0.21 over the root of n. Bounds are five of these and half a
    // per cent for the approximation of the median.
    for (n_frames, relative) in [(2, 1.17), (5, 0.47), (20, 0.21)] {
        let found = statistics((side, side), n_frames, |at| (at % 977) as f64 + 5.0 * normal(&mut random));
        let bound = 5.0 * relative / side as f64 + 0.005;
        let noise = found.noise_counts().unwrap();
        assert!((noise / 5.0 - 1.0).abs() < bound, "{n_frames}: {noise}");
        let chi_squared: f64 = (0..side * side)
            .map(|at| (found.mean()[at] - (at % 977) as f64).powi(2) * n_frames as f64 / 25.0)
            .sum();
        let n = (side * side) as f64;
        assert!((chi_squared / n - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{n_frames}: {chi_squared}");
        let variances: f64 = (0..side * side).filter_map(|at| found.variance(at)).sum();
        let degrees_of_freedom = n * (n_frames as f64 - 1.0);
        assert!(
            (variances / n / 25.0 - 1.0).abs() < 5.0 * (2.0 / degrees_of_freedom).sqrt(),
            "{n_frames}: {variances}"
        );
    }
    let one = statistics((side, side), 1, |_| 3.0);
    assert_eq!((one.noise_counts(), one.variance(0)), (None, None));
}

#[test]
fn dark_frames_give_the_defects_and_no_more_false_ones_than_stated() {
    const SIDE: usize = 1024;
    let (mut n_false, mut expected) = (0, 0.0);
    for seed in 0..4 {
        let mut random = Pcg64::seed_from_u64(seed);
        // A slope of the dark level, and pixels that differ by 3 counts; rounding adds little.
        let level: Vec<f64> =
            (0..SIDE * SIDE).map(|at| 64.0 + (at % SIDE) as f64 / 50.0 + 3.0 * normal(&mut random)).collect();
        // Ten times the usual difference, far beyond the limit of 4.9.
        let is_hot = |at: usize| at % 1009 == 500;
        let dark =
            statistics((SIDE, SIDE), 1, |at| (level[at] + if is_hot(at) { 45.0 } else { 0.0 }).round());
        let map = DefectMap::of_dark(&dark);
        let place = |defect: &chainwave_camera::Defect| defect.y * SIDE + defect.x;
        let n_found = map.defects().iter().filter(|defect| is_hot(place(defect))).count();
        assert_eq!(n_found, (0..SIDE * SIDE).filter(|&at| is_hot(at)).count());
        n_false += map.defects().len() - n_found;
        expected += map.expected_false();
    }
    assert!((expected / (4 * SIDE * SIDE) as f64 - 1e-6).abs() < 1e-15);
    // 4.2 are expected; 14 or more come once in ten thousand times (Poisson).
    assert!(n_false < 14, "{n_false} false for {expected}");
}

/// Speckle of a lens that spreads a point over some pixels: blots at random places, with noise of a camera.
fn speckle(side: usize, random: &mut Pcg64) -> Vec<f64> {
    const BLOT_PX: f64 = 1.5;
    let mut picture = vec![600.0; side * side];
    for _ in 0..side * side / 30 {
        let (x, y) = (random.random_range(0.0..side as f64), random.random_range(0.0..side as f64));
        let near = |at: f64| (at as usize).saturating_sub(6)..(at as usize + 7).min(side);
        for row in near(y) {
            for column in near(x) {
                let distance = (column as f64 - x).hypot(row as f64 - y) / BLOT_PX;
                picture[row * side + column] += 900.0 * (-0.5 * distance * distance).exp();
            }
        }
    }
    picture
}

#[test]
fn scenes_at_rest_give_the_defects_and_no_more_false_ones_than_stated() {
    const SIDE: usize = 400;
    let (mut n_false, mut expected) = (0, 0.0);
    for (seed, n_scenes) in [(1, 1), (2, 1), (3, 2), (4, 3)] {
        let mut random = Pcg64::seed_from_u64(seed);
        let is_bad = |at: usize| at % 1013 == 77;
        let scenes: Vec<PixelStatistics> = (0..n_scenes)
            .map(|_| {
                let picture = speckle(SIDE, &mut random);
                statistics((SIDE, SIDE), 10, |at| {
                    let light = picture[at] + 10.0 * normal(&mut random);
                    if !is_bad(at) {
                        light
                    } else if at % 2 == 0 {
                        light + 1500.0
                    } else {
                        64.0
                    }
                })
            })
            .collect();
        let map = DefectMap::at_rest(&scenes);
        let place = |defect: &chainwave_camera::Defect| defect.y * SIDE + defect.x;
        let n_found = map.defects().iter().filter(|defect| is_bad(place(defect))).count();
        let n_bad = (0..SIDE * SIDE).filter(|&at| is_bad(at)).count();
        // Hot pixels stand 1500 counts out of blots of 900, which the lens spreads: they cannot hide.
        let n_hot = |kind: DefectKind| {
            map.defects().iter().filter(|defect| is_bad(place(defect)) && defect.kind == kind).count()
        };
        let expected_hot = (0..SIDE * SIDE).filter(|&at| is_bad(at) && at % 2 == 0).count();
        assert_eq!(n_hot(DefectKind::Hot), expected_hot, "{n_found} of {n_bad}");
        n_false += map.defects().len() - n_found;
        expected += map.expected_false();
    }
    // 0.64 are expected; 6 or more come once in ten thousand times (Poisson).
    assert!(n_false < 6, "{n_false} false for {expected}");
}

#[test]
fn ground_without_texture_gives_every_defect_beyond_its_noise() {
    const SIDE: usize = 300;
    let mut random = Pcg64::seed_from_u64(9);
    let is_bad = |at: usize| at % 1013 == 77;
    // The mean of ten frames of 10 counts of noise, and neighbours' shares of theirs, leave 3.9 counts. 80 are 20 of these, and the limit,
    // which is the exponential continuation of a normal tail, lies below 8.
    let ground = statistics((SIDE, SIDE), 10, |at| {
        let slope = 700.0 + (at % SIDE) as f64;
        slope
            + 10.0 * normal(&mut random)
            + if !is_bad(at) {
                0.0
            } else if at % 2 == 0 {
                80.0
            } else {
                -80.0
            }
    });
    let map = DefectMap::at_rest(std::slice::from_ref(&ground));
    let found: Vec<(usize, bool)> = map
        .defects()
        .iter()
        .map(|defect| (defect.y * SIDE + defect.x, defect.kind == DefectKind::Hot))
        .collect();
    let expected: Vec<(usize, bool)> =
        (0..SIDE * SIDE).filter(|&at| is_bad(at)).map(|at| (at, at % 2 == 0)).collect();
    let missed = expected.iter().filter(|defect| !found.contains(defect)).count();
    // 0.09 false ones are expected; 4 or more come once in 400 000 times (Poisson).
    assert!(missed == 0 && found.len() < expected.len() + 4, "{missed} missed, {} found", found.len());
    assert!(DefectMap::at_rest(&[]).defects().is_empty());
}
