//! Whether a method keeps up with what a film shows: tried on the film itself, from where it begins to move, against the method that follows
//! most.

use chainwave_measurement::{Excerpt, Lost, Position, Recording, Subset, Track};

use crate::{CorrelationError, Interpolation, Method, ReferenceFrames, Settings, Shape, ShapeChoice};

/// Subsets that are followed at most, spread over those given.
const MAX_SUBSETS: usize = 8;
/// Frames that a method is tried on, from the first motion on.
const MAX_FRAMES: usize = 2000;
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

    /// How a method fares against the one that follows most.
    ///
    /// # Errors
    /// As [`crate::track`].
    pub(crate) fn of(&self, method: Method, settings: &Settings) -> Result<OnFilm, CorrelationError> {
        let tracks = method.track(&self.excerpt, &self.subsets, &self.reference, settings, &|_| ())?;
        let (mut square, mut variance) = (0.0, 0.0);
        let (mut n_found, mut n_lost, mut n_by_none) = (0, 0, 0);
        let pairs = self.followed.iter().zip(&tracks);
        let readings = pairs.flat_map(|(there, found)| there.positions.iter().zip(&found.positions));
        // a place that is given says nothing
        let n_given = self.reference.range().len();
        let n_frames = self.excerpt.info().n_frames;
        for (_, (there, found)) in readings.enumerate().filter(|(i, _)| i % n_frames >= n_given) {
            match (there, found) {
                (Ok(there), Ok(found)) => {
                    n_found += 1;
                    for (a, b) in [(there.x_px, found.x_px), (there.y_px, found.y_px)] {
                        square += (a.value - b.value).powi(2);
                        variance += a.sigma.powi(2);
                    }
                }
                (Ok(_), Err(_)) => n_lost += 1,
                (Err(Lost::OutOfView | Lost::Unreadable), _) => (),
                (Err(_), _) => n_by_none += 1,
            }
        }
        // Of differences along both axes, less what noise explains: of all by what is stated, and of those that stay from frame to frame by their
        // products, which show less than that.
        let excess: f64 = (square - variance) / f64::from(2 * n_found.max(1));
        let lasting = self.lasting_square(&tracks, n_given);
        let error_px = (n_found > 0).then(|| excess.max(lasting).max(0.0).sqrt());
        Ok(OnFilm { error_px, n_found, n_lost, n_by_none })
    }

    /// Mean product of the differences in one frame and in the next, without what noise adds: a frame's own noise, which the next one has not, adds
    /// nothing, and that of the reference, which both have, so many times less as it has frames.
    fn lasting_square(&self, tracks: &[Track], n_given: usize) -> f64 {
        let (mut products, mut squares, mut n) = (0.0, 0.0, 0_u32);
        for (there, found) in self.followed.iter().zip(tracks) {
            let differences: Vec<Option<[f64; 2]>> =
                there.positions.iter().zip(&found.positions).skip(n_given).map(difference).collect();
            for pair in differences.windows(2) {
                if let [Some(now), Some(next)] = pair {
                    products += now[0] * next[0] + now[1] * next[1];
                    squares += 0.5 * (now.iter().chain(next).map(|one| one * one).sum::<f64>());
                    n += 2;
                }
            }
        }
        let of_noise = (squares - products).max(0.0) / n_given.max(1) as f64;
        (products - of_noise) / f64::from(n.max(1))
    }
}

/// What a reading is off from another one along both axes, in pixels, where both are found.
fn difference((there, found): (&Result<Position, Lost>, &Result<Position, Lost>)) -> Option<[f64; 2]> {
    let (there, found) = (there.as_ref().ok()?, found.as_ref().ok()?);
    Some([found.x_px.value - there.x_px.value, found.y_px.value - there.y_px.value])
}

/// How a method fares on some frames of a film against the one that follows most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OnFilm {
    /// Root mean square difference along one axis beyond what noise explains, in pixels; none where nothing was found.
    pub(crate) error_px: Option<f64>,
    /// Readings that both have.
    pub(crate) n_found: u32,
    /// Those that the other has alone.
    pub(crate) n_lost: u32,
    /// Those in the view that not even the other has: hidden ones, for one.
    n_by_none: u32,
}

impl OnFilm {
    /// Whether it finds all that is there to be found, nowhere farther off than an error and the noise allow. What neither finds says nothing
    /// against it, however much of a film a body is hidden in, unless that is all there is; nor does a film without a reading outside of its
    /// reference.
    pub(crate) fn holds(&self, error_px: f64) -> bool {
        let shows_any = self.n_found > 0 || self.n_by_none == 0;
        self.n_lost == 0 && shows_any && self.error_px.is_none_or(|found_px| found_px <= error_px)
    }
}
