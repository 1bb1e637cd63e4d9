//! What a shape function leaves of surfaces that bend, or of those that turn and stretch where it only shifts: taken off tracks as far as it is known,
//! and stated.
//!
//! In each frame one more step, or where that is long a whole match, with the next shape function (the quadratic one after the affine, of which is
//! spoken here; the affine one after a translation or a rotation) tells the difference d of its place from the subset's own. Its noise is that of the quadratic place less that of the affine one, `v = var q - var a`, and independent of the latter, which
//! is the more efficient of the two (J. A. Hausman, Econometrica 46 (1978) 1251-1271). Of a subset of 33 x 33 px v is three times `var a`: a test
//! whether d is real misses bends that are as large as sigma, and so nothing is tested here. The bend b of a reading is taken for one of
//! many, of variance t^2, and of these all readings of the film near in time tell:
//!
//! - Where `w = v/(v + t^2)` is known, b is `(1 - w) d` with the variance `(1 - w) v`.
//! - How likely each t is follows from the d of all readings, with a prior that is flat in ln t from a thirtieth of the noise of d up: bends of any
//!   size are as likely, and those that drown in the noise too (the scale is open, as in W. E. Strawderman, Ann. Math. Stat. 42 (1971) 385-388,
//!   whose prior, flat in ln w, holds hardly any surface for flat). Where few readings tell it, some of the noise of d stays in sigma: it is not
//!   known that the surface does not bend.
//! - Readings of one subset in several frames share the noise of their reference, half of that of d, so T of them tell a variance no better than
//!   `4 T/(T + 3)` independent ones.
//! - A quadratic subset misses the fourth order of a wave. How long the wave is, is told by its bends over its slopes ([`fourth`]); what follows
//!   is taken off too, and half of it stated.
//! - A subset whose d stands out of all others by four standard deviations is told by its own readings.

use chainwave_measurement::{Estimate, Position, Subset};

use crate::icgn::outcome::Match;
use crate::track::matcher::Matcher;
use crate::uncertainty::sigma_px;
use crate::{PreparedSubset, Shape};

/// How far the next shape function finds the centre from where the subset's own one does, in pixels, with its variance, along x and y: infinite where it
/// finds none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bend {
    pub(crate) difference_px: [f64; 2],
    pub(crate) variance: [f64; 2],
    /// Displacement gradient of the subset's own match: du/dx, du/dy, dv/dx, dv/dy.
    pub(crate) gradient: [f64; 4],
}

/// Frames before and after one whose readings tell how large bends are in it.
const NEAR_FRAMES: usize = 2;
/// Standard deviations by which a subset that is not of the others' kind stands out: 6 of 10^5 do by chance.
const OUTSTANDING: f64 = 4.0;
/// Share of the fall in the sum of squares that goes with a bend where steps are long, below which the richer match is a false one: what ends anywhere
/// in noise has next to none of it, and bends of waves have all.
const LEAST_FALL: f64 = 0.25;
/// Pixels by which a step moves a subset's rim from which on it is not the whole of a turn or a stretch: well below the speckles of any texture.
const TURNED_PX: f64 = 0.25;
/// Least variance of a difference over that of the affine place: what two matches of one texture differ by through rounding.
const LEAST_VARIANCE: f64 = 0.05;
/// Share of the fourth order that textures and odd orders leave open.
const FOURTH_KNOWN_TO: f64 = 0.5;
/// Subsets, spread over all, that tell how large bends are: they tell a variance to a tenth, and more take longer than they are tracked in.
const MOST_SUBSETS: usize = 200;
/// Subsets whose slopes tell a wave's length: the scatter of fewer may be a crest's alone.
const LEAST_SUBSETS: usize = 4;
/// Its largest share of a bend that is believed: that of a wave of one and a quarter subsets' length.
const LARGEST_FOURTH: f64 = 0.15;

