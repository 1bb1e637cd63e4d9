//! The march of one integration: steps and their control, switches, outputs.

use super::{
    effort::{Asked, Effort},
    front::Front,
    ledger::Ledger,
    record::Record,
    recorded_steps::RecordedSteps,
    recorder::Recorder,
    schedule::Bodies,
    simulation::Simulation,
    step_size::Pace,
    switch::cut_at_switch,
};
use crate::equations::{
    model::ChainModel,
    parameters::Chain,
    row::{MassRow, RowEnd},
    state::{ChainState, Reach},
};
use crate::{
    check,
    error::MechanicsError,
    integrator::{
        method::Method,
        rung::Rung,
        step::{LocalError, TimeStep},
    },
};

/// Steps times bodies beyond which a simulation is refused (minutes of computing).
const MAX_BODY_STEPS: f64 = 2e11;
/// Switches of strikers' contacts without a whole step in between beyond which a run is given up.
const MAX_SWITCHES: u32 = 1000;
/// Outputs at which the energy is booked.
const ENERGY_BOOKINGS: usize = 512;
/// Bodies ahead of the front move by less than this part of the accuracy.
const NEGLIGIBLE: f64 = 1e-6;
/// The same for constant steps, whose accuracy is not known beforehand.
const NEGLIGIBLE_AT_CONSTANT_STEPS: f64 = 1e-16;

/// What a run is asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunRequest {
    pub(crate) method: Method,
    pub(crate) pacing: Pacing,
    pub(crate) bodies: Bodies,
    pub(crate) output_interval_s: f64,
    pub(crate) n_outputs: usize,
    /// Of so many outputs one is kept, the first one and each that comes so many behind it.
    pub(crate) keep_every: usize,
    /// Whether the states of all masses at all outputs are held beside those that are kept.
    pub(crate) holds_steps: bool,
}

/// How a run finds its steps.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Pacing {
    /// The largest step up to this one that divides the output interval.
    Constant { dt_s: f64 },
    /// Steps whose estimated errors add up to this accuracy over the run when they grow by the factor `room` on their way.
    Adaptive { accuracy: f64, room: f64 },
}

/// One integration, and what it collects: in `R`, as it is asked for, the motion at its outputs.
pub(crate) struct Run<'a, R> {
    chain: &'a Chain,
    model: ChainModel<'a>,
    order: RunRequest,
    rung: Rung,
    front: Front,
    pub(crate) record: R,
    pub(crate) ledger: Ledger,
    control: Control,
    steps: u64,
    /// Of the strikers in front and at the far end.
    contact_switch_times_s: [Vec<f64>; 2],
    force_evaluations: u64,
}

/// Where a run stands.
pub(crate) struct RunState {
    state: ChainState,
    /// Room for the state behind a step, and for those within it.
    ahead: ChainState,
    between: ChainState,
    time_s: f64,
    next_output: usize,
    /// Whether nothing switched where the last step ended.
    continued: bool,
    switches_in_a_row: u32,
}

impl<'a> Run<'a, Recorder> {
    /// Integrates to the last output.
    pub(crate) fn complete(
        chain: &'a Chain,
        pace: &Pace<'_>,
        order: RunRequest,
    ) -> Result<Self, MechanicsError> {
        let kept = (0..order.n_outputs).step_by(order.keep_every);
        let times_s: Vec<f64> = kept.map(|k| k as f64 * order.output_interval_s).collect();
        let row = MassRow::of(chain);
        let steps = order.holds_steps.then(|| RecordedSteps::new(&row, order.n_outputs));
        let recorder = Recorder::new(&row, chain.n_bodies(), (times_s, order.keep_every), steps);
        let (mut run, mut at) = Self::begin(chain, pace, order, recorder)?;
        run.go_on(&mut at, order.n_outputs - 1)?;
        if let Some((gap, end_m)) = pace.fallen_off(&run.ledger) {
            return Err(MechanicsError::BeyondTable { gap, end_m });
        }
        run.record.write();
        Ok(run)
    }

