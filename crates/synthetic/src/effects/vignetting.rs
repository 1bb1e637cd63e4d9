//! Light that falls off from the middle of the picture towards its corners, as behind an open aperture.

/// Takes from whole rows of tones, from `first_row` on, a share of the light that grows with the square of the distance from the picture's
/// middle, up to `at_corner` in the corners' outer pixels: the first order of cos^4 and of a pupil that is cut.
pub(crate) fn vignette(
    tones: &mut [f32],
    [width_px, height_px]: [usize; 2],
    first_row: usize,
    at_corner: f64,
) {
    let middle = [width_px, height_px].map(|size| 0.5 * (size as f64 - 1.0));
    let corner_square = middle.iter().map(|half| half * half).sum::<f64>().max(f64::MIN_POSITIVE);
    for (row, tones) in tones.chunks_exact_mut(width_px).enumerate() {
        let of_row = ((first_row + row) as f64 - middle[1]).powi(2);
        for (column, tone) in tones.iter_mut().enumerate() {
            let square = (column as f64 - middle[0]).powi(2) + of_row;
            *tone *= (1.0 - at_corner * square / corner_square) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_lose_their_share_and_the_middle_nothing_whichever_rows_are_drawn() {
        let size = [9, 5];
        let mut whole = vec![2.0_f32; 45];
        vignette(&mut whole, size, 0, 0.3);
        for (corner, at) in [(0.7, 0), (0.7, 8), (0.7, 36), (0.7, 44), (1.0, 22)] {
            assert!((whole[at] - 2.0 * corner).abs() < 1e-6, "rounding to f32 alone: {at} {}", whole[at]);
        }
        // Half way to the right edge: a quarter of 4^2 of the corners' 4^2 + 2^2.
        assert!((whole[24] - 2.0 * (1.0 - 0.3 * 4.0 / 20.0)).abs() < 1e-6);
        let mut part = vec![2.0_f32; 18];
        vignette(&mut part, size, 2, 0.3);
        assert_eq!(part, whole[18..36]);
    }
}
