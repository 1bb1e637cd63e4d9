//! Choice of method and step: constant, halved until two runs agree, or adaptive, as the scene calls for.

use super::{
    recorded_steps::RecordedSteps,
    recorder::Recorder,
    run::Run,
    run_request::{Pacing, RunRequest},
    schedule::{Integration, Schedule},
    simulation::Simulation,
    step_size::Pace,
};
use crate::equations::parameters::{Chain, Drive, FarEnd, FarStriker};
use crate::{
    check,
    contact::{
        contacts::{Contact, Contacts, Law},
        linear::LinearLaw,
        tension::Tension,
    },
    error::MechanicsError,
    integrator::method::Method,
};

/// Decay over oscillation from which on the dampers, and not the springs, would set the explicit step by far.
const STIFF_DAMPING: f64 = 50.0;
/// Room that the errors of adaptive steps, added up, have to grow on their way, as neighbouring motions of a chain drift apart:
/// they grow by 0.03 to 2 where a striker meets damped bodies and the stiffness changes little within the wave.
const ROOM: f64 = 10.0;
/// The room anywhere else. Kinks of the stiffness, as a hard blow or a table's points make them, can hide errors from a step's
/// estimate: they then grew by up to 30. And a chain whose bodies have no dampers is held to its energy, the measure that
/// everyone checks: so 300 bodies struck at 2.73 m/s keep theirs within 1e-9 over 150 ms at an accuracy of 1e-6.
const WIDE_ROOM: f64 = 200.0;
/// Change of the stiffness over the wave, relative to that at rest, up to which a blow is no hard one.
const HARD: f64 = 10.0;
/// Times that steps whose errors add up to more than was asked for are made anew: errors follow the accuracy of steps nearly in proportion, so that one
/// is mostly enough.
const MOST_TIGHTENED: u32 = 3;
/// What is asked of them then, over what would just do.
const TIGHTER: f64 = 0.5;
/// The least that is asked of them, over what was asked before: an error that collisions multiply falls with that by more than the error of one step.
const TIGHTEST: f64 = 1e-3;
/// What steps are held to, relative to a run's own, in another one that tells what its collisions multiply.
const COARSER: f64 = 100.0;
/// What an error over kinks may be larger than by the fall of errors on average: from one run to the next it jumps by as much.
const JUMP: f64 = 3.0;
/// Halvings after which an accuracy counts as out of reach.
const MAX_HALVINGS: u32 = 16;
/// Longest first step of a method of order 1, in radians of the fastest oscillation: what the accuracy takes is told from two short runs.
const FIRST_AIM_RAD: f64 = 1e-3;
/// Steps times bodies that halved steps may come to where nobody asked for them (half a minute of computing).
const MAX_HALVED_BODY_STEPS: f64 = 5e8;

/// A simulation, and how to go through it again.
pub(crate) struct Carried {
    pub(crate) simulation: Simulation,
    pub(crate) order: RunRequest,
    /// The chain that was integrated in place of the one that was asked for.
    pub(crate) instead: Option<Chain>,
    /// The states of all masses at all outputs, where they are held.
    pub(crate) steps: Option<RecordedSteps>,
}

/// Runs a chain as its schedule says, and keeps one of so many outputs, and the states of all masses at all of them or not.
pub(crate) fn run(
    chain: &Chain,
    schedule: &Schedule,
    n_outputs: usize,
    (keep_every, holds_steps): (usize, bool),
) -> Result<Carried, MechanicsError> {
    let task = Assignment { chain, schedule, n_outputs, keep_every, holds_steps };
    match schedule.integration {
        Integration::Steps { method, dt_s } => task.with_steps(method, dt_s),
        Integration::Accuracy { method, accuracy } if method.is_adaptive() => {
            let choice = format!("{method} was asked for; its steps follow its estimates of the error");
            task.adaptive(method, accuracy, choice)
        }
        Integration::Accuracy { method, accuracy } => task.halved(method, accuracy),
        Integration::Automatic { accuracy } => task.automatic(accuracy),
    }
}

#[derive(Clone, Copy)]
struct Assignment<'a> {
    chain: &'a Chain,
    schedule: &'a Schedule,
    n_outputs: usize,
    keep_every: usize,
    holds_steps: bool,
}

