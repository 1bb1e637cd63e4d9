//! Methods that a library of computer vision has, as far as this crate asks for them: the peers that its own rungs are measured
//! against.
//!
//! The crate itself links no such library; who has one registers it before anything is tracked, and without it those rungs are refused
//! with [`crate::CorrelationError::NeedsOpenCv`].

use std::sync::OnceLock;

/// A picture.
#[derive(Debug, Clone, Copy)]
pub struct GrayImage<'a> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Counts, row by row.
    pub pixels: &'a [f32],
}

/// How a flow is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowSettings {
    /// Columns and rows of the window around each point.
    pub window_px: [usize; 2],
    /// Steps at most.
    pub max_iterations: u32,
    /// The step that ends them, in pixels.
    pub convergence_px: f64,
}

/// A library that brings methods of its own. Places are columns and rows of a picture, the centre of its first pixel being (0, 0).
pub trait ForeignMethods: Send + Sync {
    /// Where points of a still picture lie in a moved one, by the pyramidal method of Lucas and Kanade from a start for each; `None` for
    /// points that were not found. Both pictures have so many columns and rows of 8-bit counts.
    ///
    /// # Errors
    /// What the library refuses, which ends the run.
    fn optical_flow(
        &self,
        size_px: [usize; 2],
        images: [&[u8]; 2],
        from: &[[f64; 2]],
        starts: &[[f64; 2]],
        settings: &FlowSettings,
    ) -> Result<Vec<Option<[f64; 2]>>, String>;

    /// Where the first pixel of a template lies in a scene, by the enhanced correlation coefficient from a start; `None` where the
    /// iteration does not settle.
    fn enhanced_correlation(
        &self,
        template: GrayImage<'_>,
        scene: GrayImage<'_>,
        start: [f64; 2],
        max_iterations: u32,
    ) -> Option<[f64; 2]>;

    /// The shift from a picture to another of its size, by phase correlation under a Hann window; frequencies count that have more power
    /// than a variance of grey values gives as white noise. `None` where there is none.
    fn phase_correlation(&self, images: [GrayImage<'_>; 2], variance: f64) -> Option<[f64; 2]>;
}

static LIBRARY: OnceLock<&'static dyn ForeignMethods> = OnceLock::new();

/// Brings a library. The first one stays.
pub fn register_foreign(library: &'static dyn ForeignMethods) {
    LIBRARY.get_or_init(|| library);
}

/// Whether the program has brought a library.
pub fn has_foreign() -> bool {
    LIBRARY.get().is_some()
}

/// The library that the program has brought.
pub(crate) fn library() -> Option<&'static dyn ForeignMethods> {
    LIBRARY.get().copied()
}
