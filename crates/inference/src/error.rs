//! Why a fit to motions or tracks fails.

use chainwave_analysis::AnalysisError;
use chainwave_mechanics::MechanicsError;

use crate::least_squares::Failure;

/// Why damping could not be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The chain model has no striker.
    #[error(
        "damping fit: expected a chain driven by a striker, found another drive (c_s acts in the striker's contact alone)"
    )]
    NoStriker,
    /// More than the motion of body 1 drives the chain.
    #[error("damping fit: expected a chain that nothing drives but the motion of body 1, found {found}")]
    DrivenElsewhere {
        /// What else drives it.
        found: &'static str,
    },
    /// Nobody asks for it.
    #[error("not asked for (analysis.fits = false)")]
    NotAsked,
    /// No striker drives the chain.
    #[error("damping fit: expected a chain that a striker drives, whose contact c_s damps, found {found}")]
    DrivenOtherwise {
        /// What drives it.
        found: &'static str,
    },
    /// Nothing moves.
    #[error(
        "damping fit: expected a body that leaves its place by {expected} times its uncertainty, found none (hint: do the recordings show the wave?)"
    )]
    NothingMoves {
        /// How far one must move.
        expected: f64,
    },
    /// The chain is let go, so that more than its first body moves it.
    #[error(
        "damping fit: expected a chain at rest until body 1 moves, found one that is let go, which the fit to the release takes"
    )]
    LetGo,
    /// Not enough was measured.
    #[error("damping fit: expected at least {expected} measured {what}, found {found}")]
    TooFew {
        /// What is counted.
        what: &'static str,
        /// The least number.
        expected: usize,
        /// The number measured.
        found: usize,
    },
    /// A stated error is zero, or the errors contradict each other.
    #[error("damping fit: expected positive uncertainties of the {what}, found a singular covariance")]
    SingularCovariance {
        /// What is compared.
        what: &'static str,
    },
    /// Steps of the search promised less than what would make its result matter.
    #[error(
        "damping fit: given up after {rounds} rounds, whose steps promised nothing that would change the result"
    )]
    GivenUp {
        /// Rounds gone.
        rounds: usize,
    },
    /// The search did not end at a minimum.
    #[error("damping fit: no minimum found: {rounds} rounds did not settle")]
    NotConverged {
        /// Rounds gone.
        rounds: usize,
    },
    /// What is compared depends on too few of the unknowns.
    #[error(
        "damping fit: expected {what} to determine every unknown, found that {unknowns} are not determined"
    )]
    Undetermined {
        /// What is compared.
        what: &'static str,
        /// The unknowns that it leaves open.
        unknowns: String,
    },
    /// The chain model refused the trial values.
    #[error("damping fit: {0}")]
    Model(#[from] MechanicsError),
    /// The model's motion cannot be analysed as the measured one was.
    #[error("damping fit: {0}")]
    Analysis(#[from] AnalysisError),
}

impl FitError {
    /// A search's failure, with the names of what was sought (for none: a recording's striker and impact) and of what was compared.
    pub(crate) fn of(failure: Failure<Self>, what: &'static str, name: impl Fn(usize) -> String) -> Self {
        match failure {
            Failure::Problem(error) => error,
            Failure::Unsettled { rounds } => Self::NotConverged { rounds },
            Failure::GivenUp { rounds } => Self::GivenUp { rounds },
            Failure::Undetermined(unknowns) if unknowns.is_empty() => {
                Self::Undetermined { what, unknowns: "the striker and the impact of a recording".into() }
            }
            Failure::Undetermined(unknowns) => {
                let names: Vec<String> = unknowns.into_iter().map(name).collect();
                Self::Undetermined { what, unknowns: names.join(", ") }
            }
        }
    }
}
