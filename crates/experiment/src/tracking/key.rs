//! What the tracks of a recording depend on, and nothing else: kept tracks hold as long as their key does.

use std::fmt::Write;
use std::path::Path;

use chainwave_camera::OpenOptions;
use chainwave_correlation::{Method, ReferenceFrames};
use chainwave_measurement::Subset;
use sha2::{Digest, Sha256};

use crate::camera::sensor::SensorFiles;
use crate::input::content::hexadecimal;

/// Bytes of a recording's stem in the name of its kept tracks: file systems take 255 a name, of which the digest, endings and the name of a file
/// that is being written take less than 70.
const MOST_STEM_BYTES: usize = 180;

/// What the tracks of one recording depend on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrackKey {
    /// Name of the recording as the trials table has it.
    pub recording: String,
    /// Each thing that matters, by name, in a fixed order. A text here is compared and never read back.
    pub parts: Vec<(&'static str, String)>,
}

/// What a recording is tracked with.
pub(crate) struct Task<'a> {
    /// The subsets in the reference.
    pub(crate) subsets: &'a [Subset],
    /// The reference.
    pub(crate) reference: &'a ReferenceFrames,
    /// The method.
    pub(crate) method: Method,
    /// How the recording is opened.
    pub(crate) options: &'a OpenOptions,
    /// What is known of the sensor.
    pub(crate) sensor: Option<&'a SensorFiles>,
    /// From where bodies are followed anew, as a text.
    pub(crate) seeds: String,
    /// Up to when the recording is looked at, in seconds after the trigger; `None`: to its end.
    pub(crate) until_s: Option<f64>,
}

impl TrackKey {
    /// The key of a recording by its name and what it holds.
    pub(crate) fn of(recording: &str, content: String, task: &Task<'_>) -> Self {
        let mut subsets = String::new();
        for Subset { name, x_px, y_px, half_width_px, half_height_px, outline_px } in task.subsets {
            let outline = match outline_px.is_empty() {
                true => String::new(),
                false => format!(", within {outline_px:?}"),
            };
            let _infallible = writeln!(
                subsets,
                "{name} at {x_px:?}, {y_px:?} px, half {half_width_px} x {half_height_px}{outline}"
            );
        }
        let parts = vec![
            ("recording", content),
            ("subsets", subsets),
            ("reference", format!("frames {:?}", task.reference.range())),
            ("method", task.method.to_string()),
            ("frame rate", or_as_stated(task.options.rate_hz.map(|hz| format!("{hz:?} Hz")))),
            ("geometry", or_as_stated(task.options.raw.map(|geometry| geometry.to_string()))),
            (
                "sensor correction",
                task.sensor.map_or_else(|| "none".into(), |sensor| sensor.content().to_owned()),
            ),
            ("corrections", task.seeds.clone()),
            ("frames", task.until_s.map_or_else(|| "all".into(), |until_s| format!("until {until_s:?} s"))),
            ("algorithm", format!("version {}", chainwave_correlation::ALGORITHM_VERSION)),
        ];
        Self { recording: recording.to_owned(), parts }
    }

    /// The key where frames were taken at these times, in seconds after the trigger: they come from more than the recording's bytes, such as this
    /// version's reading of its time stamps.
    #[must_use]
    pub fn at_times(mut self, times_s: &[f64]) -> Self {
        let mut hash = Sha256::new();
        times_s.iter().for_each(|time_s| hash.update(time_s.to_le_bytes()));
        self.parts
            .push(("times", format!("{} frames, sha256 {}", times_s.len(), hexadecimal(&hash.finalize()))));
        self
    }

    /// A name for the kept tracks: the recording's stem, as much of it as a file's name may have, and sixteen hexadecimal digits of the digest of
    /// all parts.
    pub fn name(&self) -> String {
        let mut hash = Sha256::new();
        for (name, part) in &self.parts {
            hash.update(format!("{name}\n{}\n{part}\n", part.len()));
        }
        let stem = self.stem();
        let most = stem.len().min(MOST_STEM_BYTES);
        let end = (0..=most).rev().find(|end| stem.is_char_boundary(*end)).unwrap_or(0);
        format!("{}-{}", &stem[..end], hexadecimal(&hash.finalize()[..8]))
    }

    /// The names of the parts that differ from those of another key.
    pub fn differs_in<N: AsRef<str>>(&self, others: &[(N, String)]) -> Vec<&'static str> {
        let same = |(name, part): &&(&'static str, String)| {
            others.iter().any(|(other, of_other)| other.as_ref() == *name && of_other == part)
        };
        self.parts.iter().filter(|part| !same(part)).map(|(name, _)| *name).collect()
    }

    /// The recording's file name without folder and ending.
    pub fn stem(&self) -> String {
        Path::new(&self.recording).file_stem().unwrap_or_default().to_string_lossy().into()
    }
}

