//! The chain as a plan takes it for true: as it is stated, struck as it is stated, with dampings that only a fit will tell.

use chainwave_measurement::Trajectory;
use chainwave_mechanics::{Schedule, simulate};

use crate::configuration::Experiment;
use crate::error::Error;
use crate::input::numbers::Positive;

/// What is taken for true.
#[derive(Debug, Clone)]
pub(super) struct AssumedChain {
    /// c_d, in kilograms per second.
    pub(super) damping_kg_per_s: f64,
    /// c_s, likewise.
    pub(super) striker_damping_kg_per_s: f64,
    /// Standard deviation of the trigger's delay from trial to trial, in seconds.
    pub(super) trigger_jitter_s: f64,
    /// When the chain is struck, in seconds: at t = 0, the trigger, or once the stated rest is over, as in recordings whose t = 0 is their first frame.
    pub(super) strike_s: f64,
    /// What no key of the experiment states, in words.
    pub(super) assumed: Vec<String>,
}

/// Standard deviation of a usual trigger, in frames.
const USUAL_JITTER_FRAMES: f64 = 0.25;
/// Standard deviations of the trigger by which a strike comes after the end of the rest.
const AFTER_REST_SIGMAS: f64 = 4.0;
/// Samples of the motion in the shortest period of the chain: their cubic interpolant errs by 4e-8 of an amplitude.
const SAMPLES_A_PERIOD: f64 = 100.0;

impl AssumedChain {
    /// As an experiment that is filmed by so many frames a second states it; with the dampings that a fit starts from where it states none.
    ///
    /// # Errors
    /// A contact law that makes no sense.
    pub(super) fn of(experiment: &Experiment, rate_hz: f64) -> Result<Self, Error> {
        let synthetic = experiment.synthetic.as_ref();
        let stated =
            experiment.chain.damping_kg_per_s.as_ref().map(|stated| stated.mean(experiment.chain.n_bodies));
        let mut assumed = Vec::new();
        let mut or_usual = |stated: Option<f64>, usual: f64, text: String| {
            stated.unwrap_or_else(|| {
                assumed.push(text);
                usual
            })
        };
        let [c_d, c_s] = experiment.starting_dampings_kg_per_s()?;
        let stated_c_d = synthetic.map(|filmed| filmed.damping_kg_per_s.get()).or(stated);
        let stated_c_s = synthetic.map(|filmed| filmed.c_s_kg_per_s());
        let stated_jitter = synthetic.map(|filmed| filmed.trigger_jitter_s.get());
        let stated_jitter = stated_jitter.or(experiment.trigger.sigma_s.map(Positive::get));
        let jitter_s = USUAL_JITTER_FRAMES / rate_hz;
        let damping_kg_per_s =
            or_usual(stated_c_d, c_d, format!("c_d = {c_d:.1e} kg/s (hint: chain.damping_kg_per_s)"));
        let striker_damping_kg_per_s = match experiment.striker {
            Some(_) => or_usual(stated_c_s, c_s, format!("c_s = {c_s:.1e} kg/s")),
            None => 0.0,
        };
        let trigger_jitter_s = or_usual(
            stated_jitter,
            jitter_s,
            format!("a trigger that scatters by {USUAL_JITTER_FRAMES} frames (hint: trigger.sigma_s)"),
        );
        let rest_until_s = experiment.tracking.rest_until_s;
        let strike_s =
            if rest_until_s > 0.0 { rest_until_s + AFTER_REST_SIGMAS * trigger_jitter_s } else { 0.0 };
        Ok(Self { damping_kg_per_s, striker_damping_kg_per_s, trigger_jitter_s, strike_s, assumed })
    }

    /// The motion by a drive of so much strength ([`Experiment::nominal_drive`]).
    ///
    /// # Errors
    /// A chain that makes no sense.
    pub(super) fn motion(
        &self,
        experiment: &Experiment,
        strength: f64,
        duration_s: f64,
    ) -> Result<Trajectory, Error> {
        let dampings = [self.damping_kg_per_s, self.striker_damping_kg_per_s];
        let duration_s = experiment.while_driven_s(duration_s);
        let chain = experiment.chain_driven(strength, dampings, duration_s)?;
        let shortest_s = experiment.band_edge_hz()?.recip() / SAMPLES_A_PERIOD;
        let interval_s = shortest_s.min(0.002 * duration_s);
        Ok(experiment
            .seen_from_rest(simulate(&chain, &Schedule::automatic(duration_s, interval_s))?.trajectory))
    }
}
