//! Files under two names: two rows of the trials table with the same bytes count one shot twice.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use chainwave_camera::files_of;

use crate::configuration::Trial;
use crate::finding::Sanity;
use crate::setup::Setup;

/// Bytes that are compared at a place, and the places, before all of two files of one size are.
const PIECE_BYTES: usize = 1 << 12;
const PLACES: u64 = 16;

/// The size of each file of a recording, and what it holds in some places from its beginning to its end.
type Pieces = Vec<(u64, Vec<u8>)>;
/// Files of a recording at most: its pictures, and a header beside them. A folder of pictures is not compared.
const MOST_FILES: usize = 2;

/// Leaves out a recording whose file holds the same bytes as that of an earlier row. Files that cannot be read are passed over: tracking names them.
pub(super) fn twice(setup: &Setup, sanity: &mut Sanity) {
    let mut of_pieces: BTreeMap<Pieces, Vec<(&Trial, Vec<PathBuf>)>> = BTreeMap::new();
    for trial in setup.trials.iter().filter(|trial| sanity.reason(&trial.recording).is_none()) {
        let files = files_of(&setup.recordings.join(&trial.recording)).unwrap_or_default();
        if !(1..=MOST_FILES).contains(&files.len()) {
            continue;
        }
        if let Ok(pieces) = files.iter().map(|file| pieces(file)).collect::<io::Result<Pieces>>() {
            of_pieces.entry(pieces).or_default().push((trial, files));
        }
    }
    let mut found: Vec<(&Trial, String)> = Vec::new();
    for alike in of_pieces.values() {
        for (k, (trial, files)) in alike.iter().enumerate().skip(1) {
            let is_same = |(_, others): &&(&Trial, Vec<PathBuf>)| {
                files.iter().zip(others).all(|(one, other)| same_bytes(one, other).unwrap_or(false))
            };
            if let Some((first, _)) = alike[..k].iter().find(is_same) {
                let why = format!(
                    "its file holds the same bytes as {}, which comes first (hint: was one file copied over the other?)",
                    first.recording
                );
                found.push((trial, why));
            }
        }
    }
    for (trial, why) in found {
        sanity.leave_out(std::slice::from_ref(trial), &why);
    }
}

fn pieces(path: &Path) -> io::Result<(u64, Vec<u8>)> {
    let mut file = File::open(path)?;
    let metadata = file.metadata()?;
    if !metadata.is_file() {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    let (size, mut read) = (metadata.len(), Vec::new());
    for place in 0..PLACES {
        file.seek(SeekFrom::Start(size.saturating_sub(PIECE_BYTES as u64) / (PLACES - 1) * place))?;
        (&file).take(PIECE_BYTES as u64).read_to_end(&mut read)?;
    }
    Ok((size, read))
}

fn same_bytes(one: &Path, other: &Path) -> io::Result<bool> {
    let (mut one, mut other) = (File::open(one)?, File::open(other)?);
    let mut buffers = [vec![0; 1 << 16], vec![0; 1 << 16]];
    loop {
        let n = one.read(&mut buffers[0])?;
        let read_as_many = other.read_exact(&mut buffers[1][..n]);
        if read_as_many.is_err() || buffers[0][..n] != buffers[1][..n] {
            return Ok(false);
        }
        if n == 0 {
            return Ok(true);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn files_are_the_same_by_all_of_their_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let written = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            fs::write(&path, bytes).unwrap();
            path
        };
        let bytes: Vec<u8> = (0..300_000_u32).map(|k| (k.wrapping_mul(k) >> 7) as u8).collect();
        let mut changed = bytes.clone();
        // Between two of the places that are looked at first.
        changed[30_000] ^= 1;
        let [one, same, other] =
            [written("one", &bytes), written("same", &bytes), written("other", &changed)];
        assert_eq!(pieces(&one).unwrap(), pieces(&other).unwrap());
        assert!(same_bytes(&one, &same).unwrap() && !same_bytes(&one, &other).unwrap());
        assert_ne!(pieces(&one).unwrap(), pieces(&written("shorter", &bytes[1..])).unwrap());
        assert!(pieces(folder.path()).is_err());
        assert!(pieces(&written("small", &[1, 2, 3])).is_ok());
    }
}
