//! The camera of recordings that are not filmed yet: as the experiment states it under `[synthetic]`, else a usual one.

use chainwave_measurement::RecordingInfo;
use chainwave_synthetic::{Camera, Effects, Marker, Packing, Ring, Rods, Sensor, Shot, Specimen, Tones};

use crate::configuration::Experiment;
use crate::error::Error;
use crate::input::numbers::Positive;
use crate::setup::Setup;

/// A camera, what it sees, and how long.
#[derive(Debug, Clone)]
pub(super) struct PlannedCamera {
    pub(super) camera: Camera,
    pub(super) specimen: Specimen,
    /// Number of the first image; the trigger is image 0.
    pub(super) first_image: i64,
    pub(super) n_frames: usize,
    /// What was assumed of it, in words; nothing of one that is stated.
    pub(super) assumed: Vec<String>,
}

/// Frames in the shortest period of the chain, where no rate is stated.
const FRAMES_A_PERIOD: f64 = 40.0;
/// Frames of the chain at rest, where nothing is stated.
const REST_FRAMES: f64 = 40.0;
/// Share of the sound speed at which a strong pulse of a softening chain runs, so that one filmed until then has passed.
const SLOWEST_SHARE: f64 = 0.75;
/// Diameter of a usual speckle, in pixels.
const SPECKLE_PX: f64 = 4.5;
/// Texture that a subset needs around it, in pixels.
const MARGIN_PX: usize = 5;
/// Half the length of a usual body, in pitches; only its marker matters.
const RING_SHARE: f64 = 0.48;

impl PlannedCamera {
    /// The camera that the experiment films with under `[synthetic]`, else a usual one.
    ///
    /// # Errors
    /// A contact law that makes no sense, and settings that no camera has.
    pub(super) fn of(setup: &Setup) -> Result<Self, Error> {
        let Some(synthetic) = &setup.experiment.synthetic else { return Self::usual(setup) };
        synthetic.camera.check()?;
        let mut specimen = synthetic.specimen.clone();
        let unequal_m = setup.experiment.unequal_gaps_at_rest_m()?;
        if !unequal_m.is_empty() {
            specimen.gaps_m = unequal_m;
        }
        Ok(Self {
            camera: synthetic.camera.clone(),
            specimen,
            first_image: synthetic.first_image,
            n_frames: synthetic.n_frames,
            assumed: Vec::new(),
        })
    }

    fn usual(setup: &Setup) -> Result<Self, Error> {
        let (experiment, scale_px_per_m) = (&setup.experiment, setup.map.m_per_px().value.recip());
        let linear = experiment.linear_chain()?;
        let stated_hz = experiment.camera.rate_hz.map(Positive::get);
        let rate_hz = stated_hz.unwrap_or((FRAMES_A_PERIOD * experiment.band_edge_hz()?).max(1.0).round());
        let first_image = (experiment.tracking.rest_until_s * rate_hz - REST_FRAMES).floor();
        let last_s = linear.crossing_time_s(experiment.chain.n_bodies) / SLOWEST_SHARE;
        let strike_s = experiment.tracking.rest_until_s.max(0.0);
        let n_frames = ((strike_s + last_s) * rate_hz - first_image).ceil();
        let camera = usual_camera(usual_size_px(setup, scale_px_per_m), rate_hz, scale_px_per_m);
        let mut assumed = vec![format!(
            "a camera of 12 bits in files of 16, {} x {} px, read noise {} counts and {} counts an electron; speckles of {SPECKLE_PX} px with a \
             contrast of 0.13 (rms) of the range (hint: film one recording of a view, or state the camera under [synthetic])",
            camera.width_px,
            camera.height_px,
            camera.sensor.read_noise_counts,
            camera.sensor.counts_per_electron
        )];
        if stated_hz.is_none() {
            assumed.push(format!(
                "{rate_hz} frames a second: {FRAMES_A_PERIOD} in the chain's shortest period (hint: camera.rate_hz)"
            ));
        }
        assumed.push(format!(
            "{n_frames} frames: {REST_FRAMES} at rest, then until a pulse of {SLOWEST_SHARE} times the sound speed has crossed the chain"
        ));
        let specimen = usual_specimen(experiment, scale_px_per_m)?;
        let (first_image, n_frames) = (first_image as i64, n_frames as usize);
        Ok(Self { camera, specimen, first_image, n_frames, assumed })
    }

