//! Whole frames, and which of many to look at.

use chainwave_measurement::{ReadError, Recording, Region};

/// The counts of a whole frame, row by row from the top.
pub(crate) fn whole_frame(recording: &dyn Recording, frame: usize) -> Result<Vec<f32>, ReadError> {
    let region = Region::whole(recording.info().width_px, recording.info().height_px);
    let mut pixels = vec![0.0; region.n_pixels()];
    recording.read_region(frame, region, &mut pixels)?;
    Ok(pixels)
}

/// At most `n` numbers below `n_all`, evenly spread, the first and the last among them.
pub(crate) fn spread(n: usize, n_all: usize) -> Vec<usize> {
    let n = n.min(n_all);
    match n {
        0 => Vec::new(),
        1 => vec![0],
        _ => (0..n).map(|index| index * (n_all - 1) / (n - 1)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_spread_from_the_first_to_the_last() {
        assert_eq!(spread(3, 101), [0, 50, 100]);
        assert_eq!(spread(5, 2), [0, 1]);
        assert_eq!((spread(1, 7), spread(4, 0)), (vec![0], vec![]));
    }
}
