//! Search for a subset at whole-pixel shifts, and for what is left of it when it has turned or stretched.

pub(crate) mod area;
pub(crate) mod chance;
mod fourier;
pub(crate) mod larger;
pub(crate) mod light;
pub(crate) mod patch;
pub(crate) mod rivals;
mod sums;
pub(crate) mod template;

use chainwave_measurement::{ReadError, Recording, Region};

use crate::PreparedSubset;
use crate::search::area::SearchArea;

/// The pixels of a frame where a subset may lie whose centre is expected at a place, up to `reach_px` columns and rows from it; `None` where
/// the frame holds none of these places.
pub(crate) fn area_around(
    recording: &dyn Recording,
    frame: usize,
    subset: &PreparedSubset,
    around_px: [f64; 2],
    reach_px: usize,
) -> Result<Option<SearchArea>, ReadError> {
    let Some(region) = region_around(recording, subset, around_px, reach_px) else { return Ok(None) };
    let mut pixels = vec![0.0; region.n_pixels()];
    recording.read_region(frame, region, &mut pixels)?;
    Ok(Some(SearchArea::new(region, pixels, subset.mean as f32)))
}

/// The pixels of all the subset's candidates, inside the frame; `None` when there is no candidate.
pub(crate) fn region_around(
    recording: &dyn Recording,
    subset: &PreparedSubset,
    [x, y]: [f64; 2],
    reach_px: usize,
) -> Option<Region> {
    let info = recording.info();
    let radius = i64::try_from(reach_px).unwrap_or(i64::MAX);
    let first = |centre: f64, offset: f64| (centre + offset).round() as i64;
    let (left, top) = (first(x, subset.first_px[0]), first(y, subset.first_px[1]));
    let end = |start: i64, n: usize| start.saturating_add(n as i64).saturating_add(radius);
    let region = Region::clipped(
        left.saturating_sub(radius),
        top.saturating_sub(radius),
        end(left, subset.width),
        end(top, subset.height),
        info.width_px,
        info.height_px,
    )?;
    (region.width >= subset.width && region.height >= subset.height).then_some(region)
}
