//! Sensitivities: the motion together with its derivatives by parameters.

use std::iter::Peekable;
use std::vec::IntoIter;

use chainwave_measurement::Trajectory;
use ndarray::{Array2, ShapeBuilder};

use super::{
    automatic::{self, Carried},
    change::{Change, DerivativeRequest, Resistance},
    recorded_steps::RecordedSteps,
    replay::{Replay, Stretch},
    run_request::RunRequest,
    schedule::Schedule,
    simulation::Simulation,
    step_size::Pace,
    tangent::Tangent,
};
use crate::equations::{
    model::ChainModel,
    parameters::Chain,
    row::{MassRow, RowEnd},
};
use crate::{check, error::MechanicsError, integrator::method::Method};

/// A motion, and its derivatives by changes of the chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivities {
    /// The motion of the chain itself.
    pub simulation: Simulation,
    /// For each change, the derivatives of displacements (metres) and velocities (metres per second) by what is changed, at the
    /// times of the outputs.
    pub derivatives: Vec<Trajectory>,
}

/// Longest step of the variational equations, in radians of the chain's fastest oscillation at rest: derivatives are then good to some
/// 1e-7 of their largest value.
const LONGEST_STEP_RAD: f64 = 0.04;

/// Longest step over the stability bound, which a gap in tension may lower.
const STABLE_SHARE: f64 = 0.25;

/// Integrates the chain's motion and, along it, the variational equations of the changes (E. Hairer, S. P. Norsett, G. Wanner,
/// Solving Ordinary Differential Equations I, 1993, I.14).
///
/// What a change does to the accelerations at a given place and speed is a difference of the two chains' accelerations there, of
/// second order in the step between them; how it spreads from there on is integrated, not differenced. Where the striker touches
/// again its dashpot pushes at once, and the derivatives of the velocities jump by that push times the change of the instant (the
/// saltation of M. A. Aizerman, F. R. Gantmacher, Q. J. Mech. Appl. Math. 11 (1958) 225-241).
///
/// # Errors
/// As for [`simulate`](super::simulate::simulate), for any of the chains; [`MechanicsError::NotAlike`] for changes that are more than changed numbers.
pub fn simulate_with_sensitivities(
    chain: &Chain,
    schedule: &Schedule,
    changes: &[Change],
) -> Result<Sensitivities, MechanicsError> {
    solve(chain, schedule, DerivativeRequest { changes, resistances: &[] })
}

/// The same, and behind the derivatives by the changes what dry friction and drag do to the motion, for each of some resistances: the motion
/// with it less that without, in metres and metres per second.
///
/// The contacts answer the difference by their stiffness along the motion without it: right to second order in the difference over
/// the length in which the contacts' stiffness changes.
///
/// # Errors
/// As for [`simulate_with_sensitivities`]; [`MechanicsError::NotPhysical`] for a negative resistance.
pub fn simulate_with_resistance(
    chain: &Chain,
    schedule: &Schedule,
    changes: &[Change],
    resistances: &[Resistance],
) -> Result<Sensitivities, MechanicsError> {
    solve(chain, schedule, DerivativeRequest { changes, resistances })
}

fn solve(
    chain: &Chain,
    schedule: &Schedule,
    asked: DerivativeRequest<'_>,
) -> Result<Sensitivities, MechanicsError> {
    let kept = if asked.n() == 0 { Kept::Outputs } else { Kept::Steps };
    let motion = ReferenceMotion::solve(chain, schedule, kept)?;
    let derivatives = motion.derivatives(asked.changes, asked.resistances)?;
    Ok(Sensitivities { simulation: motion.simulation, derivatives })
}

/// A motion, solved as finely as the variational equations along it ask.
///
/// Several of them may go along it, side by side and from one output to another ([`ReferenceMotion::variations`]), so that the derivatives by
/// many changes need not all be held over all of the time.
#[derive(Debug)]
pub struct ReferenceMotion<'a> {
    chain: &'a Chain,
    model: ChainModel<'a>,
    /// At the outputs.
    simulation: Simulation,
    /// How it was integrated, with outputs at all steps of the variational equations, and what was in place of the chain.
    order: RunRequest,
    instead: Option<Chain>,
    /// All of these steps, where they are held.
    steps: Option<RecordedSteps>,
}