/// What the caller states, or that the recording does.
fn or_as_stated(stated: Option<String>) -> String {
    stated.unwrap_or_else(|| "as the recording states it".into())
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::io::{self, Seek, SeekFrom};

    use super::*;
    use crate::input::content::{DIGESTED_WHOLE_BYTES, content};

    fn key(path: &Path, change: impl Fn(&mut Subset, &mut OpenOptions)) -> String {
        let half = 16;
        let mut subset = Subset::new("1", 40.0, 20.0, half, half);
        let mut options = OpenOptions::default();
        change(&mut subset, &mut options);
        let (subsets, reference, options) = (&[subset][..], &ReferenceFrames::Mean(0..9), &options);
        let task = Task {
            subsets,
            reference,
            method: Method::default(),
            options,
            sensor: None,
            seeds: "none".into(),
            until_s: None,
        };
        TrackKey::of("a.cine", content(path).unwrap(), &task).name()
    }

    #[test]
    fn a_changed_byte_and_a_setting_that_matters_count_and_the_time_of_a_copy_does_not() {
        let folder = tempfile::tempdir().unwrap();
        let [path, copy] = ["a.cine", "copy.cine"].map(|name| folder.path().join(name));
        let mut bytes = vec![7_u8; 3 << 20];
        std::fs::write(&path, &bytes).unwrap();
        let usual = key(&path, |_, _| ());
        assert!(usual.starts_with("a-") && usual.len() == 18, "{usual}");
        std::fs::write(&copy, &bytes).unwrap();
        assert_eq!(key(&copy, |_, _| ()), usual);
        assert_ne!(key(&path, |subset, _| subset.x_px = 40.5), usual);
        assert_ne!(key(&path, |subset, _| subset.half_width_px = 17), usual);
        assert_ne!(key(&path, |_, options| options.rate_hz = Some(25e3)), usual);
        assert_ne!(key(&path, |_, options| options.raw = "8x8x8".parse().ok()), usual);
        for at in [0, 1 << 20, 2_500_000, bytes.len() - 1] {
            bytes[at] ^= 1;
            std::fs::write(&path, &bytes).unwrap();
            assert_ne!(key(&path, |_, _| ()), usual, "byte {at}");
            bytes[at] ^= 1;
        }
    }

    #[test]
    fn the_other_file_of_a_recording_counts() {
        let folder = tempfile::tempdir().unwrap();
        let [header, pixels] = ["shot.cih", "shot.mraw"].map(|name| folder.path().join(name));
        let written = |rate: &str, pixel: u8| {
            std::fs::write(&header, format!("#Camera Information Header\r\n{rate}\r\n")).unwrap();
            std::fs::write(&pixels, [pixel; 64]).unwrap();
            [&header, &pixels].map(|path| key(path, |_, _| ()))
        };
        let usual = written("Record Rate(fps) : 20000", 7);
        assert_eq!(written("Record Rate(fps) : 20000", 7), usual);
        for changed in [written("Record Rate(fps) : 20000", 8), written("Record Rate(fps) : 10000", 7)] {
            assert!(changed.iter().all(|key| !usual.contains(key)), "{changed:?} {usual:?}");
        }
        // Pixels alone, which can be read where their geometry is stated, count for themselves.
        std::fs::remove_file(&header).unwrap();
        assert!(!usual.contains(&key(&pixels, |_, _| ())));
    }

    #[test]
    fn the_header_beside_a_folder_of_images_counts() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("view1");
        std::fs::create_dir(&folder).unwrap();
        std::fs::write(folder.join("1.pgm"), b"P5 2 1 255 ab").unwrap();
        let at_rate = |rate: &str| {
            let header = format!("#Camera Information Header\r\nRecord Rate(fps) : {rate}\r\n");
            std::fs::write(parent.path().join("view1.cih"), header).unwrap();
            key(&folder, |_, _| ())
        };
        let usual = at_rate("20000");
        assert_eq!(at_rate("20000"), usual);
        assert_ne!(at_rate("10000"), usual);
    }

    #[test]
    fn the_times_of_frames_count() {
        let key = TrackKey { recording: "a.cine".into(), parts: vec![("recording", "the same".into())] };
        let at = |times_s: &[f64]| key.clone().at_times(times_s);
        let usual = at(&[-1e-4, 0.0, 1e-4]);
        assert_eq!(at(&[-1e-4, 0.0, 1e-4]), usual);
        for other in [at(&[-1e-4, 0.0, 1.1e-4]), at(&[-1e-4, 0.0]), at(&[])] {
            assert_ne!(other.name(), usual.name());
            assert_eq!(other.differs_in(&usual.parts), ["times"]);
        }
    }

    #[test]
    fn a_byte_in_the_middle_of_a_large_file_counts_even_where_its_time_is_put_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.cine");
        let file = File::create(&path).unwrap();
        file.set_len(DIGESTED_WHOLE_BYTES + (8 << 20)).unwrap();
        let modified = file.metadata().unwrap().modified().unwrap();
        let usual = key(&path, |_, _| ());
        // The system's clock for files ticks every few milliseconds.
        std::thread::sleep(std::time::Duration::from_millis(50));
        let mut file = File::options().write(true).open(&path).unwrap();
        file.seek(SeekFrom::Start(DIGESTED_WHOLE_BYTES / 2)).unwrap();
        io::Write::write_all(&mut file, &[1]).unwrap();
        file.set_modified(modified).unwrap();
        assert_eq!(file.metadata().unwrap().modified().unwrap(), modified);
        if cfg!(unix) {
            assert_ne!(key(&path, |_, _| ()), usual);
        }
    }
}
