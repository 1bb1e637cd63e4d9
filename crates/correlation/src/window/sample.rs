//! Interpolation of a window at the places of a warped subset.

use std::marker::PhantomData;
use std::ops::Range;

use pulp::Simd;

use crate::simd::{InBlocks, LANES};
use crate::warp::Warp;
use crate::window::kernel::{BSpline, Kernel, Moms};
use crate::{Interpolation, Window};

/// The pixels of a subset: `width` columns and `height` rows, the first at `first_px` from the centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lattice {
    pub(crate) first_px: [f64; 2],
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl Lattice {
    /// The middle pixel, or the one behind it.
    pub(crate) fn middle_px(self) -> [f64; 2] {
        let [x, y] = self.first_px;
        [x + (self.width / 2) as f64, y + (self.height / 2) as f64]
    }
}

/// Samples the window (counts less its level) at every pixel of a warped subset, row by row into `samples`, which has
/// room for [`LANES`] values more. `rows` is a buffer.
///
/// Every point must lie in the window ([`Window::contains`]); the caller checks the subset's outline once instead of
/// each point here.
pub(crate) fn sample(
    window: &Window,
    warp: &Warp,
    lattice: Lattice,
    rows: &mut Vec<f32>,
    samples: &mut [f32],
) {
    match window.interpolation {
        Interpolation::Linear => sample_with::<BSpline, 2>(window, warp, lattice, rows, samples),
        Interpolation::Cubic => sample_with::<BSpline, 4>(window, warp, lattice, rows, samples),
        Interpolation::CubicMoms => sample_with::<Moms, 4>(window, warp, lattice, rows, samples),
        Interpolation::Quintic => sample_with::<BSpline, 6>(window, warp, lattice, rows, samples),
        Interpolation::QuinticMoms => sample_with::<Moms, 6>(window, warp, lattice, rows, samples),
    }
}

fn sample_with<K: Kernel<TAPS>, const TAPS: usize>(
    window: &Window,
    warp: &Warp,
    lattice: Lattice,
    rows: &mut Vec<f32>,
    samples: &mut [f32],
) {
    if warp.is_translation() {
        chainwave_vectors::dispatch_loop(
            #[inline(always)]
            || sample_grid::<K, TAPS>(window, warp, lattice, rows, samples),
        );
    } else {
        let kernel = PhantomData::<K>;
        RowSampling::<K, TAPS> { window, warp, lattice, samples, kernel }.dispatch();
    }
}

/// Samples at whole steps: a subset that is moved and not deformed has the same weights everywhere, and the two axes
/// separate.
#[inline(always)]
fn sample_grid<K: Kernel<TAPS>, const TAPS: usize>(
    window: &Window,
    warp: &Warp,
    lattice: Lattice,
    rows: &mut Vec<f32>,
    samples: &mut [f32],
) {
    let start = Start::new(window, warp.apply(lattice.first_px));
    let weight_x = K::WEIGHTS.at::<TAPS>(start.fraction[0]);
    let weight_y = K::WEIGHTS.at::<TAPS>(start.fraction[1]);
    let corner = window.corner::<TAPS>(start.column, start.row);
    let (width, n_rows) = (lattice.width, lattice.height + TAPS - 1);
    rows.resize(n_rows * width, 0.0);
    for (i, sums) in rows.chunks_exact_mut(width).enumerate() {
        weighted_sum(&window.coefficients[corner + i * window.stride..], 1, weight_x, sums);
    }
    for (i, sums) in samples.chunks_exact_mut(width).take(lattice.height).enumerate() {
        weighted_sum(&rows[i * width..], width, weight_y, sums);
    }
}

/// `sums[i] = sum over taps of weights[tap] * values[i + tap * spacing]`.
#[inline(always)]
fn weighted_sum<const TAPS: usize>(values: &[f32], spacing: usize, weights: [f32; TAPS], sums: &mut [f32]) {
    let n = sums.len();
    let lines: [&[f32]; TAPS] = std::array::from_fn(
        #[inline(always)]
        |tap| &values[tap * spacing..tap * spacing + n],
    );
    for (i, sum) in sums.iter_mut().enumerate() {
        let mut total = 0.0;
        for tap in 0..TAPS {
            total = weights[tap].mul_add(lines[tap][i], total);
        }
        *sum = total;
    }
}

