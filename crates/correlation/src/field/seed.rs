//! The points of a field that are found by search, because no neighbour leads to them.

use std::collections::VecDeque;

use crate::field::island::{Islands, MAX_DEFORMED_FAILURES, USUAL_PIXELS};
use crate::field::known::{Known, NEAR_PX};
use crate::field::pair::{ImagePair, Settled};
use crate::icgn::outcome::Match;
use crate::search::area::SearchArea;
use crate::search::chance::{RARE, chance_zncc, is_told};
use crate::search::larger::{LARGER, is_same_place};
use crate::search::patch::{Deformations, Patch};
use crate::search::template::Template;
use crate::warp::Warp;
use crate::{PreparedSubset, Workspace};

/// Points between two candidates for a seed, along x and y.
const SPACING: usize = 4;
/// Candidates that are searched for in the whole image in vain before no more are.
const MAX_WHOLE_FAILURES: usize = 12;
/// Reach of the patch that is searched for so, over half the subset's side: its square is cut from a turned one.
const PATCH: f64 = 1.6;

/// Candidates for seeds, in order.
pub(crate) struct Seeds {
    candidates: VecDeque<usize>,
    /// Displacement of the last seed found.
    displacement_px: Option<[f64; 2]>,
    n_whole_failures: usize,
    n_deformed_failures: usize,
    /// The whole target, once it has been searched.
    whole: Option<SearchArea>,
    /// Bodies apart from each other, once a candidate is not where it is expected.
    islands: Option<Islands>,
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
        Self {
            candidates: candidates.into(),
            displacement_px: None,
            n_whole_failures: 0,
            n_deformed_failures: 0,
            whole: None,
            islands: None,
        }
    }

    /// The next candidate that nothing has led to.
    pub(crate) fn next(&mut self, settled: &[Option<Settled>]) -> Option<usize> {
        loop {
            let point = self.candidates.pop_front()?;
            if !matches!(settled[point], Some((Ok(_), _))) {
                return Some(point);
            }
        }
    }

    /// Searches for a point: near where the last seed's displacement puts it; around the body that it belongs to; then in the whole image,
    /// upright and deformed, until that has failed too often.
    pub(crate) fn find(
        &mut self,
        known: &Known<'_, '_>,
        point: usize,
        workspace: &mut Workspace,
    ) -> Option<Settled> {
        let (pair, place_px) = (known.pair, known.places[point]);
        let subset = pair.prepare(place_px).ok()?;
        let [u, v] = self.displacement_px.unwrap_or([0.0; 2]);
        let expected = [place_px[0] + u, place_px[1] + v];
        let near = SearchArea::around(pair.target, expected, scene_reach(&subset));
        let found = near
            .and_then(|part| try_upright(pair, &subset, &part, place_px, workspace))
            .or_else(|| self.find_farther(known, &subset, point, workspace))?;
        let (Ok(position), _) = &found else { return None };
        let [x, y] = position.warp().position_px;
        self.displacement_px = Some([x - place_px[0], y - place_px[1]]);
        Some(found)
    }

    fn find_farther(
        &mut self,
        known: &Known<'_, '_>,
        subset: &PreparedSubset,
        point: usize,
        workspace: &mut Workspace,
    ) -> Option<Settled> {
        let islands = self.islands.get_or_insert_with(|| {
            let islands = Islands::of(known);
            let middles = islands.middles(known).into_iter().rev();
            middles.for_each(|middle| self.candidates.push_front(middle));
            islands
        });
        if islands.leaves(known, point) {
            return None;
        }
        let around = islands.search_around(known, point, |area| {
            let place_px = known.places[point];
            try_upright(known.pair, subset, area, place_px, workspace)
                .or_else(|| find_deformed(known.pair, subset, area, place_px, workspace))
        });
        around.or_else(|| self.find_anywhere(known.pair, subset, known.places[point], workspace))
    }

    fn find_anywhere(
        &mut self,
        pair: &ImagePair<'_>,
        subset: &PreparedSubset,
        place_px: [f64; 2],
        workspace: &mut Workspace,
    ) -> Option<Settled> {
        if self.n_whole_failures >= MAX_WHOLE_FAILURES {
            return None;
        }
        let whole = self.whole.get_or_insert_with(|| SearchArea::of(pair.target));
        let most =
            (MAX_DEFORMED_FAILURES * USUAL_PIXELS / whole.n_pixels().max(1)).clamp(1, MAX_DEFORMED_FAILURES);
        let mut found = try_upright(pair, subset, whole, place_px, workspace);
        if found.is_none() && self.n_deformed_failures < most {
            found = find_deformed(pair, subset, whole, place_px, workspace);
            self.n_deformed_failures += usize::from(found.is_none());
        }
        self.n_whole_failures += usize::from(found.is_none());
        found
    }
}

/// Searches for a point turned, stretched or scaled; where noise leaves too little of its subset, by a larger patch around it.
fn find_deformed(
    pair: &ImagePair<'_>,
    subset: &PreparedSubset,
    whole: &SearchArea,
    place_px: [f64; 2],
    workspace: &mut Workspace,
) -> Option<Settled> {
    let all = whole.n_pixels() * Deformations::All.count();
    let (larger, deformations) =
        if is_told(subset, all as f64) { (1.0, Deformations::All) } else { (LARGER, Deformations::Fine) };
    let n_trials = whole.n_pixels() * deformations.count();
    let reach_px = larger * PATCH * pair.half_px as f64;
    let patch = Patch::around(pair.reference.image(), subset, reach_px);
    patch.find(whole, deformations, |start| try_at(pair, subset, start, n_trials, place_px, workspace))
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
    try_at(pair, subset, Warp::at(found.place_px), part.n_pixels(), place_px, workspace)
}

/// A match from a place found by search among so many, unless it may be a coincidence, for its subset and for a larger one around it.
fn try_at(
    pair: &ImagePair<'_>,
    subset: &PreparedSubset,
    start: Warp,
    n_trials: usize,
    place_px: [f64; 2],
    workspace: &mut Workspace,
) -> Option<Settled> {
    let is_certain = |subset: &PreparedSubset, found: &Match| {
        found.position.zncc >= chance_zncc(subset, n_trials as f64, RARE)
    };
    let settled = pair.settle(place_px, start, workspace);
    let found = settled.0.as_ref().ok()?;
    let mut is_certain_around = || {
        let larger = pair.enlarged(LARGER);
        let (Ok(around), (Ok(seen), _)) =
            (larger.prepare(place_px), larger.settle(place_px, found.warp(), workspace))
        else {
            return false;
        };
        is_certain(&around, &seen) && is_same_place(found.warp().position_px, seen.warp().position_px)
    };
    (is_certain(subset, found) || is_certain_around()).then_some(settled)
}
