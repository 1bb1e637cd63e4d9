//! Search for a patch that is turned, stretched or scaled: all shifts of a few dozen deformations, on pictures of half the size where their
//! texture allows it.

use chainwave_measurement::Region;

use super::{SearchArea, Template, remove_mean};
use crate::reference::image::ReferenceImage;
use crate::warp::Warp;

/// Angles between neighbouring directions of the search, in degrees: an iteration starts from half of that.
const ANGLE_STEP_DEG: f64 = 15.0;
/// Factors of length besides 1.
const FACTORS: [f64; 6] = [0.5, 0.63, 0.8, 1.25, 1.6, 2.0];
/// Best deformations of a group that are tried by a match.
const N_TRIED: usize = 3;
/// Least half width of a template.
const LEAST_HALF_PX: f64 = 5.0;
/// Finer angles (degrees) and factors that are tried around the best.
const FINER: ([f64; 3], [f64; 3]) = ([-5.0, 0.0, 5.0], [0.92, 1.0, 1.09]);
/// Pixels around a place found on the coarse picture that are searched on the fine one.
const FINE_REACH_PX: usize = 4;

/// A linear deformation: rows of 1 + gradient.
type Linear = [[f64; 2]; 2];

/// What is searched for: the surroundings of a place in the reference, out to `reach_px` along both axes.
pub(crate) struct Patch<'a> {
    pub(crate) reference: &'a ReferenceImage,
    pub(crate) place_px: [f64; 2],
    pub(crate) reach_px: f64,
    /// Pixels of the coarse picture along a side of which one is made.
    pub(crate) coarseness: usize,
}

impl Patch<'_> {
    /// The first deformation and place that `accept` takes, of turns, of stretches along an axis, and of scaled turns in this order,
    /// the most similar ones of each group first.
    pub(crate) fn find<T>(
        &self,
        target: &SearchArea,
        mut accept: impl FnMut(Warp) -> Option<T>,
    ) -> Option<T> {
        let (coarse_target, coarse_reference) = (target.binned(self.coarseness), self.binned());
        for group in groups() {
            let mut found: Vec<(f64, Linear, [f64; 2])> = Vec::new();
            for linear in group {
                let template = coarse_reference.template(&linear);
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

    /// The patch of the picture of which `coarseness` pixels along both sides make one.
    fn binned(&self) -> CoarsePatch {
        let factor = self.coarseness as f64;
        let reach = self.reach_px.ceil() as i64 + self.coarseness as i64;
        let [left, top] = self.place_px.map(|value| value.round() as i64 - reach);
        let n = (2 * reach + 1) as usize / self.coarseness * self.coarseness;
        let mut pixels = vec![0.0; n * n];
        for (y, row) in (top..).zip(pixels.chunks_exact_mut(n)) {
            self.reference.copy_row(left, y, row);
        }
        let origin_px = [left as f64, top as f64];
        let centre =
            [0, 1].map(|axis| (self.place_px[axis] - origin_px[axis] - 0.5 * (factor - 1.0)) / factor);
        CoarsePatch {
            width: n / self.coarseness,
            pixels: binned(&pixels, n, self.coarseness),
            centre,
            reach: self.reach_px / factor,
        }
    }

    /// A finer deformation and a whole pixel near a place of the coarse picture.
    fn refined(&self, target: &SearchArea, linear: Linear, coarse_px: [f64; 2]) -> Option<Warp> {
        let factor = self.coarseness as f64;
        let near_px = coarse_px.map(|value| factor * value + 0.5 * (factor - 1.0));
        let fine = Patch { coarseness: 1, reference: self.reference, ..*self }.binned();
        let mut best: Option<(f64, Warp)> = None;
        for angle in FINER.0 {
            for scale in FINER.1 {
                let finer = product(&turn(angle), &linear).map(|row| row.map(|entry| scale * entry));
                let Some(template) = fine.template(&finer) else { continue };
                let reach = template.width / 2 + FINE_REACH_PX;
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

/// A patch with its pixels.
struct CoarsePatch {
    width: usize,
    pixels: Vec<f32>,
    /// Where the patch's place lies among them.
    centre: [f64; 2],
    /// How far around it they are to be used.
    reach: f64,
}

impl CoarsePatch {
    /// What a deformation makes of the patch: the largest square whose points all come from it. `None` where little is left.
    fn template(&self, linear: &Linear) -> Option<Template> {
        let inverse = inverse(linear)?;
        let widest = inverse.iter().map(|row| row[0].abs() + row[1].abs()).fold(0.0, f64::max);
        let half = (self.reach / widest).floor();
        if half < LEAST_HALF_PX {
            return None;
        }
        let side = 2 * half as usize + 1;
        let value = |i: usize| {
            let (x, y) = ((i % side) as f64 - half, (i / side) as f64 - half);
            let source = [0, 1].map(|axis| self.centre[axis] + inverse[axis][0] * x + inverse[axis][1] * y);
            bilinear(&self.pixels, self.width, source)
        };
        let mut values: Vec<f32> = (0..side * side).map(value).collect();
        remove_mean(&mut values);
        Some(Template::new(side, side, [-half; 2], values))
    }
}

/// Turns; stretches along one axis; turns of scaled pictures.
fn groups() -> [Vec<Linear>; 3] {
    let n_turns = (360.0 / ANGLE_STEP_DEG) as usize;
    let turns = |from: usize| (from..n_turns).map(|step| turn(ANGLE_STEP_DEG * step as f64));
    let stretches =
        FACTORS.into_iter().flat_map(|factor| [[[factor, 0.0], [0.0, 1.0]], [[1.0, 0.0], [0.0, factor]]]);
    let scaled = FACTORS.into_iter().flat_map(|factor| {
        turns(0).map(move |turn| turn.map(|row| row.map(|entry| factor * entry))).collect::<Vec<_>>()
    });
    [turns(1).collect(), stretches.collect(), scaled.collect()]
}

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
fn bilinear(pixels: &[f32], width: usize, [x, y]: [f64; 2]) -> f32 {
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
    /// The area of which `factor` pixels along both sides make one; its region counts those.
    fn binned(&self, factor: usize) -> Self {
        let (width, height) = (self.region.width / factor, self.region.height / factor);
        let pixels = binned(&self.pixels, self.region.width, factor);
        let mut area = Self::new(Region { x: 0, y: 0, width, height }, pixels, 0.0);
        // Places are counted from the image's own corner, where the region begins at a multiple of the factor.
        area.region = Region { x: self.region.x / factor, y: self.region.y / factor, width, height };
        area
    }

    /// The part within some pixels of a place; `None` outside.
    fn cut(&self, [x, y]: [f64; 2], reach: usize) -> Option<Self> {
        let Region { x: left, y: top, width, height } = self.region;
        let (x, y, reach) = (x.round() as i64 - left as i64, y.round() as i64 - top as i64, reach as i64);
        let part = Region::clipped(x - reach, y - reach, x + reach + 1, y + reach + 1, width, height)?;
        let lines = self.pixels.chunks_exact(width).skip(part.y).take(part.height);
        let pixels = lines.flat_map(|line| line[part.x..part.x + part.width].iter().copied()).collect();
        Some(Self::new(Region { x: left + part.x, y: top + part.y, ..part }, pixels, 0.0))
    }
}
