//! Points whose subsets something runs through: a crack, or the edge of an object that was not there before.
//!
//! An affine shape function takes the jump across a crack for a strain, with residuals that a crack of some pixels makes hardly twice those of
//! noise, and says too little in sigma: the error is none of a texture's scatter. So where the residuals exceed the field's usual ones, the
//! halves of the subset, all of which hold its centre at their rim, are matched by themselves. A half that shows no more than noise, and goes on as
//! an undisturbed neighbour beyond it foretells, gives the place where the whole subset or the other half is not there: with the sigma of so few
//! pixels. On a surface that bends no neighbour foretells it over such a way. Where no half is undisturbed, the place may be that of either,
//! which is stated.

use std::num::NonZero;

use chainwave_measurement::map_in_parallel;

use crate::field::pair::{ImagePair, Settled};
use crate::icgn::outcome::Match;
use crate::search::chance::{RARE, chance_zncc_by};
use crate::warp::Warp;
use crate::{PreparedSubset, Shape, Workspace};

/// Residuals over what noise explains up to which those that are least are noise alone, and not what a shape function leaves everywhere.
const NOISE_ALONE: f64 = 1.25;
/// Standard deviations by which two places are not the same.
const APART: f64 = 5.0;
/// Pixels that a place may be off by which are stated where no half is undisturbed: half of how far halves see it apart. Of a displacement that bends the third
/// order differs, by two fifths of what it is at the rim.
const LEAST_STATED_PX: f64 = 0.5;
/// Residuals of one half over those of the other that no texture makes.
const MORE: f64 = 2.0;
/// Starts that a half is matched from.
const N_STARTS: f64 = 2.0;
/// Normals of the lines through the centre that part a subset: along x, along y, and along both diagonals.
const NORMALS: [[f64; 2]; 4] = [[0.0, 1.0], [1.0, 0.0], [1.0, 1.0], [1.0, -1.0]];

/// A field of which all points are settled.
pub(crate) struct Halves<'a> {
    pub(crate) pair: &'a ImagePair<'a>,
    pub(crate) places: &'a [[f64; 2]],
    pub(crate) n_columns: usize,
    pub(crate) step_px: f64,
    pub(crate) n_threads: NonZero<usize>,
}

/// What is expected of a point by a neighbour, and the standard uncertainty of that along x and y.
struct Guide {
    warp: Warp,
    sigma_px: [f64; 2],
}

/// One half of a subset.
struct Half {
    found: Option<Match>,
    /// Whether it shows nothing but noise.
    is_clear: bool,
    /// Whether it is where its guide has it.
    is_foretold: bool,
}

