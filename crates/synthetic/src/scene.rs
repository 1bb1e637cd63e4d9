use std::sync::OnceLock;

use chainwave_measurement::Trajectory;
use ndarray::Array2;

use crate::ring::Outline;
use crate::rods::RodRows;
use crate::settings::{Camera, Shot, Specimen, Tones, require};
use crate::speckle::{Axis, Pattern};
use crate::{SyntheticError, backdrop, motion, sensor};

/// Largest half size of a marker in the picture.
const MARKER_HALF_PX: f64 = 1024.0;

/// What one recording sees: the still parts drawn once, and what moves drawn for each frame.
///
/// Body n's centre lies at the column `first_body_px[0] + scale ((n - 1) pitch - stage + x_n(t))` and the row
/// `first_body_px[1]`, at the time t = time stamp + trigger delay.
pub struct Scene<'a> {
    camera: &'a Camera,
    specimen: &'a Specimen,
    shot: &'a Shot,
    motion: &'a Trajectory,
    backdrop: Canvas,
    outline: Outline,
    rods: RodRows,
    /// One for each body, made when the body first comes into view.
    markers: Vec<OnceLock<MarkerView>>,
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
        let mut backdrop = Canvas::new(camera.width_px, camera.height_px);
        let origin_px = [shot.first_body_px[0] - camera.scale_px_per_m * shot.stage_m, shot.first_body_px[1]];
        backdrop::draw(&specimen.tones, origin_px, &mut backdrop);
        let scene = Self {
            camera,
            specimen,
            shot,
            motion,
            backdrop,
            outline: Outline::new(&specimen.ring, camera.scale_px_per_m),
            rods: RodRows::new(specimen, camera.scale_px_per_m, shot.first_body_px[1], camera.height_px),
            markers: (0..specimen.n_bodies).map(|_| OnceLock::new()).collect(),
        };
        scene.body_centres_px(shot.n_frames - 1)?;
        Ok(scene)
    }

    /// Frames in the recording.
    pub fn n_frames(&self) -> usize {
        self.shot.n_frames
    }

    /// The truth: column and row of every body's centre in a frame, in pixels.
    ///
    /// # Errors
    /// [`SyntheticError`] when the frame lies outside the recording or the motion.
    pub fn body_centres_px(&self, frame: usize) -> Result<Vec<[f64; 2]>, SyntheticError> {
        let n_frames = self.n_frames();
        if frame >= n_frames {
            return Err(SyntheticError::FrameOutside { frame, n_frames });
        }
        let needed_s = self.shot.stamp_s(frame, self.camera.rate_hz) + self.shot.trigger_delay_s;
        let last_s = self.motion.times_s.last().copied().unwrap_or_default();
        let moment =
            self.motion.at(needed_s).ok_or(SyntheticError::MotionTooShort { frame, needed_s, last_s })?;
        let centre_px = |body: usize| {
            let rest_m = body as f64 * self.specimen.pitch_m - self.shot.stage_m;
            let along_m = rest_m + moment.displacement_m(body);
            [self.shot.first_body_px[0] + self.camera.scale_px_per_m * along_m, self.shot.first_body_px[1]]
        };
        Ok((0..self.specimen.n_bodies).map(centre_px).collect())
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
        let centres_px = self.body_centres_px(frame)?;
        self.draw(&centres_px, canvas);
        let black = self.camera.sensor.black_level as f32;
        let range = (self.camera.sensor.white_level() - self.camera.sensor.black_level) as f32;
        for value in &mut canvas.values {
            *value = black + range * *value;
        }
        Ok(())
    }

    /// Composes the layers from back to front.
    fn draw(&self, centres_px: &[[f64; 2]], canvas: &mut Canvas) {
        canvas.values.copy_from_slice(&self.backdrop.values);
        let marker_px = self.specimen.marker.half_width_m * self.camera.scale_px_per_m + 2.0;
        let reach_px = self.outline.reach_px().max(marker_px);
        let in_view = -reach_px..self.camera.width_px as f64 + reach_px;
        let visible =
            || centres_px.iter().enumerate().filter(|(_, centre_px)| in_view.contains(&centre_px[0]));
        for (body, &centre_px) in visible() {
            self.outline.draw(
                centre_px,
                self.stretch(centres_px, body),
                self.specimen.tones.ring as f32,
                canvas,
            );
        }
        let mut depths = Vec::new();
        for (body, &centre_px) in visible() {
            let marker = self.markers[body].get_or_init(|| self.marker(body));
            marker.draw(centre_px[0], &self.specimen.tones, canvas, &mut depths);
        }
        self.rods.draw(canvas);
    }

    /// How far a body's left and right neighbour are, relative to rest; a free side is as at rest.
    fn stretch(&self, centres_px: &[[f64; 2]], body: usize) -> [f64; 2] {
        let pitch_px = self.specimen.pitch_m * self.camera.scale_px_per_m;
        let apart = |left: Option<&[f64; 2]>, right: Option<&[f64; 2]>| {
            left.zip(right).map_or(1.0, |(left, right)| (right[0] - left[0]) / pitch_px)
        };
        let at = |index: Option<usize>| index.and_then(|index| centres_px.get(index));
        let here = at(Some(body));
        [apart(at(body.checked_sub(1)), here), apart(here, at(body.checked_add(1)))]
    }

    fn marker(&self, body: usize) -> MarkerView {
        let marker = &self.specimen.marker;
        let half_size_px =
            [marker.half_width_m, marker.half_height_m].map(|half| half * self.camera.scale_px_per_m);
        let pattern =
            Pattern::scattered(marker.seed, body as u64 + 1, half_size_px, marker.speckle_diameter_px);
        MarkerView { rows: pattern.rows(self.shot.first_body_px[1]), pattern }
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

/// A body's marker. Bodies move along the rows only, so the rows' integrals are computed once.
struct MarkerView {
    pattern: Pattern,
    rows: Axis,
}

impl MarkerView {
    /// Lays the marker over the canvas, its centre at the column `centre_px`; `depths` is scratch.
    fn draw(&self, centre_px: f64, tones: &Tones, canvas: &mut Canvas, depths: &mut Vec<f64>) {
        let columns = self.pattern.columns(centre_px);
        self.pattern.add_up(&columns, &self.rows, depths);
        let first = columns.first_px.clamp(0, canvas.width_px as i64);
        let hidden = (first - columns.first_px) as usize;
        let top = self.rows.first_px;
        for ((row, height), depths) in
            (top..).zip(&self.rows.covered).zip(depths.chunks_exact(columns.n_pixels()))
        {
            let Some(row) = usize::try_from(row).ok().filter(|&row| row < canvas.height_px()) else {
                continue;
            };
            let pixels = canvas.row_mut(row)[first as usize..].iter_mut();
            for ((value, width), depth) in
                pixels.zip(columns.covered.iter().skip(hidden)).zip(depths.iter().skip(hidden))
            {
                let covered = width * height;
                let light = tones.marker * covered - tones.speckle_depth * depth;
                *value += (light - covered * f64::from(*value)) as f32;
            }
        }
    }
}

/// A frame under construction, row by row from the top.
pub(crate) struct Canvas {
    pub(crate) width_px: usize,
    pub(crate) values: Vec<f32>,
}

impl Canvas {
    pub(crate) fn new(width_px: usize, height_px: usize) -> Self {
        Self { width_px, values: vec![0.0; width_px * height_px] }
    }

    pub(crate) fn height_px(&self) -> usize {
        self.values.len() / self.width_px
    }

    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [f32] {
        &mut self.values[row * self.width_px..(row + 1) * self.width_px]
    }

    pub(crate) fn rows_mut(&mut self) -> impl Iterator<Item = (usize, &mut [f32])> {
        self.values.chunks_exact_mut(self.width_px).enumerate()
    }
}
