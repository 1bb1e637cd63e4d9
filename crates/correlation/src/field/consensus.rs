//! Which points of a field are to be believed: groups of neighbours that agree with each other, and resemble the reference more than
//! chance, or the reference itself elsewhere, lets a place do.

use chainwave_measurement::Lost;

use crate::acceptance::{has_fallen, is_out_of_place};
use crate::field::known::{NEAR_PX, neighbours};
use crate::field::pair::{ImagePair, Settled};
use crate::icgn::outcome::Match;
use crate::search::area::SearchArea;
use crate::search::chance::{
    correlation_length_px, expected_zncc, fisher, is_told_by, n_independent, share_told,
};
use crate::search::larger::{LARGER, is_same_place};
use crate::search::rivals::{Own, best_rival};
use crate::search::template::Template;
use crate::warp::Warp;
use crate::{PreparedSubset, Shape, Window, Workspace};

/// Disagreement of neighbours, per pixel between them, that a field may have beyond its gradient: its curvature.
const BEND: f64 = 0.12;
/// The same where a match has no gradient of its own.
const STRETCH: f64 = 0.6;
/// What neighbours may differ by in any case, in pixels and in their standard uncertainties.
const SLACK: (f64, f64) = (0.5, 5.0);
/// Standard uncertainties by which a place may differ from where a neighbour leads to: of eight neighbours one is beyond by chance in one
/// of 400 points. No more than what neighbours may differ by in any case: what is less certain has not been seen.
const FORETOLD: f64 = 4.0;
/// By how many standard errors a group's correlation has to exceed what chance gives: once in 5e7.
const BEYOND_CHANCE: f64 = 5.5;
/// Standard errors that a search among thousands of places, and the shape function's degrees of freedom, gain by chance.
const BY_SEARCH: f64 = 4.0;
/// Independent subsets of a group that count: more of them do not make a resemblance that is low likelier.
const MOST_INDEPENDENT: f64 = 16.0;
/// Independent subsets below which a group stands by its own speckles alone: a lone spot resembles every other one, and as it turns
/// freely it is found anywhere.
const FEW: f64 = 4.0;
/// Mean correlation, after Fisher's transform, that noise takes little of (0.9): a subset of which half is hidden falls far below it, were its
/// texture so coarse that chance can do much.
const CLEAR: f64 = 1.47;
/// Share of what noise leaves of a subset's correlation with itself, after Fisher's transform, from which on nothing is hidden of a group: half
/// of a subset leaves 0.7 of it where noise leaves little, and less where it leaves more.
const WHOLE: f64 = 0.85;
/// Members of a group whose own texture is looked at.
const N_ASKED: usize = 5;
/// Places of the reference that resemble a subset most, and are matched.
const N_REPEATS: usize = 3;

/// What a group stands by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Support {
    /// Its own subsets.
    Itself,
    /// Subsets twice as large around its points, for noise leaves too little of its own.
    Around,
}

/// A larger subset that was found where the point that it lies around was found.
struct Around<'a> {
    larger: ImagePair<'a>,
    centre_px: [f64; 2],
    seen: Match,
}

/// The grid that groups are formed on.
pub(crate) struct Consensus<'a> {
    pub(crate) pair: &'a ImagePair<'a>,
    pub(crate) places: &'a [[f64; 2]],
    pub(crate) n_columns: usize,
    pub(crate) step_px: f64,
}

