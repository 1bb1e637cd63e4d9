//! What a foreign method makes of a subset between two pixels, found on shifted pictures of the very subset.
//!
//! Such a method has a bias that depends on the texture and on the place between two pixels, and no covariance. The
//! reference, less its noise, is shifted by known amounts ([`crate::reference::shift`]). From pictures without noise the bias is taken
//! as a sum of waves over the place found, of first and second order. From pictures with the reference's own noise comes the
//! ratio of what is left to the standard uncertainty that this crate's own estimate of the same subset would have
//! ([`crate::uncertainty`]): so many times that of each frame is the method's. What is left of a bias is more half way between
//! two pixels than at a pixel, so the ratio's square is found as a function of the place ([`Ratio`]).
//!
//! Shifted pictures do not turn or stretch, as bodies do. By how much that moves a place which is found by translation alone, an affine match
//! from there tells: what the two places differ by, beyond the noise of the difference, is in sigma.

use std::f64::consts::{PI, TAU};

use chainwave_measurement::{Estimate, Lost, Subset};
use nalgebra::{DMatrix, DVector};

use crate::icgn::outcome::Match;
use crate::reference::shift::{Normal, shifted};
use crate::uncertainty::{expected_sigma_px, signal_sigma_px};
use crate::warp::Warp;
use crate::{PreparedSubset, Reference, Shape, Window, Workspace};

/// Pictures without noise, by which the bias is fitted.
const N_STILL: usize = 48;
/// Pictures with noise; two axes of each make a constant ratio known to a fourteenth.
const N_NOISY: usize = 48;
/// Standard deviations of the noise by which two places differ where one of them does not follow its surface.
const TOLD_SIGMAS: f64 = 3.0;
/// A constant and waves of first and second order.
const N_WAVES: usize = 15;

/// A method's bias and precision on one subset.
#[derive(Debug, Clone)]
pub(crate) struct Calibration {
    /// Of the position along x and y, without noise.
    bias: [Bias; 2],
    ratio: Ratio,
    /// The subset that follows its surface where that turns and stretches.
    following: Option<PreparedSubset>,
}

/// The square of errors over this crate's own standard uncertainty: a constant and, where it is seen, what is added half way
/// between two pixels along the axis of the error and along the other one, by the squared sine of the place.
#[derive(Debug, Clone, Copy)]
struct Ratio([f64; 3]);

/// Standard errors by which a term must be above zero to count.
const SEEN: f64 = 3.0;

impl Ratio {
    /// What the square depends on, for the error along an axis at a place.
    fn terms(place: [f64; 2], axis: usize) -> [f64; 3] {
        let half_way = |axis: usize| (PI * place[axis]).sin().powi(2);
        [1.0, half_way(axis), half_way(1 - axis)]
    }

    /// The one that describes squares best, each with its terms, by those terms that are seen.
    fn fit(squares: &[([f64; 3], f64)]) -> Self {
        let mut used = vec![0, 1, 2];
        loop {
            let columns = DMatrix::from_fn(squares.len(), used.len(), |i, k| squares[i].0[used[k]]);
            let target = DVector::from_fn(squares.len(), |i, _| squares[i].1);
            let Some(inverse) = (columns.transpose() * &columns).try_inverse() else {
                used = vec![0];
                continue;
            };
            let factors = &inverse * columns.transpose() * &target;
            let degrees_of_freedom = squares.len().saturating_sub(used.len()).max(1) as f64;
            let variance = (&columns * &factors - target).norm_squared() / degrees_of_freedom;
            let unseen = (1..used.len()).filter(|&k| factors[k] < SEEN * (variance * inverse[(k, k)]).sqrt());
            let Some(least) = unseen.min_by(|&a, &b| factors[a].total_cmp(&factors[b])) else {
                // so that squares of errors over sigma are 1 on average, though the ratio itself is uncertain: the mean of F
                let n = squares.len() as f64;
                let uncertain = n / (n - 2.0 * used.len() as f64);
                let mut all = [0.0; 3];
                used.iter().zip(&factors).for_each(|(&k, factor)| all[k] = uncertain * factor.max(0.0));
                return Self(all);
            };
            used.remove(least);
        }
    }

    fn at(&self, place: [f64; 2], axis: usize) -> f64 {
        self.0.iter().zip(Self::terms(place, axis)).map(|(factor, term)| factor * term).sum::<f64>().sqrt()
    }
}

/// What the waves are multiplied with.
type Bias = [f64; N_WAVES];

/// How a frame resembles the reference at a place, and this crate's own standard uncertainty of such a place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Judgement {
    pub(crate) zncc: f64,
    sigma_px: [f64; 2],
}

/// Compares a frame with the reference at a place; `None` where that cannot be done.
pub(crate) fn judge(
    subset: &PreparedSubset,
    window: &Window,
    place: [f64; 2],
    workspace: &mut Workspace,
) -> Option<Judgement> {
    let warp = Warp::at(place);
    let (found, residual) = subset.compare(window, &warp, workspace)?;
    Some(Judgement { zncc: found.zncc, sigma_px: signal_sigma_px(subset, &warp, &residual) })
}

