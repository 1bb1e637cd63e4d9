//! Template search: whole pixels, and the top of a paraboloid.

use crate::PreparedSubset;
use crate::refine::Refine;
use crate::search::area::SearchArea;
use crate::search::template::Template;

/// Search for the subset at whole pixels, and the top of a paraboloid through the correlation there and at its eight
/// neighbours (the peak fit of particle image velocimetry: M. Raffel et al., Particle Image Velocimetry, 3rd ed., 2018,
/// section 5.4; with the mixed term, without which texture along a diagonal pulls both coordinates).
pub(crate) struct TemplateSearch(Template);

impl Refine for TemplateSearch {
    fn prepare(subset: &PreparedSubset) -> Self {
        Self(Template::upright(subset))
    }

    fn refine(&self, _: &PreparedSubset, scene: &SearchArea, _: [f64; 2]) -> Option<[f64; 2]> {
        let [x, y] = scene.find(&self.0)?.place_px;
        let mut zncc = [[0.0; 3]; 3];
        for (dy, row) in (-1..=1).zip(&mut zncc) {
            for (dx, zncc) in (-1..=1).zip(row) {
                *zncc = scene.zncc_at(&self.0, [x + f64::from(dx), y + f64::from(dy)])?;
            }
        }
        let [dx, dy] = top(&zncc)?;
        Some([x + dx, y + dy])
    }
}

/// Where a paraboloid through nine values, row by row, has its top; `None` where that is not near the middle.
fn top(values: &[[f64; 3]; 3]) -> Option<[f64; 2]> {
    let [above, here, below] = values;
    let (slope_x, slope_y) = (0.5 * (here[2] - here[0]), 0.5 * (below[1] - above[1]));
    let bend_x = here[0] - 2.0 * here[1] + here[2];
    let bend_y = above[1] - 2.0 * here[1] + below[1];
    let mixed = 0.25 * (above[0] - above[2] - below[0] + below[2]);
    let determinant = bend_x * bend_y - mixed * mixed;
    let place = [
        (mixed * slope_y - bend_y * slope_x) / determinant,
        (mixed * slope_x - bend_x * slope_y) / determinant,
    ];
    let is_top = bend_x < 0.0 && determinant > 0.0 && place.iter().all(|value| value.abs() <= 1.0);
    is_top.then_some(place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_top_of_a_paraboloid_is_found_exactly() {
        let value = |x: f64, y: f64| {
            let (x, y) = (x - 0.3, y + 0.4);
            2.0 - 0.5 * x * x - 0.4 * y * y + 0.3 * x * y
        };
        let values = [-1.0, 0.0, 1.0].map(|y| [-1.0, 0.0, 1.0].map(|x| value(x, y)));
        let [x, y] = top(&values).unwrap();
        assert!((x - 0.3).abs() < 1e-14 && (y + 0.4).abs() < 1e-14, "rounding: {x} {y}");
        assert_eq!(top(&[[1.0; 3]; 3]), None);
    }
}
