//! What the shape function leaves of a field that bends: found from the neighbours, taken off, and what is left of it stated.
//!
//! A match follows the displacement within its subset to the order of its shape function and gives a weighted mean of the
//! rest ([`crate::prepared::response`]); at a wave of three subsets' length an affine one misses a sixth of the amplitude. A subset
//! alone tells the next order badly: a quadratic match has twice the noise. The points around it tell it well.
//!
//! 1. Where a field bends is tested ([`bend`]), at a level of 1 %. Elsewhere nothing is changed.
//! 2. There the displacement is taken for a polynomial of second order, and of fourth, of which the matches of 5 x 5 points are
//!    what they are ([`local_fit`]). Both give an error b of the match, with covariances of their noise: b_2, and d = b_4 - b_2.
//! 3. How large they really are around a point, beyond their noise, is told by all points near it: `t^2 = mean(b^2 - var b)`,
//!    no less than 0. With that for a prior (empirical Bayes: H. Robbins, Proc. 3rd Berkeley Symp. 1 (1956) 157-163) so much of both is
//!    taken off, `l = (V + T)^-1 (T 1 + q)`, V and q the covariances of their noise with each other and that of the match, that
//!    the variance left, `s^2 - 2 l q + l V l + (1 - l) T (1 - l)`, is least; this is the square of the new sigma.
//! 4. What the series leaves beyond the fourth order goes on as it began, in the ratio of the parts: [`CLOSING`].
//! 5. Beside a crack, or the edge of another body, neighbours move otherwise, and a polynomial through them says nothing. A subset that
//!    does not lie across it shows that: what its shape function leaves within it would stand in its residuals ([`seen`]). No more than these
//!    allow is taken off or stated, and neighbours that depart by more are left out.
//! 6. Where something runs through a subset nearby, what the polynomial makes of the point's own must stand in its residuals too
//!    ([`borne_out`]). Where they refute it, its neighbours are no guides: nothing is taken off, and what is stated is what other points nearby tell.
//!
//! 7. What residuals show to be left at the centre of a subset all the same, in bands narrower than it, is stated ([`centre`]).
//!
//! So sigma holds the errors on both sides: b is no noise, and a sigma that grew by it instead would be too wide where b is known.

pub(super) mod bend;
mod borne_out;
mod centre;
pub(super) mod grid;
mod local_fit;
pub(super) mod seen;

use std::num::NonZero;

use chainwave_measurement::{Estimate, map_in_parallel};

use crate::field::pair::{ImagePair, Settled};
use crate::field::shape_error::bend::where_it_bends;
use crate::field::shape_error::borne_out::is_refuted;
use crate::field::shape_error::centre::{at_centre, left_px};
use crate::field::shape_error::grid::{Grid, Reading};
use crate::field::shape_error::local_fit::{LEAST_FOR_FOURTH, LocalError, Neighbour, local_error};
use crate::field::shape_error::seen::Residuals;
use crate::icgn::outcome::Match;
use crate::prepared::response::Response;
use crate::{Shape, Workspace};

/// What is left beyond the fourth order, over the square of what this adds to the second and over what the second order makes of
/// an affine subset. By the responses of subsets of random speckles, 4.5 and 6 px wide in 33 px, to waves of one and a half to four
/// subsets it is 0.28 to 0.30 for affine subsets, and for quadratic ones 0.8 at four subsets, 1.4 and 1.55 at two, 1.7 at one and a
/// half: there, unlike on an equal texture (0.4 to 0.6), the odd orders count. The middle of it is taken.
const CLOSING: [f64; 2] = [0.3, 1.3];
/// At an edge polynomials reach beyond what tells them: what they leave there over what the fourth order adds, for a point at the outermost
/// of its neighbours. Of waves of one and a half subsets' length and more it is 0.5 to 1.8 by the same responses, one row inside half of it.
const AT_EDGE: f64 = 2.0;
/// Reach of the neighbours over half a subset: farther, less noise; nearer, less of it is left. Two strides each way.
const STRIDE: [f64; 2] = [0.75, 0.5];

