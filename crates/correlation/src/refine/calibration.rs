//! What a foreign method makes of a subset between two pixels, found on shifted pictures of the very subset.
//!
//! Such a method has a bias that depends on the texture and on the place between two pixels, and no covariance. The
//! reference, less its noise, is shifted by known amounts ([`crate::self_test::shift`]). From pictures without noise the bias is taken
//! as a sum of waves over the place found, of first and second order. From pictures with the reference's own noise comes the
//! ratio of what is left to the standard uncertainty that this crate's own estimate of the same subset would have
//! ([`crate::uncertainty`]): so many times that of each frame is the method's.

use std::f64::consts::TAU;

use chainwave_measurement::{Lost, Subset};
use nalgebra::{DMatrix, DVector};

use crate::self_test::shift::{Normal, shifted};
use crate::uncertainty::{expected_sigma_px, signal_sigma_px};
use crate::warp::Warp;
use crate::{PreparedSubset, Reference, Window, Workspace};

/// Pictures without noise, by which the bias is fitted.
const N_STILL: usize = 48;
/// Pictures with noise; two axes of each make the ratio known to a fourteenth.
const N_NOISY: usize = 48;
/// A constant and waves of first and second order.
const N_WAVES: usize = 15;

/// A method's bias and precision on one subset.
#[derive(Debug, Clone)]
pub(crate) struct Calibration {
    /// Of the position along x and y, without noise.
    bias: [Bias; 2],
    /// Errors over this crate's own standard uncertainty, root mean square.
    ratio: f64,
}

/// What the waves are multiplied with.
type Bias = [f64; N_WAVES];

/// How a frame resembles the reference at a place, and this crate's own standard uncertainty of such a place.
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
        Ok(Self { bias, ratio })
    }

    /// The place that the method means by the one that it found, and its standard uncertainty.
    pub(crate) fn correct(&self, place: [f64; 2], judgement: &Judgement) -> [(f64, f64); 2] {
        let bias = bias_at(&self.bias, place);
        [0, 1].map(|axis| (place[axis] - bias[axis], self.ratio * judgement.sigma_px[axis]))
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
            subset: Subset { name: String::new(), x_px, y_px, half_width_px, half_height_px },
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

    /// Errors less the bias over this crate's own standard uncertainty, root mean square, on pictures with noise.
    ///
    /// The scene has less contrast than what the reference shows through its noise. So it is given less noise too: so much
    /// that it is located as well.
    fn ratio(
        &self,
        subset: &PreparedSubset,
        bias: &[Bias; 2],
        rounding: f64,
        locate: impl Fn(&[f32], &[f32]) -> Option<[f64; 2]>,
    ) -> Result<f64, Lost> {
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
            let pull = [0, 1].map(|axis| (error[axis] - of_bias[axis]) / own_px[axis]);
            (found.zncc >= subset.settings.min_zncc).then_some(pull)
        };
        // other shifts than the bias was fitted to
        let other = shifts().skip(N_STILL).take(N_NOISY);
        let pulls: Vec<f64> = other.filter_map(&mut pull).flatten().collect();
        let enough = pulls.len() > N_NOISY;
        let square = pulls.iter().map(|pull| pull * pull).sum::<f64>() / pulls.len() as f64;
        enough.then(|| square.sqrt()).ok_or(Lost::NotConverged)
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
