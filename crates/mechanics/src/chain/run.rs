//! The march of one integration: steps and their control, switches, outputs.

use super::control::Control;
use super::opening::Openings;
use super::recorded_steps::RecordedSteps;
use super::run_request::{Pacing, RunRequest};
use super::{
    front::Front, ledger::Ledger, record::Record, recorder::Recorder, schedule::Bodies,
    simulation::Simulation, step_size::Pace, switch::cut_at_switch,
};
use crate::equations::{
    model::ChainModel,
    parameters::Chain,
    row::{MassRow, RowEnd},
    state::ChainState,
};
use crate::{
    error::MechanicsError,
    integrator::{rung::Rung, step::TimeStep},
};

/// Switches of strikers' contacts without a whole step in between beyond which a run is given up.
const MAX_SWITCHES: u32 = 1000;
/// Times that a step is cut at a contact that opens or closes: with each the course between its ends is better known.
const MAX_CUTS: u32 = 4;
/// Outputs at which the energy is booked.
const ENERGY_BOOKINGS: usize = 512;
/// Bodies ahead of the front move by less than this part of the accuracy.
const NEGLIGIBLE: f64 = 1e-6;
/// The same for constant steps, whose accuracy is not known beforehand.
const NEGLIGIBLE_AT_CONSTANT_STEPS: f64 = 1e-16;

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
    /// Contacts at whose opening and closing steps end; none where their lengths are not free.
    openings: Openings,
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
        let is_adaptive = matches!(order.pacing, Pacing::Adaptive { .. });
        let openings = if is_adaptive { Openings::of(chain, &model) } else { Openings::default() };
        let front = Front::new((order.bodies == Bodies::Reached).then_some(negligible), model.n_masses());
        front.begin(&mut state);
        let mut run = Self {
            rung: Rung::new(order.method, &model),
            front,
            record,
            ledger: Ledger::new(&model, &state),
            control,
            openings,
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
            if self.control.permits(self.rung.local_error(), h_s) {
                h_s = self.end_at_opening(TimeStep { time_s, h_s }, state, ahead);
            }
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

    /// Ends a step where a contact between bodies opens or closes within it; returns its length.
    fn end_at_opening(&mut self, step: TimeStep, state: &ChainState, ahead: &mut ChainState) -> f64 {
        let mut h_s = step.h_s;
        for _ in 0..MAX_CUTS {
            let tried = TimeStep { h_s, ..step };
            let least_m = self.control.least_error_m();
            let Some(part) = self.openings.first_within(&self.model, [state, ahead], tried, least_m) else {
                break;
            };
            if part * h_s < self.control.least_s {
                break;
            }
            h_s *= part;
            self.rung.advance(&self.model, state, TimeStep { h_s, ..step }, ahead);
        }
        h_s
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
