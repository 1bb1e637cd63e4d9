use std::sync::OnceLock;

use chainwave_measurement::Trajectory;
use ndarray::Array2;

use crate::canvas::Canvas;
use crate::lighting::Lighting;
use crate::marker::{Place, Plate};
use crate::ring::Outline;
use crate::rods::RodPixels;
use crate::settings::{Camera, Shot, Specimen, require};
use crate::shapes::{Shapes, Wall};
use crate::speckle::Pattern;
use crate::view::View;
use crate::{SyntheticError, backdrop, motion, sensor};

/// Largest half size of a marker in the picture.
const MARKER_HALF_PX: f64 = 1024.0;

/// A cover's size, relative to the marker that it hides, and its tone: dark cloth.
const COVER_SIZE: f64 = 1.2;
const COVER_TONE: f64 = 0.05;

/// What one recording sees: the still parts drawn once, and what moves drawn for each frame.
///
/// An ideal camera shows body n's centre at the column `first_body_px[0] + scale ((n - 1) pitch - stage + x_n(t))` and the
/// row `first_body_px[1]`, at the time t = time stamp + trigger delay; the optics move it from there.
pub struct Scene<'a> {
    pub(crate) camera: &'a Camera,
    specimen: &'a Specimen,
    pub(crate) shot: &'a Shot,
    motion: &'a Trajectory,
    shapes: Option<&'a Shapes>,
    flicker_phase_rad: f64,
    view: View,
    backdrop: Canvas,
    outline: Outline,
    rods: RodPixels,
    /// One for each body, made when the body first comes into view.
    markers: Vec<OnceLock<Plate>>,
    cover: Plate,
}

impl<'a> Scene<'a> {
    /// Checks the settings and draws the still parts.
    ///
    /// # Errors
    /// [`SyntheticError`] when a setting or the motion is not usable, or the motion ends before the last frame.
    pub fn new(
        camera: &'a Camera,
        specimen: &'a Specimen,
        shot: &'a Shot,
        motion: &'a Trajectory,
    ) -> Result<Self, SyntheticError> {
        check(camera, specimen, shot, motion)?;
        let view = View::new(camera)?;
        let mut backdrop = Canvas::new(camera.width_px, camera.height_px);
        let origin_px = [shot.first_body_px[0] - camera.scale_px_per_m * shot.stage_m, shot.first_body_px[1]];
        backdrop::draw(&specimen.tones, origin_px, &view, &mut backdrop);
        let half_px = marker_half_px(camera, specimen);
        let hidden = Pattern::blank(half_px.map(|half_px| COVER_SIZE * half_px));
        let scene = Self {
            camera,
            specimen,
            shot,
            motion,
            shapes: None,
            flicker_phase_rad: shot.flicker_phase_rad(),
            backdrop,
            outline: Outline::new(&specimen.ring, camera.scale_px_per_m),
            rods: RodPixels::new(specimen, camera, shot.first_body_px[1], &view),
            markers: (0..specimen.n_bodies).map(|_| OnceLock::new()).collect(),
            cover: Plate::new(hidden, shot.first_body_px[1], COVER_TONE, 0.0),
            view,
        };
        scene.places(shot.n_frames - 1)?;
        Ok(scene)
    }

    /// The scene with bodies of the given shapes in place of the specimen's rings.
    ///
    /// # Errors
    /// [`SyntheticError::Motion`] when the shapes are not those of the specimen's bodies.
    pub fn with_shapes(self, shapes: &'a Shapes) -> Result<Self, SyntheticError> {
        shapes.check(self.specimen.n_bodies)?;
        Ok(Self { shapes: Some(shapes), ..self })
    }

    /// Frames in the recording.
    pub fn n_frames(&self) -> usize {
        self.shot.n_frames
    }

    /// The truth: column and row of every body's centre in a frame, in pixels, as the picture shows it in the middle of the
    /// exposure.
    ///
    /// # Errors
    /// [`SyntheticError`] when the frame lies outside the recording or the motion.
    pub fn body_centres_px(&self, frame: usize) -> Result<Vec<[f64; 2]>, SyntheticError> {
        Ok(self.places(frame)?.iter().map(|place| self.view.picture_px(place.centre_px)).collect())
    }