impl Calibration {
    /// Tries a method on pictures of a subset of a reference: `locate` is given the reference's pixels and those of a
    /// picture, and says where the subset's centre lies in it, from a start less than a pixel away. `rounding` is the
    /// variance, in counts squared, that it adds to both by rounding them.
    ///
    /// # Errors
    /// [`Lost::NotConverged`] where it finds too few of them.
    pub(crate) fn new(
        reference: &Reference,
        subset: &PreparedSubset,
        rounding: f64,
        locate: impl Fn(&[f32], &[f32]) -> Option<[f64; 2]>,
    ) -> Result<Self, Lost> {
        let pictures = Pictures::new(reference, subset);
        let without_noise = |shift| {
            let place = locate(&pictures.still(), &pictures.moved(shift))?;
            Some((place, pictures.error(place, shift)))
        };
        let bias = fit(&shifts().take(N_STILL).filter_map(without_noise).collect::<Vec<_>>())?;
        let ratio = pictures.ratio(subset, &bias, rounding, locate)?;
        let shapes = Shape::Translation.richer();
        let following = PreparedSubset::of_first(shapes, reference, &pictures.subset, &subset.settings);
        Ok(Self { bias, ratio, following })
    }

    /// The place that the method means by the one that it found, and its standard uncertainty; `follow` matches a subset from there.
    pub(crate) fn correct(
        &self,
        place: [f64; 2],
        judgement: &Judgement,
        follow: impl FnOnce(&PreparedSubset) -> Option<Match>,
    ) -> [Estimate; 2] {
        let bias = bias_at(&self.bias, place);
        let means = [0, 1].map(|axis| {
            let sigma = self.ratio.at(place, axis) * judgement.sigma_px[axis];
            Estimate::new(place[axis] - bias[axis], sigma)
        });
        let Some(followed) = self.following.as_ref().and_then(follow) else { return means };
        let followed = [followed.position.x_px, followed.position.y_px];
        [0, 1].map(|axis| {
            let (own, followed) = (means[axis], followed[axis]);
            // Both places have the noise of the most efficient one, and each by itself what its variance has beyond that.
            let most_efficient = judgement.sigma_px[axis].powi(2);
            let by_noise = (followed.sigma.powi(2) + own.sigma.powi(2) - 2.0 * most_efficient).max(0.0);
            let apart = (followed.value - own.value).powi(2);
            let is_told = apart > TOLD_SIGMAS.powi(2) * by_noise;
            let by_shape = if is_told { (apart - by_noise).sqrt() } else { 0.0 };
            Estimate::new(own.value, own.sigma.hypot(by_shape))
        })
    }
}

/// Shifts of up to half a pixel that fill the square of all phases evenly: multiples of two irrational numbers.
fn shifts() -> impl Iterator<Item = [f64; 2]> {
    (0_u32..).map(|i| [0.754_878, 0.569_840].map(|step| (f64::from(i) * step).fract() - 0.5))
}

/// The reference of a subset without its noise, as a scene to be shifted.
struct Pictures<'a> {
    reference: &'a Reference,
    subset: Subset,
    scene: Vec<f64>,
}

impl<'a> Pictures<'a> {
    fn new(reference: &'a Reference, subset: &PreparedSubset) -> Self {
        let scene = reference.without_noise().into_iter().map(f64::from).collect();
        let [x_px, y_px] = subset.centre_px;
        let (half_width_px, half_height_px) = (subset.width / 2, subset.height / 2);
        Self {
            reference,
            subset: Subset::new("", x_px, y_px, half_width_px, half_height_px)
                .within(subset.outline_px.clone()),
            scene,
        }
    }

    fn still(&self) -> Vec<f32> {
        self.scene.iter().map(|&value| value as f32).collect()
    }

    fn moved(&self, shift: [f64; 2]) -> Vec<f32> {
        shifted(&self.scene, self.reference.region(), shift).into_iter().map(|value| value as f32).collect()
    }

    fn noisy(&self, mut pixels: Vec<f32>, variance: f64, random: &mut Normal) -> Vec<f32> {
        pixels.iter_mut().for_each(|pixel| *pixel += (variance.max(0.0).sqrt() * random.next()) as f32);
        pixels
    }

