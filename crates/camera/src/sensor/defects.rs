//! Hot and dead pixels: those that stand out from their neighbours where nothing that was filmed can.

use chainwave_measurement::{median, robust_sigma_about_zero};

use super::neighbours::Surroundings;
use super::statistics::PixelStatistics;

/// Share of good pixels that a rule may take for defects.
const FALSE_SHARE: f64 = 1e-6;
/// Standard deviations beyond which a normal variate lies with that probability, on both sides together.
const LIMIT_SIGMAS: f64 = 4.8916;
/// Standard deviation of what rounding to whole counts takes away, which no averaging removes where frames differ by less.
const ROUNDING_COUNTS: f64 = 0.288_675;
/// A pixel's response, against its neighbours', below or above which it is beyond correction: its noise would be more than doubled,
/// or it saturates long before them.
const RESPONSES: std::ops::RangeInclusive<f64> = 0.5..=2.0;

/// What is wrong with a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DefectKind {
    /// It shows more than there is.
    Hot,
    /// It shows less.
    Dead,
}

/// A pixel that cannot be relied on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Defect {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// What is wrong with it.
    pub kind: DefectKind,
}

/// The defects of a sensor, row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct DefectMap {
    width_px: usize,
    height_px: usize,
    defects: Vec<Defect>,
    expected_false: f64,
}

impl DefectMap {
    /// None, of a sensor of some size.
    pub fn none(width_px: usize, height_px: usize) -> Self {
        Self { width_px, height_px, defects: Vec::new(), expected_false: 0.0 }
    }

    /// From frames taken in the dark: what differs from the median of its neighbours by more than 4.89 times the usual (the median
    /// of absolute differences, as a standard deviation). Of normal pixels, one in a million does so by chance.
    pub fn of_dark(dark: &PixelStatistics) -> Self {
        let excess = excess_over_median(dark.width_px(), dark.mean());
        let sigma = robust_sigma_about_zero(excess.iter().copied()).unwrap_or(0.0).max(ROUNDING_COUNTS);
        Self::where_kind(dark.width_px(), dark.n_pixels(), |at| {
            (excess[at].abs() > LIMIT_SIGMAS * sigma).then(|| kind(excess[at]))
        })
    }

    /// From frames of an evenly lit field: what responds to light less than half or more than twice as much as the median of its
    /// neighbours, beyond what chance does to one pixel in a million. `dark` is of the same sensor, or missing.
    pub fn of_flat(flat: &PixelStatistics, dark: Option<&PixelStatistics>) -> Self {
        let response = response(flat, dark);
        let excess = excess_over_median(flat.width_px(), &response);
        let sigma = robust_sigma_about_zero(excess.iter().copied()).unwrap_or(0.0).max(ROUNDING_COUNTS);
        Self::where_kind(flat.width_px(), flat.n_pixels(), |at| {
            let usual = response[at] - excess[at];
            let is_odd = usual > 0.0 && !RESPONSES.contains(&(response[at] / usual));
            (is_odd && excess[at].abs() > LIMIT_SIGMAS * sigma).then(|| kind(excess[at]))
        })
    }

    /// From scenes at rest, each the mean of some frames: what differs from the cubic through its neighbours, to the same side in
    /// every scene, and in their weighted mean by far more than other pixels near it do.
    ///
    /// A lens does not image so sharply that a single pixel of a scene stands alone, and what does so by chance does not in a second
    /// scene whose texture lies elsewhere: the more scenes differ, the fainter the defects that are found. The limit follows
    /// from the pictures themselves: the tail of the differences, of which the largest hundredth is taken to fall exponentially, is
    /// continued to one pixel in a million. That is the rate of false defects where tails fall no slower; textures that end within a
    /// pixel (a drawing without a lens) have others, and are no material for this rule. Spots of dirt, larger than a pixel, are
    /// not looked for.
    ///
    /// None of no scene, and of scenes of different sizes.
    pub fn at_rest(scenes: &[PixelStatistics]) -> Self {
        let Some(first) = scenes.first() else { return Self::none(0, 0) };
        let (width_px, n_pixels) = (first.width_px(), first.n_pixels());
        let nothing = Self::none(width_px, first.height_px());
        if scenes.iter().any(|scene| (scene.width_px(), scene.n_pixels()) != (width_px, n_pixels)) {
            return nothing;
        }
        let differences: Vec<Differences> = scenes.iter().map(Differences::of).collect();
        let score = |at: usize, expected: &dyn Fn(&Differences) -> f64| {
            joined(differences.iter().map(|scene| (expected(scene), scene.sigma[at])))
        };
        let scores: Vec<f64> = (0..n_pixels).map(|at| score(at, &|scene| scene.difference[at])).collect();
        let Some(limit) = limit(&peaks(width_px, &scores)) else { return nothing };
        let mut candidates: Vec<usize> = (0..n_pixels).filter(|&at| scores[at].abs() > limit).collect();
        candidates.sort_by(|&a, &b| scores[b].abs().total_cmp(&scores[a].abs()).then(a.cmp(&b)));
        // A defect makes its neighbours differ too: the worst first, each against neighbours that are not defects.
        let mut is_good = vec![true; n_pixels];
        let mut kinds = vec![None; n_pixels];
        for at in candidates {
            let score = score(at, &|scene| scene.difference_from_good(at, &is_good));
            if score.abs() > limit {
                is_good[at] = false;
                kinds[at] = Some(kind(score));
            }
        }
        Self::where_kind(width_px, n_pixels, |at| kinds[at])
    }

