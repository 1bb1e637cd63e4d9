//! A .cine file written from the format's description, field by field.

use std::path::PathBuf;

use tempfile::TempDir;

/// How pixels are stored: (bits per pixel, bitmap compression).
pub(crate) const GRAY_8: (u16, u32) = (8, 0);
pub(crate) const GRAY_16: (u16, u32) = (16, 0);
pub(crate) const P10: (u16, u32) = (16, 256);
pub(crate) const P12L: (u16, u32) = (16, 1024);

/// 2023-11-14 22:13:20 UTC in units of 2^-32 s, with the flags that cameras set.
pub(crate) const TRIGGER: u64 = (1_700_000_000 << 32) | 3;

/// What to write; every default is a plain camera file of two 16x4 frames of 12 of 16 bits.
pub(crate) struct CineFile {
    pub(crate) version: u16,
    pub(crate) compression: u16,
    pub(crate) storage: (u16, u32),
    pub(crate) width_px: usize,
    pub(crate) height_px: usize,
    pub(crate) first_image: i32,
    /// Stored codes of each frame, top row first.
    pub(crate) frames: Vec<Vec<u16>>,
    pub(crate) setup_length: u16,
    /// Fields of the Setup block: offset and bytes. A field beyond the length is left out.
    pub(crate) setup_fields: Vec<(usize, Vec<u8>)>,
    pub(crate) stamps: Option<Vec<u64>>,
    /// Type of the block that holds them.
    pub(crate) stamp_block: u16,
    pub(crate) exposures: Option<Vec<u32>>,
    /// What stands behind each tagged block.
    pub(crate) padding: Vec<u8>,
    pub(crate) annotation: Vec<u8>,
    pub(crate) size_word: Option<u32>,
    /// Bytes left out between the pointers and the first frame.
    pub(crate) gap_bytes: u64,
}

impl Default for CineFile {
    fn default() -> Self {
        let frames = vec![codes(64, 4095, 1), codes(64, 4095, 2)];
        Self {
            version: 1,
            compression: 0,
            storage: GRAY_16,
            width_px: 16,
            height_px: 4,
            first_image: -1,
            stamps: Some(stamps(-1, frames.len(), 10_000.0)),
            stamp_block: 1002,
            exposures: Some(vec![425_201; frames.len()]),
            frames,
            setup_length: 0x640,
            setup_fields: vec![
                (0x300, 10_000_u32.to_le_bytes().to_vec()),
                (0x380, 12_u32.to_le_bytes().to_vec()),
                (0x620, 99_000_u32.to_le_bytes().to_vec()),
            ],
            padding: Vec::new(),
            annotation: Vec::new(),
            size_word: None,
            gap_bytes: 0,
        }
    }
}

impl CineFile {
    pub(crate) fn field(mut self, offset: usize, bytes: &[u8]) -> Self {
        self.setup_fields.push((offset, bytes.to_vec()));
        self
    }

    /// The bytes before the first frame, and the frames.
    fn parts(&self) -> (Vec<u8>, Vec<u8>) {
        let setup_at = 84;
        let mut blocks = Vec::new();
        if let Some(stamps) = &self.stamps {
            blocks
                .push(block(self.stamp_block, stamps.iter().flat_map(|stamp| stamp.to_le_bytes()).collect()));
        }
        blocks.push(block(1004, vec![7; 12]));
        if let Some(exposures) = &self.exposures {
            blocks.push(block(1003, exposures.iter().flat_map(|ticks| ticks.to_le_bytes()).collect()));
        }
        let tagged: Vec<u8> =
            blocks.into_iter().flat_map(|block| [block, self.padding.clone()].concat()).collect();
        let pointers_at = setup_at + u64::from(self.setup_length) + tagged.len() as u64;
        let pointer_bytes = if self.version == 0 { 4 } else { 8 };
        let frames_at = pointers_at + self.frames.len() as u64 * pointer_bytes + self.gap_bytes;
        let frames: Vec<Vec<u8>> = self.frames.iter().map(|codes| self.frame(codes)).collect();

        let mut bytes = self.headers(pointers_at as u32);
        bytes.extend(self.setup());
        bytes.extend(tagged);
        let mut at = frames_at;
        for frame in &frames {
            bytes.extend(&at.to_le_bytes()[..pointer_bytes as usize]);
            at += frame.len() as u64;
        }
        (bytes, frames.concat())
    }

