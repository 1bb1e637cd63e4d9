//! A subset of which something covers a part, seen by the rest.
//!
//! What covers a part pulls a match of the whole to where both fit least badly: by pixels where it is half, with residuals that say little of
//! it. Outliers by a robust scale tell it where it is small and unlike ([`crate::icgn::visible`]), and no scale is robust where half of the
//! pixels are outliers (P. J. Rousseeuw, J. Am. Stat. Assoc. 79 (1984) 871-880): there fits to few pixels are tried, and the one that most
//! agrees with is taken. Here what covers and what is covered are each in one piece, so that the few pixels are halves and thirds of the
//! subset: one that shows noise alone, and that evenly, is right, and grows by all pixels around it that its match explains.
//!
//! It is looked for only where residuals are twice what noise explains, or more than that on one side than on the other, and not again where
//! it was in vain: what a texture that has changed, more light, or the shape function leaves is all over the subset, and in all frames.

use chainwave_measurement::{Lost, Position};

use crate::icgn::outcome::Match;
use crate::icgn::visible::smooth_share;
use crate::reference::mask::{INVALID_MARGIN_PX, dilated};
use crate::search::chance::{RARE, chance_zncc};
use crate::warp::{Warp, distance_px};
use crate::{PreparedSubset, Window, Workspace};

/// Residuals over what noise explains that are looked into in any case.
const LARGE_NOISE_RATIO: f64 = 2.0;
/// The same up to which they may be those of a frame with more noise than the reference's, such as of four times the light.
const NOISIER: f64 = 6.0;
/// Mean squares of one third of a subset over those of another that no texture makes.
const UNEVEN: f64 = 2.0;
/// Standard errors of a mean square of noise besides.
const BEYOND_NOISE: f64 = 3.0;
/// Pixels of a third from which on its mean square is one.
const LEAST_PIXELS: f64 = 30.0;
/// How much less the residuals of the part that is seen are than those of the whole.
const LEAST_IMPROVEMENT: f64 = 1.2;
/// Times that residuals may be larger or smaller than others, and are as large.
const SAME_RATIO: f64 = 1.5;
/// Starts that a part is matched from, by two: the number of places that chance has.
const N_STARTS: f64 = 2.0;
/// Distance of two starts that are the same.
const SAME_PX: f64 = 0.2;
/// Standard deviations of a pixel, and of the mean square of its 5 x 5 neighbours, beyond which it does not show the subset.
const OUTLIER_SIGMAS: f64 = 4.0;
/// Half of the window of that mean square.
const AROUND_PX: usize = 2;
/// Of the parts, eight halves and as many thirds, those that see the whole subset's place, where that shows more than noise: a half of it is
/// seen by as many.
const LEAST_AGREEING: usize = 6;
/// Times that a part grows: it settles in three.
const ROUNDS: usize = 4;
/// Where parts of the subset begin along their normals, in its half widths: halves first, then thirds.
const FROM: [f64; 2] = [0.0, 1.0 / 3.0];
/// Normals of the lines that part a subset: along x, along y, and along both diagonals.
const NORMALS: [[f64; 2]; 4] = [[1.0, 0.0], [0.0, 1.0], [0.5, 0.5], [0.5, -0.5]];

/// What the parts of a subset were asked in the frames before.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    /// Residuals of the last match of which the parts told nothing new, over what noise explains.
    in_vain: f64,
}

impl Parts {
    /// Whether a match where the subset was expected, or a loss, may be due to what hides a part of it. Of residuals as large as those of
    /// which the parts told nothing, they are not asked again.
    pub(crate) fn are_asked(&self, subset: &PreparedSubset, found: &Result<Match, Lost>) -> bool {
        match found {
            Ok(found) if found.is_noise(1.0, subset.n_used as f64) => false,
            Ok(found) => {
                let ratio = found.noise_ratio / self.in_vain;
                !found.is_whole || !(1.0 / SAME_RATIO..SAME_RATIO).contains(&ratio)
            }
            Err(reason) => matches!(reason, Lost::LowCorrelation | Lost::NotConverged),
        }
    }

