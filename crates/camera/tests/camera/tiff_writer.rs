//! An uncompressed TIFF written from the format's description, tag by tag.

use crate::writer::packed;

/// What to write.
pub(crate) struct TiffFile {
    pub(crate) width_px: usize,
    pub(crate) height_px: usize,
    pub(crate) bits: u32,
    pub(crate) high_byte_first: bool,
    /// BigTIFF.
    pub(crate) is_big: bool,
    pub(crate) rows_per_strip: usize,
    /// Bytes between strips.
    pub(crate) gap_bytes: usize,
    pub(crate) photometric: u64,
    pub(crate) compression: u64,
    pub(crate) sample_format: u64,
    pub(crate) orientation: u64,
    /// Samples of a pixel, which stand in a row's codes one after the other.
    pub(crate) n_samples: usize,
    pub(crate) planar: u64,
    /// What the last sample is, where the directory says so.
    pub(crate) extra_sample: Option<u64>,
    pub(crate) description: Option<String>,
    /// How many frames have a directory.
    pub(crate) n_directories: usize,
    pub(crate) frames: Vec<Vec<u16>>,
}

impl TiffFile {
    /// 16 bits, low byte first, each frame in one strip.
    pub(crate) fn new(width_px: usize, height_px: usize, frames: Vec<Vec<u16>>) -> Self {
        Self {
            width_px,
            height_px,
            bits: 16,
            high_byte_first: false,
            is_big: false,
            rows_per_strip: height_px,
            gap_bytes: 0,
            photometric: 1,
            compression: 1,
            sample_format: 1,
            orientation: 1,
            n_samples: 1,
            planar: 1,
            extra_sample: None,
            description: None,
            n_directories: frames.len(),
            frames,
        }
    }

    fn number(&self, value: u64, n_bytes: usize) -> Vec<u8> {
        let mut bytes = value.to_le_bytes()[..n_bytes].to_vec();
        if self.high_byte_first {
            bytes.reverse();
        }
        bytes
    }

    fn word(&self) -> usize {
        if self.is_big { 8 } else { 4 }
    }

    fn row(&self, codes: &[u16]) -> Vec<u8> {
        match self.bits {
            8 => codes.iter().map(|&code| code as u8).collect(),
            10 | 12 => packed(codes, self.bits as usize),
            _ => codes.iter().flat_map(|&code| self.number(code.into(), 2)).collect(),
        }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let word = self.word();
        let mut bytes = if self.high_byte_first { b"MM".to_vec() } else { b"II".to_vec() };
        bytes.extend(self.number(if self.is_big { 43 } else { 42 }, 2));
        if self.is_big {
            bytes.extend(self.number(8, 2));
            bytes.extend([0, 0]);
        }
        let mut link_at = bytes.len();
        bytes.extend(vec![0; word]);
        let strips: Vec<Vec<u64>> = self.frames.iter().map(|codes| self.strips(&mut bytes, codes)).collect();
        for offsets in &strips[..self.n_directories] {
            let offsets_at = bytes.len() as u64;
            bytes.extend(offsets.iter().flat_map(|&offset| self.number(offset, word)));
            let text = self.description.clone().unwrap_or_default() + "\0";
            let text_at = bytes.len() as u64;
            bytes.extend(text.as_bytes());
            let directory_at = self.number(bytes.len() as u64, word);
            bytes[link_at..link_at + word].copy_from_slice(&directory_at);
            self.directory(&mut bytes, offsets, offsets_at, (text_at, text.len() as u64));
            link_at = bytes.len() - word;
        }
        bytes
    }

    fn strip_bytes(&self) -> u64 {
        (self.width_px * self.height_px * self.n_samples * self.bits as usize).div_ceil(8) as u64
    }

    fn strips(&self, bytes: &mut Vec<u8>, codes: &[u16]) -> Vec<u64> {
        let row_samples = self.width_px * self.n_samples;
        let strip = |rows: &[u16]| -> Vec<u8> {
            let stored: Vec<u8> = rows.chunks(row_samples).flat_map(|row| self.row(row)).collect();
            let offset = bytes.len() as u64;
            bytes.extend(stored);
            bytes.extend(vec![0xEE; self.gap_bytes]);
            offset.to_le_bytes().to_vec()
        };
        let offsets: Vec<u8> = codes.chunks(row_samples * self.rows_per_strip).flat_map(strip).collect();
        offsets.as_chunks().0.iter().map(|&offset| u64::from_le_bytes(offset)).collect()
    }

    fn directory(
        &self,
        bytes: &mut Vec<u8>,
        offsets: &[u64],
        offsets_at: u64,
        (text_at, n_text): (u64, u64),
    ) {
        let word_kind = if self.is_big { 16 } else { 4 };
        let strips = if let [offset] = offsets { *offset } else { offsets_at };
        let entries = [
            (256, 4, 1, self.width_px as u64),
            (257, 4, 1, self.height_px as u64),
            (258, 3, 1, self.bits.into()),
            (259, 3, 1, self.compression),
            (262, 3, 1, self.photometric),
            (270, 2, n_text, text_at),
            (273, word_kind, offsets.len() as u64, strips),
            (274, 3, 1, self.orientation),
            (277, 3, 1, self.n_samples as u64),
            (278, 3, 1, self.rows_per_strip as u64),
            (279, 4, 1, self.strip_bytes()),
            (284, 3, 1, self.planar),
            (338, 3, 1, self.extra_sample.unwrap_or(0)),
            (339, 3, 1, self.sample_format),
        ];
        let is_written = |tag: u64| match tag {
            270 => self.description.is_some(),
            // Of images in one strip, which only a decoder asks for.
            279 => offsets.len() == 1,
            338 => self.extra_sample.is_some(),
            _ => true,
        };
        let n_entries = entries.iter().filter(|entry| is_written(entry.0)).count();
        bytes.extend(self.number(n_entries as u64, if self.is_big { 8 } else { 2 }));
        for (tag, kind, count, value) in entries.into_iter().filter(|entry| is_written(entry.0)) {
            bytes.extend(self.number(tag, 2));
            bytes.extend(self.number(kind, 2));
            bytes.extend(self.number(count, self.word()));
            let n_bytes = match (kind, count) {
                (3, _) => 2,
                (4, 1) => 4,
                _ => self.word(),
            };
            let mut field = self.number(value, n_bytes);
            field.resize(self.word(), 0);
            bytes.extend(field);
        }
        bytes.extend(vec![0; self.word()]);
    }
}