/// A field of which all points are settled.
pub(crate) struct ShapeError<'a> {
    pub(crate) pair: &'a ImagePair<'a>,
    pub(crate) places: &'a [[f64; 2]],
    pub(crate) n_columns: usize,
    pub(crate) step_px: f64,
    /// Points through whose subsets something runs ([`crate::field::halves`]): their places are those of a half, or of none.
    pub(crate) is_mended: &'a [bool],
    pub(crate) n_threads: NonZero<usize>,
}

impl ShapeError<'_> {
    /// Takes the error off the points where the field bends, and states what is left in their sigma; whether it bends anywhere.
    pub(crate) fn take_off(&self, settled: &mut [Option<Settled>]) -> bool {
        let grid = Grid {
            n_columns: self.n_columns,
            n_rows: self.places.len() / self.n_columns,
            step_px: self.step_px,
        };
        let residuals = Residuals::of(settled, self.pair.side_px());
        let readings = self.readings(settled, &residuals);
        let apart = (self.pair.half_px as f64 / self.step_px).ceil().max(1.0) as usize;
        let bends = where_it_bends(grid, &readings, apart, self.pair.side_px());
        let bent: Vec<usize> =
            (0..bends.len()).filter(|&point| bends[point] && readings[point].is_some()).collect();
        if bent.is_empty() {
            self.state_what_is_left(settled, &readings, &bends, (grid, apart));
            return false;
        }
        let around = |point: &usize| {
            let shape = readings[*point].map_or(Shape::Affine, |reading| reading.shape);
            grid.around(*point, self.stride(shape))
        };
        let responses = self.responses(settled, bent.iter().flat_map(around));
        let found = map_in_parallel(bent.len(), self.n_threads, |i| {
            self.error_at(bent[i], settled, &around(&bent[i]), &readings, &responses)
        });
        let mut errors: Vec<Option<[LocalError; 2]>> = vec![None; self.places.len()];
        bent.iter().zip(found).for_each(|(&point, found)| errors[point] = found);
        // Each shape function leaves another error, and residuals that are none but noise leave less: it is known by those of its kind.
        let kind = |point: usize| {
            let of_reading = |reading: Reading| (kind_of(reading.shape), reading.leaves_noise_alone);
            readings[point].map_or((KIND_OF_AFFINE, true), of_reading)
        };
        let sizes = [0, KIND_OF_AFFINE, KIND_OF_QUADRATIC].map(|shape| {
            [false, true].map(|leaves_noise_alone| {
                let of_kind =
                    |point: usize| errors[point].filter(|_| kind(point) == (shape, leaves_noise_alone));
                let errors: Vec<_> = (0..errors.len()).map(of_kind).collect();
                [0, 1].map(|axis| sizes(grid, &errors, axis, 2 * apart))
            })
        });
        for &point in &bent {
            let (Some((Ok(found), shape)), Some(reading)) = (&mut settled[point], &readings[point]) else {
                continue;
            };
            let (of_shape, leaves_noise_alone) = kind(point);
            let of_kind = &sizes[of_shape][usize::from(leaves_noise_alone)];
            let of_axes = [0, 1].map(|axis| of_kind[axis][point].at_most(reading.left_px[axis]));
            let further = closing(*shape).powi(2) * growth(of_axes);
            let position = &mut found.position;
            for (axis, estimate) in [&mut position.x_px, &mut position.y_px].into_iter().enumerate() {
                let error = errors[point].map(|of_axes| of_axes[axis]);
                *estimate = without(*estimate, error, of_axes[axis].parts, further);
            }
        }
        self.state_what_is_left(settled, &readings, &bends, (grid, apart));
        true
    }

    /// Adds to sigmas what the residuals at places, of which errors were taken off, show to be left there: where the field bends, or they are not noise
    /// alone.
    fn state_what_is_left(
        &self,
        settled: &mut [Option<Settled>],
        readings: &[Option<Reading>],
        bends: &[bool],
        (grid, apart): (Grid, usize),
    ) {
        let is_asked = |point: &usize| {
            let asked = |reading: Reading| reading.is_whole && (bends[*point] || !reading.leaves_noise_alone);
            readings[*point].is_some_and(asked)
        };
        let asked: Vec<usize> = (0..settled.len()).filter(is_asked).collect();
        let made = map_in_parallel(asked.len(), self.n_threads, |i| {
            let Some((Ok(found), shape)) = &settled[asked[i]] else { return None };
            let subset = self.pair.prepare_with(self.places[asked[i]], *shape).ok()?;
            at_centre(&subset, self.pair.target, &found.warp(), &mut Workspace::default())
        });
        let mut found: Vec<Option<[Estimate; 2]>> = vec![None; settled.len()];
        asked.iter().zip(made).for_each(|(&point, made)| found[point] = made);
        let left_px = left_px(grid, &found, apart, self.pair.side_px());
        for point in asked {
            let Some((Ok(found), _)) = &mut settled[point] else { continue };
            let position = &mut found.position;
            for (axis, place) in [&mut position.x_px, &mut position.y_px].into_iter().enumerate() {
                place.sigma = place.sigma.hypot(left_px[point][axis]);
            }
        }
    }

    /// Columns from one of a point's neighbours to the next.
    fn stride(&self, shape: Shape) -> usize {
        let stride_px = STRIDE[usize::from(shape == Shape::Quadratic)] * self.pair.half_px as f64;
        (stride_px / self.step_px).round().max(1.0) as usize
    }

    fn readings(&self, settled: &[Option<Settled>], residuals: &Residuals) -> Vec<Option<Reading>> {
        let reading = |((settled, place), is_mended): ((&Option<Settled>, &[f64; 2]), &bool)| {
            let (Some((Ok(found), shape)), false) = (settled, is_mended) else { return None };
            Some(Reading::of(found, *place, *shape, residuals))
        };
        settled.iter().zip(self.places).zip(self.is_mended).map(reading).collect()
    }

    /// How the matches of some points answer to displacements within their subsets.
    fn responses(
        &self,
        settled: &[Option<Settled>],
        points: impl Iterator<Item = usize>,
    ) -> Vec<Option<Response>> {
        let mut wanted = vec![false; settled.len()];
        points.for_each(|point| wanted[point] = true);
        let found = |point: usize| -> Option<(usize, &Match, Shape)> {
            match &settled[point] {
                Some((Ok(found), shape)) if wanted[point] => Some((point, found, *shape)),
                _ => None,
            }
        };
        let matches: Vec<(usize, &Match, Shape)> = (0..settled.len()).filter_map(found).collect();
        let response = |&(point, found, shape): &(usize, &Match, Shape)| {
            let subset = self.pair.prepare_with(self.places[point], shape).ok()?;
            Some(subset.response(&found.warp()))
        };
        let mut responses = vec![None; settled.len()];
        let made = map_in_parallel(matches.len(), self.n_threads, |i| response(&matches[i]));
        matches.iter().zip(made).for_each(|((point, ..), response)| responses[*point] = response);
        responses
    }

    fn error_at(
        &self,
        point: usize,
        settled: &[Option<Settled>],
        around: &[usize],
        readings: &[Option<Reading>],
        responses: &[Option<Response>],
    ) -> Option<[LocalError; 2]> {
        let centre = self.places[point];
        let own = readings[point].as_ref()?;
        let mut neighbours = Vec::with_capacity(around.len());
        for &other in around {
            let (Some(reading), Some(response)) = (&readings[other], &responses[other]) else { continue };
            let Reading { sigma_px, shape, .. } = *reading;
            let offset_px = [0, 1].map(|axis| self.places[other][axis] - centre[axis]);
            if own.is_parted_from(reading, offset_px, self.pair.side_px()) {
                continue;
            }
            let turned_px = own.turned_px(offset_px);
            let u_px = [0, 1].map(|axis| reading.u_px[axis] - turned_px[axis]);
            neighbours.push(Neighbour { offset_px, u_px, sigma_px, shape, response });
        }
        let shape = own.shape;
        // What a lower order leaves is larger than linear: it may tell nothing to a higher one that can do without.
        let alike = |neighbour: &Neighbour<'_>| kind_of(neighbour.shape) >= kind_of(shape);
        if neighbours.iter().filter(|neighbour| alike(neighbour)).count() >= LEAST_FOR_FOURTH {
            neighbours.retain(alike);
        }
        let own = neighbours
            .iter()
            .position(|neighbour| neighbour.offset_px.iter().all(|offset| offset.abs() < 0.5));
        let reach_px = 2.0 * self.stride(shape) as f64 * self.step_px;
        let (errors, polynomial) = local_error(&neighbours, own?, reach_px, self.pair.side_px())?;
        let Some((Ok(found), _)) = &settled[point] else { return None };
        if !around.iter().any(|&other| self.is_mended[other]) {
            return Some(errors);
        }
        let subset = self.pair.prepare_with(centre, shape).ok()?;
        (!is_refuted(&polynomial, &subset, self.pair.target, found)).then_some(errors)
    }
}

