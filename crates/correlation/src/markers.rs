//! Markers proposed: speckled patches of like size at a regular pitch along a line, found in frames at rest.
//!
//! A patch is where the smaller eigenvalue of the structure tensor (J. Shi, C. Tomasi, CVPR 1994, 593-600) is large: an edge, a rod or a
//! ring has a gradient in one direction only, speckles have it in both. How large is large follows from no setting: patches are looked for
//! at falling thresholds (`patches`), down to what noise alone could show (`texture`), and of all rows of like patches at a regular
//! pitch (`row`) that with the most texture is taken, or one of stickers that stand out by their shade (`shades`), where it has more. Ground between markers that holds edges, such as rings that touch, should be 40 px wide.

mod held;
mod outline;
mod patches;
mod row;
mod shades;
mod texture;

use chainwave_measurement::{Estimate, Lost, Recording, Region, Subset};

use crate::error::no_markers::NoMarkers;
use crate::expected::{expected_sigma, noise_between};
use crate::markers::patches::{Patch, add_new, patches};
use crate::markers::row::{Row, best_row};
use crate::markers::shades::larger_by_shade;
use crate::markers::texture::Texture;
use crate::reference::mean_of_frames;
use crate::subset_size::{LEAST_HALF_PX, MOST_HALF_PX};
use crate::{CorrelationError, Reference, ReferenceFrames, Settings, SharpEdge, Side, sharp_edge};

/// Pixels between a subset and the edge of its marker, which rings through the interpolation; of a small marker no more than this share of
/// its half size.
const TO_EDGE_PX: f64 = 5.0;
const TO_EDGE_SHARE: f64 = 0.25;
/// Pixels by which a subset is made smaller at most, where an edge runs beside it: as many as outlines may be wrong by, and those in which an edge
/// is seen.
const MOST_OFF_PX: usize = 8;
/// Thresholds that are tried, each a share of the one before.
const N_THRESHOLDS: usize = 18;
const THRESHOLD_SHARE: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// A row of markers.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkerRow {
    /// The markers, from left to right, or from the top of a row that is steeper than 45 degrees.
    pub markers: Vec<Marker>,
    /// Distance from one body to the next, in pixels; `None` of a single marker.
    pub pitch_px: Option<Estimate>,
    /// Unit vector (x, y) along the row; `None` of a single marker.
    pub direction: Option<[f64; 2]>,
    /// Places (x, y) within the row where a marker is expected and none was found.
    pub missing_px: Vec<[f64; 2]>,
    /// Standard deviation of a pixel's noise in one frame, in counts.
    pub noise_counts: f64,
}

/// A marker, and the subset proposed on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Marker {
    /// The subset, named by its number from 1; all of a row have one size. It keeps away from the marker's edge.
    pub subset: Subset,
    /// Half of the marker's own width and height, in pixels, to 2 px or so.
    pub outline_half_px: [f64; 2],
    /// Expected standard uncertainty of its position along x and y, in pixels, or why it has none.
    pub sigma_px: Result<[f64; 2], Lost>,
}

/// Proposes the markers that frames at rest show.
///
/// # Errors
/// [`CorrelationError::NoMarkers`] with the reason, [`CorrelationError::NoSuchReference`], and [`CorrelationError::Reference`] when a frame
/// cannot be read.
pub fn propose_markers(
    recording: &dyn Recording,
    rest: &ReferenceFrames,
) -> Result<MarkerRow, CorrelationError> {
    let info = recording.info();
    let frame = Region::whole(info.width_px, info.height_px);
    Reference::check_frames(recording, rest)?;
    let pixels = mean_of_frames(recording, frame, rest.range())?;
    let between = noise_between(recording, frame, rest)?;
    let texture =
        Texture::of(&pixels, [info.width_px, info.height_px], between.map(|v| v / rest.range().len() as f64));
    let no_markers = |reason| CorrelationError::NoMarkers { path: recording.path().into(), reason };
    let noise_counts = (texture.noise_variance * rest.range().len() as f64).sqrt();
    let row = most_textured_row(&texture).map_err(no_markers)?;
    let half_px = row.half_px().unwrap_or_default().map(subset_half_px);
    let centres_px: Vec<[f64; 2]> = row.members.iter().map(|(_, outline)| outline.centre_px()).collect();
    let half_px = off_edges(recording, rest, &centres_px, half_px)?;
    let fitted = row.fitted();
    let mut markers = Vec::new();
    for (_, outline) in &row.members {
        let [x_px, y_px] = outline.centre_px();
        let name = (markers.len() + 1).to_string();
        let subset = Subset::new(name, x_px, y_px, half_px[0], half_px[1]);
        if !Reference::lies_inside(recording, &subset) {
            continue;
        }
        let expected = expected_sigma(recording, &subset, rest, &Settings::default())?;
        let sigma_px = expected.map(|sigma| sigma.noise_px);
        markers.push(Marker { subset, outline_half_px: outline.half_px(), sigma_px });
    }
    if markers.is_empty() {
        return Err(no_markers(NoMarkers::NoPatch));
    }
    Ok(MarkerRow {
        markers,
        pitch_px: fitted.pitch_px,
        direction: fitted.direction,
        missing_px: fitted.missing_px,
        noise_counts,
    })
}