    /// Errors less the bias over this crate's own standard uncertainty, on pictures with noise.
    ///
    /// The scene has less contrast than what the reference shows through its noise. So it is given less noise too: so much
    /// that it is located as well.
    fn ratio(
        &self,
        subset: &PreparedSubset,
        bias: &[Bias; 2],
        rounding: f64,
        locate: impl Fn(&[f32], &[f32]) -> Option<[f64; 2]>,
    ) -> Result<Ratio, Lost> {
        let region = self.reference.region();
        let n_averaged = self.reference.n_averaged();
        let scene = Reference::new(region, self.still(), n_averaged).map_err(|_| Lost::NoTexture)?;
        let scene = PreparedSubset::new(&scene, &self.subset, &subset.settings)?;
        let [of_subset, of_scene] = [subset, &scene].map(|s| expected_sigma_px(s, subset.noise_variance));
        let shrink = of_subset[0].hypot(of_subset[1]) / of_scene[0].hypot(of_scene[1]);
        let own_px = of_scene.map(|sigma| shrink * sigma);
        let variance = subset.noise_variance * shrink.powi(2);
        let (mut random, mut workspace) = (Normal(1), Workspace::default());
        let mut pull = |shift| {
            let still = self.noisy(self.still(), variance - rounding, &mut random);
            let moved = self.noisy(self.moved(shift), variance * subset.n_averaged - rounding, &mut random);
            let place = locate(&still, &moved)?;
            let window = Window::new(region, &moved, subset.settings.interpolation).ok()?;
            let found = judge(subset, &window, place, &mut workspace)?;
            let (error, of_bias) = (self.error(place, shift), bias_at(bias, place));
            let pull = [0, 1].map(|axis| {
                let square = ((error[axis] - of_bias[axis]) / own_px[axis]).powi(2);
                (Ratio::terms(place, axis), square)
            });
            (found.zncc >= subset.settings.acceptance.least_zncc()).then_some(pull)
        };
        // other shifts than the bias was fitted to
        let other = shifts().skip(N_STILL).take(N_NOISY);
        let squares: Vec<([f64; 3], f64)> = other.filter_map(&mut pull).flatten().collect();
        (squares.len() > N_NOISY).then(|| Ratio::fit(&squares)).ok_or(Lost::NotConverged)
    }

    fn error(&self, place: [f64; 2], shift: [f64; 2]) -> [f64; 2] {
        [place[0] - self.subset.x_px - shift[0], place[1] - self.subset.y_px - shift[1]]
    }
}

/// The waves at a place.
fn waves([x, y]: [f64; 2]) -> [f64; N_WAVES] {
    let ((sx, cx), (sy, cy)) = ((TAU * x).sin_cos(), (TAU * y).sin_cos());
    let second = [cx * cx - sx * sx, 2.0 * sx * cx, cy * cy - sy * sy, 2.0 * sy * cy];
    let [ccx, scx, ccy, scy] = second;
    [
        1.0,
        cx,
        sx,
        cy,
        sy,
        ccx,
        scx,
        ccy,
        scy,
        cx * cy,
        cx * sy,
        sx * cy,
        sx * sy,
        x - x.round(),
        y - y.round(),
    ]
}

fn bias_at(bias: &[Bias; 2], place: [f64; 2]) -> [f64; 2] {
    let waves = waves(place);
    bias.each_ref().map(|factors| factors.iter().zip(waves).map(|(factor, wave)| factor * wave).sum())
}

/// The waves that describe errors along x and y at places best.
fn fit(found: &[([f64; 2], [f64; 2])]) -> Result<[Bias; 2], Lost> {
    if found.len() < 2 * N_WAVES {
        return Err(Lost::NotConverged);
    }
    let all: Vec<Bias> = found.iter().map(|(place, _)| waves(*place)).collect();
    let solver = DMatrix::from_fn(found.len(), N_WAVES, |i, k| all[i][k]).svd(true, true);
    let along = |axis: usize| {
        let errors = DVector::from_fn(found.len(), |i, _| found[i].1[axis]);
        // places that lie together leave waves open
        let factors = solver.solve(&errors, 1e-2 * solver.singular_values.max());
        factors.map_err(|_| Lost::NotConverged)
    };
    let (x, y) = (along(0)?, along(1)?);
    Ok([x, y].map(|factors| std::array::from_fn(|k| factors[k])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_is_that_of_its_squares_by_the_terms_that_are_seen() {
        let places =
            || (0..96).map(|i| ([0.754_878 * f64::from(i), 0.569_840 * f64::from(i)], i as usize % 2));
        let of = |factors: [f64; 3], noise: f64| {
            let mut random = Normal(3);
            let mut square = |(place, axis)| {
                let terms = Ratio::terms(place, axis);
                let square: f64 = terms.iter().zip(factors).map(|(term, factor)| term * factor).sum();
                (terms, square * (1.0 + noise * (random.next().powi(2) - 1.0)))
            };
            Ratio::fit(&places().map(&mut square).collect::<Vec<_>>()).0
        };
        for factors in [[1.0, 3.0, 0.5], [2.0, 0.0, 0.0]] {
            let terms = factors.iter().filter(|factor| **factor > 0.0).count() as f64;
            let expected = factors.map(|factor| 96.0 / (96.0 - 2.0 * terms) * factor);
            let found = of(factors, 0.0);
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "rounding: {found:?}");
        }
        // squares of normal errors that are the same everywhere: their mean, to a seventh, and no other terms
        let [constant, own, other] = of([1.0, 0.0, 0.0], 1.0);
        assert!((constant - 1.0).abs() < 3.0 / 7.0 && own + other <= 0.0, "{constant} {own} {other}");
        // squares that fall half way are described by their mean
        let [constant, own, other] = of([2.0, -1.0, 0.0], 0.0);
        assert!((constant - 96.0 / 94.0 * 1.5).abs() < 0.1 && own + other <= 0.0, "{constant} {own} {other}");
    }
}
