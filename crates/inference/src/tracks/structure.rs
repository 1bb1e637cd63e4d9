//! Whether what a fit leaves over has structure: errors that neighbouring frames of a body and its trials share, where noise shares none.

use std::collections::BTreeMap;

use chainwave_analysis::probability::variance_ratio_beyond;
use chainwave_analysis::{Rule, SIGNIFICANCE_LEVEL};

use super::residuals::Residual;
use crate::measured_rates;

/// What a fit leaves over, held against noise by an analysis of variance.
///
/// The residuals of a body over a short time, in all recordings that see it then, make a cell. Noise is as large within cells as between
/// them; what the model misses moves a cell as a whole. So the ratio of the two variances follows Fisher's F where the model holds,
/// whatever the noise's size: the test of lack of fit with replicates (N. R. Draper, H. Smith, Applied Regression Analysis, 1998, ch. 2).
#[derive(Debug, Clone, PartialEq)]
pub struct Structure {
    /// Variance between cells over that within them.
    pub ratio: f64,
    /// Degrees of freedom of the two.
    pub degrees_of_freedom: (f64, f64),
    /// Probability of such a ratio or a larger one, were there noise alone.
    pub p_value: f64,
    /// Standard deviation of what cells share, in units of the noise's.
    pub size: f64,
    /// Standard deviation of what neighbouring frames of one track share, in units of the noise's: errors that differ from recording to recording
    /// are as large within cells as between them, and the test does not see them.
    pub size_in_tracks: f64,
    /// Bodies whose cells stand out (variance between them over that within all cells), the farthest first; at most three.
    pub bodies: Vec<(usize, f64)>,
    /// From when to when after the impact cells stand out the most, in seconds: the eighth of the time with the largest ratio.
    pub worst_s: (f64, f64),
    /// Ratio of that time's cells.
    pub worst_ratio: f64,
}

/// What a test of structure needs to know of a fit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fitted {
    /// Unknowns that recordings share, amplitudes of errors that the readings tell among them.
    pub(super) n_shared: f64,
    /// Unknowns that each recording, or each of its tracks, has of its own, all together.
    pub(super) n_own: usize,
    /// Length of a cell, in seconds.
    pub(super) cell_s: f64,
}

/// Parts of the time among which the one with most structure is named.
const PARTS: usize = 8;
/// Bodies that are named.
const NAMED: usize = 3;

/// Halvings that find a ratio to a thousandth of what it may be.
const HALVINGS: usize = 10;

/// What neighbouring frames of one track may share, in units of the noise's deviation. Trackers make errors that they do share (the
/// reference's own noise, a bias of interpolation), of a part of it; what is larger than noise is the model's.
const LARGEST_IN_TRACKS: f64 = 1.0;

/// Sums over one cell, or over several.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    n: f64,
    sum: f64,
    squares: f64,
}

impl Cell {
    fn add(&mut self, value: f64) {
        self.n += 1.0;
        self.sum += value;
        self.squares += value * value;
    }

    /// Square of what its residuals share, which noise of unit variance makes one on average.
    fn shared2(&self) -> f64 {
        self.sum * self.sum / self.n
    }
}

