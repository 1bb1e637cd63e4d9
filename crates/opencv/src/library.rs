//! OpenCV as the inner crates ask for it.

use std::path::Path;

use chainwave_camera::{Board, CameraError, Corner, OpenedVideo, VisionLibrary};
use chainwave_correlation::{FlowSettings, ForeignMethods, GrayImage};
use chainwave_measurement::Recording;

use crate::{corners, methods, video};

/// OpenCV, which keeps no state.
pub(crate) struct OpenCv;

impl VisionLibrary for OpenCv {
    fn version(&self) -> String {
        // A library that cannot tell it has other faults than this one.
        opencv::core::get_version_string().unwrap_or_default()
    }

    fn open_video(&self, path: &Path) -> Result<OpenedVideo, String> {
        video::open(path)
    }

    fn find_corners(
        &self,
        recording: &dyn Recording,
        frame: usize,
        board: &Board,
    ) -> Result<Vec<Corner>, CameraError> {
        corners::find(recording, frame, board)
    }
}

impl ForeignMethods for OpenCv {
    fn optical_flow(
        &self,
        size_px: [usize; 2],
        images: [&[u8]; 2],
        from: &[[f64; 2]],
        starts: &[[f64; 2]],
        settings: &FlowSettings,
    ) -> Result<Vec<Option<[f64; 2]>>, String> {
        methods::flow(size_px, images, from, starts, settings).map_err(|error| error.to_string())
    }

    fn enhanced_correlation(
        &self,
        template: GrayImage<'_>,
        scene: GrayImage<'_>,
        start: [f64; 2],
        max_iterations: u32,
    ) -> Option<[f64; 2]> {
        methods::enhanced_correlation(template, scene, start, max_iterations).ok()
    }

    fn phase_correlation(&self, images: [GrayImage<'_>; 2], variance: f64) -> Option<[f64; 2]> {
        methods::phase_correlation(images, variance).ok()
    }
}