/// How large the parts of the error are around a point, squared: those of [`LocalError`], and what the second order makes of an
/// affine subset.
#[derive(Debug, Clone, Copy, Default)]
struct Sizes {
    parts: [f64; 2],
    of_affine: f64,
}

impl Sizes {
    /// The same where the residuals leave no more than that, in pixels, to what the shape function misses.
    fn at_most(self, left_px: f64) -> Self {
        let most = left_px.powi(2);
        Self { parts: self.parts.map(|part| part.min(most)), of_affine: self.of_affine.min(most) }
    }
}

/// The sizes of the errors along an axis, from the points up to `reach` columns and rows away.
///
/// Those that tell a size better count for more: the square of a normal number less its variance scatters by sqrt(2) of its whole
/// variance, noise and size together. The first sizes are found by the noise alone, the second by these (after R. C. Paule, J. Mandel,
/// J. Res. Natl. Bur. Stand. 87 (1982) 377-385). A plain mean would give what the worst subset's noise leaves to all those around it.
fn sizes(grid: Grid, errors: &[Option<[LocalError; 2]>], axis: usize, reach: usize) -> Vec<Sizes> {
    let first = weighted_sizes(grid, errors, axis, reach, &vec![Sizes::default(); errors.len()]);
    weighted_sizes(grid, errors, axis, reach, &first)
}

