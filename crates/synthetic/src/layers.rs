//! The layers of a picture, composed from back to front: backdrop, bodies, markers, covers, rods.

use std::sync::OnceLock;

use crate::SyntheticError;
use crate::backdrop::{self, Prospect};
use crate::blur::Blur;
use crate::canvas::Canvas;
use crate::marker::{BodyPlace, Plate};
use crate::recording_camera::{CameraPose, RecordingCamera};
use crate::ring::Outline;
use crate::rods::{RodPixels, RodView};
use crate::settings::{Camera, Shot, Specimen};
use crate::shapes::{Shapes, Wall};
use crate::speckle::Pattern;
use crate::view::PixelView;

/// A cover's size, relative to the marker that it hides, and its tone: dark cloth.
const COVER_SIZE: f64 = 1.2;
const COVER_TONE: f64 = 0.05;

/// What a recording shows: the still parts drawn once, and what moves drawn for each instant.
pub(crate) struct Layers<'a> {
    camera: &'a Camera,
    specimen: &'a Specimen,
    shot: &'a Shot,
    shapes: Option<&'a Shapes>,
    /// Largest distance of any of these from its body's centre along the chain.
    shapes_reach_px: f64,
    /// True scale, and how many times the stated one it is.
    scale_px_per_m: f64,
    magnification: f64,
    first_body_px: [f64; 2],
    /// Whether nothing moves or blurs the still parts.
    is_still: bool,
    view: PixelView,
    backdrop: Canvas,
    rods: RodPixels,
    outline: Outline,
    /// One for each body, made when the body first comes into view.
    markers: Vec<OnceLock<Plate>>,
    cover: Plate,
}

/// An instant of a recording.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant {
    /// After the trigger.
    pub(crate) stamp_s: f64,
    /// After the impact.
    pub(crate) motion_s: f64,
    pub(crate) pose: CameraPose,
}

impl<'a> Layers<'a> {
    /// # Errors
    /// [`SyntheticError::Setting`] when the lens folds the picture over.
    pub(crate) fn new(
        camera: &'a Camera,
        specimen: &'a Specimen,
        shot: &'a Shot,
        recording: &RecordingCamera,
    ) -> Result<Self, SyntheticError> {
        let (scale_px_per_m, first_body_px) = (recording.scale_px_per_m, recording.first_body_px);
        let hidden = Pattern::blank(marker_half_px(specimen, COVER_SIZE * scale_px_per_m));
        let mut layers = Self {
            camera,
            specimen,
            shot,
            shapes: None,
            shapes_reach_px: 0.0,
            scale_px_per_m,
            magnification: recording.magnification(),
            first_body_px,
            is_still: recording.is_still(),
            view: PixelView::new(camera)?,
            backdrop: Canvas::new(camera.width_px, camera.height_px),
            rods: RodPixels::default(),
            outline: Outline::new(&specimen.ring, scale_px_per_m),
            markers: (0..specimen.n_bodies).map(|_| OnceLock::new()).collect(),
            cover: Plate::new(hidden, first_body_px[1], COVER_TONE, 0.0),
        };
        let at_rest = CameraPose { shift_px: [0.0; 2], turn_rad: 0.0, defocus_px: 0.0 };
        let mut backdrop = Canvas::new(camera.width_px, camera.height_px);
        backdrop::draw(&specimen.tones, &layers.prospect(&at_rest), &layers.view, &mut backdrop);
        layers.rods = RodPixels::new(specimen, &layers.rod_view(&at_rest), &layers.view, backdrop.rows());
        Ok(Self { backdrop, ..layers })
    }

    /// Bodies of the given shapes in place of the specimen's rings.
    pub(crate) fn with_shapes(self, shapes: &'a Shapes) -> Self {
        Self { shapes: Some(shapes), shapes_reach_px: shapes.reach_m() * self.scale_px_per_m, ..self }
    }

    /// Where the picture shows a point of the ideal one, with the camera turned or not.
    pub(crate) fn picture_px(&self, ideal_px: [f64; 2], turn_rad: f64) -> Result<[f64; 2], SyntheticError> {
        if turn_rad.abs() > 0.0 {
            return Ok(PixelView::turned(self.camera, turn_rad, 0..0)?.picture_px(ideal_px));
        }
        Ok(self.view.picture_px(ideal_px))
    }