impl Structure {
    /// Of the residuals of a fit.
    pub(super) fn of(residuals: &[Residual], fitted: Fitted) -> Self {
        let mut cells: BTreeMap<(usize, i64), Cell> = BTreeMap::new();
        let mut tracks: BTreeMap<(usize, usize, i64), Cell> = BTreeMap::new();
        for Residual { recording, body, after_impact_s, value } in residuals {
            let time = (after_impact_s / fitted.cell_s).floor() as i64;
            cells.entry((*body, time)).or_default().add(*value);
            tracks.entry((*recording, *body, time)).or_default().add(*value);
        }
        let n_cells = cells.len() as f64;
        let together = tracks.len() as f64 / n_cells.max(1.0);
        let n: f64 = cells.values().map(|cell| cell.n).sum();
        let shared2: f64 = cells.values().map(Cell::shared2).sum();
        let squares: f64 = cells.values().map(|cell| cell.squares).sum();
        // What one recording fits of its own takes from the mean over `together` of them only its share.
        let own = fitted.n_own as f64;
        let between = (n_cells - fitted.n_shared - own / together.max(1.0)).max(1.0);
        let within = (n - fitted.n_shared - own - between).max(1.0);
        let noise2 = ((squares - shared2) / within).max(f64::MIN_POSITIVE);
        let ratio = shared2 / between / noise2;
        // Each cell's expectation, had noise alone the fit's degrees of freedom.
        let expected = between / n_cells.max(1.0);
        let ratio_of = |takes: &dyn Fn(&(usize, i64)) -> bool| {
            let (sum, count) = cells
                .iter()
                .filter(|(key, _)| takes(key))
                .fold((0.0, 0.0), |(sum, count), (_, cell)| (sum + cell.shared2(), count + 1.0));
            sum / (count * expected * noise2).max(f64::MIN_POSITIVE)
        };
        let mut numbers: Vec<usize> = cells.keys().map(|(body, _)| *body).collect();
        numbers.dedup();
        let mut bodies: Vec<(usize, f64)> =
            numbers.into_iter().map(|body| (body, ratio_of(&|key| key.0 == body))).collect();
        bodies.sort_by(|a, b| b.1.total_cmp(&a.1));
        bodies.truncate(NAMED);
        let first = cells.keys().map(|(_, time)| *time).min().unwrap_or(0).max(0);
        let last = cells.keys().map(|(_, time)| *time).max().unwrap_or(0).max(first) + 1;
        let bound = |part: usize| first + (last - first) * part as i64 / PARTS as i64;
        let part = |k: usize| {
            let (from, until) = (bound(k), bound(k + 1));
            (ratio_of(&|key| (from..until).contains(&key.1)), from, until)
        };
        let (worst_ratio, from, until) =
            (0..PARTS).map(part).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 0, 0));
        let in_cell = n / n_cells.max(1.0);
        Self {
            ratio,
            degrees_of_freedom: (between, within),
            p_value: variance_ratio_beyond(ratio, between, within),
            size: ((ratio - 1.0).max(0.0) / in_cell).sqrt(),
            size_in_tracks: size_in_tracks(tracks.values(), fitted),
            bodies,
            worst_s: (from as f64 * fitted.cell_s, until as f64 * fitted.cell_s),
            worst_ratio,
        }
    }

    /// Whether there is nothing but noise: no structure that is told, and in single tracks less than what noise is.
    pub fn is_noise_alone(&self) -> bool {
        !self.is_told() && self.size_in_tracks <= LARGEST_IN_TRACKS
    }

    /// Whether noise alone hardly leaves so much ([`structure_rule`]).
    pub fn is_told(&self) -> bool {
        structure_rule().rejects(self.p_value)
    }

    /// Excess of the sum of squares between cells over what noise leaves, in units of the noise's variance.
    pub(super) fn excess(&self) -> f64 {
        (self.ratio - 1.0) * self.degrees_of_freedom.0
    }

    /// The least excess that is still told.
    fn least_excess_told(&self) -> f64 {
        let is_told = |ratio: f64| Self { p_value: self.p_value_of(ratio), ..self.clone() }.is_told();
        let (mut below, mut above) = (1.0, self.ratio.max(1.0));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (below + above);
            if is_told(middle) { above = middle } else { below = middle }
        }
        (above - 1.0) * self.degrees_of_freedom.0
    }

    /// By how much the residuals' sum of squares falls at least where either a share of the excess goes, or so much that none is told.
    pub(super) fn least_fall(&self, residuals: &[Residual], share: f64) -> f64 {
        let squares: f64 = residuals.iter().map(|residual| residual.value.powi(2)).sum();
        let noise2 = squares / (self.ratio * self.degrees_of_freedom.0 + self.degrees_of_freedom.1);
        let excess = self.excess();
        noise2 * (share * excess).min(excess - self.least_excess_told())
    }

    fn p_value_of(&self, ratio: f64) -> f64 {
        variance_ratio_beyond(ratio, self.degrees_of_freedom.0, self.degrees_of_freedom.1)
    }

    /// How much there is, and where it lives, in words.
    pub fn in_words(&self) -> String {
        let bodies: Vec<String> =
            self.bodies.iter().map(|(body, ratio)| format!("{body} ({ratio:.2})")).collect();
        format!(
            "neighbouring frames and trials share {:.0} % of the noise's size (variance ratio {:.3}, p = {:.1e}), most at bodies {} and \
             {:.2} to {:.2} ms after the impact ({:.2}){}",
            100.0 * self.size,
            self.ratio,
            self.p_value,
            bodies.join(", "),
            1e3 * self.worst_s.0,
            1e3 * self.worst_s.1,
            self.worst_ratio,
            match self.size_in_tracks > LARGEST_IN_TRACKS {
                true => format!(
                    "; neighbouring frames of single recordings share {:.1} times the noise's size: what the model misses differs from strike to \
                     strike",
                    self.size_in_tracks
                ),
                false => String::new(),
            }
        )
    }
}