/// A place in a window: the pixel at or before it, and the way from there.
#[derive(Clone, Copy)]
struct Start {
    column: isize,
    row: isize,
    fraction: [f32; 2],
}

impl Start {
    #[inline(always)]
    fn new(window: &Window, [x, y]: [f64; 2]) -> Self {
        let (x, y) = (x - window.region.x as f64, y - window.region.y as f64);
        let (column, row) = (x as isize, y as isize); // inside the window: not negative
        Self { column, row, fraction: [(x - column as f64) as f32, (y - row as f64) as f32] }
    }
}

/// Samples row by row, a vector of points at once. `samples` has room for [`LANES`] more: the last points of a row that lie
/// outside of the subset are overwritten by the next row.
///
/// Written in explicit vectors, for compilers unroll a loop over an array's lanes before they think of vectors. Neither is there a closure
/// between the vectors: what is not put in line is compiled without their instructions.
struct RowSampling<'a, K, const TAPS: usize> {
    window: &'a Window,
    warp: &'a Warp,
    lattice: Lattice,
    samples: &'a mut [f32],
    kernel: PhantomData<K>,
}

impl<K: Kernel<TAPS>, const TAPS: usize> InBlocks for RowSampling<'_, K, TAPS> {
    type Output = ();

    /// Points between the same coefficients are sampled together, for there what is one pixel further in the subset takes the coefficients one
    /// further. Vectors begin where such a stretch begins: what they hold beyond its end is overwritten by the next one.
    #[inline(always)]
    fn run<S: Simd, const VECTORS: usize>(self, simd: S) {
        let Self { window, warp, lattice, samples, .. } = self;
        for first_row in (0..lattice.height).step_by(TOGETHER) {
            let lines = Lines::new(window, warp, lattice, first_row);
            for (i, row) in (first_row..lattice.height).take(TOGETHER).enumerate() {
                let line = lines.line(i);
                let out = &mut samples[row * lattice.width..];
                // Most rows of a body that is hardly strained lie between the same coefficients from end to end.
                if lines.is_one_stretch[i] {
                    let (whole, pixel) = lines.first(i);
                    line.sample::<S, K, TAPS, false>(simd, window, whole, pixel, 0..lattice.width, out);
                    continue;
                }
                let line = std::hint::black_box(line);
                let mut first = 0;
                while first < lattice.width {
                    let (whole, end) = line.stretch(first, lattice.width);
                    let pixel = line.pixel(whole);
                    line.sample::<S, K, TAPS, true>(simd, window, whole, pixel, first..end, out);
                    first = end;
                }
            }
        }
    }
}

/// Rows whose beginnings are worked out together.
const TOGETHER: usize = 8;

/// Where some rows of points begin, number by number, which lets vectors work them out.
struct Lines {
    /// The pixel of the window at or before the first point.
    pixel: [[i32; TOGETHER]; 2],
    fraction: [[f32; TOGETHER]; 2],
    step: [[f32; TOGETHER]; 2],
    bend: [f32; 2],
    /// The whole part of the way of the first point.
    whole: [[f32; TOGETHER]; 2],
    /// The pixel that it leads to.
    reached: [[i32; TOGETHER]; 2],
    /// Whether the whole way has that whole part.
    is_one_stretch: [bool; TOGETHER],
}

