//! Pixels of a subset that stay where they are when it moves: ground that its box holds beside the marker.

use chainwave_measurement::{Position, Recording, Region, Subset, median};

use super::pixels::{LEAST_FRAMES, LEAST_PIXELS, Texture, bounds_at, joined, pieces};
use crate::reference::{mean_of_frames, pixel_bounds};
use crate::{CorrelationError, ReferenceFrames};

/// Change of a pixel where it is over the change where the subset has gone to, up to which it did not go along: of what goes along it is the
/// other way round.
const STAYS_SHARE: f64 = 0.1;
/// Change over the mean of all pixels from which on it tells something.
const TELLING_SHARE: f64 = 0.1;
/// The same from which on a pixel beside those that stay does not go along either, such as ground before the marker, which comes to lie over it.
const GONE_SHARE: f64 = 0.25;
/// Times of what the pixels change that go along, besides: a mean square of noise in four frames is not as large in one of a thousand.
const BEYOND_NOISE: f64 = 5.0;

/// Mean squares of the changes of one pixel.
#[derive(Debug, Clone, Copy, Default)]
struct Change {
    n: f64,
    /// Of what is seen where it was.
    in_place: f64,
    /// Of what is seen where the subset has gone to.
    along: f64,
}

/// What of a subset stays where it is.
pub(super) struct Staying {
    /// Columns and rows of its pixels.
    pub(super) pixels: Vec<[usize; 2]>,
    /// Their share of the subset.
    pub(super) share: f64,
}

/// What of a subset stays where it is when it moves; `None` where that is nothing.
pub(super) fn staying(
    recording: &dyn Recording,
    subset: &Subset,
    reference: &ReferenceFrames,
    frames: &[(usize, Position)],
) -> Result<Option<Staying>, CorrelationError> {
    let info = recording.info();
    let clipped =
        |[x0, x1, y0, y1]: [i64; 4]| Region::clipped(x0, y0, x1 + 1, y1 + 1, info.width_px, info.height_px);
    let Some(own) = clipped(pixel_bounds(subset)) else { return Ok(None) };
    let texture = mean_of_frames(recording, own, reference.range()).map_err(CorrelationError::Reference)?;
    let mut changes = vec![Change::default(); own.n_pixels()];
    for (frame, position) in frames {
        let Some(region) = clipped(joined(pixel_bounds(subset), bounds_at(subset, position))) else {
            continue;
        };
        let mut seen = vec![0.0; region.n_pixels()];
        if recording.read_region(*frame, region, &mut seen).is_err() {
            continue;
        }
        let seen = Texture { region, pixels: &seen };
        let (sin, cos) = position.theta_rad.map_or(0.0, |theta| theta.value).sin_cos();
        for (i, (change, was)) in changes.iter_mut().zip(&texture).enumerate() {
            let place = [(own.x + i % own.width) as f64, (own.y + i / own.width) as f64];
            let [dx, dy] = [place[0] - subset.x_px, place[1] - subset.y_px];
            let gone = [position.x_px.value + cos * dx - sin * dy, position.y_px.value + sin * dx + cos * dy];
            if let (Some(here), Some(there)) = (seen.at(place), seen.at(gone)) {
                change.n += 1.0;
                change.in_place += (here - f64::from(*was)).powi(2);
                change.along += (there - f64::from(*was)).powi(2);
            }
        }
    }
    let staying = pixels_that_stay(&changes, own.width);
    let share = staying.len() as f64 / own.n_pixels() as f64;
    let pixels = staying.into_iter().map(|i| [own.x + i % own.width, own.y + i / own.width]).collect();
    Ok((share > 0.0).then_some(Staying { pixels, share }))
}

/// Those that surely stay, and hang together, with those beside them that do not go along.
fn pixels_that_stay(changes: &[Change], width: usize) -> Vec<usize> {
    let means: Vec<Option<[f64; 2]>> = changes
        .iter()
        .map(|change| {
            (change.n >= LEAST_FRAMES as f64).then(|| [change.in_place / change.n, change.along / change.n])
        })
        .collect();
    let known = || means.iter().flatten();
    let mean = known().map(|[in_place, along]| in_place.max(*along)).sum::<f64>() / known().count() as f64;
    let going: Vec<f64> =
        known().filter(|[in_place, along]| along < in_place).map(|[_, along]| *along).collect();
    let usual = median(going).unwrap_or(0.0);
    let least = (GONE_SHARE * mean).max(BEYOND_NOISE * usual);
    let surely = |mean_squares: &Option<[f64; 2]>| {
        mean_squares
            .is_some_and(|[in_place, along]| along > TELLING_SHARE * mean && in_place < STAYS_SHARE * along)
    };
    let sure: Vec<bool> = means.iter().map(surely).collect();
    let may_be = |mean_squares: &Option<[f64; 2]>| mean_squares.is_some_and(|[_, along]| along > least);
    let all: Vec<bool> = means.iter().zip(&sure).map(|(means, sure)| *sure || may_be(means)).collect();
    let n_sure = |piece: &Vec<usize>| piece.iter().filter(|at| sure[**at]).count();
    pieces(&all, width).into_iter().filter(|piece| n_sure(piece) >= LEAST_PIXELS).flatten().collect()
}