    /// Where every body is in the ideal picture. Within the exposure its velocity is taken for constant: for an acceleration
    /// a, the mean of its path lies a exposure^2/24 farther, 6e-5 px for 3000 m/s^2 in 10 us at 5 px/mm.
    fn places(&self, frame: usize) -> Result<Vec<Place>, SyntheticError> {
        let n_frames = self.n_frames();
        if frame >= n_frames {
            return Err(SyntheticError::FrameOutside { frame, n_frames });
        }
        let time_s = self.motion_time_s(frame);
        let half_exposure_s = if self.camera.blur { self.camera.exposure_s / 2.0 } else { 0.0 };
        let needed_s = time_s + half_exposure_s;
        let last_s = self.motion.times_s.last().copied().unwrap_or_default();
        let moment_at = |time_s: f64| {
            self.motion.at(time_s).ok_or(SyntheticError::MotionTooShort { frame, needed_s, last_s })
        };
        let (middle, end) = (moment_at(time_s)?, moment_at(needed_s)?);
        let start = moment_at(time_s - half_exposure_s)?;
        let place = |body: usize| {
            let rest_m = body as f64 * self.specimen.pitch_m - self.shot.stage_m;
            let along_m = rest_m + middle.displacement_m(body);
            let path_m = end.displacement_m(body) - start.displacement_m(body);
            let [column_px, row_px] = self.shot.first_body_px;
            let scale_px_per_m = self.camera.scale_px_per_m;
            Place {
                centre_px: [column_px + scale_px_per_m * along_m, row_px],
                blur_px: scale_px_per_m * path_m,
            }
        };
        Ok((0..self.specimen.n_bodies).map(place).collect())
    }

    /// A frame's time after the impact.
    fn motion_time_s(&self, frame: usize) -> f64 {
        self.shot.stamp_s(frame, self.camera.rate_hz) + self.shot.trigger_delay_s
    }

    /// The counts that a frame would hold without noise and rounding, shape `[height, width]`.
    ///
    /// # Errors
    /// As [`Scene::body_centres_px`].
    pub fn expected_counts(&self, frame: usize) -> Result<Array2<f32>, SyntheticError> {
        let mut canvas = self.canvas();
        self.expose(frame, &mut canvas)?;
        Ok(self.frame_of(&canvas.values))
    }

    /// The counts that the sensor gives for a frame: with noise, whole numbers, shape `[height, width]`. A P10 file
    /// holds them companded.
    ///
    /// # Errors
    /// As [`Scene::body_centres_px`].
    pub fn recorded_counts(&self, frame: usize) -> Result<Array2<f32>, SyntheticError> {
        let (mut canvas, mut counts) = (self.canvas(), Vec::new());
        self.record(frame, &mut canvas, &mut counts)?;
        Ok(self.frame_of(&counts))
    }

    /// A canvas of the frame's size.
    pub(crate) fn canvas(&self) -> Canvas {
        Canvas::new(self.camera.width_px, self.camera.height_px)
    }

    /// Sets `counts` to the frame as the sensor gives it, row by row from the top.
    pub(crate) fn record(
        &self,
        frame: usize,
        canvas: &mut Canvas,
        counts: &mut Vec<u16>,
    ) -> Result<(), SyntheticError> {
        self.expose(frame, canvas)?;
        sensor::record(&self.camera.sensor, &canvas.values, self.shot.noise_seed, frame, counts);
        Ok(())
    }

    /// Draws a frame and turns its tones into expected counts.
    fn expose(&self, frame: usize, canvas: &mut Canvas) -> Result<(), SyntheticError> {
        self.draw(frame, &self.places(frame)?, canvas);
        let black = self.camera.sensor.black_level as f32;
        let range = self.camera.sensor.white_level() - self.camera.sensor.black_level;
        let stamp_s = self.shot.stamp_s(frame, self.camera.rate_hz);
        let factor =
            |lighting: &Lighting| lighting.factor(stamp_s, self.camera.exposure_s, self.flicker_phase_rad);
        let range = (range * self.camera.lighting.as_ref().map_or(1.0, factor)) as f32;
        for value in &mut canvas.values {
            *value = black + range * *value;
        }
        Ok(())
    }