    fn headers(&self, pointers_at: u32) -> Vec<u8> {
        let n_images = self.frames.len() as u32;
        let mut bytes = b"CI".to_vec();
        bytes.extend([44, self.compression, self.version].iter().flat_map(|value| value.to_le_bytes()));
        bytes.extend((-5_i32).to_le_bytes());
        bytes.extend(1000_u32.to_le_bytes());
        bytes.extend(self.first_image.to_le_bytes());
        bytes.extend([n_images, 44, 84, pointers_at].iter().flat_map(|value| value.to_le_bytes()));
        bytes.extend(TRIGGER.to_le_bytes());
        bytes.extend(
            [40, self.width_px as u32, self.height_px as u32].iter().flat_map(|value| value.to_le_bytes()),
        );
        bytes.extend([1, self.storage.0].iter().flat_map(|value| value.to_le_bytes()));
        let image_bytes = self.pixels(&self.frames[0]).len() as u32;
        bytes.extend(
            [self.storage.1, image_bytes, 35_714, 35_714, 0, 4096].iter().flat_map(|v| v.to_le_bytes()),
        );
        bytes
    }

    fn setup(&self) -> Vec<u8> {
        let mut setup = vec![0; self.setup_length.into()];
        setup[0x8C..0x8E].copy_from_slice(b"ST");
        setup[0x8E..0x90].copy_from_slice(&self.setup_length.to_le_bytes());
        for (offset, field) in &self.setup_fields {
            if let Some(place) = setup.get_mut(*offset..offset + field.len()) {
                place.copy_from_slice(field);
            }
        }
        setup
    }

    fn frame(&self, codes: &[u16]) -> Vec<u8> {
        let pixels = self.pixels(codes);
        let mut bytes = (8 + self.annotation.len() as u32).to_le_bytes().to_vec();
        bytes.extend(&self.annotation);
        bytes.extend(self.size_word.unwrap_or(pixels.len() as u32).to_le_bytes());
        bytes.extend(pixels);
        bytes
    }

    fn pixels(&self, codes: &[u16]) -> Vec<u8> {
        let bottom_first = codes.chunks(self.width_px).rev().flatten();
        match self.storage {
            GRAY_8 => bottom_first.map(|&code| code as u8).collect(),
            P10 => packed(codes, 10),
            P12L => packed(codes, 12),
            _ => bottom_first.flat_map(|code| code.to_le_bytes()).collect(),
        }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let (head, frames) = self.parts();
        [head, vec![0; self.gap_bytes as usize], frames].concat()
    }

    /// Writes the file into a folder that lives as long as the returned value.
    pub(crate) fn write(&self) -> (TempDir, PathBuf) {
        written(&self.bytes())
    }

    /// As [`CineFile::write`], the gap as a hole in the file.
    pub(crate) fn write_sparse(&self) -> (TempDir, PathBuf) {
        use std::io::{Seek, SeekFrom, Write};
        let (head, frames) = self.parts();
        let (folder, path) = written(&head);
        let mut file = std::fs::OpenOptions::new().write(true).open(&path).unwrap();
        file.seek(SeekFrom::Start(head.len() as u64 + self.gap_bytes)).unwrap();
        file.write_all(&frames).unwrap();
        (folder, path)
    }
}

/// A file of these bytes under a name that says nothing of its format.
pub(crate) fn written(bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.bin");
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

/// `n` codes up to `high`, different for each seed.
pub(crate) fn codes(n: usize, high: u16, seed: u32) -> Vec<u16> {
    let code = |index: u32| ((index + 977 * seed).wrapping_mul(2_654_435_761) >> 16) as u16 % (high + 1);
    (0..n as u32).map(code).collect()
}

/// Time stamps of images from number `first` at `rate_hz`, as a camera without external clock writes them.
pub(crate) fn stamps(first: i64, n: usize, rate_hz: f64) -> Vec<u64> {
    let ticks = |number: i64| (number as f64 / rate_hz * 4_294_967_296.0).round() as i64;
    (first..first + n as i64).map(|number| TRIGGER.wrapping_add_signed(ticks(number)) | 3).collect()
}

fn block(kind: u16, data: Vec<u8>) -> Vec<u8> {
    let size = 8 + data.len() as u32;
    [size.to_le_bytes().to_vec(), kind.to_le_bytes().to_vec(), vec![1, 0], data].concat()
}

/// Codes of `bits` bits in a row, highest bit first.
pub(crate) fn packed(codes: &[u16], bits: usize) -> Vec<u8> {
    let mut bytes = vec![0_u8; (codes.len() * bits).div_ceil(8)];
    for (index, code) in codes.iter().enumerate() {
        for bit in (0..bits).filter(|bit| u32::from(*code) >> (bits - 1 - bit) & 1 == 1) {
            let at = index * bits + bit;
            bytes[at / 8] |= 0x80 >> (at % 8);
        }
    }
    bytes
}