impl Lines {
    /// The rows from `first_row` on of a subset.
    #[inline(always)]
    fn new(window: &Window, warp: &Warp, lattice: Lattice, first_row: usize) -> Self {
        let [first_x, first_y] = lattice.first_px;
        let [ux, _, vx, _] = warp.gradient;
        let [uxx, uxy, _, vxx, vxy, _] = warp.curvature;
        let origin = [window.region.x as f64, window.region.y as f64];
        let slopes = [[ux, uxx, uxy], [vx, vxx, vxy]];
        let mut lines = Self {
            pixel: [[0; TOGETHER]; 2],
            fraction: [[0.0; TOGETHER]; 2],
            step: [[0.0; TOGETHER]; 2],
            bend: [uxx as f32, vxx as f32],
            whole: [[0.0; TOGETHER]; 2],
            reached: [[0; TOGETHER]; 2],
            is_one_stretch: [lattice.width > 0; TOGETHER],
        };
        let last = lattice.width.saturating_sub(1) as i32 as f32;
        for i in 0..TOGETHER {
            let y = first_y + (first_row + i) as i32 as f64;
            let place = warp.apply([first_x, y]);
            for axis in 0..2 {
                let at = place[axis] - origin[axis];
                let pixel = at.trunc(); // inside the window: not negative
                let [first, square, mixed] = slopes[axis];
                let (fraction, step) =
                    ((at - pixel) as f32, (first + 2.0 * square * first_x + mixed * y) as f32);
                let whole = fraction.floor();
                // A way that bends may leave the whole part and come back.
                let is_straight = lines.bend[axis] == 0.0;
                let at_last = lines.bend[axis].mul_add(last, step).mul_add(last, fraction).floor();
                (lines.pixel[axis][i], lines.fraction[axis][i]) = (pixel as i32, fraction);
                lines.reached[axis][i] = (pixel + f64::from(whole)) as i32;
                (lines.step[axis][i], lines.whole[axis][i]) = (step, whole);
                lines.is_one_stretch[i] &= is_straight & is_same(at_last, whole);
            }
        }
        lines
    }

    /// The row number `i` of these.
    #[inline(always)]
    fn line(&self, i: usize) -> Line {
        let [column, row] = [self.pixel[0][i] as isize, self.pixel[1][i] as isize];
        let start = Start { column, row, fraction: [self.fraction[0][i], self.fraction[1][i]] };
        Line { start, step: [self.step[0][i], self.step[1][i]], bend: self.bend }
    }

    /// The whole part of the way of the first point of row number `i`, and the pixel that it leads to.
    #[inline(always)]
    fn first(&self, i: usize) -> ([f32; 2], [isize; 2]) {
        ([0, 1].map(|axis| self.whole[axis][i]), [0, 1].map(|axis| self.reached[axis][i] as isize))
    }
}

/// A row of points: point i lies at `start.column + i + start.fraction[0] + step[0] i + bend[0] i^2`, and
/// `start.row + start.fraction[1] + step[1] i + bend[1] i^2`.
#[derive(Clone, Copy)]
struct Line {
    start: Start,
    step: [f32; 2],
    bend: [f32; 2],
}

impl Line {
    /// The whole part of what the point i has moved from the start's pixels beyond its own i columns.
    #[inline(always)]
    fn whole(&self, i: usize) -> [f32; 2] {
        let i = i as i32 as f32;
        let mut whole = [0.0; 2];
        for (axis, whole) in whole.iter_mut().enumerate() {
            let slope = self.bend[axis].mul_add(i, self.step[axis]);
            *whole = slope.mul_add(i, self.start.fraction[axis]).floor();
        }
        whole
    }

    /// The whole part of the way of the point `first`, and the first point of another one, at most `end`.
    #[inline(always)]
    fn stretch(&self, first: usize, end: usize) -> ([f32; 2], usize) {
        let whole = self.whole(first);
        let end = self.turn(0, first, end).min(self.turn(1, first, end));
        let (mut inside, mut outside) = (first, end);
        if self.is_at(end - 1, whole) {
            return (whole, end);
        }
        while outside - inside > 1 {
            let middle = usize::midpoint(inside, outside);
            if self.is_at(middle, whole) { inside = middle } else { outside = middle }
        }
        (whole, outside)
    }

    /// The pixel that a whole part leads to from the start.
    #[inline(always)]
    fn pixel(&self, whole: [f32; 2]) -> [isize; 2] {
        [self.start.column + whole[0] as i32 as isize, self.start.row + whole[1] as i32 as isize]
    }

