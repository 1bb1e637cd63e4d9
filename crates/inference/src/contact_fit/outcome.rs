//! What a fit of the contact law states.

use chainwave_measurement::Estimate;
use chainwave_mechanics::PowerLaw;

/// Parameters of the law, in the order of [`ContactFit::estimates`] and [`ContactFit::correlation`].
pub const PARAMETERS: [&str; 5] = ["a", "delta_0_m", "p", "f_0_n", "k_0_n_per_m"];

/// Where overlap and force are zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Zero {
    /// [`Zero::Contact`] where readings before contact are seen (at least five, whose slope is below a tenth of the slope of as many
    /// that follow, by four standard uncertainties); else [`Zero::LoadCell`] where residuals are independent and that offset is three
    /// standard uncertainties from zero, two thousandths of the largest force counted among them; else [`Zero::Stated`].
    #[default]
    Auto,
    /// Contact begins at overlap 0 with force 0, as the curve states.
    Stated,
    /// Contact begins at overlap 0; the load cell shows a constant too much or too little, which is fitted along.
    LoadCell,
    /// The load cell's offset is the force before contact, and the overlap at which contact begins is fitted along.
    Contact,
}

/// A fitted contact law.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactFit {
    /// The law for the chain model.
    pub law: PowerLaw,
    /// a in N/m^p, delta_0 in metres, p, f_0 = a delta_0^p in newtons and k_0 in newtons per metre, as [`PARAMETERS`] names them.
    /// A 95 % interval is the value +- [`ContactFit::factor_95`] sigma.
    pub estimates: [Estimate; 5],
    /// Correlation of their errors. Three of the five are independent.
    pub correlation: [[f64; 5]; 5],
    /// Half width of a 95 % interval over the standard uncertainty.
    pub factor_95: f64,
    /// Range of p, and the laws along it.
    pub profile: Profile,
    /// Size and structure of the residuals.
    pub residual: Residual,
    /// Where zero was found to be; never [`Zero::Auto`].
    pub zero: Zero,
    /// What the load cell shows without a force, in newtons, as fitted along; taken out unless `zero` is [`Zero::Stated`]. `None` where
    /// it is undetermined: nothing was read before contact, and correlated residuals show a misfit that looks like an offset.
    pub load_cell_offset_n: Option<Estimate>,
    /// Overlap as stated at which contact begins, in metres, where that was fitted.
    pub contact_start_m: Option<Estimate>,
    /// Runs of growing or falling overlap in the curve; the first growing one was fitted.
    pub n_runs: usize,
    /// What was lost on the way back, where the curve comes back.
    pub hysteresis: Option<Hysteresis>,
    /// What the data cannot tell apart, a sentence each.
    pub ambiguities: Vec<String>,
}

/// Exponents that the data cannot reject at 95 %: for each the other parameters are fitted anew, and the sum of squares is compared
/// with the least (profile likelihood, noise from the residuals).
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Smallest such p.
    pub low: f64,
    /// Largest such p.
    pub high: f64,
    /// Whether `low` is only the smallest p that is tried, 0.01.
    pub open_below: bool,
    /// Whether `high` is only the largest p that is tried, 5.
    pub open_above: bool,
    /// The best laws of some exponents from `low` to `high`.
    pub laws: Vec<LawOnProfile>,
}

/// The best law of a given exponent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LawOnProfile {
    /// The law.
    pub law: PowerLaw,
    /// Root mean square of its residuals, in newtons.
    pub rms_n: f64,
}

/// Measured force less the law's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Root mean square, in newtons.
    pub rms_n: f64,
    /// Largest amount, in newtons.
    pub largest_n: f64,
    /// Noise of a force that follows, the root mean square over all: the root of the (weighted) sum of squares over the degrees of freedom,
    /// in newtons.
    pub noise_n: f64,
    /// Noise of an overlap, in metres, where forces scatter the more, the steeper the curve is; each then counts by its own noise. `None` where all
    /// may well scatter alike.
    pub overlap_noise_m: Option<f64>,
    /// Correlation of neighbours along the overlap; near 0 for noise.
    pub autocorrelation: f64,
    /// Factor by which sigmas were widened for it; 1 where it is within chance.
    pub widening: f64,
    /// Readings fitted.
    pub n_readings: usize,
    /// Readings less fitted parameters.
    pub degrees_of_freedom: usize,
    /// The reading farthest from the law, where that is farther than the others' errors take one.
    pub outlier: Option<OutlyingReading>,
}

/// A reading that lies farther from the law than the errors of the others take one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutlyingReading {
    /// Its overlap, in metres.
    pub overlap_m: f64,
    /// Its force less the law's, in newtons.
    pub off_n: f64,
    /// The same over the standard deviation of the residuals, as their median tells it.
    pub deviations: f64,
    /// Readings that lie as far out, this one among them.
    pub n_like_it: usize,
}

/// Work on the way in and on the way back, over the overlaps that both cover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hysteresis {
    /// Smallest overlap of both ways, in metres.
    pub from_m: f64,
    /// Largest overlap of both ways, in metres.
    pub to_m: f64,
    /// Work done on the specimen, in joules.
    pub loading_j: f64,
    /// Work that came back, in joules.
    pub unloading_j: f64,
    /// The part that did not come back.
    pub lost_fraction: f64,
}

impl ContactFit {
    /// The estimate of one of [`PARAMETERS`].
    pub fn estimate(&self, name: &str) -> Option<Estimate> {
        let index = PARAMETERS.iter().position(|parameter| *parameter == name)?;
        self.estimates.get(index).copied()
    }
}