    /// Composes the layers from back to front.
    fn draw(&self, frame: usize, places: &[Place], canvas: &mut Canvas) {
        canvas.values.copy_from_slice(&self.backdrop.values);
        let visible: Vec<usize> = (0..places.len()).filter(|&body| self.is_in_view(places[body])).collect();
        for &body in &visible {
            self.draw_ring(frame, body, places, canvas);
        }
        let mut depths = Vec::new();
        for &body in &visible {
            let marker = self.markers[body].get_or_init(|| self.marker(body));
            marker.draw(places[body], &self.view, canvas, &mut depths);
            if self.is_covered(frame, body) {
                self.cover.draw(places[body], &self.view, canvas, &mut depths);
            }
        }
        self.rods.draw(canvas);
    }

    fn draw_ring(&self, frame: usize, body: usize, places: &[Place], canvas: &mut Canvas) {
        let tone = self.specimen.tones.ring as f32;
        let Some(shapes) = self.shapes else {
            let stretch = self.stretch(places, body);
            return self.outline.draw(places[body], stretch, tone, &self.view, canvas);
        };
        let (time_s, scale_px_per_m) = (self.motion_time_s(frame), self.camera.scale_px_per_m);
        shapes.draw(&Wall { body, place: places[body], time_s, scale_px_per_m, tone }, &self.view, canvas);
    }

    /// Whether some of a body may be seen.
    fn is_in_view(&self, place: Place) -> bool {
        let scale_px_per_m = self.camera.scale_px_per_m;
        let shapes_px = self.shapes.map_or(0.0, |shapes| shapes.reach_m() * scale_px_per_m);
        let marker_px = COVER_SIZE * self.specimen.marker.half_width_m * scale_px_per_m;
        let reach_px = self.outline.reach_px().max(shapes_px).max(marker_px + 2.0) + place.blur_px.abs();
        let [columns, _] = self.view.region(place.centre_px, [reach_px, 0.0]);
        !columns.is_empty()
    }

    fn is_covered(&self, frame: usize, body: usize) -> bool {
        let stamp_s = self.shot.stamp_s(frame, self.camera.rate_hz);
        let hides =
            |cover: &crate::Cover| cover.body == body + 1 && (cover.from_s..cover.until_s).contains(&stamp_s);
        self.shot.covers.iter().any(hides)
    }

    /// How far a body's left and right neighbour are, relative to rest; a free side is as at rest.
    fn stretch(&self, places: &[Place], body: usize) -> [f64; 2] {
        let pitch_px = self.specimen.pitch_m * self.camera.scale_px_per_m;
        let apart = |left: Option<&Place>, right: Option<&Place>| {
            left.zip(right).map_or(1.0, |(left, right)| (right.centre_px[0] - left.centre_px[0]) / pitch_px)
        };
        let at = |index: Option<usize>| index.and_then(|index| places.get(index));
        let here = at(Some(body));
        [apart(at(body.checked_sub(1)), here), apart(here, at(body.checked_add(1)))]
    }

    fn marker(&self, body: usize) -> Plate {
        let (marker, tones) = (&self.specimen.marker, &self.specimen.tones);
        let half_px = marker_half_px(self.camera, self.specimen);
        let pattern = Pattern::scattered(marker.seed, body as u64 + 1, half_px, marker.speckle_diameter_px);
        Plate::new(pattern, self.shot.first_body_px[1], tones.marker, tones.speckle_depth)
    }

    fn frame_of<T: Copy + Into<f32>>(&self, values: &[T]) -> Array2<f32> {
        let width = self.camera.width_px;
        Array2::from_shape_fn((self.camera.height_px, width), |(row, column)| {
            values[row * width + column].into()
        })
    }
}

/// Checks what one setting alone cannot show.
fn check(
    camera: &Camera,
    specimen: &Specimen,
    shot: &Shot,
    motion: &Trajectory,
) -> Result<(), SyntheticError> {
    camera.check()?;
    specimen.check()?;
    shot.check(camera.rate_hz)?;
    motion::check(motion, specimen.n_bodies)?;
    let marker = &specimen.marker;
    let half_px = marker.half_width_m.max(marker.half_height_m) * camera.scale_px_per_m;
    require(
        half_px <= MARKER_HALF_PX,
        "specimen.marker",
        "at most 1024 px on each side of its centre",
        half_px,
    )
}

fn marker_half_px(camera: &Camera, specimen: &Specimen) -> [f64; 2] {
    [specimen.marker.half_width_m, specimen.marker.half_height_m].map(|half_m| half_m * camera.scale_px_per_m)
}
