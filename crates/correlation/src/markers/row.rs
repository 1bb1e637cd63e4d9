//! Rows: patches of like size at a regular pitch along a line.

use chainwave_measurement::Estimate;

use crate::markers::patches::Patch;

/// Patches of which rows are made: those with the most texture.
const MOST_PATCHES: usize = 200;
/// Largest ratio of the widths, and of the heights, of patches of like size.
const LIKE: f64 = 1.4;
/// Share of the pitch by which a patch may lie beside its place.
const OFF_SHARE: f64 = 0.12;
/// Places in a row that may be empty before it ends.
const MOST_EMPTY: usize = 2;
/// Standard uncertainty of the middle of an outline, in pixels, at least: averages over 11 px, of speckles that differ.
const CENTRE_SIGMA_PX: f64 = 1.5;

/// A row of patches.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    /// The place of each along the row, and the patch, in order.
    pub(crate) members: Vec<(i64, Patch)>,
    /// All their texture.
    pub(crate) texture: f64,
}

/// The line through a row.
pub(crate) struct Fitted {
    pub(crate) pitch_px: Option<Estimate>,
    pub(crate) direction: Option<[f64; 2]>,
    pub(crate) missing_px: Vec<[f64; 2]>,
}

/// The row with the most texture; one patch is a row, too.
pub(crate) fn best_row(mut patches: Vec<Patch>) -> Option<Row> {
    patches.sort_by(|a, b| b.texture.total_cmp(&a.texture));
    patches.truncate(MOST_PATCHES);
    let mut best: Option<Row> = None;
    let mut keep = |row: Row| {
        if best.as_ref().is_none_or(|found| row.texture > found.texture) {
            best = Some(row);
        }
    };
    for (i, one) in patches.iter().enumerate() {
        keep(Row { members: vec![(0, *one)], texture: one.texture });
        let next = |other: &&Patch| one.is_before(other) && one.is_like(other) && one.is_clear_of(other);
        for other in patches.iter().filter(next) {
            keep(Row::through(&patches, i, other));
        }
    }
    best
}

impl Patch {
    fn is_like(&self, other: &Self) -> bool {
        let (a, b) = (self.half_px(), other.half_px());
        [0, 1].iter().all(|&axis| a[axis] < LIKE * b[axis] && b[axis] < LIKE * a[axis])
    }

    /// Whether neither holds the other's middle: outlines that two thresholds draw of one marker do.
    fn is_clear_of(&self, other: &Self) -> bool {
        let (here, there) = (self.centre_px(), other.centre_px());
        let [a, b] = [self.half_px(), other.half_px()];
        [0, 1].iter().any(|&axis| (here[axis] - there[axis]).abs() > a[axis].max(b[axis]))
    }

    fn is_before(&self, other: &Self) -> bool {
        let step = minus(other.centre_px(), self.centre_px());
        if step[0].abs() >= step[1].abs() { step[0] > 0.0 } else { step[1] > 0.0 }
    }
}

impl Row {
    /// The row that goes on, both ways, from one patch and the next.
    fn through(patches: &[Patch], one: usize, next: &Patch) -> Self {
        let one = patches[one];
        let mut members = vec![(0, one), (1, *next)];
        for way in [1, -1] {
            let mut empty = 0;
            let mut slot = if way > 0 { 1 } else { 0 };
            while empty <= MOST_EMPTY {
                slot += way;
                let (start, step) = line(&members.iter().map(|(slot, patch)| (*slot, patch.centre_px())));
                let expected = plus(start, step, slot as f64);
                let most_off = OFF_SHARE * length(step);
                let off = |patch: &Patch| length(minus(patch.centre_px(), expected));
                let found = patches
                    .iter()
                    .filter(|patch| patch.is_like(&one) && off(patch) < most_off)
                    .min_by(|a, b| off(a).total_cmp(&off(b)));
                match found {
                    Some(patch) => {
                        empty = 0;
                        members.push((slot, *patch));
                    }
                    None => empty += 1,
                }
            }
        }
        members.sort_by_key(|(slot, _)| *slot);
        let texture = members.iter().map(|(_, patch)| patch.texture).sum();
        Self { members, texture }
    }

    /// The row without markers that the picture's sides cut: their middle is not that of their body.
    pub(crate) fn without_cut(mut self, size: [usize; 2]) -> Self {
        if let Some([x, y]) = self.fitted().direction {
            let axis = usize::from(y.abs() > x.abs());
            self.members.retain(|(_, patch)| patch.is_cut(size, axis) == [false, false]);
        }
        self
    }

    /// The line through a row of two or more: where number 0 is, and a step.
    pub(crate) fn line(&self) -> Option<[[f64; 2]; 2]> {
        let (start, step) = line(&self.members.iter().map(|(slot, patch)| (*slot, patch.centre_px())));
        (self.members.len() > 1).then_some([start, step])
    }

    /// Pitch, direction and empty places.
    pub(crate) fn fitted(&self) -> Fitted {
        let places = self.members.iter().map(|(slot, patch)| (*slot, patch.centre_px()));
        let n = places.clone().count();
        if n < 2 {
            return Fitted { pitch_px: None, direction: None, missing_px: Vec::new() };
        }
        let (start, step) = line(&places);
        let mean = places.clone().map(|(slot, _)| slot as f64).sum::<f64>() / n as f64;
        let spread: f64 = places.clone().map(|(slot, _)| (slot as f64 - mean).powi(2)).sum();
        let pitch = length(step);
        let along = |[x, y]: [f64; 2]| (x * step[0] + y * step[1]) / pitch;
        let left: f64 =
            places.clone().map(|(slot, at)| along(minus(at, plus(start, step, slot as f64))).powi(2)).sum();
        // A few outlines agree by chance.
        let scatter = (left / n.saturating_sub(2).max(1) as f64).sqrt().max(CENTRE_SIGMA_PX);
        let slots: Vec<i64> = places.map(|(slot, _)| slot).collect();
        let all = slots.iter().min().zip(slots.iter().max()).map_or(0..=0, |(first, last)| *first..=*last);
        let missing_px =
            all.filter(|slot| !slots.contains(slot)).map(|slot| plus(start, step, slot as f64)).collect();
        Fitted {
            pitch_px: Some(Estimate::new(pitch, scatter / spread.sqrt())),
            direction: Some(step.map(|component| component / pitch)),
            missing_px,
        }
    }
}

/// The line of least squares through places at whole numbers of steps: where number 0 is, and a step.
fn line(places: &(impl Iterator<Item = (i64, [f64; 2])> + Clone)) -> ([f64; 2], [f64; 2]) {
    let n = places.clone().count() as f64;
    let sum =
        |of: &dyn Fn(f64, [f64; 2]) -> f64| places.clone().map(|(slot, at)| of(slot as f64, at)).sum::<f64>();
    let mean = sum(&|slot, _| slot) / n;
    let spread = sum(&|slot, _| (slot - mean).powi(2));
    let step = [0, 1].map(|axis| sum(&|slot, at| (slot - mean) * at[axis]) / spread);
    let start = [0, 1].map(|axis| sum(&|_, at| at[axis]) / n - mean * step[axis]);
    (start, step)
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn plus(start: [f64; 2], step: [f64; 2], n: f64) -> [f64; 2] {
    [start[0] + n * step[0], start[1] + n * step[1]]
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}