    /// Composes the rows of the canvas that are being drawn.
    pub(crate) fn draw(
        &self,
        instant: &Instant,
        places: &[BodyPlace],
        canvas: &mut Canvas,
    ) -> Result<(), SyntheticError> {
        let turn_rad = instant.pose.turn_rad;
        let turned = match turn_rad.abs() > 0.0 {
            true => Some(PixelView::turned(self.camera, turn_rad, canvas.rows())?),
            false => None,
        };
        let view = turned.as_ref().unwrap_or(&self.view);
        if self.is_still {
            let still = canvas.rows().start * canvas.width_px..canvas.rows().end * canvas.width_px;
            canvas.drawn_mut().copy_from_slice(&self.backdrop.values[still]);
        } else {
            backdrop::draw(&self.specimen.tones, &self.prospect(&instant.pose), view, canvas);
        }
        let is_in_view = |body: &usize| self.is_in_view(places[*body], view);
        let visible: Vec<usize> = (0..places.len()).filter(is_in_view).collect();
        for &body in &visible {
            self.draw_ring(instant, body, places, view, canvas);
        }
        let mut depths = Vec::new();
        for &body in &visible {
            let marker = self.markers[body].get_or_init(|| self.marker(body));
            marker.draw(places[body], view, canvas, &mut depths);
            if self.is_covered(instant.stamp_s, body) {
                self.cover.draw(places[body], view, canvas, &mut depths);
            }
        }
        if self.is_still {
            self.rods.draw(canvas);
        } else {
            RodPixels::new(self.specimen, &self.rod_view(&instant.pose), view, canvas.rows()).draw(canvas);
        }
        Ok(())
    }

    fn prospect(&self, pose: &CameraPose) -> Prospect {
        let [column_px, row_px] = self.first_body_px;
        let origin_px = [column_px - self.scale_px_per_m * self.shot.stage_m, row_px];
        Prospect {
            origin_px: [0, 1].map(|axis| origin_px[axis] + pose.shift_px[axis]),
            magnification: self.magnification,
            blur: Blur { path_px: 0.0, defocus_px: pose.defocus_px },
        }
    }

    fn rod_view(&self, pose: &CameraPose) -> RodView {
        RodView {
            scale_px_per_m: self.scale_px_per_m,
            axis_px: self.first_body_px[1] + pose.shift_px[1],
            width_px: self.camera.width_px,
            defocus_px: pose.defocus_px,
        }
    }

    fn draw_ring(
        &self,
        instant: &Instant,
        body: usize,
        places: &[BodyPlace],
        view: &PixelView,
        canvas: &mut Canvas,
    ) {
        let tone = self.specimen.tones.ring as f32;
        let Some(shapes) = self.shapes else {
            let stretch = self.stretch(places, body);
            return self.outline.draw(places[body], stretch, tone, view, canvas);
        };
        let (time_s, scale_px_per_m) = (instant.motion_s, self.scale_px_per_m);
        shapes.draw(&Wall { body, place: places[body], time_s, scale_px_per_m, tone }, view, canvas);
    }

    /// Whether some of a body may be seen.
    fn is_in_view(&self, place: BodyPlace, view: &PixelView) -> bool {
        let marker_px = COVER_SIZE * self.specimen.marker.half_width_m * self.scale_px_per_m;
        let blur_px = place.blur.path_px.abs() + place.blur.reach_px();
        let reach_px = self.outline.reach_px().max(self.shapes_reach_px).max(marker_px + 2.0) + blur_px;
        let [columns, _] = view.region(place.centre_px, [reach_px, 0.0]);
        !columns.is_empty()
    }

    fn is_covered(&self, stamp_s: f64, body: usize) -> bool {
        let hides =
            |cover: &crate::Cover| cover.body == body + 1 && (cover.from_s..cover.until_s).contains(&stamp_s);
        self.shot.covers.iter().any(hides)
    }

    /// How far a body's left and right neighbour are, relative to rest; a free side is as at rest.
    fn stretch(&self, places: &[BodyPlace], body: usize) -> [f64; 2] {
        let stretched = |left: Option<usize>| {
            let left = left?;
            let apart_px = places.get(left + 1)?.centre_px[0] - places.get(left)?.centre_px[0];
            Some(apart_px / (self.specimen.gap_m(left) * self.scale_px_per_m))
        };
        [body.checked_sub(1), Some(body)].map(|left| stretched(left).unwrap_or(1.0))
    }

    fn marker(&self, body: usize) -> Plate {
        let (marker, tones) = (&self.specimen.marker, &self.specimen.tones);
        let half_px = marker_half_px(self.specimen, self.scale_px_per_m);
        let diameter_px = marker.speckle_diameter_px * self.magnification;
        let pattern = Pattern::scattered(marker.seed, body as u64 + 1, half_px, diameter_px);
        Plate::new(pattern, self.first_body_px[1], tones.marker, tones.speckle_depth)
    }
}

fn marker_half_px(specimen: &Specimen, px_per_m: f64) -> [f64; 2] {
    [specimen.marker.half_width_m, specimen.marker.half_height_m].map(|half_m| half_m * px_per_m)
}
