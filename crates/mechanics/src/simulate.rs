use chainwave_measurement::Trajectory;

use crate::{
    Chain, Drive, MechanicsError, check,
    ledger::Ledger,
    model::{Model, State},
    recorder::Recorder,
    rk4::Rk4,
    step_size::{Pace, stiffest_n_per_m},
    switch::cut_at_switch,
};

/// When a simulation ends, when it reports, and its time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Schedule {
    /// Length of the simulation in seconds. Outputs lie at all multiples of the interval up to it; the last is its end.
    pub duration_s: f64,
    /// Time between outputs, in seconds.
    pub output_interval_s: f64,
    /// Largest time step in seconds; the step used is the next smaller one that divides the output interval. `None`: such
    /// that the fastest oscillation, at the stiffness that the gaps reach, turns by about 0.02 rad in a step.
    pub dt_s: Option<f64>,
}

/// What the chain did.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// Motion of bodies 1 to N at the output times.
    pub trajectory: Trajectory,
    /// Motion of the striker at the output times, where there is one.
    pub striker: Option<StrikerMotion>,
    /// Largest change, over the outputs, of kinetic and potential energy plus what the dampers took (less what an imposed
    /// motion put in), relative to the initial energy (for an imposed motion: to the largest energy held).
    pub energy_drift: f64,
    /// Peak potential energy of each gap between bodies in joules, over all steps and between them.
    pub psi_max_j: Vec<f64>,
    /// Number of steps, those that end at a switch included.
    pub steps: u64,
    /// Time step in seconds.
    pub dt_s: f64,
    /// Name of the integrator.
    pub method: &'static str,
    /// Times a gap between bodies was pulled beyond [`crate::PowerLaw::TENSION_LIMIT`].
    pub tension_events: u64,
    /// Times the striker's contact opened or closed after t = 0.
    pub contact_switches: u32,
    /// Contact forces evaluated.
    pub force_evaluations: u64,
}

/// Motion of the striker at the output times.
#[derive(Debug, Clone, PartialEq)]
pub struct StrikerMotion {
    /// Displacement since it touched, in metres.
    pub displacement_m: Vec<f64>,
    /// Velocity in metres per second.
    pub velocity_m_per_s: Vec<f64>,
}

/// Steps times bodies beyond which a simulation is refused (a quarter of an hour of computing).
const MAX_BODY_STEPS: f64 = 2e10;
/// Stored displacements beyond which a simulation is refused (4 GB with the velocities).
const MAX_SAMPLES: f64 = 2.5e8;
/// Switches of the striker's contact within one step beyond which the run is given up.
const MAX_SWITCHES_PER_STEP: u32 = 1000;
/// Automatic steps tried; the last must be stable.
const MAX_TRIALS: u32 = 8;

/// Integrates the chain's motion from t = 0 by the classical Runge-Kutta method.
///
/// The striker's switches are located within a step and end it, so the error falls with the fourth power of the step
/// with a striker too.
///
/// # Errors
/// [`MechanicsError::NotPhysical`], [`MechanicsError::Length`] or [`MechanicsError::ImposedTooShort`] for input without
/// meaning; [`MechanicsError::StepTooLarge`] for a given step beyond the stability bound, at rest or at the stiffness
/// reached; [`MechanicsError::TooLarge`], [`MechanicsError::NotFinite`] and [`MechanicsError::Chatter`] as they say.
pub fn simulate(chain: &Chain, schedule: &Schedule) -> Result<Simulation, MechanicsError> {
    chain.check()?;
    let n_outputs = schedule.check(chain)?;
    let pace = Pace::new(chain);
    match schedule.dt_s {
        Some(dt_s) => with_given_step(chain, schedule, n_outputs, pace, dt_s),
        None => with_automatic_step(chain, schedule, n_outputs, pace),
    }
}

fn with_given_step(
    chain: &Chain,
    schedule: &Schedule,
    n_outputs: usize,
    pace: Pace,
    dt_s: f64,
) -> Result<Simulation, MechanicsError> {
    pace.check_stable(dt_s, chain.contact.k_0_n_per_m())?;
    let run = Run::complete(chain, schedule, n_outputs, dt_s)?;
    pace.check_stable(run.dt_s, run.stiffest_n_per_m(chain))?;
    Ok(run.finish())
}

/// Starts from the stiffness at rest, and repeats with a smaller step when the gaps turn out much stiffer.
fn with_automatic_step(
    chain: &Chain,
    schedule: &Schedule,
    n_outputs: usize,
    pace: Pace,
) -> Result<Simulation, MechanicsError> {
    let mut dt_s = pace.automatic_s(chain.contact.k_0_n_per_m());
    for _ in 1..MAX_TRIALS {
        dt_s = match Run::complete(chain, schedule, n_outputs, dt_s) {
            Ok(run) => {
                let stiffness_n_per_m = run.stiffest_n_per_m(chain);
                if pace.accepts(run.dt_s, stiffness_n_per_m) {
                    return Ok(run.finish());
                }
                // A run that went astray says too much of the stiffness, so the step shrinks by a bounded factor.
                pace.automatic_s(stiffness_n_per_m).clamp(run.dt_s / 8.0, run.dt_s / 2.0)
            }
            Err(MechanicsError::NotFinite { .. }) => dt_s.min(schedule.output_interval_s) / 8.0,
            Err(error) => return Err(error),
        }
    }
    with_given_step(chain, schedule, n_outputs, pace, dt_s)
}

