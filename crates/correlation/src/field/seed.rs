//! The points of a field that are found by search, because no neighbour leads to them.

use chainwave_measurement::Lost;

use crate::field::pair::{ImagePair, Settled};
use crate::search::{SearchArea, Template, chance_zncc};
use crate::warp::Warp;
use crate::{PreparedSubset, Workspace};

/// Points between two candidates for a seed, along x and y.
const SPACING: usize = 4;
/// Candidates that are searched for in the whole image before the images count as unrelated.
const MAX_WHOLE_SEARCHES: usize = 12;
/// Of these, the first so many are searched for at all angles too.
const MAX_TURNED_SEARCHES: usize = 3;
/// Columns and rows around the expected place that are searched first.
const NEAR_PX: usize = 24;

/// Candidates for seeds, in order.
pub(crate) struct Seeds {
    candidates: std::vec::IntoIter<usize>,
    /// Displacement of the last seed found.
    displacement_px: Option<[f64; 2]>,
    n_whole_searches: usize,
}

impl Seeds {
    /// Candidates on a coarse lattice of a grid, those near its centre first.
    pub(crate) fn new(n_columns: usize, n_points: usize) -> Self {
        let n_rows = n_points / n_columns;
        let lattice = |n: usize| (n / 2 % SPACING..n).step_by(SPACING);
        let mut candidates: Vec<usize> = lattice(n_rows)
            .flat_map(|row| lattice(n_columns).map(move |column| row * n_columns + column))
            .collect();
        let far = |&point: &usize| {
            let (row, column) = (point / n_columns, point % n_columns);
            row.abs_diff(n_rows / 2).pow(2) + column.abs_diff(n_columns / 2).pow(2)
        };
        candidates.sort_by_key(far);
        Self { candidates: candidates.into_iter(), displacement_px: None, n_whole_searches: 0 }
    }

    /// The next candidate that nothing has led to.
    pub(crate) fn next(&mut self, settled: &[Option<Settled>]) -> Option<usize> {
        self.candidates.find(|&point| !matches!(settled[point], Some((Ok(_), _))))
    }

    /// Searches for a point: near where the last seed's displacement puts it, then, until there is a first seed, in the
    /// whole image, upright and turned.
    pub(crate) fn find(
        &mut self,
        pair: &ImagePair<'_>,
        place_px: [f64; 2],
        workspace: &mut Workspace,
    ) -> Option<Settled> {
        let subset = pair.prepare(place_px).ok()?;
        let [u, v] = self.displacement_px.unwrap_or([0.0; 2]);
        let expected = [place_px[0] + u, place_px[1] + v];
        let near = SearchArea::around(pair.target, expected, scene_reach(&subset));
        let mut found = near.and_then(|part| try_upright(pair, &subset, &part, place_px, workspace));
        if found.is_none() && self.displacement_px.is_none() && self.n_whole_searches < MAX_WHOLE_SEARCHES {
            self.n_whole_searches += 1;
            let whole = SearchArea::of(pair.target);
            found = try_upright(pair, &subset, &whole, place_px, workspace).or_else(|| {
                let turned =
                    (self.n_whole_searches <= MAX_TURNED_SEARCHES).then(|| whole.find_turned(&subset));
                try_at(pair, &subset, turned??, place_px, workspace)
            });
        }
        let (Ok(position), _) = found.as_ref()? else { return None };
        let [x, y] = position.warp().position_px;
        self.displacement_px = Some([x - place_px[0], y - place_px[1]]);
        found
    }
}

/// Columns and rows on each side that are read around the expected place.
fn scene_reach(subset: &PreparedSubset) -> [usize; 2] {
    subset.half_px().map(|half| half.ceil() as usize + NEAR_PX)
}

fn try_upright(
    pair: &ImagePair<'_>,
    subset: &PreparedSubset,
    part: &SearchArea,
    place_px: [f64; 2],
    workspace: &mut Workspace,
) -> Option<Settled> {
    let found = part.find(&Template::upright(subset))?;
    try_at(pair, subset, Warp::at(found.place_px), place_px, workspace)
}

/// A match from a place found by search, unless it may be a coincidence.
fn try_at(
    pair: &ImagePair<'_>,
    subset: &PreparedSubset,
    start: Warp,
    place_px: [f64; 2],
    workspace: &mut Workspace,
) -> Option<Settled> {
    let settled = pair.settle(place_px, start, workspace);
    let certain = |zncc: f64| zncc >= chance_zncc(subset).max(subset.settings.min_zncc);
    let position: &Result<_, Lost> = &settled.0;
    position.as_ref().is_ok_and(|found| certain(found.position.zncc)).then_some(settled)
}