impl Consensus<'_> {
    /// Takes the positions of points that no group supports.
    pub(crate) fn judge(&self, settled: &mut [Option<Settled>]) {
        let groups = self.groups(settled);
        let Some(reference) = self.searched_reference(&groups) else { return };
        for group in groups {
            let mean = mean_correlation(&group, settled);
            let refused: Vec<(usize, Lost)> = match self.supported(&group, mean, settled, &reference) {
                Err(reason) => group.iter().map(|&point| (point, reason)).collect(),
                Ok(support) => {
                    let seen = self.seen(&group, support, settled);
                    let lost =
                        |&point: &usize| Some((point, self.in_place(point, &seen, mean, settled).err()?));
                    group.iter().filter_map(lost).collect()
                }
            };
            for (point, reason) in refused {
                if let Some((found, _)) = &mut settled[point] {
                    *found = Err(reason);
                }
            }
        }
    }

    /// Which points of a group are told from chance: all, or where subsets do not tell their places by themselves, those that are where
    /// the larger one around them is found.
    fn seen(&self, group: &[usize], support: Support, settled: &[Option<Settled>]) -> Vec<bool> {
        let mut seen = vec![false; settled.len()];
        for &point in group {
            let Some((Ok(found), _)) = &settled[point] else { continue };
            seen[point] = support == Support::Itself || self.seen_around(point, found).is_some();
        }
        seen
    }

    /// Whether a point of a group that is believed is so too: what hides a subset, or passes over it, leads the match astray by little
    /// from one point to the next. One that is where its neighbours foretell it is right, however weak its texture is.
    fn in_place(
        &self,
        point: usize,
        seen: &[bool],
        mean: f64,
        settled: &[Option<Settled>],
    ) -> Result<(), Lost> {
        let Some((Ok(found), _)) = &settled[point] else { return Ok(()) };
        // Few points have to be prepared once more for what noise leaves of them.
        let has_fallen = has_fallen(found.position.zncc, mean);
        if seen[point] && !has_fallen {
            return Ok(());
        }
        let may_be_lost = !seen[point]
            || is_out_of_place(&self.pair.prepare(self.places[point])?, found.position.zncc, mean);
        let is_lost = may_be_lost && !self.is_foretold(point, found, (seen, mean), settled);
        if is_lost { Err(Lost::LowCorrelation) } else { Ok(()) }
    }

    /// Whether a point lies where the places and gradients of neighbours lead to that are seen and have not fallen themselves.
    fn is_foretold(
        &self,
        point: usize,
        found: &Match,
        (seen, mean): (&[bool], f64),
        settled: &[Option<Settled>],
    ) -> bool {
        let by = |neighbour: usize| {
            let Some((Ok(other), _)) = &settled[neighbour] else { return None };
            let apart = [0, 1].map(|axis| self.places[point][axis] - self.places[neighbour][axis]);
            let (expected, at) = (other.warp().apply(apart), found.warp().position_px);
            let off_px = (expected[0] - at[0]).hypot(expected[1] - at[1]);
            let of_gradient = self.pair.gradient_noise_at(apart) * sigma(other);
            let slack_px = (FORETOLD * sigma(found).hypot(sigma(other)).hypot(of_gradient)).min(SLACK.0);
            (seen[neighbour] && !has_fallen(other.position.zncc, mean)).then_some(off_px <= slack_px)
        };
        let said: Vec<bool> = neighbours(point, self.n_columns, self.places.len()).filter_map(by).collect();
        !said.is_empty() && said.into_iter().all(|agrees| agrees)
    }

    fn searched_reference(&self, groups: &[Vec<usize>]) -> Option<SearchArea> {
        let image = self.pair.reference.image();
        (!groups.is_empty()).then(|| SearchArea::new(image.region, image.pixels.clone(), image.level as f32))
    }

    /// Found points, grouped by agreement with their neighbours.
    fn groups(&self, settled: &[Option<Settled>]) -> Vec<Vec<usize>> {
        let mut open: Vec<bool> = settled.iter().map(|one| matches!(one, Some((Ok(_), _)))).collect();
        let mut groups = Vec::new();
        for first in 0..settled.len() {
            if !std::mem::take(&mut open[first]) {
                continue;
            }
            let mut group = vec![first];
            let mut next = 0;
            while let Some(&point) = group.get(next) {
                next += 1;
                for neighbour in neighbours(point, self.n_columns, self.places.len()) {
                    if open[neighbour] && self.agree(settled, point, neighbour) {
                        open[neighbour] = false;
                        group.push(neighbour);
                    }
                }
            }
            groups.push(group);
        }
        groups
    }

    fn agree(&self, settled: &[Option<Settled>], left: usize, right: usize) -> bool {
        let (Some((Ok(a), shape)), Some((Ok(b), _))) = (&settled[left], &settled[right]) else {
            return false;
        };
        let apart = [0, 1].map(|axis| self.places[right][axis] - self.places[left][axis]);
        let (there, back) = (a.warp().apply(apart), b.warp().apply(apart.map(|value| -value)));
        let off = |expected: [f64; 2], found: &Match| {
            let [x, y] = found.warp().position_px;
            (expected[0] - x).hypot(expected[1] - y)
        };
        // Their mean: what a curvature adds to the one it takes from the other.
        let off_px = 0.5 * (off(there, b) + off(back, a));
        let bend = if *shape == Shape::Translation { STRETCH } else { BEND };
        off_px <= SLACK.0 + SLACK.1 * sigma(a).hypot(sigma(b)) + bend * apart[0].hypot(apart[1])
    }

    /// Whether a group resembles the reference beyond chance, and beyond what the reference resembles itself elsewhere.
    fn supported(
        &self,
        group: &[usize],
        mean: f64,
        settled: &[Option<Settled>],
        reference: &SearchArea,
    ) -> Result<Support, Lost> {
        let asked = group.iter().step_by(group.len().div_ceil(N_ASKED));
        let asked: Vec<(usize, &Match)> =
            asked.filter_map(|&point| Some((point, settled[point].as_ref()?.0.as_ref().ok()?))).collect();
        self.supported_by_itself(group, &asked, mean, reference).or_else(|reason| {
            let around = self.supported_around(group, &asked, reference);
            around.map(|()| Support::Around).map_err(|_| reason)
        })
    }

    fn supported_by_itself(
        &self,
        group: &[usize],
        asked: &[(usize, &Match)],
        mean: f64,
        reference: &SearchArea,
    ) -> Result<Support, Lost> {
        let subsets = asked.iter().map(|&(point, found)| Ok((self.pair.prepare(self.places[point])?, found)));
        let subsets: Vec<(PreparedSubset, &Match)> = subsets.collect::<Result<_, Lost>>()?;
        let n_subsets = self.n_apart(group, self.pair.side_px()).min(MOST_INDEPENDENT);
        let beyond = Beyond::chance(subsets.iter().map(|(subset, _)| subset), n_subsets);
        let stands = |(subset, found): &(PreparedSubset, &Match)| {
            beyond.is_exceeded(mean, self.pair, subset, found, reference)
        };
        most(subsets.iter().map(stands))?;
        let asked_whether = |is_so: &dyn Fn(&PreparedSubset) -> bool| {
            let said = subsets.iter().map(|(subset, _)| is_so(subset));
            most(said.map(|is_so| if is_so { Ok(()) } else { Err(Lost::LowCorrelation) }))
        };
        let is_told =
            |subset: &PreparedSubset| mean >= CLEAR || is_told_by(mean, subset, reference.n_pixels() as f64);
        // Of a group of which nothing is hidden by and large, something may be of some.
        asked_whether(&is_told).map(|()| Support::Itself).or_else(|_| {
            asked_whether(&|subset| n_subsets >= FEW && is_whole(mean, subset)).map(|()| Support::Around)
        })
    }

    /// The same of larger subsets around points of a group: each by itself, for it is matched for itself, or together where nothing is hidden
    /// of them.
    fn supported_around(
        &self,
        group: &[usize],
        asked: &[(usize, &Match)],
        reference: &SearchArea,
    ) -> Result<(), Lost> {
        let around = asked.iter().map(|&(point, found)| {
            let around = self.seen_around(point, found)?;
            let subset = around.larger.prepare(around.centre_px).ok()?;
            Some((around, subset))
        });
        let around: Vec<Option<(Around<'_>, PreparedSubset)>> = around.collect();
        let seen = || around.iter().flatten();
        let n_seen = seen().count().max(1) as f64;
        let of = |around: &Around<'_>| fisher(around.seen.position.zncc);
        let mean = seen().map(|(around, _)| of(around)).sum::<f64>() / n_seen;
        let n_subsets = self.n_apart(group, LARGER * self.pair.side_px()).min(n_seen);
        let together = Beyond::chance(seen().map(|(_, subset)| subset), n_subsets);
        most(around.iter().map(|one| {
            let (around, subset) = one.as_ref().ok_or(Lost::LowCorrelation)?;
            let stands = |beyond: Beyond, correlation: f64| {
                beyond.is_exceeded(correlation, &around.larger, subset, &around.seen, reference)
            };
            let alone = stands(Beyond::chance([subset], 1.0), of(around));
            let are_whole = n_subsets >= FEW && is_whole(mean, subset);
            alone.or_else(|reason| if are_whole { stands(together, mean) } else { Err(reason) })
        }))
    }

    /// How many subsets of a side a group holds that share no pixel, by its area.
    fn n_apart(&self, group: &[usize], side_px: f64) -> f64 {
        (group.len() as f64 * (self.step_px / side_px).powi(2)).max(1.0)
    }

    /// The match of a larger subset around a point that puts the point in its place; at an edge of either picture its centre lies
    /// farther inside.
    fn seen_around(&self, point: usize, found: &Match) -> Option<Around<'_>> {
        let larger = self.pair.enlarged(LARGER);
        let place_px = self.places[point];
        let centre_px = larger.nearest_inside(place_px, self.pair.half_px, &found.warp())?;
        let offset = [0, 1].map(|axis| centre_px[axis] - place_px[axis]);
        let start = Warp { position_px: found.warp().apply(offset), ..found.warp() };
        let seen = larger.settle(centre_px, start, &mut Workspace::default()).0.ok()?;
        let there_px = seen.warp().apply(offset.map(|value| -value));
        is_same_place(found.warp().position_px, there_px).then_some(Around { larger, centre_px, seen })
    }
}