    pub(crate) fn finish(self, choice: String) -> Simulation {
        let error_estimate = self.error_estimate();
        let duration_s = self.time_of(self.order.n_outputs - 1);
        let dt_s = match self.order.pacing {
            Pacing::Constant { .. } => self.control.h_s,
            Pacing::Adaptive { .. } => duration_s / self.steps as f64,
        };
        let (trajectory, [striker, far_striker]) = self.record.finish();
        let [contact_switch_times_s, far_contact_switch_times_s] = self.contact_switch_times_s;
        Simulation {
            trajectory,
            striker,
            far_striker,
            energy_drift: self.ledger.energy_drift(),
            psi_max_j: self.ledger.psi_max_j(&self.model),
            peak_times_s: self.ledger.peak_times_s(&self.model),
            steps: self.steps,
            dt_s,
            method: self.order.method.name(),
            choice,
            error_estimate,
            tension_events: self.ledger.tension_events,
            contact_switch_times_s,
            far_contact_switch_times_s,
            force_evaluations: self.force_evaluations,
        }
    }
}

impl<'a, R: Record> Run<'a, R> {
    /// At t = 0, with the output there recorded.
    pub(crate) fn begin(
        chain: &'a Chain,
        pace: &Pace<'_>,
        order: RunRequest,
        record: R,
    ) -> Result<(Self, RunState), MechanicsError> {
        let model = ChainModel::new(chain);
        if order.method.is_symplectic() && model.has_neighbours_coupled() {
            let what = "dashpots between neighbours";
            return Err(MechanicsError::NotFor { method: order.method.name(), what });
        }
        let mut state = model.initial_state(chain);
        let control = Control::new(&order, pace, &model, &state)?;
        let negligible = match order.pacing {
            Pacing::Constant { .. } => NEGLIGIBLE_AT_CONSTANT_STEPS,
            Pacing::Adaptive { accuracy, .. } => NEGLIGIBLE * accuracy,
        };
        let front = Front::new((order.bodies == Bodies::Reached).then_some(negligible), model.n_masses());
        front.begin(&mut state);
        let mut run = Self {
            rung: Rung::new(order.method, &model),
            front,
            record,
            ledger: Ledger::new(&model, &state),
            control,
            steps: 0,
            contact_switch_times_s: [Vec::new(), Vec::new()],
            force_evaluations: 0,
            chain,
            model,
            order,
        };
        run.output(0, &state)?;
        let at = RunState {
            ahead: state.clone(),
            between: state.clone(),
            state,
            time_s: 0.0,
            next_output: 1,
            continued: false,
            switches_in_a_row: 0,
        };
        Ok((run, at))
    }

    /// Steps on until an output is recorded, and any other ones within the last step.
    pub(crate) fn go_on(&mut self, at: &mut RunState, output: usize) -> Result<(), MechanicsError> {
        while at.next_output <= output.min(self.order.n_outputs - 1) {
            self.begin_step(&at.state, at.continued);
            let time_s = at.time_s;
            let target_s = self.control.target_s(time_s, at.next_output, &self.order);
            let (h_s, cut) = self.step(time_s, target_s, &at.state, &mut at.ahead)?;
            let reached = cut.is_none() && time_s + h_s * (1.0 + 1e-5) >= target_s;
            let end_s = if reached { target_s } else { time_s + h_s };
            let reach = self.ledger.book_gaps(&self.model, &at.state, &at.ahead, TimeStep { time_s, h_s });
            self.control.reach(self.model.reach_of_bodies(&at.ahead, reach));
            while at.next_output < self.order.n_outputs && self.time_of(at.next_output) <= end_s {
                if !self.is_asked(at.next_output) {
                    at.next_output += 1;
                    continue;
                }
                let output_s = self.time_of(at.next_output);
                // Methods that cannot interpolate stop at every output, be it that a switch ended the step there.
                if (reached && output_s >= target_s) || !self.control.passes_outputs {
                    self.output(at.next_output, &at.ahead)?;
                } else {
                    let step = TimeStep { time_s, h_s };
                    let fraction = (output_s - time_s) / h_s;
                    let ends = [&at.state, &at.ahead];
                    self.rung.interpolate(&self.model, ends, step, fraction, &mut at.between);
                    self.output(at.next_output, &at.between)?;
                }
                at.next_output += 1;
            }
            std::mem::swap(&mut at.state, &mut at.ahead);
            at.time_s = end_s;
            at.continued = cut.is_none();
            at.switches_in_a_row = if at.continued { 0 } else { at.switches_in_a_row + 1 };
            if let Some(end) = cut {
                self.switch(&mut at.state, end, at.time_s, at.switches_in_a_row)?;
            }
            self.front.advance(&mut at.state, self.control.x_m, self.control.v_m_per_s);
        }
        Ok(())
    }

