//! Markers that stand out by their shade: stickers darker or lighter than the textured ground around them, beside whose texture theirs is no more.

use std::iter;

use chainwave_measurement::{median, median_and_robust_sigma};

use crate::markers::patches::{Patch, add_new, connected};
use crate::markers::row::{Row, best_row};
use crate::markers::texture::{RADIUS_PX, Texture};

/// Levels between the darkest and the lightest shade that are tried.
const N_LEVELS: usize = 12;
/// Least share of its rectangle that such a marker fills: a disc has 0.79.
const LEAST_FILL: f64 = 0.65;
/// Standard deviations of the ground's shades by which a marker differs from them: texture all over has blots that differ by two.
const OUTSTANDING: f64 = 4.0;
/// What its speckles have at least: those of a small sticker are few, and lines that cross, or rings that touch, do not stand out so.
const LEAST_ISOTROPY: f64 = 0.1;
const LEAST_EVENNESS: f64 = 0.1;
/// Share of the texture of a row of fewer members that these must have.
const LEAST_SHARE: f64 = 0.5;
/// Fewer are no row: any two make one.
const LEAST_MEMBERS: usize = 3;

/// A row, or that of the markers which stand out by their shade, where it has more members and half of the texture, or far more members: what holds most of
/// the ground has much texture, too.
pub(crate) fn larger_by_shade(row: Option<Row>, texture: &Texture) -> Option<Row> {
    let shaded = best_row(texture.shaded_markers()).map(|row| row.without_cut(texture.size));
    let size = |row: &Option<Row>| row.as_ref().map_or((0, 0.0), |row| (row.members.len(), row.texture));
    let ((n, strength), (n_shaded, strength_shaded)) = (size(&row), size(&shaded));
    let is_larger = n_shaded > n && strength_shaded > LEAST_SHARE * strength || n_shaded > 2 * n;
    if is_larger && n_shaded >= LEAST_MEMBERS { shaded } else { row }
}

impl Texture {
    /// The markers that are all darker, or all lighter, than what is beside them.
    pub(crate) fn shaded_markers(&self) -> Vec<Patch> {
        let [darkest, lightest] =
            [f32::min, f32::max].map(|of| self.shades.iter().copied().reduce(of).unwrap_or(0.0));
        let step = (lightest - darkest) / (N_LEVELS + 1) as f32;
        let levels = iter::successors(Some(darkest + step), |level| Some(level + step)).take(N_LEVELS);
        let mut found: Vec<Patch> = Vec::new();
        for level in levels {
            let darker = connected(self, self.shades.iter().map(|shade| *shade < level).collect());
            let lighter = connected(self, self.shades.iter().map(|shade| *shade > level).collect());
            let patches = darker.iter().chain(&lighter);
            add_new(&mut found, patches.filter_map(|patch| self.shaded_marker(patch)));
        }
        found
    }

    /// The marker that a patch of one shade is; `None` where it is something else.
    fn shaded_marker(&self, patch: &Patch) -> Option<Patch> {
        let [width, height] = patch.sides_px();
        if (patch.area as f64) < LEAST_FILL * (width * height) as f64 {
            return None;
        }
        let [own, ground] = self.shades_if_it_stands_out(patch)?;
        let is_nearer = |i: usize| {
            let shade = f64::from(self.shades[i]);
            (shade - own).abs() < (shade - ground).abs()
        };
        // Ground of its shade beside it may be part of the patch.
        let outline = self.reaching(patch, is_nearer)?;
        let plateau = self.plateau(&outline).filter(|plateau| *plateau > f64::from(self.least))?;
        let is_speckled = self.is_speckled(&outline, LEAST_ISOTROPY, LEAST_EVENNESS);
        let is_marker = self.is_large_enough(&outline) && is_speckled;
        is_marker.then(|| outline.of_texture(plateau))
    }

    /// The shade of a patch and that of the ground around it, out to half its size, which has it nowhere; `None` where it may.
    fn shades_if_it_stands_out(&self, patch: &Patch) -> Option<[f64; 2]> {
        let reach = |axis: usize, beyond: usize| {
            patch.first[axis].saturating_sub(beyond)..(patch.last[axis] + 1 + beyond).min(self.size[axis])
        };
        let half = patch.sides_px().map(|side| RADIUS_PX + side / 2);
        let [near_columns, near_rows] = [0, 1].map(|axis| reach(axis, RADIUS_PX));
        let (mut own, mut around) = (Vec::new(), Vec::new());
        let [core_columns, core_rows] = patch.core();
        for y in reach(1, half[1]) {
            for x in reach(0, half[0]) {
                let shade = f64::from(self.shades[y * self.size[0] + x]);
                if core_columns.contains(&x) && core_rows.contains(&y) {
                    own.push(shade);
                } else if !(near_columns.contains(&x) && near_rows.contains(&y)) {
                    around.push(shade);
                }
            }
        }
        let (own, [ground, sigma]) = median(own).zip(median_and_robust_sigma(around))?;
        ((own - ground).abs() > OUTSTANDING * sigma).then_some([own, ground])
    }
}
