//! Sharp edges beside a subset, which ring through the interpolation into it.

use std::fmt;

use chainwave_measurement::{Recording, Subset, median};

use crate::reference::pixel_bounds;
use crate::{CorrelationError, Reference, ReferenceFrames};

/// A sharp edge, as a marker's against its ground, that runs along a side of a subset. It rings through the spline's prefilter
/// into the subset, by the power of the prefilter's pole, and biases positions: those of the cubic kernel by 1 to 2 mpx at
/// 3 px, half as much with each further one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SharpEdge {
    /// Where it lies from the subset.
    pub side: Side,
    /// Pixels between the subset's last and the edge; 0 where it runs inside.
    pub distance_px: usize,
}

/// An edge as near as this biases positions by a thousandth of a pixel or more; one a pixel farther off by half as much.
const RINGING_PX: usize = 3;

impl SharpEdge {
    /// Whether it is so near that it biases positions by a thousandth of a pixel or more.
    pub fn rings(&self) -> bool {
        self.distance_px <= RINGING_PX
    }
}

/// Pixels between an edge and what is left of a subset: nearer, it moves positions by some hundredths of a pixel, by how it lies between pixels.
const CLEAR_PX: i64 = 2;

/// Share of the usual variance along lines of a texture that one over ground has at most: along 21 px of texture, some five speckles, it is as small once
/// in a hundred lines.
pub(crate) const GROUND_SHARE: f64 = 0.05;

/// A side of a subset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Towards smaller x.
    Left,
    /// Towards larger x.
    Right,
    /// Towards smaller y.
    Above,
    /// Towards larger y.
    Below,
}

impl Side {
    /// 0 where subsets grow towards it along x, 1 along y.
    fn axis(self) -> usize {
        match self {
            Self::Left | Self::Right => 0,
            Self::Above | Self::Below => 1,
        }
    }
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Left => "left",
            Self::Right => "right",
            Self::Above => "above",
            Self::Below => "below",
        })
    }
}

/// Pixels beyond the subset in which an edge is looked for, and as many within.
const REACH_PX: i64 = 4;
/// Mean square of third differences along a side over that along the roughest line in the subset from which on there is an
/// edge. A step as high as the contrast has nine times its square, speckles of 4.5 px a third of it, and noise of a fifth of it
/// as much again.
const EDGE_RATIO: f64 = 3.0;
/// Standard deviations above the texture's own lines from which on an edge is told: a normal deviate is beyond in one of 100 subsets with the
/// 40 lines that each looks at.
const TOLD_SIGMA: f64 = 3.48;
/// Roughness of a line, over that of the roughest, below which it is none.
const NO_ROUGHNESS: f64 = 1e-6;

/// The sharp edge nearest to a subset, if one may run along a side within 4 px: what is rougher than any line in the subset along that side.
/// Ground that is left out ([`crate::PreparedSubset`]) has no edge.
///
/// # Errors
/// As [`Reference::read`].
pub fn sharp_edge(
    recording: &dyn Recording,
    subset: &Subset,
    frames: &ReferenceFrames,
) -> Result<Option<SharpEdge>, CorrelationError> {
    Ok(nearest(beside(&Reference::read(recording, subset, frames)?, subset), |_| true))
}

/// The same of what is an edge beyond doubt, as a warning needs it: rougher than any line in the subset in either direction too, and than the
/// texture's lines would be by chance. How these scatter is taken from the subset (of the logarithm, which is about normal), so that a texture
/// of few dots, whose lines differ by much, has no edge for a dot on a side.
///
/// # Errors
/// As [`Reference::read`].
pub fn detected_edge(
    recording: &dyn Recording,
    subset: &Subset,
    frames: &ReferenceFrames,
) -> Result<Option<SharpEdge>, CorrelationError> {
    Ok(nearest(beside(&Reference::read(recording, subset, frames)?, subset), |found| found.is_told))
}

