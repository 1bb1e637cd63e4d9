//! Textures of Gaussian spots: scattered speckles, periodic dots, or spots where they are asked for.

use std::f64::consts::SQRT_2;

use crate::speckle::{Pattern, REACH_SIGMA, Speckle};

/// Side of the square cells by which spots are found.
const CELL_PX: f64 = 8.0;

/// Dark Gaussian spots on a plane, in the pixels of the reference picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    pub(super) sigma_px: f64,
    pub(super) spots: Vec<Speckle>,
    cells: Cells,
}

impl Texture {
    /// Speckles scattered about a centre as on a marker ([`Pattern::scattered`]), over a rectangle of the given half sizes.
    pub fn speckles(seed: u64, diameter_px: f64, centre_px: [f64; 2], half_size_px: [f64; 2]) -> Self {
        let pattern = Pattern::scattered(seed, 0, half_size_px, diameter_px);
        let moved = |speckle: &Speckle| Speckle {
            x_px: speckle.x_px + centre_px[0],
            y_px: speckle.y_px + centre_px[1],
            ..*speckle
        };
        Self::new(pattern.speckles.iter().map(moved).collect(), diameter_px)
    }

    /// Equal dots on a square lattice through a centre, over a rectangle of the given half sizes.
    pub fn dots(pitch_px: f64, diameter_px: f64, centre_px: [f64; 2], half_size_px: [f64; 2]) -> Self {
        let [columns, rows] = half_size_px.map(|half_px| (half_px / pitch_px).floor() as i64);
        let spot = |row: i64, column: i64| Speckle {
            x_px: centre_px[0] + column as f64 * pitch_px,
            y_px: centre_px[1] + row as f64 * pitch_px,
            depth: 1.0,
        };
        let lattice = (-rows..=rows).flat_map(|row| (-columns..=columns).map(move |column| (row, column)));
        Self::new(lattice.map(|(row, column)| spot(row, column)).collect(), diameter_px)
    }

    /// Spots of depth 1 at the given places.
    pub fn spots(places_px: &[[f64; 2]], diameter_px: f64) -> Self {
        let spot = |&[x_px, y_px]: &[f64; 2]| Speckle { x_px, y_px, depth: 1.0 };
        Self::new(places_px.iter().map(spot).collect(), diameter_px)
    }

    fn new(spots: Vec<Speckle>, diameter_px: f64) -> Self {
        let sigma_px = diameter_px / (2.0 * SQRT_2);
        let cells = Cells::new(&spots, REACH_SIGMA * sigma_px);
        Self { sigma_px, spots, cells }
    }

    /// Centre (column, row) of each spot.
    pub fn places_px(&self) -> impl Iterator<Item = [f64; 2]> {
        self.spots.iter().map(|spot| [spot.x_px, spot.y_px])
    }

    /// Standard deviation of a spot.
    pub fn sigma_px(&self) -> f64 {
        self.sigma_px
    }

    /// The sum of the spots at a point: each has its depth, about 1, in its middle.
    pub fn depth(&self, at_px: [f64; 2]) -> f64 {
        let per_variance = -0.5 / (self.sigma_px * self.sigma_px);
        let of_spot = |&spot: &usize| {
            let Speckle { x_px, y_px, depth } = self.spots[spot];
            let (x, y) = (at_px[0] - x_px, at_px[1] - y_px);
            depth * libm::exp(per_variance * (x * x + y * y))
        };
        self.cells.near(at_px).iter().map(of_spot).sum()
    }
}

/// The spots that reach into each square cell.
#[derive(Debug, Clone, PartialEq)]
struct Cells {
    corner_px: [f64; 2],
    n_columns: usize,
    spots: Vec<Vec<usize>>,
}

impl Cells {
    fn new(spots: &[Speckle], reach_px: f64) -> Self {
        let bounds = |of: fn(&Speckle) -> f64| {
            let low = spots.iter().map(of).fold(f64::INFINITY, f64::min) - reach_px;
            let high = spots.iter().map(of).fold(f64::NEG_INFINITY, f64::max) + reach_px;
            if spots.is_empty() { (0.0, 0) } else { (low, ((high - low) / CELL_PX).ceil() as usize + 1) }
        };
        let ((left_px, n_columns), (top_px, n_rows)) = (bounds(|spot| spot.x_px), bounds(|spot| spot.y_px));
        let mut cells =
            Self { corner_px: [left_px, top_px], n_columns, spots: vec![Vec::new(); n_columns * n_rows] };
        for (index, spot) in spots.iter().enumerate() {
            let cell = |at_px: f64, corner_px: f64| ((at_px - corner_px) / CELL_PX) as usize;
            for row in cell(spot.y_px - reach_px, top_px)..=cell(spot.y_px + reach_px, top_px) {
                for column in cell(spot.x_px - reach_px, left_px)..=cell(spot.x_px + reach_px, left_px) {
                    cells.spots[row * n_columns + column].push(index);
                }
            }
        }
        cells
    }

    fn near(&self, at_px: [f64; 2]) -> &[usize] {
        let cell = |axis: usize| {
            let cell = ((at_px[axis] - self.corner_px[axis]) / CELL_PX).floor();
            (cell >= 0.0).then_some(cell as usize)
        };
        let found = cell(0).filter(|&column| column < self.n_columns).zip(cell(1));
        found
            .and_then(|(column, row)| self.spots.get(row * self.n_columns + column))
            .map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cells_find_every_spot_that_reaches_a_point() {
        let texture = Texture::speckles(3, 4.5, [20.0, -7.0], [40.0, 30.0]);
        for step in 0..500 {
            let at_px = [-30.0 + 0.21 * f64::from(step), -50.0 + f64::from(step * 37 % 500) * 0.17];
            let all: f64 = texture
                .spots
                .iter()
                .map(|spot| {
                    let square = (at_px[0] - spot.x_px).powi(2) + (at_px[1] - spot.y_px).powi(2);
                    spot.depth * (-0.5 * square / texture.sigma_px.powi(2)).exp()
                })
                .sum();
            // What lies beyond 6 sigma: exp(-18) of each of fewer than 100 spots.
            assert!((texture.depth(at_px) - all).abs() < 1.6e-6, "{at_px:?}");
        }
        assert!(Texture::spots(&[], 4.5).depth([0.0, 0.0]).abs() < 1.0e-300);
    }

    #[test]
    fn dots_repeat_with_their_pitch() {
        let dots = Texture::dots(9.0, 5.0, [50.0, 50.0], [100.0, 100.0]);
        for at_px in [[50.0, 50.0], [53.1, 47.7], [61.2, 44.4]] {
            let beside = dots.depth([at_px[0] + 9.0, at_px[1] - 18.0]);
            // As above: a dot may lie just within 6 sigma here and just beyond there.
            assert!((dots.depth(at_px) - beside).abs() < 1.0e-6);
        }
    }
}
