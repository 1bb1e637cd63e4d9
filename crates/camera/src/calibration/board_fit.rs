//! Calibration by pictures of a board: lens distortion, perspective and scale by least squares, with their covariance.

use nalgebra::{DMatrix, DVector, Dyn, linalg::Cholesky};

use super::checks::{check_length, refusal};
use super::lens::Lens;
use super::plane::{PlaneMap, adjugate, corners_px, product, projected};
use super::{Calibration, MapError, Source};
use crate::board::{Board, Corner};
use crate::error::CameraError;

/// Unknowns of a picture: the perspective in which it shows the board.
const PER_PICTURE: usize = 8;
/// Unknowns of the lens: k1, k2 and the centre.
const OF_LENS: usize = 4;
/// Corners that a picture needs, so that some are left over to tell their errors.
const FEWEST_CORNERS: usize = 9;
/// Standard deviation of the optical axis from the picture's centre, as a part of the picture's half diagonal: the
/// tolerance of a lens's mount and of a sensor's place behind it. Pictures of weak distortion tell the centre no better, and
/// then it hardly matters.
const CENTRE_PRIOR: f64 = 0.05;
/// Rounds after which the fit stops in any case; 6 to 10 are usual.
const MAX_ROUNDS: usize = 60;
/// An error that moves points by less than this part of the largest error's effect is left out.
const LEAST_EFFECT: f64 = 1e-3;

impl Calibration {
    /// The lens's distortion, the perspective and the scale from pictures of one board. In the first, the board lies in the
    /// plane in which the chain moves; in the others, wherever it was held, which tells more of the lens.
    ///
    /// Least squares over all corners (Zhang, 2000), but with a free perspective for each picture in place of a camera at a
    /// distance: a board parallel to the sensor, as in the first picture, leaves focal length and distance open, and only
    /// their ratio is needed. The corners' residuals tell their standard error. In the plane, x points along the picture's
    /// rows at its centre, which is 0.
    ///
    /// # Errors
    /// [`CameraError::Calibration`] for no picture, fewer than nine corners in one, corners in a line, or a distortion that
    /// cannot be undone.
    pub fn from_boards(
        pictures: &[Vec<Corner>],
        board: &Board,
        (width_px, height_px): (usize, usize),
    ) -> Result<Self, CameraError> {
        check_length("side of a square in metres", board.square_m)?;
        let fewest = pictures.iter().map(Vec::len).min().unwrap_or(0);
        if fewest < FEWEST_CORNERS {
            return Err(refusal("corners in a picture", "9 or more in each", fewest as f64));
        }
        let place = |corner: &Corner| corner.x_px + corner.y_px;
        if let Some(lost) = pictures.iter().flatten().map(place).find(|place| !place.is_finite()) {
            return Err(refusal("place of a corner", "finite numbers", lost));
        }
        let frame = Frame::new(width_px, height_px);
        let fitted = Fit::new(pictures, frame)?.solve()?;
        let plane = |unknowns: &DVector<f64>| frame.plane_map(unknowns, board.square_m.value);
        let map = plane(&fitted.unknowns);
        map.check(width_px, height_px)?;
        let errors = principal_errors(&fitted, &plane, (width_px, height_px));
        let errors = errors.into_iter().map(|map| MapError { source: Source::Points, map }).collect();
        let calibration = Self { map, errors, residual_px: fitted.residual_px };
        Ok(calibration.with_scale_error(Source::Length, board.square_m.sigma / board.square_m.value))
    }
}

/// The picture's own measures, in which all unknowns are of order one.
#[derive(Clone, Copy)]
struct Frame {
    middle_px: [f64; 2],
    /// Half the diagonal.
    radius_px: f64,
}

impl Frame {
    fn new(width_px: usize, height_px: usize) -> Self {
        let [_, _, _, [right, bottom]] = corners_px(width_px, height_px);
        Self { middle_px: [right / 2.0, bottom / 2.0], radius_px: right.hypot(bottom) / 2.0 }
    }

    /// The lens that the last four unknowns describe.
    fn lens(&self, unknowns: &DVector<f64>) -> Lens {
        let of_lens = unknowns.len() - OF_LENS;
        let centre = |axis: usize| self.middle_px[axis] + self.radius_px * unknowns[of_lens + 2 + axis];
        Lens {
            centre_px: [centre(0), centre(1)],
            focal_px: self.radius_px,
            k1: unknowns[of_lens],
            k2: unknowns[of_lens + 1],
        }
    }