impl Bend {
    /// The bend that the richer subset shows at the own one's match, which the matcher's window shows, where that saw it.
    pub(crate) fn of(
        [own, richer]: [&PreparedSubset; 2],
        matcher: &mut Matcher<'_>,
        frame: usize,
        found: &Match,
    ) -> Self {
        let shown = match found.is_whole {
            true => Self::of_seen([own, richer], matcher, frame, found),
            false => Self::of_whole(richer, matcher, frame, found).or_else(|| {
                matcher.have_window(own, frame, &found.warp()).ok()?;
                own.visible_at(&matcher.window, found, &mut matcher.workspace).and_then(|visible| {
                    let [own, richer] = [own.only(&visible).ok()?, richer.only(&visible).ok()?];
                    Self::of_seen([&own, &richer], matcher, frame, found)
                })
            }),
        };
        let untold = || Self {
            difference_px: [0.0; 2],
            variance: [f64::INFINITY; 2],
            gradient: found.warp().gradient,
        };
        shown.unwrap_or_else(untold)
    }

    /// Where the whole of the richer subset is matched, and left no more than what the own one matched of itself: what that left out was turned or bent
    /// away, and not hidden.
    fn of_whole(
        richer: &PreparedSubset,
        matcher: &mut Matcher<'_>,
        frame: usize,
        found: &Match,
    ) -> Option<Self> {
        let whole = matcher.match_from(richer, frame, found.warp()).ok()?;
        let [own, richer] = [found, &whole].map(|found| [found.position.x_px, found.position.y_px]);
        (whole.is_whole && whole.noise_ratio <= found.noise_ratio).then(|| Self {
            difference_px: [0, 1].map(|axis| richer[axis].value - own[axis].value),
            variance: [0, 1].map(|axis| richer[axis].sigma.powi(2)),
            gradient: found.gradient,
        })
    }

    /// `None` where the richer subset is not found, or elsewhere than the own one.
    fn of_seen(
        [own, richer]: [&PreparedSubset; 2],
        matcher: &mut Matcher<'_>,
        frame: usize,
        found: &Match,
    ) -> Option<Self> {
        let (warp, place) = (found.warp(), &found.position);
        let (compared, residual) = richer.compare(&matcher.window, &warp, &mut matcher.workspace)?;
        let stepped = warp.compose_inverse(&compared.step)?;
        let places = [place.x_px.value, place.y_px.value];
        let away = |[x, y]: [f64; 2]| [x - places[0], y - places[1]];
        let of_own = sigma_px(own, &warp, &residual);
        let variance = |whole: [f64; 2]| {
            [0, 1].map(|axis| {
                let least = LEAST_VARIANCE * of_own[axis].powi(2);
                (whole[axis].powi(2) - of_own[axis].powi(2)).max(least)
            })
        };
        let bend = Self {
            difference_px: away(richer.without_bias(&stepped, &residual.of_interpolation)),
            variance: variance(sigma_px(richer, &warp, &residual)),
            gradient: warp.gradient,
        };
        let is_long = (0..2).any(|axis| bend.difference_px[axis].powi(2) > 9.0 * bend.variance[axis]);
        // By as much of a turn or a stretch the residual is its, and hides how long the step is.
        let half_px = richer.half_px();
        let at_rim_px = |k: usize| (stepped.gradient[k] - warp.gradient[k]).abs() * half_px[k % 2];
        let is_wide = (0..4).any(|k| at_rim_px(k) > TURNED_PX);
        if !is_long && !is_wide {
            return Some(bend);
        }
        // A long step is not the whole of it, and what it leaves is no noise.
        let whole = matcher.match_whole_from(richer, frame, stepped).ok()?;
        let Position { x_px, y_px, zncc, .. } = whole.position;
        let ratio =
            [0, 1].map(|axis| variance(sigma_px(richer, &warp, &residual))[axis] / of_own[axis].powi(2));
        let of_whole = [x_px, y_px].map(|estimate| estimate.sigma.powi(2));
        let bend = Self {
            difference_px: away([x_px.value, y_px.value]),
            variance: [0, 1].map(|axis| of_whole[axis] * ratio[axis] / (1.0 + ratio[axis])),
            gradient: warp.gradient,
        };
        let fall = richer.n_used as f64 * ((1.0 - place.zncc.powi(2)) / (1.0 - zncc.powi(2)) - 1.0);
        (bend.least_fall() * LEAST_FALL <= fall).then_some(bend)
    }

    /// What the sum of squares over the noise falls by at least where the richer place is as far from the own one as this: a model that has the other
    /// one in it explains as much more as its place is unlikely to be the other's.
    fn least_fall(&self) -> f64 {
        let fall = |axis: usize| self.difference_px[axis].powi(2) / self.variance[axis];
        fall(0).max(fall(1))
    }

