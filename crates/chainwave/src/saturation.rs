//! Pixels at the top of the sensor's range, which tell no texture: said of a recording before its tracks are believed.

use chainwave_camera::histogram;
use chainwave_measurement::Recording;

/// Frames that are looked at, spread over the recording.
const N_FRAMES: usize = 8;
/// Of the pixels; fewer are glints, which the matching leaves out.
const TOLD_SHARE: f64 = 0.01;

/// What is said of a recording of which more than a hundredth of the pixels is saturated. One that can be read only from its beginning on is
/// not read twice for it.
pub(crate) fn saturation(recording: &dyn Recording) -> Option<String> {
    if recording.is_sequential() {
        return None;
    }
    let counts = histogram(recording, N_FRAMES).ok()?;
    let saturation = counts.saturation()?;
    let share = saturation.n_pixels as f64 / counts.total() as f64;
    (share > TOLD_SHARE).then(|| {
        format!(
            "{:.0} % of the pixels are saturated, at {} counts: they show no texture (hint: a shorter exposure or less light; `chainwave \
             inspect` shows the counts)",
            100.0 * share,
            saturation.count
        )
    })
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::MemoryRecording;

    use super::*;

    #[test]
    fn many_saturated_pixels_are_told_and_a_glint_is_not() {
        let told = |n_saturated: usize| {
            let mut pixels: Vec<f32> = (0..1000).map(|i| (100 + i % 7) as f32).collect();
            let bright = pixels.len() - n_saturated;
            pixels[bright..].fill(255.0);
            saturation(&MemoryRecording::new(50, 20, vec![pixels]))
        };
        assert!(
            told(160).is_some_and(|said| said.starts_with("16 % of the pixels are saturated, at 255 counts"))
        );
        assert_eq!((told(5), told(0)), (None, None));
    }
}
