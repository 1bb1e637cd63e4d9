//! The camera's motion: found from bodies that the wave has not reached, and taken out of what is stitched.

use chainwave_analysis::{CameraMotion, at_rest_p_value, at_rest_rule, camera_motion, camera_motion_rule};
use chainwave_measurement::{ChainMotion, ErrorSource, Estimate, Observation, median};
use ndarray::Array2;

use crate::chain::stated_motion::StatedMotion;
use crate::configuration::Experiment;
use crate::geometry::scale::ScaleCheck;
use crate::tracks::Coordinate;

/// Whether the camera moves, and its motion; before that, views that are magnified differently are put on one scale.
pub(crate) struct Stabilisation {
    pub(crate) scale: ScaleCheck,
    /// Absent where no recording shows two bodies at rest.
    pub(crate) found: Option<CameraMotion>,
    /// Until when each body certainly rests, in seconds after the trigger.
    pub(crate) rests_until_s: Vec<f64>,
    /// Share of the time to the wave's arrival by the stated chain in which bodies certainly rest.
    certain_share: f64,
    /// Whether what is found may be the bodies' own: across the chain they may ring ahead of the wave, as rods do, where along it the camera rests.
    may_be_bodies: bool,
}

/// Share of the time to the wave's arrival by the stated chain in which a body rests: a sound speed that is a tenth off changes nothing.
const CERTAIN_SHARE: f64 = 0.9;
/// Shares that are tried instead where bodies move in that time, as those do that bend and carry faster waves; the last leaves what lies
/// before the strike.
const SMALLER_SHARES: [f64; 5] = [0.6, 0.4, 0.25, 0.15, 0.0];
/// Displacement, in standard uncertainties of a reading, by which the wave has arrived.
const ARRIVED_SIGMA: f64 = 0.1;

impl Stabilisation {
    /// Follows the camera through all recordings.
    pub(crate) fn of(
        experiment: &Experiment,
        stated: &StatedMotion,
        observations: &[Observation],
        scale: &ScaleCheck,
    ) -> Self {
        let scale = scale.clone();
        let observations = &scale.levelled(observations.to_vec());
        let sigmas = observations.iter().flat_map(|one| &one.bodies).flat_map(|track| &track.position_m);
        let Some(sigma_m) = median(sigmas.flatten().map(|place| place.sigma).collect()) else {
            let (found, rests_until_s, certain_share) = (None, Vec::new(), CERTAIN_SHARE);
            return Self { scale, found, rests_until_s, certain_share, may_be_bodies: false };
        };
        // The chain is at rest before `tracking.rest_until_s`, so the wave comes later than that by so much.
        let arrivals_s = stated.arrivals_s(ARRIVED_SIGMA * sigma_m);
        let rests_until_s = |share: f64| -> Vec<f64> {
            let from_s = experiment.tracking.rest_until_s;
            arrivals_s.iter().map(|arrival_s| from_s + share * arrival_s).collect()
        };
        // Bodies that move at any time, before the strike too, are moved by something else than a wave that runs ahead.
        let moves = |share: f64| {
            let p_value = at_rest_p_value(observations, &rests_until_s(share));
            p_value.is_some_and(|p_value| at_rest_rule().rejects(p_value))
        };
        let shares = std::iter::once(CERTAIN_SHARE).chain(SMALLER_SHARES);
        let certain_share = shares.into_iter().find(|share| !moves(*share)).unwrap_or(CERTAIN_SHARE);
        let rests_until_s = rests_until_s(certain_share);
        let found = camera_motion(observations, &rests_until_s);
        Self { found, scale, rests_until_s, certain_share, may_be_bodies: false }
    }

    /// The same in another coordinate of the same bodies, which rest as long: across the chain by the same scale, and turned by none.
    pub(crate) fn in_coordinate(&self, coordinate: Coordinate, observations: &[Observation]) -> Self {
        let scale = match coordinate {
            Coordinate::Along | Coordinate::Across => self.scale.clone(),
            Coordinate::Turn => ScaleCheck::default(),
        };
        let found = camera_motion(&scale.levelled(observations.to_vec()), &self.rests_until_s);
        let (rests_until_s, certain_share) = (self.rests_until_s.clone(), self.certain_share);
        Self { found, scale, rests_until_s, certain_share, may_be_bodies: self.motion().is_none() }
    }

    /// What bodies that the wave has not reached do together, where it is more than chance.
    fn told(&self) -> Option<&CameraMotion> {
        self.found.as_ref().filter(|found| camera_motion_rule().rejects(found.departure.p_value))
    }

