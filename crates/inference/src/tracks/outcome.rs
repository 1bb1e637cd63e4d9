//! What a fit to the tracks found.

use chainwave_analysis::probability::chi_squared_beyond;
use chainwave_measurement::Estimate;

use super::bootstrap::OverTrials;
use super::directed::{cost_of_a_cause, hypothesis_rule};
use super::hypothesis::Hypothesis;
use super::model::TrackModel;
use super::profile::Interval;
use super::rivals::{BetweenHypotheses, FAR_BEHIND, with_variance};
use super::structure::Structure;
use super::usual_amplitudes::UsualAmplitudes;
use crate::damping::Damping;
use crate::least_squares::{JointCovariance, Own};
use crate::quantity::Quantity;

/// Damping fitted to the tracks of all recordings, and what went along.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackFit {
    /// c_d and c_s, with what the model's error may do to them.
    pub damping: Damping,
    /// The same with what noise does to them alone.
    pub by_noise: Damping,
    /// The same of the model as it is stated, whether it explains the tracks or not: for comparison. `None` where its search led nowhere.
    pub stated: Option<Damping>,
    /// 95 % intervals of c_d and c_s by profile likelihood.
    pub intervals_95: [Interval; 2],
    /// How c_d and c_s scatter over recordings drawn anew with replacement, view by view: with the differences between trials in it
    /// that the model leaves out, but known only as well as so few trials tell it; and what the model's error may do to all trials alike. `None` where a
    /// view has a single recording.
    pub bootstrap: Option<[OverTrials; 2]>,
    /// Starting points whose search ended at this minimum, and all of them.
    pub starts: (usize, usize),
    /// Factors on the quantities that are known only within an uncertainty, in their order.
    pub factors: Vec<(Quantity, Estimate)>,
    /// What the tracks ask for beyond the stated model.
    pub beyond: Vec<Hypothesis>,
    /// The quantities of that, in their order: factors on what is stated, or what is added.
    pub found: Vec<(Quantity, Estimate)>,
    /// Other hypotheses that explain as much as the last of these. What they would make of the dampings is in the uncertainties, each by its
    /// likelihood, as is what those do that are neither told nor excluded.
    pub rivals: Vec<Hypothesis>,
    /// What all of those make of the recordings' strikers and impacts.
    pub between: BetweenHypotheses,
    /// What the stated model leaves over: at its minimum, or where it has none, at that of the model with what it was given.
    pub as_stated: Structure,
    /// Probability, by chance, of what single hypotheses find at the stated model ([`hypothesis_rule`](super::hypothesis_rule)); `None` where none
    /// could be tried.
    pub p_value_as_stated: Option<f64>,
    /// What the model leaves over with what it was given beyond that.
    pub structure: Structure,
    /// The model with that.
    pub model: TrackModel,
    /// How large its usual errors are, in their order.
    pub usual_amplitudes: UsualAmplitudes,
    /// The covariance of all unknowns.
    pub(super) errors: JointCovariance,
    /// Mean striker velocity of the recordings, in metres per second.
    pub striker_velocity_m_per_s: Estimate,
    /// Mean stamp of the impact, in seconds after the trigger.
    pub impact_time_s: Estimate,
    /// Each recording's own striker and impact, in the order given.
    pub recordings: Vec<FittedRecording>,
    /// Sum of squared residuals, priors included.
    pub chi_squared: f64,
    /// Sum of squared residuals over their number less the unknowns; near 1 when model and stated errors explain the tracks.
    pub reduced_chi_squared: f64,
    /// Positions compared.
    pub n_residuals: usize,
    /// Chain simulations carried out.
    pub n_simulations: u64,
}

impl TrackFit {
    /// What it found of a recording, with what noise alone leaves open.
    pub fn recording_by_noise(&self, recording: usize) -> FittedRecording {
        let mut by_noise = self.recordings[recording].clone();
        let more = self.between.of_recording(recording, self.striker_velocity_m_per_s.value);
        let estimates = by_noise.estimates_mut().into_iter().zip(more);
        estimates.for_each(|(found, more)| found.sigma = (found.sigma.powi(2) - more).max(0.0).sqrt());
        by_noise
    }

    /// Whether the model, with what it was given beyond the stated one, leaves nothing but noise.
    pub fn leaves_noise_alone(&self) -> bool {
        self.structure.is_noise_alone()
    }