    fn time_of(&self, output: usize) -> f64 {
        output as f64 * self.order.output_interval_s
    }

    /// Whether anything is made of an output.
    fn is_asked(&self, k: usize) -> bool {
        self.record.takes(k) || self.is_booked(k)
    }

    /// Whether the energy is booked at an output.
    fn is_booked(&self, k: usize) -> bool {
        let last = self.order.n_outputs - 1;
        k.is_multiple_of(last.div_ceil(ENERGY_BOOKINGS)) || k == last
    }

    fn begin_step(&mut self, state: &ChainState, continued: bool) {
        let before = self.rung.evaluations();
        self.rung.begin(&self.model, state, continued);
        self.force_evaluations += (self.rung.evaluations() - before) * state.active as u64;
    }

    /// One step towards `target_s`, shortened until its error is small enough, and again to the first switch of a
    /// striker's contact; returns its length, and whose switch ended it.
    fn step(
        &mut self,
        time_s: f64,
        target_s: f64,
        state: &ChainState,
        ahead: &mut ChainState,
    ) -> Result<(f64, Option<RowEnd>), MechanicsError> {
        let before = self.rung.evaluations();
        let mut h_s = self.control.step_s(target_s - time_s);
        loop {
            if let Some(effort) = &mut self.control.effort {
                effort.count(time_s, || Pace::new(self.chain).omega_reached(&self.ledger))?;
            }
            self.rung.advance(&self.model, state, TimeStep { time_s, h_s }, ahead);
            let Some(shorter_s) = self.control.judge(self.rung.local_error(), h_s) else { break };
            if shorter_s < self.control.least_s {
                if self.model.gap_jumps(state, ahead) {
                    // The state ahead is that of the step which was tried.
                    self.control.pass(self.rung.local_error());
                    break;
                }
                return Err(self.control.out_of_reach(&self.order, time_s, shorter_s));
            }
            h_s = shorter_s;
        }
        let cut = cut_at_switch(&mut self.rung, &self.model, state, TimeStep { time_s, h_s }, ahead);
        self.steps += 1;
        self.force_evaluations += (self.rung.evaluations() - before) * state.active as u64;
        Ok(cut.map_or((h_s, None), |(part_s, end)| (part_s, Some(end))))
    }

    fn switch(
        &mut self,
        state: &mut ChainState,
        end: RowEnd,
        time_s: f64,
        in_a_row: u32,
    ) -> Result<(), MechanicsError> {
        self.contact_switch_times_s[end.index()].push(time_s);
        self.model.switch_contact(state, end);
        if in_a_row > MAX_SWITCHES {
            return Err(MechanicsError::Chatter { time_s, switches: in_a_row });
        }
        Ok(())
    }

    fn output(&mut self, k: usize, state: &ChainState) -> Result<(), MechanicsError> {
        self.record.record(k, state);
        if self.is_booked(k) {
            let held_j = self.ledger.book_total(&self.model, state);
            if !held_j.is_finite() {
                return Err(MechanicsError::NotFinite { time_s: self.time_of(k) });
            }
        }
        Ok(())
    }

    /// Estimated error of the displacements over the largest displacement, where the method has estimates: what its steps add
    /// up to, with the room that they have to grow.
    pub(crate) fn error_estimate(&self) -> Option<f64> {
        match self.order.pacing {
            Pacing::Constant { .. } => None,
            Pacing::Adaptive { room, .. } => Some(room * self.control.error_over_motion()),
        }
    }

