//! How far apart neighbours lie in the picture: the step at which its texture repeats itself along the chain.

use chainwave_measurement::Subset;

/// Fewer bodies in view do not repeat a step often enough to tell it.
const LEAST_BODIES: usize = 4;
/// How far a pitch is looked for around the stated one.
const REACH: f64 = 0.3;
/// Correlation of the texture with itself, a pitch farther on, from which on a pitch is believed.
const LEAST_CORRELATION: f64 = 0.3;

/// Pixels between neighbours as the experiment has them, and as the picture has them; `None` where it does not repeat itself.
///
/// The chain runs along x. Of each column the mean difference between neighbouring pixels is taken, over the rows of the bodies'
/// subsets and as many above and below; its autocorrelation peaks at a pitch, and more sharply at several.
pub(super) fn pitch_in_picture(
    picture: &[f32],
    width_px: usize,
    bodies: &[(usize, Subset)],
) -> Option<[f64; 2]> {
    let (first, last) = (&bodies.first()?.1, &bodies.last()?.1);
    if bodies.len() < LEAST_BODIES {
        return None;
    }
    // Of a chain to the left the last one lies before the first.
    let stated_px = (last.x_px - first.x_px).abs() / (bodies.len() - 1) as f64;
    let height_px = picture.len() / width_px;
    let (middle, reach) = (first.y_px.round() as usize, 2 * first.half_height_px);
    let rows = middle.saturating_sub(reach)..(middle + reach + 1).min(height_px);
    let profile: Vec<f64> = (0..width_px - 1)
        .map(|x| {
            let difference =
                |y: usize| f64::from(picture[y * width_px + x + 1] - picture[y * width_px + x]).abs();
            rows.clone().map(difference).sum()
        })
        .collect();
    let near = |steps: f64, pitch_px: f64, reach: f64| {
        let (from, to) = (steps * pitch_px - reach * pitch_px, steps * pitch_px + reach * pitch_px);
        peak(&profile, from.max(1.0) as usize, to as usize)
    };
    let mut found = near(1.0, stated_px, REACH)?;
    for steps in 2..bodies.len() - 1 {
        // Each further step is looked for where the last one puts it.
        let Some(next) = near(steps as f64, found, 0.1) else { break };
        found = next / steps as f64;
    }
    Some([stated_px, found])
}

/// The lag between two of the highest autocorrelation, where that is a peak and high enough.
fn peak(profile: &[f64], from: usize, to: usize) -> Option<f64> {
    let lags: Vec<f64> = (from..=to).map(|lag| autocorrelation(profile, lag)).collect();
    let best = (1..lags.len().checked_sub(1)?).max_by(|a, b| lags[*a].total_cmp(&lags[*b]))?;
    let (before, at, after) = (lags[best - 1], lags[best], lags[best + 1]);
    let bend = before - 2.0 * at + after;
    let is_peak = at >= before && at >= after && at > LEAST_CORRELATION && bend < 0.0;
    is_peak.then(|| (from + best) as f64 + 0.5 * (before - after) / bend)
}

/// Correlation of a profile with itself, so many columns farther on; 0 where they hardly overlap.
fn autocorrelation(profile: &[f64], lag: usize) -> f64 {
    let Some(n) = profile.len().checked_sub(lag).filter(|n| *n > profile.len() / 5) else { return 0.0 };
    let (left, right) = (&profile[..n], &profile[lag..]);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / n as f64;
    let (of_left, of_right) = (mean(left), mean(right));
    let mut sums = [0.0; 3];
    for (a, b) in left.iter().zip(right) {
        let (a, b) = (a - of_left, b - of_right);
        sums[0] += a * b;
        sums[1] += a * a;
        sums[2] += b * b;
    }
    sums[0] / (sums[1] * sums[2]).sqrt().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_of_a_drawn_row_of_markers_is_found_wherever_it_is_looked_for() {
        // Markers of 31 px, 60.5 px apart, each with speckle of its own.
        let (width, height, pitch) = (400_usize, 40_usize, 60.5_f64);
        let marker = |x: usize| (x as f64 - 30.0) / pitch;
        let picture: Vec<f32> = (0..width * height)
            .map(|i| {
                let (x, y) = (i % width, i / width);
                let from_centre = (marker(x) - marker(x).round()) * pitch;
                let speckle = ((x * 7919 + y * 104_729 + x * y * 31) % 97) as f32;
                if from_centre.abs() < 15.5 { 100.0 + 10.0 * speckle } else { 400.0 }
            })
            .collect();
        for stated in [55.0, 60.5, 66.0] {
            let bodies: Vec<(usize, Subset)> = (1..=5)
                .map(|body| {
                    let x_px = 30.0 + stated * (body - 1) as f64;
                    let (half_width_px, half_height_px) = (8, 8);
                    (body, Subset::new(body.to_string(), x_px, 20.0, half_width_px, half_height_px))
                })
                .collect();
            let [told, found] = pitch_in_picture(&picture, width, &bodies).unwrap();
            assert!((told - stated).abs() < 1e-9);
            // Edges lie on whole pixels: half a pixel over three steps.
            assert!((found - pitch).abs() < 0.2, "{found} from {stated}");
            // The same chain from its other end, as one that goes to the left is numbered.
            let to_the_left: Vec<(usize, Subset)> = bodies.into_iter().rev().collect();
            assert_eq!(pitch_in_picture(&picture, width, &to_the_left), Some([told, found]));
        }
        let plain = vec![400.0; width * height];
        assert!(pitch_in_picture(&plain, width, &[]).is_none());
    }
}