/// A subset without the lines that an edge beyond doubt rings into most, and those beyond it: of what is left its outline. An edge is sampled too coarsely
/// to be interpolated, and one row of pixels that it runs through has more of the gradient than all others. One that has an outline, or keeps less than half
/// of its width, stays as it is.
pub(crate) fn clear_of_edges(reference: &Reference, subset: &Subset) -> Subset {
    if !subset.outline_px.is_empty() {
        return subset.clone();
    }
    let found = beside(reference, subset);
    let cut = |side: Side| {
        let told = found.iter().filter(|found| found.is_told && found.edge.side == side);
        told.map(|found| (CLEAR_PX - found.distance_px).max(0)).max().unwrap_or(0)
    };
    let [left, right, above, below] = [Side::Left, Side::Right, Side::Above, Side::Below].map(cut);
    let [x0, x1, y0, y1] = pixel_bounds(subset);
    let is_much = |cut: i64, side_px: i64| 2 * cut >= side_px;
    let is_clear = left + right + above + below == 0;
    if is_clear || is_much(left + right, x1 - x0 + 1) || is_much(above + below, y1 - y0 + 1) {
        return subset.clone();
    }
    let xs = [(x0 + left) as f64 - 0.5, (x1 - right) as f64 + 0.5].map(|x| x - subset.x_px);
    let ys = [(y0 + above) as f64 - 0.5, (y1 - below) as f64 + 0.5].map(|y| y - subset.y_px);
    subset.clone().within(vec![[xs[0], ys[0]], [xs[1], ys[0]], [xs[1], ys[1]], [xs[0], ys[1]]])
}

/// Pixels beyond an edge whose lines are ground, or none of the marker that ends there.
const GROUND_PX: std::ops::RangeInclusive<i64> = 2..=4;

/// Columns and rows to each side of a subset's centre that keep clear of edges beyond doubt behind which ground lies: those of a marker.
pub(crate) fn clear_of_ground(reference: &Reference, subset: &Subset) -> [Option<usize>; 2] {
    let half_px = [subset.half_width_px, subset.half_height_px];
    let found = beside(reference, subset);
    [0, 1].map(|axis| {
        let is_ground = |found: &&Beside| {
            found.is_told && found.edge.side.axis() == axis && ends_in_ground(reference, subset, found)
        };
        let inner = |found: &Beside| half_px[axis] as i64 + found.distance_px - CLEAR_PX;
        found.iter().filter(is_ground).map(inner).min().map(|inner| usize::try_from(inner).unwrap_or(0))
    })
}

/// Whether lines along an edge have next to no contrast beyond it, of that of the subset's own.
fn ends_in_ground(reference: &Reference, subset: &Subset, found: &Beside) -> bool {
    let [x0, x1, y0, y1] = pixel_bounds(subset);
    let contrast = |distance: i64| {
        let line: Option<Vec<f64>> = match found.edge.side {
            Side::Left => (y0..=y1).map(|y| reference.usable_pixel([x0 - distance, y])).collect(),
            Side::Right => (y0..=y1).map(|y| reference.usable_pixel([x1 + distance, y])).collect(),
            Side::Above => (x0..=x1).map(|x| reference.usable_pixel([x, y0 - distance])).collect(),
            Side::Below => (x0..=x1).map(|x| reference.usable_pixel([x, y1 + distance])).collect(),
        };
        line.map(|line| variance(&line))
    };
    let n_lines = if found.edge.side.axis() == 0 { x1 - x0 } else { y1 - y0 };
    let own = (-n_lines..found.distance_px - CLEAR_PX).filter_map(contrast).collect();
    let Some(usual) = median(own) else { return false };
    GROUND_PX
        .map(|away| found.distance_px + away)
        .all(|distance| contrast(distance).is_some_and(|it| it < GROUND_SHARE * usual))
}

/// The variance of a line of pixels.
pub(crate) fn variance(line: &[f64]) -> f64 {
    let n = line.len() as f64;
    let mean = line.iter().sum::<f64>() / n;
    line.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n
}