    /// The pixels that a rule, which errs in one of [`FALSE_SHARE`], calls defects.
    fn where_kind(width_px: usize, n_pixels: usize, rule: impl Fn(usize) -> Option<DefectKind>) -> Self {
        let defect = |at: usize| Some(Defect { x: at % width_px, y: at / width_px, kind: rule(at)? });
        Self {
            width_px,
            height_px: n_pixels.checked_div(width_px).unwrap_or(0),
            defects: (0..n_pixels).filter_map(defect).collect(),
            expected_false: FALSE_SHARE * n_pixels as f64,
        }
    }

    /// These defects and those of another map of the same sensor; unchanged by a map of another size.
    pub fn and(mut self, other: &Self) -> Self {
        if (self.width_px, self.height_px) == (other.width_px, other.height_px) {
            self.defects.extend(&other.defects);
            self.defects.sort_by_key(|defect| (defect.y, defect.x));
            self.defects.dedup_by_key(|defect| (defect.y, defect.x));
            self.expected_false += other.expected_false;
        }
        self
    }

    /// Columns of the sensor.
    pub fn width_px(&self) -> usize {
        self.width_px
    }

    /// Rows of the sensor.
    pub fn height_px(&self) -> usize {
        self.height_px
    }

    /// The defects, row by row from the top.
    pub fn defects(&self) -> &[Defect] {
        &self.defects
    }

    /// How many of them are good pixels by the rules' own rate: a millionth of the pixels for each rule that was asked.
    pub fn expected_false(&self) -> f64 {
        self.expected_false
    }
}

fn kind(excess: f64) -> DefectKind {
    if excess > 0.0 { DefectKind::Hot } else { DefectKind::Dead }
}

/// Response to light: the flat field less the dark level.
pub(super) fn response(flat: &PixelStatistics, dark: Option<&PixelStatistics>) -> Vec<f64> {
    match dark {
        Some(dark) => flat.mean().iter().zip(dark.mean()).map(|(flat, dark)| flat - dark).collect(),
        None => flat.mean().to_vec(),
    }
}

/// What each pixel has more than the median of the up to 24 around it.
fn excess_over_median(width_px: usize, values: &[f64]) -> Vec<f64> {
    const REACH: usize = 2;
    let height_px = values.len().checked_div(width_px).unwrap_or(0);
    let span = |at: usize, size: usize| at.saturating_sub(REACH)..(at + REACH + 1).min(size);
    let around = |at: usize| {
        let (x, y) = (at % width_px, at / width_px);
        let places = span(y, height_px)
            .flat_map(move |row| span(x, width_px).map(move |column| row * width_px + column));
        median(places.filter(|&place| place != at).map(|place| values[place]).collect())
    };
    (0..values.len()).map(|at| values[at] - around(at).unwrap_or(values[at])).collect()
}

/// What differences and their standard deviations say together: the weighted mean in its own standard deviations where all have
/// one sign; 0 where they have not.
fn joined(scenes: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for (difference, sigma) in scenes {
        if sum * difference < 0.0 {
            return 0.0;
        }
        sum += difference / (sigma * sigma);
        weights += (sigma * sigma).recip();
    }
    sum / f64::sqrt(weights)
}

/// Sizes of the scores that are the largest in 5x5 px, and 0 for all others: a defect raises its neighbours' scores, which must not count
/// as so many chances.
fn peaks(width_px: usize, scores: &[f64]) -> Vec<f64> {
    const REACH: usize = 2;
    let height_px = scores.len().checked_div(width_px).unwrap_or(0);
    let span = |at: usize, size: usize| at.saturating_sub(REACH)..(at + REACH + 1).min(size);
    let is_peak = |at: usize| {
        let (x, y) = (at % width_px, at / width_px);
        let rows = span(y, height_px).flat_map(|row| &scores[row * width_px..][span(x, width_px)]);
        rows.fold(0.0_f64, |most, score| most.max(score.abs())) <= scores[at].abs()
    };
    (0..scores.len()).map(|at| if is_peak(at) { scores[at].abs() } else { 0.0 }).collect()
}

/// The score that one pixel in a million exceeds by chance: the largest hundredth, continued exponentially. `None` of too few.
///
/// The tail's fall is told by the median of what it exceeds its start by, which a few defects hardly move.
fn limit(scores: &[f64]) -> Option<f64> {
    const TAIL: f64 = 0.01;
    let mut sizes: Vec<f64> = scores.iter().map(|score| score.abs()).collect();
    let n_tail = (TAIL * sizes.len() as f64) as usize;
    if n_tail < 20 {
        return None;
    }
    let first = sizes.len() - n_tail;
    let (_, start, beyond) = sizes.select_nth_unstable_by(first - 1, f64::total_cmp);
    let start = *start;
    let fall = median(beyond.iter().map(|size| size - start).collect())? / std::f64::consts::LN_2;
    Some((start + fall * (TAIL / FALSE_SHARE).ln()).max(LIMIT_SIGMAS))
}

