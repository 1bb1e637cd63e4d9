//! Noise that is alike in neighbouring pixels, as of pictures that were demosaiced, smoothed or compressed: what it does to all points of a field.
//!
//! Each match takes its residuals for independent ([`crate::uncertainty`]); [`Structure`] tells the variance by how alike they are, of one match to a
//! fifth, and of some all over the field to a few hundredths. It is asked of what the next shape function leaves, since what a shape function does not
//! follow is alike as well, and has a sigma of its own.

use chainwave_measurement::{Lost, median};

use crate::field::pair::{ImagePair, Settled};
use crate::icgn::outcome::Match;
use crate::structure::Structure;
use crate::track::alike::Left;
use crate::{PreparedSubset, Shape, Workspace};

/// Points that are asked, all over the field.
const ASKED: usize = 64;
/// Points from which on they tell it.
const LEAST: usize = 8;
/// Standard deviations that the median ratio is above 1 by chance.
const BY_CHANCE: f64 = 3.0;
/// Standard deviation of the median of many over that of their mean.
const OF_MEDIAN: f64 = 1.2533;
/// A point's sigma over the median of those asked, at most: what is more is no noise.
const LARGEST_NOISE: f64 = 2.0;

/// What one match tells.
struct Asked {
    /// Variance by structure over the stated one, along x and y.
    ratio: [f64; 2],
    /// Relative scatter of that, of white noise.
    scatter: [f64; 2],
    /// Standard uncertainty that is stated, in pixels.
    sigma_px: [f64; 2],
}

/// Widens the sigmas of all points where noise is alike in neighbouring pixels.
pub(crate) fn widen_alike(pair: &ImagePair<'_>, places: &[[f64; 2]], settled: &mut [Option<Settled>]) {
    let mut workspace = Workspace::default();
    let whole: Vec<usize> = (0..settled.len())
        .filter(|point| matches!(&settled[*point], Some((Ok(found), _)) if found.is_whole))
        .collect();
    let asked: Vec<Asked> = whole
        .iter()
        .step_by(whole.len().div_ceil(ASKED).max(1))
        .filter_map(|&point| match &settled[point] {
            Some((Ok(found), shape)) => Asked::of(pair, places[point], found, *shape, &mut workspace),
            _ => None,
        })
        .collect();
    if asked.len() < LEAST {
        return;
    }
    let middle = |of: &dyn Fn(&Asked) -> f64| median(asked.iter().map(of).collect()).unwrap_or(1.0);
    let n = asked.len() as f64;
    let [x, y] = [0, 1].map(|axis| {
        let ratio = middle(&|one| one.ratio[axis]);
        let chance = OF_MEDIAN * middle(&|one| one.scatter[axis]) / n.sqrt();
        let is_alike = ratio > 1.0 + BY_CHANCE * chance;
        let more = if is_alike { (ratio - 1.0).sqrt() } else { 0.0 };
        (more, LARGEST_NOISE * middle(&|one| one.sigma_px[axis]))
    });
    if x.0 <= 0.0 && y.0 <= 0.0 {
        return;
    }
    let error_px = |sigma_px: f64, (more, largest_px): (f64, f64)| more * sigma_px.min(largest_px);
    for found in settled.iter_mut().filter_map(|one| one.as_mut()?.0.as_mut().ok()) {
        let position = found.position;
        *found = found.with_error([error_px(position.x_px.sigma, x), error_px(position.y_px.sigma, y)]);
    }
}

impl Asked {
    fn of(
        pair: &ImagePair<'_>,
        place_px: [f64; 2],
        found: &Match,
        shape: Shape,
        workspace: &mut Workspace,
    ) -> Option<Self> {
        let warp = found.warp();
        let prepared = |shape: Shape| -> Result<PreparedSubset, Lost> { pair.prepare_with(place_px, shape) };
        let subset = prepared(shape).ok()?;
        let richer = prepared(shape.richer().first().copied().unwrap_or(shape)).ok()?;
        // The next one's match is a step from the subset's own.
        let (here, _) = richer.compare(pair.target, &warp, workspace)?;
        let left = Left::of(&richer, pair.target, &warp.compose_inverse(&here.step)?, workspace)?;
        if left.is_interpolated() {
            return None;
        }
        let structure = Structure::of(&subset, &richer);
        let variance_px2 = structure.variance_px2(&warp, &left.residuals, left.residual.gain);
        let sigma_px = [found.position.x_px.sigma, found.position.y_px.sigma];
        let ratio = [0, 1].map(|axis| variance_px2[axis] / sigma_px[axis].powi(2));
        ratio.iter().all(|ratio| ratio.is_finite()).then_some(Self {
            ratio,
            scatter: structure.scatter,
            sigma_px,
        })
    }
}