impl Halves<'_> {
    /// Takes the places of points through whose subsets something runs from the half that shows nothing else; which points that are.
    pub(crate) fn mend(&self, settled: &mut [Option<Settled>]) -> Vec<bool> {
        let [least, usual] = usual_ratios(settled);
        let mut is_mended = vec![false; settled.len()];
        if least > NOISE_ALONE {
            // No residuals are those of noise alone, so none tell what is undisturbed.
            return is_mended;
        }
        let is_unusual = |point: &usize| match &settled[*point] {
            Some((Ok(found), _)) => !self.is_noise(found, usual, 1.0),
            _ => false,
        };
        let unusual: Vec<usize> = (0..settled.len()).filter(is_unusual).collect();
        let mended =
            map_in_parallel(unusual.len(), self.n_threads, |i| self.mended(unusual[i], settled, least));
        for (point, mended) in unusual.into_iter().zip(mended) {
            if let Some((found, shape)) = mended {
                settled[point] = Some((Ok(found), shape));
                is_mended[point] = true;
            }
        }
        is_mended
    }

    /// Whether the residuals of a share of a subset's pixels are no more than noise leaves.
    fn is_noise(&self, found: &Match, usual: f64, share: f64) -> bool {
        let n_pixels = share * (2 * self.pair.half_px + 1).pow(2) as f64;
        found.is_noise(usual, n_pixels)
    }

    /// The match of a point through whose subset something runs; `None` where nothing does.
    fn mended(&self, point: usize, settled: &[Option<Settled>], least: f64) -> Option<(Match, Shape)> {
        let Some((Ok(found), shape)) = &settled[point] else { return None };
        let guides = NORMALS.map(|normal| {
            [1.0, -1.0].map(|sign| self.guide(point, normal.map(|part| sign * part), settled, least))
        });
        // A shape function that fails everywhere fails for the field, and not for what runs through it.
        guides.iter().flatten().flatten().next()?;
        let of_half = if *shape == Shape::Quadratic { Shape::Affine } else { *shape };
        let subset = self.pair.prepare_with(self.places[point], of_half).ok()?;
        let own = Warp { curvature: [0.0; 6], ..found.warp() };
        let workspace = &mut Workspace::default();
        let pairs: Vec<[Half; 2]> = NORMALS
            .iter()
            .zip(&guides)
            .map(|(normal, [ahead, behind])| {
                [(1.0, ahead), (-1.0, behind)].map(|(sign, guide)| {
                    let side = normal.map(|part| sign * part);
                    self.half(&subset, side, own, guide.as_ref(), least, workspace)
                })
            })
            .collect();
        let right = pairs.iter().flat_map(|[a, b]| [(a, b), (b, a)]).filter_map(|(half, other)| {
            let undisturbed = half.found.filter(|_| half.is_clear && half.is_foretold)?;
            // What bends a subset along the line between its halves is in both.
            let is_other = other.found.is_none_or(|other| {
                let leaves_more = other.noise_ratio > MORE * undisturbed.noise_ratio;
                leaves_more || is_beyond_noise(&undisturbed, &other)
            });
            (is_other && is_beyond_noise(&undisturbed, found)).then_some(undisturbed)
        });
        if let Some(best) = right.min_by(|a, b| variance(a).total_cmp(&variance(b))) {
            return Some((Match { is_whole: false, ..best }, of_half));
        }
        let errors_px = pairs.iter().zip(&guides).map(|(halves, guides)| error_px(found, halves, guides));
        let most_px = errors_px.fold([0.0; 2], largest);
        // It may as well be that of either.
        (most_px[0].max(most_px[1]) > LEAST_STATED_PX).then(|| (found.with_error(most_px), *shape))
    }

    /// The half of a subset on one side of its centre, from where the whole one or a guide leads.
    fn half(
        &self,
        subset: &PreparedSubset,
        [x, y]: [f64; 2],
        own: Warp,
        guide: Option<&Guide>,
        least: f64,
        workspace: &mut Workspace,
    ) -> Half {
        let places = subset.columns.iter().zip(subset.rows.iter()).zip(subset.weights.iter());
        let is_in = |((column, row), weight): ((&f32, &f32), &f32)| {
            *weight > 0.0 && x * f64::from(*column) + y * f64::from(*row) >= 0.0
        };
        let pixels: Vec<bool> = places.take(subset.n_pixels()).map(is_in).collect();
        let Ok(half) = subset.only(&pixels) else {
            return Half { found: None, is_clear: false, is_foretold: false };
        };
        // What lies and is deformed as a neighbour foretells was not made to resemble anything.
        let by_chance = chance_zncc_by(0, &half, N_STARTS, RARE);
        let starts = [Some(own), guide.map(|guide| guide.warp)].into_iter().flatten();
        let found = starts
            .filter_map(|start| half.solve(self.pair.target, start, workspace).ok())
            .filter(|found| found.position.zncc >= by_chance)
            .min_by(|a, b| a.noise_ratio.total_cmp(&b.noise_ratio));
        Half {
            is_clear: found.as_ref().is_some_and(|found| self.is_noise(found, least, 0.5)),
            is_foretold: found.as_ref().zip(guide).is_some_and(|(found, guide)| guide.foretells(found)),
            found,
        }
    }

    /// What the undisturbed neighbour that lies straightest to one side, and as far away as the subset reaches, says of a point.
    fn guide(&self, point: usize, side: [f64; 2], settled: &[Option<Settled>], least: f64) -> Option<Guide> {
        let length = side[0].hypot(side[1]);
        let [x, y] = side.map(|part| part / length);
        let half_px = self.pair.half_px as f64;
        let offset_px = |other: usize| [0, 1].map(|axis| self.places[other][axis] - self.places[point][axis]);
        let straight = |other: &usize| {
            let [dx, dy] = offset_px(*other);
            let (along, across) = (x * dx + y * dy, (x * dy - y * dx).abs());
            let is_noise = match &settled[*other] {
                Some((Ok(found), _)) => found.is_whole && self.is_noise(found, least, 1.0),
                _ => false,
            };
            (along >= half_px && across <= 0.5 * half_px && is_noise).then_some(across + along)
        };
        let around = self.around(point, settled.len()).into_iter();
        let (other, _) = around
            .filter_map(|other| Some((other, straight(&other)?)))
            .min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let Some((Ok(found), _)) = &settled[other] else { return None };
        let away_px = offset_px(other).map(|offset| -offset);
        let flat = Warp { curvature: [0.0; 6], ..found.warp() };
        let of_gradient = self.pair.gradient_noise_at(away_px);
        let sigma_px = [found.position.x_px.sigma, found.position.y_px.sigma]
            .map(|sigma| sigma * 1.0_f64.hypot(of_gradient));
        Some(Guide { warp: Warp { position_px: flat.apply(away_px), ..flat }, sigma_px })
    }

    /// The points whose subsets share pixels with that of a point.
    fn around(&self, point: usize, n_points: usize) -> Vec<usize> {
        let n_columns = self.n_columns;
        let reach = 1 + (self.pair.half_px as f64 / self.step_px).ceil() as usize;
        let (column, row) = (point % n_columns, point / n_columns);
        let near = |place: usize, n: usize| place.saturating_sub(reach)..(place + reach + 1).min(n);
        let rows = near(row, n_points / n_columns);
        rows.flat_map(|row| near(column, n_columns).map(move |column| row * n_columns + column)).collect()
    }
}

