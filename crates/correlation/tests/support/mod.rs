//! Images of known motion: Gaussian speckles integrated over each pixel in closed form.

#![expect(dead_code, unreachable_pub, reason = "each test binary uses a part of it")]
#![expect(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "a test fails by panicking, and says when it skips"
)]

use std::path::{Path, PathBuf};

use chainwave_correlation::{PreparedSubset, Reference, Settings};
use chainwave_measurement::{ReadError, Recording, RecordingInfo, Region, Subset};
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

/// Frames in memory.
pub struct Film {
    info: RecordingInfo,
    pub frames: Vec<Vec<f32>>,
}

impl Film {
    pub fn new(frames: Vec<Vec<f32>>) -> Self {
        let info = RecordingInfo {
            format: "memory".into(),
            width_px: SIZE[0],
            height_px: SIZE[1],
            n_frames: frames.len(),
            bit_depth: 12,
            rate_hz: None,
            times_s: (0..frames.len()).map(|i| i as f64).collect(),
            first_image: 0,
            camera: None,
            exposure_s: None,
            warnings: Vec::new(),
        };
        Self { info, frames }
    }
}

impl Recording for Film {
    fn path(&self) -> &Path {
        Path::new("film")
    }

    fn info(&self) -> &RecordingInfo {
        &self.info
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        self.check_request(frame, region, pixels.len())?;
        for (y, row) in pixels.chunks_exact_mut(region.width).enumerate() {
            let start = (region.y + y) * self.info.width_px + region.x;
            row.copy_from_slice(&self.frames[frame][start..start + region.width]);
        }
        Ok(())
    }
}

pub fn subset(x_px: f64, y_px: f64, half: usize) -> Subset {
    Subset { name: format!("{x_px} {y_px}"), x_px, y_px, half_width_px: half, half_height_px: half }
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

/// A file of the reference data; `None`, with a message, where the data are not at hand.
pub fn reference_data(name: &str) -> Option<PathBuf> {
    let Some(root) = std::env::var_os("CHAINWAVE_REFERENCE_DATA") else {
        eprintln!("skipped: CHAINWAVE_REFERENCE_DATA is not set");
        return None;
    };
    Some(PathBuf::from(root).join(name))
}
