//! The share of interpolation in a match's residual, foreseen from the reference alone.
//!
//! What interpolation does to the image ([`crate::interpolation_error::alias`]) and is neither displacement nor gain stays in the residual. Counted
//! as noise, it would overstate sigma where the noise is low. At each phase between two pixels it is an even and an odd
//! filter of the reference along each axis, so its energy follows from the filters' taps and the reference's autocorrelation
//! at a few lags. What the even filter has in common with the reference is gain, and what the odd one has in common with
//! its derivative is displacement: neither stays.
//!
//! The reference's noise has its share in that energy, which is known but for the noise's variance: [`Foreseen`].

use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use crate::Interpolation;
use crate::interpolation_error::alias::{LAGS, Taps, error_response, fit, sinc};
use crate::interpolation_error::lagged::Correlations;
use crate::reference::filter::convolve;
use crate::reference::gradient::spline_slope;
use crate::warp::Warp;
use crate::window::sample::Lattice;

/// Phases from 0 to 1/2 at which the energy is known; it is the same on both sides of 1/2.
const N_PHASES: usize = 5;
/// What the contrast of the finest usable texture loses, half way between two pixels.
const LARGEST_LOSS: f64 = -0.5;
/// A number for each phase.
type ByPhase = [f64; N_PHASES];
/// The energy over the phase t as a sum of `cos(2 pi m t)`.
type Waves = [f64; N_PHASES];
/// An autocorrelation, or what it is to be multiplied with, at the lags from 0 on.
type ByLag = [f64; 2 * LAGS + 1];

/// The energy of interpolation's errors in a subset's residual over the phases of interpolation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct InterpolationEnergy {
    /// By interpolation along x and y, in counts squared.
    axes: [Waves; 2],
    /// What interpolation along x and y adds to the contrast of the reference's gradient along it, as a share.
    slopes: [Waves; 2],
    /// And to that of the reference itself.
    greys: [Waves; 2],
    /// The same of a pixel of white noise of unit variance.
    of_noise: Waves,
}

/// What interpolation adds to the sum of squares of a residual, for a target of unit gain.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Foreseen {
    /// By the reference as it is, with its noise, in counts squared.
    pub(crate) energy: f64,
    /// What noise of unit variance has added to that in each pixel.
    pub(crate) noise_share: f64,
    /// What interpolation along x and y leaves of the contrast of the gradient along it.
    pub(crate) slopes: [f64; 2],
    /// And of the reference itself, or of its gradient across.
    pub(crate) greys: [f64; 2],
}

impl Foreseen {
    /// What interpolation leaves of the contrast of the gradient along x and y.
    pub(crate) fn gradients(&self) -> [f64; 2] {
        [self.slopes[0] * self.greys[1], self.slopes[1] * self.greys[0]]
    }
}

impl InterpolationEnergy {
    /// The energy for a subset in its surroundings, in whose pixels noise has together `noise_energy`.
    pub(crate) fn new(correlations: &Correlations, noise_energy: f64, interpolation: Interpolation) -> Self {
        let phases = &PHASES[interpolation as usize];
        // where noise hides the texture, what is left after its share is taken off may be anything
        let contrast = |added: ByPhase, of: f64| {
            waves_through(added.map(|added| (added / of).clamp(LARGEST_LOSS, -LARGEST_LOSS)))
        };
        let mut energy = Self { of_noise: phases.of_noise, ..Self::default() };
        for (axis, r) in correlations.grey.iter().enumerate() {
            let mut texture = *r;
            texture[0] -= noise_energy;
            let [even, odd] = [&phases.even, &phases.odd].map(|filters| filters.energies(r));
            energy.axes[axis] = waves_through(std::array::from_fn(|i| even[i] + odd[i]));
            energy.slopes[axis] =
                contrast(sums(&phases.of_slope, &texture), sum(&phases.odd.absorbed, &texture));
            energy.greys[axis] =
                contrast(sums(&phases.even.shared, &texture), sum(&phases.even.absorbed, &texture));
        }
        energy
    }

    /// The energy in a part of the subset.
    pub(crate) fn scaled(&self, share: f64) -> Self {
        Self { axes: self.axes.map(|waves| waves.map(|wave| share * wave)), ..*self }
    }

