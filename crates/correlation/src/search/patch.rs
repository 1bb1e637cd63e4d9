//! Search for a patch that is turned, stretched or scaled: all shifts of a few dozen deformations, on pictures of half the size where their
//! texture allows it.

use chainwave_measurement::Region;

use crate::PreparedSubset;
use crate::reference::image::ReferenceImage;
use crate::search::area::SearchArea;
use crate::search::chance::n_speckles;
use crate::search::template::Template;
use crate::warp::Warp;

/// Angles between neighbouring directions of the search, in degrees: an iteration starts from half of that.
const ANGLE_STEP_DEG: f64 = 15.0;
/// Factors of length besides 1.
const FACTORS: [f64; 6] = [0.5, 0.63, 0.8, 1.25, 1.6, 2.0];
/// Factors between them and 1.
const FACTORS_BETWEEN: [f64; 6] = [0.56, 0.71, 0.9, 1.12, 1.4, 1.8];
/// Best deformations of a group that are tried by a match.
const N_TRIED: usize = 3;
/// Least half width of a template.
const LEAST_HALF_PX: f64 = 5.0;
/// Finer angles (degrees) and factors that are tried around the best.
const FINER: ([f64; 3], [f64; 3]) = ([-5.0, 0.0, 5.0], [0.92, 1.0, 1.09]);
/// Pixels around a place found on the coarse picture that are searched on the fine one.
const FINE_REACH_PX: usize = 4;
/// Speckles of a pixel below which a picture of half the size still shows them: of Gaussian speckles of 3 px it has 19 parts of 20.
const COARSE: f64 = 0.2;

/// A linear deformation: rows of 1 + gradient.
type Linear = [[f64; 2]; 2];

/// Which deformations are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Deformations {
    /// Turns by all angles.
    Turns,
    /// Stretches along an axis, then turns of scaled pictures.
    Stretches,
    /// Turns, then stretches.
    All,
    /// Turns, then stretches along an axis, then scaled pictures that are not turned, in steps half as wide: for a patch twice as large.
    Fine,
}

impl Deformations {
    /// How many they are.
    pub(crate) fn count(self) -> usize {
        self.groups().iter().map(Vec::len).sum()
    }

    fn groups(self) -> Vec<Vec<Linear>> {
        let n_turns = (360.0 / ANGLE_STEP_DEG) as usize;
        let turns = |from: usize| (from..n_turns).map(|step| turn(ANGLE_STEP_DEG * step as f64));
        let along = |factor: f64| [[[factor, 0.0], [0.0, 1.0]], [[1.0, 0.0], [0.0, factor]]];
        let stretches = FACTORS.into_iter().flat_map(along);
        let scaled = FACTORS.into_iter().flat_map(|factor| {
            turns(0).map(move |turn| turn.map(|row| row.map(|entry| factor * entry))).collect::<Vec<_>>()
        });
        match self {
            Self::Turns => vec![turns(1).collect()],
            Self::Stretches => vec![stretches.collect(), scaled.collect()],
            Self::All => vec![turns(1).collect(), stretches.collect(), scaled.collect()],
            Self::Fine => {
                let between = (0..n_turns).map(|step| turn(ANGLE_STEP_DEG * (step as f64 + 0.5)));
                let finer = FACTORS_BETWEEN.into_iter().flat_map(along);
                let scaled =
                    FACTORS.into_iter().chain(FACTORS_BETWEEN).map(|factor| [[factor, 0.0], [0.0, factor]]);
                vec![turns(1).chain(between).collect(), stretches.chain(finer).collect(), scaled.collect()]
            }
        }
    }
}

/// What is searched for: the surroundings of a place in the reference.
pub(crate) struct Patch {
    fine: Pixels,
    /// The same picture with `coarseness` pixels along both sides in one.
    coarse: Pixels,
    coarseness: usize,
}

impl Patch {
    /// The surroundings of a subset's centre out to `reach_px` along both axes.
    pub(crate) fn around(reference: &ReferenceImage, subset: &PreparedSubset, reach_px: f64) -> Self {
        let coarseness = coarseness(subset, reach_px);
        let pixels = |coarseness: usize| Pixels::around(reference, subset.centre_px, reach_px, coarseness);
        Self { fine: pixels(1), coarse: pixels(coarseness).binned(coarseness), coarseness }
    }

    /// A subset's own pixels.
    pub(crate) fn of(subset: &PreparedSubset) -> Self {
        let fine = Pixels {
            width: subset.width,
            values: subset.template().to_vec(),
            centre: subset.first_px.map(|first| -first),
            reach: subset.half_px().map(f64::floor),
        };
        let coarseness = coarseness(subset, fine.reach[0].min(fine.reach[1]));
        Self { coarse: fine.clone().binned(coarseness), fine, coarseness }
    }

