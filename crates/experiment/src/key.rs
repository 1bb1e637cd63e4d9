//! What the tracks of a recording depend on, and nothing else: kept tracks hold as long as their key does.

use std::fmt::Write;
use std::fs::{File, Metadata};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use chainwave_camera::OpenOptions;
use chainwave_correlation::{Method, ReferenceFrames};
use chainwave_measurement::Subset;
use sha2::{Digest, Sha256};

use crate::error::Error;
use crate::sensor::SensorFiles;

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
}

impl TrackKey {
    /// The key of a recording that lies at `path`.
    pub(crate) fn of(recording: &str, path: &Path, task: &Task<'_>) -> Result<Self, Error> {
        let mut subsets = String::new();
        for Subset { name, x_px, y_px, half_width_px, half_height_px } in task.subsets {
            let _infallible =
                writeln!(subsets, "{name} at {x_px:?}, {y_px:?} px, half {half_width_px} x {half_height_px}");
        }
        let parts = vec![
            ("recording", content(path)?),
            ("subsets", subsets),
            ("reference", format!("frames {:?}", task.reference.range())),
            ("method", task.method.to_string()),
            ("frame rate", or_as_stated(task.options.rate_hz.map(|hz| format!("{hz:?} Hz")))),
            ("geometry", or_as_stated(task.options.raw.map(|geometry| geometry.to_string()))),
            (
                "sensor correction",
                task.sensor.map_or_else(|| "none".into(), |sensor| sensor.content().to_owned()),
            ),
            ("algorithm", format!("version {}", chainwave_correlation::ALGORITHM_VERSION)),
        ];
        Ok(Self { recording: recording.to_owned(), parts })
    }

    /// A name for the kept tracks: the recording's stem, and sixteen hexadecimal digits of the digest of all parts.
    pub fn name(&self) -> String {
        let mut hash = Sha256::new();
        for (name, part) in &self.parts {
            hash.update(format!("{name}\n{}\n{part}\n", part.len()));
        }
        format!("{}-{}", self.stem(), hexadecimal(&hash.finalize()[..8]))
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

/// Recordings up to this size are digested whole.
const DIGESTED_WHOLE_BYTES: u64 = 16 << 20;
/// Of larger ones, so much at the beginning (header and time stamps) and at the end.
const DIGESTED_ENDS_BYTES: u64 = 1 << 20;

/// What a recording holds, as a text: its size and a digest.
///
/// A file of up to 16 MiB is digested whole, and its time does not matter. Of a larger one, of which tracking reads a few per cent, the
/// first and last MiB are digested, and the times of its last modification and change count as well: no program can write a byte without
/// moving the latter.
pub(crate) fn content(path: &Path) -> Result<String, Error> {
    let metadata = std::fs::metadata(path).map_err(Error::file(path, "read the size of"))?;
    if metadata.is_dir() {
        return content_of_folder(path);
    }
    let digest = |hash: Sha256| hexadecimal(&hash.finalize());
    let size = metadata.len();
    let mut file = File::open(path).map_err(Error::file(path, "open"))?;
    let mut hash = Sha256::new();
    let read = match size <= DIGESTED_WHOLE_BYTES {
        true => digest_all(&mut file, &mut hash),
        false => digest_ends(&mut file, &mut hash),
    };
    read.map_err(Error::file(path, "read"))?;
    Ok(match size <= DIGESTED_WHOLE_BYTES {
        true => format!("{size} bytes, sha256 {}", digest(hash)),
        false => format!("{size} bytes, {}, sha256 of the ends {}", times(&metadata), digest(hash)),
    })
}

fn digest_ends(file: &mut File, hash: &mut Sha256) -> io::Result<()> {
    digest_all(&mut file.take(DIGESTED_ENDS_BYTES), hash)?;
    file.seek(SeekFrom::End(-(DIGESTED_ENDS_BYTES as i64)))?;
    digest_all(file, hash)
}

/// Feeds what is left of a file into a digest.
fn digest_all(bytes: &mut impl Read, hash: &mut Sha256) -> io::Result<()> {
    let mut buffer = vec![0; 1 << 16];
    loop {
        match bytes.read(&mut buffer)? {
            0 => return Ok(()),
            n => hash.update(&buffer[..n]),
        }
    }
}

/// When a file was last modified, and when anything of it last changed where the system tells, in nanoseconds.
fn times(metadata: &Metadata) -> String {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let [modified, changed] =
            [(metadata.mtime(), metadata.mtime_nsec()), (metadata.ctime(), metadata.ctime_nsec())]
                .map(|(seconds, nanoseconds)| i128::from(seconds) * 1_000_000_000 + i128::from(nanoseconds));
        format!("modified {modified}, changed {changed}")
    }
    #[cfg(not(unix))]
    {
        let modified =
            metadata.modified().ok().and_then(|time| time.duration_since(std::time::UNIX_EPOCH).ok());
        format!("modified {}", modified.unwrap_or_default().as_nanos())
    }
}

/// A folder's files, each as [`content`] tells it.
fn content_of_folder(path: &Path) -> Result<String, Error> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(Error::file(path, "list"))? {
        let entry = entry.map_err(Error::file(path, "list"))?.path();
        if entry.is_file() {
            files.push(format!(
                "{} {}\n",
                entry.file_name().unwrap_or_default().to_string_lossy(),
                content(&entry)?
            ));
        }
    }
    files.sort();
    Ok(format!("{} files, sha256 {}", files.len(), hexadecimal(&Sha256::digest(files.concat().as_bytes()))))
}

/// A recording's size and the digest of its first mebibyte, which holds the header and the time stamps: what stands in
/// `provenance.toml`.
///
/// # Errors
/// A file or folder that cannot be read.
pub fn fingerprint(path: &Path) -> Result<String, Error> {
    if path.is_dir() {
        return fingerprint_of_folder(path);
    }
    let file = File::open(path).map_err(Error::file(path, "open"))?;
    let size = file.metadata().map_err(Error::file(path, "read the size of"))?.len();
    let mut head = Vec::new();
    file.take(1 << 20).read_to_end(&mut head).map_err(Error::file(path, "read"))?;
    Ok(format!("{size} bytes, sha256 of the first MiB {}", hexadecimal(&Sha256::digest(&head))))
}

/// A folder's files by name and size.
fn fingerprint_of_folder(path: &Path) -> Result<String, Error> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(Error::file(path, "list"))? {
        let entry = entry.map_err(Error::file(path, "list"))?;
        let size = entry.metadata().map_err(Error::file(&entry.path(), "read the size of"))?.len();
        files.push(format!("{} {size}\n", entry.file_name().to_string_lossy()));
    }
    files.sort();
    let digest = hexadecimal(&Sha256::digest(files.concat().as_bytes()));
    Ok(format!("{} files, sha256 of names and sizes {digest}", files.len()))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(path: &Path, change: impl Fn(&mut Subset, &mut OpenOptions)) -> String {
        let half = 16;
        let mut subset =
            Subset { name: "1".into(), x_px: 40.0, y_px: 20.0, half_width_px: half, half_height_px: half };
        let mut options = OpenOptions::default();
        change(&mut subset, &mut options);
        let (subsets, reference, options) = (&[subset][..], &ReferenceFrames::Mean(0..9), &options);
        let task = Task { subsets, reference, method: Method::default(), options, sensor: None };
        TrackKey::of("a.cine", path, &task).unwrap().name()
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