/// Half of a subset on a marker of a half size: away from its edge, and no larger than a tracker needs.
fn subset_half_px(marker_half_px: f64) -> usize {
    let to_edge = TO_EDGE_PX.min(TO_EDGE_SHARE * marker_half_px);
    ((marker_half_px - to_edge).floor().max(0.0) as usize).clamp(LEAST_HALF_PX, MOST_HALF_PX)
}

/// The largest half sizes up to some, the same for all markers, with which no sharp edge rings into a subset: outlines are known to 2 px or so,
/// and [`sharp_edge`] sees. Where no size that outlines allow is free of edges, these are the texture's own, and the size stays.
fn off_edges(
    recording: &dyn Recording,
    rest: &ReferenceFrames,
    centres_px: &[[f64; 2]],
    half_px: [usize; 2],
) -> Result<[usize; 2], CorrelationError> {
    let mut smaller_px = half_px;
    loop {
        let mut beside = [false; 2];
        for (number, [x_px, y_px]) in centres_px.iter().enumerate() {
            let subset = Subset::new(number.to_string(), *x_px, *y_px, smaller_px[0], smaller_px[1]);
            if Reference::lies_inside(recording, &subset)
                && let Some(edge) = sharp_edge(recording, &subset, rest)?.filter(SharpEdge::rings)
            {
                beside[usize::from(matches!(edge.side, Side::Above | Side::Below))] = true;
            }
        }
        if beside == [false; 2] {
            return Ok(smaller_px);
        }
        for axis in [0, 1] {
            smaller_px[axis] -= usize::from(beside[axis]);
            if smaller_px[axis] < LEAST_HALF_PX || smaller_px[axis] + MOST_OFF_PX < half_px[axis] {
                return Ok(half_px);
            }
        }
    }
}

/// The row with the most texture, of the markers that any threshold shows: two that lie close are apart at a high one, and a faint one is
/// whole at a low one.
fn most_textured_row(texture: &Texture) -> Result<Row, NoMarkers> {
    let most = texture.most();
    if most <= texture.least {
        return Err(NoMarkers::NoTexture);
    }
    let mut markers: Vec<Patch> = Vec::new();
    let mut is_everywhere = false;
    let thresholds =
        std::iter::successors(Some(THRESHOLD_SHARE * most), |threshold| Some(THRESHOLD_SHARE * threshold));
    for threshold in thresholds.take(N_THRESHOLDS).take_while(|threshold| *threshold > texture.least) {
        let (everywhere, some): (Vec<Patch>, Vec<Patch>) =
            patches(texture, threshold).into_iter().partition(|patch| patch.is_everywhere(texture.size));
        is_everywhere |= !everywhere.is_empty();
        add_new(&mut markers, some.iter().filter_map(|patch| texture.marker(patch)));
    }
    let row = best_row(markers).map(|row| row.without_cut(texture.size).with_held(texture));
    let row = larger_by_shade(row, texture);
    let none = if is_everywhere { NoMarkers::Everywhere } else { NoMarkers::NoPatch };
    row.filter(|row| !row.members.is_empty()).ok_or(none)
}
