//! Points to follow: read from a table, given subsets, and followed through an opened recording.

use std::num::NonZero;

use chainwave_correlation::{
    CorrelationError, Method, Reference, ReferenceFrames, Settings, SubsetSize, subset_size,
};
use chainwave_measurement::{Recording, Subset, Track};

use crate::configuration::outline;
use crate::error::Error;
use crate::input::table::{Table, shown};
use crate::monitor::{Monitor, Stage};
use crate::tracking::follow::{Followed, FollowedSubset, edges_beside, follow_with};
use crate::tracking::matching::{MethodChoice, noise_px};

/// Half size of a subset of no given size that lies in no frame.
const LEAST_HALF_PX: usize = 5;
/// Half sizes are smaller than this.
const MOST_HALF_PX: f64 = 1e6;
/// The columns of half sizes.
const HALVES: [&str; 2] = ["half_width_px", "half_height_px"];

/// A point to follow; the size of its subset may be left open.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedPoint {
    name: String,
    place_px: [f64; 2],
    half_px: [Option<usize>; 2],
    outline_px: Vec<[f64; 2]>,
}

impl PlacedPoint {
    /// The points of a table: `name, x_px, y_px`, unless they are left open `half_width_px, half_height_px`, and where subsets are no
    /// rectangles `outline_px`.
    ///
    /// # Errors
    /// A missing column, a cell that makes no sense, a name twice, and no point at all.
    pub fn of_table(table: &Table) -> Result<Vec<Self>, Error> {
        let names = table.texts("name")?;
        if let Some(row) = (1..names.len()).find(|row| names[..*row].contains(&names[*row])) {
            return Err(table.cell(row, "name", "each name once", &names[row]));
        }
        if let Some(row) = names.iter().position(String::is_empty) {
            return Err(table.cell(row, "name", "a name", "nothing"));
        }
        let (x_px, y_px) = (table.full_numbers("x_px")?, table.full_numbers("y_px")?);
        let [half_widths, half_heights] = HALVES.map(|name| half_sizes(table, name));
        let (half_widths, half_heights) = (half_widths?, half_heights?);
        let outlines = match table.has("outline_px") {
            true => table.texts("outline_px")?,
            false => vec![String::new(); names.len()],
        };
        let outline = |(row, text): (usize, &String)| {
            outline::of_cell(text).ok_or_else(|| table.cell(row, "outline_px", outline::EXPECTED, text))
        };
        let outlines = outlines.iter().enumerate().map(outline).collect::<Result<Vec<_>, _>>()?;
        let point = |((row, name), outline_px): ((usize, String), Vec<[f64; 2]>)| Self {
            name,
            place_px: [x_px[row], y_px[row]],
            half_px: match (half_widths[row], half_heights[row]) {
                (None, None) if !outline_px.is_empty() => outline::half_px(&outline_px).map(Some),
                (width, height) => [width, height],
            },
            outline_px,
        };
        let points: Vec<Self> = names.into_iter().enumerate().zip(outlines).map(point).collect();
        match points.is_empty() {
            true => Err(table.cell(0, "name", "at least one point", "none")),
            false => Ok(points),
        }
    }

    /// The subset in a recording: of the given size, or of one that the texture, the frame and the other points ask for.
    fn placed(
        &self,
        recording: &dyn Recording,
        others: &[[f64; 2]],
        reference: &ReferenceFrames,
        error_px: f64,
    ) -> Result<PlacedSubset, Error> {
        let [width, height] = self.half_px;
        let chosen = match width.or(height) {
            Some(_) => None,
            None => match subset_size(recording, self.place_px, others, reference, error_px) {
                // No subset fits there: the point is lost, whatever the size.
                Err(CorrelationError::SubsetOutside { .. }) => None,
                found => Some(found?),
            },
        };
        let [x_px, y_px] = self.place_px;
        let given = |half: Option<usize>, other: Option<usize>| half.or(other).unwrap_or(LEAST_HALF_PX);
        let (half_width_px, half_height_px) = match chosen {
            Some(size) => (size.half_width_px, size.half_height_px),
            None => (given(width, height), given(height, width)),
        };
        let subset = Subset::new(self.name.clone(), x_px, y_px, half_width_px, half_height_px)
            .within(self.outline_px.clone());
        Ok(PlacedSubset { subset, chosen })
    }
}

/// The half sizes along an axis, as far as they are given; none where their column is left out.
fn half_sizes(table: &Table, name: &str) -> Result<Vec<Option<usize>>, Error> {
    // A column that may be meant for it is not passed over.
    let is_another = |column: &str| column.contains("half") && !HALVES.contains(&column);
    if !table.has(name) && !table.names().any(is_another) {
        return Ok(vec![None; table.texts("name")?.len()]);
    }
    let whole = |value: f64| value >= 0.0 && value.fract() == 0.0 && value < MOST_HALF_PX;
    let half = |(row, value): (usize, Option<f64>)| match value {
        Some(value) if !whole(value) => {
            Err(table.cell(row, name, "a whole number from 0 to 999999, or nothing", &shown(value)))
        }
        value => Ok(value.map(|value| value as usize)),
    };
    table.numbers(name)?.into_iter().enumerate().map(half).collect()
}