    /// The homography from squares of the board to undistorted pixels that eight unknowns describe.
    fn image_from_board(&self, unknowns: &[f64]) -> [[f64; 3]; 3] {
        let u = unknowns;
        let [x, y] = self.middle_px;
        let to_pixels = [[self.radius_px, 0.0, x], [0.0, self.radius_px, y], [0.0, 0.0, 1.0]];
        product(&to_pixels, &[[u[0], u[1], u[2]], [u[3], u[4], u[5]], [u[6], u[7], 1.0]])
    }

    /// The map of the first picture's board, turned so that x follows the picture's rows at its centre, which is 0.
    fn plane_map(&self, unknowns: &DVector<f64>, square_m: f64) -> PlaneMap {
        let lens = self.lens(unknowns);
        let board_from_image = adjugate(&self.image_from_board(&unknowns.as_slice()[..PER_PICTURE]));
        let in_squares = PlaneMap { lens, plane_from_image: board_from_image };
        let [[xx, xy], [yx, yy]] = in_squares.m_per_px(self.middle_px);
        let length = xx.hypot(yx);
        let (cosine, sine) = (square_m * xx / length, square_m * yx / length);
        // A board whose corners are counted the other way round is turned over.
        let side = if xx * yy - xy * yx < 0.0 { -1.0 } else { 1.0 };
        let turn = [[cosine, sine, 0.0], [-side * sine, side * cosine, 0.0], [0.0, 0.0, 1.0]];
        let [x_m, y_m] = projected(&turn, in_squares.position_m(self.middle_px));
        let shift = [[1.0, 0.0, -x_m], [0.0, 1.0, -y_m], [0.0, 0.0, 1.0]];
        let plane_from_image = product(&shift, &product(&turn, &board_from_image));
        let norm = plane_from_image[2][2];
        PlaneMap { lens, plane_from_image: plane_from_image.map(|row| row.map(|entry| entry / norm)) }
    }
}

/// A corner on the board, in squares from the middle of those seen, and in the picture.
struct SeenCorner {
    board: [f64; 2],
    at_px: [f64; 2],
}

/// What the corners give.
struct Fitted {
    unknowns: DVector<f64>,
    /// Square root of the covariance of the first picture's unknowns and the lens's, column by column; the same order, and
    /// zero for the other pictures.
    errors: Vec<DVector<f64>>,
    residual_px: f64,
}

struct Fit {
    frame: Frame,
    pictures: Vec<Vec<SeenCorner>>,
}

impl Fit {
    fn new(pictures: &[Vec<Corner>], frame: Frame) -> Result<Self, CameraError> {
        let points = |corners: &Vec<Corner>| {
            let n = corners.len() as f64;
            let middle = [
                corners.iter().map(|corner| corner.column as f64).sum::<f64>() / n,
                corners.iter().map(|corner| corner.row as f64).sum::<f64>() / n,
            ];
            let point = |corner: &Corner| SeenCorner {
                board: [corner.column as f64 - middle[0], corner.row as f64 - middle[1]],
                at_px: [corner.x_px, corner.y_px],
            };
            corners.iter().map(point).collect::<Vec<SeenCorner>>()
        };
        Ok(Self { frame, pictures: pictures.iter().map(points).collect() })
    }

    fn n_unknowns(&self) -> usize {
        PER_PICTURE * self.pictures.len() + OF_LENS
    }

    /// Levenberg and Marquardt's iteration; the corners' variance, which weighs them against the centre's prior, follows from
    /// their residuals.
    fn solve(&self) -> Result<Fitted, CameraError> {
        let mut unknowns = self.start()?;
        let n_free =
            2.0 * self.pictures.iter().map(Vec::len).sum::<usize>() as f64 - (self.n_unknowns() - 2) as f64;
        let mut variance_px2 = self.squares(&unknowns) / n_free;
        let mut damping = 1e-3;
        for _ in 0..MAX_ROUNDS {
            let (normal, gradient) = self.normal_equations(&unknowns, variance_px2);
            let cost = self.cost(&unknowns, variance_px2);
            let mut damped = normal.clone();
            (0..damped.nrows()).for_each(|k| damped[(k, k)] *= 1.0 + damping);
            let step = factored(damped)?.solve(&gradient);
            let trial = &unknowns - &step;
            let trial_cost = self.cost(&trial, variance_px2);
            if trial_cost <= cost {
                unknowns = trial;
                damping *= 0.1;
                variance_px2 = self.squares(&unknowns) / n_free;
                if cost - trial_cost <= 1e-12 * cost && step.amax() < 1e-9 {
                    break;
                }
            } else if step.amax() < 1e-12 {
                break;
            } else {
                damping *= 10.0;
            }
        }
        let (normal, _) = self.normal_equations(&unknowns, variance_px2);
        let covariance = factored(normal)?.inverse() * variance_px2;
        let residual_px = (self.squares(&unknowns) / n_free).sqrt();
        Ok(Fitted { errors: self.errors(&covariance), unknowns, residual_px })
    }