/// The standard deviation, in units of the noise's, of what the cells of single tracks share.
fn size_in_tracks<'a>(cells: impl ExactSizeIterator<Item = &'a Cell>, fitted: Fitted) -> f64 {
    let n_cells = cells.len() as f64;
    let all = cells.fold((0.0, 0.0, 0.0), |(n, shared2, squares), cell| {
        (n + cell.n, shared2 + cell.shared2(), squares + cell.squares)
    });
    let (n, shared2, squares) = all;
    let between = (n_cells - fitted.n_shared - fitted.n_own as f64).max(1.0);
    let within = (n - n_cells).max(1.0);
    let noise2 = ((squares - shared2) / within).max(f64::MIN_POSITIVE);
    ((shared2 / between / noise2 - 1.0).max(0.0) / (n / n_cells.max(1.0))).sqrt()
}

/// The rule by which the chain model explains the tracks.
pub fn structure_rule() -> Rule {
    Rule {
        question: "whether the chain model explains the tracks",
        text: format!(
            "unless residuals that neighbouring frames of a body share, in all its trials, vary more than noise does (F test of lack of \
             fit, {} % level), or neighbouring frames of single recordings share more than noise is",
            100.0 * SIGNIFICANCE_LEVEL
        ),
        level: Some(SIGNIFICANCE_LEVEL),
        rates: measured_rates::STRUCTURE.to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;

    /// Noise of some size in three recordings of four bodies, and what a wave would add.
    fn residuals(seed: u64, noise: f64, wave: f64) -> Vec<Residual> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut all = Vec::new();
        for recording in 0..3 {
            for body in 1..=4 {
                for k in 0..200 {
                    let after_impact_s = 1e-5 * f64::from(k);
                    let deviate: f64 = StandardNormal.sample(&mut random);
                    let missed = if body == 3 { wave * (0.05 * f64::from(k)).sin() } else { 0.0 };
                    all.push(Residual { recording, body, after_impact_s, value: noise * deviate + missed });
                }
            }
        }
        all
    }

    #[test]
    fn the_least_fall_is_what_takes_half_of_the_excess_away_or_what_leaves_none_told() {
        for (wave, is_half) in [(0.8, true), (0.36, false)] {
            let residuals = residuals(1, 1.0, wave);
            let found = Structure::of(&residuals, NOTHING_FITTED);
            assert!(found.is_told());
            let fall = found.least_fall(&residuals, 0.5);
            let half = 0.5 * found.excess();
            // The noise's variance is known from some two thousand residuals: to 3 %, three deviations 10 %.
            assert!((fall / half - 1.0).abs() < 0.1 || !is_half && fall < half, "{fall} of {half}");
        }
    }

    const NOTHING_FITTED: Fitted = Fitted { n_shared: 0.0, n_own: 0, cell_s: 8e-5 };

    #[test]
    fn noise_of_any_size_is_left_at_the_level() {
        const N: u64 = 400;
        let told = |noise: f64| {
            (0..N)
                .filter(|seed| Structure::of(&residuals(*seed, noise, 0.0), NOTHING_FITTED).p_value < 0.1)
                .count()
        };
        for noise in [0.3, 1.0, 5.0] {
            // 40 +- 6; four deviations.
            let told = told(noise);
            assert!((16..=64).contains(&told), "{told} of {N} at noise {noise}");
        }
    }

    /// What has another sign in each recording is none of what their cells share.
    #[test]
    fn what_differs_from_recording_to_recording_is_no_noise() {
        let signs = [1.0, -0.5, -0.5];
        let with = |wave: f64| {
            let mut all = residuals(1, 1.0, 0.0);
            for residual in &mut all {
                residual.value += signs[residual.recording] * wave * (5e3 * residual.after_impact_s).sin();
            }
            Structure::of(&all, NOTHING_FITTED)
        };
        let found = with(3.0);
        assert!(!found.is_told() && !found.is_noise_alone(), "{found:?}");
        // Its variance, the mean of the signs' squares being a half: 9 / 4. Within cells it changes little.
        assert!((found.size_in_tracks - 1.5).abs() < 0.15, "{found:?}");
        assert!(with(0.3).is_noise_alone());
    }

    #[test]
    fn a_wave_below_the_noise_is_told_and_where_it_lives() {
        let found = Structure::of(&residuals(1, 1.0, 0.4), NOTHING_FITTED);
        // 24 positions a cell: the cells of body 3 have 1 + 24 x 0.08 of the noise's variance, and F deviates by 0.14.
        assert!(found.is_told() && found.bodies[0].0 == 3, "{found:?}");
        assert!((found.bodies[0].1 - 2.9).abs() < 1.5, "{found:?}");
        // The wave's variance over four bodies: 0.4^2 / 8.
        assert!((found.size - 0.02_f64.sqrt()).abs() < 0.07, "{found:?}");
    }
}