    /// What was found of a subset where it was expected, mended where a part of it is hidden.
    ///
    /// A match that residuals contradict, and whose parts do not tell which of them is right, is as uncertain as they differ; one that most
    /// of them do not see, and that leaves a texture, is none.
    pub(crate) fn seen(
        &mut self,
        subset: &PreparedSubset,
        window: &Window,
        start: Warp,
        found: Result<Match, Lost>,
        workspace: &mut Workspace,
    ) -> Result<Match, Lost> {
        let mut scene = Scene { subset, window, workspace };
        if !subset.fits(window, &start) || found.as_ref().is_ok_and(|found| scene.is_clearly_whole(found)) {
            return found;
        }
        let in_part = scene.seen_in_part(start, found);
        self.in_vain = match (&found, &in_part) {
            (Ok(found), Ok(in_part)) if found == in_part => found.noise_ratio,
            _ => self.in_vain,
        };
        in_part
    }
}

/// A part of a subset, and its match.
struct Seed {
    part: PreparedSubset,
    found: Match,
    /// Whether it shows noise alone.
    is_clear: bool,
}

/// A subset in a frame.
struct Scene<'a> {
    subset: &'a PreparedSubset,
    window: &'a Window,
    workspace: &'a mut Workspace,
}

impl Scene<'_> {
    /// Whether a match leaves little, and on all sides as much.
    fn is_clearly_whole(&mut self, found: &Match) -> bool {
        let is_little = found.is_whole && found.noise_ratio <= LARGE_NOISE_RATIO;
        is_little && is_even(self.subset, self.window, &found.warp(), self.workspace)
    }

    /// The match of what the frame shows of the subset, by those of its parts from a start and from where the whole was found.
    fn seen_in_part(&mut self, start: Warp, found: Result<Match, Lost>) -> Result<Match, Lost> {
        let at_found =
            found.as_ref().ok().map(Match::warp).filter(|warp| distance_px(warp, &start) > SAME_PX);
        let starts: Vec<Warp> = [Some(start), at_found].into_iter().flatten().collect();
        let mut others = Vec::new();
        for from in FROM {
            let mut seeds = self.seeds(from, &starts);
            seeds.sort_by(|a, b| a.found.noise_ratio.total_cmp(&b.found.noise_ratio));
            let mended = seeds.iter().filter(|seed| seed.is_clear).find_map(|seed| self.grown(seed));
            if let Some(mended) = mended.filter(|mended| is_less(mended, &found)) {
                return Ok(mended);
            }
            others.extend(seeds.into_iter().map(|seed| seed.found));
        }
        let found = found?;
        if self.subset.settings.surfaces_bend {
            return Ok(found);
        }
        let is_there = |other: &&Match| apart_px(&found, other).iter().all(|apart_px| *apart_px <= 0.0);
        let n_agreeing = others.iter().filter(is_there).count();
        match n_agreeing >= LEAST_AGREEING || !self.shows_something_else(&found) {
            true => Ok(with_differences(found, &others)),
            false => Err(Lost::LowCorrelation),
        }
    }

    /// The parts on each side that resemble the frame more than chance allows.
    fn seeds(&mut self, from: f64, starts: &[Warp]) -> Vec<Seed> {
        let mut seeds = Vec::new();
        for normal in NORMALS {
            let sides = [1.0, -1.0].map(|sign| self.seed(normal.map(|part| sign * part), from, starts));
            let clear = sides.each_ref().map(|side| side.as_ref().is_some_and(|seed| seed.is_clear));
            // Where a surface bends, each side by itself is explained better than both.
            let is_bend = self.subset.settings.surfaces_bend && clear == [true; 2];
            seeds.extend(
                sides.into_iter().flatten().map(|seed| Seed { is_clear: seed.is_clear && !is_bend, ..seed }),
            );
        }
        seeds
    }

    fn seed(&mut self, side: [f64; 2], from: f64, starts: &[Warp]) -> Option<Seed> {
        let beyond = |at: f64| at >= from;
        let pixels: Vec<bool> = along(self.subset, side).map(beyond).collect();
        let part = self.subset.masked(&pixels).ok()?;
        let by_chance = chance_zncc(&part, N_STARTS, RARE);
        let matches = starts.iter().filter_map(|start| {
            part.solve(self.window, *start, self.workspace)
                .ok()
                .filter(|found| found.position.zncc >= by_chance)
        });
        let found = matches.min_by(|a, b| a.noise_ratio.total_cmp(&b.noise_ratio))?;
        let is_clear =
            found.noise_ratio < NOISIER && is_even(&part, self.window, &found.warp(), self.workspace);
        Some(Seed { part, found, is_clear })
    }

    /// Whether more of what a match leaves is as smooth as a texture than is noise.
    fn shows_something_else(&mut self, found: &Match) -> bool {
        let seen =
            if found.is_whole { None } else { self.subset.visible_at(self.window, found, self.workspace) };
        let part = seen.and_then(|seen| self.subset.only(&seen).ok());
        let part = part.as_ref().unwrap_or(self.subset);
        let Some((compared, _)) = part.compare(self.window, &found.warp(), self.workspace) else {
            return false;
        };
        smooth_share(part, part.residuals(&compared, self.workspace)) * found.noise_ratio > 1.0
    }

    /// The match of all pixels that that of a part explains, and then that of those, until they stay the same.
    fn grown(&mut self, seed: &Seed) -> Option<Match> {
        let (mut part, mut found) = (None::<PreparedSubset>, seed.found);
        let mut seen: Vec<bool> = Vec::new();
        for _ in 0..ROUNDS {
            let explained = self.explained(part.as_ref().unwrap_or(&seed.part), &found.warp())?;
            if explained == seen {
                break;
            }
            let next = self.subset.only(&explained).ok()?;
            found = next.solve(self.window, found.warp(), self.workspace).ok()?;
            (part, seen) = (Some(next), explained);
        }
        let part = part?;
        let is_right = found.noise_ratio < NOISIER
            && found.position.zncc >= chance_zncc(&part, N_STARTS, RARE)
            && is_even(&part, self.window, &found.warp(), self.workspace);
        let found = self.subset.in_part(found, &part);
        let is_noise = found.is_noise(1.0, part.n_used as f64);
        let stated = if is_noise { found } else { with_differences(found, &[seed.found]) };
        is_right.then_some(stated)
    }

    /// The pixels of the subset that show what the match of a part lets expect, by the residuals of the part.
    fn explained(&mut self, part: &PreparedSubset, warp: &Warp) -> Option<Vec<bool>> {
        let Self { subset, window, workspace } = self;
        if !subset.fits(window, warp) {
            return None;
        }
        let of_part = part.evaluate(window, warp, workspace)?;
        let own = part.residuals(&of_part, workspace);
        let variance = own.iter().map(|residual| residual.powi(2)).sum::<f64>() / part.n_used as f64;
        subset.sample_at(window, warp, workspace);
        let offset = subset.mean - part.mean;
        let pixels = workspace.samples.iter().zip(&subset.intensity).zip(subset.weights.iter());
        let squares: Vec<f64> = pixels
            .take(subset.n_pixels())
            .map(|((g, f), weight)| {
                let expected = of_part.mean + of_part.gain * (f64::from(*f) + offset);
                f64::from(*weight) * (f64::from(*g) - expected).powi(2) / variance
            })
            .collect();
        let means = means_around(&squares, &subset.weights, subset.width);
        let outliers: Vec<bool> = squares.iter().map(|square| *square > OUTLIER_SIGMAS.powi(2)).collect();
        let near = dilated(subset.width, &outliers, INVALID_MARGIN_PX);
        let hidden = means.into_iter().zip(near).map(|(mean, near)| near || mean > 1.0);
        Some(hidden.zip(subset.weights.iter()).map(|(hidden, weight)| !hidden && *weight > 0.0).collect())
    }
}