    /// Perspectives without distortion.
    fn start(&self) -> Result<DVector<f64>, CameraError> {
        let mut unknowns = DVector::zeros(self.n_unknowns());
        for (index, points) in self.pictures.iter().enumerate() {
            let perspective = perspective(points, self.frame)?;
            unknowns.rows_mut(PER_PICTURE * index, PER_PICTURE).copy_from(&perspective);
        }
        Ok(unknowns)
    }

    /// Each corner with the number of its picture's first unknown.
    fn points(&self) -> impl Iterator<Item = (usize, &SeenCorner)> {
        let numbered = self.pictures.iter().enumerate();
        numbered.flat_map(|(index, points)| points.iter().map(move |point| (PER_PICTURE * index, point)))
    }

    fn residual(&self, unknowns: &DVector<f64>, first: usize, point: &SeenCorner) -> [f64; 2] {
        let matrix = self.frame.image_from_board(&unknowns.as_slice()[first..first + PER_PICTURE]);
        let model_px = self.frame.lens(unknowns).distorted_px(projected(&matrix, point.board));
        [model_px[0] - point.at_px[0], model_px[1] - point.at_px[1]]
    }

    fn squares(&self, unknowns: &DVector<f64>) -> f64 {
        self.points()
            .map(|(first, point)| {
                let [x, y] = self.residual(unknowns, first, point);
                x * x + y * y
            })
            .sum()
    }

    fn cost(&self, unknowns: &DVector<f64>, variance_px2: f64) -> f64 {
        let centre = unknowns.rows(unknowns.len() - 2, 2).norm_squared();
        self.squares(unknowns) + variance_px2 * centre / CENTRE_PRIOR.powi(2)
    }

    fn normal_equations(&self, unknowns: &DVector<f64>, variance_px2: f64) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.n_unknowns();
        let (mut normal, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
        let columns = |first: usize| (first..first + PER_PICTURE).chain(n - OF_LENS..n);
        for (first, point) in self.points() {
            let slopes = self.slopes(unknowns, first, point);
            let residual = self.residual(unknowns, first, point);
            for (slopes, residual) in slopes.iter().zip(residual) {
                for (i, slope) in columns(first).zip(slopes) {
                    gradient[i] += slope * residual;
                    for (j, other) in columns(first).zip(slopes) {
                        normal[(i, j)] += slope * other;
                    }
                }
            }
        }
        for i in n - 2..n {
            normal[(i, i)] += variance_px2 / CENTRE_PRIOR.powi(2);
            gradient[i] += variance_px2 / CENTRE_PRIOR.powi(2) * unknowns[i];
        }
        (normal, gradient)
    }

    /// Derivatives of a corner's place by its picture's unknowns and the lens's, in pixels.
    fn slopes(&self, unknowns: &DVector<f64>, first: usize, point: &SeenCorner) -> [[f64; 12]; 2] {
        let matrix = self.frame.image_from_board(&unknowns.as_slice()[first..first + PER_PICTURE]);
        let lens = self.frame.lens(unknowns);
        let ideal_px = projected(&matrix, point.board);
        let distortion = lens.distortion_jacobian(ideal_px);
        let ray = lens.normalised(ideal_px);
        let square = ray[0] * ray[0] + ray[1] * ray[1];
        let radius_px = self.frame.radius_px;
        let [x, y] = point.board;
        let weight = 1.0 + unknowns[first + 6] * x + unknowns[first + 7] * y;
        let undistorted = [0, 1].map(|axis| (ideal_px[axis] - self.frame.middle_px[axis]) / radius_px);
        let row = |axis: usize| {
            let [along_x, along_y] = distortion[axis].map(|slope| slope * radius_px / weight);
            let tilt = -(along_x * undistorted[0] + along_y * undistorted[1]);
            // A centre that moves takes the distortion with it and leaves the ideal point.
            let centre = [0, 1].map(|other| {
                let identity = if axis == other { 1.0 } else { 0.0 };
                radius_px * (identity - distortion[axis][other])
            });
            let (k1, k2) = (radius_px * ray[axis] * square, radius_px * ray[axis] * square * square);
            [
                along_x * x,
                along_x * y,
                along_x,
                along_y * x,
                along_y * y,
                along_y,
                tilt * x,
                tilt * y,
                k1,
                k2,
                centre[0],
                centre[1],
            ]
        };
        [row(0), row(1)]
    }