    /// The motion, where the camera is told to move.
    pub(crate) fn motion(&self) -> Option<&CameraMotion> {
        self.told().filter(|_| !self.may_be_bodies)
    }

    /// What is told, and may be the bodies' own.
    fn disputed(&self) -> Option<&CameraMotion> {
        self.told().filter(|_| self.may_be_bodies)
    }

    /// Positions by one scale and without the camera's motion; as they are where nothing was found.
    pub(crate) fn steadied(&self, observations: Vec<Observation>) -> Vec<Observation> {
        let levelled = self.scale.levelled(observations);
        match self.motion() {
            Some(motion) => motion.taken_out_of(&levelled),
            None => levelled,
        }
    }

    /// Adds to a motion the error that all trials share: where no recording that saw a body knew the camera's motion. One that may be the bodies' own
    /// was left in all of it, and is its error where it is the camera's.
    pub(crate) fn add_to(&self, motion: &mut ChainMotion, observations: &[Observation]) {
        if let Some(disputed) = self.disputed() {
            let sizes_m: Vec<f64> = motion
                .times_s
                .iter()
                .map(|time_s| disputed.departure.size.value * disputed.growth(*time_s))
                .collect();
            let displacement_m = Array2::from_shape_fn(motion.displacement_m.dim(), |(_, i)| sizes_m[i]);
            motion.add_error(ErrorSource::CameraMotion, &displacement_m);
        }
        let Some(camera) = self.motion().filter(|camera| camera.shared_m > 0.0) else { return };
        let error_m = |(row, i): (usize, usize)| {
            let sees = |one: &&Observation| one.bodies.iter().any(|track| track.body == row + 1);
            let is_known = |one: &Observation| camera.is_known(&one.recording, motion.times_s[i]);
            let is_open =
                motion.displacement_m[(row, i)].is_some() && !observations.iter().filter(sees).any(is_known);
            if is_open { camera.shared_m * camera.growth(motion.times_s[i]) } else { 0.0 }
        };
        let displacement_m = Array2::from_shape_fn(motion.displacement_m.dim(), error_m);
        motion.add_error(ErrorSource::CameraMotion, &displacement_m);
    }

    /// Positions whose uncertainty is such that a fit to all of them, which takes them for independent, gives an unknown motion its weight:
    /// it hardly changes from frame to frame, so that its variance counts as often as there are frames in which it is not known, and
    /// what all recordings share of it as often again as there are recordings.
    pub(crate) fn widened(&self, mut observations: Vec<Observation>) -> Vec<Observation> {
        let Some(camera) = self.motion() else { return observations };
        let shared_m2 = camera.shared_m.powi(2);
        let own_m2 = (camera.departure.size.value.powi(2) - shared_m2).max(0.0);
        let of_all_m2 = own_m2 + shared_m2 * observations.len() as f64;
        for observation in &mut observations {
            let is_known = |time_s: &f64| camera.is_known(&observation.recording, *time_s);
            let known: Vec<bool> = observation.times_s.iter().map(is_known).collect();
            let extra_m2 = of_all_m2 * known.iter().filter(|known| !**known).count() as f64;
            for track in &mut observation.bodies {
                let places = track.position_m.iter_mut().zip(&observation.times_s).zip(&known);
                for ((place, time_s), _) in places.filter(|(_, known)| !**known) {
                    let extra_m2 = extra_m2 * camera.growth(*time_s).powi(2);
                    *place = place.map(|x| Estimate::new(x.value, (x.sigma.powi(2) + extra_m2).sqrt()));
                }
            }
        }
        observations
    }

    /// What the reader should know of a coordinate beside that along the chain, in which the motion's size has a unit and is so many of it in one.
    pub(crate) fn warning_beside(&self, (unit, in_one): (&str, f64)) -> Option<String> {
        let taken_out = self.motion().map(|_| {
            "the camera moves in it as well: its motion was taken out where two bodies at rest tell it, and stands in the \
             uncertainties elsewhere"
                .to_owned()
        });
        let left_in = self.disputed().map(|disputed| {
            format!(
                "bodies that the wave has not reached move together in it by {:.2} {unit} (rms), and not along the chain: the bodies \
                 themselves, as what carries them rings, or the camera. It was left in, and stands in the uncertainties",
                in_one * disputed.departure.size.value
            )
        });
        taken_out.or(left_in)
    }