    /// A recording at one place of the stage as it would be filmed if the camera were triggered by the impact.
    pub(super) fn shot(&self, setup: &Setup, view: u32, stage_m: f64) -> Shot {
        Shot {
            stage_m,
            first_body_px: setup.experiment.camera.first_body_px,
            first_image: self.first_image,
            n_frames: self.n_frames,
            trigger_delay_s: 0.0,
            frame_phase_s: 0.0,
            noise_seed: setup.experiment.analysis.seed,
            view: view.into(),
            covers: Vec::new(),
        }
    }

    /// What a recording of this camera will say of itself; its stamps count from a trigger that falls on image 0.
    pub(super) fn info(&self) -> RecordingInfo {
        let camera = &self.camera;
        let stamp_s = |frame: usize| (self.first_image as f64 + frame as f64) / camera.rate_hz;
        RecordingInfo {
            format: "planned".into(),
            width_px: camera.width_px,
            height_px: camera.height_px,
            n_frames: self.n_frames,
            bit_depth: camera.sensor.bit_depth,
            rate_hz: Some(camera.rate_hz),
            times_s: (0..self.n_frames).map(stamp_s).collect(),
            first_image: self.first_image,
            camera: None,
            exposure_s: Some(camera.exposure_s),
            triggered_unix_s: None,
            warnings: Vec::new(),
        }
    }
}

/// Columns and rows that show the bodies from one place of the stage to the next, with as much beyond them at both ends, unless the experiment
/// states them.
fn usual_size_px(setup: &Setup, scale_px_per_m: f64) -> [usize; 2] {
    let Experiment { chain, camera, tracking, .. } = &setup.experiment;
    if let Some(raw) = camera.raw {
        return [raw.width_px(), raw.height_px()];
    }
    let [first_px, row_px] = camera.first_body_px;
    let whole_m = (chain.n_bodies - 1) as f64 * chain.mean_pitch_m();
    let way_px = largest_step_m(setup).unwrap_or(whole_m) * scale_px_per_m;
    // Columns count from the left, where a chain to the left ends.
    let beyond_px = match setup.map.goes_left() {
        true => (first_px - way_px).max((tracking.half_width_px + MARGIN_PX) as f64),
        false => first_px,
    };
    [2.0 * beyond_px + 1.0 + way_px, 2.0 * row_px + 1.0]
        .map(|px| px.ceil().clamp(1.0, f64::from(u16::MAX)) as usize)
}

fn usual_camera([width_px, height_px]: [usize; 2], rate_hz: f64, scale_px_per_m: f64) -> Camera {
    Camera {
        width_px,
        height_px,
        rate_hz,
        exposure_s: 0.1 / rate_hz,
        blur: false,
        packing: Packing::Bits16,
        scale_px_per_m,
        sensor: Sensor {
            bit_depth: 12,
            black_level: 64.0,
            read_noise_counts: 12.0,
            counts_per_electron: 0.2,
        },
        optics: None,
        lighting: None,
        effects: Effects::default(),
    }
}

/// Markers as large as their subsets with a margin.
fn usual_specimen(experiment: &Experiment, scale_px_per_m: f64) -> Result<Specimen, Error> {
    let (chain, tracking) = (&experiment.chain, &experiment.tracking);
    let pitch_m = chain.mean_pitch_m();
    let half_m = |half_px: usize| ((half_px + MARGIN_PX) as f64 / scale_px_per_m).min(RING_SHARE * pitch_m);
    Ok(Specimen {
        n_bodies: chain.n_bodies,
        pitch_m,
        gaps_m: experiment.unequal_gaps_at_rest_m()?,
        ring: Ring {
            semi_major_m: RING_SHARE * pitch_m,
            semi_minor_m: 0.5 * RING_SHARE * pitch_m,
            wall_m: 0.02 * pitch_m,
        },
        marker: Marker {
            half_width_m: half_m(tracking.half_width_px),
            half_height_m: half_m(tracking.half_height_px),
            speckle_diameter_px: SPECKLE_PX,
            seed: 1,
        },
        rods: Rods { diameter_m: 0.05 * pitch_m, below_axis_m: Vec::new() },
        tones: Tones::default(),
    })
}

/// The largest step of the stage from one view to the next; `None` where it never moves.
fn largest_step_m(setup: &Setup) -> Option<f64> {
    let mut stages_m: Vec<f64> = setup.trials.iter().map(|trial| trial.stage_m).collect();
    stages_m.sort_by(f64::total_cmp);
    let largest = stages_m.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    (largest > 0.0).then_some(largest)
}
