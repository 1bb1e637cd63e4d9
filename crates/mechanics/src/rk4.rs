use crate::model::{Model, Rates, State};

/// The classical Runge-Kutta method of fourth order, with its work space.
///
/// A step has two halves: [`Rk4::begin`] evaluates the rates at its start (and the gaps' energies on the way), then
/// [`Rk4::advance`] goes on by any length from there. So a step can be tried with several lengths, to find a switch,
/// for three stages each.
#[derive(Debug)]
pub(crate) struct Rk4 {
    /// Rates at the start of the step.
    pub(crate) start: Rates,
    /// Potential energy of each gap of the row at the start of the step.
    pub(crate) energy_j: Vec<f64>,
    /// Contact forces evaluated so far.
    pub(crate) force_evaluations: u64,
    stage: State,
    rates: Rates,
}

impl Rk4 {
    /// Name of the method in results.
    pub(crate) const NAME: &'static str = "rk4";
    /// Evaluations of the rates in one step.
    const STAGES: u64 = 4;
    /// |lambda| dt up to which an undamped oscillation does not grow, 2 sqrt(2).
    pub(crate) const STABLE_UNDAMPED: f64 = 2.828;
    /// |lambda| dt up to which no decaying mode, oscillating or not, grows: the radius of the largest half disc inside
    /// the region of stability.
    pub(crate) const STABLE_DAMPED: f64 = 2.61;

    pub(crate) fn new(state: &State) -> Self {
        let n = state.x_m.len();
        Self {
            start: Rates::new(n),
            energy_j: vec![0.0; n + 1],
            force_evaluations: 0,
            stage: state.clone(),
            rates: Rates::new(n),
        }
    }

    /// Evaluates rates and energies where the step starts.
    pub(crate) fn begin(&mut self, model: &Model, from: &State) {
        model.rates_and_energy(from, &mut self.start, &mut self.energy_j);
        self.force_evaluations += model.forces_per_evaluation();
    }

    /// The state `h` after `from`, which is at `time_s` and was given to [`Rk4::begin`], into `to`.
    pub(crate) fn advance(&mut self, model: &Model, from: &State, time_s: f64, h: f64, to: &mut State) {
        let Self { start, stage, rates, .. } = self;
        stage.touching = from.touching;
        to.touching = from.touching;
        to.copy_values(from);
        to.add(&from.v_m_per_s, start, h / 6.0);
        stage.copy_values(from);
        stage.add(&from.v_m_per_s, start, h / 2.0);
        for (weight, next) in [(h / 3.0, h / 2.0), (h / 3.0, h)] {
            // The stage stands at the middle of the step, both times; the next one lies `next` after the start.
            model.impose(time_s + h / 2.0, &mut stage.x_m, &mut stage.v_m_per_s);
            model.rates(stage, rates);
            to.add(&stage.v_m_per_s, rates, weight);
            stage.restart(from, rates, next);
        }
        model.impose(time_s + h, &mut stage.x_m, &mut stage.v_m_per_s);
        model.rates(stage, rates);
        to.add(&stage.v_m_per_s, rates, h / 6.0);
        model.impose(time_s + h, &mut to.x_m, &mut to.v_m_per_s);
        self.force_evaluations += (Self::STAGES - 1) * model.forces_per_evaluation();
    }
}

impl State {
    /// Takes positions, velocities and losses from another state.
    fn copy_values(&mut self, from: &Self) {
        self.x_m.copy_from_slice(&from.x_m);
        self.v_m_per_s.copy_from_slice(&from.v_m_per_s);
        self.lost_j = from.lost_j;
    }

    /// Adds velocities and rates times `h`.
    fn add(&mut self, velocity: &[f64], rates: &Rates, h: f64) {
        let slopes = velocity.iter().zip(&rates.acceleration_m_per_s2);
        for ((x, v), (slope, acceleration)) in self.x_m.iter_mut().zip(&mut self.v_m_per_s).zip(slopes) {
            *x += h * slope;
            *v += h * acceleration;
        }
        self.lost_j += h * rates.lost_w;
    }

    /// Replaces this stage by the one `h` after `from`, along this stage's own velocities and rates.
    fn restart(&mut self, from: &Self, rates: &Rates, h: f64) {
        let origin = from.x_m.iter().zip(&from.v_m_per_s);
        let own = self.x_m.iter_mut().zip(&mut self.v_m_per_s);
        for (((x, v), (x_0, v_0)), acceleration) in own.zip(origin).zip(&rates.acceleration_m_per_s2) {
            *x = x_0 + h * *v;
            *v = v_0 + h * acceleration;
        }
    }
}
