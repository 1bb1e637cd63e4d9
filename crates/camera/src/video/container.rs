//! Where a video's container says that it ends, by its outermost chunks: AVI (RIFF), MP4 (boxes), Matroska (EBML).

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use crate::error::CameraError;

/// Outermost chunks that are looked at; recordings of many gigabytes have some ten.
const MOST_CHUNKS: usize = 10_000;
/// Bytes at the start of a chunk that its size is found in.
const CHUNK_HEAD: usize = 16;

/// A video that is shorter than its container says.
pub(super) struct Cut {
    /// Where the container ends, in bytes from its start.
    pub(super) stated_bytes: u64,
    /// Where the file does.
    pub(super) file_bytes: u64,
    /// Frames of an AVI that are wholly there; of other containers nobody says.
    n_whole: Option<usize>,
}

impl Cut {
    /// How many of the frames that can be decoded are whole: decoders fill up the last one, of which the file holds a part.
    pub(super) fn n_whole(&self, n_decoded: usize) -> usize {
        self.n_whole.map_or(n_decoded.saturating_sub(1), |n_whole| n_whole.min(n_decoded))
    }
}

/// Whether and how a video is cut short.
pub(super) fn cut(path: &Path) -> Result<Option<Cut>, CameraError> {
    let mut file = File::open(path).map_err(|source| CameraError::Io { path: path.into(), source })?;
    cut_of(&mut file).map_err(|source| CameraError::Io { path: path.into(), source })
}

fn cut_of(file: &mut File) -> std::io::Result<Option<Cut>> {
    let file_bytes = file.metadata()?.len();
    let mut kind = None;
    let mut at = 0;
    for _ in 0..MOST_CHUNKS {
        let head = head_at(file, at)?;
        let Some(found) = ContainerKind::of(&head) else { return Ok(None) };
        // What follows a container of one kind is no chunk of another.
        if *kind.get_or_insert(found) != found {
            return Ok(None);
        }
        let Some(size) = found.chunk_bytes(&head) else { return Ok(None) };
        at = at.saturating_add(size);
        if at >= file_bytes {
            break;
        }
    }
    if at <= file_bytes {
        return Ok(None);
    }
    let n_whole =
        if kind == Some(ContainerKind::Riff) { Some(whole_frames(file, file_bytes)?) } else { None };
    Ok(Some(Cut { stated_bytes: at, file_bytes, n_whole }))
}

/// The pictures of an AVI that are wholly in the file: chunks named by a stream and `dc` or `db`, in lists within lists.
fn whole_frames(file: &mut File, file_bytes: u64) -> std::io::Result<usize> {
    let (mut n_whole, mut at) = (0, 0_u64);
    loop {
        let head = head_at(file, at)?;
        let (Some(name), Some(&size)) =
            (head.first_chunk::<4>(), head.get(4..).and_then(|rest| rest.first_chunk()))
        else {
            return Ok(n_whole);
        };
        // Zeros where a disk was full are no chunks.
        if !name.iter().all(|letter| letter.is_ascii_graphic() || *letter == b' ') {
            return Ok(n_whole);
        }
        let size = u64::from(u32::from_le_bytes(size));
        let holds_pictures = head
            .get(8..12)
            .is_some_and(|list| [b"movi", b"rec ", b"AVI ", b"AVIX"].iter().any(|name| list == *name));
        if [b"RIFF", b"LIST"].contains(&name) && holds_pictures {
            at += 12;
            continue;
        }
        at = at.saturating_add(8 + size);
        if name[..2].iter().all(u8::is_ascii_digit) && [b"dc", b"db"].iter().any(|kind| name[2..] == **kind) {
            n_whole += usize::from(at <= file_bytes);
        }
        at = at.saturating_add(size % 2);
    }
}

/// The first bytes of a chunk.
fn head_at(file: &mut File, at: u64) -> std::io::Result<Vec<u8>> {
    let mut head = Vec::new();
    file.seek(SeekFrom::Start(at))?;
    file.by_ref().take(CHUNK_HEAD as u64).read_to_end(&mut head)?;
    Ok(head)
}