impl Schedule {
    /// Checks the schedule for a chain, and counts the outputs.
    fn check(&self, chain: &Chain) -> Result<usize, MechanicsError> {
        check::positive("duration_s", self.duration_s)?;
        check::positive("output_interval_s", self.output_interval_s)?;
        if let Some(dt_s) = self.dt_s {
            check::positive("dt_s", dt_s)?;
        }
        // A duration that was meant as a multiple of the interval may lie a rounding below it.
        let n_intervals = (self.duration_s / self.output_interval_s * (1.0 + 1e-9)).floor();
        check::require(n_intervals >= 1.0, "duration_s", "at least one output_interval_s", self.duration_s)?;
        let n_samples = (n_intervals + 1.0) * chain.n_bodies() as f64;
        let hint = "a longer output_interval_s needs fewer";
        check_limit("outputs times bodies", MAX_SAMPLES, n_samples, hint)?;
        if let Drive::Imposed(motion) = &chain.drive {
            motion.check_covers(n_intervals * self.output_interval_s)?;
        }
        Ok(n_intervals as usize + 1)
    }
}

fn check_limit(
    quantity: &'static str,
    limit: f64,
    found: f64,
    hint: &'static str,
) -> Result<(), MechanicsError> {
    if found <= limit { Ok(()) } else { Err(MechanicsError::TooLarge { quantity, limit, found, hint }) }
}

/// One integration, and what it collects.
struct Run {
    rk4: Rk4,
    ledger: Ledger,
    recorder: Recorder,
    dt_s: f64,
    steps: u64,
    contact_switches: u32,
    /// Length of the last step, or of the part of it since a switch.
    elapsed_s: f64,
}

impl Run {
    /// Integrates to the last output with the largest step up to `dt_max_s` that divides the output interval.
    fn complete(
        chain: &Chain,
        schedule: &Schedule,
        n_outputs: usize,
        dt_max_s: f64,
    ) -> Result<Self, MechanicsError> {
        let n_steps = (schedule.output_interval_s / dt_max_s).ceil().max(1.0);
        let hint = "very strong damping or very stiff contacts need very small steps";
        let body_steps = n_steps * n_outputs as f64 * chain.n_bodies() as f64;
        check_limit("time steps times bodies", MAX_BODY_STEPS, body_steps, hint)?;
        let model = Model::new(chain);
        let mut state = model.initial_state(chain);
        let mut ahead = state.clone();
        let times_s: Vec<f64> = (0..n_outputs).map(|k| k as f64 * schedule.output_interval_s).collect();
        let mut run = Self {
            rk4: Rk4::new(&state),
            ledger: Ledger::new(&model),
            recorder: Recorder::new(chain.n_bodies(), times_s.clone(), model.has_striker()),
            dt_s: schedule.output_interval_s / n_steps,
            steps: 0,
            contact_switches: 0,
            elapsed_s: 0.0,
        };
        for (k, time_s) in times_s.into_iter().enumerate() {
            run.begin(&model, &state);
            run.output(&model, k, time_s, &state)?;
            if k + 1 == n_outputs {
                break;
            }
            for i in 0..n_steps as u64 {
                if i > 0 {
                    run.begin(&model, &state);
                }
                run.step(&model, time_s + i as f64 * run.dt_s, &mut state, &mut ahead)?;
            }
        }
        Ok(run)
    }

    /// Evaluates and books the state that a step starts from.
    fn begin(&mut self, model: &Model, state: &State) {
        self.rk4.begin(model, state);
        self.ledger.book_gaps(model, &self.rk4, state, self.elapsed_s);
    }

    fn output(&mut self, model: &Model, k: usize, time_s: f64, state: &State) -> Result<(), MechanicsError> {
        let held_j = self.ledger.book_total(model, &self.rk4, state);
        if !held_j.is_finite() {
            return Err(MechanicsError::NotFinite { time_s });
        }
        self.recorder.record(k, state);
        Ok(())
    }

    /// One step from `state`, which was begun, in as many parts as the striker's contact switches; `ahead` is work space.
    fn step(
        &mut self,
        model: &Model,
        time_s: f64,
        state: &mut State,
        ahead: &mut State,
    ) -> Result<(), MechanicsError> {
        let mut done_s = 0.0;
        for _ in 0..MAX_SWITCHES_PER_STEP {
            let (from_s, h) = (time_s + done_s, self.dt_s - done_s);
            self.rk4.advance(model, state, from_s, h, ahead);
            let cut =
                model.has_striker().then(|| cut_at_switch(&mut self.rk4, model, state, from_s, h, ahead));
            std::mem::swap(state, ahead);
            self.steps += 1;
            self.elapsed_s = h;
            let Some(part_s) = cut.flatten() else { return Ok(()) };
            self.elapsed_s = part_s;
            self.contact_switches += 1;
            model.switch_contact(state);
            done_s += part_s;
            if done_s >= self.dt_s {
                return Ok(());
            }
            self.begin(model, state);
        }
        Err(MechanicsError::Chatter { time_s, switches: MAX_SWITCHES_PER_STEP })
    }

    /// Stiffness of the stiffest gap that the run has met.
    fn stiffest_n_per_m(&self, chain: &Chain) -> f64 {
        stiffest_n_per_m(&chain.contact, self.ledger.overlap_range_m)
    }

    fn finish(self) -> Simulation {
        let energy_drift = self.ledger.energy_drift();
        let (trajectory, striker) = self.recorder.finish();
        Simulation {
            trajectory,
            striker,
            energy_drift,
            psi_max_j: self.ledger.psi_max_j,
            steps: self.steps,
            dt_s: self.dt_s,
            method: Rk4::NAME,
            tension_events: self.ledger.tension_events,
            contact_switches: self.contact_switches,
            force_evaluations: self.rk4.force_evaluations,
        }
    }
}