impl Carried {
    fn by(mut run: Run<'_, Recorder>, choice: String) -> Self {
        let steps = run.record.take_steps();
        Self { order: run.order(), simulation: run.finish(choice), instead: None, steps }
    }
}

impl Assignment<'_> {
    fn order(&self, method: Method, pacing: Pacing) -> RunRequest {
        RunRequest {
            method,
            pacing,
            bodies: self.schedule.bodies,
            output_interval_s: self.schedule.output_interval_s,
            n_outputs: self.n_outputs,
            keep_every: self.keep_every,
            holds_steps: self.holds_steps,
        }
    }

    fn with_steps(&self, method: Method, dt_s: f64) -> Result<Carried, MechanicsError> {
        let choice = format!("{method} with steps of at most {dt_s:e} s was asked for");
        Ok(Carried::by(self.constant(&Pace::new(self.chain), method, dt_s)?, choice))
    }

    /// A run with constant steps, refused where they turn out unstable.
    fn constant(
        &self,
        pace: &Pace<'_>,
        method: Method,
        dt_s: f64,
    ) -> Result<Run<'_, Recorder>, MechanicsError> {
        // The step used divides the output interval.
        let dt_s = dt_s.min(self.schedule.output_interval_s);
        pace.check_stable(method, dt_s, pace.omega_at_rest())?;
        let run = Run::complete(self.chain, pace, self.order(method, Pacing::Constant { dt_s }))?;
        pace.check_stable(method, run.dt_s(), pace.omega_reached(&run.ledger))?;
        Ok(run)
    }

    /// Steps of a length that suits each. They are held to the accuracy one by one, in proportion to the time they take of the chain's own; over very many
    /// oscillations, and in contacts that close in a part of one, they add up to more, and are made again with as much less.
    ///
    /// Where contacts opened, bodies fly and collide, and each collision multiplies what came before it, as in a gas of hard spheres: what steps add up to
    /// says little there, and another run with other steps tells the error.
    fn adaptive(&self, method: Method, accuracy: f64, choice: String) -> Result<Carried, MechanicsError> {
        let pace = Pace::new(self.chain);
        let complete = |of_steps: f64, holds_steps: bool| {
            let order = self.order(method, self.adaptive_pacing(&pace, of_steps));
            Run::complete(self.chain, &pace, RunRequest { holds_steps, ..order })
        };
        let mut of_steps = accuracy;
        let mut run = complete(of_steps, self.holds_steps)?;
        let mut error = run.error_estimate();
        let mut has_opened = pace.has_opened(&run.ledger);
        if has_opened {
            // Where no coarser run comes to its end, what steps add up to is all that is known.
            let coarser = complete(of_steps * COARSER, false);
            error = coarser.map_or(error, |coarser| error_beside(&run, &coarser, COARSER.recip()));
        }
        for _ in 0..MOST_TIGHTENED {
            let Some(too_large) = error.filter(|error| *error > accuracy) else { break };
            let asked = TIGHTER * accuracy / too_large;
            // Runs that are nearly alike tell little of each other's errors.
            let tighter = if has_opened { asked.clamp(TIGHTER * TIGHTEST, COARSER.recip()) } else { asked };
            of_steps *= tighter;
            // Where no step is as fine as that, the first one stands, with its estimate.
            let Ok(finer) = complete(of_steps, self.holds_steps) else { break };
            has_opened = pace.has_opened(&finer.ledger);
            error = match has_opened {
                true => error_beside(&finer, &run, tighter),
                false => finer.error_estimate(),
            };
            run = finer;
        }
        let mut carried = Carried::by(run, choice);
        carried.simulation.error_estimate = error;
        Ok(carried)
    }

    fn adaptive_pacing(&self, pace: &Pace<'_>, accuracy: f64) -> Pacing {
        let change = steepest_bend_per_m(self.chain).zip(self.first_overlap_m(pace));
        let smooth = change.is_some_and(|(bend_per_m, overlap_m)| bend_per_m * overlap_m <= HARD);
        let room = if smooth && self.chain.is_damped() { ROOM } else { WIDE_ROOM };
        Pacing::Adaptive { accuracy, room }
    }

    /// A guess of the overlaps that strikers make, in metres: the faster one's way in a radian of the fastest oscillation.
    fn first_overlap_m(&self, pace: &Pace<'_>) -> Option<f64> {
        let far_m_per_s = self.chain.far_striker().map_or(0.0, |far| far.striker.velocity_m_per_s);
        match &self.chain.drive {
            Drive::Striker(striker) => Some(striker.velocity_m_per_s.max(far_m_per_s) / pace.omega_at_rest()),
            _ => None,
        }
    }

    /// Halves constant steps until two runs agree; the error of the finer one follows from the method's order.
    fn halved(&self, method: Method, accuracy: f64) -> Result<Carried, MechanicsError> {
        let pace = Pace::new(self.chain);
        let omega_rad_per_s = pace.omega_at_rest();
        let order = f64::from(method.order());
        let aim_rad = accuracy.powf(order.recip()).max(FIRST_AIM_RAD).min(0.5 * method.stable_oscillation());
        let longest_s = 0.5 * pace.stable_s(method, omega_rad_per_s);
        let mut dt_s = (aim_rad / omega_rad_per_s).min(longest_s).min(self.schedule.output_interval_s);
        // Steps over a jump of the forces err in proportion to their length, whatever the method.
        let gain = if self.chain.has_dashpots_that_end() { 1.0 } else { order.exp2() - 1.0 };
        let mut coarse: Option<Run<'_, Recorder>> = None;
        let mut before: Option<f64> = None;
        for _ in 0..MAX_HALVINGS {
            let fine = match self.constant(&pace, method, dt_s) {
                Ok(run) => run,
                Err(MechanicsError::StepTooLarge { .. } | MechanicsError::NotFinite { .. }) => {
                    (coarse, dt_s) = (None, 0.5 * dt_s);
                    continue;
                }
                Err(error) => return Err(error),
            };
            let difference = coarse.map(|coarse| fine.record.relative_difference(&coarse.record));
            let error = match pace.has_opened(&fine.ledger) {
                // Over contacts that open errors fall with a step's square, and jump: two runs may agree by chance.
                true => {
                    difference.zip(before).map(|(difference, before)| JUMP * difference.max(before * 0.25))
                }
                false => difference.map(|difference| difference / gain),
            };
            if let Some(error) = error {
                let finer = (error / accuracy).max(1.0).powf(order.recip());
                self.expect_few_steps(fine.dt_s() / finer)?;
            }
            if let Some(error) = error.filter(|error| *error <= accuracy) {
                let choice = format!("{method} was asked for; its step was halved until two runs agreed");
                let mut carried = Carried::by(fine, choice);
                carried.simulation.error_estimate = Some(error);
                return Ok(carried);
            }
            dt_s = 0.5 * fine.dt_s();
            (coarse, before) = (Some(fine), difference);
        }
        Err(MechanicsError::OutOfReach { method: method.name(), accuracy, time_s: 0.0, h_s: dt_s })
    }

    /// Refuses steps of a length that an accuracy asks for where there are too many of them.
    fn expect_few_steps(&self, dt_s: f64) -> Result<(), MechanicsError> {
        let body_steps = self.schedule.duration_s / dt_s * self.chain.n_bodies() as f64;
        let hint = "a coarser accuracy, or a method of higher order, as dop853 is";
        check::limit("time steps times bodies", MAX_HALVED_BODY_STEPS, body_steps, hint)
    }

    /// The method that the scene asks for.
    fn automatic(&self, accuracy: f64) -> Result<Carried, MechanicsError> {
        if let Some(carried) = self.linear(accuracy)? {
            return Ok(carried);
        }
        let pace = Pace::new(self.chain);
        let stiffness = pace.decay_per_s / pace.omega_at_rest();
        if stiffness > STIFF_DAMPING {
            let choice = format!(
                "esdirk4, because the dampers are {stiffness:.0} times as fast as the springs: it is implicit"
            );
            return self.adaptive(Method::Esdirk4, accuracy, choice);
        }
        let choice = "dop853, because nothing is stiff: the highest order takes the longest steps".to_owned();
        self.adaptive(Method::Dop853, accuracy, choice)
    }

    /// The chain with linear springs in place of power laws, where that changes the displacements by less than a tenth of the
    /// accuracy.
    ///
    /// At y = Delta / delta_0 the law's stiffness departs from k_0 by a part (p - 1) y, so a wave's phase, omega t for the
    /// fastest one, by up to half that part. The rule is judged by the overlaps reached, after a guess before the run.
    fn linear(&self, accuracy: f64) -> Result<Option<Carried>, MechanicsError> {
        let Some(bend_per_m) = steepest_bend_per_m(self.chain) else { return Ok(None) };
        let pace = Pace::new(self.chain);
        let omega_rad_per_s = pace.omega_at_rest();
        let phase_rad = 1.0 + omega_rad_per_s * self.schedule.duration_s;
        let error_at = |overlap_m: f64| 0.5 * bend_per_m * overlap_m * phase_rad;
        let Some(guess_m) = self.first_overlap_m(&pace) else { return Ok(None) };
        if error_at(guess_m) > 0.1 * accuracy || pace.decay_per_s > STIFF_DAMPING * omega_rad_per_s {
            return Ok(None);
        }
        let linear = linearised(self.chain)?;
        let order = self.order(Method::Dop853, self.adaptive_pacing(&pace, accuracy));
        let run = Run::complete(&linear, &Pace::new(&linear), order)?;
        let largest_m = pace.largest_overlap_m(&run.ledger);
        let error = error_at(largest_m);
        if error > 0.1 * accuracy || pace.has_opened(&run.ledger) {
            return Ok(None);
        }
        let choice = format!(
            "dop853 with linear springs: the overlaps stay so small that the power law changes displacements by less \
             than {error:.1e} of the largest"
        );
        let estimate = run.error_estimate().map(|estimate| estimate + error);
        let mut carried = Carried::by(run, choice);
        carried.simulation.error_estimate = estimate;
        Ok(Some(Carried { instead: Some(linear), ..carried }))
    }
}