/// What of a motion is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kept {
    /// The outputs: for a motion along which little or nothing goes. It is integrated again where anything does.
    Outputs,
    /// The steps of the variational equations too, where they are so few that they take little memory, for these to go along them.
    Steps,
}

/// Displacements that are held at once of the motion along which all of the derivatives are worked out: 32 MB with the velocities.
const HELD: usize = 1 << 21;
/// Displacements of all masses at all steps up to which these are held beside the outputs: 8 MB with the velocities. Longer motions are integrated again.
const HELD_WHOLE: usize = 1 << 19;

impl<'a> ReferenceMotion<'a> {
    /// Integrates the chain's motion.
    ///
    /// # Errors
    /// As for [`simulate`](super::simulate::simulate).
    pub fn solve(chain: &'a Chain, schedule: &Schedule, kept: Kept) -> Result<Self, MechanicsError> {
        chain.check()?;
        check::positive("output_interval_s", schedule.output_interval_s)?;
        let n_between = steps_between(chain, schedule.output_interval_s);
        let output_interval_s = schedule.output_interval_s / n_between as f64;
        let fine = Schedule { output_interval_s, ..*schedule };
        let n_steps = fine.check(chain, n_between)?;
        let holds_steps = kept == Kept::Steps && n_steps * MassRow::of(chain).n_masses() <= HELD_WHOLE;
        let Carried { mut simulation, order, instead, steps } =
            automatic::run(chain, &fine, n_steps, (n_between, holds_steps))?;
        let n_outputs = simulation.trajectory.times_s.len();
        simulation.trajectory.times_s =
            (0..n_outputs).map(|k| k as f64 * schedule.output_interval_s).collect();
        Ok(Self { chain, model: ChainModel::new(chain), simulation, order, instead, steps })
    }

    /// The motion at the outputs.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// Number of outputs.
    pub fn n_outputs(&self) -> usize {
        self.simulation.trajectory.times_s.len()
    }

    /// The variational equations of changes and, behind them, of what resists the bodies ([`simulate_with_resistance`]), at t = 0.
    ///
    /// # Errors
    /// Of any of the chains that make no sense; [`MechanicsError::NotAlike`] for changes that are more than changed numbers;
    /// [`MechanicsError::NotPhysical`] for a negative resistance.
    pub fn variations<'b>(
        &'b self,
        changes: &'b [Change],
        resistances: &'b [Resistance],
    ) -> Result<Variations<'b>, MechanicsError> {
        changes.iter().enumerate().try_for_each(|(index, change)| change.check(index, self.chain))?;
        resistances.iter().try_for_each(Resistance::check)?;
        let asked = DerivativeRequest { changes, resistances };
        Ok(Variations {
            motion: self,
            tangent: Tangent::new(self.chain, &self.model, asked),
            n: asked.n(),
            switches: switches_of(&self.simulation).into_iter().peekable(),
            output: 0,
        })
    }

    /// The motion of all masses once more, for variations to go along it.
    ///
    /// # Errors
    /// As when it was solved.
    pub fn replay(&self) -> Result<Replay<'_>, MechanicsError> {
        match &self.steps {
            Some(steps) => Ok(Replay::held(steps, self.order, self.n_outputs())),
            None => Replay::of(self.instead.as_ref().unwrap_or(self.chain), self.order, self.n_outputs()),
        }
    }

    /// The derivatives by changes and the effects of resistances ([`ReferenceMotion::variations`]) at all outputs.
    ///
    /// # Errors
    /// As for the variations.
    pub fn derivatives(
        &self,
        changes: &[Change],
        resistances: &[Resistance],
    ) -> Result<Vec<Trajectory>, MechanicsError> {
        let mut variations = self.variations(changes, resistances)?;
        if variations.n == 0 {
            return Ok(Vec::new());
        }
        let (mut replay, n_outputs) = (self.replay()?, self.n_outputs());
        let mut found =
            vec![at_rest(self.chain.n_bodies(), &self.simulation.trajectory.times_s); variations.n];
        let length = (HELD / (self.model.n_masses() * self.order.keep_every)).max(1);
        for first in (0..n_outputs - 1).step_by(length) {
            variations.follow(&replay.until(first + length)?, first, &mut found);
        }
        finite(found)
    }
}

