//! A baseline JPEG of blocks of one brightness each, written from the format's description: such blocks are coded without loss.

/// Pixels of a block's side.
const BLOCK: usize = 8;

/// A JPEG whose `channels` (one of brightness, or brightness, blue and red) have the given levels, block by block, row by row.
pub(crate) fn jpeg_bytes((n_columns, n_rows): (usize, usize), channels: &[Vec<u8>]) -> Vec<u8> {
    let n_channels = channels.len() as u8;
    let mut bytes = vec![0xFF, 0xD8];
    // All steps of the quantisation are 8, so that a flat block's only coefficient is its level less 128.
    bytes.extend(segment(0xDB, &[vec![0], vec![8; 64]].concat()));
    let sides = [(BLOCK * n_rows) as u16, (BLOCK * n_columns) as u16].map(u16::to_be_bytes).concat();
    let mut frame = [vec![8], sides, vec![n_channels]].concat();
    (1..=n_channels).for_each(|channel| frame.extend([channel, 0x11, 0]));
    bytes.extend(segment(0xC0, &frame));
    // Sizes 0 to 8 of differences have codes of four bits; the end of a block has one of one bit.
    let lengths =
        |at: usize, n: u8| (0..16).map(|length| if length == at { n } else { 0 }).collect::<Vec<u8>>();
    bytes.extend(segment(0xC4, &[vec![0x00], lengths(3, 9), (0..9).collect()].concat()));
    bytes.extend(segment(0xC4, &[vec![0x10], lengths(0, 1), vec![0]].concat()));
    let mut scan = vec![n_channels];
    (1..=n_channels).for_each(|channel| scan.extend([channel, 0]));
    scan.extend([0, 63, 0]);
    bytes.extend(segment(0xDA, &scan));
    bytes.extend(blocks(channels));
    bytes.extend([0xFF, 0xD9]);
    bytes
}

/// A JPEG with an EXIF segment of one directory, which states an orientation, high byte first.
pub(crate) fn with_orientation(jpeg: &[u8], orientation: u8) -> Vec<u8> {
    let exif =
        [&b"Exif\0\0MM\0\x2A\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"[..], &[orientation, 0, 0], &[0; 4]]
            .concat();
    [&jpeg[..2], &segment(0xE1, &exif), &jpeg[2..]].concat()
}

fn segment(marker: u8, data: &[u8]) -> Vec<u8> {
    [vec![0xFF, marker], (data.len() as u16 + 2).to_be_bytes().to_vec(), data.to_vec()].concat()
}

fn blocks(channels: &[Vec<u8>]) -> Vec<u8> {
    let mut bits = Vec::new();
    let mut last = vec![0_i32; channels.len()];
    for block in 0..channels[0].len() {
        for (channel, last) in channels.iter().zip(&mut last) {
            let level = i32::from(channel[block]) - 128;
            let difference = level - *last;
            *last = level;
            let size = 32 - difference.unsigned_abs().leading_zeros();
            push(&mut bits, size, 4);
            // Negative differences are written less one, so that their first bit is 0.
            push(&mut bits, (difference - i32::from(difference < 0)) as u32, size);
            push(&mut bits, 0, 1);
        }
    }
    bits.resize(bits.len().next_multiple_of(8), true);
    let bytes = bits.chunks(8).map(|bits| bits.iter().fold(0_u8, |byte, &bit| byte << 1 | u8::from(bit)));
    bytes.flat_map(|byte| if byte == 0xFF { vec![0xFF, 0] } else { vec![byte] }).collect()
}

fn push(bits: &mut Vec<bool>, value: u32, n_bits: u32) {
    bits.extend((0..n_bits).rev().map(|bit| value >> bit & 1 == 1));
}