/// What may be an edge along a side.
struct Beside {
    edge: SharpEdge,
    /// Pixels between the subset's last and the edge; below 0 within.
    distance_px: i64,
    is_told: bool,
}

fn nearest(found: Vec<Beside>, counts: impl Fn(&Beside) -> bool) -> Option<SharpEdge> {
    found.into_iter().filter(counts).map(|one| one.edge).min_by_key(|edge| edge.distance_px)
}

fn beside(reference: &Reference, subset: &Subset) -> Vec<Beside> {
    let [x0, x1, y0, y1] = pixel_bounds(subset);
    let sides = [
        (Side::Left, [[x0, -1, x1 - x0], [y0, y1, 0]]),
        (Side::Right, [[x1, 1, x1 - x0], [y0, y1, 0]]),
        (Side::Above, [[y0, -1, y1 - y0], [x0, x1, 1]]),
        (Side::Below, [[y1, 1, y1 - y0], [x0, x1, 1]]),
    ];
    let of_sides = sides.map(|(side, lines)| (side, Roughness::of(reference, lines)));
    // Both directions once: the lines along the right side are those along the left.
    let own = [of_sides[0].1.inside(), of_sides[2].1.inside()].concat();
    let told = told_roughness(&own);
    let of_side = |(side, lines): (Side, Roughness)| {
        let inside = lines.inside().into_iter().fold(0.0, f64::max);
        // Differences that end on an edge feel a ninth of it, so one just out of reach must be seen to be told from one within.
        let found = (-REACH_PX..=REACH_PX + 1).filter_map(|distance| Some((lines.at(distance)?, distance)));
        let (roughest, distance) = found.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let edge = SharpEdge { side, distance_px: usize::try_from(distance).unwrap_or(0) };
        let may_be = distance <= REACH_PX && roughest > EDGE_RATIO * inside;
        may_be.then_some(Beside { edge, distance_px: distance, is_told: roughest > told })
    };
    of_sides.into_iter().filter_map(of_side).collect()
}

/// How rough lines along a side of a subset are.
struct Roughness {
    /// The least distance from the side of a line that is known, below 0 within the subset.
    first: i64,
    /// Of each line, the mean square of the third differences between its pixels and those of the lines before and after it; none where a pixel
    /// is not used.
    of_lines: Vec<Option<f64>>,
}

impl Roughness {
    /// Of the lines along the side whose last one is `last`, counted in the direction `out`, and whose pixels go from `start` to `end` along the other
    /// axis than the given one; it has as many lines as `across` behind that one.
    fn of(reference: &Reference, [[last, out, across], [start, end, axis]]: [[i64; 3]; 2]) -> Self {
        let first = (2 - across).min(-REACH_PX);
        let line = |distance: i64| -> Option<Vec<f64>> {
            let across = last + out * distance;
            let place = |along| if axis == 0 { [across, along] } else { [along, across] };
            (start..=end).map(|along| reference.usable_pixel(place(along))).collect()
        };
        let lines: Vec<Option<Vec<f64>>> = (first - 1..=REACH_PX + 3).map(line).collect();
        let of_line = |lines: &[Option<Vec<f64>>]| {
            let [a, b, c, d] = lines else { return None };
            let (a, b, c, d) = (a.as_ref()?, b.as_ref()?, c.as_ref()?, d.as_ref()?);
            let pairs = a.iter().zip(b).zip(c.iter().zip(d));
            let sum: f64 = pairs.map(|((a, b), (c, d))| (a - 3.0 * b + 3.0 * c - d).powi(2)).sum();
            Some(sum / (end - start + 1) as f64)
        };
        Self { first, of_lines: lines.windows(4).map(of_line).collect() }
    }

    /// That of the line at a distance from the side.
    fn at(&self, distance: i64) -> Option<f64> {
        let index = usize::try_from(distance - self.first).ok()?;
        *self.of_lines.get(index)?
    }