fn weighted_sizes(
    grid: Grid,
    errors: &[Option<[LocalError; 2]>],
    axis: usize,
    reach: usize,
    expected: &[Sizes],
) -> Vec<Sizes> {
    let term = |value_px: f64, variance: f64, size: f64| {
        let weight = (variance + size).powi(-2);
        if weight.is_finite() { [weight * (value_px.powi(2) - variance), weight] } else { [0.0; 2] }
    };
    let squares = |(error, expected): (&Option<[LocalError; 2]>, &Sizes)| {
        let Some(error) = error.map(|of_axes| of_axes[axis]) else { return [0.0; 6] };
        let of_part =
            |part: usize| term(error.parts_px[part], error.covariance[part][part], expected.parts[part]);
        let [second, n_second] = of_part(0);
        let [fourth, n_fourth] = if error.has_fourth { of_part(1) } else { [0.0; 2] };
        let [of_affine, n_affine] = term(error.of_affine_px, error.variance_of_affine, expected.of_affine);
        [second, n_second, fourth, n_fourth, of_affine, n_affine]
    };
    let squares: Vec<[f64; 6]> = errors.iter().zip(expected).map(squares).collect();
    let mean = |sum: f64, n: f64| if n > 0.0 { (sum / n).max(0.0) } else { 0.0 };
    let size = |[second, n_second, fourth, n_fourth, of_affine, n_affine]: [f64; 6]| Sizes {
        parts: [mean(second, n_second), mean(fourth, n_fourth)],
        of_affine: mean(of_affine, n_affine),
    };
    grid.sums(&squares, reach).into_iter().map(size).collect()
}