    /// Whether it explains the tracks by something else as well as another fit does, or nearly: that is less than a thousand times likelier.
    pub(super) fn rivals(&self, other: &Self) -> bool {
        let is_other = self.beyond.iter().any(|one| !other.beyond.contains(one));
        is_other
            && self.leaves_noise_alone()
            && self.chi_squared - other.chi_squared < FAR_BEHIND * other.reduced_chi_squared.max(1.0)
    }

    /// Whether what it has beyond another fit lowers chi squared by more than chance does; of numbers that have a prior each counts in full.
    pub(super) fn tells_more_than(&self, other: &Self) -> bool {
        let n_free = |fit: &Self| fit.model.priors.len() + fit.found.len();
        let more = n_free(self).saturating_sub(n_free(other)).max(1) as f64;
        let fall = (other.chi_squared - self.chi_squared) / self.reduced_chi_squared.max(1.0);
        let p_value = Hypothesis::ALL.len() as f64 * chi_squared_beyond(fall, more);
        hypothesis_rule().rejects(p_value)
    }

    /// A fit whose uncertainties of recordings are noise's alone, with what hypotheses that might as well hold make of them.
    pub(super) fn among(mut self, between: BetweenHypotheses) -> Self {
        let with = |found: &mut Estimate, more: f64| *found = with_variance(*found, more);
        let mean_m_per_s = self.striker_velocity_m_per_s.value;
        for (r, one) in self.recordings.iter_mut().enumerate() {
            let more = between.of_recording(r, mean_m_per_s);
            one.estimates_mut().into_iter().zip(more).for_each(|(found, more)| with(found, more));
        }
        let of_mean = [&mut self.striker_velocity_m_per_s, &mut self.impact_time_s];
        of_mean.into_iter().zip(between.of_mean()).for_each(|(found, more)| with(found, more));
        Self { between: self.between.and(between), ..self }
    }

    /// Striker and impact of each recording.
    pub(super) fn own(&self) -> Vec<Own> {
        let own =
            |one: &FittedRecording| Own::new(one.striker_velocity_m_per_s.value, one.impact_time_s.value);
        self.recordings.iter().map(own).collect()
    }

    /// Minus twice the logarithm of its likelihood over all that its causes and its usual errors might have been beforehand (Laplace's approximation), but
    /// for what all fits to the same tracks have alike; the residuals have the variance `unit`.
    fn cost(&self, unit: f64) -> f64 {
        let of_cause = |cause: &Hypothesis| cost_of_a_cause(cause.quantities().len());
        let of_causes: f64 = self.beyond.iter().map(of_cause).sum();
        self.chi_squared / unit + of_causes + self.usual_amplitudes.narrowing()
    }

    /// With what another fit says that might as well hold: how far its dampings and its recordings' strikers and impacts are off joins the uncertainties
    /// by its odds.
    pub(super) fn beside(self, other: &Self) -> Self {
        let unit = self.reduced_chi_squared.max(1.0);
        let behind = other.cost(unit) - self.cost(unit);
        let weight = (1.0 + (0.5 * behind.max(0.0)).exp()).recip();
        let values = |fit: &Self| {
            let Damping { chain_damping_kg_per_s: c_d, striker_damping_kg_per_s: c_s, .. } = fit.damping;
            [c_d.value, c_s.value]
        };
        let ([c_d, c_s], [other_c_d, other_c_s]) = (values(&self), values(other));
        let more = [weight * (other_c_d - c_d).powi(2), weight * (other_c_s - c_s).powi(2)];
        let damping = self.damping.widened(more);
        let bootstrap = self.bootstrap.map(|found| std::array::from_fn(|i| found[i].widened(more[i])));
        let [of_c_d, of_c_s] = damping.sigmas_over(&self.damping);
        let [in_c_d, in_c_s] = self.intervals_95;
        let intervals_95 = [in_c_d.widened(c_d, of_c_d), in_c_s.widened(c_s, of_c_s)];
        let mut rivals = self.rivals.clone();
        rivals.extend(other.beyond.iter().filter(|one| !self.beyond.contains(one)));
        // A fit without usual errors takes them for zero.
        let usual = other.usual_amplitudes.less(&self.usual_amplitudes);
        let between = BetweenHypotheses::of_recordings([self.own(), other.own()], &usual, weight);
        Self { damping, bootstrap, intervals_95, rivals, ..self }.among(between)
    }