/// A subset, and how its size was chosen where it was left open.
#[derive(Debug, Clone)]
pub struct PlacedSubset {
    /// The subset.
    pub subset: Subset,
    /// The choice of its size.
    pub chosen: Option<SubsetSize>,
}

/// The subsets around points; one of no given size is as small as an error (0.01 px where none is asked for) allows.
///
/// # Errors
/// A reference whose pixels cannot be read, or that shows no texture at a point.
pub fn subsets_in(
    recording: &dyn Recording,
    points: &[PlacedPoint],
    reference: &ReferenceFrames,
    error_px: Option<f64>,
) -> Result<Vec<PlacedSubset>, Error> {
    let error_px = noise_px(error_px);
    let all: Vec<[f64; 2]> = points.iter().map(|point| point.place_px).collect();
    let one = |(i, point): (usize, &PlacedPoint)| {
        let others = [&all[..i], &all[i + 1..]].concat();
        point.placed(recording, &others, reference, error_px)
    };
    points.iter().enumerate().map(one).collect()
}

/// How points are followed through recordings.
#[derive(Debug, Clone, Copy)]
pub struct PointTracking<'a> {
    /// The points.
    pub points: &'a [PlacedPoint],
    /// The way of matching.
    pub choice: MethodChoice,
    /// The frames in which the points are given.
    pub reference: &'a ReferenceFrames,
    /// Threads for each recording.
    pub n_threads: NonZero<usize>,
}

/// What came of the points of one recording.
#[derive(Debug, Clone)]
pub struct FollowedPoints {
    /// The tracks.
    pub followed: Followed,
    /// What a careful reader should know: what the file says against itself, points outside, sharp edges.
    pub notes: Vec<String>,
    /// The subsets, with how their sizes were chosen.
    pub placed: Vec<PlacedSubset>,
    /// The method that was named or chosen.
    pub method: Method,
}

impl PointTracking<'_> {
    /// Follows the points through one recording. A point whose subset reaches outside its frames is lost.
    ///
    /// # Errors
    /// What the correlation refuses, and pixels that cannot be read.
    pub fn follow(&self, recording: &dyn Recording, monitor: &Monitor<'_>) -> Result<FollowedPoints, Error> {
        let reference = self.reference;
        let placed = subsets_in(recording, self.points, reference, self.choice.accuracy_px())?;
        let subsets: Vec<Subset> = placed.iter().map(|placed| placed.subset.clone()).collect();
        let (inside, outside): (Vec<Subset>, Vec<Subset>) =
            subsets.iter().cloned().partition(|subset| Reference::lies_inside(recording, subset));
        let mut notes = recording.info().warnings.clone();
        notes.extend(outside.iter().map(|Subset { name, x_px, y_px, .. }| {
            let place = [x_px, y_px].map(|px| shown(*px)).join(", ");
            format!("point {name} at ({place}): its subset reaches outside the image, so it is lost")
        }));
        notes.extend(edges_beside(recording, &inside, reference)?.iter().map(ToString::to_string));
        let method = self.choice.method(recording, &inside, reference)?;
        monitor.planned(Stage::Tracking, recording.info().n_frames as u64);
        let settings = Settings { n_threads: self.n_threads, surfaces_bend: true, ..Settings::default() };
        let followed = follow_with(recording, &subsets, reference, method, &settings, monitor)?;
        notes.extend(followed.tracks.iter().filter_map(|one| still_note(&one.track)));
        notes.extend(followed.tracks.iter().filter_map(cover_note));
        notes.extend(followed.tracks.iter().filter_map(ground_note));
        Ok(FollowedPoints { followed, notes, placed, method })
    }
}

/// What is to be said of a point before which something stands.
fn cover_note(FollowedSubset { track, covered_share, .. }: &FollowedSubset) -> Option<String> {
    let percent = 100.0 * covered_share.as_ref()?;
    Some(format!(
        "point {}: something stands still before {percent:.0} % of its subset, which was left out there and wherever the subset passes behind it (hint: a \
         cable, a rod, a dirty window: clear the view, or place the point beside it)",
        track.name
    ))
}

/// What is to be said of a point whose subset holds ground.
fn ground_note(FollowedSubset { track, ground_share, .. }: &FollowedSubset) -> Option<String> {
    let percent = 100.0 * ground_share.as_ref()?;
    Some(format!(
        "point {}: {percent:.0} % of its subset is ground that stays where it is when the point moves, and was left out (hint: a smaller \
         half_width_px or half_height_px, so that the subset lies on its marker alone)",
        track.name
    ))
}

/// What is to be said of a point of whose texture a part stands still.
fn still_note(Track { name, still_share, .. }: &Track) -> Option<String> {
    let percent = 100.0 * still_share.as_ref()?.value;
    Some(format!(
        "point {name}: about {percent:.0} % of its texture stands still in the image while the point moves, or changes with its place: its position lies between \
         what follows and what does not, and its sigma holds half of that (hint: dirt on the sensor or a reflection: a flat field, a polariser; ground inside the subset: \
         a smaller one)"
    ))
}
