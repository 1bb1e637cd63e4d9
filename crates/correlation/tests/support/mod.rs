//! Images of known motion: Gaussian speckles integrated over each pixel in closed form.

#![expect(dead_code, unreachable_pub, reason = "each test binary uses a part of it")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use chainwave_correlation::{PreparedSubset, Reference, Settings};
use chainwave_measurement::{MemoryRecording, Region, Subset};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

/// Columns and rows of the images.
pub const SIZE: [usize; 2] = [420, 420];
/// Full range of 12 bits.
pub const FULL_RANGE: f64 = 4095.0;

/// A pattern of equal, randomly placed Gaussian spots on an unbounded plane.
pub struct Speckle {
    spots: Vec<[f64; 2]>,
    /// Standard deviation of a spot, in pixels.
    radius_px: f64,
    peak: f64,
    base: f64,
}

impl Speckle {
    /// Spots of 4.5 px: so wide is the autocorrelation of the image at half its height.
    pub const RADIUS_PX: f64 = 4.5 / (2.354_82 * std::f64::consts::SQRT_2);

    /// Fills an image and 20 px around it; mean 1200 counts, standard deviation about 700 (17 % of full range).
    pub fn new(seed: u64, radius_px: f64) -> Self {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let [width, height] = SIZE.map(|n| n as f64 + 40.0);
        let n_spots = (width * height / (2.0 * std::f64::consts::PI * radius_px.powi(2))) as usize;
        let spot = |_| [random.random_range(-20.0..width - 20.0), random.random_range(-20.0..height - 20.0)];
        Self { spots: (0..n_spots).map(spot).collect(), radius_px, peak: 1000.0, base: 200.0 }
    }

    /// Spots of the usual width at these places.
    pub fn at(spots: Vec<[f64; 2]>, peak: f64, base: f64) -> Self {
        Self { spots, radius_px: Self::RADIUS_PX, peak, base }
    }

