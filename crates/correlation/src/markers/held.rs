//! Places of a row that hold a marker which no outline showed: speckles are sparse, so that an outline may end within a marker, or reach a rod
//! beside it, and is then unlike the others or off its place.

use chainwave_measurement::median;

use crate::markers::patches::Patch;
use crate::markers::row::Row;
use crate::markers::texture::Texture;

/// How many times the pitch may be shorter than that of a row of few.
const FINER: [i64; 3] = [2, 3, 4];
/// Texture in the middle of a marker over that of the weakest of its row, at least: where a marker ends, windows are half full.
const LEAST_SHARE: f64 = 0.5;

impl Row {
    /// The row with the markers at its empty places, and at those before its first and behind its last, as far as the picture reaches. Of a row
    /// of which only every second or third was seen, all places between hold one, and the pitch is as much shorter.
    pub(crate) fn with_held(mut self, texture: &Texture) -> Self {
        let finer = FINER.into_iter().find_map(|finer| {
            let places = self.places(texture, finer)?;
            let slots = self.members.iter().map(|(slot, _)| finer * slot);
            let (first, last) = (slots.clone().min()?, slots.max()?);
            let between = (first..=last).filter(|slot| slot % finer != 0);
            let held: Option<Vec<(i64, Patch)>> = between.map(|slot| places.holds(slot)).collect();
            Some((finer, held?))
        });
        if let Some((finer, held)) = finer {
            self.members.iter_mut().for_each(|(slot, _)| *slot *= finer);
            self.members.extend(held);
            self.members.sort_by_key(|(slot, _)| *slot);
        }
        let Some(places) = self.places(texture, 1) else { return self };
        let holds = |slot: i64| places.holds(slot);
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

    /// Its places, and so many times as many; `None` of a single marker, and where they would lie in each other.
    fn places<'a>(&self, texture: &'a Texture, finer: i64) -> Option<Places<'a>> {
        let ([start, step], half_px) = (self.line()?, self.half_px()?);
        let step = step.map(|step| step / finer as f64);
        let weakest =
            self.members.iter().filter_map(|(_, patch)| texture.plateau(patch)).fold(f64::INFINITY, f64::min);
        let is_apart = [0, 1].iter().any(|&axis| step[axis].abs() > 2.0 * half_px[axis]);
        is_apart.then_some(Places { texture, start, step, half_px, weakest })
    }

    /// Half of the width and height of its markers.
    pub(crate) fn half_px(&self) -> Option<[f64; 2]> {
        let of = |axis: usize| median(self.members.iter().map(|(_, patch)| patch.half_px()[axis]).collect());
        Some([of(0)?, of(1)?])
    }
}

/// Where markers of a row may be.
struct Places<'a> {
    texture: &'a Texture,
    start: [f64; 2],
    step: [f64; 2],
    half_px: [f64; 2],
    /// The least texture of those that are known.
    weakest: f64,
}

impl Places<'_> {
    /// The marker at a place; `None` where there is none.
    fn holds(&self, slot: i64) -> Option<(i64, Patch)> {
        let Self { texture, start, step, half_px, weakest } = *self;
        let centre_px = [0, 1].map(|axis| start[axis] + slot as f64 * step[axis]);
        let patch = Patch::around(centre_px, half_px, texture.size)?;
        let plateau = texture.plateau(&patch)?;
        let is_marker = plateau >= LEAST_SHARE * weakest && texture.has_speckles(&patch);
        is_marker.then_some((slot, patch))
    }
}
