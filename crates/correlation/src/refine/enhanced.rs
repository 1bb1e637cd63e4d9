//! Places by OpenCV's enhanced correlation coefficient.

use crate::PreparedSubset;
use crate::foreign::{GrayImage, library};
use crate::refine::Refine;
use crate::search::area::SearchArea;

/// `findTransformECC` (G. D. Evangelidis, E. Z. Psarakis, IEEE Trans. Pattern Anal. Mach. Intell. 30 (2008) 1858-1865):
/// translation, bilinear interpolation.
pub(crate) struct EnhancedCorrelation;

impl Refine for EnhancedCorrelation {
    fn prepare(_: &PreparedSubset) -> Self {
        Self
    }

    fn refine(&self, subset: &PreparedSubset, scene: &SearchArea, start_px: [f64; 2]) -> Option<[f64; 2]> {
        let (region, pixels) = scene.pixels();
        let first = [region.x as f64, region.y as f64];
        let template = GrayImage { width: subset.width, height: subset.height, pixels: subset.template() };
        let scene = GrayImage { width: region.width, height: region.height, pixels };
        let near = [0, 1].map(|axis| start_px[axis] + subset.first_px[axis] - first[axis]);
        let corner =
            library()?.enhanced_correlation(template, scene, near, subset.settings.max_iterations)?;
        let place = [0, 1].map(|axis| corner[axis] + first[axis] - subset.first_px[axis]);
        place.iter().all(|value| value.is_finite()).then_some(place)
    }
}