    /// Whether its dampings may be believed: the model leaves nothing but noise, or what it leaves over cannot make c_d by itself (c_d is told
    /// from zero by more than 1.96 of a sigma that contains what that may do).
    pub fn is_believed(&self) -> bool {
        let c_d = self.damping.chain_damping_kg_per_s;
        self.leaves_noise_alone() || c_d.value > Estimate::COVERAGE_95 * c_d.sigma
    }

    /// What the reader should know of the model: what was believed beyond the stated one, and what structure is left.
    pub fn warnings(&self) -> Vec<String> {
        let mut said = Vec::new();
        let chi_squared = self.reduced_chi_squared;
        let lost = ["c_d", "c_s"].into_iter().zip(&self.intervals_95).filter(|(_, found)| !found.is_profile);
        let lost: Vec<&str> = lost.map(|(name, _)| name).collect();
        if !lost.is_empty() {
            said.push(format!(
                "chi squared could not be followed to the ends of the 95 % interval of {}: they lie 1.96 standard uncertainties away, as if it \
                 were a parabola",
                lost.join(" and ")
            ));
        }
        let rivals: Vec<&str> = self.rivals.iter().map(|one| one.in_words()).collect();
        let rivals = rivals.join(", or ");
        if self.beyond.is_empty() && !rivals.is_empty() {
            said.push(format!(
                "before a square camera the chain model as stated does not explain the tracks. A usual lens or turn of the camera does; it might as well \
                 be as if {rivals}. c_d and c_s contain what the choice may do to them"
            ));
        }
        if !self.beyond.is_empty() {
            let causes: Vec<&str> = self.beyond.iter().map(|one| one.in_words()).collect();
            let found: Vec<String> = self
                .found
                .iter()
                .map(|(quantity, found)| {
                    format!("{} {:.4e} +- {:.1e}", quantity.name(), found.value, found.sigma)
                })
                .collect();
            let directed = match self.as_stated.is_told() {
                true => String::new(),
                false => self.p_value_as_stated.map_or(String::new(), |p_value| {
                    format!("; a test for single causes tells it, p = {p_value:.1e}")
                }),
            };
            let others = match rivals.is_empty() {
                true => String::new(),
                false => format!("; it might as well be as if {rivals}"),
            };
            said.push(format!(
                "the chain model as stated does not explain the tracks ({}{directed}). They move as if {}{} (reduced chi squared {chi_squared:.3} with \
                 it){others}. The dampings stated and motion_by_model have it; x_n(t), strains and peak energies are those of the stated scale and contacts, \
                 and the sigmas of these energies contain by how much such contacts change them. c_d and c_s contain what the choice may do to them",
                self.as_stated.in_words(),
                causes.join(", and "),
                if found.is_empty() { String::new() } else { format!(": {}", found.join(", ")) },
            ));
        }
        if !self.leaves_noise_alone() {
            said.push(format!(
                "the chain model does not explain all of the tracks: reduced chi squared {chi_squared:.3}, {}; {}. The sigmas of c_d and c_s \
                 contain how they differ between parts of the chain and of the time",
                self.structure.in_words(),
                match self.beyond.is_empty() {
                    true => "nothing that was tried beyond the stated model takes half of that away, or nine tenths with a number for each body",
                    false => "this is what is left with what it was given beyond the stated one",
                }
            ));
        }
        said
    }
}

/// What the fit found of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedRecording {
    /// Name of the recording.
    pub recording: String,
    /// Velocity of its striker, in metres per second.
    pub striker_velocity_m_per_s: Estimate,
    /// Stamp of its impact, in seconds after its trigger.
    pub impact_time_s: Estimate,
    /// Velocity of its striker over the mean of all recordings, less one.
    pub drive_deviation: Estimate,
    /// Its trigger's lead over the mean trigger, in seconds: the stamp of its impact less the mean of all.
    pub trigger_offset_s: Estimate,
    /// Residuals' rms over what the tracker's sigma lets expect.
    pub scatter_ratio: f64,
}

impl FittedRecording {
    /// What the fit found of it, in the order in which it stands here.
    pub(super) fn estimates_mut(&mut self) -> [&mut Estimate; 4] {
        [
            &mut self.striker_velocity_m_per_s,
            &mut self.impact_time_s,
            &mut self.drive_deviation,
            &mut self.trigger_offset_s,
        ]
    }
}
