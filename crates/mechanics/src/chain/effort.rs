//! How many steps a motion may take that chooses them itself: as its chain's own oscillation asks for at the accuracy, so that every machine
//! refuses the same motions.

use crate::check;
use crate::error::MechanicsError;
use crate::integrator::method::Method;

/// Trials of a step times bodies beyond which a motion is refused: some ten seconds of computing.
const MAX_BODY_TRIALS: f64 = 1e9;
/// The same of an implicit method, whose steps take some twenty times as long.
const MAX_IMPLICIT_BODY_TRIALS: f64 = 5e7;
/// Trials over what a smooth oscillation takes ([`Asked::most_trials`]). With jumps, kinks and fast dashpots it was up to 1.4 times as many.
const MARGIN: f64 = 8.0;
/// Trials that any motion may take.
const FREE_TRIALS: f64 = 20_000.0;
/// Trials that an output may cost where steps end there.
const TRIALS_AN_OUTPUT: f64 = 10.0;

/// What makes steps so small.
const HINT: &str = "masses, stiffnesses, dampings and times in SI units? light bodies and stiff contacts oscillate fast, which \
                               takes as many steps";

/// What an adaptive motion is asked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked {
    pub(super) method: Method,
    /// Relative error that the steps may add up to.
    pub(super) tolerance: f64,
    pub(super) duration_s: f64,
    pub(super) n_outputs: usize,
    pub(super) n_masses: usize,
}

/// The steps that were tried on the way of a motion.
#[derive(Debug)]
pub(super) struct Effort {
    asked: Asked,
    n_trials: u64,
    /// Trials at which it is looked what the motion needs.
    limit: u64,
}

impl Effort {
    /// None so far.
    ///
    /// # Errors
    /// [`MechanicsError::TooLarge`] where no stable steps follow the fastest oscillation at rest within the limit.
    pub(super) fn new(asked: Asked, omega_rad_per_s: f64) -> Result<Self, MechanicsError> {
        let least = omega_rad_per_s * asked.duration_s / asked.method.stable_oscillation();
        check::limit(
            "time steps times bodies",
            asked.most_body_trials(),
            least * asked.n_masses as f64,
            HINT,
        )?;
        Ok(Self { asked, n_trials: 0, limit: asked.most_trials(omega_rad_per_s) })
    }

    /// Counts a step that is about to be tried.
    ///
    /// # Errors
    /// [`MechanicsError::TooManySteps`] where there are too many, even for the fastest oscillation with the gaps as stiff as they became.
    pub(super) fn count(
        &mut self,
        time_s: f64,
        omega_reached: impl FnOnce() -> f64,
    ) -> Result<(), MechanicsError> {
        self.n_trials += 1;
        if self.n_trials <= self.limit {
            return Ok(());
        }
        let omega_rad_per_s = omega_reached();
        self.limit = self.limit.max(self.asked.most_trials(omega_rad_per_s));
        if self.n_trials <= self.limit {
            return Ok(());
        }
        let Self { asked: Asked { method, duration_s, .. }, limit, .. } = *self;
        Err(MechanicsError::TooManySteps {
            method: method.name(),
            limit,
            time_s,
            duration_s,
            omega_rad_per_s,
        })
    }
}

impl Asked {
    /// Trials of a step after which a motion is given up whose fastest oscillation is this.
    ///
    /// A step of h errs by (omega h)^(q + 1) or less, q being the order of the estimate, and may err by its part of the tolerance: over a phase
    /// of omega T, that takes (omega T) (omega T / tolerance)^(1 / q) steps.
    fn most_trials(&self, omega_rad_per_s: f64) -> u64 {
        let phase_rad = omega_rad_per_s * self.duration_s;
        let order = f64::from(self.method.error_order()) - 1.0;
        let smooth = phase_rad * (phase_rad / self.tolerance).powf(order.recip());
        let stops = if self.method.is_dense() { 0.0 } else { TRIALS_AN_OUTPUT * self.n_outputs as f64 };
        (FREE_TRIALS + stops + MARGIN * smooth).min(self.most_body_trials() / self.n_masses as f64) as u64
    }

    fn most_body_trials(&self) -> f64 {
        if self.method == Method::Esdirk4 { MAX_IMPLICIT_BODY_TRIALS } else { MAX_BODY_TRIALS }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASKED: Asked =
        Asked { method: Method::Dop853, tolerance: 1e-7, duration_s: 0.02, n_outputs: 200, n_masses: 6 };

    /// Trials until a motion is given up that takes them without end, and why.
    fn trials(asked: Asked, omega_rad_per_s: f64, omega_reached: f64) -> (u64, MechanicsError) {
        let mut effort = Effort::new(asked, omega_rad_per_s).unwrap();
        let mut n_trials = 0;
        loop {
            match effort.count(0.01, || omega_reached) {
                Ok(()) => n_trials += 1,
                Err(why) => return (n_trials, why),
            }
        }
    }

    #[test]
    fn steps_are_counted_against_what_the_chains_oscillation_asks_for() {
        // 73 radians, of which each takes 73^(1/7) 1e7^(1/7) = 18.5 steps at most.
        let (n_trials, why) = trials(ASKED, 3641.0, 3641.0);
        assert!((n_trials as f64 / (20_000.0 + 8.0 * 72.8 * 18.5) - 1.0).abs() < 0.01, "{n_trials}");
        let why = why.to_string();
        assert!(
            why.contains("expected at most") && why.contains("beyond t = 1.000e-2 s") && why.contains("hint"),
            "{why}"
        );
        // Gaps that became stiffer allow more, a coarser accuracy fewer, and outputs that end a step some each.
        assert!(trials(ASKED, 3641.0, 36_410.0).0 > 4 * n_trials);
        assert!(trials(Asked { tolerance: 1e-3, ..ASKED }, 3641.0, 3641.0).0 < n_trials);
        let implicit = Asked { method: Method::Esdirk4, ..ASKED };
        let [few, many] =
            [200, 1200].map(|n_outputs| trials(Asked { n_outputs, ..implicit }, 3641.0, 3641.0).0);
        assert_eq!(many - few, 10_000);
    }
}