    /// What it was asked for.
    pub(crate) fn order(&self) -> RunRequest {
        self.order
    }

    /// The constant step, in seconds.
    pub(crate) fn dt_s(&self) -> f64 {
        self.control.h_s
    }
}

/// Chooses the steps and adds up their errors.
#[derive(Debug)]
struct Control {
    adaptive: Option<Tolerance>,
    /// Whether steps may pass outputs, which are then interpolated.
    passes_outputs: bool,
    /// The constant step, or the next one.
    h_s: f64,
    /// Steps between two outputs, where they are constant.
    n_between: f64,
    least_s: f64,
    /// Largest displacement and velocity so far; at first those of the fastest oscillation.
    x_m: f64,
    v_m_per_s: f64,
    /// Largest displacement that bodies did reach so far.
    reached_m: f64,
    /// Sum of the steps' relative errors.
    error: f64,
    /// Of steps that are chosen on the way.
    effort: Option<Effort>,
}

/// What adaptive steps are held to.
#[derive(Debug, Clone, Copy)]
struct Tolerance {
    /// Relative error for each second of the run.
    per_second: f64,
    /// Relative error that any step may make: short transients and corners need not be followed to the end.
    least: f64,
    /// Order of the error of a step, less one.
    order: f64,
    omega_rad_per_s: f64,
}

/// Share of the whole tolerance that any one step may take.
const LEAST_SHARE: f64 = 1e-4;
/// Part of the longest permissible step that the next one takes.
const SAFETY: f64 = 0.9;
/// Bounds of the next step over the last.
const CHANGE: [f64; 2] = [0.2, 3.0];
/// First step of an adaptive method, in radians of the fastest oscillation.
const FIRST_STEP_RAD: f64 = 0.05;
/// Shortest step of an adaptive method, in radians of the fastest oscillation at rest.
const LEAST_STEP_RAD: f64 = 1e-9;

impl Control {
    fn new(
        order: &RunRequest,
        pace: &Pace<'_>,
        model: &ChainModel<'_>,
        state: &ChainState,
    ) -> Result<Self, MechanicsError> {
        let omega_rad_per_s = pace.omega_at_rest();
        let Reach { x_m, v_m_per_s } = model.first_reach(state);
        let duration_s = order.output_interval_s * (order.n_outputs - 1) as f64;
        let scale_s = if omega_rad_per_s > 0.0 { omega_rad_per_s.recip() } else { duration_s };
        let mut control = Self {
            adaptive: None,
            passes_outputs: false,
            h_s: 0.0,
            n_between: 1.0,
            least_s: 0.0,
            x_m: x_m.max(v_m_per_s * scale_s),
            v_m_per_s: v_m_per_s.max(x_m / scale_s),
            reached_m: x_m,
            error: 0.0,
            effort: None,
        };
        match order.pacing {
            Pacing::Constant { dt_s } => {
                // A step that divides the interval but for rounding is taken as it is.
                control.n_between = (order.output_interval_s / dt_s * (1.0 - 1e-12)).ceil().max(1.0);
                control.h_s = order.output_interval_s / control.n_between;
                let n_steps = control.n_between * order.n_outputs as f64;
                let hint = "very strong damping or very stiff contacts need very small steps";
                let body_steps = n_steps * state.x_m.len() as f64;
                check::limit("time steps times bodies", MAX_BODY_STEPS, body_steps, hint)?;
            }
            Pacing::Adaptive { accuracy, room } => {
                let tolerance = accuracy / room;
                let (method, n_outputs, n_masses) = (order.method, order.n_outputs, model.n_masses());
                let asked = Asked { method, tolerance, duration_s, n_outputs, n_masses };
                control.effort = Some(Effort::new(asked, omega_rad_per_s)?);
                control.adaptive = Some(Tolerance {
                    per_second: tolerance / duration_s,
                    least: LEAST_SHARE * tolerance,
                    order: f64::from(order.method.error_order()) - 1.0,
                    omega_rad_per_s: scale_s.recip(),
                });
                control.passes_outputs = order.method.is_dense();
                control.h_s = (FIRST_STEP_RAD * scale_s).min(duration_s);
                control.least_s = LEAST_STEP_RAD * scale_s.min(duration_s);
            }
        }
        Ok(control)
    }

