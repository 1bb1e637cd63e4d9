//! Whether a method keeps up with what a film shows: tried on the film itself, from where it begins to move, against the method that follows
//! most.

use chainwave_measurement::{Excerpt, Position, Recording, Subset, Track};

use crate::{CorrelationError, Interpolation, Method, ReferenceFrames, Settings, Shape, ShapeChoice};

/// Subsets that are followed at most, spread over those given.
const MAX_SUBSETS: usize = 4;
/// Frames that a method is tried on, from the first motion on.
const MAX_FRAMES: usize = 120;
/// A subset that has moved by so many pixels moves.
const MOVING_PX: f64 = 0.5;
/// The method that follows turns, stretches and jumps.
const ROBUST: Method =
    Method::IcGn { interpolation: Interpolation::Cubic, shape: ShapeChoice::Named(Shape::Affine) };

/// Some frames of a film, in their order, and the places of some subsets in them.
pub(crate) struct Trial<'a> {
    excerpt: Excerpt<'a>,
    reference: ReferenceFrames,
    subsets: Vec<Subset>,
    followed: Vec<Track>,
}

impl<'a> Trial<'a> {
    /// The reference frames of a recording and those after its first motion.
    ///
    /// # Errors
    /// As [`crate::track`].
    pub(crate) fn new(
        recording: &'a dyn Recording,
        subsets: &[Subset],
        reference: &ReferenceFrames,
        settings: &Settings,
    ) -> Result<Self, CorrelationError> {
        let every = subsets.len().div_ceil(MAX_SUBSETS).max(1);
        let subsets: Vec<Subset> = subsets.iter().step_by(every).cloned().collect();
        let range = reference.range();
        let whole = ROBUST.track(recording, &subsets, reference, settings, &|_| ())?;
        let moves = |frame: &usize| {
            whole.iter().zip(&subsets).any(|(track, subset)| match &track.positions[*frame] {
                Ok(Position { x_px, y_px, .. }) => {
                    (x_px.value - subset.x_px).hypot(y_px.value - subset.y_px) > MOVING_PX
                }
                Err(_) => true,
            })
        };
        let n_frames = recording.info().n_frames;
        let first = (range.end..n_frames).find(moves).unwrap_or(range.end).max(range.end + 1) - 1;
        let frames: Vec<usize> = range.chain((first..n_frames).take(MAX_FRAMES)).collect();
        let excerpt = Excerpt::new(recording, frames);
        let reference = match reference {
            ReferenceFrames::Single(_) => ReferenceFrames::Single(0),
            ReferenceFrames::Mean(range) => ReferenceFrames::Mean(0..range.len()),
        };
        let followed = ROBUST.track(&excerpt, &subsets, &reference, settings, &|_| ())?;
        Ok(Self { excerpt, reference, subsets, followed })
    }

    /// Whether a method finds all that is there to be found, nowhere farther off than an error and the noise allow.
    ///
    /// # Errors
    /// As [`crate::track`].
    pub(crate) fn is_held_by(
        &self,
        method: Method,
        error_px: f64,
        settings: &Settings,
    ) -> Result<bool, CorrelationError> {
        let tracks = method.track(&self.excerpt, &self.subsets, &self.reference, settings, &|_| ())?;
        let (mut square, mut variance, mut n) = (0.0, 0.0, 0.0);
        let pairs = self.followed.iter().zip(&tracks);
        for (there, found) in pairs.flat_map(|(there, found)| there.positions.iter().zip(&found.positions)) {
            let Ok(there) = there else { continue };
            let Ok(found) = found else { return Ok(false) };
            for (a, b) in [(there.x_px, found.x_px), (there.y_px, found.y_px)] {
                square += (a.value - b.value).powi(2);
                variance += a.sigma.powi(2);
                n += 1.0;
            }
        }
        Ok(square <= n * error_px.powi(2) + variance)
    }
}
