//! Subsets followed through a recording, and why they are lost.

use crate::Estimate;

/// The rectangle of pixels that is followed, given in the reference frame.
///
/// It holds the pixels within `half_width_px` columns and `half_height_px` rows of the pixel nearest to (`x_px`,
/// `y_px`), so it is `2 * half + 1` pixels wide and high; of these, where it has an outline, those whose centres lie within.
#[derive(Debug, Clone, PartialEq)]
pub struct Subset {
    /// Name of the body or point.
    pub name: String,
    /// Column of the centre, in pixels.
    pub x_px: f64,
    /// Row of the centre, in pixels.
    pub y_px: f64,
    /// Columns on each side of the centre.
    pub half_width_px: usize,
    /// Rows above and below the centre.
    pub half_height_px: usize,
    /// Corners of a polygon, column and row in pixels from the centre; none where the whole rectangle is followed.
    pub outline_px: Vec<[f64; 2]>,
}

impl Subset {
    /// The whole rectangle.
    pub fn new(
        name: impl Into<String>,
        x_px: f64,
        y_px: f64,
        half_width_px: usize,
        half_height_px: usize,
    ) -> Self {
        Self { name: name.into(), x_px, y_px, half_width_px, half_height_px, outline_px: Vec::new() }
    }

    /// The part of it that a rectangle around another place shows, `[x, y]` pixels from the centre.
    #[must_use]
    pub fn part_at(&self, [x, y]: [f64; 2], half_width_px: usize, half_height_px: usize) -> Self {
        let outline_px = self.outline_px.iter().map(|corner| [corner[0] - x, corner[1] - y]).collect();
        let (x_px, y_px) = (self.x_px + x, self.y_px + y);
        Self { name: self.name.clone(), x_px, y_px, half_width_px, half_height_px, outline_px }
    }

    /// What lies within a polygon alone: corners in pixels from the centre.
    #[must_use]
    pub fn within(self, outline_px: Vec<[f64; 2]>) -> Self {
        Self { outline_px, ..self }
    }
}

/// Where a subset's centre was found in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Column of the centre, in pixels.
    pub x_px: Estimate,
    /// Row of the centre, in pixels.
    pub y_px: Estimate,
    /// The angle by which the subset is turned since its reference, in radians, from right towards down in the picture, in
    /// (-pi, pi]; `None` where the method does not tell it (a shape function that only shifts, the faster tiers).
    pub theta_rad: Option<Estimate>,
    /// Zero-normalised cross-correlation with the reference, at most 1.
    pub zncc: f64,
    /// Gauss-Newton iterations used.
    pub iterations: u32,
}

/// Why a subset has no position in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Lost {
    /// The subset lies partly outside the frame.
    OutOfView,
    /// The subset's reference has too little contrast to be located.
    NoTexture,
    /// The best match resembles the reference too little.
    LowCorrelation,
    /// The best match resembles the reference no more than the reference resembles itself elsewhere: its pattern repeats.
    Ambiguous,
    /// The iteration did not settle within its limit.
    NotConverged,
    /// The frame's pixels could not be read.
    Unreadable,
    /// A reader of the pictures took the reading out.
    Excluded,
}

impl Lost {
    /// All reasons.
    pub const ALL: [Self; 7] = [
        Self::OutOfView,
        Self::NoTexture,
        Self::LowCorrelation,
        Self::Ambiguous,
        Self::NotConverged,
        Self::Unreadable,
        Self::Excluded,
    ];

    /// The reason of a name in a table's `status` column; `None` for `ok` and what is no reason.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|reason| reason.as_str() == name)
    }

    /// The reason as it stands in a table's `status` column.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::OutOfView => "out_of_view",
            Self::NoTexture => "no_texture",
            Self::LowCorrelation => "low_correlation",
            Self::Ambiguous => "ambiguous",
            Self::NotConverged => "not_converged",
            Self::Unreadable => "unreadable",
            Self::Excluded => "excluded",
        }
    }
}

/// The positions of one subset in every frame of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Name of the subset.
    pub name: String,
    /// One entry for each frame, from frame 0.
    pub positions: Vec<Result<Position, Lost>>,
    /// Share of the subset's texture that stands still in the image while the rest moves, of its squared gradients; where that is beyond
    /// doubt and to be seen in the positions, which hold what it keeps back. Told of single tracks alone.
    pub still_share: Option<Estimate>,
}