/// The error of a run by what one with coarser steps makes of the same; `tighter` is what its steps are held to over the other's.
///
/// Over kinks of the forces errors fall more slowly than what steps are held to, and at least by its root.
fn error_beside(fine: &Run<'_, Recorder>, coarse: &Run<'_, Recorder>, tighter: f64) -> Option<f64> {
    let falls_to = tighter.sqrt();
    let told = JUMP * fine.record.relative_difference(&coarse.record) * falls_to / (1.0 - falls_to);
    fine.error_estimate().map(|added| added.max(told))
}

/// The largest relative change of stiffness per overlap of any power law, |p - 1| / delta_0; nothing where there is another
/// kind of law, be it to ground.
fn steepest_bend_per_m(chain: &Chain) -> Option<f64> {
    let bend = |contact: &Contact| match &contact.law {
        Law::Power(law) => Some((law.p - 1.0).abs() / law.delta_0_m),
        _ => None,
    };
    if chain.ground_law.is_some() {
        return None;
    }
    chain.all_contacts().into_iter().map(bend).try_fold(0.0_f64, |largest, bend| Some(largest.max(bend?)))
}

/// The chain with springs of the stiffness at zero overlap.
fn linearised(chain: &Chain) -> Result<Chain, MechanicsError> {
    let far_end = match &chain.far_end {
        FarEnd::Struck(far) => {
            let contact = far.contact.as_ref().map(linear_spring).transpose()?;
            FarEnd::Struck(FarStriker { contact, ..far.clone() })
        }
        end => end.clone(),
    };
    Ok(Chain { contact: linear_springs(&chain.contact)?, far_end, ..chain.clone() })
}

fn linear_springs(contacts: &Contacts) -> Result<Contacts, MechanicsError> {
    Ok(match contacts {
        Contacts::Same(contact) => Contacts::Same(linear_spring(contact)?),
        Contacts::Each(contacts) => {
            Contacts::Each(contacts.iter().map(linear_spring).collect::<Result<_, _>>()?)
        }
        Contacts::Struck { striker, between } => {
            Contacts::Struck { striker: linear_spring(striker)?, between: Box::new(linear_springs(between)?) }
        }
    })
}

fn linear_spring(contact: &Contact) -> Result<Contact, MechanicsError> {
    let law = Law::Linear(LinearLaw::new(contact.stiffness_n_per_m(0.0))?);
    Ok(Contact { law, tension: Tension::default(), ..contact.clone() })
}