/// The variational equations of several changes on their way along a motion.
pub struct Variations<'a> {
    motion: &'a ReferenceMotion<'a>,
    tangent: Tangent<'a>,
    /// Derivatives that are sought.
    n: usize,
    switches: Peekable<IntoIter<(f64, RowEnd)>>,
    /// Where they stand.
    output: usize,
}

impl Variations<'_> {
    /// Goes along a part of the motion, which begins where they stand, and gives the derivatives at its outputs.
    ///
    /// # Errors
    /// [`MechanicsError::NotFinite`] for derivatives that grow beyond all bounds.
    pub fn along(&mut self, stretch: &Stretch) -> Result<Vec<Trajectory>, MechanicsError> {
        let [first, last] = stretch.outputs;
        let outputs_s = &self.motion.simulation.trajectory.times_s[first..=last];
        let mut found = vec![at_rest(self.motion.chain.n_bodies(), outputs_s); self.n];
        self.follow(stretch, 0, &mut found);
        finite(found)
    }

    /// Goes along a part of the motion, and writes the derivatives at its outputs from one place on.
    fn follow(&mut self, stretch: &Stretch, place: usize, found: &mut [Trajectory]) {
        let Self { motion, tangent, switches, .. } = self;
        let Stretch { outputs: [first, last], masses } = stretch;
        let n_between = motion.order.keep_every;
        debug_assert_eq!(self.output, *first, "a part of the motion follows the one before it");
        tangent.record(place, found);
        for k in 0..(last - first) * n_between {
            let (mut start_s, end_s) = (masses.times_s[k], masses.times_s[k + 1]);
            while let Some((switch_s, end)) = switches.next_if(|(switch_s, _)| *switch_s <= end_s) {
                if !tangent.sleeps_until(masses, k + 1) {
                    tangent.step(masses, k + 1, [start_s, switch_s]);
                }
                tangent.switch(masses, end, switch_s);
                start_s = switch_s;
            }
            if !tangent.sleeps_until(masses, k + 1) {
                tangent.step(masses, k + 1, [start_s, end_s]);
            }
            if (k + 1).is_multiple_of(n_between) {
                tangent.record(place + (k + 1) / n_between, found);
            }
        }
        self.output = *last;
    }
}

/// Derivatives that are numbers throughout.
fn finite(found: Vec<Trajectory>) -> Result<Vec<Trajectory>, MechanicsError> {
    let is_finite =
        |derivative: &Trajectory| derivative.displacement_m.fold(true, |all, value| all && value.is_finite());
    let last_s = || found.first().and_then(|one| one.times_s.last()).copied().unwrap_or(0.0);
    match found.iter().all(is_finite) {
        true => Ok(found),
        false => Err(MechanicsError::NotFinite { time_s: last_s() }),
    }
}

/// When the strikers' contacts switched, and whose, in their order.
fn switches_of(simulation: &Simulation) -> Vec<(f64, RowEnd)> {
    let near = simulation.contact_switch_times_s.iter().map(|time_s| (*time_s, RowEnd::Near));
    let far = simulation.far_contact_switch_times_s.iter().map(|time_s| (*time_s, RowEnd::Far));
    let mut switches: Vec<(f64, RowEnd)> = near.chain(far).collect();
    switches.sort_by(|one, other| one.0.total_cmp(&other.0));
    switches
}

/// Steps of the variational equations between two outputs.
fn steps_between(chain: &Chain, output_interval_s: f64) -> usize {
    let pace = Pace::new(chain);
    let omega_rad_per_s = pace.omega_at_rest();
    let stable_s = STABLE_SHARE * pace.stable_s(Method::Rk4, omega_rad_per_s);
    let longest_s = (LONGEST_STEP_RAD / omega_rad_per_s).min(stable_s);
    (output_interval_s / longest_s).ceil().max(1.0) as usize
}

/// Rest, the values of one time side by side as they are written and read.
fn at_rest(n_bodies: usize, times_s: &[f64]) -> Trajectory {
    let rest = Array2::zeros((n_bodies, times_s.len()).f());
    Trajectory { times_s: times_s.to_vec(), displacement_m: rest.clone(), velocity_m_per_s: rest }
}
