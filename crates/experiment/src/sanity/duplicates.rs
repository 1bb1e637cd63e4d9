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

/// The size of each file of a recording, and what some of them hold in some places from their beginning to their end.
type Pieces = Vec<(u64, Vec<u8>)>;
/// Of recordings of more files than a pair of pixels and header has, folders of pictures, only the first and the last file are looked into.
const MOST_FILES: usize = 2;

/// Leaves out a recording whose files hold the same bytes as those of an earlier row. Files that cannot be read are passed over: tracking names them.
pub(super) fn twice(setup: &Setup, sanity: &mut Sanity) {
    let usable = setup.trials.iter().filter(|trial| sanity.reason(&trial.recording).is_none());
    let recordings: Vec<(&Trial, Vec<PathBuf>)> = usable
        .map(|trial| (trial, files_of(&setup.recordings.join(&trial.recording)).unwrap_or_default()))
        .collect();
    for (later, earlier) in same(recordings.iter().map(|(_, files)| files.as_slice())) {
        let whose = if recordings[later].1.len() == 1 { "its file holds" } else { "its files hold" };
        let why = format!(
            "{whose} the same bytes as {}, which comes first (hint: was one file copied over the other?)",
            recordings[earlier].0.recording
        );
        sanity.leave_out(std::slice::from_ref(recordings[later].0), &why);
    }
}

/// The places of recordings that hold the same bytes as one before them, and its place, in order. Recordings are given by their files.
fn same<'a>(recordings: impl Iterator<Item = &'a [PathBuf]>) -> Vec<(usize, usize)> {
    let mut of_pieces: BTreeMap<Pieces, Vec<(usize, &[PathBuf])>> = BTreeMap::new();
    for (place, files) in recordings.enumerate().filter(|(_, files)| !files.is_empty()) {
        if let Ok(pieces) = pieces_of_all(files) {
            of_pieces.entry(pieces).or_default().push((place, files));
        }
    }
    let mut found = Vec::new();
    for alike in of_pieces.values() {
        for (k, (place, files)) in alike.iter().enumerate().skip(1) {
            let is_same = |(_, others): &&(usize, &[PathBuf])| {
                files.iter().zip(*others).all(|(one, other)| same_bytes(one, other).unwrap_or(false))
            };
            if let Some((first, _)) = alike[..k].iter().find(is_same) {
                found.push((*place, *first));
            }
        }
    }
    found.sort_unstable();
    found
}

fn pieces_of_all(files: &[PathBuf]) -> io::Result<Pieces> {
    let is_looked_into = |k: usize| files.len() <= MOST_FILES || k == 0 || k == files.len() - 1;
    let of_one = |(k, file): (usize, &PathBuf)| match is_looked_into(k) {
        true => pieces(file),
        false => Ok((std::fs::metadata(file)?.len(), Vec::new())),
    };
    files.iter().enumerate().map(of_one).collect()
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

    #[test]
    fn folders_of_pictures_are_the_same_by_all_of_their_pictures() {
        let parent = tempfile::tempdir().unwrap();
        let folder = |name: &str, names: &[&str], changed: Option<usize>| -> Vec<PathBuf> {
            let folder = parent.path().join(name);
            fs::create_dir(&folder).unwrap();
            for (k, name) in names.iter().enumerate() {
                let level = if changed == Some(k) { 7 } else { k as u8 };
                fs::write(folder.join(name), [&b"P5 2 1 255 "[..], &[level, 9]].concat()).unwrap();
            }
            files_of(&folder).unwrap()
        };
        let names = ["a1.pgm", "a2.pgm", "a3.pgm", "a4.pgm"];
        let recordings = [
            folder("one", &names, None),
            folder("changed", &names, Some(2)),
            folder("copied", &names, None),
            folder("renamed", &["b1.pgm", "b2.pgm", "b3.pgm", "b4.pgm"], None),
            folder("shorter", &names[..3], None),
            // The same folder by another path.
            files_of(&parent.path().join("changed").join("..").join("changed")).unwrap(),
            Vec::new(),
            Vec::new(),
        ];
        assert_eq!(same(recordings.iter().map(Vec::as_slice)), [(2, 0), (3, 0), (5, 1)]);
    }
}
