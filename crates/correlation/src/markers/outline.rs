//! The outline of a marker, and whether what it holds are speckles.

use chainwave_measurement::median;

use crate::markers::patches::Patch;
use crate::markers::texture::Texture;

/// Smallest width and height of a marker, in pixels: that of the smallest subset.
const LEAST_SIDE_PX: usize = 2 * crate::subset_size::LEAST_HALF_PX + 1;
/// Least ratio of the eigenvalues of the structure tensor over the middle of a marker. Speckles have a half and more, of the 30 or so that a
/// small marker's middle shows; two rings that touch have what their curvature makes, a twentieth.
const LEAST_ISOTROPY: f64 = 0.3;
/// Least ratio of the median square of a gradient to its mean. It is ln 2 where gradients are normal numbers along both axes, as those of
/// speckles and of noise nearly are; where lines cross on even ground, most pixels have none.
const LEAST_EVENNESS: f64 = 0.25;

/// Outlines until they no longer change; two or three do.
const MOST_OUTLINES: usize = 8;

impl Texture {
    /// The marker that a patch shows; `None` where it shows something else.
    pub(crate) fn marker(&self, patch: &Patch) -> Option<Patch> {
        // Each outline begins from the middle of the one before, so that it does not depend on the threshold.
        let mut outline = self.outline(patch)?;
        for _ in 0..MOST_OUTLINES {
            let next = self.outline(&outline)?;
            if next.is_same(&outline) {
                break;
            }
            outline = next;
        }
        (self.is_large_enough(&outline) && self.has_speckles(&outline)).then_some(outline)
    }

    /// Whether a marker may be as large as this: neither smaller than any subset, nor all of the picture.
    pub(crate) fn is_large_enough(&self, outline: &Patch) -> bool {
        outline.sides_px().iter().all(|side| *side >= LEAST_SIDE_PX) && !outline.is_everywhere(self.size)
    }

    /// Where the texture falls to half of what it is in the middle: averages over a window are half of what they are inside where half of
    /// the window lies inside, at the edge.
    fn outline(&self, patch: &Patch) -> Option<Patch> {
        let plateau = self.plateau(patch).filter(|plateau| *plateau > 0.0)?;
        let half = (0.5 * plateau) as f32;
        let outline = self.reaching(patch, |i| self.values[i] > half)?;
        Some(outline.of_texture(plateau))
    }

    /// The rectangle around the middle of a patch as far as half of its columns' and rows' middle pixels are of it.
    pub(crate) fn reaching(&self, patch: &Patch, is_of_it: impl Fn(usize) -> bool) -> Option<Patch> {
        let core = patch.core();
        let [width, height] = self.size;
        let is_at = |x: usize, y: usize| is_of_it(y * width + x);
        let column = |x: usize| 2 * core[1].clone().filter(|y| is_at(x, *y)).count() >= core[1].len();
        let row = |y: usize| 2 * core[0].clone().filter(|x| is_at(*x, y)).count() >= core[0].len();
        let [x, y] = patch.middle();
        let back =
            [(0..x).rev().take_while(|x| column(*x)).count(), (0..y).rev().take_while(|y| row(*y)).count()];
        let on = [(x..width).take_while(|x| column(*x)).count(), (y..height).take_while(|y| row(*y)).count()];
        if on.contains(&0) {
            return None;
        }
        let first = [x - back[0], y - back[1]];
        let last = [x + on[0] - 1, y + on[1] - 1];
        let area = (on[0] + back[0]) * (on[1] + back[1]);
        Some(Patch { first, last, area, texture: 0.0 })
    }

    /// The texture in the middle of a patch.
    pub(crate) fn plateau(&self, patch: &Patch) -> Option<f64> {
        let [columns, rows] = patch.core();
        median(rows.flat_map(|y| columns.clone().map(move |x| f64::from(self.at((x, y))))).collect())
    }

    /// Whether the middle of a patch has gradients in all directions, and nearly everywhere.
    pub(crate) fn has_speckles(&self, patch: &Patch) -> bool {
        self.is_speckled(patch, LEAST_ISOTROPY, LEAST_EVENNESS)
    }

    /// The same by other bounds.
    pub(crate) fn is_speckled(&self, patch: &Patch, least_isotropy: f64, least_evenness: f64) -> bool {
        let [columns, rows] = patch.core();
        let places = rows.flat_map(|y| columns.clone().map(move |x| y * self.size[0] + x));
        let gradients: Vec<[f64; 2]> =
            places.map(|i| [0, 1].map(|axis| f64::from(self.gradients[axis][i]))).collect();
        let n = gradients.len() as f64;
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| gradients.iter().map(of).sum::<f64>() / n;
        let [xx, xy, yy] = [mean(&|[x, _]| x * x), mean(&|[x, y]| x * y), mean(&|[_, y]| y * y)];
        let apart = (0.5 * (xx - yy)).hypot(xy);
        let of_noise = f64::from(self.least);
        let [smaller, larger] = [-1.0, 1.0].map(|sign| 0.5 * (xx + yy) + sign * apart - of_noise);
        let middle = median(gradients.iter().map(|[x, y]| x * x + y * y).collect()).unwrap_or(0.0);
        smaller >= least_isotropy * larger && middle >= least_evenness * (xx + yy)
    }
}