    /// Whether it tells anything.
    fn is_told(&self) -> bool {
        self.variance.iter().all(|variance| variance.is_finite())
    }
}

/// What is known of a reading's bend along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BendEstimate {
    /// Expected bend with its standard uncertainty, in pixels: what the affine place lacks, but for the fourth order.
    bend: Estimate,
    /// What the quadratic place lacks of the fourth order, over the bend.
    fourth: f64,
    /// Whether so many subsets tell it that it is taken off; by fewer it is stated alone.
    is_fourth_known: bool,
}

impl BendEstimate {
    /// The affine place with the bend, and what is not known of it in sigma.
    pub(crate) fn with_bend(&self, place: Estimate) -> Estimate {
        let bent = Estimate::new(place.value + self.bend.value, place.sigma.hypot(self.bend.sigma));
        self.with_fourth(bent)
    }

    /// The quadratic place with the fourth order.
    pub(crate) fn with_fourth(&self, place: Estimate) -> Estimate {
        let size_px = self.fourth * self.bend.value.hypot(self.bend.sigma);
        match self.is_fourth_known {
            true => Estimate::new(
                place.value + self.fourth * self.bend.value,
                place.sigma.hypot(FOURTH_KNOWN_TO * size_px),
            ),
            false => Estimate::new(place.value, place.sigma.hypot(size_px)),
        }
    }
}

/// What is known of the bends of some subsets, frame by frame, along x and y.
pub(crate) type AllBends = Vec<Vec<[Option<BendEstimate>; 2]>>;

/// What the bends of all subsets of a film, which were followed with a shape function, tell frame by frame of each of them.
pub(crate) fn tell(bends: &[Vec<Option<Bend>>], subsets: &[Subset], shape: Shape) -> AllBends {
    let n_frames = bends.first().map_or(0, Vec::len);
    let mut told: AllBends = vec![vec![[None; 2]; n_frames]; bends.len()];
    for frame in 0..n_frames {
        let near = frame.saturating_sub(NEAR_FRAMES)..(frame + NEAR_FRAMES + 1).min(n_frames);
        let near: Vec<Vec<Bend>> = bends
            .iter()
            .map(|of_subset| {
                of_subset[near.clone()].iter().flatten().filter(|bend| bend.is_told()).copied().collect()
            })
            .collect();
        let n_subsets = near.iter().filter(|bends| !bends.is_empty()).count();
        for axis in [0, 1] {
            let reading = |bend: &Bend| [bend.difference_px[axis], bend.variance[axis]];
            let readings: Vec<Vec<[f64; 2]>> =
                near.iter().map(|bends| bends.iter().map(reading).collect()).collect();
            let spread_out: Vec<Vec<[f64; 2]>> =
                readings.iter().step_by(readings.len().div_ceil(MOST_SUBSETS).max(1)).cloned().collect();
            let all = Sizes::of(&spread_out);
            let slope = mean_square_slope(&near, axis);
            for (subset, of_subset) in bends.iter().enumerate() {
                let Some(own) = of_subset[frame].as_ref().map(reading) else { continue };
                let stands_out = own[0].powi(2) > OUTSTANDING.powi(2) * (own[1] + all.mean);
                let apart = stands_out.then(|| Sizes::of(&readings[subset..=subset]));
                let sizes = apart.as_ref().unwrap_or(&all);
                // A subset that is shifted or turned lacks what the affine one has of the second order, and little besides.
                let fourth = match shape {
                    Shape::Affine => fourth(sizes.mean, slope, &subsets[subset]),
                    _ => 0.0,
                };
                let is_fourth_known = n_subsets >= LEAST_SUBSETS;
                told[subset][frame][axis] =
                    Some(BendEstimate { bend: sizes.bend(own), fourth, is_fourth_known });
            }
        }
    }
    told
}

/// Mean square of the slopes of a displacement, less their mean over the subsets where there are several: rigid turns bend nothing.
fn mean_square_slope(near: &[Vec<Bend>], axis: usize) -> f64 {
    let slopes: Vec<[f64; 2]> = near
        .iter()
        .flatten()
        .map(|Bend { gradient, .. }| [gradient[2 * axis], gradient[2 * axis + 1]])
        .collect();
    let n = slopes.len().max(1) as f64;
    let n_subsets = near.iter().filter(|bends| !bends.is_empty()).count();
    let mean = |of: fn(&[f64; 2]) -> f64| -> f64 {
        if n_subsets > 1 { slopes.iter().map(of).sum::<f64>() / n } else { 0.0 }
    };
    let [x, y] = [mean(|slope| slope[0]), mean(|slope| slope[1])];
    slopes.iter().map(|slope| (slope[0] - x).powi(2) + (slope[1] - y).powi(2)).sum::<f64>() / n
}