    /// The first deformation and place that `accept` takes, the most similar ones of each group of deformations first.
    pub(crate) fn find<T>(
        &self,
        target: &SearchArea,
        deformations: Deformations,
        mut accept: impl FnMut(Warp) -> Option<T>,
    ) -> Option<T> {
        let coarse_target = target.binned(self.coarseness)?;
        for group in deformations.groups() {
            let mut found: Vec<(f64, Linear, [f64; 2])> = Vec::new();
            for linear in group {
                let template = self.coarse.template(&linear);
                let best = template.and_then(|template| coarse_target.find(&template));
                found.extend(best.map(|best| (best.zncc, linear, best.place_px)));
            }
            found.sort_by(|left, right| right.0.total_cmp(&left.0));
            for (_, linear, coarse_px) in found.into_iter().take(N_TRIED) {
                let refined = self.refined(target, linear, coarse_px);
                if let Some(accepted) = refined.and_then(&mut accept) {
                    return Some(accepted);
                }
            }
        }
        None
    }

    /// What a warp makes of the patch.
    pub(crate) fn template(&self, warp: &Warp) -> Option<Template> {
        let [ux, uy, vx, vy] = warp.gradient;
        self.fine.template(&[[1.0 + ux, uy], [vx, 1.0 + vy]])
    }

    /// A finer deformation and a whole pixel near a place of the coarse picture.
    fn refined(&self, target: &SearchArea, linear: Linear, coarse_px: [f64; 2]) -> Option<Warp> {
        let factor = self.coarseness as f64;
        let near_px = coarse_px.map(|value| factor * value + 0.5 * (factor - 1.0));
        let mut best: Option<(f64, Warp)> = None;
        for angle in FINER.0 {
            for scale in FINER.1 {
                let finer = product(&turn(angle), &linear).map(|row| row.map(|entry| scale * entry));
                let Some(template) = self.fine.template(&finer) else { continue };
                let reach = [template.width, template.height].map(|n| n / 2 + FINE_REACH_PX);
                let Some(found) = target.cut(near_px, reach).and_then(|part| part.find(&template)) else {
                    continue;
                };
                if best.as_ref().is_none_or(|(zncc, _)| found.zncc > *zncc) {
                    let gradient = [finer[0][0] - 1.0, finer[0][1], finer[1][0], finer[1][1] - 1.0];
                    best = Some((found.zncc, Warp { gradient, ..Warp::at(found.place_px) }));
                }
            }
        }
        best.map(|(_, warp)| warp)
    }
}

/// Pixels along a side of which one is made: two where a picture of half the size still shows the speckles, and enough of them at any angle.
fn coarseness(subset: &PreparedSubset, reach_px: f64) -> usize {
    let is_coarse = n_speckles(subset) < COARSE * subset.n_used() as f64;
    let is_large = reach_px >= 2.0 * std::f64::consts::SQRT_2 * LEAST_HALF_PX;
    if is_coarse && is_large { 2 } else { 1 }
}

/// Grey values around a place.
#[derive(Clone)]
struct Pixels {
    width: usize,
    values: Vec<f32>,
    /// Where the place lies among them.
    centre: [f64; 2],
    /// How far around it they are to be used.
    reach: [f64; 2],
}

impl Pixels {
    /// Those of a reference, so many that whole squares of `coarseness` pixels along a side reach as far.
    fn around(reference: &ReferenceImage, place_px: [f64; 2], reach_px: f64, coarseness: usize) -> Self {
        let reach = reach_px.ceil() as i64 + coarseness as i64;
        let [left, top] = place_px.map(|value| value.round() as i64 - reach);
        let width = (2 * reach + 1) as usize / coarseness * coarseness;
        let mut values = vec![0.0; width * width];
        for (y, row) in (top..).zip(values.chunks_exact_mut(width)) {
            reference.copy_row(left, y, 0.0, row);
        }
        let centre = [place_px[0] - left as f64, place_px[1] - top as f64];
        Self { width, values, centre, reach: [reach_px; 2] }
    }

    /// The picture of which `factor` pixels along both sides make one.
    fn binned(self, factor: usize) -> Self {
        let to_coarse = |value: f64| (value - 0.5 * (factor as f64 - 1.0)) / factor as f64;
        Self {
            width: self.width / factor,
            values: binned(&self.values, self.width, factor),
            centre: self.centre.map(to_coarse),
            reach: self.reach.map(|reach| reach / factor as f64),
        }
    }

