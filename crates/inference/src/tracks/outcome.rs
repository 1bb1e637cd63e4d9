//! What a fit to the tracks found.

use chainwave_analysis::Rule;
use chainwave_measurement::Estimate;

use super::bootstrap::OverTrials;
use super::profile::Interval;
use crate::damping::Damping;
use crate::quantity::Quantity;

/// Damping fitted to the tracks of all recordings, and what went along.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackFit {
    /// c_d and c_s.
    pub damping: Damping,
    /// 95 % intervals of c_d and c_s by profile likelihood.
    pub intervals_95: [Interval; 2],
    /// How c_d and c_s scatter over recordings drawn anew with replacement, view by view: with the differences between trials in it
    /// that the model leaves out, but known only as well as so few trials tell it. `None` where a view has a single recording.
    pub bootstrap: Option<[OverTrials; 2]>,
    /// Starting points whose search ended at this minimum, and all of them.
    pub starts: (usize, usize),
    /// Factors on the quantities that are known only within an uncertainty, in their order.
    pub factors: Vec<(Quantity, Estimate)>,
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
    /// Reduced chi squared up to which the chain model explains the tracks.
    pub const LARGEST_REDUCED_CHI_SQUARED: f64 = 1.2;

    /// Whether the chain model explains the tracks well enough for their damping to be believed ([`damping_source_rule`]).
    pub fn explains_the_tracks(&self) -> bool {
        self.reduced_chi_squared <= Self::LARGEST_REDUCED_CHI_SQUARED
    }
}

/// The rule by which the damping is taken from the tracks or from the peak energies.
pub fn damping_source_rule() -> Rule {
    Rule {
        question: "what the damping is taken from",
        text: format!(
            "the tracks while the model explains them (reduced chi squared up to {}), else the peak energies, which feel less of what the \
             model leaves out",
            TrackFit::LARGEST_REDUCED_CHI_SQUARED
        ),
        level: None,
        rates: Vec::new(),
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