/// What a quadratic subset misses of a wave of bends and slopes of these mean squares, over what an affine one does.
///
/// Of a wave of k per pixel, seen evenly over a half width h, an affine subset misses `(kh)^2/6`, and a quadratic one, whose weights
/// `(3/8)(3 - 5 x^2)` have the fourth moment -3/35, `(kh)^4/280`. Bend over slope is `k h^2/6`, which tells k.
fn fourth(mean_square_bend: f64, mean_square_slope: f64, subset: &Subset) -> f64 {
    let [width, height] = [subset.half_width_px, subset.half_height_px].map(|half| half as f64 + 0.5);
    let half_square = 0.5 * (width * width + height * height);
    let phase_square = 36.0 * mean_square_bend / (mean_square_slope * half_square);
    let share = 6.0 / 280.0 * phase_square;
    if share.is_finite() { share.min(LARGEST_FOURTH) } else { 0.0 }
}

/// Steps in which t^2 grows by a factor of ten, and factors of ten, from a small part of the noise on.
const STEPS: (usize, usize) = (8, 9);
const N_SIZES: usize = STEPS.0 * STEPS.1;
/// The least t^2 over the noise.
const LEAST: f64 = 1e-3;

/// Logarithms of how likely the differences and variances of the readings of each subset are, by the variance of bends.
///
/// Logarithms are taken of products. A variance over the mean noise is at most that of the largest size, 10^6, and the number of readings, so that
/// 40 of them do not overflow.
fn log_likelihoods(subsets: &[&[[f64; 2]]], noise: f64, sizes: &[f64; N_SIZES]) -> [f64; N_SIZES] {
    const IN_A_PRODUCT: usize = 40;
    let mut logs = [0.0; N_SIZES];
    let most = subsets.iter().map(|readings| readings.len()).max().unwrap_or(0);
    for n_readings in 1..=most {
        let alike = subsets.iter().filter(|readings| readings.len() == n_readings);
        let readings: Vec<[f64; 2]> = alike.flat_map(|readings| readings.iter().copied()).collect();
        let share = 4.0 / (n_readings as f64 + 3.0);
        for part in readings.chunks(IN_A_PRODUCT) {
            let (mut squares, mut products) = ([0.0; N_SIZES], [1.0; N_SIZES]);
            for [d, v] in part {
                for ((size, square), product) in sizes.iter().zip(&mut squares).zip(&mut products) {
                    let variance = v + size;
                    *square += d * d / variance;
                    *product *= variance / noise;
                }
            }
            for ((log, square), product) in logs.iter_mut().zip(squares).zip(products) {
                *log -= 0.5 * share * (square + product.ln());
            }
        }
    }
    logs
}

/// How likely each variance of bends is by what some readings show.
struct Sizes {
    /// Variance in square pixels, and its probability.
    likely: Vec<[f64; 2]>,
    /// A middle one, by which outliers are told.
    mean: f64,
}

impl Sizes {
    /// From the differences and variances of the readings of each subset.
    fn of(subsets: &[Vec<[f64; 2]>]) -> Self {
        let subsets: Vec<&[[f64; 2]]> =
            subsets.iter().filter(|readings| !readings.is_empty()).map(Vec::as_slice).collect();
        let n = subsets.iter().map(|readings| readings.len()).sum::<usize>() as f64;
        let noise = subsets.iter().flat_map(|readings| readings.iter()).map(|[_, v]| v).sum::<f64>() / n;
        if !(noise > 0.0 && noise.is_finite()) {
            return Self { likely: vec![[0.0, 1.0]], mean: 0.0 };
        }
        let mut sizes = [0.0; N_SIZES];
        let step = |step: usize| noise * LEAST * 10.0_f64.powf((step as f64 + 0.5) / STEPS.0 as f64);
        sizes.iter_mut().enumerate().for_each(|(index, size)| *size = step(index));
        let logs = log_likelihoods(&subsets, noise, &sizes);
        let steps: Vec<[f64; 2]> = sizes.iter().zip(logs).map(|(&size, log)| [size, log]).collect();
        let best = steps.iter().map(|[_, log]| *log).fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<[f64; 2]> = steps.iter().map(|[size, log]| [*size, (log - best).exp()]).collect();
        let total: f64 = weights.iter().map(|[_, weight]| weight).sum();
        let likely: Vec<[f64; 2]> = weights.iter().map(|[size, weight]| [*size, weight / total]).collect();
        let precision: f64 = likely.iter().map(|[size, p]| p / (noise + size)).sum();
        Self { likely, mean: (1.0 / precision - noise).max(0.0) }
    }