    /// Whether this is the whole part of the way of the point i.
    #[inline(always)]
    fn is_at(&self, i: usize, whole: [f32; 2]) -> bool {
        let [x, y] = self.whole(i);
        is_same(x, whole[0]) & is_same(y, whole[1])
    }

    /// The first point behind `first` from which on the way turns back, at most `end`: up to there it grows or falls.
    #[inline(always)]
    fn turn(&self, axis: usize, first: usize, end: usize) -> usize {
        if self.bend[axis] == 0.0 {
            return end;
        }
        let turn = (-0.5 * self.step[axis] / self.bend[axis]).ceil();
        if turn > first as f32 && turn < end as f32 { turn as usize } else { end }
    }

    /// Samples these points, and what fills a last vector, as if the way of all had this whole part.
    #[inline(always)]
    fn sample<S: Simd, K: Kernel<TAPS>, const TAPS: usize, const BENDS: bool>(
        &self,
        simd: S,
        window: &Window,
        whole: [f32; 2],
        [column, line]: [isize; 2],
        points: Range<usize>,
        row: &mut [f32],
    ) {
        let corner = window.corner::<TAPS>(column + points.start as isize, line);
        let n = points.len().div_ceil(S::F32_LANES);
        // Cut to one length before the loop, within which nothing needs to be checked.
        let mut coefficients: [[&[S::f32s]; TAPS]; TAPS] = [[&[]; TAPS]; TAPS];
        for (line, coefficients) in coefficients.iter_mut().enumerate() {
            let line = &window.coefficients[corner + line * window.stride..][..n * S::F32_LANES + TAPS - 1];
            for (tap, coefficients) in coefficients.iter_mut().enumerate() {
                *coefficients = &S::as_simd_f32s(&line[tap..]).0[..n];
            }
        }
        let out = &mut S::as_mut_simd_f32s(&mut row[points.start..][..n * S::F32_LANES]).0[..n];
        let mut i =
            simd.add_f32s(simd.splat_f32s(points.start as i32 as f32), S::as_simd_f32s(&FIRST_NUMBERS).0[0]);
        let next = simd.splat_f32s(S::F32_LANES as f32);
        for (at, out) in out.iter_mut().enumerate() {
            let mut along = [i; 2];
            for axis in 0..2 {
                let mut slope = simd.splat_f32s(self.step[axis]);
                if BENDS {
                    slope = simd.mul_add_f32s(simd.splat_f32s(self.bend[axis]), i, slope);
                }
                let way = simd.mul_add_f32s(slope, i, simd.splat_f32s(self.start.fraction[axis]));
                along[axis] = simd.sub_f32s(way, simd.splat_f32s(whole[axis]));
            }
            i = simd.add_f32s(i, next);
            let weights_x: [S::f32s; TAPS] = K::WEIGHTS.at_all(simd, along[0]);
            let weights_y: [S::f32s; TAPS] = K::WEIGHTS.at_all(simd, along[1]);
            let mut value = simd.splat_f32s(0.0);
            for (line, weight_y) in coefficients.iter().zip(weights_y) {
                let mut sum = simd.mul_f32s(weights_x[0], line[0][at]);
                for tap in 1..TAPS {
                    sum = simd.mul_add_f32s(weights_x[tap], line[tap][at], sum);
                }
                value = simd.mul_add_f32s(weight_y, sum, value);
            }
            *out = value;
        }
    }
}

/// Whether two whole numbers are one.
#[inline(always)]
fn is_same(one: f32, other: f32) -> bool {
    (one - other).abs() < 0.5
}

/// 0, 1, 2 and so on.
const FIRST_NUMBERS: [f32; LANES] = {
    let mut numbers = [0.0; LANES];
    let mut i = 0;
    while i < LANES {
        numbers[i] = i as f32;
        i += 1;
    }
    numbers
};

#[cfg(test)]
mod tests {
    use super::*;
    use chainwave_measurement::Region;

    fn noise(region: Region) -> Vec<f32> {
        (0..region.n_pixels()).map(|i| ((i * 7919) % 4096) as f32).collect()
    }

