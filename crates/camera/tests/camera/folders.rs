//! Folders of images: their order, and the .cih or .cihx beside them.

use std::path::Path;

use chainwave_camera::{CameraError, OpenOptions, open, open_with};
use chainwave_measurement::Region;

use crate::common::has_warning;
use crate::mraw::MrawFile;
use crate::tiff_writer::TiffFile;
use crate::writer::codes;

#[test]
fn images_with_negative_numbers_come_before_the_trigger() {
    let folder = tempfile::tempdir().unwrap();
    for number in -5..8_i32 {
        let image = TiffFile::new(4, 1, vec![vec![(number + 100) as u16; 4]]).bytes();
        let sign = if number < 0 { "-" } else { "" };
        let name = format!("img_{sign}{:05}.tif", number.abs());
        std::fs::write(folder.path().join(name), image).unwrap();
    }
    let recording = open(folder.path()).unwrap();
    let info = recording.info();
    assert_eq!((info.n_frames, info.first_image, info.times_s[12]), (13, -5, 12.0));
    for frame in 0..13 {
        let mut count = vec![0.0];
        recording.read_region(frame, Region { x: 0, y: 0, width: 1, height: 1 }, &mut count).unwrap();
        assert_eq!(count, vec![95.0 + frame as f32]);
    }
    assert!(has_warning(&*recording, "the minus is taken for the sign"));
}

/// A folder of TIFF of numbers `first`, `first + spacing`, ...
fn tiff_folder(numbers: &[usize]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for &number in numbers {
        let bytes = TiffFile::new(16, 4, vec![codes(64, 4095, number as u32)]).bytes();
        std::fs::write(folder.path().join(format!("shot{number:06}.tif")), bytes).unwrap();
    }
    folder
}

fn tiff_header(file: &MrawFile) -> String {
    file.cih().replace("File Format : MRaw", "File Format : TIFF")
}

#[test]
fn a_folder_takes_the_rate_of_the_header_beside_it() {
    let folder = tiff_folder(&[1, 2, 3, 4]);
    let unknown = open(folder.path()).unwrap();
    assert_eq!((unknown.info().rate_hz, unknown.info().times_s[3]), (None, 3.0));
    assert!(has_warning(&*unknown, "times count frames"));
    let header = MrawFile { step: 10, start: -50, trigger: -30, ..MrawFile::default() };
    std::fs::write(folder.path().join("shot.cih"), tiff_header(&header)).unwrap();
    let recording = open(folder.path()).unwrap();
    let info = recording.info();
    assert_eq!((info.rate_hz, info.times_s[3]), (Some(2000.0), 30.0 / 20_000.0));
    assert_eq!((info.camera.as_deref(), info.first_image), (Some("FASTCAM SA-Z"), 1));
    assert!((info.exposure_s.unwrap() - 25e-6).abs() < 1e-18);
    assert!(has_warning(&*recording, "the rate of shot.cih beside them"));
    // The whole of what was saved: t = 0 is the trigger.
    let whole = MrawFile { frames: vec![Vec::new(); 4], ..header };
    std::fs::write(folder.path().join("shot.cih"), tiff_header(&whole)).unwrap();
    let recording = open(folder.path()).unwrap();
    assert_eq!((recording.info().first_image, recording.info().times_s[0]), (-20, -20.0 / 20_000.0));
    // The caller knows the rate better, and the header the trigger: of 20 recorded frames before it two were saved.
    let options = OpenOptions { rate_hz: Some(500.0), ..OpenOptions::default() };
    let recording = open_with(folder.path(), &options).unwrap();
    let info = recording.info();
    assert_eq!((info.rate_hz, info.first_image), (Some(500.0), -20));
    assert_eq!(info.times_s, [-2.0, -1.0, 0.0, 1.0].map(|frame| frame / 500.0));
    assert!(has_warning(&*recording, "at 500 Hz, as given, and not at the 2000 Hz of shot.cih"));
}

#[test]
fn the_header_beside_a_folder_is_one_of_its_files() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("view1");
    std::fs::create_dir(&folder).unwrap();
    let images = ["shot1.tif", "shot2.tif"].map(|name| folder.join(name));
    for image in &images {
        std::fs::write(image, TiffFile::new(16, 4, vec![codes(64, 4095, 1)]).bytes()).unwrap();
    }
    let of = |path: &Path| chainwave_camera::files_of(path).unwrap();
    assert_eq!(of(&folder), images);
    // Another folder's, and one that is no header, do not count.
    std::fs::write(parent.path().join("view2.cih"), tiff_header(&MrawFile::default())).unwrap();
    std::fs::write(parent.path().join("view1.cih"), "notes").unwrap();
    assert_eq!(of(&folder), images);
    let header = parent.path().join("view1.cih");
    std::fs::write(&header, tiff_header(&MrawFile::default())).unwrap();
    let expected = [images.as_slice(), std::slice::from_ref(&header)].concat();
    assert_eq!(of(&folder), expected);
    assert_eq!(of(&folder.join("")), expected);
    assert_eq!(open(&folder).unwrap().info().rate_hz, Some(20_000.0));
}

#[test]
fn numbers_and_header_that_contradict_each_other_give_no_rate() {
    for (spacing, step, expected_hz, part) in [
        (20, 1, Some(1000.0), "one frame in 20 is taken"),
        (20, 20, Some(1000.0), "advance by 20"),
        (20, 7, None, "no rate is taken"),
    ] {
        let folder = tiff_folder(&[1, 1 + spacing, 1 + 2 * spacing]);
        let header = MrawFile { step, ..MrawFile::default() };
        std::fs::write(folder.path().join("shot.cih"), tiff_header(&header)).unwrap();
        let recording = open(folder.path()).unwrap();
        assert_eq!(recording.info().rate_hz, expected_hz, "{spacing} {step}");
        assert!(has_warning(&*recording, part), "{:?}", recording.info().warnings);
    }
}

#[test]
fn of_several_headers_the_one_with_the_images_name_counts() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("view.1");
    std::fs::create_dir(&folder).unwrap();
    for number in [1, 2] {
        let bytes = TiffFile::new(16, 4, vec![codes(64, 4095, number)]).bytes();
        std::fs::write(folder.join(format!("shot{number}.tif")), bytes).unwrap();
    }
    let file = MrawFile::default();
    std::fs::write(parent.path().join("view.1.cihx"), file.cihx()).unwrap();
    assert_eq!(open(&folder).unwrap().info().rate_hz, Some(20_000.0));
    std::fs::write(folder.join("other.cih"), tiff_header(&file)).unwrap();
    assert!(has_warning(&*open(&folder).unwrap(), "several .cih"));
    std::fs::write(folder.join("shot.cih"), tiff_header(&file).replace("20000", "5000")).unwrap();
    assert_eq!(open(&folder).unwrap().info().rate_hz, Some(5_000.0));
    std::fs::write(folder.join("shot.cih"), tiff_header(&file).replace("20000", "fast")).unwrap();
    let recording = open(&folder).unwrap();
    assert_eq!(recording.info().rate_hz, None);
    assert!(has_warning(&*recording, "no rate is taken from shot.cih") && has_warning(&*recording, "fast"));
    let colour = MrawFile { colour: "Raw", ..MrawFile::default() };
    std::fs::write(folder.join("shot.cih"), tiff_header(&colour)).unwrap();
    assert!(matches!(open(&folder), Err(CameraError::Colour { .. })));
}
