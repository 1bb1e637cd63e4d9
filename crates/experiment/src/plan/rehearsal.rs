//! A run without pictures: the stated chain moves, and its bodies are read with the noise that pictures will have.

use std::f64::consts::{SQRT_2, TAU};
use std::num::NonZero;

use chainwave_measurement::{Estimate, Lost, Position, map_in_parallel, median_interval_s};
use chainwave_synthetic::trials::{Draw, Scatter, draw};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::assumed_chain::AssumedChain;
use super::readings::Readings;
use super::schedule::{PlannedRecording, Schedule};
use crate::configuration::Trial;
use crate::error::Error;
use crate::geometry::scale::SharedBody;
use crate::geometry::stages::Stages;
use crate::recordings::view::bodies_in_view;
use crate::setup::Setup;
use crate::tracked::{Origin, Tracked, TrackedRecording};
use crate::tracks::{FollowedBody, RecordingTracks};

/// What is rehearsed.
#[derive(Clone)]
pub(super) struct Rehearsal {
    pub(super) setup: Setup,
    pub(super) schedule: Schedule,
    pub(super) readings: Readings,
    pub(super) chain: AssumedChain,
    /// Seed of what differs from trial to trial, and of the noise.
    pub(super) seed: u64,
}

/// Of a turn: its multiples spread over a turn as evenly as can be.
const GOLDEN_SHARE: f64 = 0.618_033_988_749_894_9;
/// Time that is simulated beyond the last frame, for triggers that come late.
const BEYOND_S: f64 = 1e-3;

impl Rehearsal {
    /// The tracks that the recordings would give, of bodies that are followed without fail while they are in view.
    ///
    /// # Errors
    /// A chain or a scatter that makes no sense.
    pub(super) fn tracked(&self, n_threads: NonZero<usize>) -> Result<Tracked, Error> {
        let recordings = &self.schedule.recordings;
        let scatters: Vec<Scatter> = recordings.iter().map(|one| self.scatter(one)).collect();
        let draws = draw(self.seed, &scatters)?;
        let of_each = |index: usize| self.tracked_recording(&recordings[index], draws[index]);
        let recordings = map_in_parallel(recordings.len(), n_threads, of_each);
        let recordings: Vec<TrackedRecording> = recordings.into_iter().collect::<Result<_, _>>()?;
        let shows_bodies = |one: &TrackedRecording| !one.tracks.bodies.is_empty();
        let recordings: Vec<TrackedRecording> = recordings.into_iter().filter(shows_bodies).collect();
        Ok(Tracked {
            observations: recordings.iter().map(TrackedRecording::observation).collect(),
            stages: Stages::as_stated(&self.setup, &self.schedule.trials(), &self.shared_bodies()),
            recordings,
            failed: Vec::new(),
            findings: Vec::new(),
        })
    }

    fn scatter(&self, one: &PlannedRecording) -> Scatter {
        let strength = self.setup.experiment.nominal_drive();
        let frame_s = median_interval_s(&one.info.times_s).unwrap_or(1.0);
        Scatter {
            striker_velocity_m_per_s: strength.value,
            striker_velocity_sigma_m_per_s: strength.sigma,
            trigger_jitter_s: self.chain.trigger_jitter_s,
            trigger_walk_s: 0.0,
            rate_hz: one.info.rate_hz.unwrap_or(frame_s.recip()),
        }
    }