/// What the mean correlation of some subsets has to exceed, after Fisher's transform.
#[derive(Debug, Clone, Copy)]
struct Beyond {
    /// What a search gains by chance.
    by_search: f64,
    /// By how much that, and anything else that they resemble, has to be exceeded.
    slack: f64,
}

impl Beyond {
    /// Chance, for as many subsets with textures like these, apart from each other.
    fn chance<'a>(textures: impl IntoIterator<Item = &'a PreparedSubset>, n_subsets: f64) -> Self {
        let variances = textures.into_iter().map(|subset| chance_sigma(subset, n_subsets).powi(2));
        let variances: Vec<f64> = variances.collect();
        let n = variances.len().max(1) as f64;
        // The gain is the mean of the subsets' own, and the mean scatters by the mean of their variances.
        let sigma = variances.iter().map(|variance| variance.sqrt()).sum::<f64>() / n;
        let variance = variances.iter().sum::<f64>() / n;
        Self { by_search: BY_SEARCH * sigma, slack: BEYOND_CHANCE * (variance / n_subsets).sqrt() }
    }

    /// Whether a mean correlation exceeds it, and what the reference resembles one of the subsets elsewhere.
    fn is_exceeded(
        self,
        mean: f64,
        pair: &ImagePair<'_>,
        subset: &PreparedSubset,
        found: &Match,
        reference: &SearchArea,
    ) -> Result<(), Lost> {
        if mean < self.by_search + self.slack {
            Err(Lost::LowCorrelation)
        } else if mean < repeats(pair, subset, found, reference) + self.slack {
            Err(Lost::Ambiguous)
        } else {
            Ok(())
        }
    }
}

