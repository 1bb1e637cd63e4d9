//! Places of a row that hold a marker which no outline showed: speckles are sparse, so that an outline may end within a marker, or reach a rod
//! beside it, and is then unlike the others or off its place.

use chainwave_measurement::median;

use crate::markers::patches::Patch;
use crate::markers::row::Row;
use crate::markers::texture::Texture;

/// Texture in the middle of a marker over that of the weakest of its row, at least: where a marker ends, windows are half full.
const LEAST_SHARE: f64 = 0.5;

impl Row {
    /// The row with the markers at its empty places, and at those before its first and behind its last, as far as the picture reaches.
    pub(crate) fn with_held(mut self, texture: &Texture) -> Self {
        let (Some([start, step]), Some(half_px)) = (self.line(), self.half_px()) else { return self };
        let weakest =
            self.members.iter().filter_map(|(_, patch)| texture.plateau(patch)).fold(f64::INFINITY, f64::min);
        let holds = |slot: i64| {
            let centre_px = [0, 1].map(|axis| start[axis] + slot as f64 * step[axis]);
            let patch = Patch::around(centre_px, half_px, texture.size)?;
            let plateau = texture.plateau(&patch)?;
            let is_marker = plateau >= LEAST_SHARE * weakest && texture.has_speckles(&patch);
            is_marker.then_some((slot, patch))
        };
        let slots: Vec<i64> = self.members.iter().map(|(slot, _)| *slot).collect();
        let (Some(&first), Some(&last)) = (slots.first(), slots.last()) else { return self };
        let between = (first..=last).filter(|slot| !slots.contains(slot)).filter_map(holds);
        let before = (1..).map_while(|n| holds(first - n));
        let behind = (1..).map_while(|n| holds(last + n));
        let held: Vec<(i64, Patch)> = between.chain(before).chain(behind).collect();
        self.members.extend(held);
        self.members.sort_by_key(|(slot, _)| *slot);
        self
    }

    /// Half of the width and height of its markers.
    pub(crate) fn half_px(&self) -> Option<[f64; 2]> {
        let of = |axis: usize| median(self.members.iter().map(|(_, patch)| patch.half_px()[axis]).collect());
        Some([of(0)?, of(1)?])
    }
}
