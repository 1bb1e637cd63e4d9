use super::FitError;
use super::arrow::own_steps;
use super::track_problem::{Linearised, N_DAMPINGS, Problem, State};

const MAX_ROUNDS: usize = 60;
const FIRST_DAMPING: f64 = 1e-3;
/// A step shorter than a hundredth of a standard error changes nothing.
const CONVERGED_LENGTH2: f64 = 1e-4;

/// Where a search ended.
pub(super) struct Minimum {
    pub(super) state: State,
    pub(super) at: Linearised,
}

/// Gauss-Newton steps with Marquardt's damping from a state; `held` is an unknown that stays at its value.
pub(super) fn search(
    problem: &Problem<'_>,
    start: State,
    held: Option<usize>,
    n_simulations: &mut u64,
) -> Result<Minimum, FitError> {
    let mut state = start;
    let mut damping = FIRST_DAMPING;
    let mut here = problem.linearise(&state, n_simulations)?;
    for _ in 0..MAX_ROUNDS {
        let recordings = here.eliminated(damping).ok_or_else(undetermined)?;
        let mut equations = here.equations(&recordings, |_| 1.0, damping);
        if let Some(unknown) = held {
            equations.hold(unknown);
        }
        let mut shared = equations.step().ok_or_else(undetermined)?;
        // A damping at zero that would fall further stays there, and the others find their place without it.
        if let Some(unknown) = (0..N_DAMPINGS).find(|i| state.shared[*i] <= 0.0 && shared[*i] < 0.0) {
            equations.hold(unknown);
            shared = equations.step().ok_or_else(undetermined)?;
        }
        let own = own_steps(&recordings, &shared);
        let own_length2: f64 =
            recordings.iter().zip(&own).map(|(recording, step)| recording.own_length2(step)).sum();
        let length2 = equations.length2(&shared) + own_length2;
        let trial = problem.stepped(&state, &shared, &own);
        let there = problem.linearise(&trial, n_simulations)?;
        if there.chi_squared > here.chi_squared * (1.0 + 1e-12) {
            damping = (10.0 * damping).max(FIRST_DAMPING);
            continue;
        }
        (state, here) = (trial, there);
        damping = if damping > 1e-9 { 0.1 * damping } else { 0.0 };
        if length2 < CONVERGED_LENGTH2 {
            return Ok(Minimum { state, at: here });
        }
    }
    Err(FitError::NotConverged(format!("{MAX_ROUNDS} rounds did not settle")))
}

pub(super) fn undetermined() -> FitError {
    FitError::NotConverged("the tracks do not determine the damping and every recording's striker".into())
}
