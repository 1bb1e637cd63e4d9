//! The outline of a marker.

use crate::markers::patches::Patch;
use crate::markers::texture::Texture;

impl Texture {
    /// The outline of a patch: an average reaches half of its strength inside where half of its pixels lie inside, at the edge.
    pub(crate) fn outline(&self, patch: &Patch, threshold: f32) -> Patch {
        let core = patch.core();
        let mut inside: Vec<f32> = core[1]
            .clone()
            .flat_map(|y| core[0].clone().map(move |x| (x, y)))
            .map(|at| self.at(at))
            .collect();
        inside.sort_by(f32::total_cmp);
        let half = (0.5 * inside[inside.len() / 2]).max(0.5 * threshold);
        let [width, height] = self.size;
        let column =
            |x: usize| 2 * core[1].clone().filter(|y| self.at((x, *y)) > half).count() >= core[1].len();
        let row = |y: usize| 2 * core[0].clone().filter(|x| self.at((*x, y)) > half).count() >= core[0].len();
        let [x, y] = patch.middle();
        let columns =
            [(0..x).rev().take_while(|x| column(*x)).count(), (x..width).take_while(|x| column(*x)).count()];
        let rows =
            [(0..y).rev().take_while(|y| row(*y)).count(), (y..height).take_while(|y| row(*y)).count()];
        let first = [x - columns[0], y - rows[0]];
        let last = [(x + columns[1]).saturating_sub(1).max(x), (y + rows[1]).saturating_sub(1).max(y)];
        Patch { first, last, ..*patch }
    }
}
