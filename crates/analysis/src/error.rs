//! Why a motion cannot be analysed, or a single value of it cannot be measured.

/// Why a motion cannot be analysed at all. A single value that is lost says so with [`Missing`] instead.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AnalysisError {
    /// A gap needs two bodies.
    #[error("motion: expected at least 2 bodies, found {found}")]
    TooFewBodies {
        /// Bodies in the motion.
        found: usize,
    },
    /// Local polynomials need a few samples.
    #[error("motion: expected at least {expected} sample times, found {found}")]
    TooFewTimes {
        /// Smallest number of times that can be analysed.
        expected: usize,
        /// Times in the motion.
        found: usize,
    },
    /// The sample times do not form one time base.
    #[error(
        "motion: time {index}: expected {expected_s} s (equal spacing), found {found_s} s; resample the motion onto one time base"
    )]
    UnequalTimes {
        /// Index of the first time out of step.
        index: usize,
        /// Time that equal spacing gives there.
        expected_s: f64,
        /// Time found there.
        found_s: f64,
    },
    /// Two arrays of the motion disagree in shape.
    #[error("motion: {what}: expected shape {expected:?} [body, time], found {found:?}")]
    Shape {
        /// The array.
        what: String,
        /// Shape of the displacements.
        expected: (usize, usize),
        /// Shape found.
        found: (usize, usize),
    },
    /// A displacement or an uncertainty is infinite or not a number.
    #[error("motion: body {body}, time index {index}: expected finite numbers and sigma >= 0, found {found}")]
    NotFinite {
        /// Number of the body, from 1.
        body: usize,
        /// Index of the sample.
        index: usize,
        /// The offending number.
        found: f64,
    },
    /// A setting lies outside its range.
    #[error("setting {name}: expected {expected}, found {found}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Its allowed range.
        expected: &'static str,
        /// The value given.
        found: f64,
    },
}

/// Why one value could not be measured although the motion could be analysed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Missing {
    /// No sample, or too few of them where the value lives.
    TooFewSamples,
    /// No compressive pulse stands out of the noise.
    NoPulse,
    /// The pulse has not passed its peak when the record ends, or had passed it when the record began; the same of a hole in the record.
    PeakOutsideRecord,
    /// The top has several humps of nearly one height, and which of them leads hangs on a few per cent of it.
    SeveralHumps,
    /// The gap passed a barrier of the contact's energy, which is greater than where it went.
    BarrierPassed,
    /// What the gap held at rest may be its greatest energy: what came later does not stand above it by more than noise may make it.
    NotAboveRest,
    /// The record ends too soon after the leading pulse for a tail to be seen.
    NoTail,
    /// Too few gaps have the value that is needed.
    TooFewGaps,
    /// Gaps farther down do not peak later, so no pulse runs along them.
    NoProgress,
    /// The peaks do not lie on one line: some are of another pulse, such as the far end's reflection.
    NotOneLine,
    /// The far end reflects, and too few feet of the pulse tell when the reflection comes back.
    ReflectionUntold,
    /// The first crest of a train that stands out is another one farther down.
    OtherCrests,
    /// Something drives the chain throughout, so that nothing rings freely behind the wave.
    StillDriven,
    /// The spectrum has no maximum in the searched band.
    NoMaximum,
    /// The spectrum's maximum is no higher than noise may make it.
    BelowNoise,
    /// The spectrum's maximum is no higher than what lies below the band leaks to it.
    Leaked,
    /// Most noisy replicas of the motion lose the value, so its uncertainty is not known.
    Unstable,
}

impl Missing {
    /// The reason in words, for a report.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::TooFewSamples => "too few samples",
            Self::NoPulse => "no pulse above the noise",
            Self::PeakOutsideRecord => "peak outside the record, or where a body was not seen",
            Self::SeveralHumps => "a flat top of several humps",
            Self::BarrierPassed => "greatest energy is the contact's own barrier, which was passed",
            Self::NotAboveRest => "no greater energy than at rest stands out of the noise",
            Self::NoTail => "record ends with the leading pulse",
            Self::TooFewGaps => "too few gaps",
            Self::NoProgress => "no pulse that runs down the chain",
            Self::NotOneLine => {
                "peaks do not lie on one line: some are of another pulse, such as a reflection"
            }
            Self::ReflectionUntold => "too few gaps show when the far end's reflection comes back",
            Self::OtherCrests => "not the same crest in all gaps",
            Self::StillDriven => "the chain is driven throughout",
            Self::NoMaximum => "no spectral maximum",
            Self::BelowNoise => "no frequency stands out of the noise",
            Self::Leaked => "tail too short: what it holds below the searched band leaks as much",
            Self::Unstable => "lost in most noisy replicas",
        }
    }
}