/// Standard deviation of the correlation of a subset with something unrelated, after Fisher's transform, one of so many that are apart from
/// each other.
fn chance_sigma(subset: &PreparedSubset, n_subsets: f64) -> f64 {
    // The shape function brings as many spots onto others as it has pairs of parameters, which neighbours that agree would contradict.
    let (told, degrees_of_freedom) =
        if n_subsets < FEW { (share_told(subset), subset.settings.shape.n_parameters()) } else { (1.0, 0) };
    let n_told = told * n_independent(subset) - degrees_of_freedom as f64;
    (n_told - 3.0).max(1.0).sqrt().recip()
}

/// Whether a mean correlation is so near to what noise leaves of a subset's with itself that nothing is hidden of most.
fn is_whole(mean: f64, subset: &PreparedSubset) -> bool {
    mean >= WHOLE * fisher(expected_zncc(subset))
}

/// How well the reference resembles a subset of its own somewhere else: within what a search near it sees from either of both, and
/// as far as a place goes that the point could have moved to by less than it did.
fn repeats(pair: &ImagePair<'_>, subset: &PreparedSubset, found: &Match, reference: &SearchArea) -> f64 {
    let [x, y] = subset.centre_px;
    let [u, v] = found.warp().position_px;
    let moved_px = (u - x).hypot(v - y).ceil() as usize;
    let reach_px = (2 * NEAR_PX).max(NEAR_PX + 2 * moved_px);
    let reach = subset.half_px().map(|half| half.ceil() as usize + reach_px);
    let Some(area) = reference.cut(subset.centre_px, reach) else { return 0.0 };
    let Ok(window) = Window::new(area.region, &area.pixels, pair.settings.interpolation) else {
        return 0.0;
    };
    let length_px = correlation_length_px(subset);
    let peaks = area.peaks_elsewhere(&Template::upright(subset), subset.centre_px, length_px, N_REPEATS);
    let mut workspace = Workspace::default();
    let own = Own { place_px: subset.centre_px, zncc: 1.0, length_px };
    best_rival(own, &peaks, |place_px| {
        let found = subset.solve(&window, Warp::at(place_px), &mut workspace).ok()?;
        Some(found.place())
    })
}

/// What most of those that were asked say: they let a group stand, or the first reason against it.
fn most(said: impl ExactSizeIterator<Item = Result<(), Lost>>) -> Result<(), Lost> {
    let n_asked = said.len();
    let reasons: Vec<Lost> = said.filter_map(Result::err).collect();
    match reasons.as_slice() {
        [reason, ..] if 2 * reasons.len() > n_asked => Err(*reason),
        _ => Ok(()),
    }
}

/// The standard uncertainty of a place, in pixels.
fn sigma(found: &Match) -> f64 {
    found.position.x_px.sigma.hypot(found.position.y_px.sigma)
}

/// The mean correlation of a group's points, after Fisher's transform.
fn mean_correlation(group: &[usize], settled: &[Option<Settled>]) -> f64 {
    let correlation = |point: &usize| match &settled[*point] {
        Some((Ok(found), _)) => fisher(found.position.zncc),
        _ => 0.0,
    };
    group.iter().map(correlation).sum::<f64>() / group.len() as f64
}