    /// What is foreseen under a warp. Where the subset is deformed the phase varies over it; the mean over it is taken.
    pub(crate) fn at(&self, warp: &Warp, lattice: Lattice) -> Foreseen {
        let middle = warp.apply(lattice.middle_px());
        let [ux, uy, vx, vy] = warp.gradient;
        let (columns, rows) = (lattice.width as f64, lattice.height as f64);
        let mut foreseen = Foreseen { energy: 0.0, noise_share: 0.0, slopes: [1.0; 2], greys: [1.0; 2] };
        let mut of_axes = [[0.0; 2]; 2];
        for (axis, [along, across]) in [[ux, uy], [vx, vy]].into_iter().enumerate() {
            let cosine = (TAU * middle[axis]).cos();
            let [mut before, mut wave] = [cosine, 1.0];
            for m in 0..N_PHASES {
                let order = m as f64;
                let mean = wave * sinc(order * along * columns) * sinc(order * across * rows);
                of_axes[axis][0] += self.axes[axis][m] * mean;
                of_axes[axis][1] += self.of_noise[m] * mean;
                foreseen.slopes[axis] += self.slopes[axis][m] * mean;
                foreseen.greys[axis] += self.greys[axis][m] * mean;
                // cos((m + 1) a) = 2 cos(a) cos(m a) - cos((m - 1) a)
                [before, wave] = [wave, 2.0 * cosine * wave - before];
            }
        }
        // interpolation along the other axis takes as much of an error's contrast as of the reference's
        for (axis, [energy, of_noise]) in of_axes.into_iter().enumerate() {
            let left = foreseen.greys[1 - axis].powi(2);
            foreseen.energy += left * energy;
            foreseen.noise_share += left * of_noise;
        }
        foreseen
    }
}

/// The waves through the values at the phases.
fn waves_through(values: ByPhase) -> Waves {
    WAVES.each_ref().map(|wave| wave.iter().zip(values).map(|(share, value)| share * value).sum())
}

/// What each value counts in each wave.
static WAVES: LazyLock<[ByPhase; N_PHASES]> = LazyLock::new(|| {
    let last = N_PHASES - 1;
    let share = |i: usize| if i == 0 || i == last { 0.5 } else { 1.0 };
    let count = |m: usize, i: usize| {
        2.0 / last as f64 * share(m) * share(i) * (PI * (m * i) as f64 / last as f64).cos()
    };
    std::array::from_fn(|m| std::array::from_fn(|i| count(m, i)))
});

/// What interpolation does at the phases.
struct Phases {
    even: Filters,
    odd: Filters,
    /// What an autocorrelation is multiplied with for the product of the gradient and its even filter.
    of_slope: [ByPhase; 2 * LAGS + 1],
    /// The energy that white noise of unit variance has after both filters.
    of_noise: Waves,
}

/// The even or the odd filters of all phases, as what an autocorrelation is multiplied with at each lag.
struct Filters {
    /// For the energy of the filtered reference.
    square: [ByPhase; 2 * LAGS + 1],
    /// For its product with what the match absorbs: the reference itself, or its derivative.
    shared: [ByPhase; 2 * LAGS + 1],
    /// For the energy of the latter.
    absorbed: ByLag,
}

static PHASES: LazyLock<[Phases; 5]> = LazyLock::new(|| Interpolation::ALL.map(Phases::new));

impl Phases {
    fn new(interpolation: Interpolation) -> Self {
        let phase = |i: usize| 0.5 * i as f64 / (N_PHASES - 1) as f64;
        let taps: [Taps; N_PHASES] =
            std::array::from_fn(|i| fit(|w| error_response(interpolation, phase(i), w)));
        let [even, odd] = [0, 1].map(|parity| taps.each_ref().map(|taps| taps.map(|pair| pair[parity])));
        let mut identity = [0.0; 2 * LAGS + 1];
        identity[LAGS] = 1.0;
        let slope: [f64; 2 * LAGS + 1] = std::array::from_fn(|i| spline_slope(i as i32 - LAGS as i32));
        let centred_slope = convolve(&identity, &slope);
        let of_slope = even.each_ref().map(|taps| by_lag(&convolve(taps, &slope), &centred_slope));
        let (even, odd) = (Filters::new(&even, &identity), Filters::new(&odd, &slope));
        let of_noise = std::array::from_fn(|i| even.square[0][i] + odd.square[0][i]);
        Self { even, odd, of_slope: transposed(of_slope), of_noise: waves_through(of_noise) }
    }
}

