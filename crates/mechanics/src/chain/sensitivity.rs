//! Sensitivities: the motion together with its derivatives by parameters.

use std::iter::Peekable;
use std::vec::IntoIter;

use chainwave_measurement::Trajectory;
use ndarray::{Array2, Axis, ShapeBuilder, Slice};

use super::{
    change::{Asked, Change},
    model::ChainModel,
    parameters::Chain,
    row::End,
    schedule::Schedule,
    simulate::simulate,
    simulation::{Simulation, StrikerMotion},
    step_size::Pace,
    tangent::Tangent,
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
/// As for [`simulate`], for any of the chains; [`MechanicsError::NotAlike`] for changes that are more than changed numbers.
pub fn simulate_with_sensitivities(
    chain: &Chain,
    schedule: &Schedule,
    changes: &[Change],
) -> Result<Sensitivities, MechanicsError> {
    solve(chain, schedule, Asked { changes, frictions_n: &[] })
}

/// The same, and behind the derivatives by the changes what dry friction does to the motion, for each of some forces: the motion with it less
/// that without, in metres and metres per second. The force is the same on every body and against its motion, and holds it at rest
/// where nothing stronger moves it.
///
/// The contacts answer the difference by their stiffness along the motion without friction: right to second order in the difference over
/// the length in which the contacts' stiffness changes.
///
/// # Errors
/// As for [`simulate_with_sensitivities`]; [`MechanicsError::NotPhysical`] for a negative force.
pub fn simulate_with_friction(
    chain: &Chain,
    schedule: &Schedule,
    changes: &[Change],
    frictions_n: &[f64],
) -> Result<Sensitivities, MechanicsError> {
    solve(chain, schedule, Asked { changes, frictions_n })
}

fn solve(chain: &Chain, schedule: &Schedule, asked: Asked<'_>) -> Result<Sensitivities, MechanicsError> {
    let motion = ReferenceMotion::solve(chain, schedule)?;
    let derivatives = match asked.n() {
        0 => Vec::new(),
        _ => motion.variations(asked.changes, asked.frictions_n)?.until(motion.n_outputs() - 1)?,
    };
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
    /// Of all masses, at all steps of the variational equations.
    masses: Trajectory,
    n_between: usize,
}

impl<'a> ReferenceMotion<'a> {
    /// Integrates the chain's motion.
    ///
    /// # Errors
    /// As for [`simulate`].
    pub fn solve(chain: &'a Chain, schedule: &Schedule) -> Result<Self, MechanicsError> {
        chain.check()?;
        check::positive("output_interval_s", schedule.output_interval_s)?;
        let n_between = steps_between(chain, schedule.output_interval_s);
        let output_interval_s = schedule.output_interval_s / n_between as f64;
        let mut simulation = simulate(chain, &Schedule { output_interval_s, ..*schedule })?;
        let masses = motion_of_masses(&simulation);
        let n_outputs = masses.times_s.len().div_ceil(n_between);
        if n_between > 1 {
            thin(&mut simulation, n_between);
        }
        simulation.trajectory.times_s =
            (0..n_outputs).map(|k| k as f64 * schedule.output_interval_s).collect();
        Ok(Self { chain, model: ChainModel::new(chain), simulation, masses, n_between })
    }

    /// The motion at the outputs.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// Number of outputs.
    pub fn n_outputs(&self) -> usize {
        self.simulation.trajectory.times_s.len()
    }

    /// The variational equations of changes and, behind them, of forces of dry friction in newtons ([`simulate_with_friction`]), at t = 0.
    ///
    /// # Errors
    /// Of any of the chains that make no sense; [`MechanicsError::NotAlike`] for changes that are more than changed numbers;
    /// [`MechanicsError::NotPhysical`] for a negative force.
    pub fn variations<'b>(
        &'b self,
        changes: &'b [Change],
        frictions_n: &'b [f64],
    ) -> Result<Variations<'b>, MechanicsError> {
        changes.iter().enumerate().try_for_each(|(index, change)| change.check(index, self.chain))?;
        frictions_n.iter().try_for_each(|force_n| check::not_negative("friction_n", *force_n))?;
        let asked = Asked { changes, frictions_n };
        Ok(Variations {
            motion: self,
            tangent: Tangent::new(self.chain, &self.model, &self.masses, asked),
            n: asked.n(),
            switches: switches_of(&self.simulation).into_iter().peekable(),
            output: 0,
        })
    }
}

/// The variational equations of several changes on their way along a motion.
pub struct Variations<'a> {
    motion: &'a ReferenceMotion<'a>,
    tangent: Tangent<'a>,
    /// Derivatives that are sought.
    n: usize,
    switches: Peekable<IntoIter<(f64, End)>>,
    /// Where they stand.
    output: usize,
}