    /// What a deformation makes of the patch: a rectangle, as long and wide as the patch, of points that all come from it. `None` where
    /// little is left.
    fn template(&self, linear: &Linear) -> Option<Template> {
        let inverse = inverse(linear)?;
        let [[a, b], _] = *linear;
        let upright = a.abs() >= b.abs();
        let sides = if upright { self.reach } else { [self.reach[1], self.reach[0]] };
        let share = |axis: usize| {
            let [from_x, from_y] = inverse[axis].map(f64::abs);
            self.reach[axis] / (from_x * sides[0] + from_y * sides[1])
        };
        let share = share(0).min(share(1));
        let half = sides.map(|side| (share * side + ROUNDING).floor());
        if half[0].min(half[1]) < LEAST_HALF_PX {
            return None;
        }
        let [width, height] = half.map(|half| 2 * half as usize + 1);
        let value = |i: usize| {
            let (x, y) = ((i % width) as f64 - half[0], (i / width) as f64 - half[1]);
            let source = [0, 1].map(|axis| self.centre[axis] + inverse[axis][0] * x + inverse[axis][1] * y);
            bilinear(&self.values, self.width, source)
        };
        let values = (0..width * height).map(value).collect();
        Some(Template::new(width, height, half.map(|half| -half), values))
    }
}

/// What a quotient of equal lengths may fall short of 1 by.
const ROUNDING: f64 = 1e-9;

/// The turn by an angle in degrees, from x towards y.
fn turn(angle_deg: f64) -> Linear {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    [[cos, -sin], [sin, cos]]
}

fn product(left: &Linear, right: &Linear) -> Linear {
    std::array::from_fn(|i| std::array::from_fn(|j| left[i][0] * right[0][j] + left[i][1] * right[1][j]))
}

fn inverse([[a, b], [c, d]]: &Linear) -> Option<Linear> {
    let determinant = a * d - b * c;
    (determinant.abs() > f64::EPSILON)
        .then(|| [[d / determinant, -b / determinant], [-c / determinant, a / determinant]])
}

/// The value at a place between pixels, by their weights; the nearest inside beyond them.
pub(crate) fn bilinear(pixels: &[f32], width: usize, [x, y]: [f64; 2]) -> f32 {
    let height = pixels.len() / width;
    let (x, y) = (x.clamp(0.0, (width - 1) as f64), y.clamp(0.0, (height - 1) as f64));
    let (column, row) = ((x as usize).min(width - 2), (y as usize).min(height - 2));
    let (t, s) = ((x - column as f64) as f32, (y - row as f64) as f32);
    let at = |i: usize, j: usize| pixels[(row + j) * width + column + i];
    (1.0 - s) * ((1.0 - t) * at(0, 0) + t * at(1, 0)) + s * ((1.0 - t) * at(0, 1) + t * at(1, 1))
}

/// The means of squares of `factor` pixels along a side, those that are whole.
fn binned(pixels: &[f32], width: usize, factor: usize) -> Vec<f32> {
    let columns = width / factor;
    let rows = pixels.chunks_exact(width * factor);
    let mean = |rows: &[f32], column: usize| {
        let squares = rows.chunks_exact(width).flat_map(|row| &row[factor * column..factor * (column + 1)]);
        squares.sum::<f32>() / (factor * factor) as f32
    };
    rows.flat_map(|rows| (0..columns).map(|column| mean(rows, column)).collect::<Vec<_>>()).collect()
}

impl SearchArea {
    /// The area of which `factor` pixels along both sides make one; its region counts those. It begins at a multiple of the factor, so that
    /// places are counted from the image's own corner. `None` where it has no such pixel.
    fn binned(&self, factor: usize) -> Option<Self> {
        let Region { x, y, width, height } = self.region;
        let (left, top) = (x.next_multiple_of(factor) - x, y.next_multiple_of(factor) - y);
        let aligned =
            Region { x: left, y: top, width: width.saturating_sub(left), height: height.saturating_sub(top) };
        if aligned.width < factor || aligned.height < factor {
            return None;
        }
        let pixels = binned(&self.cropped(aligned), aligned.width, factor);
        let region = Region {
            x: (x + left) / factor,
            y: (y + top) / factor,
            width: aligned.width / factor,
            height: aligned.height / factor,
        };
        Some(Self::new(region, pixels, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_area_narrower_than_a_coarse_pixel_has_none() {
        for (x, width) in [(0, 1), (3, 1), (3, 2)] {
            let area = SearchArea::new(Region { x, y: 0, width, height: 40 }, vec![0.5; 40 * width], 0.0);
            assert!(area.binned(2).is_none(), "{x} {width}");
        }
        let area = SearchArea::new(Region { x: 2, y: 0, width: 2, height: 40 }, vec![0.5; 80], 0.0);
        assert_eq!(area.binned(2).map(|area| area.n_pixels()), Some(20));
    }
}
