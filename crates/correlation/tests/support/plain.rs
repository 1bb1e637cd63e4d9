//! The textbook's IC-GN, one pixel after the other in f64: what the vectorised one must agree with, and is timed against.
//! B. Pan, K. Li, W. Tong, Exp. Mech. 53 (2013) 1277-1289.

use nalgebra::{Matrix3, Matrix6, Vector6};

/// Coefficients of the cubic B-spline through the pixels of an image.
pub(crate) struct Spline {
    width: usize,
    coefficients: Vec<f64>,
}

impl Spline {
    pub(crate) fn through(width: usize, pixels: &[f32]) -> Self {
        let mut coefficients: Vec<f64> = pixels.iter().map(|&pixel| f64::from(pixel)).collect();
        let height = pixels.len() / width;
        for row in 0..height {
            prefilter(&mut coefficients, row * width, 1, width);
        }
        for column in 0..width {
            prefilter(&mut coefficients, column, width, height);
        }
        Self { width, coefficients }
    }

    /// The value at a place, and its derivatives along x and y.
    pub(crate) fn at(&self, x: f64, y: f64) -> [f64; 3] {
        let (column, row) = (x.floor(), y.floor());
        let ([wx, dx], [wy, dy]) = (weights(x - column), weights(y - row));
        let mut sums = [0.0; 3];
        for j in 0..4 {
            for i in 0..4 {
                let c = self.coefficients[(row as usize + j - 1) * self.width + column as usize + i - 1];
                sums[0] += wx[i] * wy[j] * c;
                sums[1] += dx[i] * wy[j] * c;
                sums[2] += wx[i] * dy[j] * c;
            }
        }
        sums
    }
}

/// The recursive filter along a line, which is mirrored at its start and end (M. Unser, A. Aldroubi, M. Eden 1993).
fn prefilter(values: &mut [f64], start: usize, stride: usize, n: usize) {
    let pole = 3.0_f64.sqrt() - 2.0;
    let at = |i: usize| start + i * stride;
    let mut first = 0.0;
    for i in (0..n.min(24)).rev() {
        first = values[at(i)] + pole * first;
    }
    values[at(0)] = first;
    for i in 1..n {
        values[at(i)] += pole * values[at(i - 1)];
    }
    values[at(n - 1)] = pole / (pole * pole - 1.0) * (values[at(n - 1)] + pole * values[at(n - 2)]);
    for i in (0..n - 1).rev() {
        values[at(i)] = pole * (values[at(i + 1)] - values[at(i)]);
    }
    (0..n).for_each(|i| values[at(i)] *= 6.0);
}

/// Weights of the four coefficients around a point at the fraction t, and their derivatives.
fn weights(t: f64) -> [[f64; 4]; 2] {
    let u = 1.0 - t;
    let inner = |t: f64| (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0;
    let slope = |t: f64| (9.0 * t * t - 12.0 * t) / 6.0;
    [[u * u * u / 6.0, inner(t), inner(u), t * t * t / 6.0], [-0.5 * u * u, slope(t), -slope(u), 0.5 * t * t]]
}

/// A subset of `2 half + 1` pixels a side, prepared.
pub(crate) struct Plain {
    half: i32,
    intensity: Vec<f64>,
    norm: f64,
    steepest: Vec<Vector6<f64>>,
    inverse: Matrix6<f64>,
}

impl Plain {
    pub(crate) fn new(reference: &Spline, centre: [f64; 2], half: i32) -> Self {
        let (mut intensity, mut steepest, mut hessian) = (Vec::new(), Vec::new(), Matrix6::zeros());
        for (x, y) in places(half) {
            let [f, fx, fy] = reference.at(centre[0] + x, centre[1] + y);
            let j = Vector6::new(fx, fx * x, fx * y, fy, fy * x, fy * y);
            hessian += j * j.transpose();
            intensity.push(f);
            steepest.push(j);
        }
        let norm = normalise(&mut intensity);
        Self { half, intensity, norm, steepest, inverse: hessian.try_inverse().unwrap() }
    }

    /// The displaced centre, from a start, once a step moves no corner by more than 1 mpx, and how many steps
    /// that took; `None` beyond 20.
    pub(crate) fn find(&self, target: &Spline, start: [f64; 2]) -> Option<([f64; 2], u32)> {
        let mut warp = Matrix3::new(1.0, 0.0, start[0], 0.0, 1.0, start[1], 0.0, 0.0, 1.0);
        for iteration in 1..=20 {
            let at = |(x, y): (f64, f64)| {
                target.at(
                    warp[(0, 2)] + warp[(0, 0)] * x + warp[(0, 1)] * y,
                    warp[(1, 2)] + warp[(1, 0)] * x + warp[(1, 1)] * y,
                )[0]
            };
            let mut samples: Vec<f64> = places(self.half).map(at).collect();
            let norm = normalise(&mut samples);
            let mut sum = Vector6::zeros();
            for ((g, f), j) in samples.iter().zip(&self.intensity).zip(&self.steepest) {
                sum += j * (self.norm / norm * g - f);
            }
            let p = self.inverse * sum;
            let step = Matrix3::new(1.0 + p[1], p[2], p[0], p[4], 1.0 + p[5], p[3], 0.0, 0.0, 1.0);
            warp *= step.try_inverse().unwrap();
            let reach = f64::from(self.half);
            let edge = |shift: f64, a: f64, b: f64| shift.abs() + (a.abs() + b.abs()) * reach;
            if edge(p[0], p[1], p[2]).hypot(edge(p[3], p[4], p[5])) < 1e-3 {
                return Some(([warp[(0, 2)], warp[(1, 2)]], iteration));
            }
        }
        None
    }
}

fn places(half: i32) -> impl Iterator<Item = (f64, f64)> {
    (-half..=half).flat_map(move |y| (-half..=half).map(move |x| (f64::from(x), f64::from(y))))
}

/// Takes the mean off and returns the norm of what is left.
fn normalise(values: &mut [f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter_mut().for_each(|value| *value -= mean);
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}