impl Variations<'_> {
    /// Goes on to an output, and gives the derivatives from the output where they stood to that one, both included.
    ///
    /// # Errors
    /// [`MechanicsError::NotFinite`] for derivatives that grow beyond all bounds.
    pub fn until(&mut self, output: usize) -> Result<Vec<Trajectory>, MechanicsError> {
        let Self { motion, tangent, switches, .. } = self;
        let (first, n_between) = (self.output, motion.n_between);
        let last = output.min(motion.n_outputs() - 1).max(first);
        let outputs_s = &motion.simulation.trajectory.times_s[first..=last];
        let mut found = vec![at_rest(motion.chain.n_bodies(), outputs_s); self.n];
        tangent.record(0, &mut found);
        for k in first * n_between..last * n_between {
            let (mut start_s, end_s) = (motion.masses.times_s[k], motion.masses.times_s[k + 1]);
            while let Some((switch_s, end)) = switches.next_if(|(switch_s, _)| *switch_s <= end_s) {
                if !tangent.sleeps_until(k + 1) {
                    tangent.step(start_s, switch_s);
                }
                tangent.switch(end, switch_s);
                start_s = switch_s;
            }
            if !tangent.sleeps_until(k + 1) {
                tangent.step(start_s, end_s);
            }
            if (k + 1).is_multiple_of(n_between) {
                tangent.record((k + 1) / n_between - first, &mut found);
            }
        }
        self.output = last;
        let is_finite = |derivative: &Trajectory| {
            derivative.displacement_m.fold(true, |all, value| all && value.is_finite())
        };
        match found.iter().all(is_finite) {
            true => Ok(found),
            false => Err(MechanicsError::NotFinite { time_s: outputs_s.last().copied().unwrap_or(0.0) }),
        }
    }
}

/// When the strikers' contacts switched, and whose, in their order.
fn switches_of(simulation: &Simulation) -> Vec<(f64, End)> {
    let near = simulation.contact_switch_times_s.iter().map(|time_s| (*time_s, End::Near));
    let far = simulation.far_contact_switch_times_s.iter().map(|time_s| (*time_s, End::Far));
    let mut switches: Vec<(f64, End)> = near.chain(far).collect();
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

/// The motion of all masses, the strikers' at the ends; those of one time lie side by side.
fn motion_of_masses(simulation: &Simulation) -> Trajectory {
    let Trajectory { times_s, displacement_m, velocity_m_per_s } = &simulation.trajectory;
    let (striker, far_striker) = (simulation.striker.as_ref(), simulation.far_striker.as_ref());
    let with = |of_striker: fn(&StrikerMotion) -> &Vec<f64>, bodies: &Array2<f64>| {
        let first = usize::from(striker.is_some());
        let behind = first + bodies.nrows();
        let n_masses = behind + usize::from(far_striker.is_some());
        let mut all = Array2::zeros((n_masses, bodies.ncols()).f());
        all.slice_axis_mut(Axis(0), Slice::from(first..behind)).assign(bodies);
        for (striker, mass) in [(striker, 0), (far_striker, behind)] {
            let Some(striker) = striker else { continue };
            all.row_mut(mass).iter_mut().zip(of_striker(striker)).for_each(|(place, value)| *place = *value);
        }
        all
    };
    Trajectory {
        times_s: times_s.clone(),
        displacement_m: with(|striker| &striker.displacement_m, displacement_m),
        velocity_m_per_s: with(|striker| &striker.velocity_m_per_s, velocity_m_per_s),
    }
}

/// Rest, the values of one time side by side as they are written and read.
fn at_rest(n_bodies: usize, times_s: &[f64]) -> Trajectory {
    let rest = Array2::zeros((n_bodies, times_s.len()).f());
    Trajectory { times_s: times_s.to_vec(), displacement_m: rest.clone(), velocity_m_per_s: rest }
}

/// Leaves every `n_between`-th output.
fn thin(simulation: &mut Simulation, n_between: usize) {
    let of_list = |values: &mut Vec<f64>| *values = values.iter().step_by(n_between).copied().collect();
    let of_rows = |rows: &mut Array2<f64>| {
        *rows = rows.slice_axis(Axis(1), Slice::new(0, None, n_between as isize)).to_owned();
    };
    of_rows(&mut simulation.trajectory.displacement_m);
    of_rows(&mut simulation.trajectory.velocity_m_per_s);
    for striker in [&mut simulation.striker, &mut simulation.far_striker].into_iter().flatten() {
        of_list(&mut striker.displacement_m);
        of_list(&mut striker.velocity_m_per_s);
    }
}
