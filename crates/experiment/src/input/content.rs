//! What a recording holds, in a line: its size and digests, by which kept tracks are told from stale ones.

use std::fs::{File, Metadata};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use chainwave_camera::files_of;
use sha2::{Digest, Sha256};

use crate::error::Error;

/// Recordings up to this size are digested whole.
pub(crate) const DIGESTED_WHOLE_BYTES: u64 = 16 << 20;
/// Of larger ones, so much at the beginning (header and time stamps) and at the end.
const DIGESTED_ENDS_BYTES: u64 = 1 << 20;

/// What a recording holds, as a text: its size and a digest; of several files, that of each.
///
/// A file of up to 16 MiB is digested whole, and its time does not matter. Of a larger one, of which tracking reads a few per cent, the
/// first and last MiB are digested, and the times of its last modification and change count as well: no program can write a byte without
/// moving the latter.
pub(crate) fn content(path: &Path) -> Result<String, Error> {
    match files_of(path)?.as_slice() {
        [file] if file == path => content_of_file(file),
        files => together(files, "sha256", content_of_file),
    }
}

fn content_of_file(path: &Path) -> Result<String, Error> {
    let metadata = std::fs::metadata(path).map_err(Error::file(path, "read the size of"))?;
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

/// Several files: their number, and a digest of their names with what is told of each.
fn together(
    files: &[PathBuf],
    digested: &str,
    told: impl Fn(&Path) -> Result<String, Error>,
) -> Result<String, Error> {
    let line = |file: &PathBuf| {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        Ok(format!("{name} {}\n", told(file)?))
    };
    let lines = files.iter().map(line).collect::<Result<Vec<String>, Error>>()?;
    let digest = hexadecimal(&Sha256::digest(lines.concat().as_bytes()));
    Ok(format!("{} files, {digested} {digest}", files.len()))
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

/// A recording's size and the digest of its first mebibyte, which holds the header and the time stamps: what stands in
/// `provenance.toml`. Of several files, a digest of their names and sizes.
///
/// # Errors
/// A file or folder that cannot be read.
pub fn fingerprint(path: &Path) -> Result<String, Error> {
    let size = |file: &Path| {
        let metadata = std::fs::metadata(file).map_err(Error::file(file, "read the size of"))?;
        Ok(metadata.len().to_string())
    };
    match files_of(path)?.as_slice() {
        [file] if file == path => fingerprint_of_file(file),
        files => together(files, "sha256 of names and sizes", size),
    }
}

fn fingerprint_of_file(path: &Path) -> Result<String, Error> {
    let file = File::open(path).map_err(Error::file(path, "open"))?;
    let size = file.metadata().map_err(Error::file(path, "read the size of"))?.len();
    let mut head = Vec::new();
    file.take(1 << 20).read_to_end(&mut head).map_err(Error::file(path, "read"))?;
    Ok(format!("{size} bytes, sha256 of the first MiB {}", hexadecimal(&Sha256::digest(&head))))
}

pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
