//! A speckle pattern seen by turned or sheared pixels, by Gauss-Legendre quadrature.

use crate::blur::{Blur, NODE, WEIGHTS};
use crate::gaussian::exp;
use crate::speckle::{Pattern, REACH_SIGMA, Speckle};
use crate::view::Sight;

/// Side of the square cells by which speckles are found.
const CELL_PX: f64 = 4.0;

/// A pattern that pixels of any orientation may look at.
///
/// A turned or sheared pixel has no closed form. Its mean over a speckle is taken by the three-point Gauss-Legendre rule
/// along each side, whose error h^6/2016000 max|f^(6)| (h the side) is 5e-7 of the depth for speckles of 4.5 px, and
/// along the path that the pattern moves during the exposure, in pieces of at most a pixel. The 27 values are one
/// exponential times powers of three others.
pub(crate) struct Sampled {
    half_px: [f64; 2],
    sigma_px: f64,
    n_columns: usize,
    /// The speckles that a pixel in the cell may reach.
    cells: Vec<Vec<Speckle>>,
}

impl Sampled {
    /// `defocus_px` is the most that the picture will be out of focus.
    pub(crate) fn new(pattern: &Pattern, defocus_px: f64) -> Self {
        let half_px = [pattern.half_width_px, pattern.half_height_px];
        let n_cells = half_px.map(|half_px| (2.0 * half_px / CELL_PX).ceil() as usize + 1);
        let reach_px = REACH_SIGMA * Blur { path_px: 0.0, defocus_px }.widened(pattern.sigma_px).0 + CELL_PX;
        let near = |cell: usize| {
            let middle = |index: usize, axis: usize| (index as f64 + 0.5) * CELL_PX - half_px[axis];
            let (x_px, y_px) = (middle(cell % n_cells[0], 0), middle(cell / n_cells[0], 1));
            let within = |speckle: &&Speckle| {
                (speckle.x_px - x_px).abs() <= reach_px && (speckle.y_px - y_px).abs() <= reach_px
            };
            pattern.speckles.iter().filter(within).copied().collect()
        };
        Self {
            half_px,
            sigma_px: pattern.sigma_px,
            n_columns: n_cells[0],
            cells: (0..n_cells[0] * n_cells[1]).map(near).collect(),
        }
    }

    /// The mean depth over the part of a pixel that lies on the pattern. `sight` is what the pixel looks at, relative to the
    /// pattern's centre in the middle of the exposure; the pattern moves along x while it lasts. Out of focus it is the mean
    /// over the whole pixel: the edge then fades what lies about it.
    pub(crate) fn mean_depth(&self, sight: &Sight, blur: Blur) -> f64 {
        let whole = (sight.centre_px, [1.0; 2]);
        let (centre_px, share) = if blur.is_focused() { self.inside(sight) } else { whole };
        let sides = [
            [0, 1].map(|axis| share[0] * sight.across_px[axis]),
            [0, 1].map(|axis| share[1] * sight.down_px[axis]),
        ];
        let (sigma_px, height) = blur.widened(self.sigma_px);
        let per_variance = 1.0 / (sigma_px * sigma_px);
        let n_pieces = blur.path_px.abs().ceil().max(1.0);
        let piece_px = blur.path_px / n_pieces;
        let pieces = 0..n_pieces as usize;
        let shift_px = |piece: usize| (piece as f64 + 0.5) * piece_px - blur.path_px / 2.0;
        let mean = |piece: usize| {
            let at_px = [centre_px[0] + shift_px(piece), centre_px[1]];
            self.mean_over_box(at_px, [sides[0], sides[1], [piece_px, 0.0]], per_variance)
        };
        height * height * pieces.map(mean).sum::<f64>() / n_pieces
    }

    /// Centre of the part of a pixel that lies on the rectangle, and its share of the pixel along each side. (The pixel is
    /// taken for upright here: what a slight turn changes at the rectangle's edge is below half its angle.)
    fn inside(&self, sight: &Sight) -> ([f64; 2], [f64; 2]) {
        let size_px = [sight.across_px[0].abs(), sight.down_px[1].abs()];
        let within = |axis: usize| {
            let clamped = |at_px: f64| at_px.clamp(-self.half_px[axis], self.half_px[axis]);
            let low_px = clamped(sight.centre_px[axis] - size_px[axis] / 2.0);
            let high_px = clamped(sight.centre_px[axis] + size_px[axis] / 2.0);
            let whole = high_px - low_px >= size_px[axis] * (1.0 - 1.0e-12);
            if whole {
                (sight.centre_px[axis], 1.0)
            } else {
                ((low_px + high_px) / 2.0, (high_px - low_px) / size_px[axis])
            }
        };
        let [(x_px, share_x), (y_px, share_y)] = [within(0), within(1)];
        ([x_px, y_px], [share_x, share_y])
    }

    /// The mean over a parallelepiped with the given sides: along the pixel, down the pixel, along the motion.
    fn mean_over_box(&self, at_px: [f64; 2], sides: [[f64; 2]; 3], per_variance: f64) -> f64 {
        let steps = sides.map(|side| side.map(|component| 0.5 * NODE * component));
        let weights = node_weights(steps, per_variance);
        let node_px: f64 = steps.iter().map(|[x, y]| x.abs() + y.abs()).sum();
        let reach_px = REACH_SIGMA / per_variance.sqrt() + node_px;
        let moves = !is_still(steps[2]);
        let mut sum = 0.0;
        for speckle in self.near(at_px) {
            let [x, y] = [at_px[0] - speckle.x_px, at_px[1] - speckle.y_px];
            let square = x * x + y * y;
            // The cell holds those of all its pixels; this one sees fewer.
            if square > reach_px * reach_px {
                continue;
            }
            let up = |step: [f64; 2]| exp(-per_variance * (x * step[0] + y * step[1]));
            let (along, down) = (up(steps[0]), up(steps[1]));
            let motion = if moves { up(steps[2]) } else { 1.0 };
            let powers = [along, down, motion].map(|up| [1.0 / up, 1.0, up]);
            sum += speckle.depth * exp(-0.5 * per_variance * square) * weigh(&weights, &powers);
        }
        sum
    }