/// What the outermost chunks are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ContainerKind {
    Riff,
    Ebml,
    Box,
}

impl ContainerKind {
    fn of(head: &[u8]) -> Option<Self> {
        let is_letter = |letter: &u8| letter.is_ascii_alphanumeric() || *letter == b' ';
        if head.starts_with(b"RIFF") {
            Some(Self::Riff)
        } else if head.starts_with(&[0x1A, 0x45, 0xDF, 0xA3]) || head.starts_with(&[0x18, 0x53, 0x80, 0x67]) {
            Some(Self::Ebml)
        } else {
            head.get(4..8)?.iter().all(is_letter).then_some(Self::Box)
        }
    }

    /// Bytes of the chunk that starts with `head`; `None` where it does not say.
    fn chunk_bytes(self, head: &[u8]) -> Option<u64> {
        match self {
            Self::Riff => {
                let size = u32::from_le_bytes(*head.get(4..)?.first_chunk()?);
                // Programs that stop early leave 0 or all bits set.
                (size != 0 && size != u32::MAX).then(|| 8 + u64::from(size) + u64::from(size % 2))
            }
            Self::Ebml => ebml_bytes(head.get(4..)?).map(|bytes| 4 + bytes),
            Self::Box => match u32::from_be_bytes(*head.first_chunk()?) {
                1 => Some(u64::from_be_bytes(*head.get(8..)?.first_chunk()?)).filter(|&size| size >= 16),
                size @ 8.. => Some(size.into()),
                _ => None,
            },
        }
    }
}

/// A size in Matroska's coding and the bytes that follow it; `None` where it is unknown. The first byte's leading zeros count the
/// bytes behind it.
fn ebml_bytes(coded: &[u8]) -> Option<u64> {
    let first = *coded.first()?;
    let n_more = first.leading_zeros() as usize;
    let rest = coded.get(1..=n_more)?;
    let start = u64::from(first) & (0x7F >> n_more.min(7));
    let size = rest.iter().fold(start, |size, &byte| size << 8 | u64::from(byte));
    let unknown = (1_u64 << (7 * (n_more + 1))) - 1;
    (n_more < 8 && size != unknown).then(|| 1 + n_more as u64 + size)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk_bytes(head: &[u8]) -> Option<u64> {
        ContainerKind::of(head)?.chunk_bytes(head)
    }

    #[test]
    fn chunks_of_every_container_say_how_long_they_are() {
        assert_eq!(chunk_bytes(b"RIFF\x10\0\0\0AVI LIST"), Some(24));
        assert_eq!(chunk_bytes(b"RIFF\x11\0\0\0AVI LIST"), Some(26));
        assert_eq!(chunk_bytes(b"RIFF\0\0\0\0AVI LIST"), None);
        assert_eq!(chunk_bytes(b"\0\0\0\x18ftypisom"), Some(24));
        assert_eq!(chunk_bytes(b"\0\0\0\x01mdat\0\0\0\x02\0\0\0\x01"), Some((2 << 32) + 1));
        assert_eq!(chunk_bytes(b"\0\0\0\0mdat"), None);
        assert_eq!(chunk_bytes(&[0x1A, 0x45, 0xDF, 0xA3, 0x9F]), Some(5 + 0x1F));
        assert_eq!(chunk_bytes(&[0x18, 0x53, 0x80, 0x67, 0x40, 0x02]), Some(6 + 2));
        let long = [0x18, 0x53, 0x80, 0x67, 0x01, 0, 0, 0, 0, 1, 0, 0];
        assert_eq!(chunk_bytes(&long), Some(12 + 0x1_0000));
        let unknown = [0x18, 0x53, 0x80, 0x67, 0x01, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF];
        assert_eq!(chunk_bytes(&unknown), None);
        for head in [b"".as_slice(), b"RIFF", b"junk, behind it", &[0x1A, 0x45, 0xDF, 0xA3, 0x00, 1, 2]] {
            assert_eq!(chunk_bytes(head), None, "{head:?}");
        }
    }
}
