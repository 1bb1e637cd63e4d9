//! Places by OpenCV's phase correlation.

use crate::foreign::{GrayImage, library};
use crate::refine::Refine;
use crate::search::area::SearchArea;
use crate::simd::LANES;
use crate::warp::Warp;
use crate::window::sample::sample;
use crate::{PreparedSubset, Window};

/// `phaseCorrelate` (E. De Castro, C. Morandi, IEEE Trans. Pattern Anal. Mach. Intell. 9 (1987) 700-703) of the subset and as
/// much of the frame, both under a Hann window; the centroid of 5 x 5 px at the peak.
///
/// That centroid is not the shift but some multiple of it, which depends on the noise. So the frame is sampled anew where
/// the shift leads, until there is none (the repeated passes of particle image velocimetry: M. Raffel et al., Particle
/// Image Velocimetry, 3rd ed., 2018, section 5.3.4.3), the multiple being that of the last pass.
pub(crate) struct PhaseCorrelation;

/// Variance of what the window's edge makes of the contrast over that of the grey values.
const EDGE_SHARE: f64 = 0.1;
/// Passes at most, and the shift that ends them.
const N_PASSES: usize = 12;
const NO_SHIFT_PX: f64 = 1e-3;
/// Multiples of a shift that are taken for one.
const MULTIPLES: [f64; 2] = [0.5, 4.0];

impl Refine for PhaseCorrelation {
    fn prepare(_: &PreparedSubset) -> Self {
        Self
    }

    fn refine(&self, subset: &PreparedSubset, scene: &SearchArea, start_px: [f64; 2]) -> Option<[f64; 2]> {
        let (region, pixels) = scene.pixels();
        let window = Window::new(region, pixels, subset.settings.interpolation).ok()?;
        let (mut rows, mut samples) = (Vec::new(), vec![0.0; subset.n_pixels() + LANES]);
        let (mut place, mut before, mut multiple) = (start_px, None, [1.0; 2]);
        for _ in 0..N_PASSES {
            let warp = Warp::at(place);
            if !subset.fits(&window, &warp) {
                return None;
            }
            sample(&window, &warp, subset.lattice(), &mut rows, &mut samples);
            let shift = shift(subset, &samples[..subset.n_pixels()])?;
            if shift.iter().all(|shift| shift.abs() <= NO_SHIFT_PX) {
                return Some(place);
            }
            if let Some((place_before, shift_before)) = before.replace((place, shift)) {
                multiple = [0, 1].map(|axis| {
                    let step: f64 = place[axis] - place_before[axis];
                    let [least, most] = MULTIPLES;
                    let found = (shift_before[axis] - shift[axis]) / step;
                    if found.is_finite() { found.clamp(least, most) } else { multiple[axis] }
                });
            }
            place = [0, 1].map(|axis| place[axis] + shift[axis] / multiple[axis]);
        }
        None
    }
}

/// The shift of a part of a frame, in counts.
fn shift(subset: &PreparedSubset, part: &[f32]) -> Option<[f64; 2]> {
    let picture = |pixels| GrayImage { width: subset.width, height: subset.height, pixels };
    let contrast = subset.signal_energy / subset.n_used as f64;
    let variance = subset.noise_variance + EDGE_SHARE * contrast;
    library()?.phase_correlation([picture(subset.template()), picture(part)], variance)
}
