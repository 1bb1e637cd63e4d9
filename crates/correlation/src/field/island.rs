//! Bodies apart from each other before a bare ground: each is searched for around itself before the whole picture is.
//!
//! Among points that have texture, those that are neighbours belong to one island. A body that is turned by any angle stays near where it
//! was, and what is near takes a small part of the time that the whole picture takes. So the middle of each island is a candidate, for it
//! moves the least as the island turns.

use std::collections::VecDeque;

use chainwave_measurement::Region;

use crate::field::known::{Known, NEAR_PX, neighbours};
use crate::search::area::SearchArea;

/// Share of the picture up to which the surroundings of an island are worth a search of their own.
const SMALL: f64 = 0.25;
/// Points of an island that are searched for around it in vain before no more are.
const MAX_FAILURES: usize = 3;
/// Searches at all angles and lengths of a picture of [`USUAL_PIXELS`] that may be in vain; fewer of a larger one.
pub(crate) const MAX_DEFORMED_FAILURES: usize = 6;
/// Pixels of a picture in which such a search takes a second or so.
pub(crate) const USUAL_PIXELS: usize = 512 * 512;
/// Pixels that are searched so in vain before no more are: as many as the searches of whole pictures take.
const MAX_PIXELS: usize = MAX_DEFORMED_FAILURES * USUAL_PIXELS;

/// The islands of a grid.
pub(crate) struct Islands {
    /// To which island each point belongs; `None` where it has no texture.
    of_point: Vec<Option<usize>>,
    islands: Vec<Island>,
    /// Pixels that were searched in vain.
    n_pixels: usize,
}

struct Island {
    points: Vec<usize>,
    n_failures: usize,
}

impl Islands {
    /// Points with texture, grouped with their neighbours.
    pub(crate) fn of(known: &Known<'_, '_>) -> Self {
        let places = known.places;
        let mut open: Vec<bool> = (0..places.len())
            .map(|point| known.is_found(point) || known.pair.prepare(places[point]).is_ok())
            .collect();
        let mut found = Self { of_point: vec![None; places.len()], islands: Vec::new(), n_pixels: 0 };
        for first in 0..places.len() {
            if !std::mem::take(&mut open[first]) {
                continue;
            }
            let mut points = vec![first];
            let mut next = 0;
            while let Some(&point) = points.get(next) {
                next += 1;
                found.of_point[point] = Some(found.islands.len());
                for neighbour in neighbours(point, known.n_columns, places.len()) {
                    if std::mem::take(&mut open[neighbour]) {
                        points.push(neighbour);
                    }
                }
            }
            found.islands.push(Island { points, n_failures: 0 });
        }
        found
    }

    /// The point nearest to the middle of each island of which nothing was found, where there are several, the largest islands first.
    pub(crate) fn middles(&self, known: &Known<'_, '_>) -> Vec<usize> {
        let mut open: Vec<&Island> = self.islands.iter().filter(|island| !island.has_found(known)).collect();
        if self.islands.len() < 2 {
            return Vec::new();
        }
        open.sort_by_key(|island| std::cmp::Reverse(island.points.len()));
        let middle = |island: &Island| {
            let n = island.points.len() as f64;
            let places = || island.points.iter().map(|&point| known.places[point]);
            let [x, y] = [0, 1].map(|axis| places().map(|place| place[axis]).sum::<f64>() / n);
            let away = |&point: &usize| (known.places[point][0] - x).hypot(known.places[point][1] - y);
            island.points.iter().copied().min_by(|a, b| away(a).total_cmp(&away(b)))
        };
        open.into_iter().filter_map(middle).collect()
    }

    /// Whether the nearest point of its island that was found expects a point outside of the picture.
    pub(crate) fn leaves(&self, known: &Known<'_, '_>, point: usize) -> bool {
        let nearest = self.nearest_found(known, point);
        nearest.is_some_and(|from| match &known.settled[from] {
            Some((Ok(found), _)) => !known.pair.is_well_inside(&known.start_from(&found.warp(), from, point)),
            _ => false,
        })
    }

    fn nearest_found(&self, known: &Known<'_, '_>, point: usize) -> Option<usize> {
        let own = self.of_point[point]?;
        let mut is_seen = vec![false; self.of_point.len()];
        is_seen[point] = true;
        let mut open = VecDeque::from([point]);
        while let Some(point) = open.pop_front() {
            if known.is_found(point) {
                return Some(point);
            }
            for neighbour in neighbours(point, known.n_columns, known.places.len()) {
                let is_new = !std::mem::replace(&mut is_seen[neighbour], true);
                if is_new && self.of_point[neighbour] == Some(own) {
                    open.push_back(neighbour);
                }
            }
        }
        None
    }

    /// What a search around the island of a point finds, where nothing of it was found yet and it is small.
    pub(crate) fn search_around<T>(
        &mut self,
        known: &Known<'_, '_>,
        point: usize,
        search: impl FnOnce(&SearchArea) -> Option<T>,
    ) -> Option<T> {
        let island = &mut self.islands[self.of_point[point]?];
        let is_open =
            island.n_failures < MAX_FAILURES && self.n_pixels < MAX_PIXELS && !island.has_found(known);
        let area = is_open.then(|| island.surroundings(known))??;
        let found = search(&area);
        if found.is_none() {
            island.n_failures += 1;
            self.n_pixels += area.n_pixels();
        }
        found
    }
}

impl Island {
    fn has_found(&self, known: &Known<'_, '_>) -> bool {
        self.points.iter().any(|&point| known.is_found(point))
    }

    /// The pixels of the target where the island's subsets lay, and some around; `None` where that is a large part of the picture.
    fn surroundings(&self, known: &Known<'_, '_>) -> Option<SearchArea> {
        let half_px = known.pair.half_px as f64;
        let places = self.points.iter().map(|&point| known.places[point]);
        let bounds = places.fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], place| {
            [[0, 1].map(|axis| low[axis].min(place[axis])), [0, 1].map(|axis| high[axis].max(place[axis]))]
        });
        let [low, high] = bounds;
        let middle_px = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
        // An island that lies across is as long along the other axis when it has turned.
        let longest_px = (high[0] - low[0]).max(high[1] - low[1]);
        let reach = (0.5 * longest_px + half_px).ceil() as usize + NEAR_PX;
        let Region { width, height, .. } = known.pair.target.source;
        let is_small = ((2 * reach + 1).pow(2) as f64) <= SMALL * (width * height) as f64;
        is_small.then(|| SearchArea::around(known.pair.target, middle_px, [reach; 2]))?
    }
}