    /// The image when the spot at (x, y) has moved to `place([x, y])`, in counts that are not rounded.
    pub fn render(&self, place: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<f64> {
        let mut image = vec![self.base; SIZE[0] * SIZE[1]];
        for &spot in &self.spots {
            let [x, y] = place(spot);
            let (columns, rows) = (self.profile(x, SIZE[0]), self.profile(y, SIZE[1]));
            for (j, row) in &rows {
                for (i, column) in &columns {
                    image[j * SIZE[0] + i] += self.peak * row * column;
                }
            }
        }
        image
    }

    /// The image whose pixel at (x, y) shows the point `source([x, y])` of the plane, not integrated over the pixel: the
    /// truth for any deformation, which `source` is the inverse of.
    pub fn deformed(&self, source: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<f64> {
        const CELL_PX: f64 = 10.0;
        let reach = 6.0 * self.radius_px;
        assert!(reach < CELL_PX + 2.0, "a spot reaches its neighbouring cells alone");
        let cell = |value: f64| (value / CELL_PX).floor() as i64;
        let mut cells = std::collections::BTreeMap::<[i64; 2], Vec<[f64; 2]>>::new();
        for &spot in &self.spots {
            cells.entry(spot.map(cell)).or_default().push(spot);
        }
        let at = |i: usize| {
            let [x, y] = source([(i % SIZE[0]) as f64, (i / SIZE[0]) as f64]);
            let near = (-1..=1).flat_map(|j| (-1..=1).map(move |i| [cell(x) + i, cell(y) + j]));
            let spots = near.filter_map(|cell| cells.get(&cell)).flatten();
            let share = |spot: &[f64; 2]| {
                let square = (spot[0] - x).powi(2) + (spot[1] - y).powi(2);
                (-0.5 * square / self.radius_px.powi(2)).exp()
            };
            self.base + self.peak * spots.map(share).sum::<f64>()
        };
        (0..SIZE[0] * SIZE[1]).map(at).collect()
    }

    /// Integrals of a spot at `centre` over each pixel it reaches along one axis.
    fn profile(&self, centre: f64, n: usize) -> Vec<(usize, f64)> {
        let reach = 7.0 * self.radius_px;
        let first = (centre - reach).max(0.0) as usize;
        let last = ((centre + reach).max(0.0) as usize).min(n);
        let scale = self.radius_px * std::f64::consts::SQRT_2;
        let edge = |i: usize| libm::erf((i as f64 - 0.5 - centre) / scale);
        let unit = self.radius_px * (std::f64::consts::PI / 2.0).sqrt();
        (first..last).map(|i| (i, unit * (edge(i + 1) - edge(i)))).collect()
    }
}

/// What a 12-bit sensor makes of an image: noise of this share of full range, rounding, clipping.
pub fn sense(image: &[f64], noise: f64, seed: u64) -> Vec<f32> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut count = |value: f64| {
        let normal: f64 = StandardNormal.sample(&mut random);
        (value + noise * FULL_RANGE * normal).round().clamp(0.0, FULL_RANGE) as f32
    };
    image.iter().map(|&value| count(value)).collect()
}

/// A recording of 12 bits in memory, its frames of the usual size.
pub fn recorded(frames: Vec<Vec<f32>>) -> MemoryRecording {
    MemoryRecording::new(SIZE[0], 12, frames)
}

pub fn subset(x_px: f64, y_px: f64, half: usize) -> Subset {
    Subset::new(format!("{x_px} {y_px}"), x_px, y_px, half, half)
}

/// Subsets of 33 x 33 px, edge to edge, at least `margin` px away from the border.
pub fn grid(margin: usize) -> Vec<Subset> {
    let line = |n: usize| (margin + 16..n - margin - 16).step_by(33).collect::<Vec<_>>();
    let columns = line(SIZE[0]);
    let place = |y: usize| columns.iter().map(move |&x| subset(x as f64, y as f64, 16)).collect::<Vec<_>>();
    line(SIZE[1]).into_iter().flat_map(place).collect()
}

/// Every subset prepared from an image.
pub fn prepare(image: &[f32], subsets: &[Subset], settings: &Settings) -> Vec<PreparedSubset> {
    let whole = Region::whole(SIZE[0], SIZE[1]);
    let reference = Reference::new(whole, image.to_vec(), 1).unwrap();
    subsets.iter().map(|subset| PreparedSubset::new(&reference, subset, settings).unwrap()).collect()
}

/// Mean and standard deviation about the mean.
pub fn moments(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    [mean, (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()]
}

/// Standard deviations within which normal errors lie, and in how many of a hundred cases.
const NOMINAL: [[f64; 2]; 2] = [[1.0, 68.27], [1.96, 95.0]];
/// What this crate claims of its intervals: 68 +- 2 and 95 +- 1 % of errors.
const CLAIM: [f64; 2] = [2.0, 1.0];

/// Percent of errors, given over their sigma, within one sigma and within the 95 % interval.
pub fn coverage(pulls: &[f64]) -> [f64; 2] {
    let share = |limit: f64| pulls.iter().filter(|pull| pull.abs() < limit).count() as f64;
    NOMINAL.map(|[limit, _]| 100.0 * share(limit) / pulls.len() as f64)
}

/// Which intervals are wrong.
#[derive(Clone, Copy)]
pub enum Wrong {
    /// Those that are too narrow or too wide.
    Both,
    /// Those that are too narrow: where the errors come from a foreign library, whose code paths differ from machine to
    /// machine.
    TooNarrow,
}

/// Holds the coverage of errors over their sigma against what is claimed of it and two standard errors of the shares found.
/// Always `n_sharing` errors come from the same noisy reference.
///
/// Two errors with a reference in common have a correlation of 1/2. Whether they lie within c sigma has then, by the first
/// term of Hermite's series, the correlation `(c phi(c))^2/(2 p (1 - p))`: 0.135 for 68 and 0.138 for 95 %, with
/// the next term 0.15 and 0.14. So n errors tell a share as `n/(1 + 0.15 (n_sharing - 1))` independent ones do.
pub fn assert_coverage(name: &str, pulls: &[f64], n_sharing: usize, wrong: Wrong) {
    let found = coverage(pulls);
    let independent = pulls.len() as f64 / (1.0 + 0.15 * (n_sharing - 1) as f64);
    for ((share, [limit, nominal]), claim) in found.into_iter().zip(NOMINAL).zip(CLAIM) {
        let standard_error = (nominal * (100.0 - nominal) / independent).sqrt();
        let off = claim + 2.0 * standard_error;
        let holds = share > nominal - off && (share < nominal + off || matches!(wrong, Wrong::TooNarrow));
        assert!(
            holds,
            "{name}: {share:.1} % within {limit} sigma, expected {nominal} +- {off:.1}: {found:?}"
        );
    }
}

/// Standard error of a standard deviation found from so many independent errors, as a share of it.
pub fn error_of_std(n: usize) -> f64 {
    (2.0 * n as f64).sqrt().recip()
}

/// Root of the mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// An image that has moved by so many pixels along x and y, in counts.
pub type Image = Box<dyn Fn([f64; 2]) -> Vec<f64>>;

/// Derivatives of an image along x and y, in counts per pixel.
pub fn slopes(image: &Image) -> [Vec<f64>; 2] {
    [[1.0, 0.0], [0.0, 1.0]].map(|d| {
        let [after, before] = [0.01, -0.01].map(|h| image([h * d[0], h * d[1]]));
        after.iter().zip(before).map(|(a, b)| (a - b) / 0.02).collect()
    })
}

/// The noise floor of each subset along x and y, from the images without noise.
pub fn floors_px(slopes: &[Vec<f64>; 2], noise: f64, subsets: &[Subset]) -> Vec<[f64; 2]> {
    let of = |subset: &Subset| {
        let (cx, cy) = (subset.x_px as usize, subset.y_px as usize);
        let pixels =
            || (cy - 16..=cy + 16).flat_map(move |y| (cx - 16..=cx + 16).map(move |x| y * SIZE[0] + x));
        [0, 1].map(|axis| {
            let energy: f64 = pixels().map(|i| slopes[axis][i].powi(2)).sum();
            (2.0 * (noise * FULL_RANGE).powi(2) / energy).sqrt()
        })
    };
    subsets.iter().map(of).collect()
}

/// The Cramer-Rao bound of the affine shape function with unknown gain and offset, of each subset along x and y.
pub fn affine_bounds_px(
    still: &[f64],
    slopes: &[Vec<f64>; 2],
    noise: f64,
    subsets: &[Subset],
) -> Vec<[f64; 2]> {
    let of = |subset: &Subset| {
        let (cx, cy) = (subset.x_px as usize, subset.y_px as usize);
        let mut hessian = nalgebra::DMatrix::<f64>::zeros(8, 8);
        for (x, y) in (0..33).flat_map(|y| (0..33).map(move |x| (x, y))) {
            let i = (cy + y - 16) * SIZE[0] + cx + x - 16;
            let (fx, fy, x, y) = (slopes[0][i], slopes[1][i], x as f64 - 16.0, y as f64 - 16.0);
            let derivatives = [fx, fx * x, fx * y, fy, fy * x, fy * y, 1.0, still[i] / 1e3];
            let j = nalgebra::DVector::from_row_slice(&derivatives);
            hessian += &j * j.transpose();
        }
        let inverse = hessian.try_inverse().unwrap();
        [0, 3].map(|i| (2.0 * inverse[(i, i)]).sqrt() * noise * FULL_RANGE)
    };
    subsets.iter().map(of).collect()
}

/// What the bound grows by where the texture is known from a picture alone that is as noisy: a wave of the signal-to-noise
/// ratio s tells `s^2/(1 + 2 s)` of a delay and not s/2 (C. H. Knapp, G. C. Carter 1976). Speckles have the spectrum
/// `4 pi r^2 exp(-w^2 r^2)` times their variance, and a wave's share in the bound is `w^2` of it.
pub fn bound_of_unknown_texture(contrast: f64, noise: f64) -> f64 {
    let r2 = Speckle::RADIUS_PX.powi(2) + 1.0 / 12.0;
    let strongest = (contrast / noise).powi(2) * 4.0 * std::f64::consts::PI * r2;
    let (step, n) = (0.01, 4000);
    let told = (0..n)
        .map(|i| step * (f64::from(i) + 0.5))
        .map(|u| u * (-u).exp() / (1.0 + u.exp() / (2.0 * strongest)));
    (told.sum::<f64>() * step).powf(-0.5)
}