/// The square of what the fourth order adds over that of what the second makes of an affine subset, along both axes together.
fn growth([u, v]: [Sizes; 2]) -> f64 {
    let (fourth, of_affine) = (u.parts[1] + v.parts[1], u.of_affine + v.of_affine);
    if of_affine > 0.0 { fourth / of_affine } else { 1.0 }
}

/// Shape functions by the order that they follow: none, the first, the second.
const KIND_OF_AFFINE: usize = 1;
const KIND_OF_QUADRATIC: usize = 2;

fn kind_of(shape: Shape) -> usize {
    match shape {
        Shape::Quadratic => KIND_OF_QUADRATIC,
        Shape::Affine => KIND_OF_AFFINE,
        _ => 0,
    }
}

fn closing(shape: Shape) -> f64 {
    CLOSING[usize::from(shape == Shape::Quadratic)]
}

/// A place without the error of its shape function, as far as that is known, and with what is left of it in its sigma; `further` is
/// what is left beyond the fourth order over what this adds, squared.
fn without(found: Estimate, error: Option<LocalError>, [second, fourth]: [f64; 2], further: f64) -> Estimate {
    let beyond = further * fourth;
    let Some(error) = error else {
        return Estimate::new(found.value, (found.sigma.powi(2) + second + fourth + beyond).sqrt());
    };
    let shares = shares(&error, [second, fourth]);
    let [of_second, of_fourth] = shares;
    let [[var_second, between], [_, var_fourth]] = error.covariance;
    let of_noise = of_second * of_second * var_second
        + 2.0 * of_second * of_fourth * between
        + of_fourth * of_fourth * var_fourth
        - 2.0 * (of_second * error.with_own[0] + of_fourth * error.with_own[1]);
    let left = (1.0 - of_second).powi(2) * second + (1.0 - of_fourth).powi(2) * fourth;
    let taken_px = of_second * error.parts_px[0] + of_fourth * error.parts_px[1];
    let at_edge = (AT_EDGE * error.aside).powi(2) * fourth;
    let variance = found.sigma.powi(2) + of_noise + left + beyond + at_edge;
    Estimate::new(found.value - taken_px, variance.max(0.0).sqrt())
}

/// The shares of the parts of an error that leave the least variance.
fn shares(error: &LocalError, [second, fourth]: [f64; 2]) -> [f64; 2] {
    let [[var_second, between], [_, var_fourth]] = error.covariance;
    let (var_second, var_fourth) = (var_second + second, var_fourth + fourth);
    let [with_second, with_fourth] = [second + error.with_own[0], fourth + error.with_own[1]];
    let alone = |size: f64, wanted: f64, variance: f64| {
        if size > 0.0 { (wanted / variance).clamp(0.0, 1.0) } else { 0.0 }
    };
    if !error.has_fourth || fourth <= 0.0 {
        return [alone(second, with_second, var_second), 0.0];
    }
    if second <= 0.0 {
        return [0.0, alone(fourth, with_fourth, var_fourth)];
    }
    let determinant = var_second * var_fourth - between * between;
    [
        (var_fourth * with_second - between * with_fourth) / determinant,
        (var_second * with_fourth - between * with_second) / determinant,
    ]
    .map(|share| share.clamp(0.0, 1.0))
}
