//! The phases of merging as types: recordings are aligned, then their gauge is fixed, then the ends are trimmed; no other order
//! can be written.

use chainwave_measurement::Observation;
use nalgebra::{DMatrix, DVector};
use ndarray::Array2;

use crate::assembly::Assembled;
use crate::convergence::Convergence;
use crate::error::StitchingError;
use crate::fitted::Fitted;
use crate::fitted_body::FittedBody;
use crate::gauge::{Exchange, OnsetTells, closed_directions};
use crate::modes::AlignmentErrors;
use crate::normal_equations::{NormalEquations, Prior, Solved};
use crate::settings::Settings;
use crate::state::{AlignmentState, Scale};
use crate::stitched::{AlignmentPhase, Stitched, Unsettled};

/// Rounds after which the alignment stops in any case; 4 are usual.
const MAX_ROUNDS: usize = 50;
/// Rounds after which an alignment counts as settled too where its step is short against its own uncertainty, as where a
/// direction is hardly told from noise: it wanders within what it states. How far it may still have to go stands among the errors.
const LONG_ROUNDS: usize = 20;
/// How short, in standard uncertainties.
const SHORT: f64 = 0.2;
/// A step is shortened to this, in the same measure as [`SETTLED`]: the readings bend, and one that goes farther is led by noise.
const LONGEST_STEP: f64 = 2.0;
/// A step is the last one where it changes drives and offsets by less than this, in drives' priors and frames.
const SETTLED: f64 = 1e-5;
/// Rounds in which the open directions move too.
const FREE_ROUNDS: usize = 2;
/// Rounds in which the onset fixes the gauge, at most: where the first body's noise is a third of a per cent of its onset, each leaves
/// a third of what was left before. An alignment that follows it need not settle as far as one that leads.
const GAUGE_ROUNDS: usize = 50;

/// A step that was made.
struct AlignmentStep {
    /// The largest change, in drives' priors and frames.
    change: f64,
    /// An upper bound of its length, in standard uncertainties.
    length: f64,
    covariance: DMatrix<f64>,
}

/// Drives and offsets as the readings have them; what these leave open is as the priors put it.
pub(crate) struct Aligned<'a> {
    state: AlignmentState<'a>,
    covariance: DMatrix<f64>,
    rounds: usize,
    unsettled: Option<Unsettled>,
    /// How far drives and offsets may still have to go.
    left: Option<DVector<f64>>,
}

/// Drives and offsets with what the readings leave open fixed, or left to the priors by choice.
pub(crate) struct Gauged<'a> {
    state: AlignmentState<'a>,
    errors: AlignmentErrors,
    rounds: usize,
    unsettled: Option<Unsettled>,
    warnings: Vec<String>,
}

/// Gauged, on the times at which something was measured.
pub(crate) struct Trimmed<'a> {
    gauged: Gauged<'a>,
}

impl<'a> Aligned<'a> {
    /// Aligns recordings by the bodies that they share.
    pub(crate) fn of(
        observations: &'a [Observation],
        settings: &'a Settings,
        frame_interval_s: f64,
    ) -> Result<Self, StitchingError> {
        let mut state = AlignmentState::new(observations, settings, frame_interval_s)?;
        let mut rounds = 0;
        let mut course = Convergence::from(&state.drive, &state.offsets_s);
        let mut before = None;
        loop {
            rounds += 1;
            let fitted = state.responses()?;
            // The first rounds, from S = X, bring drives and offsets to their natural scale; later ones leave the open directions
            // alone, along which only priors would pull, slowly and far.
            state.scale = if rounds > FREE_ROUNDS { Scale::Held } else { Scale::Open };
            let AlignmentStep { change, length, covariance } = match (state.align(&fitted), before.take()) {
                (Ok(step), _) => step,
                (Err(_), Some(covariance)) => {
                    let (unsettled, left) = state.left(&course, AlignmentPhase::Readings);
                    return Ok(Self {
                        state,
                        covariance,
                        rounds,
                        unsettled: Some(unsettled),
                        left: Some(left),
                    });
                }
                (Err(failure), None) => return Err(failure),
            };
            course.goes_to(&state.drive, &state.offsets_s);
            before = Some(covariance.clone());
            let is_settled = change < SETTLED || (rounds > LONG_ROUNDS && length < SHORT);
            if is_settled || rounds == MAX_ROUNDS {
                let (unsettled, left) = state.left(&course, AlignmentPhase::Readings);
                return Ok(Self {
                    state,
                    covariance,
                    rounds,
                    unsettled: (!is_settled).then_some(unsettled),
                    left: (change >= SETTLED).then_some(left),
                });
            }
        }
    }

