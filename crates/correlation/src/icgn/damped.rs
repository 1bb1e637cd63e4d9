//! The damped match (Levenberg and Marquardt), for what plain Gauss-Newton does not settle.

use chainwave_measurement::Lost;

use crate::icgn::outcome::Stop;
use crate::icgn::sums::Evaluation;
use crate::prepared::linearised::Linearised;
use crate::prepared::normal::inverse_of;
use crate::warp::{MAX_PARAMETERS, Step, Warp};
use crate::{Window, Workspace};

/// Damping of the first step, and the factor by which it falls or grows (D. W. Marquardt, J. Soc. Ind. Appl. Math. 11
/// (1963) 431-441).
const FIRST_DAMPING: f64 = 0.1;
const FACTOR: f64 = 10.0;
/// Damping at which steps are a millionth of the plain ones: nothing better is near.
const LARGEST_DAMPING: f64 = 1e6;

impl Linearised {
    /// The best place that steps of Levenberg and Marquardt reach from a start, each of which must raise the correlation:
    /// where plain steps overshoot, from afar or in the weak directions of a noisy texture, these do not.
    pub(crate) fn climb(
        &self,
        window: &Window,
        start: Warp,
        workspace: &mut Workspace,
    ) -> Result<Warp, Stop> {
        let (mut warp, mut damping) = (start, FIRST_DAMPING);
        let mut here = self.look(window, &warp, workspace)?;
        for _ in 0..2 * self.settings.max_iterations {
            let Some(step) = self.damped_step(&here, damping) else { break };
            if step.at_edge_px(self.half_px()) <= self.settings.convergence_px {
                break;
            }
            let next = warp.compose_inverse(&step);
            let there = next.and_then(|next| Some((next, self.look(window, &next, workspace).ok()?)));
            match there {
                Some((next, better)) if better.zncc > here.zncc => {
                    (warp, here) = (next, better);
                    damping /= FACTOR;
                }
                _ if damping > LARGEST_DAMPING => break,
                _ => damping *= FACTOR,
            }
        }
        Ok(warp)
    }

    fn look(&self, window: &Window, warp: &Warp, workspace: &mut Workspace) -> Result<Evaluation, Stop> {
        if !self.fits(window, warp) {
            return Err(Stop::Escaped(*warp));
        }
        self.evaluate(window, warp, workspace).ok_or(Stop::Lost(Lost::LowCorrelation))
    }

    /// The step by the Hessian whose diagonal is enlarged.
    fn damped_step(&self, found: &Evaluation, damping: f64) -> Option<Step> {
        let mut enlarged = self.hessian;
        (0..MAX_PARAMETERS).for_each(|i| enlarged[i][i] *= 1.0 + damping);
        let inverse = inverse_of(self.settings.shape, &enlarged)?;
        let parameters = inverse.map(|row| {
            row.iter().zip(&found.slopes).map(|(inverse, slope)| inverse * slope).sum::<f64>() / found.gain
        });
        Some(Step::new(self.settings.shape, &parameters))
    }
}