    /// Where the steps must stop next.
    fn target_s(&self, time_s: f64, next_output: usize, order: &RunRequest) -> f64 {
        let interval_s = order.output_interval_s;
        if self.adaptive.is_none() {
            let start_s = (next_output - 1) as f64 * interval_s;
            let done = ((time_s - start_s) / self.h_s * (1.0 + 1e-9)).floor() + 1.0;
            return if done >= self.n_between {
                next_output as f64 * interval_s
            } else {
                start_s + done * self.h_s
            };
        }
        let output = if self.passes_outputs { order.n_outputs - 1 } else { next_output };
        output as f64 * interval_s
    }

    /// Length of the next step, `left_s` before it must stop.
    fn step_s(&self, left_s: f64) -> f64 {
        match self.adaptive {
            // A rounding of the time must not make a new step length.
            None if (left_s - self.h_s).abs() < 1e-6 * self.h_s => self.h_s,
            None => left_s,
            // Two equal steps rather than a whole one and a tiny one.
            Some(_) if self.h_s < left_s && left_s < 2.0 * self.h_s => 0.5 * left_s,
            Some(_) => left_s.min(self.h_s),
        }
    }

    /// Accepts a step and sets the next one, or says how much shorter it must be.
    fn judge(&mut self, error: Option<LocalError>, h_s: f64) -> Option<f64> {
        let (Some(tolerance), Some(error)) = (self.adaptive, error) else { return None };
        let relative = self.relative(error, tolerance);
        let ratio = relative / (tolerance.per_second * h_s).max(tolerance.least);
        let change = SAFETY * ratio.max(1e-30).powf(-1.0 / tolerance.order);
        if ratio > 1.0 || !ratio.is_finite() {
            let [least, _] = CHANGE;
            return Some(h_s * if change.is_finite() { change.clamp(least, SAFETY) } else { least });
        }
        self.error += relative;
        // A step that was cut short by a stop says nothing against a longer one.
        self.h_s =
            (h_s * change.clamp(CHANGE[0], CHANGE[1])).max(if h_s < self.h_s { self.h_s } else { 0.0 });
        None
    }

    /// Takes in the error of a step that is as short as it may be and passes a jump of the forces.
    fn pass(&mut self, error: Option<LocalError>) {
        if let (Some(tolerance), Some(error)) = (self.adaptive, error) {
            self.error += self.relative(error, tolerance);
        }
        self.h_s = self.least_s;
    }

    /// A step's error over the largest displacement. Errors of the velocity count as displacements within a radian of the fastest
    /// oscillation; what has not moved has no error.
    fn relative(&self, error: LocalError, tolerance: Tolerance) -> f64 {
        let of_size = |error: f64, size: f64| if error == 0.0 { 0.0 } else { error / size };
        of_size(error.x_m, self.x_m).max(of_size(error.v_m_per_s, tolerance.omega_rad_per_s * self.x_m))
    }

    /// Takes in a state's reach.
    fn reach(&mut self, of_state: Reach) {
        self.x_m = self.x_m.max(of_state.x_m);
        self.reached_m = self.reached_m.max(of_state.x_m);
        self.v_m_per_s = self.v_m_per_s.max(of_state.v_m_per_s);
    }

    /// Sum of the steps' errors over the largest displacement that bodies reached, which may stay below the scale that the steps were
    /// held to.
    fn error_over_motion(&self) -> f64 {
        if self.reached_m > 0.0 { self.error * (self.x_m / self.reached_m).max(1.0) } else { self.error }
    }

    fn out_of_reach(&self, order: &RunRequest, time_s: f64, h_s: f64) -> MechanicsError {
        let Pacing::Adaptive { accuracy, .. } = order.pacing else {
            return MechanicsError::NotFinite { time_s };
        };
        MechanicsError::OutOfReach { method: order.method.name(), accuracy, time_s, h_s }
    }
}