    fn near(&self, at_px: [f64; 2]) -> &[Speckle] {
        let cell = |axis: usize| ((at_px[axis] + self.half_px[axis]) / CELL_PX).max(0.0) as usize;
        let n_rows = self.cells.len() / self.n_columns;
        &self.cells[cell(1).min(n_rows - 1) * self.n_columns + cell(0).min(self.n_columns - 1)]
    }
}

/// Of each node: the rule's weight times exp(-|node|^2/(2 sigma^2)).
fn node_weights(steps: [[f64; 2]; 3], per_variance: f64) -> [[[f64; 3]; 3]; 3] {
    let place = |node: usize| node as f64 - 1.0;
    let weight = |i: usize, j: usize, k: usize| {
        let at = [0, 1]
            .map(|axis| place(i) * steps[0][axis] + place(j) * steps[1][axis] + place(k) * steps[2][axis]);
        let square = at[0] * at[0] + at[1] * at[1];
        WEIGHTS[i] * WEIGHTS[j] * WEIGHTS[k] * exp(-0.5 * per_variance * square)
    };
    let nodes = [0, 1, 2];
    if is_still(steps[2]) {
        // No motion: all the weight lies in the middle of the exposure.
        let still = |i: usize, j: usize| [0.0, weight(i, j, 1) / WEIGHTS[1], 0.0];
        return nodes.map(|i| nodes.map(|j| still(i, j)));
    }
    nodes.map(|i| nodes.map(|j| nodes.map(|k| weight(i, j, k))))
}

fn is_still(step: [f64; 2]) -> bool {
    step.iter().all(|component| *component == 0.0)
}

#[inline]
fn weigh(weights: &[[[f64; 3]; 3]; 3], [along, down, motion]: &[[f64; 3]; 3]) -> f64 {
    let mut sum = 0.0;
    for (plane, along) in weights.iter().zip(along) {
        let mut of_plane = 0.0;
        for (line, down) in plane.iter().zip(down) {
            of_plane += (line[0] * motion[0] + line[1] * motion[1] + line[2] * motion[2]) * down;
        }
        sum += of_plane * along;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF_PX: f64 = 27.3;

    fn pattern() -> Pattern {
        Pattern::scattered(3, 1, [HALF_PX, HALF_PX], 4.5)
    }

    #[test]
    fn an_upright_pixel_agrees_with_the_closed_form() {
        let (pattern, centre_px) = (pattern(), [40.3, 41.6]);
        let sampled = Sampled::new(&pattern, 0.0);
        let exact = pattern.depth_image(82, 84, centre_px);
        for ((row, column), depth) in exact.indexed_iter() {
            let apart = [column as f64 - centre_px[0], row as f64 - centre_px[1]];
            let whole = apart.iter().all(|apart| apart.abs() <= HALF_PX - 0.5);
            if whole {
                let sight = Sight { centre_px: apart, across_px: [1.0, 0.0], down_px: [0.0, 1.0] };
                let found = sampled.mean_depth(&sight, Blur::default());
                // 2e-6: the rule's error, 5e-7 of a depth along each side, and a neighbour's as much.
                assert!((found - depth).abs() < 2.0e-6, "{apart:?}: {found} {depth}");
            }
        }
    }

    #[test]
    fn a_turned_pixel_that_moves_agrees_with_counting_points() {
        let pattern = pattern();
        let sampled = Sampled::new(&pattern, 0.0);
        let sight = Sight { centre_px: [3.2, -1.7], across_px: [0.98, 0.11], down_px: [-0.07, 1.03] };
        for blur_px in [0.0, 0.4, -1.8] {
            let n = 40;
            let place = |i: usize| (i as f64 + 0.5) / n as f64 - 0.5;
            let depth_at = |x: f64, y: f64| -> f64 {
                let square = |speckle: &Speckle| (x - speckle.x_px).powi(2) + (y - speckle.y_px).powi(2);
                let sigma = pattern.sigma_px;
                pattern.speckles.iter().map(|s| s.depth * (-square(s) / (2.0 * sigma * sigma)).exp()).sum()
            };
            let counted = (0..n * n * n)
                .map(|i| [place(i % n), place(i / n % n), place(i / n / n)])
                .map(|[u, v, w]| {
                    let x = sight.centre_px[0] + u * sight.across_px[0] + v * sight.down_px[0] + w * blur_px;
                    depth_at(x, sight.centre_px[1] + u * sight.across_px[1] + v * sight.down_px[1])
                })
                .sum::<f64>()
                / (n * n * n) as f64;
            // 1e-4: the midpoint rule over 40 points of each side, (1/40)^2/24 times second derivatives below 1 a side,
            // 1.8^2 times as much along the motion.
            assert!(
                (sampled.mean_depth(&sight, Blur { path_px: blur_px, defocus_px: 0.0 }) - counted).abs()
                    < 1.0e-4,
                "{blur_px}"
            );
        }
    }
}