    /// The interpolated value at one point, by the definition: f64, one point after the other.
    fn plain<K: Kernel<TAPS>, const TAPS: usize>(window: &Window, [x, y]: [f64; 2]) -> f64 {
        let (x, y) = (x - window.region.x as f64, y - window.region.y as f64);
        let weights = |t: f64| K::WEIGHTS.at::<TAPS>(t as f32).map(f64::from);
        let (weights_x, weights_y) = (weights(x - x.floor()), weights(y - y.floor()));
        let corner = window.corner::<TAPS>(x.floor() as isize, y.floor() as isize);
        let mut sum = 0.0;
        for (j, weight_y) in weights_y.into_iter().enumerate() {
            for (i, weight_x) in weights_x.into_iter().enumerate() {
                sum += weight_x * weight_y * f64::from(window.coefficients[corner + j * window.stride + i]);
            }
        }
        sum
    }

    fn plain_of(window: &Window, point: [f64; 2]) -> f64 {
        match window.interpolation {
            Interpolation::Linear => plain::<BSpline, 2>(window, point),
            Interpolation::Cubic => plain::<BSpline, 4>(window, point),
            Interpolation::CubicMoms => plain::<Moms, 4>(window, point),
            Interpolation::Quintic => plain::<BSpline, 6>(window, point),
            Interpolation::QuinticMoms => plain::<Moms, 6>(window, point),
        }
    }

    #[test]
    fn every_path_agrees_with_single_points() {
        let region = Region { x: 4, y: 9, width: 110, height: 100 };
        let pixels = noise(region);
        let gradients = [
            [0.0; 4],
            [1e-4, -2e-4, 3e-4, 1e-4],
            [0.02, 0.01, -0.015, -0.02],
            [0.1, 0.05, 0.08, -0.1],
            [-0.4, -0.6, 0.6, -0.4],
        ];
        let warp_of = |gradient: [f64; 4]| Warp { gradient, ..Warp::at([58.3, 57.8]) };
        let curved = Warp { curvature: [2e-3, -1e-3, 1e-3, -3e-3, 2e-3, 1e-3], ..warp_of(gradients[2]) };
        let warps: Vec<Warp> = gradients.map(warp_of).into_iter().chain([curved]).collect();
        for interpolation in Interpolation::ALL {
            let window = Window::new(region, &pixels, interpolation).unwrap();
            for warp in &warps {
                for (width, height) in [(33, 33), (41, 9), (9, 20), (16, 3), (61, 31)] {
                    let first_px = [-0.5 * width as f64, -0.5 * height as f64];
                    let lattice = Lattice { first_px, width, height };
                    let mut samples = vec![0.0; width * height + LANES];
                    sample(&window, warp, lattice, &mut Vec::new(), &mut samples);
                    for (i, &found) in samples[..width * height].iter().enumerate() {
                        let place = [first_px[0] + (i % width) as f64, first_px[1] + (i / width) as f64];
                        let expected = plain_of(&window, warp.apply(place));
                        // coordinates in f32 are good to 2e-6 px; this noise changes by up to 3e4 counts a pixel
                        assert!(
                            (f64::from(found) - expected).abs() < 0.1,
                            "{interpolation} {warp:?} {width} {i}: {found} {expected}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn bits_do_not_depend_on_the_instruction_set() {
        let region = Region::whole(80, 80);
        let window = Window::new(region, &noise(region), Interpolation::CubicMoms).unwrap();
        let warp = Warp { gradient: [0.02, 0.01, -0.015, -0.02], ..Warp::at([40.3, 40.8]) };
        let lattice = Lattice { first_px: [-16.0; 2], width: 33, height: 33 };
        let (mut plain, mut best) = (vec![0.0_f32; 33 * 33 + LANES], vec![0.0_f32; 33 * 33 + LANES]);
        let samples = plain.as_mut_slice();
        let kernel = PhantomData::<Moms>;
        RowSampling::<Moms, 4> { window: &window, warp: &warp, lattice, samples, kernel }.scalar();
        sample(&window, &warp, lattice, &mut Vec::new(), &mut best);
        assert_eq!(plain[..33 * 33], best[..33 * 33]);
    }
}