/// How far the pixels of one scene differ from what their neighbours make likely.
struct Differences<'a> {
    scene: &'a PixelStatistics,
    difference: Vec<f64>,
    /// Standard deviation of the usual difference near a pixel.
    sigma: Vec<f64>,
}

impl<'a> Differences<'a> {
    fn of(scene: &'a PixelStatistics) -> Self {
        let width_px = scene.width_px();
        let all_good = |_: usize, _: usize| true;
        let count = |x: usize, y: usize| scene.mean()[y * width_px + x];
        let surroundings =
            Surroundings { width_px, height_px: scene.height_px(), count: &count, is_good: &all_good };
        let difference: Vec<f64> = (0..scene.n_pixels())
            .map(|at| {
                let (x, y) = (at % width_px, at / width_px);
                count(x, y) - surroundings.expected(x, y).unwrap_or(count(x, y))
            })
            .collect();
        let sigma = sigma_nearby(width_px, &difference, least_sigma(scene));
        Self { scene, difference, sigma }
    }

    /// The difference of one pixel, by neighbours that are good.
    fn difference_from_good(&self, at: usize, is_good: &[bool]) -> f64 {
        let width_px = self.scene.width_px();
        let count = |x: usize, y: usize| self.scene.mean()[y * width_px + x];
        let is_good = |x: usize, y: usize| is_good[y * width_px + x];
        let height_px = self.scene.height_px();
        let surroundings = Surroundings { width_px, height_px, count: &count, is_good: &is_good };
        let (x, y) = (at % width_px, at / width_px);
        count(x, y) - surroundings.expected(x, y).unwrap_or(count(x, y))
    }
}

/// What noise alone makes of a difference: its own, and a third and a twelfth of each of eight neighbours'.
fn least_sigma(scene: &PixelStatistics) -> f64 {
    let weights: f64 = 1.0 + 4.0 / 9.0 + 4.0 / 144.0;
    let of_mean = scene.noise_counts().unwrap_or(0.0) / (scene.n_frames().max(1) as f64).sqrt();
    weights.sqrt() * of_mean.hypot(ROUNDING_COUNTS)
}

/// The usual difference in 7x7 px about each pixel, but for itself and the eight that it is in the likely count of.
fn sigma_nearby(width_px: usize, differences: &[f64], least: f64) -> Vec<f64> {
    const REACH: usize = 3;
    let height_px = differences.len().checked_div(width_px).unwrap_or(0);
    let span = |at: usize, size: usize| at.saturating_sub(REACH)..(at + REACH + 1).min(size);
    let of = |at: usize| {
        let (x, y) = (at % width_px, at / width_px);
        let is_apart = |column: usize, row: usize| {
            let (dx, dy) = (column.abs_diff(x), row.abs_diff(y));
            dx.min(dy) > 0 || dx.max(dy) > 2
        };
        let places = span(y, height_px).flat_map(|row| span(x, width_px).map(move |column| (column, row)));
        let apart = places
            .filter(|&(column, row)| is_apart(column, row))
            .map(|(column, row)| differences[row * width_px + column]);
        robust_sigma_about_zero(apart).unwrap_or(0.0).max(least)
    };
    (0..differences.len()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_is_the_quantile_of_an_exponential() {
        // Evenly spaced quantiles of an exponential of mean 2: its size at one in a million is 2 ln 10^6, far above that of normal
        // variates.
        let n = 100_000;
        let scores: Vec<f64> = (0..n).map(|k| -2.0 * ((k as f64 + 0.5) / f64::from(n)).ln()).collect();
        // Quantiles of a thousand values are off by a thousandth of their spacing's scale.
        let expected = 2.0 * 1e6_f64.ln();
        assert!((limit(&scores).unwrap() / expected - 1.0).abs() < 0.005, "{:?}", limit(&scores));
        assert_eq!(limit(&scores[..1000]), None);
    }

    #[test]
    fn differences_of_one_sign_add_up_and_others_tell_nothing() {
        assert!((joined([(3.0, 1.0)].into_iter()) - 3.0).abs() < 1e-15);
        assert!((joined([(-3.0, 1.0), (-3.0, 1.0)].into_iter()) + 3.0 * 2_f64.sqrt()).abs() < 1e-15);
        // The second is twice as uncertain: a quarter of the weight.
        assert!((joined([(4.0, 1.0), (8.0, 2.0)].into_iter()) - 6.0 / 1.25_f64.sqrt()).abs() < 1e-15);
        assert!(joined([(5.0, 1.0), (-3.0, 1.0), (9.0, 1.0)].into_iter()).abs() < f64::MIN_POSITIVE);
    }
}
