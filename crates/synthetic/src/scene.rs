//! A scene: what one recording sees, drawn frame by frame, and its truth.

use chainwave_measurement::Trajectory;
use ndarray::Array2;

use crate::blur::Blur;
use crate::canvas::Canvas;
use crate::check::require;
use crate::effects::AlongAxis;
use crate::layers::{Instant, Layers};
use crate::marker::BodyPlace;
use crate::recording_camera::{CameraPose, CameraTruth, RecordingCamera};
use crate::settings::{Camera, Shot, Specimen};
use crate::shapes::Shapes;
use crate::{SyntheticError, motion, sensor};

/// Largest half size of a marker in the picture.
const MARKER_HALF_PX: f64 = 1024.0;

/// What one recording sees.
///
/// An ideal camera shows body n's centre at the column `first_body_px[0] + scale ((n - 1) pitch - stage + x_n(t))` and the
/// row `first_body_px[1]`, at the time t = time stamp + trigger delay; a shake displaces that ideal picture, and the optics
/// move it from there. A body that moves towards the camera is seen farther from the middle.
pub struct Scene<'a> {
    pub(crate) camera: &'a Camera,
    specimen: &'a Specimen,
    pub(crate) shot: &'a Shot,
    motion: &'a Trajectory,
    flicker_phase_rad: f64,
    recording: RecordingCamera<'a>,
    along_axis: Option<AlongAxis>,
    layers: Layers<'a>,
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
        let recording = RecordingCamera::new(camera, shot);
        let layers = Layers::new(camera, specimen, shot, &recording)?;
        let flicker_phase_rad = shot.flicker_phase_rad();
        let effects = &camera.effects;
        let along_axis = effects.out_of_plane.map(|own| own.of_bodies(effects.seed, motion));
        let scene = Self { camera, specimen, shot, motion, flicker_phase_rad, recording, along_axis, layers };
        scene.places(shot.n_frames - 1, &scene.instant(shot.n_frames - 1, camera.height_px as f64))?;
        Ok(scene)
    }

    /// The scene with bodies of the given shapes in place of the specimen's rings.
    ///
    /// # Errors
    /// [`SyntheticError::Motion`] when the shapes are not those of the specimen's bodies.
    pub fn with_shapes(self, shapes: &'a Shapes) -> Result<Self, SyntheticError> {
        shapes.check(self.specimen.n_bodies)?;
        Ok(Self { layers: self.layers.with_shapes(shapes), ..self })
    }

    /// Frames in the recording.
    pub fn n_frames(&self) -> usize {
        self.shot.n_frames
    }

    /// The truth: column and row of every body's centre in a frame, in pixels, as the picture shows it in the middle of the
    /// exposure of the line that it lies on.
    ///
    /// # Errors
    /// [`SyntheticError`] when the frame lies outside the recording or the motion.
    pub fn body_centres_px(&self, frame: usize) -> Result<Vec<[f64; 2]>, SyntheticError> {
        let seen_px = |row: f64| -> Result<Vec<[f64; 2]>, SyntheticError> {
            let instant = self.instant(frame, row);
            let places = self.places(frame, &instant)?;
            let turn_rad = instant.pose.turn_rad;
            places.iter().map(|place| self.layers.picture_px(place.centre_px, turn_rad)).collect()
        };
        let mut centres_px = seen_px(0.0)?;
        if self.recording.is_rolling() {
            // A centre moves far less than a line while a line is read: the second step leaves nothing.
            for (body, centre_px) in centres_px.iter_mut().enumerate() {
                for _ in 0..2 {
                    *centre_px = seen_px(centre_px[1])?[body];
                }
            }
        }
        Ok(centres_px)
    }

    /// What was drawn for this recording's camera.
    pub fn camera_truth(&self) -> CameraTruth {
        self.recording.truth()
    }

    /// How the camera stands and is focused at a frame's time stamp.
    pub fn camera_pose(&self, frame: usize) -> CameraPose {
        self.instant(frame, 0.0).pose
    }

    /// When a row of a frame is exposed.
    fn instant(&self, frame: usize, row: f64) -> Instant {
        let stamp_s = self.shot.stamp_s(frame, self.camera.rate_hz) + self.recording.delay_s(row);
        let motion_s = stamp_s + self.shot.trigger_delay_s;
        Instant { stamp_s, motion_s, pose: self.recording.pose(stamp_s) }
    }

    /// Where every body is in the ideal picture. Within the exposure its velocity is taken for constant: for an acceleration
    /// a, the mean of its path lies a exposure^2/24 farther, 6e-5 px for 3000 m/s^2 in 10 us at 5 px/mm.
    fn places(&self, frame: usize, instant: &Instant) -> Result<Vec<BodyPlace>, SyntheticError> {
        let n_frames = self.n_frames();
        if frame >= n_frames {
            return Err(SyntheticError::FrameOutside { frame, n_frames });
        }
        let (time_s, pose) = (instant.motion_s, instant.pose);
        let half_exposure_s = if self.camera.blur { self.camera.exposure_s / 2.0 } else { 0.0 };
        let needed_s = time_s + half_exposure_s;
        let last_s = self.motion.times_s.last().copied().unwrap_or_default();
        let moment_at = |time_s: f64| {
            self.motion.at(time_s).ok_or(SyntheticError::MotionTooShort { frame, needed_s, last_s })
        };
        let (middle, end) = (moment_at(time_s)?, moment_at(needed_s)?);
        let start = moment_at(time_s - half_exposure_s)?;
        let place = |body: usize| {
            let rest_m = self.specimen.rest_m(body) - self.shot.stage_m;
            let along_m = rest_m + middle.displacement_m(body);
            let path_m = end.displacement_m(body) - start.displacement_m(body);
            let [column_px, row_px] = self.recording.first_body_px;
            let scale_px_per_m = self.recording.scale_px_per_m;
            let centre_px = [column_px + scale_px_per_m * along_m, row_px];
            let nearer = self.along_axis.as_ref().map_or(0.0, |own| own.magnification(body, time_s));
            let from_middle_px = |axis: usize| centre_px[axis] - 0.5 * (self.size_px()[axis] as f64 - 1.0);
            let centre_px = [0, 1].map(|axis| centre_px[axis] + nearer * from_middle_px(axis));
            BodyPlace {
                centre_px: [0, 1].map(|axis| centre_px[axis] + pose.shift_px[axis]),
                blur: Blur { path_px: scale_px_per_m * path_m, defocus_px: pose.defocus_px },
            }
        };
        Ok((0..self.specimen.n_bodies).map(place).collect())
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

    fn size_px(&self) -> [usize; 2] {
        [self.camera.width_px, self.camera.height_px]
    }

    /// A canvas of the frame's size.
    pub(crate) fn canvas(&self) -> Canvas {
        Canvas::new(self.camera.width_px, self.camera.height_px)
    }

    /// Sets `counts` to the frame as the camera stores it, row by row from the top.
    pub(crate) fn record(
        &self,
        frame: usize,
        canvas: &mut Canvas,
        counts: &mut Vec<u16>,
    ) -> Result<(), SyntheticError> {
        self.expose(frame, canvas)?;
        self.recording.add_line_noise(frame, &mut canvas.values);
        sensor::record(&self.camera.sensor, &canvas.values, self.shot.noise_seed, frame, counts);
        self.recording.store(frame, counts);
        Ok(())
    }

    /// Draws a frame, all rows at once or one after the other, and turns its tones into expected counts.
    fn expose(&self, frame: usize, canvas: &mut Canvas) -> Result<(), SyntheticError> {
        let height_px = self.camera.height_px;
        let rows_at_once = if self.recording.is_rolling() { 1 } else { height_px };
        for first_row in (0..height_px).step_by(rows_at_once) {
            canvas.draw_in(first_row..first_row + rows_at_once);
            let instant = self.instant(frame, first_row as f64);
            self.layers.draw(&instant, &self.places(frame, &instant)?, canvas)?;
            self.recording.collect(canvas.drawn_mut(), first_row, instant.stamp_s, self.flicker_phase_rad);
        }
        canvas.draw_in(0..height_px);
        self.recording.lay_pattern(&mut canvas.values);
        Ok(())
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