/// Mean squares around each pixel, of so many pixels as are used there, over the largest that noise of variance 1 leaves.
fn means_around(squares: &[f64], weights: &[f32], width: usize) -> Vec<f64> {
    let height = squares.len() / width;
    let around = |at: usize, n: usize| at.saturating_sub(AROUND_PX)..(at + AROUND_PX + 1).min(n);
    let mean = |i: usize| {
        let (column, row) = (i % width, i / width);
        let (mut sum, mut n) = (0.0, 0.0);
        for y in around(row, height) {
            for at in around(column, width).map(|x| y * width + x) {
                sum += squares[at];
                n += f64::from(weights[at]);
            }
        }
        sum / (n + OUTLIER_SIGMAS * (2.0_f64 * n).sqrt())
    };
    (0..squares.len()).map(mean).collect()
}

/// Where each pixel of a subset lies along a normal, in half widths.
fn along(subset: &PreparedSubset, [x, y]: [f64; 2]) -> impl Iterator<Item = f64> {
    let [half_x, half_y] = subset.half_px();
    let places = subset.columns.iter().zip(subset.rows.iter()).take(subset.n_pixels());
    places.map(move |(column, row)| x * f64::from(*column) / half_x + y * f64::from(*row) / half_y)
}

/// Whether the residuals of the thirds of a subset, along each normal, are alike.
fn is_even(part: &PreparedSubset, window: &Window, warp: &Warp, workspace: &mut Workspace) -> bool {
    if !part.fits(window, warp) {
        return true;
    }
    let Some(found) = part.evaluate(window, warp, workspace) else { return true };
    let residuals = part.residuals(&found, workspace);
    NORMALS.iter().all(|normal| {
        let mut thirds = [(0.0, 0.0); 3];
        for ((at, residual), weight) in along(part, *normal).zip(&residuals).zip(part.weights.iter()) {
            let (n, sum) = &mut thirds[((1.5 * (at + 1.0)) as usize).min(2)];
            *n += f64::from(*weight);
            *sum += residual.powi(2);
        }
        let means = thirds.iter().filter(|(n, _)| *n >= LEAST_PIXELS).map(|(n, sum)| (sum / n, *n));
        let low = means.clone().min_by(|a, b| a.0.total_cmp(&b.0));
        let high = means.max_by(|a, b| a.0.total_cmp(&b.0));
        low.zip(high).is_none_or(|((low, n_low), (high, n_high))| {
            let by_noise = BEYOND_NOISE * (2.0 / n_low + 2.0 / n_high).sqrt();
            high <= UNEVEN * (1.0 + by_noise) * low
        })
    })
}

/// Whether a match of a part leaves so much less than that of the whole that the part alone is believed.
fn is_less(mended: &Match, found: &Result<Match, Lost>) -> bool {
    found.as_ref().map_or(true, |found| LEAST_IMPROVEMENT * mended.noise_ratio < found.noise_ratio)
}

/// How far two matches are apart along x and y, 0 where the noise of the second explains it.
fn apart_px(found: &Match, other: &Match) -> [f64; 2] {
    let own = found.warp().position_px;
    let Position { x_px, y_px, .. } = other.position;
    std::array::from_fn(|axis| {
        let there = [x_px, y_px][axis];
        let apart_px = (there.value - own[axis]).abs();
        if apart_px > BEYOND_NOISE * there.sigma { apart_px } else { 0.0 }
    })
}

/// A match with the farthest that parts of the subset see it elsewhere in its sigmas.
fn with_differences(found: Match, others: &[Match]) -> Match {
    let apart = others.iter().map(|other| apart_px(&found, other));
    found.with_error(apart.fold([0.0_f64; 2], |[x, y], [u, v]| [x.max(u), y.max(v)]))
}