    /// Leaves open what the readings leave open: how well recordings agree does not depend on it.
    pub(crate) fn ungauged(self) -> Gauged<'a> {
        let exchange = Exchange::none(self.state.observations.len());
        let errors = AlignmentErrors { covariance: self.covariance, exchange, left: self.left };
        let (rounds, unsettled) = (self.rounds, self.unsettled);
        Gauged { state: self.state, errors, rounds, unsettled, warnings: Vec::new() }
    }

    /// Fixes what the readings leave open by the first body's onset, and aligns again from where that led to: the curvatures' prior
    /// holds there. Where this does not settle, the errors hold how far it may still have to go.
    pub(crate) fn gauged(mut self) -> Result<Gauged<'a>, StitchingError> {
        let state = &mut self.state;
        let (mut scatter, mut contradiction) = (state.settings.drive_scatter, None);
        let (mut last, mut is_short, mut is_untold) = (None, false, false);
        let mut course = Convergence::from(&state.drive, &state.offsets_s);
        let ungauged = (state.drive.clone(), state.offsets_s.clone(), state.scale);
        for round in 1..=GAUGE_ROUNDS {
            let gauge = match state.gauge(scatter)? {
                OnsetTells::Of(gauge) => gauge,
                // The exchange before stands, as unsettled as it was; where there is none, what is open is left to the priors.
                OnsetTells::Nothing => break,
                // Nor does any before.
                OnsetTells::NothingButNoise => {
                    (last, is_untold) = (None, true);
                    break;
                }
            };
            let before = (state.drive.clone(), state.offsets_s.clone(), state.scale);
            gauge.fix(&mut state.drive, &mut state.offsets_s);
            state.scale = Scale::True;
            if gauge.is_settled() && is_short {
                if let Some(stated) = scatter {
                    contradiction = state.contradiction_of_scatter(stated)?;
                }
                if scatter.is_some() && contradiction.is_some() {
                    // From the beginning, by the onset alone.
                    (state.drive, state.offsets_s, state.scale) = ungauged.clone();
                    course = Convergence::from(&state.drive, &state.offsets_s);
                    (scatter, is_short) = (None, false);
                    continue;
                }
                last = Some(gauge);
                self.unsettled = None;
                self.left = self.left.filter(|_| round > LONG_ROUNDS);
                break;
            }
            let step = state.align(&state.responses()?);
            course.goes_to(&state.drive, &state.offsets_s);
            let (unsettled, left) = state.left(&course, AlignmentPhase::Onset);
            (self.unsettled, self.left) = (Some(unsettled), Some(left));
            let Ok(step) = step else {
                // An exchange from which no alignment leads on is none: all stays where the covariance belongs to.
                (state.drive, state.offsets_s, state.scale) = before;
                break;
            };
            last = Some(gauge);
            is_short = step.change < 10.0 * SETTLED || (round > LONG_ROUNDS && step.length < SHORT);
            self.covariance = step.covariance;
        }
        let exchange = match last {
            Some(gauge) => gauge.errors(&state.drive, &self.covariance),
            None if is_untold => {
                let prior_s = state.settings.trigger_prior_s(state.frame_interval_s);
                Exchange::untold(&state.drive, prior_s)
            }
            None => Exchange::none(state.observations.len()),
        };
        let errors = AlignmentErrors { covariance: self.covariance, exchange, left: self.left };
        let warnings = contradiction.into_iter().collect();
        Ok(Gauged { state: self.state, errors, rounds: self.rounds, unsettled: self.unsettled, warnings })
    }
}

impl<'a> Gauged<'a> {
    /// Drops the times at both ends at which no body was measured.
    pub(crate) fn trimmed(mut self) -> Result<Trimmed<'a>, StitchingError> {
        let state = &mut self.state;
        let fitted = state.responses()?;
        let measured = |i: &usize| fitted.iter().any(|of_body| !of_body.at(*i).contributions.is_empty());
        let first = (0..state.times_s.len()).find(measured).unwrap_or(0);
        let last = (0..state.times_s.len()).rfind(measured).unwrap_or(0);
        state.times_s = state.times_s[first..=last].to_vec();
        Ok(Trimmed { gauged: self })
    }
}

impl Trimmed<'_> {
    /// The merged motion, with what one unit of mean drive and of mean trigger (seconds) changes of it, in metres.
    pub(crate) fn stitched(self) -> Result<(Stitched, [Array2<f64>; 2]), StitchingError> {
        let Gauged { state, errors, rounds, unsettled, warnings } = self.gauged;
        let Assembled { motion, alignments, spread, of_means_m, shown, clocks, left_by_views } =
            state.assembled(&errors)?;
        let said = unsettled.map(|unsettled| unsettled.to_string());
        let warnings = said.into_iter().chain(warnings).collect();
        let drive_scale_sigma = errors.exchange.scale_sigma;
        let stitched = Stitched {
            motion,
            alignments,
            drive_scale_sigma,
            spread,
            rounds,
            unsettled,
            by_trigger: false,
            shown,
            clocks,
            untied: Vec::new(),
            left_by_views,
            warnings,
        };
        Ok((stitched, of_means_m))
    }
}