    /// What the reader should know of bodies that move before the wave of the stated chain comes.
    pub(crate) fn precursor(&self) -> Option<String> {
        (self.certain_share < CERTAIN_SHARE).then(|| {
            format!(
                "bodies move against each other before the wave of the stated chain comes, as of faster waves that bodies carry which bend: they \
                 count as at rest for {:.0} % of the time until then",
                100.0 * self.certain_share
            )
        })
    }

    /// What the reader should know of a camera that moves, or of light that does.
    pub(crate) fn warning(&self, light_moves: bool) -> Option<String> {
        let camera = self.motion()?;
        let [n_known, n] = camera.n_known;
        let set_off = match camera.shared_m > 0.5 * camera.departure.size.value {
            true => "; all trials share most of it, as of a camera that the strike sets off",
            false => "",
        };
        let what = match light_moves {
            true => "the light moves, or the camera does as well",
            false => "the camera moves",
        };
        Some(format!(
            "{what}: bodies that the wave has not reached swing together by {:.2} um (rms){set_off}. It was taken out of the \
             {:.0} % of frames that show two such bodies; in the others it counts as an uncertainty, which hardly varies within a \
             period, so that speeds may be farther off than stated (hint: a firmer stand, or more bodies ahead of the wave in view)",
            1e6 * camera.departure.size.value,
            100.0 * n_known as f64 / n.max(1) as f64
        ))
    }
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::{BodyTrack, ErrorModes};

    use super::*;

    /// Two bodies that rest for 20 frames and then swing together by 10 um, as three trials read them to 1 um.
    fn swinging() -> Vec<Observation> {
        let times_s: Vec<f64> = (-20..200).map(|frame| f64::from(frame) * 4e-5).collect();
        let of_trial = |trial: u32| {
            let track = |body: usize| {
                let noise_m = |k: usize| 1e-6 * (2.4 * (k + 31 * body) as f64 + f64::from(trial)).sin();
                let swing_m = |time_s: f64| 1e-5 * (2000.0 * time_s.max(0.0)).sin();
                let place =
                    |(k, time_s): (usize, &f64)| Some(Estimate::new(swing_m(*time_s) + noise_m(k), 1e-6));
                BodyTrack { body, position_m: times_s.iter().enumerate().map(place).collect() }
            };
            let (times_s, bodies) = (times_s.clone(), vec![track(1), track(2)]);
            Observation { recording: trial.to_string(), view: 1, trial, times_s, bodies }
        };
        (1..4).map(of_trial).collect()
    }

    fn along(found: Option<CameraMotion>) -> Stabilisation {
        let rests_until_s = vec![1.0, 1.0];
        Stabilisation {
            scale: ScaleCheck::default(),
            found,
            rests_until_s,
            certain_share: CERTAIN_SHARE,
            may_be_bodies: false,
        }
    }

    #[test]
    fn what_bodies_do_across_a_chain_along_which_the_camera_rests_is_left_in() {
        let seen = swinging();
        let beside = along(None).in_coordinate(Coordinate::Across, &seen);
        assert_eq!(beside.steadied(seen.clone()), seen);
        let said = beside.warning_beside(("um", 1e6)).unwrap();
        assert!(said.contains("um (rms), and not along the chain") && said.contains("left in"), "{said}");
        let mut motion = ChainMotion {
            times_s: vec![1e-3],
            displacement_m: Array2::from_elem((2, 1), Some(Estimate::new(0.0, 1e-7))),
            independent_sigma_m: Array2::from_elem((2, 1), 1e-7),
            modes: ErrorModes::default(),
            n_trials: Array2::ones((2, 1)),
        };
        beside.add_to(&mut motion, &seen);
        // Ten um of a sine have 7 um (rms), over the frames behind the trigger in which it swings.
        let sigma_m = motion.displacement_m[(0, 0)].unwrap().sigma;
        assert!((3e-6..3e-5).contains(&sigma_m), "{sigma_m}");
    }

    #[test]
    fn where_the_camera_moves_along_the_chain_it_is_the_camera_across_it_too() {
        let seen = swinging();
        let moving = along(camera_motion(&seen, &[1.0, 1.0]));
        assert!(moving.motion().is_some());
        let beside = moving.in_coordinate(Coordinate::Across, &seen);
        let said = beside.warning_beside(("um", 1e6)).unwrap();
        assert!(said.contains("taken out"), "{said}");
        assert_ne!(beside.steadied(seen.clone()), seen);
    }
}