impl Guide {
    /// How far a match is from where this leads, in pixels along x and y; 0 where noise explains it.
    fn away_px(&self, found: &Match) -> [f64; 2] {
        let there = found.warp().position_px;
        let is_there = self.foretells(found);
        [0, 1].map(|axis| if is_there { 0.0 } else { (there[axis] - self.warp.position_px[axis]).abs() })
    }

    /// Whether a match is where this leads.
    fn foretells(&self, found: &Match) -> bool {
        let sigmas = [found.position.x_px.sigma, found.position.y_px.sigma];
        let there = found.warp().position_px;
        (0..2).all(|axis| {
            let off = (there[axis] - self.warp.position_px[axis]).abs();
            off <= APART * self.sigma_px[axis].hypot(sigmas[axis])
        })
    }
}

/// What the residuals of a field's matches are over what noise explains: of the twentieth part that have least, which bends spare the longest, and of
/// the quarter.
fn usual_ratios(settled: &[Option<Settled>]) -> [f64; 2] {
    let ratio = |one: &Option<Settled>| {
        // What was left out of the others may be what a shape function leaves at the rim.
        let found = one.as_ref()?.0.as_ref().ok().filter(|found| found.is_whole)?;
        Some(found.noise_ratio)
    };
    let mut ratios: Vec<f64> = settled.iter().filter_map(ratio).filter(|ratio| ratio.is_finite()).collect();
    ratios.sort_by(f64::total_cmp);
    [20, 4].map(|part| ratios.get(ratios.len() / part).copied().unwrap_or(1.0).max(1.0))
}

/// The variance of a place, in square pixels.
fn variance(found: &Match) -> f64 {
    found.position.x_px.sigma.powi(2) + found.position.y_px.sigma.powi(2)
}

/// How far two places are apart along x and y, in pixels.
fn distance_px(a: &Match, b: &Match) -> [f64; 2] {
    let places = [a, b].map(|found| found.warp().position_px);
    [0, 1].map(|axis| (places[0][axis] - places[1][axis]).abs())
}

/// What a match may be off by, in pixels along x and y, where neither of a subset's halves is undisturbed: half as far as they see its centre apart. One that
/// shows it nowhere would have it where its neighbour leads; where both do, only that is known.
fn error_px(found: &Match, [a, b]: &[Half; 2], [ahead, behind]: &[Option<Guide>; 2]) -> [f64; 2] {
    let led =
        |guide: &Option<Guide>, found: &Match| guide.as_ref().map_or([0.0; 2], |guide| guide.away_px(found));
    let apart_px = match (&a.found, &b.found) {
        (Some(a), Some(b)) if is_beyond_noise(a, b) => distance_px(a, b),
        (Some(_), Some(_)) => [0.0; 2],
        (Some(a), None) => led(behind, a),
        (None, Some(b)) => led(ahead, b),
        (None, None) => return largest(led(ahead, found), led(behind, found)),
    };
    apart_px.map(|apart_px| 0.5 * apart_px)
}

/// The larger ones of two errors along x and y.
fn largest([x, y]: [f64; 2], [u, v]: [f64; 2]) -> [f64; 2] {
    [x.max(u), y.max(v)]
}

/// Whether two places are farther apart along an axis than noise explains.
fn is_beyond_noise(a: &Match, b: &Match) -> bool {
    let sigmas = [(a.position.x_px, b.position.x_px), (a.position.y_px, b.position.y_px)]
        .map(|(a, b)| a.sigma.hypot(b.sigma));
    distance_px(a, b).iter().zip(sigmas).any(|(apart, sigma)| *apart > APART * sigma)
}