    fn tracked_recording(&self, one: &PlannedRecording, draw: Draw) -> Result<TrackedRecording, Error> {
        let phase_s = if one.is_filmed { 0.0 } else { draw.frame_phase_s };
        let times_s: Vec<f64> = one.info.times_s.iter().map(|time_s| time_s + phase_s).collect();
        let last_s = times_s.iter().copied().fold(0.0, f64::max) + draw.trigger_delay_s.abs() + BEYOND_S;
        let motion = self.chain.motion(&self.setup.experiment, draw.striker_velocity_m_per_s, last_s)?;
        let tracking = &self.setup.experiment.tracking;
        let halves = [tracking.half_width_px, tracking.half_height_px].map(|half| half as f64);
        let size = [one.info.width_px, one.info.height_px].map(|size| size as f64);
        let is_inside = |at: [f64; 2]| {
            (0..2).all(|axis| at[axis] >= halves[axis] && at[axis] + halves[axis] <= size[axis] - 1.0)
        };
        let map = self.setup.map_of(&one.trial, &one.info);
        let mut random = Pcg64::seed_from_u64(draw.noise_seed);
        let mut of_body = |(body, rest_px): (usize, [f64; 2])| {
            let [x_m, y_m] = map.of_chain.map.position_m(rest_px);
            let sigma = self.readings.of_body(body);
            let sigma_px = [0, 1].map(|axis| sigma.noise_px[axis].hypot(sigma.interpolation_px[axis]));
            let positions = times_s.iter().map(|time_s| {
                let since_strike_s = time_s + draw.trigger_delay_s - self.chain.strike_s;
                let moment = motion.at(since_strike_s).ok_or(Lost::Unreadable)?;
                let at_m = [x_m + moment.displacement_m(body - 1), y_m];
                let at_px =
                    map.of_chain.map.image_px(at_m).filter(|at| is_inside(*at)).ok_or(Lost::OutOfView)?;
                let mut read = |axis: usize| {
                    let deviate: f64 = StandardNormal.sample(&mut random);
                    let moved_px = at_px[axis] - rest_px[axis];
                    // A body's own texture, the same in all recordings, decides where the wave begins.
                    let wave = SQRT_2 * (TAU * (moved_px + GOLDEN_SHARE * body as f64)).sin();
                    let off_px = sigma.noise_px[axis] * deviate + sigma.interpolation_px[axis] * wave;
                    Estimate::new(at_px[axis] + off_px, sigma_px[axis])
                };
                Ok(Position { x_px: read(0), y_px: read(1), theta_rad: None, zncc: 1.0, iterations: 0 })
            });
            let positions = positions.collect();
            FollowedBody { body, method: self.setup.method().to_string(), positions }
        };
        let in_view = bodies_in_view(&self.setup, &one.trial, &one.info).into_iter();
        let bodies = in_view.map(|(body, subset)| of_body((body, [subset.x_px, subset.y_px]))).collect();
        let tracks = RecordingTracks { times_s, bodies };
        Ok(TrackedRecording {
            trial: one.trial.clone(),
            tracks,
            map,
            picture_px: (one.info.width_px, one.info.height_px),
            line_time_s: Estimate::new(self.setup.line_time_s(), 0.0),
            without_rest: Vec::new(),
            // Its readings are of instants.
            exposure_s: 0.0,
            repeated_frames: Vec::new(),
            frame_steps: Vec::new(),
            clock: 1.0,
            origin: Origin::New(Vec::new()),
            remarks: Vec::new(),
        })
    }

    /// Views of which no other shows a body, where there are several.
    pub(super) fn views_apart(&self) -> Vec<u32> {
        let shared = self.shared_bodies();
        let stages = self.schedule.stages();
        let is_apart = |view: &u32| stages.len() > 1 && shared.iter().all(|one| !one.views.contains(view));
        let mut views: Vec<u32> = stages.iter().map(|(view, _)| *view).filter(is_apart).collect();
        views.dedup();
        views
    }

    /// Bodies that two views show, which will tell how the views are magnified: by the places of a marker's halves in the mean pictures at
    /// rest, whose noise is small beside what interpolation leaves of it.
    fn shared_bodies(&self) -> Vec<SharedBody> {
        let shows = |view: &(u32, f64)| {
            let one = self.schedule.recordings.iter().find(|one| one.trial.view == view.0)?;
            let trial = Trial { stage_m: view.1, ..one.trial.clone() };
            Some(
                bodies_in_view(&self.setup, &trial, &one.info)
                    .into_iter()
                    .map(|(body, _)| body)
                    .collect::<Vec<_>>(),
            )
        };
        let views = self.schedule.stages();
        let shown: Vec<Vec<usize>> = views.iter().map(|view| shows(view).unwrap_or_default()).collect();
        let shared = |[one, other]: [usize; 2]| {
            let bodies = shown[one].iter().filter(|body| shown[other].contains(body));
            let stated_m = views[other].1 - views[one].1;
            bodies
                .map(|body| SharedBody {
                    body: *body,
                    views: [views[one].0, views[other].0],
                    stated_m,
                    found_m: Estimate::new(stated_m, 0.0),
                    from_middle_m: 0.5 * stated_m,
                    magnified: Some(Estimate::new(0.0, 0.0)),
                })
                .collect::<Vec<_>>()
        };
        let n = views.len();
        (0..n).flat_map(|one| (one + 1..n).map(move |other| [one, other])).flat_map(shared).collect()
    }
}