    /// Those of the lines within the subset that are out of an edge's reach.
    fn inside(&self) -> Vec<f64> {
        (self.first..-REACH_PX).filter_map(|distance| self.at(distance)).collect()
    }
}

/// The roughness beyond which a line is none of the texture's, from the roughness of its lines; infinite of fewer than two.
fn told_roughness(lines: &[f64]) -> f64 {
    let roughest = lines.iter().copied().fold(0.0, f64::max);
    let logs: Vec<f64> = lines.iter().map(|one| one.max(NO_ROUGHNESS * roughest).ln()).collect();
    let n = logs.len() as f64;
    let mean = logs.iter().sum::<f64>() / n;
    let scatter = (logs.iter().map(|log| (log - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    match logs.len() {
        0 | 1 => f64::INFINITY,
        _ => (mean + TOLD_SIGMA * scatter).exp().max(EDGE_RATIO * roughest),
    }
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Region;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    /// Smooth texture on a marker from column 20 to 60 and row 15 to 62, on grey ground.
    fn marker(ground: f32) -> Reference {
        let value = |i: usize| {
            let (x, y) = ((i % 90) as f32, (i / 90) as f32);
            let on_marker = (20.0..=60.0).contains(&x) && (15.0..=62.0).contains(&y);
            let texture = (0.9 * x + 0.2 * y).sin() + (0.3 * x - 1.1 * y).cos() + (0.7 * x + 0.8 * y).cos();
            if on_marker { 1000.0 + 200.0 * texture } else { ground }
        };
        Reference::new(Region::whole(90, 90), (0..8100).map(value).collect(), 1).unwrap()
    }

    #[test]
    fn an_edge_is_seen_on_its_side_and_at_its_distance() {
        let edge = |x_px: f64, y_px: f64, half: usize| {
            let subset = Subset::new("a", x_px, y_px, half, half);
            // Ground much lighter than the texture is beyond doubt.
            let told = nearest(beside(&marker(1800.0), &subset), |found| found.is_told);
            let may_be = nearest(beside(&marker(1100.0), &subset), |_| true);
            assert_eq!(told, may_be);
            may_be
        };
        assert_eq!(edge(40.0, 40.0, 12), None);
        assert_eq!(edge(37.0, 40.0, 12), None, "5 px are enough");
        assert_eq!(edge(36.0, 40.0, 12), Some(SharpEdge { side: Side::Left, distance_px: 4 }));
        assert_eq!(edge(33.0, 40.0, 12), Some(SharpEdge { side: Side::Left, distance_px: 1 }));
        assert_eq!(edge(45.0, 40.0, 12), Some(SharpEdge { side: Side::Right, distance_px: 3 }));
        assert_eq!(edge(40.0, 29.0, 12), Some(SharpEdge { side: Side::Above, distance_px: 2 }));
        assert_eq!(edge(40.0, 52.0, 12), Some(SharpEdge { side: Side::Below, distance_px: 0 }));
    }

    #[test]
    fn a_subset_keeps_clear_of_an_edge_that_runs_through_it() {
        let lines = |x_px: f64, y_px: f64| {
            let found = clear_of_edges(&marker(1800.0), &Subset::new("a", x_px, y_px, 12, 12));
            let outline = found.outline_px;
            outline.first().zip(outline.get(2)).map(|([left, above], [right, below])| {
                [x_px + left, x_px + right, y_px + above, y_px + below]
            })
        };
        // The marker's first column is 20: what is left begins two columns within.
        assert_eq!(lines(40.0, 40.0), None);
        assert_eq!(lines(34.0, 40.0), None);
        assert_eq!(lines(32.0, 40.0), Some([21.5, 44.5, 27.5, 52.5]));
        assert_eq!(lines(30.0, 40.0), Some([21.5, 42.5, 27.5, 52.5]));
        assert_eq!(lines(40.0, 52.0), Some([27.5, 52.5, 39.5, 60.5]));
    }

    #[test]
    fn ground_that_is_left_out_has_no_edge() {
        let subset = Subset::new("a", 33.0, 40.0, 12, 12);
        assert!(beside(&marker(20.0), &subset).is_empty());
    }

    const SIDE: usize = 64;

    /// Draws a texture of `SIDE` x `SIDE` pixels.
    type Texture = dyn Fn(&mut Pcg64Mcg) -> Vec<f64>;

    /// White noise, blurred by a Gaussian around which it closes.
    fn blurred(random: &mut Pcg64Mcg, sigma_px: f64) -> Vec<f64> {
        let white: Vec<f64> = (0..SIDE * SIDE).map(|_| random.random_range(-1.0..1.0)).collect();
        let reach = (4.0 * sigma_px).ceil() as usize;
        let weights: Vec<f64> =
            (0..=2 * reach).map(|k| (-0.5 * ((k as f64 - reach as f64) / sigma_px).powi(2)).exp()).collect();
        let along = |from: &[f64], at: &dyn Fn(usize, usize) -> usize| -> Vec<f64> {
            let sum = |i: usize| {
                let terms = weights.iter().enumerate();
                terms.map(|(k, weight)| weight * from[at(i, SIDE + k - reach)]).sum::<f64>()
            };
            (0..SIDE * SIDE).map(sum).collect()
        };
        let rows = along(&white, &|i, by| i / SIDE * SIDE + (i + by) % SIDE);
        along(&rows, &|i, by| (i / SIDE + by) % SIDE * SIDE + i % SIDE)
    }

    /// Light dots of 1.2 to 2.5 px in radius, their rims a pixel wide.
    fn dots(random: &mut Pcg64Mcg) -> Vec<f64> {
        let mut dotted = vec![0.0_f64; SIDE * SIDE];
        for _ in 0..SIDE * SIDE / 60 {
            let middle: [f64; 2] = std::array::from_fn(|_| random.random_range(0.0..SIDE as f64));
            let radius = random.random_range(1.2..2.5);
            for (i, value) in dotted.iter_mut().enumerate() {
                let away = ((i % SIDE) as f64 - middle[0]).hypot((i / SIDE) as f64 - middle[1]);
                *value = value.max((radius + 0.5 - away).clamp(0.0, 1.0));
            }
        }
        dotted
    }

    #[test]
    fn a_texture_without_an_edge_is_rarely_told_to_have_one() {
        const N: usize = 200;
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let octaves = |random: &mut Pcg64Mcg| {
            let mut sum = vec![0.0; SIDE * SIDE];
            for sigma_px in [1.0, 2.0, 4.0, 8.0] {
                // Weights whose sum grows with their reach make what is broad the stronger.
                let of_sigma = blurred(random, sigma_px);
                sum.iter_mut().zip(of_sigma).for_each(|(sum, value)| *sum += value);
            }
            sum
        };
        let blots = |random: &mut Pcg64Mcg| {
            let blurred = blurred(random, 2.0);
            blurred.into_iter().map(|value| (2.0 * value).clamp(-1.0, 1.0)).collect::<Vec<_>>()
        };
        let textures: [&Texture; 6] = [
            &|random| blurred(random, 0.7),
            &|random| blurred(random, 1.2),
            &|random| blurred(random, 2.0),
            &octaves,
            &blots,
            &dots,
        ];
        let (mut n_told, mut n_may) = (0, 0);
        for texture in textures {
            for _ in 0..N {
                let pixels = texture(&mut random).into_iter().map(|value| 1000.0 + 100.0 * value as f32);
                let reference = Reference::new(Region::whole(SIDE, SIDE), pixels.collect(), 1).unwrap();
                let found = beside(&reference, &Subset::new("a", 32.0, 32.0, 8, 8));
                n_told += usize::from(found.iter().any(|found| found.is_told));
                n_may += usize::from(!found.is_empty());
            }
        }
        // One in 100 of the 1200, to three standard errors; what may be one is in several.
        assert!(n_told <= 22 && n_may > 36, "{n_told} told, {n_may} may be");
    }
}