    fn errors(&self, covariance: &DMatrix<f64>) -> Vec<DVector<f64>> {
        let n = self.n_unknowns();
        let kept: Vec<usize> = (0..PER_PICTURE).chain(n - OF_LENS..n).collect();
        let block = DMatrix::from_fn(kept.len(), kept.len(), |i, j| covariance[(kept[i], kept[j])]);
        let eigen = (0.5 * (&block + block.transpose())).symmetric_eigen();
        (0..kept.len())
            .map(|k| {
                let mut error = DVector::zeros(n);
                let sigma = eigen.eigenvalues[k].max(0.0).sqrt();
                kept.iter().enumerate().for_each(|(i, at)| error[*at] = sigma * eigen.eigenvectors[(i, k)]);
                error
            })
            .collect()
    }
}

/// Cholesky's factor of normal equations.
fn factored(normal: DMatrix<f64>) -> Result<Cholesky<f64, Dyn>, CameraError> {
    normal.cholesky().ok_or_else(|| refusal("corners", "some that do not lie in a line", f64::NAN))
}

/// The perspective of a picture from its corners by linear least squares, without distortion (the direct linear transform).
fn perspective(points: &[SeenCorner], frame: Frame) -> Result<DVector<f64>, CameraError> {
    let mut matrix = DMatrix::zeros(2 * points.len(), PER_PICTURE);
    let mut right = DVector::zeros(2 * points.len());
    for (index, point) in points.iter().enumerate() {
        let [x, y] = point.board;
        for axis in 0..2 {
            let at = (point.at_px[axis] - frame.middle_px[axis]) / frame.radius_px;
            let row = 2 * index + axis;
            for (column, value) in [x, y, 1.0].into_iter().enumerate() {
                matrix[(row, 3 * axis + column)] = value;
            }
            (matrix[(row, 6)], matrix[(row, 7)]) = (-at * x, -at * y);
            right[row] = at;
        }
    }
    let decomposed = matrix.svd(true, true);
    let (largest, smallest) = (decomposed.singular_values.max(), decomposed.singular_values.min());
    let is_flat = smallest.is_finite() && smallest > 1e-6 * largest;
    let solution = decomposed.solve(&right, 0.0).ok().filter(|_| is_flat);
    solution.ok_or_else(|| refusal("corners", "some that do not lie in a line", smallest / largest))
}

/// The maps with the errors of the fit, turned so that each moves points of the picture independently of the others and those
/// come first that move them most; only motion relative to the picture's centre counts, for displacements are all that is
/// measured.
fn principal_errors(
    fitted: &Fitted,
    plane: &dyn Fn(&DVector<f64>) -> PlaneMap,
    (width_px, height_px): (usize, usize),
) -> Vec<PlaneMap> {
    const GRID: usize = 9;
    let grid_px = |index: usize, size: usize| (size as f64 - 1.0) * index as f64 / (GRID as f64 - 1.0);
    let points = (0..GRID * GRID).map(|at| [grid_px(at % GRID, width_px), grid_px(at / GRID, height_px)]);
    let points: Vec<[f64; 2]> = points.collect();
    let places = |map: &PlaneMap| {
        DVector::from_iterator(2 * points.len(), points.iter().flat_map(|at_px| map.position_m(*at_px)))
    };
    let nominal = places(&plane(&fitted.unknowns));
    let effects: Vec<DVector<f64>> =
        fitted.errors.iter().map(|error| places(&plane(&(&fitted.unknowns + error))) - &nominal).collect();
    let effects = DMatrix::from_columns(&effects);
    let eigen = effects.tr_mul(&effects).symmetric_eigen();
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let least = order.first().map_or(0.0, |first| LEAST_EFFECT.powi(2) * eigen.eigenvalues[*first]);
    let kept = order.into_iter().filter(|k| eigen.eigenvalues[*k] > least);
    kept.map(|k| {
        let mut unknowns = fitted.unknowns.clone();
        for (error, share) in fitted.errors.iter().zip(eigen.eigenvectors.column(k).iter()) {
            unknowns.axpy(*share, error, 1.0);
        }
        plane(&unknowns)
    })
    .collect()
}