impl Filters {
    fn new(of_phases: &[[f64; 2 * LAGS + 1]; N_PHASES], absorbed: &[f64; 2 * LAGS + 1]) -> Self {
        Self {
            square: transposed(of_phases.each_ref().map(|taps| by_lag(taps, taps))),
            shared: transposed(of_phases.each_ref().map(|taps| by_lag(taps, absorbed))),
            absorbed: by_lag(absorbed, absorbed),
        }
    }

    /// The energies that stay of what these filters make of a reference.
    fn energies(&self, autocorrelation: &ByLag) -> ByPhase {
        let absorbed = sum(&self.absorbed, autocorrelation);
        let (square, shared) = (sums(&self.square, autocorrelation), sums(&self.shared, autocorrelation));
        std::array::from_fn(|i| square[i] - shared[i] * shared[i] / absorbed)
    }
}

fn transposed(of_phases: [ByLag; N_PHASES]) -> [ByPhase; 2 * LAGS + 1] {
    std::array::from_fn(|lag| of_phases.each_ref().map(|by_lag| by_lag[lag]))
}

/// The sums of products of two filters' taps that are so far apart; what is farther apart is next to nothing.
fn by_lag(a: &[f64], b: &[f64]) -> ByLag {
    let mut sums = [0.0; 2 * LAGS + 1];
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            if let Some(sum) = sums.get_mut(i.abs_diff(j)) {
                *sum += a * b;
            }
        }
    }
    sums
}

fn sum(by_lag: &ByLag, autocorrelation: &ByLag) -> f64 {
    by_lag.iter().zip(autocorrelation).map(|(a, r)| a * r).sum()
}

/// [`sum`] for all phases.
fn sums(by_lag: &[ByPhase; 2 * LAGS + 1], autocorrelation: &ByLag) -> ByPhase {
    let mut sums = [0.0; N_PHASES];
    for (of_phases, r) in by_lag.iter().zip(autocorrelation) {
        for (sum, a) in sums.iter_mut().zip(of_phases) {
            *sum += a * r;
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interpolation_error::alias::tests::waves;
    use crate::{PreparedSubset, Reference, Settings, Window, Workspace};
    use chainwave_measurement::{Region, Subset};

    #[test]
    fn what_is_foreseen_is_what_a_match_without_noise_leaves() {
        let whole = Region::whole(90, 90);
        let reference = Reference::new(whole, waves([0.0; 2]), 1).unwrap();
        let subset = Subset::new("a", 45.0, 44.0, 16, 14);
        for interpolation in Interpolation::ALL {
            let settings = Settings { interpolation, convergence_px: 1e-5, ..Settings::default() };
            let subset = PreparedSubset::new(&reference, &subset, &settings).unwrap();
            let mut workspace = Workspace::default();
            for shift in [[0.5, 0.0], [0.0, 0.5], [0.5, 0.3], [0.2, 0.1], [0.8, 0.4], [0.3, 0.9]] {
                let window = Window::new(whole, &waves(shift), interpolation).unwrap();
                let start = Warp::at([45.0 + shift[0], 44.0 + shift[1]]);
                let warp = subset.solve(&window, start, &mut workspace).unwrap().warp();
                let (_, residual) = subset.compare(&window, &warp, &mut workspace).unwrap();
                let (left, foreseen) = (residual.sum_of_squares, residual.of_interpolation);
                // A quarter for what is odd along one axis and even along the other; and a millionth of the image's energy
                // for the filters' few taps: a tenth of a count, of 450.
                let error = (foreseen.energy - left).abs();
                assert!(
                    error < 0.25 * left + 1e-6 * subset.energy,
                    "{interpolation} {shift:?}: {foreseen:?} {left}"
                );
                // Linear interpolation half way takes 1 - cos(w/2) of a wave; these have w of about 1.
                let loss = 1.0 - foreseen.slopes[0] * foreseen.slopes[1];
                let expected = if interpolation == Interpolation::Linear { 0.02..0.35 } else { -0.01..0.01 };
                assert!(expected.contains(&loss), "{interpolation} {shift:?}: {loss}");
            }
        }
    }

    #[test]
    fn waves_pass_through_their_values() {
        let values = [0.0, 0.3, 1.0, 0.7, 0.2];
        let waves = waves_through(values);
        for (i, value) in values.into_iter().enumerate() {
            let phase = 0.5 * i as f64 / 4.0;
            let sum: f64 =
                waves.iter().enumerate().map(|(m, wave)| wave * (TAU * m as f64 * phase).cos()).sum();
            assert!((sum - value).abs() < 1e-12, "five waves, five values");
        }
    }
}