impl AlignmentState<'_> {
    /// What an alignment that is given up still changed, and how far it may still have to go.
    fn left(&self, course: &Convergence, phase: AlignmentPhase) -> (Unsettled, DVector<f64>) {
        (course.unsettled(phase), course.left(self.frame_interval_s, self.settings.drive_prior))
    }

    /// The joint least squares for all drives and offsets.
    pub(crate) fn solved(&self, field: &Fitted) -> Result<Solved, StitchingError> {
        let n = self.observations.len();
        let mut equations = NormalEquations::new(n);
        for at in field.iter().flat_map(FittedBody::times).filter(|at| at.contributions.len() > 1) {
            equations.add(at, &self.drive);
        }
        let prior = Prior {
            offset_s: self.settings.trigger_prior_s(self.frame_interval_s),
            drive: self.settings.drive_prior,
        };
        equations
            .solve(&self.drive, &self.offsets_s, prior)
            .ok_or(StitchingError::Singular { n_recordings: n })
    }

    /// One step by it.
    fn align(&mut self, field: &Fitted) -> Result<AlignmentStep, StitchingError> {
        let n = self.observations.len();
        let solved = self.solved(field)?;
        let closed = match self.scale {
            Scale::Open => None,
            Scale::Held => closed_directions(&self.drive, &solved.covariance, 2),
            Scale::True => closed_directions(&self.drive, &solved.covariance, 1),
        };
        let solution = closed.map_or(solved.solution.clone(), |closed| closed * &solved.solution);
        if solution.iter().any(|entry| !entry.is_finite()) {
            return Err(StitchingError::Singular { n_recordings: n });
        }
        let of_recording = |r: usize| {
            let drive = solution[r].abs() / self.settings.drive_prior;
            drive.max(solution[n + r].abs() / self.frame_interval_s)
        };
        let change = (0..n).map(of_recording).fold(0.0, f64::max);
        let share = (LONGEST_STEP / change).min(1.0);
        for r in 0..n {
            self.drive[r] += share * solution[r];
            self.offsets_s[r] += share * solution[n + r];
        }
        Ok(AlignmentStep { change, length: solved.length(&solution), covariance: solved.covariance })
    }
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::{BodyTrack, ErrorSource, Estimate};

    use super::*;

    /// Three trials of one body on a parabola.
    fn trials() -> Vec<Observation> {
        let position = |t: f64| Some(Estimate::new(3.0 * t.max(0.0).powi(2), 1e-6));
        let trial = |trial: u32| {
            let times_s: Vec<f64> = (-20..60).map(|frame| f64::from(frame) * 1e-3).collect();
            let body = BodyTrack { body: 1, position_m: times_s.iter().map(|t| position(*t)).collect() };
            Observation { recording: format!("trial {trial}"), view: 1, trial, times_s, bodies: vec![body] }
        };
        (1..4).map(trial).collect()
    }

    #[test]
    fn an_alignment_that_did_not_settle_says_so_and_keeps_no_small_sigma() {
        let (observations, settings) = (trials(), Settings::new(1, 2e-3));
        let aligned = || Aligned::of(&observations, &settings, 1e-3).unwrap();
        let (settled, _) = aligned().ungauged().trimmed().unwrap().stitched().unwrap();
        assert!(settled.unsettled.is_none() && settled.warnings.is_empty());

        let mut unsettled = aligned();
        let mut course = Convergence::from(&[0.0; 3], &[0.0; 3]);
        course.goes_to(&[0.0; 3], &[1e-3, 1e-3, 1e-3]);
        unsettled.unsettled = Some(course.unsettled(AlignmentPhase::Readings));
        unsettled.left = Some(course.left(1e-3, 0.05));
        let (unsettled, _) = unsettled.ungauged().trimmed().unwrap().stitched().unwrap();
        assert_eq!(unsettled.unsettled.map(|one| one.offset_change_s), Some(1e-3));
        assert!(unsettled.warnings[0].contains("not settled after 1 round:"), "{:?}", unsettled.warnings);
        let k = unsettled.motion.modes.sources().position(|one| *one == ErrorSource::Unsettled).unwrap();
        let mode_m = unsettled.motion.modes.displacement_m(k, unsettled.motion.displacement_m.dim());
        // All triggers may be a frame off for as many rounds again, while the body moves with a velocity of 6 t.
        let (i, time_s) = (60, unsettled.motion.times_s[60]);
        let before = settled.motion.displacement_m[(0, i)].unwrap().sigma;
        let after = unsettled.motion.displacement_m[(0, i)].unwrap().sigma;
        assert!(mode_m[(0, i)].abs() > 0.9 * 6.0 * time_s * 1e-3, "{}", mode_m[(0, i)]);
        assert!((after - before.hypot(mode_m[(0, i)])).abs() < 1e-9 * after);
    }
}
