//! The displacement field between two opened pictures, on a grid that is asked for or that the pictures ask for.

use std::num::NonZero;

use chainwave_correlation::{
    ChosenGrid, Field, FieldGrid, Interpolation, Method, PicturePair, Reference, ReferenceFrames, Settings,
    ShapeChoice, Window,
};
use chainwave_measurement::{Recording, Region, Subset};

use crate::error::Error;
use crate::tracking::matching::{MethodChoice, noise_px};

/// What is asked of a field.
#[derive(Debug, Clone, Copy)]
pub struct FieldRequest {
    /// The way of matching: one of the Gauss-Newton methods, or an accuracy.
    pub choice: MethodChoice,
    /// Columns and rows of a subset on each side of its centre; chosen by the pictures where it is left open.
    pub half_px: Option<usize>,
    /// Pixels from one point to the next; half of the half size where it is left open.
    pub step_px: Option<usize>,
    /// Threads.
    pub n_threads: NonZero<usize>,
}

/// A field, and what was chosen for it.
pub struct FoundField {
    /// The field.
    pub field: Field,
    /// The method.
    pub method: Method,
    /// The grid that the pictures asked for, where the half size was left open.
    pub settled: Option<ChosenGrid>,
}

impl FieldRequest {
    /// Correlates the first frames of two recordings; `progress` hears of points that are done.
    ///
    /// # Errors
    /// A method that gives no field, pictures that cannot be read, a grid that does not fit, and a reference without texture.
    pub fn carry_out(
        &self,
        reference: &dyn Recording,
        deformed: &dyn Recording,
        progress: &(dyn Fn(u64) + Sync),
    ) -> Result<FoundField, Error> {
        let accuracy_px = self.choice.accuracy_px();
        let whole = Reference::read_whole(reference, &ReferenceFrames::Single(0))?;
        let by_texture = match self.half_px {
            Some(_) => None,
            None => Some(ChosenGrid::by_texture(&whole, noise_px(accuracy_px))?),
        };
        let half_px = by_texture.map_or(self.half_px.unwrap_or(0), |chosen| chosen.grid.half_px);
        let (interpolation, shape) = solver(&self.choice, reference, half_px)?;
        let pair = PicturePair {
            reference: &whole,
            target: &window(deformed, interpolation)?,
            settings: &Settings::default(),
            choice: shape,
            n_threads: self.n_threads,
            progress,
        };
        let step_px = self.step_px;
        let on = |grid: FieldGrid| pair.field(FieldGrid { step_px: step_px.unwrap_or(grid.step_px), ..grid });
        let (field, settled) = match by_texture {
            None => (on(FieldGrid::with_half(half_px))?, None),
            Some(by_texture) => {
                let (settled, field) = by_texture.correlate(&pair, noise_px(accuracy_px))?;
                (if step_px.is_some() { on(settled.grid)? } else { field }, Some(settled))
            }
        };
        Ok(FoundField { field, method: Method::IcGn { interpolation, shape }, settled })
    }
}

/// The first frame; what saturates in it counts as unseen.
fn window(recording: &dyn Recording, interpolation: Interpolation) -> Result<Window, Error> {
    let info = recording.info();
    let whole = Region::whole(info.width_px, info.height_px);
    let mut pixels = vec![0.0; whole.n_pixels()];
    recording.read_region(0, whole, &mut pixels)?;
    Ok(Window::saturating_at(whole, &pixels, interpolation, info.full_scale())?)
}

/// The interpolation and the shape function; where an accuracy asks for them, by nine subsets over the reference.
fn solver(
    choice: &MethodChoice,
    reference: &dyn Recording,
    half_px: usize,
) -> Result<(Interpolation, ShapeChoice), Error> {
    let (width, height) = (reference.info().width_px, reference.info().height_px);
    let fits = width.min(height) > 2 * half_px + 1;
    let place = |i: usize, n: usize| half_px as f64 + 0.25 * (i + 1) as f64 * (n - 2 * half_px - 1) as f64;
    let subset = |i: usize| {
        Subset::new(
            i.to_string(),
            place(i % 3, width).floor(),
            place(i / 3, height).floor(),
            half_px,
            half_px,
        )
    };
    let subsets: Vec<Subset> = (0..9).filter(|_| fits).map(subset).collect();
    match choice.method(reference, &subsets, &ReferenceFrames::Single(0))? {
        Method::IcGn { interpolation, shape } => Ok((interpolation, shape)),
        other => Err(Error::Value(format!(
            "method {other}: expected one of the icgn methods, which give a field (hint: icgn-cubic-affine)"
        ))),
    }
}