    /// The bend that a difference with its variance shows.
    fn bend(&self, [d, v]: [f64; 2]) -> Estimate {
        if v.is_infinite() {
            let mean_square = self.likely.iter().map(|[size, p]| p * size).sum::<f64>();
            return Estimate::new(0.0, mean_square.sqrt());
        }
        let mean = |of: &dyn Fn(f64) -> f64| -> f64 {
            self.likely.iter().map(|[size, p]| p * of(size / (v + size))).sum()
        };
        let share = mean(&|share| share);
        let spread = mean(&|one| (one - share).powi(2));
        Estimate::new(share * d, (share * v + spread * d * d).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Differences that are spread as a normal distribution of a standard deviation, by its quantiles at equal steps.
    fn spread(n: usize, deviation: f64, variance: f64) -> Vec<Vec<[f64; 2]>> {
        let quantile = |k: usize| {
            // R. E. Odeh, J. O. Evans give more digits; a logistic distribution of the same variance has enough.
            let p = (k as f64 + 0.5) / n as f64;
            deviation * 3.0_f64.sqrt() / std::f64::consts::PI * (p / (1.0 - p)).ln()
        };
        (0..n).map(|k| vec![[quantile(k), variance]]).collect()
    }

    #[test]
    fn many_readings_tell_how_much_of_a_difference_is_a_bend() {
        let variance = 4e-6;
        for ratio in [1.0_f64, 9.0, 1e4] {
            let found = Sizes::of(&spread(2000, (variance * (1.0 + ratio)).sqrt(), variance));
            let bend = found.bend([0.01, variance]);
            let share = ratio / (1.0 + ratio);
            // 2000 readings tell a variance to 3 %, and the grid's steps are of 15 %.
            assert!((bend.value / (share * 0.01) - 1.0).abs() < 0.06, "{ratio}: {}", bend.value);
            assert!((bend.sigma / (share * variance).sqrt() - 1.0).abs() < 0.1, "{ratio}: {}", bend.sigma);
        }
        let none = Sizes::of(&spread(2000, variance.sqrt(), variance)).bend([0.002, variance]);
        assert!(none.value < 0.1 * 0.002 && none.sigma < 0.3 * variance.sqrt(), "{none:?}");
    }

    #[test]
    fn a_single_reading_leaves_open_how_large_bends_are() {
        let of_one = |difference: f64| Sizes::of(&[vec![[difference, 1.0]]]).bend([difference, 1.0]);
        let (small, large) = (of_one(0.0), of_one(30.0));
        assert!(small.value.abs() < 1e-12 && (0.3..0.9).contains(&small.sigma), "{small:?}");
        assert!((large.value / 30.0 - 1.0).abs() < 0.01 && (0.95..1.1).contains(&large.sigma), "{large:?}");
    }

    #[test]
    fn without_a_reading_nothing_is_known_and_nothing_is_taken() {
        let bend = Sizes::of(&[Vec::new()]).bend([0.5, 1.0]);
        assert_eq!((bend.value, bend.sigma), (0.0, 0.0));
    }

    #[test]
    fn the_fourth_order_is_that_of_the_wave_that_bends_and_slopes_have() {
        let subset = Subset::new("", 0.0, 0.0, 16, 16);
        let (k, half): (f64, f64) = (std::f64::consts::TAU / 100.0, 16.5);
        // amplitude 1: mean squares of a sine are a half
        let bend = (k * half).powi(2) / 6.0;
        let found = fourth(0.5 * bend * bend, 0.5 * k * k, &subset);
        let expected = (k * half).powi(4) / 280.0 / bend;
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        assert!(fourth(1.0, 0.0, &subset).abs() < 1e-12);
    }
}
